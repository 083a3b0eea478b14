"""What the virtual counters measure: from edges to a frequency, a period, an interval, a duty cycle, a total.

A measurement takes its time, and is a generator: it asks for edges, and waits where it may not look any further.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field

from instruments.ieee488 import NOT_A_NUMBER
from instruments.virtual.counter.edges import Edge, EdgeFinder, Input, Signal


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
