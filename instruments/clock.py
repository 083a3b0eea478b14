"""Time on the bench: the wall's, or a virtual one that jumps."""

from __future__ import annotations

import math
import time
from typing import Protocol


class Clock(Protocol):
    """Seconds since the bench was switched on.

    jumps: whether time stands still between the calls of `sleep`; if not, it passes by itself.
    """

    jumps: bool

    def now(self) -> float:
        """The time [s]."""

    def sleep(self, duration: float) -> None:
        """Let time pass [s]."""

    def wall_duration(self, duration: float) -> float:
        """How long the wall's clock runs until so much time may have passed here [s].

        An event loop waits for that long.  On a clock that jumps `sleep` then returns without waiting.
        """


class WallClock:
    """The time of a real bench, or that time at a multiple.

    speed: seconds of the bench per second of the wall, for a virtual bench that a person watches; waits: time stands at
    0 until :meth:`begin` is called.  Raises ValueError when the speed is not a positive number.
    """

    jumps = False

    def __init__(self, *, speed: float = 1.0, waits: bool = False) -> None:
        if not 0 < speed < math.inf:
            raise ValueError(f"speed = {speed:g}, a number above 0 is expected")
        self.speed = speed
        self._start: float | None = None if waits else time.monotonic()

    def begin(self) -> None:
        """Let time pass from now on, if it does not yet."""
        if self._start is None:
            self._start = time.monotonic()

    def now(self) -> float:
        """The time [s]."""
        return 0.0 if self._start is None else self.speed * (time.monotonic() - self._start)

    def sleep(self, duration: float) -> None:
        """Wait until so much time has passed on the bench [s]."""
        time.sleep(self.wall_duration(duration))

    def wall_duration(self, duration: float) -> float:
        """See :class:`Clock` [s]."""
        return max(0.0, duration) / self.speed


class VirtualClock:
    """The time of a virtual bench: waiting takes no time, or with realtime as long as it says.

    >>> clock = VirtualClock()
    >>> clock.sleep(190.0)
    >>> clock.now()
    190.0
    """

    jumps = True

    def __init__(self, *, realtime: bool = False) -> None:
        self._now = 0.0
        self._wall = WallClock() if realtime else None

    def now(self) -> float:
        """The time [s]."""
        return self._now

    def sleep(self, duration: float) -> None:
        """Jump ahead [s]; with realtime wait until the wall clock is there too."""
        self._now += max(0.0, duration)
        if self._wall:
            self._wall.sleep(self._now - self._wall.now())

    def wall_duration(self, duration: float) -> float:
        """See :class:`Clock` [s]."""
        if self._wall is None:
            return 0.0
        return self._wall.wall_duration(self._now + max(0.0, duration) - self._wall.now())
