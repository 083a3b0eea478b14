"""Traps: half and double the frequency, and the mains."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.pulses.clean import MAINS
from analysis.pulses.result import Finding

if TYPE_CHECKING:
    from analysis.pulses.matched import Match
    from analysis.uncertainty import Estimate

#: Every second pulse differs where the means of both halves are so many standard errors apart ...
CERTAIN = 6.0
#: ... and by so much, in parts of the height, or in turns.
HIGHER, ASIDE = 0.1, 2e-3
#: Two pulses of a turn are equal where the turn resembles itself half a turn later like this.
EQUAL = 0.95
#: The frequency is that of the mains where it is so near to a multiple and changes so little, as parts of it [1, 1/s].
NEAR, STEADY = 2e-3, 3e-4


def repeats(found: Match) -> bool:
    """Whether a turn has two nearly equal pulses, half a turn apart."""
    if found.window.half < 0.5:
        return False
    shape = found.pulse.shape - found.pulse.shape.mean()
    return float(shape @ np.roll(shape, shape.size // 2)) > EQUAL * float(shape @ shape)


def alternates(found: Match) -> str:
    """How every second pulse differs from the others; empty if it does not."""
    odd = found.numbers % 2 == 1
    for values, least, what in (
        (found.heights, HIGHER, "has another height"),
        (found.shifts, ASIDE, "is not half-way between its neighbours"),
    ):
        a, b = values[odd & found.used], values[~odd & found.used]
        if min(a.size, b.size) < 8:
            return ""
        apart = abs(float(a.mean() - b.mean()))
        error = float(np.sqrt(a.var() / a.size + b.var() / b.size))
        if apart > max(CERTAIN * error, least):
            return what
    return ""


def mains(frequency: Estimate, chirp: Estimate) -> tuple[Finding, ...]:
    """What is to be said where the frequency is that of the mains or twice that, and stays."""
    assert frequency.value is not None
    assert chirp.value is not None
    for nominal in [multiple * line for line in MAINS for multiple in (0.5, 1, 2)]:
        steady = abs(chirp.value) + (chirp.u or 0.0) < STEADY * nominal
        if steady and abs(frequency.value / nominal - 1) < NEAR:
            text = (
                f"the frequency is {nominal:g} Hz and stays: is it the mains (a lamp, hum), or a drive locked to them?"
            )
            return (Finding("mains", text),)
    return ()
