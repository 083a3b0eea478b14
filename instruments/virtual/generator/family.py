"""What the models of a family of generators have in common: their waveforms, and their limits."""

from __future__ import annotations

from dataclasses import dataclass
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

    @property
    def short(self) -> str:
        """What a query answers."""
        return "".join(c for c in self.word if not c.islower())


@dataclass(frozen=True)
class Family:
    """What the models of a family have in common.

    least_vpp: smallest amplitude into 50 Ω [V]; shortest_pulse, shortest_edge, longest_edge [s]; longest_period: of
    pulses [s]; edge_part: an edge is no longer than this part of the shorter half of a pulse; square: the limits of
    the duty cycle [%] at a frequency [Hz]; most_cycles, longest_burst [s], burst_rest [s]: of bursts;
    longest_delay: of a trigger [s]; longest_sweep [s]; arb: the word for arbitrary waveforms;
    points: how many an arbitrary waveform may have; room: of the memory for them.
    """

    waveforms: tuple[Waveform, ...]
    square: Callable[[float], tuple[float, float]]
    arb: str
    least_vpp: float
    shortest_pulse: float
    shortest_edge: float
    longest_edge: float
    first_edge: float
    longest_period: float
    most_cycles: float
    longest_burst: float
    burst_rest: float
    longest_delay: float
    longest_sweep: float
    points: tuple[int, int]
    room: int
    edge_part: float = 0.625

    def waveform(self, short: str) -> Waveform:
        """The waveform with this short name."""
        return next(waveform for waveform in self.waveforms if waveform.short == short)
