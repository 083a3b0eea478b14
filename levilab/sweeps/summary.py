"""The summary of a store, computed chunk by chunk, so that memory does not grow with the map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.sweeps.observables import columns_of

if TYPE_CHECKING:
    from levilab.sweeps.observables import Observable
    from levilab.sweeps.plan import Plan
    from levilab.sweeps.store import Store


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
                "least": _finite(one.least),
                "mean": _finite(one.mean),
                "greatest": _finite(one.greatest),
            }
            for one in summary.columns
        },
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
