"""Rough cost of a plan, which determines the size of its chunks and no result."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from levilab.sweeps.observables import GROUPS, columns_of
from levilab.sweeps.plan import QUICKLY, chunk_shape

if TYPE_CHECKING:
    from levilab.sweeps.plan import Plan

#: Seconds of motion that one core does in a second, with samples on the way.
SAMPLED = 4e4
#: Factors of the time: for an estimate of the error, in a field of higher order, in the exact one, for a disc.
ERRORS, HIGHER_FIELD, EXACT_FIELD, DISC = 1.8, 2.5, 8.0, 400.0
#: Time to find the lines of a top [s], and seconds of motion in which they are found in a second.
LINES_S, SEARCHED = 1.2e-3, 5e3
#: Time for each top before its motion begins [s].
OVERHEAD_S = 1e-5


def seconds_per_point(plan: Plan) -> float:
    """Return roughly how long one core takes for a point [s].

    The constants were measured on one busy core of 2026 (CPU time, the better of two, 32 to 512 tops of 3 to 30 s,
    tolerance 1e-6) with the scenes undriven and driven; measured times are within a factor of two of them.
    """
    columns = columns_of(plan.observables)
    needs = {column.needs for column in columns}
    rate = SAMPLED if "samples" in needs else QUICKLY
    rate /= ERRORS if "errors" in needs else 1.0
    rate /= {"paraxial-2": 1.0, "exact": EXACT_FIELD}.get(plan.scene.base.field, HIGHER_FIELD)
    rate /= DISC if plan.scene.top.magnet == "disc" else 1.0
    has_lines = {column.name for column in columns} & set(GROUPS["lines"])
    lines = LINES_S + plan.duration_s / SEARCHED if has_lines else 0.0
    return OVERHEAD_S + plan.duration_s / rate + lines


def cut(plan: Plan) -> Plan:
    """Return the plan with chunks that take about `levilab.sweeps.plan.CHUNK_S` each."""
    return replace(plan, chunk=chunk_shape(plan.shape, 1 / seconds_per_point(plan)))
