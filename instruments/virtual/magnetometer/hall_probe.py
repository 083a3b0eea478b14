"""A Hall probe in its place, and how a gaussmeter looks at the field there: steady, r.m.s. and peaks."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: An alternating field: duration [s] and number of samples of one reading.
_WINDOW, _LOOKS = 0.2, 512
#: A steady field: samples within the time constant of the filter.
_STEADY_LOOKS = 16


@dataclass(frozen=True)
class Reading:
    """What stood at the probe.

    instant: of the reading [s]; mode: as in RDGMODE; steady, rms, lowest, highest [T]; noise: in units of the last
    digit.
    """

    instant: float
    mode: int
    steady: float
    rms: float
    lowest: float
    highest: float
    noise: float


@dataclass(frozen=True)
class HallProbe:
    """A probe at its place.

    flux_density: along its axis, at a time [s] → [T]; zero_error: its reading without a field [T].
    """

    flux_density: Callable[[float], float]
    zero_error: float

    def look(self, instant: float, mode: int, time_constant: float, noise: float) -> Reading:
        """Read.  mode: as in RDGMODE; time_constant: of the filter for steady fields [s]; noise: see Reading."""
        steady = self.steady(instant, time_constant)
        if mode == 1:
            return Reading(instant, mode, steady, 0.0, steady, steady, noise)
        step = _WINDOW / _LOOKS
        field = self._sample(instant - _WINDOW + step * np.arange(1, _LOOKS + 1))
        rms, lowest, highest = float(field.std()), float(field.min()), float(field.max())
        return Reading(instant, mode, steady, rms, lowest, highest, noise)

    def steady(self, instant: float, time_constant: float) -> float:
        """Return the mean over the time constant, the probe's own zero error included [T]."""
        step = time_constant / _STEADY_LOOKS
        field = self._sample(instant - step * np.arange(_STEADY_LOOKS)[::-1])
        return float(field.mean()) + self.zero_error

    def _sample(self, times: NDArray[np.floating]) -> NDArray[np.float64]:
        return np.array([self.flux_density(time) for time in np.maximum(times, 0.0).tolist()])
