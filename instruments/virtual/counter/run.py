"""A run of a virtual counter, from INITiate to idle, and the memory for its readings, with their statistics.

A run goes on with the bench's clock.  Where a program waits for its end (READ?), the model computes it ahead of the
clock, in steps.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from instruments.ieee488 import NOT_A_NUMBER
from instruments.virtual.core.signal import Array
from instruments.virtual.core.steps import Steps
from instruments.virtual.counter.measurements import Inputs, Measurement, Reading

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


#: How far ahead a message may make a model look [s]; an answer that is further away does not come.  Three hours are
#: ten readings with the longest gate.
FARTHEST = 12_000.0
#: How many readings an answer may wait for; one that needs more does not come.
_MOST_AHEAD = 100_000
#: A model skips light from longer ago than this [s], where no message came meanwhile.
_CATCH_UP = 2500.0
#: A model looks ahead in steps of this length [s], and stops where it knows the result.
_STEP = 60.0


@dataclass
class Run:
    """From INITiate to idle: a number of readings after each of a number of triggers.

    Attributes:
        begin: time of INITiate [s].
        inputs: the edges of both inputs.
        measure: one measurement, given the inputs, the time at which it may begin, and its number since the trigger.
        samples: readings after each trigger.
        triggers: how many there are.
        dead_time: from the end of one measurement to the beginning of the next [s].
        delay: after a trigger [s].
        shortest: the shortest time that a reading can take [s], to know what is out of reach.
        patience: after this time without a reading there will be none [s].
        immediate: whether triggers come by themselves.
        memory: of the readings.
        n_taken: how many readings are complete.
    """

    begin: float
    inputs: Inputs
    measure: Callable[[Inputs, float, int], Measurement]
    samples: float
    triggers: float = 1
    dead_time: float = 0.0
    delay: float = 0.0
    shortest: float = 0.0
    patience: float = 2000.0
    immediate: bool = True
    memory: Memory = field(default_factory=Memory)
    n_taken: int = 0
    _next: float = 0.0
    _seen: float = 0.0
    _under_way: Measurement | None = None

    def __post_init__(self) -> None:
        self._next = self.begin + self.delay if self.immediate else math.inf
        self._seen = self.begin

    @property
    def wanted(self) -> float:
        """How many readings the run has in all."""
        return self.samples * self.triggers

    @property
    def complete(self) -> bool:
        """Whether all readings are known; their times may lie in the future."""
        return self.n_taken >= self.wanted

    @property
    def waiting(self) -> bool:
        """Whether it waits for a trigger that a program must send."""
        return math.isinf(self._next) and self._under_way is None and not self.complete

    def trigger(self, now: float) -> None:
        """Give the run the trigger that it waits for, at this time [s]."""
        self._next = now + self.delay

    def advance(self, until: float, count: float = math.inf) -> Steps[None]:
        """Work out what happens up to this time [s], or until there are `count` readings in all.

        Where no message came for hours, the run skips most of that time.  Between two steps other methods may be
        called, but not advance() beyond this time.
        """
        if until > self._seen + _CATCH_UP and not self.waiting:
            self._under_way, self._next = None, until - _CATCH_UP
            self.inputs.forget()
        self._seen = max(self._seen, until)
        while self.n_taken < min(count, self.wanted):
            if self._under_way is None:
                if self._next > until:
                    return
                self._under_way = self.measure(
                    self.inputs, self._next, self.n_taken % max(1, int(min(self.samples, 1e9)))
                )
            try:
                finder, wanted = next(self._under_way)
            except StopIteration as result:
                self._keep(result.value)
            else:
                if not finder.look(wanted, until):
                    return
            yield

    def _keep(self, reading: Reading) -> None:
        self._under_way = None
        self.n_taken += 1
        self.memory.add(reading)
        self._next = reading.done + self.dead_time
        if self.n_taken % self.samples == 0:
            self._next = self._next + self.delay if self.immediate else math.inf

    def reach(self, count: float, now: float) -> Steps[float]:
        """Look ahead for the time of `count` readings in all, or of the last [s]; infinity where that is too far."""
        count = min(count, self.wanted)
        yield from self.advance(now)
        if count - self.n_taken > _MOST_AHEAD or (count - self.n_taken) * self.shortest > FARTHEST:
            return math.inf
        ahead, last_reading, n_taken = 0.0, 0.0, self.n_taken
        while self.n_taken < count and ahead < min(FARTHEST, last_reading + self.patience + _STEP) and not self.waiting:
            ahead += _STEP
            yield from self.advance(now + ahead, count)
            if self.n_taken > n_taken:
                n_taken, last_reading = self.n_taken, ahead
        if self.n_taken < count:
            return math.inf
        back = self.n_taken - int(count)
        return self.memory.done(back) if count else self.begin
