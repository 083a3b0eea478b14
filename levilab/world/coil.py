"""The drive coil's field in time, as a generator puts it there."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from analysis.arrays import Array
from instruments.virtual.generator.channel import Output
from instruments.virtual.generator.voltage import voltage
from levilab.world.bursts import burst_starts
from levilab.world.timeline import Timeline

Edges = Callable[[float, float, bool], Array]


@dataclass(frozen=True)
class _Stretch:
    """From some time on.

    Attributes:
        output: amplitude and offset in T.
        origin: when its phase was turns [s].
    """

    output: Output
    origin: float
    turns: float

    def field(self, times: Array, edges: Edges | None) -> Array:
        """Return the field at times within it [T]."""
        if self.output.triggered and edges:
            return self._triggered_field(times, edges)
        since, burst = times - self.origin, self.output.burst
        if burst is None or burst.period is None:
            return voltage(self.output, self.turns + self.output.frequency * since, times)
        turns = self.output.frequency * (since % burst.period)
        # 1e-9 of a turn: the end of a burst is no sample of its beginning
        playing = turns < burst.cycles - 1e-9
        return np.where(playing, voltage(self.output, turns, times), self.output.offset)

    def _triggered_field(self, times: Array, edges: Edges) -> Array:
        """Return the field of the bursts that edges at the trigger input start."""
        bursts = self.output.triggered
        assert bursts
        length = bursts.delay + bursts.cycles / self.output.frequency
        first = max(self.origin, float(times[0]) - 4 * length) if length < math.inf else self.origin
        starts = burst_starts(edges(first, float(times[-1]), bursts.rising), length) + bursts.delay
        if not starts.size:
            return np.full_like(times, self.output.offset)
        since = times - starts[np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)]
        turns = self.output.frequency * since
        playing = (turns >= 0) & (turns < bursts.cycles)
        signal = voltage(replace(self.output, amplitude=bursts.amplitude), turns, times)
        return np.where(playing, signal, self.output.offset)

    def turns_at(self, time: float) -> float:
        """Return the turns that the waveform has made."""
        return self.turns + self.output.frequency * (time - self.origin)


class Coil:
    """The field of a coil that is driven.

    Where the frequency changes the phase runs on; a signal begins at its start where there was none, and bursts do.

    Args:
        edges: (start [s], stop [s], rising) → the edges at the generator's trigger input, shape (m,) [s]; None: nothing
            is plugged in.

    >>> coil = Coil()
    >>> coil.change(1.0, Output("SQU", 2.0, 4e-4, 0.0))
    >>> coil.field(np.array([0.9, 1.1, 1.3])).tolist()
    [0.0, 0.0004, -0.0004]
    """

    def __init__(self, edges: Edges | None = None) -> None:
        self._edges = edges
        self.history = Timeline(-math.inf, _Stretch(Output("DC", 0.0, 0.0, 0.0), 0.0, 0.0))

    def change(self, time: float, output: Output) -> None:
        """Let the coil have this output from this time [s] on, in T; later changes are dropped."""
        last = self.history.at(math.nextafter(time, -math.inf))
        same = last.output == output and last.output.samples is output.samples
        if same and last is self.history.last:
            return
        self.history.cut(time)
        if not same:
            self.history.append(time, self._next(last, time, output))

    def _next(self, last: _Stretch, time: float, output: Output) -> _Stretch:
        if not last.output.amplitude:
            return _Stretch(output, time, 0.0)
        burst = output.burst
        if burst is not None and burst.period is not None:  # bursts that start by themselves keep their rhythm
            same = (last.output.burst, last.output.frequency) == (burst, output.frequency)
            return _Stretch(output, last.origin if same else time, 0.0)
        # the random bits repeat after 127 turns, all others after one
        return _Stretch(output, time, last.turns_at(time) % 127.0)

    def turns(self, time: float) -> float:
        """Return the turns that the waveform has made at this time, without the phase that it is set to."""
        return self.history.at(time).turns_at(time)

    def field(self, times: Array) -> Array:
        """Return the field at these times, shape (n,) [T]."""
        field = np.empty_like(times)
        for stretch, part in self.history.pieces(times):
            field[part] = stretch.field(times[part], self._edges)
        return field
