"""Tracks of swaying tops ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from levilab.pipelines.document import Document, result_model, values_of
from levilab.pipelines.row import find_all
from levilab.pipelines.sway.analysis import METHOD, SwayRun
from levilab.pipelines.sway.budget import budget_of_run
from levilab.pipelines.sway.quantities import QUANTITIES

if TYPE_CHECKING:
    from levilab.pipelines.sway.analysis import SwayAnalysis


def _entries(analysis: SwayAnalysis) -> dict[str, Any]:
    alone = _run_entries(analysis.runs[0]) if len(analysis.runs) == 1 else {"values": {}, "models": []}
    return alone | {"text": analysis.text}


def _run_entries(run: SwayRun) -> dict[str, Any]:
    found = run.geometry
    values = values_of(find_all(QUANTITIES, found))
    freedom = len(found.shares) - 1
    model = {
        "name": "geometric magnetism",
        "parameters": {"geometric_magnetism": values["geometric_magnetism"]},
        "covariance": [[(found.measured.u or 0.0) ** 2]],
        "statistics": {"n": freedom + 1, "reduced_chi_square": found.chi_square / freedom if freedom else None},
    }
    return {"values": values, "models": [model]}


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run),
    result=result_model(METHOD, SwayRun),
    entries=_entries,
    run_entries=_run_entries,
)
