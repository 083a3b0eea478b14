"""How long a plan takes, roughly: it decides how the plan is cut, never what comes out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from levilab.sweeps.observables import columns_of
from levilab.sweeps.plan import QUICKLY, chunk_shape

if TYPE_CHECKING:
    from levilab.sweeps.plan import Plan

#: Seconds of motion that one core simulates in a second, top after top: with a drive that has kinks, and with samples.
SINGLY, SAMPLED = 2e4, 3e3
#: So many times longer takes a field of higher order, or the exact one, and a magnet that is a disc.
HIGHER_FIELD, DISC = 8.0, 300.0
#: What a top takes before its motion begins [s].
OVERHEAD_S = 2e-4


def seconds_per_point(plan: Plan) -> float:
    """Return roughly how long one core takes for a point [s].

    Measured on one core of an Epyc in 2026; only the order of magnitude is needed.
    """
    scene, swept = plan.scene, {axis.key for axis in plan.axes}
    kinked = scene.drive.waveform not in {"off", "sine"} or scene.drive.off_s is not None or "drive.waveform" in swept
    rate = SINGLY if kinked else QUICKLY
    if any(column.needs == "samples" for column in columns_of(plan.observables)):
        rate = SAMPLED
    rate /= 1.0 if scene.base.field == "paraxial-2" else HIGHER_FIELD
    rate /= DISC if scene.top.magnet == "disc" else 1.0
    return OVERHEAD_S + plan.duration_s / rate


def cut(plan: Plan) -> Plan:
    """Return the plan with chunks that take about `levilab.sweeps.plan.CHUNK_S` each."""
    return replace(plan, chunk=chunk_shape(plan.shape, 1 / seconds_per_point(plan)))
