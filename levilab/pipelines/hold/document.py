"""Held spins → uncertainty budgets and result.json."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from analysis.budget import Budget
from analysis.held import Hold
from levilab.pipelines.budget import direct_row
from levilab.pipelines.document import Analysis, number, statistics_of, values_of
from levilab.pipelines.hold.analysis import (
    HOLD_ROW,
    QUANTITIES,
    HeldTogether,
    HoldAnalysis,
    combine,
    fit_source,
    set_spindown_beside,
    text_of,
)
from levilab.pipelines.hold.readings import HoldReadings, read_hold_file, read_hold_run
from levilab.pipelines.hold.report import hold_columns, hold_part, hold_tables
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import HoldOptions
from levilab.pipelines.row import find_all, symbols_of

#: Name of a part → its description, where it comes from, what would make it smaller.
_ROWS = {
    "gain": ("gain at the full amplitude", "scatter of the counts about their lines", "more measurements of the gain"),
    "drift": ("change of the spin meanwhile", "u of the first and of the last reading", "a longer hold"),
    "exponent": ("gain seen beside the held spin", "an exponent of the drag of 1.5(3)", "counts evenly about the spin"),
    "lean": ("pull there", "a top that leans, or is upright", "counts evenly about the spin"),
}


def budget_of_run(_: Source[HoldReadings], run: Hold, __: HoldOptions) -> tuple[Budget, ...]:
    """Return the budget of one held spin; none without a drag."""
    if run.drag is None or run.drag.value is None or run.drag.u is None:
        return ()
    rows = [direct_row(name, what, run.parts[name], "Hz/s", note, remedy, "A" if name in {"gain", "drift"} else "B")
            for name, (what, note, remedy) in _ROWS.items()]  # fmt: skip
    return (Budget("drag", run.drag.value, run.drag.u, "Hz/s", tuple(rows)),)


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
    if len(analysis.runs) == 1:
        values = values_of(find_all(QUANTITIES, analysis.runs[0]))
    elif found.best:
        values = values_of(found.best.constants)
    else:
        values = values_of({"drag": found.drag} if found.laws else {})
    pulls = {
        f"{name}_pull": number(found.beside[law.name][1], "1")
        for law in found.laws if law.name in found.beside for name in law.constants
    }  # fmt: skip
    best = {"best_model": found.best.name} if found.best else {}
    return {"values": values | pulls, "models": models, "verdict": analysis.text} | best


def _run_entries(run: Hold) -> dict[str, Any]:
    return {"values": values_of(find_all(QUANTITIES, run)), "models": [], "verdict": text_of(run)}


def _apart(analysis: HoldAnalysis) -> str:
    return "" if analysis.at_one_spin else "the groups held different spins, and the drag rises with the spin"


def _renumber(found: HeldTogether, order: Sequence[int]) -> HeldTogether:
    return replace(found, factors=tuple(found.factors[k] for k in order))


HOLD = Analysis(
    name="hold",
    experiments=frozenset({"hold"}),
    read_file=read_hold_file,
    read_run=read_hold_run,
    kind=HoldAnalysis,
    options=HoldOptions,
    fit=fit_source,
    combine=combine,
    mixed="a drag law through both says nothing about a real top",
    skips=True,
    set_beside=set_spindown_beside,
    budget_of_run=budget_of_run,
    finding=Hold,
    combination=HeldTogether,
    entries=_entries,
    run_entries=_run_entries,
    renumber=_renumber,
    tables=hold_tables,
    part=hold_part,
    columns=hold_columns,
    row=HOLD_ROW,
    symbols=symbols_of(QUANTITIES),
    compared=("drag",),
    apart=_apart,
)
