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

    word: as the manual prints it; top, bottom: of its frequency [Hz]; crest: peak to peak over r.m.s.
    """

    word: str
    top: float
    bottom: float = 1e-6
    crest: float = 2.0
    bursts: bool = True
    sweeps: bool = True

    @cached_property
    def short(self) -> str:
        """What a query answers."""
        return "".join(c for c in self.word if not c.islower())


@dataclass(frozen=True)
class Family:
    """What the models of a family have in common, beside their rows.

    least_vpp: smallest amplitude into 50 Ω [V]; shortest_pulse, shortest_edge [s]; edge_part: an edge is no longer than
    this part of the shorter half of a pulse; square: the limits of the duty cycle [%] at a frequency [Hz];
    longest_burst [s], burst_rest [s]: of bursts; arb: the word for arbitrary waveforms; library: those that it is made
    with; points: how many an arbitrary waveform may have; room: of the memory for them.
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
        """The waveform with this short name."""
        return next(waveform for waveform in self.waveforms if waveform.short == short)
