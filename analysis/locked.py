"""A top that a drive holds: does its tape turn as fast as the drive?

While the drive holds the top, the angle between its moment and the drive stays within half a turn, so the mean of the
spin is the drive's frequency, whatever the drag.  A tape that turns slower is not fixed to the moment: the washers that
carry it slip.  Air drags them back with a torque that grows as the power 3/2 of the spin, and the friction of the
O-ring drags them along with one that grows with the slip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.errors import TooFewReadings

if TYPE_CHECKING:
    from collections.abc import Sequence

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
    def warning(self) -> str:
        """What it means, empty where the tape turns with the drive."""
        if abs(self.difference) <= max(_SIGNIFICANT * self.u, self.least):
            return ""
        seen = f"the drive holds the top at {self.drive:.2f} Hz, but the counter sees {self.spin:.2f}({_u(self.u)}) Hz"
        if self.difference > 0:
            return (
                f"{seen}: no tape overtakes the drive; is there a second bright mark, or is the trigger level too low?"
            )
        return (
            f"{seen}: LOOSE WASHERS, the tape slips by {-self.difference:.2f} Hz; fix the washers to the top, for the "
            "readings are of the tape and not of the top"
        )


def _u(u: float) -> str:
    """Return a standard uncertainty in the second digit behind the point."""
    return f"{max(round(100 * u), 1)}"


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
