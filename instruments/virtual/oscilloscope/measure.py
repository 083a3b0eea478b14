"""What an oscilloscope measures in a trace: levels, edges, widths.

Levels as in IEEE 181: top and base are the most frequent voltages of the upper and the lower half; edges cross the
middle between them, with a hysteresis; rise and fall go from 10 % to 90 %.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from instruments.virtual.core.signal import crossings

Volts = NDArray[np.float64]


#: A level of the histogram must hold this part of the samples, else the extreme itself is taken.
_FLAT = 0.05
#: A pulse must come back by this part of the amplitude before it counts again; less than the 10 % of a rise.
_HYSTERESIS = 0.05


@dataclass(frozen=True, eq=False)
class Measured:
    """A trace and what follows from it.  volts: shape (n,) [V]; step: between samples [s]; start: of the first [s]."""

    volts: Volts
    step: float
    start: float

    @cached_property
    def top(self) -> float:
        """The upper level [V]."""
        return _level(self.volts, upper=True)

    @cached_property
    def base(self) -> float:
        """The lower level [V]."""
        return _level(self.volts, upper=False)

    def crossings(self, part: float, *, rising: bool) -> Volts:
        """Return the places where the trace crosses base + part·(top − base), in samples, interpolated."""
        amplitude = self.top - self.base
        sign = 1.0 if rising else -1.0
        level = sign * (self.base + part * amplitude)
        return crossings(sign * self.volts, level, _HYSTERESIS * amplitude) if amplitude > 0 else np.empty(0)

    @cached_property
    def rises(self) -> Volts:
        """Rising edges, in samples."""
        return self.crossings(0.5, rising=True)

    @cached_property
    def falls(self) -> Volts:
        """Falling edges, in samples."""
        return self.crossings(0.5, rising=False)

    @cached_property
    def period(self) -> float:
        """Mean time between edges of the same kind [s]; raises NotMeasurable if there are not two."""
        found = self.rises if self.rises.size > 1 else self.falls
        if found.size < 2:
            raise NotMeasurable
        return float((found[-1] - found[0]) / (found.size - 1)) * self.step

    @cached_property
    def positive_width(self) -> float:
        """Mean time from a rising edge to the next falling one [s]."""
        return _mean_gap(self.rises, self.falls) * self.step

    @cached_property
    def negative_width(self) -> float:
        """Mean time from a falling edge to the next rising one [s]."""
        return _mean_gap(self.falls, self.rises) * self.step

    def transition(self, *, rising: bool) -> float:
        """Return the mean time from 10 % to 90 % or back [s]."""
        first, last = (0.1, 0.9) if rising else (0.9, 0.1)
        return _mean_gap(self.crossings(first, rising=rising), self.crossings(last, rising=rising)) * self.step

    def whole_periods(self) -> Volts:
        """Return the samples from the first rising edge to the last."""
        if self.rises.size < 2:
            raise NotMeasurable
        return self.volts[round(self.rises[0]) : round(self.rises[-1])]

    @property
    def amplitude(self) -> float:
        """From base to top [V]; raises NotMeasurable where there is none."""
        if self.top == self.base:
            raise NotMeasurable
        return self.top - self.base


class NotMeasurable(Exception):
    """The trace does not show what a measurement needs."""


def _level(volts: Volts, *, upper: bool) -> float:
    low, high = float(volts.min()), float(volts.max())
    if high <= low:
        return low
    middle = (low + high) / 2
    half = volts[volts >= middle] if upper else volts[volts < middle]
    counts, places = np.histogram(half, bins=64)
    most = int(np.argmax(counts))
    if counts[most] < _FLAT * volts.size:
        return high if upper else low
    return float(np.median(half[(half >= places[most]) & (half <= places[most + 1])]))


def _mean_gap(starts: Volts, ends: Volts) -> float:
    """Return the mean way from each start to the end behind it, in samples."""
    following = np.searchsorted(ends, starts)
    there = following < ends.size
    if not there.any():
        raise NotMeasurable
    return float(np.mean(ends[following[there]] - starts[there]))


#: By the name they have in both makers' commands, in full.
MEASUREMENTS: dict[str, Callable[[Measured], float]] = {
    "VMAX": lambda t: float(t.volts.max()),
    "VMIN": lambda t: float(t.volts.min()),
    "VPP": lambda t: float(np.ptp(t.volts)),
    "VTOP": lambda t: t.top,
    "VBASE": lambda t: t.base,
    "VAMPLITUDE": lambda t: t.top - t.base,
    "VAVERAGE": lambda t: float(t.volts.mean()),
    "VRMS": lambda t: float(np.sqrt(np.mean(t.volts**2))),
    "PVRMS": lambda t: float(np.sqrt(np.mean(t.whole_periods() ** 2))),
    "VARIANCE": lambda t: float(t.volts.var()),
    "SDEVIATION": lambda t: float(t.volts.std()),
    "VUPPER": lambda t: t.base + 0.9 * (t.top - t.base),
    "VMID": lambda t: (t.top + t.base) / 2,
    "VLOWER": lambda t: t.base + 0.1 * (t.top - t.base),
    "OVERSHOOT": lambda t: (float(t.volts.max()) - t.top) / t.amplitude,
    "PRESHOOT": lambda t: (t.base - float(t.volts.min())) / t.amplitude,
    "AREA": lambda t: float(t.volts.sum()) * t.step,
    "PERIODAREA": lambda t: float(t.whole_periods().sum()) * t.step / max(1, t.rises.size - 1),
    "PERIOD": lambda t: t.period,
    "FREQUENCY": lambda t: 1 / t.period,
    "RISETIME": lambda t: t.transition(rising=True),
    "FALLTIME": lambda t: t.transition(rising=False),
    "PWIDTH": lambda t: t.positive_width,
    "NWIDTH": lambda t: t.negative_width,
    "PDUTY": lambda t: t.positive_width / t.period,
    "NDUTY": lambda t: t.negative_width / t.period,
    "TVMAX": lambda t: t.start + t.step * int(np.argmax(t.volts)),
    "TVMIN": lambda t: t.start + t.step * int(np.argmin(t.volts)),
    "PSLEWRATE": lambda t: 0.8 * (t.top - t.base) / t.transition(rising=True),
    "NSLEWRATE": lambda t: -0.8 * (t.top - t.base) / t.transition(rising=False),
    "PPULSES": lambda t: float(t.rises.size),
    "NPULSES": lambda t: float(t.falls.size),
    "PEDGES": lambda t: float(t.rises.size),
    "NEDGES": lambda t: float(t.falls.size),
}


def measure(name: str, trace: Measured) -> float | None:
    """Return one of the measurements, or None where the trace does not show enough for it.

    >>> square = np.repeat([0.0, 1.0, 0.0, 1.0, 0.0], 100)
    >>> measure("FREQUENCY", Measured(square, step=1e-3, start=0.0))
    5.0
    >>> measure("FREQUENCY", Measured(np.zeros(100), step=1e-3, start=0.0))
    """
    try:
        return MEASUREMENTS[name](trace)
    except (NotMeasurable, ZeroDivisionError):
        return None
