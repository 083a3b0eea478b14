"""A run of a virtual counter, from INITiate to idle.

A run goes on with the bench's clock.  Where a program waits for its end (READ?), the model computes it ahead of the
clock, in steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from instruments.virtual.counter.memory import Memory

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.core.steps import Steps
    from instruments.virtual.counter.measurements import Inputs, Measurement, Reading

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
