"""The measurements of the virtual counters: from edges to a frequency, a period, an interval.

A measurement is a Python generator: it yields the input and the time up to which it needs edges, and goes on when the
run has looked that far.
"""

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace

from instruments.ieee488 import NOT_A_NUMBER
from instruments.virtual.core.signal import Signal
from instruments.virtual.counter.edges import Edge, EdgeFinder, TriggerInput


@dataclass(frozen=True)
class Reading:
    """A result, its time stamp, which is the beginning of the measurement, and when it is in the memory [s]."""

    value: float
    stamp: float
    done: float


#: What a measurement yields: the input whose edges it needs, at least up to this time [s].
Wanted = tuple[EdgeFinder, float]
Measurement = Generator[Wanted, None, Reading]


@dataclass
class Inputs:
    """The edges of the inputs, for one run.  inputs: by channel, signal and settings."""

    inputs: dict[int, tuple[Signal, TriggerInput]]
    _finders: dict[int, EdgeFinder] = field(default_factory=dict)

    def finder(self, channel: int, instant: float) -> EdgeFinder:
        """Return the edge finder of a channel; a new one begins at this time [s]."""
        if channel not in self._finders:
            self._finders[channel] = EdgeFinder(*self.inputs[channel], instant)
        return self._finders[channel]

    def forget(self) -> None:
        """Drop all edge finders, so that the next ones start from the beginning."""
        self._finders.clear()


#: A gate opens within a period, and closes within another one: at 20 Hz and above so much later than its length [s].
_TWO_PERIODS_AT_20_HZ = 0.1


def first_edge(
    finder: EdgeFinder, instant: float, before: float, *, ahead: float = 0.0
) -> Generator[Wanted, None, Edge | None]:
    """Wait for the first edge at this time or later; None where there is none before the deadline.

    Args:
        finder: of the edges.
        instant: [s].
        before: the deadline [s].
        ahead: time after the instant for which edges will be needed, too, and are searched for at once [s].
    """
    while (edge := finder.find(instant)) is None:
        if finder.reached >= before:
            return None
        yield finder, min(instant + ahead, before)
    return edge if edge.time < before else None


@dataclass(frozen=True)
class GateTime:
    """The times of one measurement: when it begins, how long its gate is, and its deadline (all s)."""

    begin: float
    length: float
    deadline: float

    def without_result(self) -> Reading:
        """Return the reading of a measurement without a result."""
        return Reading(NOT_A_NUMBER, self.begin, self.deadline)


def frequency(inputs: Inputs, channel: int, gate: GateTime) -> Measurement:
    """Count the periods from the first edge to the first one after the gate, and divide by their time [Hz]."""
    finder = inputs.finder(channel, gate.begin)
    finder.refresh(gate.begin)
    opened = yield from first_edge(finder, gate.begin, gate.deadline, ahead=gate.length + _TWO_PERIODS_AT_20_HZ)
    if opened is None:
        return gate.without_result()
    due = max(opened.time + gate.length, math.nextafter(opened.time, math.inf))
    closed = yield from first_edge(finder, due, gate.deadline)
    if closed is None:
        return gate.without_result()
    return Reading((closed.count - opened.count) / (closed.time - opened.time), opened.time, closed.time)


def period(inputs: Inputs, channel: int, gate: GateTime) -> Measurement:
    """Measure the mean period [s]."""
    found = yield from frequency(inputs, channel, gate)
    return found if found.value == NOT_A_NUMBER else Reading(1 / found.value, found.stamp, found.done)


def interval(inputs: Inputs, start: int, stop: int, gate: GateTime) -> Measurement:
    """Measure the time from an edge of one input to the next edge of another, or of the same one [s].

    Args:
        inputs: of the run.
        start: channel of the first edge.
        stop: channel of the second.
        gate: when to begin, and the deadline.
    """
    finders = [inputs.finder(channel, gate.begin) for channel in (start, stop)]
    for finder in finders:
        finder.refresh(gate.begin)
    opened = yield from first_edge(finders[0], gate.begin, gate.deadline)
    if opened is None:
        return gate.without_result()
    closed = yield from first_edge(finders[1], math.nextafter(opened.time, math.inf), gate.deadline)
    if closed is None:
        return gate.without_result()
    return Reading(closed.time - opened.time, opened.time, closed.time)


#: By function; the arguments are inputs, channels, gate.
_FUNCTIONS: dict[str, Callable[[Inputs, tuple[int, ...], GateTime], Measurement]] = {
    "FREQ": lambda inputs, channels, gate: frequency(inputs, channels[0], gate),
    "PER": lambda inputs, channels, gate: period(inputs, channels[0], gate),
    "SPER": lambda inputs, channels, gate: period(inputs, channels[0], replace(gate, length=0.0)),
    "TINT": lambda inputs, channels, gate: interval(inputs, channels[0], channels[-1], gate),
}


def measurement(function: str, inputs: Inputs, channels: tuple[int, ...], gate: GateTime) -> Measurement:
    """Begin one measurement of this function."""
    return _FUNCTIONS[function](inputs, channels, gate)
