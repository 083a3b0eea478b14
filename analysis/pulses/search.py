"""Pulses of a trace, found roughly: a shorter trace, smoothed as its pulses ask for, and where that stands out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.pulses.regression import median

#: Widths of the smoothing that are tried, in bins of the shortened trace.
WIDTHS = (1, 2, 4, 8, 16)
#: Of this many values the quantiles are taken.
SAMPLE = 2048
#: Height of an event in standard deviations of the noise, at least, and where pulses are higher.
STANDS_OUT, CLEARLY = 3.3, 4.2


#: Pulses last about as long as their pauses where a sixth of the values are farther from the middle, in units of noise.
WIDE = 4.0


@dataclass(frozen=True)
class Events:
    """Times [s] from the first sample, shape (n,).

    contrast: how many standard deviations the pulses stand out; sign: of the pulses; width: of the pulses at the
    threshold, without the smoothing [s].
    """

    times: Array
    contrast: float
    sign: int
    width: float


def shorten(samples: Array, factor: int) -> Array:
    """Return means of `factor` samples each, shape (n // factor,); NaN where one of them is."""
    whole = samples.size // factor * factor
    if factor == 1:
        return samples
    return np.asarray(samples[:whole].reshape(-1, factor) @ np.full(factor, 1 / factor))


def noise_of(bins: Array) -> float:
    """Return standard deviation of a bin's noise, from the differences of neighbours."""
    step = max(bins.size // SAMPLE, 1)
    steps = np.abs(bins[1::step] - bins[:-1:step][: bins[1::step].size])
    return float(np.sqrt(np.mean(np.sort(steps)[: steps.size * 2 // 3] ** 2))) / 0.753 + 1e-30


def find_events(bins: Array, rate: float) -> Events:
    """Return the centres of the peaks in the bins; rate: bins per second."""
    total = np.zeros(bins.size + 1)
    np.cumsum(bins - bins[0], out=total[1:])
    noise = noise_of(bins)
    best = (0.0, 1, 1, 0.0)
    for width in WIDTHS:
        if width > bins.size // 8:
            break
        step = max((bins.size - width) // SAMPLE, 1)
        thin = np.sort((total[width::step] - total[:-width:step]) / width)
        contrast, sign, threshold = _contrast(thin, noise / np.sqrt(width))
        if contrast > 1.05 * best[0]:
            best = contrast, width, sign, threshold
    contrast, width, sign, threshold = best
    smooth = total[width:] - total[:-width]  # sums: means would be one more pass
    threshold *= sign * width
    stands = smooth > threshold if sign > 0 else smooth < threshold
    above = np.flatnonzero(stands[1:] != stands[:-1])
    if above.size and stands[0]:
        above = above[1:]
    above = above[: above.size // 2 * 2]
    up, down = above[::2], above[1::2]
    apart = np.flatnonzero(up[1:] - down[:-1] > max(width // 2, 1))
    up = np.concatenate([up[:1], up[1:][apart]])
    down = np.concatenate([down[:-1][apart], down[-1:]])
    times = (0.5 * (_crossing(smooth, up, threshold) + _crossing(smooth, down, threshold)) + 0.5 * width) / rate
    wide = median(_crossing(smooth, down, threshold) - _crossing(smooth, up, threshold)) if up.size else 0.0
    return Events(times, contrast, sign, float(np.sqrt(max(wide**2 - 0.46 * width**2, 1.0))) / rate)


def _crossing(smooth: Array, at: NDArray[np.intp], threshold: float) -> Array:
    """Return where the line between a value and the next crosses the threshold."""
    a, b = smooth[at], smooth[at + 1]
    return np.asarray(at + (threshold - a) / (b - a))


def _contrast(thin: Array, noise: float) -> tuple[float, int, float]:
    """Return how far the highest (or lowest) values stand from the middle, which of them, and a threshold between."""
    n = thin.size
    middle = thin[n // 2]
    low, high = middle - thin[n // 6], thin[n - 1 - n // 6] - middle
    quiet = float(min(low, high)) / 0.967  # a sixth lies below -0.967 sigma
    sigma = min(quiet, noise) + 1e-30
    if max(low, high) > WIDE * sigma and thin[n - 1 - n // 6] - thin[n // 6] > 0.5 * (
        thin[-1 - n // 64] - thin[n // 64]
    ):
        reach = float(thin[-1 - n // 64] - thin[n // 64])
        return reach / sigma, 1, float(thin[n // 64] + 0.5 * reach)
    reach_of = {}
    for sign in (1, -1):
        ends = [sign * (thin[round((p if sign > 0 else 1 - p) * (n - 1))] - middle) for p in (0.985, 0.995)]
        reach_of[sign] = max(0.5 * ends[0], 0.3 * ends[1]), ends
    sign = 1 if reach_of[1][0] >= reach_of[-1][0] else -1
    level, ends = reach_of[sign]
    return (
        float(ends[0] + ends[1]) / sigma,
        sign,
        float(sign * middle + max(level, STANDS_OUT * sigma, min(0.75 * float(ends[0]), CLEARLY * sigma))),
    )
