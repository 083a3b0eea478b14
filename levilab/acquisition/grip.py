"""Taking hold of a top: the drive yields to it for some seconds, whatever way the top points when it comes on.

A top under a drive is a pendulum: the angle from the drive to the moment swings about where the pull is as large as the
drag.  One that points far from there when the drive comes on turns over and over, and is not held; one that is held
swings for minutes, for hardly anything damps it, and is lost on the ramp.  So each count moves the drive a part of the
way to the counted spin.  That damps the pendulum at the rate share/interval, and where this is large enough beside
drag and pull no motion is left in which it turns over: the drive takes hold at each angle.  (A Josephson junction that
is damped comes back to zero voltage for the same reason: Stewart, Appl. Phys. Lett. 12, 277 (1968).)
"""

import math
from dataclasses import dataclass

#: Gate of a count [s]; the share of the difference to the spin by which it moves the drive; number of counts until the
#: drive stands still.  As a pendulum with the pull of 0.4 mT at 2 to 6 % of the moment across the axis, drag at 26 and
#: 33 Hz, and 0.03 Hz of noise, 400 angles each: all were held after 27 counts, and swung by less than 0.06 Hz.  With a
#: share of 0.2 up to 6 % were not; gates of 1 s come too late for the swing, whose period is 2.5 to 4.5 s, and with
#: gates of 0.1 s the counts are over before it holds, and their noise moves the drive.
GRIP_GATE_S, SHARE, COUNTS = 0.5, 0.4, 27
#: Largest distance from the drive of a spin that it can hold [Hz]; number of counts without such a
#: spin, one after another, that ends the try.
_WITHIN_HZ, _MOST_MISSED = 1.0, 3


@dataclass
class Grip:
    """A drive that takes hold of a top.

    Attributes:
        drive: its frequency [Hz].
        lowest, highest: that it may have [Hz].
        counts: so far.
        missed: the last ones of them that show no top that it could hold.

    >>> grip = Grip(30.0)
    >>> grip.follow(29.9)
    29.96
    """

    drive: float
    lowest: float = 0.0
    highest: float = math.inf
    counts: int = 0
    missed: int = 0

    @property
    def is_over(self) -> bool:
        """Whether the drive is to stand still from now on."""
        return self.counts >= COUNTS

    @property
    def is_lost(self) -> bool:
        """Whether there is no top that the drive could hold."""
        return self.missed >= _MOST_MISSED

    def follow(self, spin: float | None) -> float:
        """Take in a count [Hz], None without light pulses.  Returns the drive's next frequency [Hz]."""
        self.counts += 1
        if spin is None or abs(spin - self.drive) > _WITHIN_HZ:
            self.missed += 1
        else:
            self.missed = 0
            nearer = round(self.drive + SHARE * (spin - self.drive), 6)
            self.drive = min(max(nearer, self.lowest), self.highest)
        return self.drive
