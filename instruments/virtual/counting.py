"""What the virtual counters share: measurements that take their time, and the memory for readings.

A measurement is a generator: it asks for edges, and waits where it may not look any further.  So one that is
under way (INITiate) goes on as the bench's clock does, and one that is waited for (READ?) is worked out ahead of it,
in steps.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from instruments.scpi import NOT_A_NUMBER
from instruments.virtual.edges import Array, Edge, EdgeFinder, Input, Signal

if TYPE_CHECKING:
    from instruments.virtual.steps import Steps

#: A message may make a model look so far ahead [s]; an answer that is further away does not come.  Three hours are
#: ten readings with the longest gate there is.
FARTHEST = 12_000.0
#: Nor does one that has to wait for more readings than this.
_MOST_AHEAD = 100_000
#: Light that nobody has asked about for longer than this [s] is passed over.
_CATCH_UP = 2500.0
#: A model looks ahead in steps, to stop where the result is known [s].
_STEP = 60.0
#: Readings that are kept; then the oldest is lost (53220A/53230A User's Guide: 1 000 000).
CAPACITY = 1_000_000


@dataclass(frozen=True)
class Reading:
    """A result, when its measurement began (its time stamp), and when it was in memory [s]."""

    value: float
    stamp: float
    done: float


#: A measurement asks: let me look at this input at least up to this time [s].
Wish = tuple[EdgeFinder, float]
Measurement = Generator[Wish, None, Reading]


@dataclass
class Looks:
    """The edges of the inputs, for one run.  inputs: signal and setting by channel."""

    inputs: dict[int, tuple[Signal, Input, Input]]
    _finders: dict[tuple[int, bool], EdgeFinder] = field(default_factory=dict)

    def finder(self, channel: int, instant: float, *, other_slope: bool = False) -> EdgeFinder:
        """The edges of a channel with its own slope or the other one, known from this time on."""
        key = channel, other_slope
        if key not in self._finders:
            signal, own, other = self.inputs[channel]
            self._finders[key] = EdgeFinder(signal, other if other_slope else own, instant)
        return self._finders[key]

    def forget(self) -> None:
        """Begin anew, wherever it is asked for next."""
        self._finders.clear()


def first_edge(finder: EdgeFinder, instant: float, before: float) -> Generator[Wish, None, Edge | None]:
    """The first edge at this time or later; None if there is none before the deadline."""
    while (edge := finder.find(instant)) is None:
        if finder.reached >= before:
            return None
        yield finder, min(instant, before)
    return edge if edge.time < before else None


@dataclass(frozen=True)
class Span:
    """One measurement's time: when it begins, how long its gate is, and when it is given up (all s)."""

    begin: float
    gate: float
    deadline: float

    def given_up(self) -> Reading:
        """No result."""
        return Reading(NOT_A_NUMBER, self.begin, self.deadline)


def frequency(looks: Looks, channel: int, span: Span) -> Measurement:
    """Whole periods between the first edge and the first one after the gate, over their time [Hz]."""
    finder = looks.finder(channel, span.begin)
    finder.refresh(span.begin)
    opened = yield from first_edge(finder, span.begin, span.deadline)
    if opened is None:
        return span.given_up()
    due = max(opened.time + span.gate, math.nextafter(opened.time, math.inf))
    closed = yield from first_edge(finder, due, span.deadline)
    if closed is None:
        return span.given_up()
    return Reading((closed.count - opened.count) / (closed.time - opened.time), opened.time, closed.time)


def period(looks: Looks, channel: int, span: Span) -> Measurement:
    """The mean period [s]."""
    found = yield from frequency(looks, channel, span)
    return found if found.value == NOT_A_NUMBER else Reading(1 / found.value, found.stamp, found.done)


def single_period(looks: Looks, channel: int, span: Span) -> Measurement:
    """One period [s]."""
    return (yield from period(looks, channel, Span(span.begin, 0.0, span.deadline)))


def interval(looks: Looks, start: int, stop: int, span: Span, *, slopes: tuple[bool, bool]) -> Measurement:
    """From an edge of one input to the next of another, or of the same one [s].

    slopes: for each whether it is the slope that is not set.
    """
    finders = [
        looks.finder(channel, span.begin, other_slope=other)
        for channel, other in zip((start, stop), slopes, strict=True)
    ]
    for finder in finders:
        finder.refresh(span.begin)
    opened = yield from first_edge(finders[0], span.begin, span.deadline)
    if opened is None:
        return span.given_up()
    closed = yield from first_edge(finders[1], math.nextafter(opened.time, math.inf), span.deadline)
    if closed is None:
        return span.given_up()
    return Reading(closed.time - opened.time, opened.time, closed.time)


def duty(looks: Looks, channel: int, span: Span, *, slopes: tuple[bool, bool]) -> Measurement:
    """The part of a period that lies between an edge of one slope and the next of the other one."""
    width = yield from interval(looks, channel, channel, span, slopes=slopes)
    if width.value == NOT_A_NUMBER:
        return width
    again = yield from first_edge(looks.finder(channel, span.begin, other_slope=slopes[0]), width.done, span.deadline)
    if again is None:
        return span.given_up()
    return Reading(width.value / (again.time - width.stamp), width.stamp, again.time)


