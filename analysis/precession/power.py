"""What it takes to tell a slope from 1: the power of the test, and the points, range or u that it needs.

Source: Cohen, Statistical Power Analysis (1988), §9: the noncentral t distribution as a normal one over that of the
scatter.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.precession.line import CONFIDENCE

if TYPE_CHECKING:
    from analysis.precession.line import Line

Array = NDArray[np.float64]

#: The slope that was published without an uncertainty, and how probable it should be that the test finds it.
OTHER_SLOPE, POWER = 1.05, 0.9
#: A sweep of more points is no answer any more.
MOST_POINTS = 1_000_000
#: Even three points distinguish a slope so many u from 1 almost certainly.
_CERTAIN = 100.0
#: For integrals over the distribution of the scatter: right to 1e-7.
_NODES = 200


@dataclass(frozen=True)
class Power:
    """What tells OTHER_SLOPE from 1 with POWER at 95 % confidence, two-sided, each change by itself.

    Attributes:
        slope: that the test is to distinguish from 1.
        now: probability that these points tell it.
        smallest_difference: from 1 that these points tell with POWER.
        points, points_needed: now, and with the same u spread over the same range; None: more than a million.
        range_hz, range_needed_hz: of the drive now, and with as many points of the same u.
        u_hz, u_needed_hz: of a point now, and at the same drive frequencies.
    """

    slope: float
    now: float
    smallest_difference: float
    points: int
    points_needed: int | None
    range_hz: float
    range_needed_hz: float
    u_hz: float
    u_needed_hz: float

    @property
    def enough(self) -> bool:
        """Whether these points suffice."""
        return self.now >= POWER


def probability_of_telling(difference: float, u_slope: float, degrees_of_freedom: int | None) -> float:
    """How probable it is that a two-sided test at 95 % tells a slope that differs so much from 1.

    Args:
        difference: of the slope from 1.
        u_slope: its standard uncertainty.
        degrees_of_freedom: of the scatter that u_slope is from; None: u_slope is known.

    >>> round(probability_of_telling(3.2415, 1.0, None), 3), round(probability_of_telling(0.0, 1.0, 7), 3)
    (0.9, 0.05)
    """
    from scipy.special import ndtr, ndtri, stdtrit

    level, shift = (1 + CONFIDENCE) / 2, abs(difference) / u_slope
    if degrees_of_freedom is None:
        limit = float(ndtri(level))
        return float(ndtr(shift - limit) + ndtr(-shift - limit))
    limit = float(stdtrit(degrees_of_freedom, level))
    share, weight = _shares(degrees_of_freedom)
    return float(np.sum(weight * (ndtr(shift - limit * share) + ndtr(-shift - limit * share))))


@functools.lru_cache(maxsize=8)
def _shares(degrees_of_freedom: int) -> tuple[Array, Array]:
    """By how much too small or large an estimated scatter is, with the probability of each, shape (n,) each.

    Its quantiles at the nodes of Gauss and Legendre.  SciPy's noncentral t distribution is no way: it is NaN for large
    shifts.
    """
    from scipy.special import chdtri

    node, weight = np.polynomial.legendre.leggauss(_NODES)
    return np.sqrt(chdtri(degrees_of_freedom, (1 - node) / 2) / degrees_of_freedom), weight / 2


def what_it_takes(line: Line, range_hz: float, u_hz: float) -> Power | None:
    """What tells a slope of 1.05 from 1, from the points at hand; None where the slope has no u.

    Args:
        line: through the points.
        range_hz: of the drive.
        u_hz: of a point: the typical u, or the scatter about the line.
    """
    if not line.u_slope:
        return None
    u_slope, difference = line.u_slope, OTHER_SLOPE - 1
    dof = None if line.u_known else line.degrees_of_freedom
    reach = _ratio_for(POWER, dof)  # difference in units of u(slope)
    shrink = u_slope * reach / difference  # by which u(slope) is too large
    return Power(
        slope=OTHER_SLOPE,
        now=probability_of_telling(difference, u_slope, dof),
        smallest_difference=reach * u_slope,
        points=line.n,
        points_needed=_points_needed(line, difference),
        range_hz=range_hz,
        range_needed_hz=range_hz * shrink,
        u_hz=u_hz,
        u_needed_hz=u_hz / shrink,
    )


def _ratio_for(power: float, dof: int | None) -> float:
    """Difference over u(slope) that a test with this power detects."""
    from scipy.optimize import brentq

    return float(brentq(lambda ratio: probability_of_telling(ratio, 1.0, dof) - power, 0.0, _CERTAIN))


def _points_needed(line: Line, difference: float) -> int | None:
    """Points of the same kind: u(slope) falls with the root of their number, and the test gains degrees of freedom."""

    def enough(n: int) -> bool:
        dof = None if line.u_known else n - 2
        u_slope = (line.u_slope or 0.0) * math.sqrt(line.n / n)
        return probability_of_telling(difference, u_slope, dof) >= POWER

    low, high = 2, 3
    while not enough(high):
        low, high = high, 2 * high
        if high > MOST_POINTS:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high
