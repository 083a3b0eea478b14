"""Spin frequencies ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from levilab.pipelines.document import Document, result_model, values_of
from levilab.pipelines.row import find_all
from levilab.pipelines.spin.analysis import METHOD, SpinAnalysis, SpinRun
from levilab.pipelines.spin.budget import budget_of_run
from levilab.pipelines.spin.quantities import OF_A_RUN, QUANTITIES


def _entries(analysis: SpinAnalysis) -> dict[str, Any]:
    return _run_entries(analysis.runs[0]) if len(analysis.runs) == 1 else {"values": {}, "method": None}


def _run_entries(run: SpinRun) -> dict[str, Any]:
    found = find_all(QUANTITIES, run.spin) | find_all(OF_A_RUN, run)
    return {"values": values_of(found), "method": run.spin.method}


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run),
    result=result_model(METHOD, SpinRun),
    entries=_entries,
    run_entries=_run_entries,
)
