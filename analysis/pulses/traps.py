"""Traps: half and double the frequency, and the mains."""

import numpy as np

from analysis.arrays import Array
from analysis.pulses.clean import MAINS
from analysis.pulses.matched import COARSE, Match
from analysis.pulses.result import Finding
from analysis.uncertainty import Estimate, student

#: Every second pulse differs where the means of both halves are this number of standard errors apart (with few pulses
#: the quantile of Student's t of the same probability) ...
CERTAIN = 6.0
#: ... and by more than this part of the height, or of a turn.
HIGHER, ASIDE = 0.1, 2e-3
#: Two pulses of a turn are equal where the turn resembles itself half a turn later like this.
EQUAL = 0.7
#: Every second pulse lies elsewhere where the profiles of even and odd turns are less alike than this,
ALIKE = 0.5
#: smoothed over this number of places, for pulses that scatter about theirs,
BLUR = 7
#: and one of them is higher than this multiple of its noise.
STANDS_OUT = 8.0
#: The frequency is that of the mains where it is so near to a multiple and changes so little, as parts of it [1, 1/s].
NEAR, STEADY = 2e-3, 3e-4


def repeats(found: Match) -> bool:
    """Return whether a turn has two nearly equal pulses, half a turn apart."""
    if found.window.half < 0.5:
        return False
    shape = found.pulse.shape - found.pulse.shape.mean()
    return float(shape @ np.roll(shape, shape.size // 2)) > EQUAL * float(shape @ shape)


def alternates(found: Match) -> str:
    """Return by what every second pulse differs from the others, "height" or "place"; empty if it does not.

    Turns of 167½ samples have flanks that lie on either side of a sample by turns: that is no second mark.
    """
    odd = found.numbers % 2 == 1
    for values, least, what in ((found.heights, HIGHER, "height"), (found.shifts, max(ASIDE, found.grid), "place")):
        a, b = values[odd & found.used], values[~odd & found.used]
        if min(a.size, b.size) < 8:
            return ""
        apart = abs(float(a.mean() - b.mean()))
        error = float(np.sqrt(a.var() / a.size + b.var() / b.size))
        if apart > max(student(a.size + b.size - 2, CERTAIN) * error, least):
            return what
    return ""


def displaces(bins: Array, phase: Array) -> str:
    """Return "place" if every second pulse lies at another one, too far for `alternates`; else nothing.

    bins: of the trace, and their phases [turns], shape (n,).
    """
    place = ((0.5 * phase - np.floor(0.5 * phase)) * 2 * COARSE).astype(np.intp)
    counts = np.maximum(np.bincount(place, minlength=2 * COARSE), 1)
    both = (np.bincount(place, bins, 2 * COARSE) / counts).reshape(2, COARSE)
    both = both - np.median(both)
    away = np.abs(both)
    if phase[-1] - phase[0] < 16 or away.max() < STANDS_OUT * 1.4826 * float(np.median(away)):
        return ""
    around = np.pad(both.ravel(), BLUR // 2, mode="wrap")
    even, odd = np.lib.stride_tricks.sliding_window_view(around, BLUR).sum(axis=1).reshape(2, COARSE)
    alike = float(even @ odd) / float(np.sqrt((even @ even) * (odd @ odd)) + 1e-300)
    return "place" if alike < ALIKE else ""


def mains(frequency: Estimate, chirp: Estimate) -> tuple[Finding, ...]:
    """Return the finding where the frequency is that of the mains or twice that, and stays."""
    assert frequency.value is not None
    assert chirp.value is not None
    for nominal in [multiple * line for line in MAINS for multiple in (0.5, 1, 2)]:
        steady = abs(chirp.value) + (chirp.u or 0.0) < STEADY * nominal
        if steady and abs(frequency.value / nominal - 1) < NEAR:
            return (Finding("mains", values=(nominal,)),)
    return ()
