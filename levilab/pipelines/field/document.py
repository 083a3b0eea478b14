"""Scans of a field ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from levilab.pipelines.document import Document, result_model, statistics_of, value_of, values_of
from levilab.pipelines.field.analysis import METHOD, FieldAnalysis, FieldRun, Mean
from levilab.pipelines.field.budget import budget_of_all, budget_of_run
from levilab.pipelines.field.words import remark

if TYPE_CHECKING:
    from analysis.uncertainty import Estimate


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


def _run_entries(run: FieldRun) -> dict[str, Any]:
    return {"values": values_of(run.values), "models": [_model(run)]}


def _model(run: FieldRun) -> dict[str, Any]:
    return {
        "name": "ring",
        "parameters": values_of(run.scan.parameters),
        "covariance": run.scan.covariance.tolist(),
        "statistics": statistics_of(run.scan.statistics),
        "warnings": [remark(each) for each in run.scan.remarks],
    }


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run, budget_of_all=budget_of_all),
    result=result_model(METHOD, FieldRun),
    entries=_entries,
    run_entries=_run_entries,
)
