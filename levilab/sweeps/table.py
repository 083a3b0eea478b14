"""The tables that a sweep prints: its axes, each column in numbers, and the points where they are few."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from analysis.numbers import with_minus
from levilab.present.tables import Table, table
from levilab.present.units import unit
from levilab.sweeps.axes import in_words
from levilab.sweeps.plan import unit_of

if TYPE_CHECKING:
    from levilab.sweeps.store import Map
    from levilab.sweeps.summary import ColumnSummary, Summary

#: A sweep of one dimension with at most so many points is printed point by point.
FEW_POINTS = 40


def headline(summary: Summary) -> str:
    """Return what was swept, in a line."""
    plan = summary.plan
    size = f"{' × '.join(map(str, plan.shape))} point{'s' if plan.size > 1 else ''}"
    done = "" if summary.points == plan.size else f", {summary.points} of them computed"
    return f"{plan.scene.name or 'the scene'}: {size}{done}, each up to {plan.duration_s:g} s"


def axes_lines(summary: Summary) -> list[str]:
    """Return a line for each axis."""
    return [in_words(axis) for axis in summary.plan.axes]


def columns_table(summary: Summary) -> Table:
    """Return each column's numbers over all points."""
    rows = [_row(one, summary.points) for one in summary.columns]
    heads = ("", "least", "mean", "greatest", "points", "meaning")
    return table("", heads, rows, numbers=heads[1:5])


def _row(one: ColumnSummary, points: int) -> tuple[str, ...]:
    meaning = one.column.meaning
    if one.column.dtype == "bool":
        yes = round(one.mean * one.defined) if one.defined else 0
        return (one.column.name, "", f"{100 * one.mean:.1f} %" if points else "", "", f"{yes} of {points}", meaning)
    numbers = (_number(value) for value in (one.least, one.mean, one.greatest))
    return (one.column.name, *numbers, str(one.defined), meaning)


def _number(value: Any) -> str:
    if isinstance(value, str):
        return value
    return with_minus(f"{value:.5g}") if math.isfinite(value) else "—"


def points_table(found: Map) -> Table:
    """Return the computed points of a sweep of one dimension, a row each."""
    axes, columns = found.plan.axes, list(found.values)
    heads = [_head(axis.key) for axis in axes] + columns
    rows = []
    for k in range(found.plan.size):
        if found.computed[k]:
            cells = [_number(axis.values[k].item()) for axis in axes]
            rows.append(cells + [_cell(found.values[name][k].item()) for name in columns])
    return table("", heads, rows, numbers=heads)


def _cell(value: Any) -> str:
    return ("yes" if value else "no") if isinstance(value, bool) else _number(value)


def _head(key: str) -> str:
    text = unit(unit_of(key)).text
    return f"{key} [{text}]" if text else key
