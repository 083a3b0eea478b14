"""A jump of a record's time, where a recorder lost or repeated samples."""

from dataclasses import dataclass

from analysis.arrays import Array


@dataclass(frozen=True)
class Jump:
    """A place where the record's time jumps.

    Attributes:
        at: the record's time there [s].
        lost: time that is missing there, below 0 where samples were repeated [s]; whole turns cannot be seen.
        u: its standard uncertainty [s].
    """

    at: float
    lost: float
    u: float = 0.0

    def mend(self, times: Array) -> Array:
        """Return the times of an unbroken clock at times of the record."""
        return times + self.lost * (times > self.at)

    def spoil(self, times: Array) -> Array:
        """Return the times of the record at times of the unbroken clock."""
        return times - self.lost * (times > self.at + max(self.lost, 0.0))
