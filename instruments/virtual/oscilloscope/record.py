"""A record of a virtual oscilloscope, the inputs it was taken from, and the search for its trigger.

A record keeps the time of its trigger and the settings it was taken with, not its samples: a read of a piece of it
samples the signal for that piece again.  So 24 million points need the memory of one piece, and the signals must be
functions of time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from instruments.virtual.core.signal import Signal

Codes = NDArray[np.uint8]

#: Samples taken from a signal at once, and at which places a record is cut into pieces: a multiple of what one block
#: of the DS1000Z holds, so that reading block by block samples every point once.
PIECE = 250_000
#: The coarsest look of the trigger at the signal [s]: a pulse of 3 % of a turn at 60 Hz lasts 0.5 ms.
COARSEST = 50e-6
#: Number of looks that is as fine as the record; a signal too fast for the coarse ones has triggered by then.
_FINE_LOOKS = 100_000


@dataclass(frozen=True)
class Input:
    """One channel as it was set when the scope was armed.

    factor: of the probe, negative if inverted; mean: what the coupling takes away [V]; volts_per_code: of the
    converter; zero: the code of 0 V; lowest, highest: the codes of a clipped trace.
    """

    signal: Signal
    factor: float
    mean: float
    volts_per_code: float
    zero: int
    lowest: int
    highest: int

    def volts(self, start: float, step: float, n: int) -> NDArray[np.float64]:
        """Return the voltage that the scope shows for the one at the probe's tip."""
        return self.factor * (self.signal(start, step, n) - self.mean)

    def codes(self, start: float, step: float, n: int) -> Codes:
        """Return the converter's codes of the same samples."""
        codes = np.rint(self.volts(start, step, n) / self.volts_per_code) + self.zero
        return np.asarray(np.clip(codes, self.lowest, self.highest), dtype=np.uint8)

    def shown(self, codes: Codes) -> NDArray[np.float64]:
        """Return the voltages that codes stand for."""
        return (codes.astype(np.float64) - self.zero) * self.volts_per_code


@dataclass(frozen=True, eq=False)
class Record:
    """One acquisition.

    trigger: when it was triggered [s]; forced: without an edge; rate: samples per second; points: in memory;
    origin: of the first sample, counted from the trigger [s]; done: when the last sample was taken [s];
    screen: where the screen begins [s from the trigger] and how long it is [s].
    """

    trigger: float
    forced: bool
    rate: float
    points: int
    origin: float
    screen: tuple[float, float]
    inputs: Mapping[int, Input]
    _kept: dict[tuple[int, int, float], tuple[int, Codes]] = field(default_factory=dict)

    @property
    def done(self) -> float:
        """When the last sample was taken [s]."""
        return self.trigger + self.origin + self.points / self.rate

    def trigger_at(self, trigger: float, *, forced: bool) -> Record:
        """Return the same record, triggered at this time [s]."""
        return replace(self, trigger=trigger, forced=forced, _kept={})

    def codes(self, channel: int, first: int, count: int, *, of: int, start: float, step: float) -> Codes:
        """Return codes first … first + count − 1 of those that begin at start [s from the trigger], a step apart [s].

        of: how many there are.
        """
        pieces = range(first // PIECE, -(-(first + count) // PIECE))
        whole = [self._piece(channel, k, of, start, step) for k in pieces]
        offset = first - pieces.start * PIECE if pieces else 0
        return (whole[0] if len(whole) == 1 else np.concatenate([np.empty(0, np.uint8), *whole]))[
            offset : offset + count
        ]

    def _piece(self, channel: int, k: int, of: int, start: float, step: float) -> Codes:
        """Cut at fixed places, so that noise of a seeded signal is the same whichever way a record is read."""
        key = (channel, of, step)
        kept = self._kept.get(key)
        if kept is None or kept[0] != k:
            begin = self.trigger + start + k * PIECE * step
            kept = (k, self.inputs[channel].codes(begin, step, min(PIECE, of - k * PIECE)))
            self._kept.clear()
            self._kept[key] = kept
        return kept[1]


@dataclass
class Edge:
    """Looks for the first edge in a signal, and goes on where it was when it looks again.

    slopes: 1.0 rising, −1.0 falling; step: between looks, fine: how well the crossing is to be placed [s].
    """

    volts: Signal
    level: float
    hysteresis: float
    slopes: tuple[float, ...]
    step: float
    fine: float
    position: float
    _armed: list[bool] = field(default_factory=list)
    _looks: int = 0

    def until(self, stop: float) -> float | None:
        """Return the time of the first edge, if it is before stop [s]."""
        self._armed = self._armed or [False] * len(self.slopes)
        while self.position < stop:
            n = min(_FINE_LOOKS, math.ceil((stop - self.position) / self.step) + 1)
            volts, before = self.volts(self.position, self.step, n), list(self._armed)
            looks = ((self._first(k, slope * volts, slope), slope) for k, slope in enumerate(self.slopes))
            found = [(i, slope) for i, slope in looks if i is not None]
            if found:
                i, slope = min(found)
                at = self._place(self.position + (i - 1) * self.step, self.step, slope)
                self._armed = before  # the last look may lie behind the stop: such an edge is found again
                return at if at < stop else None
            self.position += (n - 1) * self.step
            self._looks += n
            if self._looks >= _FINE_LOOKS:
                self.step = max(self.step, COARSEST)
        return None

    def _first(self, k: int, volts: NDArray[np.float64], slope: float) -> int | None:
        """Return the first sample at or above the level after one below it less the hysteresis."""
        level = slope * self.level
        begin = 0
        if not self._armed[k]:
            below = volts < level - self.hysteresis
            begin = int(np.argmax(below))
            if not below[begin]:
                return None
        above = volts[begin:] >= level
        i = int(np.argmax(above))
        if above[i]:
            return begin + i
        self._armed[k] = True
        return None

    def _place(self, start: float, step: float, slope: float) -> float:
        """Return the time of the crossing between two looks, by halving."""
        while step > self.fine:
            step /= 1000
            volts = self.volts(start, step, 1001)
            above = slope * volts >= slope * self.level
            turns = np.flatnonzero(above[1:] != above[:-1])
            # an edge that only the coarse look saw stands, but for the rounding of its time, at that look
            start += step * (int(turns[0]) if turns.size else 999)
        before, after = self.volts(start, step, 2)
        part = (self.level - before) / (after - before) if after != before else 0.5
        return start + step * float(min(max(part, 0.0), 1.0))
