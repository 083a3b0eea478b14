"""What the models of a family of generators have in common: waveforms and limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True)
class Waveform:
    """A waveform that a family can make.

    Attributes:
        word: as the manual prints it.
        top: its highest frequency [Hz].
        bottom: its lowest frequency [Hz].
        crest: peak to peak over r.m.s.
        bursts: whether it can come in bursts.
        sweeps: whether its frequency can be swept.
    """

    word: str
    top: float
    bottom: float = 1e-6
    crest: float = 2.0
    bursts: bool = True
    sweeps: bool = True

    @cached_property
    def short(self) -> str:
        """The word in an answer."""
        return "".join(c for c in self.word if not c.islower())


@dataclass(frozen=True)
class Family:
    """What the models of a family have in common, beside their rows.

    Attributes:
        waveforms: that it can make.
        square: the limits of the duty cycle of a square wave [%] at a frequency [Hz].
        arb: the word for arbitrary waveforms.
        library: names of the arbitrary waveforms that it is made with.
        least_vpp: smallest amplitude into 50 Ω [V].
        shortest_pulse: width of it [s].
        shortest_edge: of a pulse [s].
        longest_burst: period of bursts, at most [s].
        burst_rest: the pause between two bursts, at least [s].
        points: fewest and most samples of an arbitrary waveform.
        room: samples in the memory for them.
        edge_part: an edge is no longer than this part of the shorter half of a pulse.
    """

    waveforms: tuple[Waveform, ...]
    square: Callable[[float], tuple[float, float]]
    arb: str
    library: tuple[str, ...]
    least_vpp: float
    shortest_pulse: float
    shortest_edge: float
    longest_burst: float
    burst_rest: float
    points: tuple[int, int]
    room: int
    edge_part: float = 0.625

    def waveform(self, short: str) -> Waveform:
        """Return the waveform with this short name."""
        return next(waveform for waveform in self.waveforms if waveform.short == short)
