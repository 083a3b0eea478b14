"""How long a plan takes, roughly: it decides how the plan is cut, never what comes out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from levilab.sweeps.observables import GROUPS, columns_of
from levilab.sweeps.plan import QUICKLY, chunk_shape

if TYPE_CHECKING:
    from levilab.sweeps.plan import Plan

#: Seconds of motion that one core does in a second, with samples on the way.
SAMPLED = 4e4
#: So many times longer the motion takes with an estimate of its error ...
ERRORS = 1.8
#: ... in a field of higher order, in the exact one, and with a magnet that is a disc.
HIGHER_FIELD, EXACT_FIELD, DISC = 2.5, 8.0, 400.0
#: What finding the lines takes of a top, and so many seconds of motion are searched for them in a second.
LINES_S, SEARCHED = 1.2e-3, 5e3
#: What a top takes before its motion begins [s].
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
