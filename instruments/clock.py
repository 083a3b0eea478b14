"""Time on the bench: the wall's, or a virtual one that jumps."""

import math
import time
from collections.abc import Callable
from typing import Protocol

#: Where a clock has something to do meanwhile, it does so after each such part of a wait, by the clock on the wall [s].
PART_S = 0.05
#: What a clock that is paced is behind the clock on the wall it catches up with, up to this [s]; more is lost.
_CATCHES_UP_S = 0.25


class Clock(Protocol):
    """Seconds since the bench was switched on.

    Attributes:
        jumps: whether time stands still between the calls of `sleep`; if not, it passes by itself.
        speed: seconds of the bench in one of the wall; infinite where a sleep takes no time.
        meanwhile: called after each part of a sleep, for what goes on beside: a view of the bench, a progress bar.  It
            may sleep itself, which makes the sleep around it no longer.
    """

    jumps: bool
    speed: float
    meanwhile: Callable[[], None] | None

    def now(self) -> float:
        """Return the time [s]."""

    def sleep(self, duration: float) -> None:
        """Let time pass [s]."""

    def wall_duration(self, duration: float) -> float:
        """Return how long the wall's clock runs until this time may have passed here [s].

        An event loop waits for that long.  On a clock that jumps `sleep` then returns without waiting.
        """


class WallClock:
    """The time of a real bench, or that time at a multiple.

    speed: seconds of the bench per second of the wall, for a virtual bench that a person watches; waits: time stands at
    0 until :meth:`begin` is called.  Raises ValueError when the speed is not a positive number.
    """

    jumps = False
    meanwhile: Callable[[], None] | None = None

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
        """Return the time [s]."""
        return 0.0 if self._start is None else self.speed * (time.monotonic() - self._start)

    def sleep(self, duration: float) -> None:
        """Wait until this time has passed on the bench [s]."""
        if self.meanwhile is None:
            time.sleep(self.wall_duration(duration))
            return
        end = time.monotonic() + self.wall_duration(duration)
        while (left := end - time.monotonic()) > 0:
            time.sleep(min(left, PART_S))
            self.meanwhile()

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
    meanwhile: Callable[[], None] | None = None

    def __init__(self, *, realtime: bool = False) -> None:
        self._now = 0.0
        self._wall = WallClock() if realtime else None
        self.speed = 1.0 if realtime else math.inf

    def now(self) -> float:
        """Return the time [s]."""
        return self._now

    def sleep(self, duration: float) -> None:
        """Jump ahead [s]; with realtime wait until the wall clock is there too."""
        end = self._now + max(0.0, duration)
        while True:
            self._pass(end)
            if self.meanwhile is not None:
                self.meanwhile()
            if self._now >= end:
                return

    def _pass(self, end: float) -> None:
        """Let time pass, to the end of a sleep [s], or a part of it if there is something to do meanwhile."""
        if self._wall and self.meanwhile is not None:
            end = min(end, max(self._wall.now(), self._now) + PART_S)
        self._now = max(self._now, end)
        if self._wall:
            self._wall.sleep(self._now - self._wall.now())

    def wall_duration(self, duration: float) -> float:
        """See :class:`Clock` [s]."""
        if self._wall is None:
            return 0.0
        return self._wall.wall_duration(self._now + max(0.0, duration) - self._wall.now())


class PacedClock(VirtualClock):
    """The time of a virtual bench that a person watches: its speed may change, and it may stand still.

    It keeps to the wall's clock as long as the bench can; what the bench is late by is not caught up with, so a slow
    machine has a slower bench.  A clock that is paused passes no time until `meanwhile` ends that.

    Attributes:
        speed: seconds of the bench in one of the wall, above 0; infinite: it does not wait.
        paused: whether time stands still.
    """

    def __init__(self, speed: float = 1.0) -> None:
        super().__init__()
        self.speed = speed
        self.paused = False
        self._due = time.monotonic()  # when the wall's clock is to show the present time

    def _pass(self, end: float) -> None:
        if self.paused and self.meanwhile is not None:
            time.sleep(PART_S)
            self._due = time.monotonic()
            return
        part = min(end - self._now, PART_S * self.speed)
        self._now = end if part >= end - self._now else self._now + part
        if self.speed < math.inf:
            self._due = max(self._due + part / self.speed, time.monotonic() - _CATCHES_UP_S)
            if (left := self._due - time.monotonic()) > 0:
                time.sleep(left)

    def wall_duration(self, duration: float) -> float:
        """See :class:`Clock` [s]."""
        return max(0.0, duration) / self.speed
