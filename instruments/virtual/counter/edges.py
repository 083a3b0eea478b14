"""Edges of a sampled voltage: a search, piece by piece, for the places where a Schmitt trigger fires.

A search may go through hours of a signal, of which only a piece is in memory at a time.  A signal may have a method
`crossings`, (start [s], stop [s], thresholds) → shape (m,) [s]: the times at which a trigger fires, or None where only
the voltage shows them.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from instruments.virtual.core.signal import Array, Signal, find_firings

#: Samples per second with which the models look at the light.  A pulse of 3 % of a turn at 60 Hz lasts
#: 0.5 ms: ten samples; the crossing is interpolated between two of them.
RATE = 20_000.0
#: Samples in one piece: a megabyte each for the voltage and for what the world needs to make it.
_SHORTEST, _LONGEST = 1 << 10, 1 << 17
#: The time over which a.c. coupling takes the mean, and how long an automatic level stays valid [s].
_SETTLING, _LEVEL_AGE = 1.0, 1.0


@dataclass(frozen=True)
class Thresholds:
    """A Schmitt trigger: it fires at one voltage and arms beyond another one [V].

    sign: 1 for rising edges, −1 for falling ones.
    """

    fire: float
    arm: float
    sign: float = 1.0


@dataclass(frozen=True)
class TriggerInput:
    """The settings of an input: how its trigger sees the signal.

    Attributes:
        level: fixed [V], or None for the automatic level.
        hysteresis: between firing and arming [V], for a fixed level, or where upper and lower are equal.
        window: how long the automatic level looks at the signal [s].
        upper: where an automatic trigger fires, in parts of peak to peak.
        lower: where it arms.
        alternating: whether the input is a.c. coupled, so that the mean counts as 0 V.
        falling: whether the trigger fires on falling edges.
    """

    level: float | None
    hysteresis: float
    window: float
    upper: float = 0.5
    lower: float = 0.5
    alternating: bool = False
    falling: bool = False

    def thresholds(self, signal: Signal, instant: float) -> Thresholds:
        """Return the trigger's voltages for the signal at this time [s].

        An automatic level is right where the window holds at least a period of the signal.  The pulse of a slower
        signal may fall outside the window; then the level lies in the noise of the dark.
        """
        sign = -1.0 if self.falling else 1.0
        if self.level is None:
            low, high = self.extremes(signal, instant)
            upper, lower = (self.lower, self.upper) if self.falling else (self.upper, self.lower)
            fire, arm = (low + share * (high - low) for share in (upper, lower))
            return Thresholds(fire, fire - sign * self.hysteresis if fire == arm else arm, sign)
        mean = float(signal(instant, 1 / RATE, int(_SETTLING * RATE)).mean()) if self.alternating else 0.0
        return Thresholds(self.level + mean, self.level + mean - sign * self.hysteresis, sign)

    def extremes(self, signal: Signal, instant: float) -> tuple[float, float]:
        """Return the least and the greatest voltage within the window [V]."""
        voltage = signal(instant, 1 / RATE, max(2, int(self.window * RATE)))
        return float(voltage.min()), float(voltage.max())


@dataclass(frozen=True)
class Edge:
    """An edge.  count: edges before it since the search began; time [s]."""

    count: int
    time: float


class EdgeFinder:
    """Finds the edges of one input from a time on.  Questions must come in order of time: earlier edges are dropped."""

    def __init__(self, signal: Signal, entry: TriggerInput, start: float) -> None:
        self._signal, self._entry, self._start = signal, entry, start
        self._samples = 0
        self._ask: Callable[[float, float, Thresholds], Array | None] | None = getattr(signal, "crossings", None)
        self._stride = _SHORTEST
        self._last: Array = np.empty(0)
        self._armed = False
        self._times: Array = np.empty(0)
        self._passed = 0
        self._triggers, self._found_at = entry.thresholds(signal, start), start

    @property
    def reached(self) -> float:
        """The time up to which all edges are known [s]."""
        return self._start + (self._samples - 1) / RATE

    def find(self, instant: float) -> Edge | None:
        """Return the first known edge at this time or later, None where there is none."""
        count = int(np.searchsorted(self._times, instant))
        self._times, self._passed = self._times[count:], self._passed + count
        return Edge(self._passed, float(self._times[0])) if self._times.size else None

    def refresh(self, instant: float) -> None:
        """Find a level that follows the signal again, where it is too old, at the beginning of a measurement [s]."""
        follows = self._entry.level is None or self._entry.alternating
        if follows and instant > self._found_at + _LEVEL_AGE:
            self._triggers, self._found_at = self._entry.thresholds(self._signal, instant), instant

    def look(self, wanted: float, until: float) -> bool:
        """Search the next piece of the signal: up to `wanted` or a little further, but not beyond `until` [s].

        Returns:
            Whether there was anything left to search.
        """
        wish = math.ceil((wanted - self._start) * RATE) + 1 - self._samples
        left = math.floor((until - self._start) * RATE) + 1 - self._samples
        count = min(max(wish, self._stride), _LONGEST, left)
        if count <= (0 if self._samples else 1):  # the first sample alone has no edge
            return False
        times = self._crossings(count)
        if times is None:
            times = self._crossings_seen(count)
        # the search goes through the dark in ever longer pieces
        self._stride = _SHORTEST if times.size else min(2 * self._stride, _LONGEST)
        self._times = np.concatenate((self._times, times))
        self._samples += count
        return True

    def _crossings(self, count: int) -> Array | None:
        """Return the edges in the next `count` samples as the signal itself gives them, None where it cannot."""
        if self._ask is None:
            return None
        begin = self._start + max(self._samples - 1, 0) / RATE
        times = self._ask(begin, self._start + (self._samples + count - 1) / RATE, self._triggers)
        if times is not None:
            self._last, self._armed = np.empty(0), False
        return times

    def _crossings_seen(self, count: int) -> Array:
        """Return the edges in the next `count` samples of the voltage."""
        voltage = self._signal(self._start + self._samples / RATE, 1 / RATE, count)
        joined = self._triggers.sign * np.concatenate((self._last, voltage))
        sign = self._triggers.sign
        places, self._armed = find_firings(
            joined, sign * self._triggers.fire, sign * self._triggers.arm, armed=self._armed
        )
        times = self._start + (self._samples - self._last.size + places) / RATE
        self._last = voltage[-1:]
        return times
