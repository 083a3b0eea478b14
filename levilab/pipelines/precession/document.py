"""Sweeps ↔ result.json."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from analysis.precession.coherence import Coherence  # noqa: TC001 - pydantic reads the types when it runs
from analysis.precession.sweep import SweepFit  # noqa: TC001 - as above
from levilab.errors import unquoted
from levilab.pipelines.document import Document, Settings, number, values_of
from levilab.pipelines.precession.analysis import (
    METHOD,
    PointCoherence,
    PrecessionAnalysis,
    PrecessionRun,
    intercept_of,
    slope_of,
    verdict,
)
from levilab.pipelines.precession.budget import budget_of_all, budget_of_run
from levilab.pipelines.precession.quantities import QUANTITIES
from levilab.pipelines.result import Part, Result, RunPart, Value
from levilab.pipelines.row import find_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    from analysis.precession.line import Line
    from levilab.pipelines.precession.readings import Readings
    from levilab.pipelines.sources import Source

# --- what is in it -------------------------------------------------------------------------------------


class StatisticsPart(Part):
    """How well a line fits."""

    n: int = Field(ge=3)
    rms_residual: float = Field(ge=0)
    reduced_chi_square: float | None = Field(ge=0)
    p_fit: float | None = Field(ge=0, le=1)


class CentredPart(Part):
    """A line about the weighted mean of ν_d, where slope and height are uncorrelated."""

    centre: Value
    height: Value
    covariance: tuple[tuple[float | None, ...], ...] | None


class ModelPart(Part):
    """A line.

    Attributes:
        covariance: of slope and intercept.
    """

    name: Literal["weighted", "orthogonal", "robust"]
    parameters: dict[str, Value]
    covariance: tuple[tuple[float | None, ...], ...] | None
    centred: CentredPart | None
    statistics: StatisticsPart


class _WithLine(Part):
    """What stands at the top of a result and with each of its runs.  fit: all of it, as the analysis made it."""

    models: tuple[ModelPart, ...]
    verdict: str
    fit: SweepFit | None


class CoherencePart(Part):
    """How firmly the laser's pulses follow the drive at a point."""

    point: int = Field(ge=0)
    coherence: Coherence


class PrecessionPart(RunPart, _WithLine):
    """One sweep."""

    fit: SweepFit
    coherences: tuple[CoherencePart, ...]
    record_warnings: tuple[str, ...]


class SettingsPart(Settings):
    """How the points were analyzed."""

    reading_u: float | None = Field(gt=0, alias="reading_u_hz")
    orthogonal: bool
    keep_outliers: bool
    clock_u: float | None = Field(default=None, gt=0)


class PrecessionResult(Result, _WithLine):
    """result.json of sweeps.  fit: None for one input, it is then that run's."""

    analysis: Literal["precession"] = "precession"
    settings: SettingsPart
    runs: tuple[PrecessionPart, ...]


# --- writing -------------------------------------------------------------------------------------------


def _entries(analysis: PrecessionAnalysis) -> dict[str, Any]:
    return _about(analysis.combined) | ({} if len(analysis.runs) > 1 else {"fit": None})


def _run_entries(_: Source[Readings], run: PrecessionRun) -> dict[str, Any]:
    return {
        "coherences": [asdict(one) for one in run.coherences],
        "record_warnings": [unquoted(text) for text in run.warnings],
        "warnings": (*run.fit.warnings, *run.warnings),
    } | _about(run.fit)


def _about(fit: SweepFit) -> dict[str, Any]:
    """What a fit says, for people and programs; then all of it."""
    return {
        "values": values_of(find_all(QUANTITIES, fit)),
        "models": [_line(fit), _robust(fit)],
        "verdict": verdict(fit),
        "fit": asdict(fit),
    }


def _line(fit: SweepFit) -> dict[str, Any]:
    line = fit.line
    return {
        "name": "orthogonal" if line.orthogonal else "weighted",
        "parameters": values_of({"slope": slope_of(fit), "intercept": intercept_of(fit)}),
        "covariance": _covariance(line.u_slope, line.u_intercept, line.correlation),
        "centred": {
            "centre": number(line.centre, "Hz"),
            "height": number(line.height, "Hz", line.u_height),
            "covariance": _covariance(line.u_slope, line.u_height, 0.0),
        },
        "statistics": _statistics(fit, fit.column("residual"), line),
    }


def _robust(fit: SweepFit) -> dict[str, Any]:
    slope, intercept = fit.robust.slope, fit.robust.intercept
    left = fit.column("precession") - float(intercept.value or 0.0) - float(slope.value or 0.0) * fit.column("drive")
    return {
        "name": "robust",
        "parameters": values_of({"slope": slope, "intercept": intercept}),
        "covariance": None,
        "centred": None,
        "statistics": _statistics(fit, left, None),
    }


def _statistics(fit: SweepFit, residual: np.ndarray, line: Line | None) -> dict[str, Any]:
    """line: None for the median line, which goes through all points."""
    if line:
        residual = residual[[point.used for point in fit.points]]
    chi_square = line.chi_square if line else None
    return {
        "n": residual.size,
        "rms_residual": float(np.sqrt(np.mean(residual**2))),
        "reduced_chi_square": None if line is None or chi_square is None else chi_square / line.degrees_of_freedom,
        "p_fit": line.p_fit if line else None,
    }


def _covariance(u: float | None, v: float | None, correlation: float | None) -> list[list[float]] | None:
    if u is None or v is None or correlation is None:
        return None
    return [[u * u, correlation * u * v], [correlation * u * v, v * v]]


# --- reading -------------------------------------------------------------------------------------------


def _combined(result: PrecessionResult, runs: Sequence[PrecessionRun], _: object) -> SweepFit:
    """The fit of all points together.  Raises ValueError where the result lacks it."""
    if result.fit is None and len(runs) > 1:
        raise ValueError("lacks the fit of all points together")
    return result.fit or runs[0].fit


def _run(part: PrecessionPart, source: Source[Readings], _: object) -> PrecessionRun:
    """One run as it was found.  Raises ValueError where it is not of these points."""
    seen = (part.fit.column("drive"), part.fit.column("precession"))
    if not all(
        len(a) == len(b) and np.allclose(a, b, rtol=1e-9, atol=0)
        for a, b in zip(seen, (source.readings.drive, source.readings.precession), strict=True)
    ):
        raise ValueError(f"its points are not those of {source.data}")
    coherences = tuple(PointCoherence(one.point, one.coherence) for one in part.coherences)
    return PrecessionRun(part.fit, coherences, part.record_warnings)


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run, budget_of_all=budget_of_all),
    result=PrecessionResult,
    entries=_entries,
    run_entries=_run_entries,
    run=_run,
    combined=_combined,
)
