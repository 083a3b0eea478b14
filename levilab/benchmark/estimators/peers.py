"""What a user would otherwise do for a frequency of light pulses; each knows that it lies between 20 and 45 Hz."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Callable

Array = NDArray[np.float64]

LOW, HIGH = 20.0, 45.0


def fft_peak(samples: Array, rate: float) -> float:
    """Return the highest line behind a Hann window, placed between the bins by a parabola through three logarithms."""
    n = samples.size
    height = np.abs(np.fft.rfft((samples - samples.mean()) * np.hanning(n)))
    first = int(LOW * n / rate)
    peak = first + int(np.argmax(height[first : int(HIGH * n / rate)]))
    return (peak + _vertex(np.log(height[peak - 1 : peak + 2]))) * rate / n


def autocorrelation(samples: Array, rate: float) -> float:
    """Return one over the lag at which the trace resembles itself most, placed by a parabola."""
    n = samples.size
    power = np.abs(np.fft.rfft(samples - samples.mean(), 2 * n)) ** 2
    alike = np.fft.irfft(power)
    first = int(rate / HIGH)
    peak = first + int(np.argmax(alike[first : int(rate / LOW)]))
    return float(rate / (peak + _vertex(alike[peak - 1 : peak + 2])))


def mean_period(samples: Array, rate: float) -> float:
    """Return one over the mean interval of scipy's find_peaks above half the height, half a turn apart at least."""
    from scipy.signal import find_peaks

    peaks, _ = find_peaks(samples, height=0.5 * float(samples.max()), distance=int(0.5 * rate / HIGH))
    return float((peaks.size - 1) * rate / (peaks[-1] - peaks[0]))


def _vertex(three: Array) -> float:
    a, b, c = three
    return float(0.5 * (a - c) / (a - 2 * b + c))


PEERS: dict[str, Callable[[Array, float], float]] = {
    "FFT peak, interpolated": fft_peak,
    "autocorrelation": autocorrelation,
    "find_peaks, mean period": mean_period,
}
