"""The drive coil's field in time, as a generator puts it there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Callable

Array = NDArray[np.float64]


def _sawtooth(turns: Array) -> Array:
    return np.asarray(2 * ((turns + 0.5) % 1.0) - 1)


#: Waveforms of amplitude 1 by their short name: turns since the start → value.
WAVEFORMS: dict[str, Callable[[Array], Array]] = {
    "SIN": lambda turns: np.asarray(np.sin(2 * np.pi * turns)),
    "SQU": lambda turns: np.where(turns % 1.0 < 0.5, 1.0, -1.0),
    "TRI": lambda turns: np.asarray(1 - 4 * np.abs((turns + 0.25) % 1.0 - 0.5)),
    "RAMP": _sawtooth,
    "DC": np.zeros_like,
}


@dataclass(frozen=True)
class _Stretch:
    """From start [s] on: waveform, frequency [Hz], amplitude [T], and the turns the phase had made at the start."""

    start: float
    waveform: str
    frequency: float
    amplitude: float
    turns: float


class Coil:
    """The field of a coil that is driven; where the frequency changes the phase runs on.

    >>> coil = Coil()
    >>> coil.change(1.0, "SQU", 2.0, 4e-4)
    >>> coil.field(np.array([0.9, 1.1, 1.3])).tolist()
    [0.0, 0.0004, -0.0004]
    """

    def __init__(self) -> None:
        self._stretches = [_Stretch(-np.inf, "DC", 0.0, 0.0, 0.0)]

    def change(self, time: float, waveform: str, frequency: float, amplitude: float) -> None:
        """From this time [s] on it is this: short name, [Hz], amplitude [T]; what was said of later times is gone."""
        while self._stretches[-1].start >= time:
            self._stretches.pop()
        last = self._stretches[-1]
        turns = last.turns + last.frequency * (time - last.start) if last.amplitude else 0.0
        self._stretches.append(_Stretch(time, waveform, frequency, amplitude, turns % 1.0))

    def field(self, times: Array) -> Array:
        """The field at increasing times, shape (n,) [T]."""
        field = np.zeros_like(times)
        starts = np.array([stretch.start for stretch in self._stretches])
        index = np.searchsorted(starts, times, side="right") - 1
        for i in np.unique(index):
            stretch, here = self._stretches[i], index == i
            if stretch.amplitude and stretch.waveform in WAVEFORMS:
                turns = stretch.turns + stretch.frequency * (times[here] - stretch.start)
                field[here] = stretch.amplitude * WAVEFORMS[stretch.waveform](turns)
        return field
