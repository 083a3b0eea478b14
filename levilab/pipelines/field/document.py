"""Scans of a field ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.errors import AnalysisError
from analysis.field.fit import PARAMETERS, Known, Prior, Statistics, restore_scan
from analysis.field.floating import Floating, KnownTop
from analysis.field.magnet import Disc
from levilab.errors import unquoted
from levilab.formats.device import Device  # noqa: TC001 - pydantic reads it
from levilab.pipelines.document import Document, Settings, value_of, values_of
from levilab.pipelines.field.analysis import METHOD, FieldAnalysis, FieldRun, Mean
from levilab.pipelines.field.budget import budget_of_all, budget_of_run
from levilab.pipelines.result import Part, Result, RunPart, Value

if TYPE_CHECKING:
    from analysis.uncertainty import Estimate
    from levilab.pipelines.field.readings import FieldReadings
    from levilab.pipelines.sources import Source

#: What a result has of the top, by the attributes of `KnownTop`.
_OF_TOP = ("transverse", "axial", "moment", "mass", "height")


# --- what is in it -------------------------------------------------------------------------------------


class StatisticsPart(Part):
    """How well the model fits; what does not compete has no criterion and no weight."""

    n: int = Field(ge=1)
    rms_residual: float = Field(ge=0)
    reduced_chi_square: float | None = Field(ge=0)
    aicc: None = None
    bic: None = None
    weight: None = None
    durbin_watson: float | None
    runs_test_p: float | None


class PriorPart(Part):
    """What was known before."""

    value: float
    u: float = Field(ge=0)


class FitPart(Part):
    """What it takes to draw the fit."""

    n_parameters: int = Field(ge=0)
    chi_square: float | None = Field(ge=0)
    degrees_of_freedom: int
    fitted: tuple[str, ...]
    known: dict[str, PriorPart]
    gain_u: float = Field(ge=0)


class ModelPart(Part):
    """The ring as fitted."""

    name: Literal["ring"]
    parameters: dict[str, Value]
    covariance: tuple[tuple[float, ...], ...]
    statistics: StatisticsPart
    fit: FitPart
    warnings: tuple[str, ...]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if set(self.parameters) != set(PARAMETERS) or any(one.value is None for one in self.parameters.values()):
            raise ValueError(f"the parameters {', '.join(PARAMETERS)} are expected, each with a value")
        if [len(line) for line in self.covariance] != [len(PARAMETERS)] * len(PARAMETERS):
            raise ValueError(f"the covariance is not {len(PARAMETERS)} × {len(PARAMETERS)}")
        if not {"inner_radius", "outer_radius"} <= set(self.fit.known):
            raise ValueError("the fit lacks what was known of the radii")
        return self


class TopPart(Part):
    """Of which top the windows are."""

    values: dict[str, Value]
    gravity_m_s2: float = Field(gt=0)
    magnet_radius_m: float | None = Field(gt=0)
    magnet_height_m: float | None = Field(ge=0)
    covariance: tuple[tuple[float, ...], ...] | None

    @model_validator(mode="after")
    def _has_inertias(self) -> Self:
        if not {"transverse", "axial"} <= set(self.values):
            raise ValueError("the top lacks its inertias")
        return self


class ScanPart(RunPart):
    """One scan."""

    models: tuple[ModelPart]
    top: TopPart
    floats: bool
    text: str


class SettingsPart(Settings):
    """How the scans were analyzed."""

    device: Device | None
    height_m: float | None
    height_u_m: float | None
    free_radii: bool


class FieldResult(Result):
    """result.json of scans."""

    analysis: Literal["field"] = "field"
    settings: SettingsPart
    runs: tuple[ScanPart, ...]
    models: tuple[ModelPart, ...]
    text: str


# --- writing -------------------------------------------------------------------------------------------


def _entries(analysis: FieldAnalysis) -> dict[str, Any]:
    return {
        "values": {name: _value(estimate) for name, estimate in analysis.values.items()},
        # of several scans there is no fit together: the scan's own stand with each
        "models": [_model(analysis.runs[0])] if len(analysis.runs) == 1 else [],
        "text": analysis.text,
    }


def _value(estimate: Estimate) -> dict[str, Any]:
    scatter = {"scatter": estimate.scatter, "runs": estimate.runs} if isinstance(estimate, Mean) else {}
    return value_of(estimate) | scatter


def _run_entries(_: Source[FieldReadings], run: FieldRun) -> dict[str, Any]:
    return {
        "values": values_of(run.values),
        "models": [_model(run)],
        "top": _top(run.top),
        "floats": run.floating is not None,
        "text": run.text,
        "warnings": run.warnings,
    }


def _model(run: FieldRun) -> dict[str, Any]:
    scan, statistics = run.scan, run.scan.statistics
    known = {name: prior for name in PARAMETERS if (prior := scan.known.prior(name))}
    return {
        "name": "ring",
        "parameters": values_of(scan.parameters),
        "covariance": scan.covariance.tolist(),
        "statistics": {
            name: getattr(statistics, name) for name in StatisticsPart.model_fields if hasattr(statistics, name)
        },
        "fit": {
            "n_parameters": statistics.n_parameters,
            "chi_square": statistics.chi_square,
            "degrees_of_freedom": statistics.degrees_of_freedom,
            "fitted": list(scan.fitted),
            "known": {name: {"value": prior.value, "u": prior.u} for name, prior in known.items()},
            "gain_u": scan.known.gain_u,
        },
        "warnings": [unquoted(text) for text in scan.warnings],
    }


def _top(top: KnownTop) -> dict[str, Any]:
    known = {name: estimate for name in _OF_TOP if (estimate := getattr(top, name)) is not None}
    return {
        "values": values_of(known),
        "gravity_m_s2": top.gravity,
        "magnet_radius_m": top.magnet.radius if top.magnet else None,
        "magnet_height_m": top.magnet.height if top.magnet else None,
        "covariance": None if top.covariance is None else top.covariance.tolist(),
    }


# --- reading -------------------------------------------------------------------------------------------


def _run(part: ScanPart, source: Source[FieldReadings], _: object) -> FieldRun:
    """One scan.  Raises ValueError where the readings belie it."""
    readings, model = source.readings, part.models[0]
    try:
        scan = restore_scan(
            readings.height,
            readings.flux_density,
            _known(model.fit),
            readings.u,
            0.0 if readings.height_u is None else readings.height_u,
            fitted=model.fit.fitted,
            parameters={name: model.parameters[name].estimate for name in PARAMETERS},
            covariance=np.array(model.covariance),
            statistics=_statistics(model),
            warnings=model.warnings,
        )
    except AnalysisError as error:
        raise ValueError(f"does not go with {source.data}: {error}") from error
    if not (np.isfinite(scan.residuals).all() and np.isfinite(scan.u).all() and (scan.u > 0).all()):
        raise ValueError(f"its fit leaves the range of numbers at the readings of {source.data}")
    values = {name: value.estimate for name, value in part.values.items() if name not in PARAMETERS}
    floating = Floating(values) if part.floats else None
    return FieldRun(scan, _known_top(part.top), floating, part.text, ())  # the warnings are those of the source


def _known(fit: FitPart) -> Known:
    priors = {name: Prior(part.value, part.u) for name, part in fit.known.items() if name in PARAMETERS}
    return Known(**priors, gain_u=fit.gain_u)


def _statistics(model: ModelPart) -> Statistics:
    return Statistics(
        model.statistics.n,
        model.fit.n_parameters,
        model.statistics.rms_residual,
        model.fit.chi_square,
        model.fit.degrees_of_freedom,
        model.statistics.durbin_watson,
        model.statistics.runs_test_p,
    )


def _known_top(part: TopPart) -> KnownTop:
    known = {name: value.estimate for name, value in part.values.items() if name in _OF_TOP}
    magnet = Disc(part.magnet_radius_m, part.magnet_height_m or 0.0) if part.magnet_radius_m else None
    covariance = None if part.covariance is None else np.array(part.covariance)
    return KnownTop(
        known["transverse"], known["axial"], known.get("moment"), known.get("mass"), known.get("height"),
        part.gravity_m_s2, covariance, magnet,
    )  # fmt: skip


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run, budget_of_all=budget_of_all),
    result=FieldResult,
    entries=_entries,
    run_entries=_run_entries,
    run=_run,
)
