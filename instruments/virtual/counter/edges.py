"""Edges of a sampled voltage: where a Schmitt trigger fires, looked for piece by piece.

A signal may be looked at for hours: only a piece of it is in memory at a time.  One may have a method `crossings`
beside, which gives the times at which a trigger fires: (start [s], stop [s], thresholds) → shape (m,) [s], or None if
only the voltage shows them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from instruments.virtual.core.trigger import fires

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.core.signal import Array, Signal

#: Samples per second with which the models look at the light.  A pulse of 3 % of a turn at 60 Hz lasts
#: 0.5 ms: ten samples; the crossing is interpolated between two of them.
RATE = 20_000.0
#: Samples at a look: a megabyte each for the voltage and for whatever the world needs to make it.
_SHORTEST, _LONGEST = 1 << 10, 1 << 17
#: What the mean is taken over that a.c. coupling removes, and how long a level that was found is good for [s].
_SETTLING, _LEVEL_AGE = 1.0, 1.0


@dataclass(frozen=True)
class Thresholds:
    """A Schmitt trigger: it fires at one voltage and is armed beyond another one [V].

    sign: 1 for rising edges, −1 for falling ones.
    """

    fire: float
    arm: float
    sign: float = 1.0


@dataclass(frozen=True)
class TriggerInput:
    """How an input looks at its signal.

    level: fixed [V], or None to find it; upper, lower: where the trigger fires and is armed, in parts of peak to
    peak, when it is found; both the same: then the hysteresis [V] lies below.  window: how long the signal is
    looked at for that [s]; alternating: the mean is taken away (a.c. coupling); falling: the slope.
    """

    level: float | None
    hysteresis: float
    window: float
    upper: float = 0.5
    lower: float = 0.5
    alternating: bool = False
    falling: bool = False

    @property
    def ages(self) -> bool:
        """Whether the thresholds follow the signal."""
        return self.level is None or self.alternating

    def thresholds(self, signal: Signal, instant: float) -> Thresholds:
        """The trigger's voltages as the signal lets choose them at this time [s].

        A found level is right if the window holds at least a period of the signal.  A pulse of a slower one may
        fall outside: the level then stands in the dark noise.
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
        """The least and the greatest voltage within the window [V]."""
        voltage = signal(instant, 1 / RATE, max(2, int(self.window * RATE)))
        return float(voltage.min()), float(voltage.max())


@dataclass(frozen=True)
class Edge:
    """count: edges of the signal before this one, from where the look began; time [s]."""

    count: int
    time: float


class EdgeFinder:
    """The edges of one input from some time on.  They are asked for in order; those passed are forgotten."""

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
        """Up to here every edge is known [s]."""
        return self._start + (self._samples - 1) / RATE

    def find(self, instant: float) -> Edge | None:
        """The first edge at this time or later, if it is known."""
        count = int(np.searchsorted(self._times, instant))
        self._times, self._passed = self._times[count:], self._passed + count
        return Edge(self._passed, float(self._times[0])) if self._times.size else None

    def count_before(self, instant: float) -> int:
        """How many of the edges that are known lie before this time."""
        return self._passed + int(np.searchsorted(self._times, instant))

    def refresh(self, instant: float) -> None:
        """A measurement begins: a level that follows the signal is found anew, if it is old."""
        if self._entry.ages and instant > self._found_at + _LEVEL_AGE:
            self._triggers, self._found_at = self._entry.thresholds(self._signal, instant), instant

    def look(self, wanted: float, until: float) -> bool:
        """Look on at the signal: as far as wanted, or a little further, but not beyond until.

        Returns False if there was nothing left to look at.
        """
        wish = math.ceil((wanted - self._start) * RATE) + 1 - self._samples
        left = math.floor((until - self._start) * RATE) + 1 - self._samples
        count = min(max(wish, self._stride), _LONGEST, left)
        if count <= 0:
            return False
        times = self._crossings(count)
        if times is None:
            times = self._crossings_seen(count)
        # darkness is looked through in ever longer pieces
        self._stride = _SHORTEST if times.size else min(2 * self._stride, _LONGEST)
        self._times = np.concatenate((self._times, times))
        self._samples += count
        return True

    def _crossings(self, count: int) -> Array | None:
        """What a signal itself says of its edges in so many samples, None if it cannot."""
        if self._ask is None:
            return None
        begin = self._start + max(self._samples - 1, 0) / RATE
        times = self._ask(begin, self._start + (self._samples + count - 1) / RATE, self._triggers)
        if times is not None:
            self._last, self._armed = np.empty(0), False
        return times

    def _crossings_seen(self, count: int) -> Array:
        """The edges in so many samples of the voltage."""
        voltage = self._signal(self._start + self._samples / RATE, 1 / RATE, count)
        joined = self._triggers.sign * np.concatenate((self._last, voltage))
        sign = self._triggers.sign
        places, self._armed = fires(joined, sign * self._triggers.fire, sign * self._triggers.arm, armed=self._armed)
        times = self._start + (self._samples - self._last.size + places) / RATE
        self._last = voltage[-1:]
        return times
