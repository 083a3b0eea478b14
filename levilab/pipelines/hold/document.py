"""Held spins ↔ result.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from analysis.held import Hold
from levilab.pipelines.document import Document, number, result_model, statistics_of, values_of
from levilab.pipelines.hold.analysis import METHOD, HeldTogether, text_of
from levilab.pipelines.hold.budget import budget_of_run
from levilab.pipelines.hold.quantities import QUANTITIES
from levilab.pipelines.row import find_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    from levilab.pipelines.hold.analysis import HoldAnalysis


def _entries(analysis: HoldAnalysis) -> dict[str, Any]:
    found = analysis.combined
    models = [
        {
            "name": law.name,
            "parameters": values_of(law.constants),
            "covariance": None if law.covariance is None else law.covariance.tolist(),
            "statistics": statistics_of(law.statistics),
        }
        for law in found.laws
    ]
    alone = values_of(find_all(QUANTITIES, analysis.runs[0])) if len(analysis.runs) == 1 else {}
    values = values_of(found.best.constants) if found.best else alone
    pulls = {
        f"{name}_pull": number(found.beside[law.name][1], "1")
        for law in found.laws if law.name in found.beside for name in law.constants
    }  # fmt: skip
    best = {"best_model": found.best.name} if found.best else {}
    return {"values": values | pulls, "models": models, "verdict": analysis.text} | best


def _run_entries(run: Hold) -> dict[str, Any]:
    return {"values": values_of(find_all(QUANTITIES, run)), "models": [], "verdict": text_of(run)}


def _renumber(found: HeldTogether, order: Sequence[int]) -> HeldTogether:
    return replace(found, factors=tuple(found.factors[k] for k in order))


DOCUMENT = Document(
    method=replace(METHOD, budget_of_run=budget_of_run),
    result=result_model(METHOD, Hold, HeldTogether),
    entries=_entries,
    run_entries=_run_entries,
    renumber=_renumber,
)
