"""The drive coil's field in time, as a generator puts it there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.virtual.generator.channel import Output
from instruments.virtual.generator.voltage import voltage
from levilab.world.timeline import Timeline

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Stretch:
    """From some time on.  output: amplitude and offset in T; origin [s]: when its phase was turns."""

    output: Output
    origin: float
    turns: float

    def field(self, times: Array) -> Array:
        """Return the field at times within it [T]."""
        since, burst = times - self.origin, self.output.burst
        if burst is None or burst.period is None:
            return voltage(self.output, self.turns + self.output.frequency * since, times)
        turns = self.output.frequency * (since % burst.period)
        # 1e-9 of a turn: the end of a burst is no sample of its beginning
        playing = turns < burst.cycles - 1e-9
        return np.where(playing, voltage(self.output, turns, times), self.output.offset)


class Coil:
    """The field of a coil that is driven.

    Where the frequency changes the phase runs on; a signal begins at its start where there was none, and bursts do.

    >>> coil = Coil()
    >>> coil.change(1.0, Output("SQU", 2.0, 4e-4, 0.0))
    >>> coil.field(np.array([0.9, 1.1, 1.3])).tolist()
    [0.0, 0.0004, -0.0004]
    """

    def __init__(self) -> None:
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

    @staticmethod
    def _next(last: _Stretch, time: float, output: Output) -> _Stretch:
        if not last.output.amplitude:
            return _Stretch(output, time, 0.0)
        if (
            output.burst is not None and output.burst.period is not None
        ):  # bursts that start by themselves keep their rhythm
            same = (last.output.burst, last.output.frequency) == (output.burst, output.frequency)
            return _Stretch(output, last.origin if same else time, 0.0)
        turns = last.turns + last.output.frequency * (time - last.origin)
        # the random bits repeat after 127 turns, all others after one
        return _Stretch(output, time, turns % 127.0)

    def turns(self, time: float) -> float:
        """Return the turns that the waveform has made at this time, without the phase that it is set to."""
        now = self.history.at(time)
        return now.turns + now.output.frequency * (time - now.origin)

    def field(self, times: Array) -> Array:
        """Return the field at these times, shape (n,) [T]."""
        field = np.empty_like(times)
        for stretch, part in self.history.pieces(times):
            field[part] = stretch.field(times[part])
        return field
