"""The summary of a store, computed chunk by chunk, so that memory does not grow with the map, and its tables."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.numbers import with_minus
from levilab.files import finite
from levilab.present.tables import Table, table
from levilab.present.units import unit
from levilab.sweeps.axes import in_words
from levilab.sweeps.plan import Plan, unit_of
from levilab.sweeps.quantities import Observable, columns_of
from levilab.sweeps.store import Map, Store
from levilab.texts.text import Text


@dataclass(frozen=True)
class ColumnSummary:
    """One column over all points that are computed.

    Attributes:
        column: which.
        defined: points at which it is a number.
        least, mean, greatest: of these, NaN without any; of a column of yes and no the mean is the share of yes.
    """

    column: Observable
    defined: int
    least: float
    mean: float
    greatest: float


@dataclass(frozen=True)
class Summary:
    """A sweep in numbers.

    Attributes:
        plan: of the sweep.
        points: that are computed, or filled in by an adaptive sweep.
        chunks: that are done.
        columns: one for each column.
    """

    plan: Plan
    points: int
    chunks: int
    columns: tuple[ColumnSummary, ...]


def summarise(store: Store) -> Summary:
    """Return the summary of the points that a store has so far."""
    plan = store.plan
    parts: dict[str, list[tuple[int, float, float, float]]] = {one.name: [] for one in columns_of(plan.observables)}
    points = 0
    for chunk in plan.chunks():
        known = store.known_points(chunk)
        points += int(np.count_nonzero(known))
        for name, values in store.read(chunk).items() if np.any(known) else ():
            numbers = values[known & np.isfinite(values)].astype(np.float64)
            if numbers.size:
                parts[name].append((numbers.size, numbers.min(), float(numbers.sum()), numbers.max()))
    columns = tuple(_join(column, parts[column.name]) for column in columns_of(plan.observables))
    return Summary(plan, points, store.done, columns)


def _join(column: Observable, parts: list[tuple[int, float, float, float]]) -> ColumnSummary:
    if not parts:
        return ColumnSummary(column, 0, math.nan, math.nan, math.nan)
    counts, least, sums, greatest = zip(*parts, strict=True)
    defined = sum(counts)
    return ColumnSummary(column, defined, float(min(least)), math.fsum(sums) / defined, float(max(greatest)))


def as_document(summary: Summary) -> dict[str, Any]:
    """Return the summary as JSON has it; what is not defined is None."""
    plan = summary.plan
    return {
        "schema": "levilab-sweep-summary/1",
        "plan": plan.as_table(),
        "points": plan.size,
        "computed": summary.points,
        "chunks": plan.chunk_count,
        "chunks_done": summary.chunks,
        "values": {
            one.column.name: {
                "unit": one.column.unit,
                "meaning": one.column.meaning,
                "defined": one.defined,
                "least": finite(one.least),
                "mean": finite(one.mean),
                "greatest": finite(one.greatest),
            }
            for one in summary.columns
        },
    }


# --- tables ---

#: Points of a sweep of one dimension that is printed point by point, at most.
FEW_POINTS = 40


def headline(summary: Summary) -> str:
    """Return what was swept, in a line."""
    plan = summary.plan
    return Text(
        "{scene:s}: {size} {points}{done}, each up to {seconds:g} s",
        scene=plan.scene.name or "scene",
        size=" × ".join(map(str, plan.shape)),
        points="points" if plan.size > 1 else "point",
        done="" if summary.points == plan.size else Text(", {n} of them computed", n=summary.points),
        seconds=plan.duration_s,
    )


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
        yes = Text("{yes} of {points}", yes=round(one.mean * one.defined) if one.defined else 0, points=points)
        return (one.column.name, "", f"{100 * one.mean:.1f} %" if points else "", "", yes, meaning)
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
