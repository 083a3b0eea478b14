"""Sweeps ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.precession.sweep import SweepFit
from levilab.pipelines.document import Document, number, result_model, values_of
from levilab.pipelines.precession.analysis import METHOD, PrecessionAnalysis, PrecessionRun
from levilab.pipelines.precession.budget import budget_of_all, budget_of_run
from levilab.pipelines.precession.quantities import QUANTITIES
from levilab.pipelines.precession.words import intercept_of, slope_of, verdict
from levilab.pipelines.row import find_all

if TYPE_CHECKING:
    from analysis.precession.line import Line


def _entries(analysis: PrecessionAnalysis) -> dict[str, Any]:
    return _about(analysis.combined)


def _run_entries(run: PrecessionRun) -> dict[str, Any]:
    return _about(run.fit)


def _about(fit: SweepFit) -> dict[str, Any]:
    return {
        "values": values_of(find_all(QUANTITIES, fit)),
        "models": [_line(fit), _robust(fit)],
        "verdict": verdict(fit),
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
    """Return the statistics of a line.  line: None for the median line, which goes through all points."""
    if line:
        residual = residual[[point.used for point in fit.points]]
    chi_square = line.chi_square if line else None
    return {
        "n": residual.size,
        "degrees_of_freedom": residual.size - 2,
        "freedom_of_u": line.freedom if line else None,
        "rms_residual": float(np.sqrt(np.mean(residual**2))),
        "reduced_chi_square": None if line is None or chi_square is None else chi_square / line.degrees_of_freedom,
        "p_fit": line.p_fit if line else None,
    }


def _covariance(u: float | None, v: float | None, correlation: float | None) -> list[list[float]] | None:
    if u is None or v is None or correlation is None:
        return None
    return [[u * u, correlation * u * v], [correlation * u * v, v * v]]


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run, budget_of_all=budget_of_all),
    result=result_model(METHOD, PrecessionRun, SweepFit),
    entries=_entries,
    run_entries=_run_entries,
)
