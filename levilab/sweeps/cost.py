"""Rough cost of a plan, which determines the size of its chunks and no result."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from levilab.sweeps.observables import GROUPS, columns_of
from levilab.sweeps.plan import QUICKLY, chunk_shape

if TYPE_CHECKING:
    from levilab.sweeps.plan import Plan

#: Seconds of motion that one core does in a second, with samples on the way, and with the lines in them.
SAMPLED, WITH_LINES = 1.2e4, 300.0
#: Factors of the time for a field of higher order or the exact one, and for a magnet that is a disc.
HIGHER_FIELD, DISC = 8.0, 400.0
#: Time for each top before its motion begins [s].
OVERHEAD_S = 1e-5


def seconds_per_point(plan: Plan) -> float:
    """Return roughly how long one core takes for a point [s].

    The constants were measured on one core of 2026 with the scenes undriven and driven; the order of
    magnitude is enough.
    """
    columns = columns_of(plan.observables)
    rate = SAMPLED if any(column.needs == "samples" for column in columns) else QUICKLY
    rate /= 1.0 if plan.scene.base.field == "paraxial-2" else HIGHER_FIELD
    rate /= DISC if plan.scene.top.magnet == "disc" else 1.0
    lines = plan.duration_s / WITH_LINES if {column.name for column in columns} & set(GROUPS["lines"]) else 0.0
    return OVERHEAD_S + plan.duration_s / rate + lines


def cut(plan: Plan) -> Plan:
    """Return the plan with chunks that take about `levilab.sweeps.plan.CHUNK_S` each."""
    return replace(plan, chunk=chunk_shape(plan.shape, 1 / seconds_per_point(plan)))
