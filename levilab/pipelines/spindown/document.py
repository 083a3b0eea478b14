"""Spin-downs ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.spindown.combine import Combined
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown
from levilab.pipelines.document import Document, number, result_model, statistics_of, value_of, values_of
from levilab.pipelines.row import find_all
from levilab.pipelines.spindown.analysis import METHOD, SpinDownAnalysis
from levilab.pipelines.spindown.budget import budget_of_all, budget_of_run
from levilab.pipelines.spindown.meaning import answer
from levilab.pipelines.spindown.quantities import CORRELATION, QUANTITIES
from levilab.pipelines.spindown.words import remark, verdict_of_run

if TYPE_CHECKING:
    from collections.abc import Mapping

    from analysis.spindown.combine import CombinedLaw, Mean
    from analysis.spindown.verdict import Verdict


def _entries(analysis: SpinDownAnalysis) -> dict[str, Any]:
    combined = analysis.combined
    several = len(analysis.runs) > 1
    return {
        "text": f"{answer(analysis)} {analysis.text}".lstrip(),
        "values": _combined_values(combined),
        "models": [_combined_model(fit) for fit in combined.fits] if several else _models(analysis.runs[0]),
    } | _verdict(combined.best, combined.verdict, analysis.text)


def _run_entries(run: SpinDown) -> dict[str, Any]:
    values = values_of(run.fit(run.best).parameters | find_all(QUANTITIES, run))
    return {"values": values, "models": _models(run)} | _verdict(run.best, run.verdict, verdict_of_run(run))


def _verdict(best: str, verdict: Verdict, text: str) -> dict[str, Any]:
    return {
        "best_model": best, "verdict": text, "decided": verdict.decided, "describes": verdict.describes,
    }  # fmt: skip


def _combined_values(combined: Combined) -> dict[str, Any]:
    """Return the constants of the favoured law, and their scatter from run to run."""
    best = combined.fit(combined.best)
    scatter = {
        f"{name}_scatter": number(mean.scatter, mean.unit) | {"runs": mean.degrees_of_freedom + 1}
        for name, mean in best.constants.items()
        if mean.scatter is not None
    }
    tilt = {"moment_tilt": _mean_value(combined.tilt)} if combined.tilt else {}
    return _means(best.constants) | scatter | tilt | values_of(find_all([CORRELATION], combined))


def _combined_model(fit: CombinedLaw) -> dict[str, Any]:
    """Return a law over several runs."""
    return {
        "name": fit.name,
        "parameters": _means(fit.constants),
        "covariance": None,
        "scatter": {name: mean.scatter for name, mean in fit.constants.items()},
        "statistics": statistics_of(fit.statistics),
        "warnings": [remark(each) for each in fit.remarks],
    } | ({"linearised": _means(fit.linearised)} if fit.linearised else {})


def _models(run: SpinDown) -> list[dict[str, Any]]:
    """Return the laws fitted to one run."""
    return [
        {
            "name": fit.name,
            "parameters": values_of(fit.parameters),
            "covariance": None if fit.covariance is None else fit.covariance.tolist(),
            "statistics": statistics_of(fit.statistics),
            "warnings": [remark(each) for each in fit.remarks],
        }
        | ({"linearised": values_of(fit.linearised)} if fit.linearised else {})
        for fit in run.fits
    ]


def _means(means: Mapping[str, Mean]) -> dict[str, Any]:
    return {name: _mean_value(mean) for name, mean in means.items()}


def _mean_value(mean: Mean) -> dict[str, Any]:
    scatter = {} if mean.scatter is None else {"scatter": mean.scatter, "runs": mean.degrees_of_freedom + 1}
    return value_of(mean) | scatter


def _check(run: SpinDown) -> None:
    """Raise ValueError where the curves of a run cannot be drawn."""
    for fit in run.fits:
        try:
            with np.errstate(all="ignore"):
                drawn = fit.spin_frequency(run.time)
        except (IndexError, ValueError) as error:
            raise ValueError(f"the solution of {fit.name} is of another law") from error
        if drawn.shape != fit.residuals.shape or not np.isfinite(drawn).all():
            raise ValueError(f"the curve of {fit.name} is not one of its readings")


def _check_models(run: SpinDown) -> str:
    unknown = [fit.name for fit in run.fits if fit.name not in LAWS]
    return f"its result has a drag law that this version lacks, {unknown[0]}" if unknown else ""


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run, budget_of_all=budget_of_all),
    result=result_model(METHOD, SpinDown, Combined),
    entries=_entries,
    run_entries=_run_entries,
    check=_check,
    outdated=_check_models,
)
