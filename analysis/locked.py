"""A top that a drive holds: does its tape turn as fast as the drive?

While the drive holds the top, the angle between its moment and the drive stays within half a turn, so the mean of the
spin is the drive's frequency, whatever the drag.  A tape that turns slower is not fixed to the moment: the washers that
carry it slip.  Air drags them back with a torque that grows as the power 3/2 of the spin, and the friction of the
O-ring drags them along with one that grows with the slip.

And how did the drive lose it?  Where drag takes more than the drive can give, the lag behind the drive passes a quarter
turn and runs away.  A top that leaves the window of its spin takes its lock along until it falls.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from analysis.errors import TooFewReadings

#: A difference counts from this number of standard uncertainties on (by chance once in 10 000 runs), and of Hz:
#: less is the beginning and the end of a swing about the drive, a third of a turn in 20 s.
_SIGNIFICANT, LEAST_HZ = 4.0, 0.02


@dataclass(frozen=True)
class Slip:
    """The counted spin of a held top beside its drive.

    Attributes:
        spin: mean of the counts [Hz].
        drive: the drive's frequency [Hz].
        u: standard uncertainty of the mean [Hz].
        least: a smaller difference is none [Hz].
    """

    spin: float
    drive: float
    u: float
    least: float

    @property
    def difference(self) -> float:
        """By how much the counted spin exceeds the drive's frequency [Hz]."""
        return self.spin - self.drive

    @property
    def significant(self) -> bool:
        """Whether the tape does not turn with the drive."""
        return abs(self.difference) > max(_SIGNIFICANT * self.u, self.least)


def slip_of(spins: Sequence[float], drives: float | Sequence[float], *, least: float = LEAST_HZ) -> Slip:
    """Compare the counts of a held top with its drive.

    The swing about the drive comes back to where it was, so its mean vanishes faster than the scatter says: the
    standard uncertainty, scatter over √n, is on the safe side.

    Args:
        spins: counts, shape (n,) [Hz].
        drives: the drive's frequency, or that of each count, shape (n,) [Hz].
        least: a difference that counts [Hz], where the drive was changed between the counts: its step.

    Raises:
        TooFewReadings: fewer than two counts.

    >>> round(slip_of([29.8, 29.9, 29.7, 29.8], 30.0).difference, 6)
    -0.2
    """
    spin = np.asarray(spins, dtype=np.float64)
    if spin.size < 2:
        raise TooFewReadings(seen=spin.size, needed=2)
    off = spin - np.asarray(drives)
    drive = float(np.mean(drives))
    u = float(off.std(ddof=1)) / math.sqrt(spin.size)
    return Slip(drive + float(off.mean()), drive, u, max(least, LEAST_HZ))


# --- how it was lost ---

#: Length of the record before the loss [s], about twice the time from a quarter turn of lag to 1 Hz behind the drive,
#: and of the one before that, whose mean is the slip of the tape: a swing of a quarter turn changes it by 0.01 Hz.
#: Fewest counts that give a lag.
_LAST_S, _BEFORE_S, _FEWEST = 10.0, 30.0, 3
#: A longer time between two counts than this multiple of the usual one is a gap: the lag of that time is not known.
_GAP = 3.0
#: In full motion 19 tops that left the window had lagged by 0.44 turns at most, in the wide swings before their fall,
#: and 16 that were left behind by 1.28 and more; this is the middle by ratio [turns].
LEFT_BEHIND_TURNS = 0.75


class Cause(StrEnum):
    """Why a driven top was lost, by its phase before the loss, or got no faster: pull and drag are equal."""

    LEFT_BEHIND = "left behind by the drive"
    OUT_OF_WINDOW = "out of the window"
    PULLS_NO_FURTHER = "the drive pulls no further"
    NOT_KNOWN = "not known"


def lag_before_loss(ends: Sequence[float], spins: Sequence[float], drives: Sequence[float]) -> float:
    """Return the largest lag behind the drive that built up over the last counts before a loss [turns].

    Counts without gaps between them are the phase: each adds (drive − spin) × duration, without the mean of the half
    minute before, by which a tape on loose washers slips.  The largest sum that ends at the last count is given, so
    that what the top had been ahead before is not taken off.

    Args:
        ends: of the counts, increasing, shape (n,) [s].
        spins: counts, shape (n,) [Hz].
        drives: the drive's frequency during each of them, shape (n,) [Hz].

    Returns:
        The lag; NaN of too few counts since the last gap.

    >>> ends = np.arange(0.5, 30.0, 0.5)
    >>> lag_before_loss(ends, 60.0 - 0.2 * np.maximum(ends - 26.0, 0.0), np.full(ends.size, 60.0))
    1.4
    """
    time, off = np.asarray(ends, dtype=np.float64), np.asarray(drives, dtype=np.float64) - np.asarray(spins)
    if time.size < _FEWEST:
        return math.nan
    lasts = np.diff(time, prepend=time[0] - float(np.median(np.diff(time))))
    last = max(
        max(np.flatnonzero(lasts > _GAP * np.median(lasts)), default=0), int(np.searchsorted(time, time[-1] - _LAST_S))
    )
    before = off[np.searchsorted(time, time[last] - _BEFORE_S) : last]
    if time.size - last < _FEWEST:
        return math.nan
    slip = float(before.mean()) if before.size >= _FEWEST else 0.0
    return max(0.0, round(float(np.cumsum(((off - slip) * lasts)[last:][::-1]).max()), 6))


def cause_of_loss(lag: float, *, fell: bool) -> Cause:
    """Return why a driven top was lost.

    Args:
        lag: before the loss, NaN where it is not known [turns].
        fell: whether the top is down.

    >>> cause_of_loss(1.2, fell=True).value, cause_of_loss(0.1, fell=True).value, cause_of_loss(0.1, fell=False).value
    ('left behind by the drive', 'out of the window', 'not known')
    """
    if lag >= LEFT_BEHIND_TURNS:
        return Cause.LEFT_BEHIND
    return Cause.OUT_OF_WINDOW if fell and lag < LEFT_BEHIND_TURNS else Cause.NOT_KNOWN
