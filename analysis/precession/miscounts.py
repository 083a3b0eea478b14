"""A line that outliers do not move, and the points off it that a miscount explains.

Source: Theil, Proc. R. Neth. Acad. Sci. 53, 386 (1950), Sen, J. Am. Stat. Assoc. 63, 1379 (1968): the median of the
slopes between all pairs of points withstands up to 29 % of outliers.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.budget import printed_step, u_of_step
from analysis.precession.gates import Gates, whole_counts
from analysis.uncertainty import Estimate, student

#: From more points every k-th, in the order of x, is used: there are n²/2 pairs.
MOST_PAIRED = 500
#: A point farther off the line, in standard deviations, is examined.
FAR = 5.0
#: The median line goes through two of three points, whose median deviation is then 0: it shows no scatter.
_NO_SCATTER = 3
#: Counted over true frequency when a threshold sees each period twice, misses every other one, and the like.
RATIOS = ((1, 2), (2, 1), (1, 3), (3, 1), (2, 3), (3, 2))
#: Turns differ, so a miscount in every turn has these ratios to within 1 %.
_NEAR = 0.01
#: A point is off by whole counts if it is within a fifth of one, and one count is at least three standard deviations.
_OF_A_COUNT, _STANDS_OUT = 0.2, 3.0
#: Standard deviation of a normal distribution, over the median distance from its median.
MAD = 1.482602218505602


@dataclass(frozen=True)
class Robust:
    """The median line through all points, shown beside the fit: with 68 % intervals, u being half their width."""

    slope: Estimate
    intercept: Estimate
    scatter: float


@dataclass(frozen=True)
class Miscount:
    """A point far off the median line.

    Attributes:
        index: of the point.
        times: (1, 2) if half the line's frequency was counted, and so on; None if no ratio explains it.
        counts: whole counts too many in a gate; None if they do not explain it.

    Without either, no cause is known.
    """

    index: int
    times: tuple[int, int] | None = None
    counts: int | None = None

    @property
    def named(self) -> bool:
        """Whether a miscount explains it."""
        return self.times is not None or self.counts is not None


def robust_line(x: Array, y: Array) -> Robust:
    """Return the median line: the slope of Theil and Sen, and the median of its residuals.

    Args:
        x: shape (n,), not all alike [Hz].
        y: shape (n,) [Hz].
    """
    order = np.argsort(x, kind="stable")
    chosen = np.unique(np.append(order[:: -(-x.size // MOST_PAIRED)], order[-1]))  # both ends among them
    slope, low, high = _median_slope(x[chosen], y[chosen])
    left = y - slope * x
    intercept = float(np.median(left))
    scatter = MAD * float(np.median(np.abs(left - intercept)))
    ends = [float(np.median(y - end * x)) for end in (high, low)]
    return Robust(
        Estimate(slope, (high - low) / 2, "1", (low, high)),
        Estimate(intercept, abs(ends[1] - ends[0]) / 2, "Hz", (min(ends), max(ends))),
        scatter,
    )


def _median_slope(x: Array, y: Array) -> tuple[float, float, float]:
    """Return the median of the slopes of all pairs, and the ends of its 68 % interval.

    Sen, eq. (2.6): the variance of Kendall's statistic of the residuals depends on ties in x alone.  SciPy's
    theilslopes subtracts ties in y as well, and its variance becomes negative if there are many.
    """
    i, j = np.triu_indices(x.size, 1)
    apart = x[j] != x[i]
    slopes = np.sort((y[j] - y[i])[apart] / (x[j] - x[i])[apart])
    _, alike = np.unique(x, return_counts=True)
    counts = np.append(-alike, x.size).astype(np.float64)
    size = np.abs(counts)
    variance = float(np.sum(np.sign(counts) * size * (size - 1) * (2 * size + 5))) / 18
    width = math.sqrt(variance)
    low = max(round((slopes.size - width) / 2) - 1, 0)
    high = min(round((slopes.size + width) / 2), slopes.size - 1)
    return float(np.median(slopes)), float(slopes[low]), float(slopes[high])


def find_miscounts(
    x: Array,
    y: Array,
    u: Array | None,
    robust: Robust,
    *,
    gate_s: float | None = None,
    gates: Sequence[Gates] | None = None,
) -> list[Miscount]:
    """Find the points far off the median line, and what the counter counted there.

    Without u few points hardly show their scatter: one that no miscount explains is farther off than `FAR` standard
    deviations by Student's t.  Of lines through five points 2 % have such a point by chance, through eight 0.3 %: the
    median deviation is less certain than a standard deviation of n − 2 degrees of freedom.  Of rounded numbers most may
    lie on the line, and those beside it by a step are no miscounts.

    Args:
        x: shape (n,) [Hz].
        y: shape (n,) [Hz].
        u: standard uncertainty of y, shape (n,) [Hz], if it is known.
        robust: the median line.
        gate_s: of the counter [s]; without it, and without gates, whole counts are not recognised.
        gates: behind each point, if they are known: each of them must be off by the same counts.
    """
    line = float(robust.intercept.value or 0.0) + float(robust.slope.value or 0.0) * x
    rounding = u_of_step(printed_step(y.tolist()) or 0.0)
    usual = np.maximum(max(robust.scatter, rounding), 1e-9 * np.abs(line))
    deviation = usual if u is None else np.maximum(u, usual)
    far = FAR
    if u is None:
        far = student(x.size - 2, FAR) if x.size > _NO_SCATTER else math.inf
    found = []
    for i in np.flatnonzero(np.abs(y - line) > FAR * deviation).tolist():
        sigma, expected = float(deviation[i]), float(line[i])
        times = _times(float(y[i]), expected, sigma)
        if times is not None:
            one = Miscount(i, times)
        elif gates is not None:
            one = Miscount(i, counts=whole_counts(gates[i], expected) or None)
        else:
            one = Miscount(i, counts=_counts(float(y[i]) - expected, sigma, gate_s))
        if one.named or abs(float(y[i]) - expected) > far * sigma:
            found.append(one)
    return found


def _times(y: float, expected: float, sigma: float) -> tuple[int, int] | None:
    for above, below in RATIOS:
        there = expected * above / below
        if abs(y - there) < max(_NEAR * there, _STANDS_OUT * sigma * above / below):
            return above, below
    return None


def _counts(off: float, sigma: float, gate_s: float | None) -> int | None:
    if gate_s is None or _STANDS_OUT * sigma * gate_s > 1 - _OF_A_COUNT:
        return None
    counts = round(off * gate_s)
    near = abs(off * gate_s - counts) < _OF_A_COUNT
    return counts if counts and near else None
