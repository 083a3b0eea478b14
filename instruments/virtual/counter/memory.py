"""The memory of the virtual counters for their readings, and their statistics."""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING

import numpy as np

from instruments.ieee488 import NOT_A_NUMBER

if TYPE_CHECKING:
    from instruments.virtual.core.signal import Array
    from instruments.virtual.counter.measurements import Reading

#: How many readings the memory keeps; then it drops the oldest (53220A/53230A User's Guide: 1 000 000).
CAPACITY = 1_000_000


class Memory:
    """Readings in the order in which they came; a full memory drops the oldest.

    Attributes:
        overflowed: whether it has dropped any.
        n_fetched: how many of those it holds were fetched.
    """

    def __init__(self) -> None:
        self.overflowed = False
        self.n_fetched = 0
        self._values, self._stamps, self._done = array("d"), array("d"), array("d")

    def add(self, reading: Reading) -> None:
        """Append a reading."""
        for column, number in zip(self._columns, (reading.value, reading.stamp, reading.done), strict=True):
            column.append(number)
        if len(self._done) >= CAPACITY + CAPACITY // 8:
            self.drop_oldest(len(self._done) - CAPACITY)
            self.overflowed = True

    @property
    def _columns(self) -> tuple[array[float], array[float], array[float]]:
        return self._values, self._stamps, self._done

    def drop_oldest(self, count: int) -> None:
        """Drop the `count` oldest readings."""
        for column in self._columns:
            del column[:count]
        self.n_fetched = max(0, self.n_fetched - count)

    def available(self, now: float) -> int:
        """Return the number of readings by this time [s]."""
        return int(np.searchsorted(np.frombuffer(self._done), now, "right")) if self._done else 0

    def truncate(self, now: float) -> None:
        """Drop the readings that would come after this time [s]."""
        keep = self.available(now)
        for column in self._columns:
            del column[keep:]

    @property
    def size(self) -> int:
        """How many readings there are, with those whose time is still to come."""
        return len(self._done)

    def done(self, back: int) -> float:
        """Return when the last reading was complete, or the one `back` before it [s]; −∞ where it is dropped."""
        return self._done[-1 - back] if back < len(self._done) else -math.inf

    def slice(self, start: int, stop: int) -> tuple[Array, Array]:
        """Return values and time stamps of the readings from start to stop."""
        return np.array(self._values[start:stop]), np.array(self._stamps[start:stop])


def statistics(values: Array) -> dict[str, float]:
    """Return mean, standard deviation, extremes and Allan deviation of readings.

    Without a reading each is the instruments' "not a number"; of one reading the deviations are 0.

    >>> statistics(np.array([1.0, 3.0]))["sdev"]
    1.4142135623730951
    """
    values = values[values < NOT_A_NUMBER]
    if not values.size:
        return dict.fromkeys(("mean", "sdev", "min", "max", "ptp", "adev"), NOT_A_NUMBER)
    several = values.size > 1
    return {
        "mean": float(values.mean()),
        "sdev": float(values.std(ddof=1)) if several else 0.0,
        "min": float(values.min()),
        "max": float(values.max()),
        "ptp": float(np.ptp(values)),
        "adev": float(np.sqrt(np.mean(np.diff(values) ** 2) / 2)) if several else 0.0,
    }