def total(looks: Looks, channel: int, span: Span) -> Measurement:
    """Edges while the gate is open."""
    finder = looks.finder(channel, span.begin)
    finder.refresh(span.begin)
    finder.find(span.begin)
    before, end = finder.count_before(span.begin), span.begin + span.gate
    while finder.reached < end:
        yield finder, end
    return Reading(float(finder.count_before(end) - before), span.begin, end)


#: By function: looks, channels, span, and whether falling edges are the ones that are set.
_FUNCTIONS: dict[str, Callable[[Looks, tuple[int, ...], Span, bool], Measurement]] = {
    "FREQ": lambda looks, channels, span, _: frequency(looks, channels[0], span),
    "PER": lambda looks, channels, span, _: period(looks, channels[0], span),
    "SPER": lambda looks, channels, span, _: single_period(looks, channels[0], span),
    "TINT": lambda looks, channels, span, _: interval(looks, channels[0], channels[-1], span, slopes=(False, False)),
    "PWID": lambda looks, channels, span, falling: interval(
        looks, channels[0], channels[0], span, slopes=(falling, not falling)
    ),
    "NWID": lambda looks, channels, span, falling: interval(
        looks, channels[0], channels[0], span, slopes=(not falling, falling)
    ),
    "PDUT": lambda looks, channels, span, falling: duty(looks, channels[0], span, slopes=(falling, not falling)),
    "NDUT": lambda looks, channels, span, falling: duty(looks, channels[0], span, slopes=(not falling, falling)),
    "TOT": lambda looks, channels, span, _: total(looks, channels[0], span),
}


def measurement(function: str, looks: Looks, channels: tuple[int, ...], span: Span, *, falling: bool) -> Measurement:
    """One measurement of this function.  falling: whether the first channel is set to falling edges."""
    return _FUNCTIONS[function](looks, channels, span, falling)


class Memory:
    """Readings in the order in which they came; the oldest are lost when there are too many."""

    def __init__(self) -> None:
        self.lost = False
        self.fetched = 0
        self._values, self._stamps, self._done = array("d"), array("d"), array("d")

    def add(self, reading: Reading) -> None:
        """One more."""
        for column, number in zip(self._columns, (reading.value, reading.stamp, reading.done), strict=True):
            column.append(number)
        if len(self._done) >= CAPACITY + CAPACITY // 8:
            self.drop(len(self._done) - CAPACITY)
            self.lost = True

    @property
    def _columns(self) -> tuple[array[float], array[float], array[float]]:
        return self._values, self._stamps, self._done

    def drop(self, count: int) -> None:
        """Take the oldest away."""
        for column in self._columns:
            del column[:count]
        self.fetched = max(0, self.fetched - count)

    def there(self, now: float) -> int:
        """How many there are by this time [s]."""
        return int(np.searchsorted(np.frombuffer(self._done), now, "right")) if self._done else 0

    def cut(self, now: float) -> None:
        """What would have come later does not come."""
        keep = self.there(now)
        for column in self._columns:
            del column[keep:]

    @property
    def held(self) -> int:
        """How many there are, those included that come later."""
        return len(self._done)

    def done(self, back: int) -> float:
        """When the last reading was there, or the one so many before it [s]; long ago if it is lost."""
        return self._done[-1 - back] if back < len(self._done) else -math.inf

    def part(self, start: int, stop: int) -> tuple[Array, Array]:
        """Values and time stamps of some of them."""
        return np.array(self._values[start:stop]), np.array(self._stamps[start:stop])


@dataclass
class Run:
    """From INITiate to idle: so many readings after each of so many triggers.

    measure: one measurement, given the time it may begin and its number since the trigger; dead: from the end of one
    to the beginning of the next [s]; delay: after a trigger [s]; immediate: triggers come by themselves.
    least: the shortest that a reading can take [s], to know what is out of reach; quiet: after so long without a
    reading there will be none [s].
    """

    begin: float
    looks: Looks
    measure: Callable[[Looks, float, int], Measurement]
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
        """It has come [s]."""
        if self.waiting:
            self._next = now + self.delay

    def advance(self, until: float, count: float = math.inf) -> Steps[None]:
        """Everything that happens up to this time [s], or until so many readings have been taken in all.

        A program that stays away for hours finds that time passed over.  Between two steps anything may happen to the
        run, but for being advanced beyond this time.
        """
        if until > self._seen + _CATCH_UP and not self.waiting:
            self._under_way, self._next = None, until - _CATCH_UP
            self.looks.forget()
        self._seen = max(self._seen, until)
        while self.taken < min(count, self.wanted):
            if self._under_way is None:
                if self._next > until:
                    return
                self._under_way = self.measure(self.looks, self._next, self.taken % max(1, int(min(self.samples, 1e9))))
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


def statistics(values: Array) -> dict[str, float]:
    """Mean, standard deviation, extremes and Allan deviation of what was measured.

    Without a reading everything is "not a number", as the instruments say it; one reading has no deviation.

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
