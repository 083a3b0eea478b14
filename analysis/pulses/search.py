"""Pulses of a trace, found roughly: a shorter trace, smoothed as its pulses ask for, and where that stands out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Widths of the smoothing that are tried, in bins of the shortened trace.
WIDTHS = (1, 2, 4, 8, 16, 32)
#: Of this many values the quantiles are taken.
SAMPLE = 8192
#: What exceeds so many standard deviations of the noise is an event.
STANDS_OUT = 3.3


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
    """Means of `factor` samples each, shape (n // factor,); NaN where one of them is."""
    whole = samples.size // factor * factor
    if factor == 1:
        return samples
    return np.asarray(samples[:whole].reshape(-1, factor) @ np.full(factor, 1 / factor))


def find_events(bins: Array, rate: float) -> Events:
    """Centres of what stands out of the bins; rate: bins per second."""
    total = np.concatenate([[0.0], np.cumsum(bins - bins[0])])
    best = (0.0, 1, 1, 0.0)
    for width in WIDTHS:
        if width > bins.size // 8:
            break
        step = max((bins.size - width) // SAMPLE, 1)
        thin = np.sort((total[width::step] - total[:-width:step]) / width)
        contrast, sign, threshold = _contrast(thin)
        if contrast > 1.05 * best[0]:
            best = contrast, width, sign, threshold
    contrast, width, sign, threshold = best
    smooth = sign * (total[width:] - total[:-width]) / width
    above = np.flatnonzero(np.diff((smooth > threshold).view(np.int8)))
    if above.size and smooth[0] > threshold:
        above = above[1:]
    above = above[: above.size // 2 * 2]
    up, down = above[::2], above[1::2]
    apart = np.flatnonzero(up[1:] - down[:-1] > max(width // 2, 1))
    up = np.concatenate([up[:1], up[1:][apart]])
    down = np.concatenate([down[:-1][apart], down[-1:]])
    times = (0.5 * (_crossing(smooth, up, threshold) + _crossing(smooth, down, threshold)) + 0.5 * width) / rate
    wide = float(np.median(_crossing(smooth, down, threshold) - _crossing(smooth, up, threshold))) if up.size else 0.0
    return Events(times, contrast, sign, float(np.sqrt(max(wide**2 - 0.46 * width**2, 1.0))) / rate)


def _crossing(smooth: Array, at: NDArray[np.intp], threshold: float) -> Array:
    """Where the line between a value and the next crosses the threshold."""
    a, b = smooth[at], smooth[at + 1]
    return np.asarray(at + (threshold - a) / (b - a))


def _contrast(thin: Array) -> tuple[float, int, float]:
    """How far the highest (or lowest) values stand from the middle, which of them, and a threshold between."""
    n = thin.size
    middle = thin[n // 2]
    low, high = middle - thin[n // 6], thin[n - 1 - n // 6] - middle
    sigma = float(min(low, high)) / 0.967 + 1e-30  # a sixth lies below -0.967 sigma
    reach = {}
    for sign in (1, -1):
        ends = [
            sign * (thin[round(p * (n - 1)) if sign > 0 else round((1 - p) * (n - 1))] - middle) for p in (0.985, 0.995)
        ]
        reach[sign] = max(0.5 * ends[0], 0.3 * ends[1]), ends
    sign = 1 if reach[1][0] >= reach[-1][0] else -1
    level, ends = reach[sign]
    return float(ends[0] + ends[1]) / sigma, sign, float(sign * middle + max(level, STANDS_OUT * sigma))
