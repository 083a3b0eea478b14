"""A run of a virtual counter, from INITiate to idle: one that is under way goes on as the bench's clock does.

One that is waited for (READ?) is worked out ahead of it, in steps.
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

#: A message may make a model look so far ahead [s]; an answer that is further away does not come.  Three hours are
#: ten readings with the longest gate there is.
FARTHEST = 12_000.0
#: Nor does one that has to wait for more readings than this.
_MOST_AHEAD = 100_000
#: Light that was not asked about for longer than this [s] is passed over.
_CATCH_UP = 2500.0
#: A model looks ahead in steps, to stop where the result is known [s].
_STEP = 60.0


@dataclass
class Run:
    """From INITiate to idle: so many readings after each of so many triggers.

    measure: one measurement, given the time it may begin and its number since the trigger; dead: from the end of one
    to the beginning of the next [s]; delay: after a trigger [s]; immediate: triggers come by themselves.
    least: the shortest that a reading can take [s], to know what is out of reach; quiet: after so long without a
    reading there will be none [s].
    """

    begin: float
    inputs: Inputs
    measure: Callable[[Inputs, float, int], Measurement]
    samples: float
    triggers: float = 1
    dead: float = 0.0
    delay: float = 0.0
    least: float = 0.0
    quiet: float = 2000.0
    immediate: bool = True
    memory: Memory = field(default_factory=Memory)
    taken: int = 0
    _next: float = 0.0
    _seen: float = 0.0
    _under_way: Measurement | None = None

    def __post_init__(self) -> None:
        self._next = self.begin + self.delay if self.immediate else math.inf
        self._seen = self.begin

    @property
    def wanted(self) -> float:
        """Readings in all."""
        return self.samples * self.triggers

    @property
    def complete(self) -> bool:
        """Whether all readings are known (they may lie in the future)."""
        return self.taken >= self.wanted

    @property
    def waiting(self) -> bool:
        """Whether it waits for a trigger that must be sent."""
        return math.isinf(self._next) and self._under_way is None and not self.complete

    def trigger(self, now: float) -> None:
        """The trigger that is waited for has come [s]."""
        self._next = now + self.delay

    def advance(self, until: float, count: float = math.inf) -> Steps[None]:
        """Everything that happens up to this time [s], or until so many readings have been taken in all.

        A program that stays away for hours finds that time passed over.  Between two steps anything may happen to the
        run, but for being advanced beyond this time.
        """
        if until > self._seen + _CATCH_UP and not self.waiting:
            self._under_way, self._next = None, until - _CATCH_UP
            self.inputs.forget()
        self._seen = max(self._seen, until)
        while self.taken < min(count, self.wanted):
            if self._under_way is None:
                if self._next > until:
                    return
                self._under_way = self.measure(
                    self.inputs, self._next, self.taken % max(1, int(min(self.samples, 1e9)))
                )
            try:
                finder, wanted = next(self._under_way)
            except StopIteration as result:
                self._take(result.value)
            else:
                if not finder.look(wanted, until):
                    return
            yield

    def _take(self, reading: Reading) -> None:
        self._under_way = None
        self.taken += 1
        self.memory.add(reading)
        self._next = reading.done + self.dead
        if self.taken % self.samples == 0:
            self._next = self._next + self.delay if self.immediate else math.inf

    def reach(self, count: float, now: float) -> Steps[float]:
        """When so many readings have been taken in all, or all of them [s]; infinity if that is out of reach."""
        count = min(count, self.wanted)
        yield from self.advance(now)
        if count - self.taken > _MOST_AHEAD or (count - self.taken) * self.least > FARTHEST:
            return math.inf
        ahead, stirred, taken = 0.0, 0.0, self.taken
        while self.taken < count and ahead < min(FARTHEST, stirred + self.quiet + _STEP) and not self.waiting:
            ahead += _STEP
            yield from self.advance(now + ahead, count)
            if self.taken > taken:
                taken, stirred = self.taken, ahead
        if self.taken < count:
            return math.inf
        back = self.taken - int(count)
        return self.memory.done(back) if count else self.begin
