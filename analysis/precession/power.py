"""The power of the test of a slope against 1, and the number of points, range or u that a wanted power needs.

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

#: The slope that was published without an uncertainty, and the wanted probability that the test detects it.
OTHER_SLOPE, POWER = 1.05, 0.9
#: A sweep of more points is no useful answer.
MOST_POINTS = 1_000_000
#: A slope so many u from 1 is detected almost certainly, even with three points.
_CERTAIN = 100.0
#: Nodes of the integral over the distribution of the scatter: right to 1e-7.
_NODES = 200


@dataclass(frozen=True)
class Power:
    """What the test needs to detect OTHER_SLOPE with POWER, at 95 % confidence, two-sided; each change by itself.

    Attributes:
        slope: that the test is to distinguish from 1.
        now: probability that these points detect it.
        smallest_difference: from 1, that these points detect with POWER.
        points, points_needed: their number now, and the one needed with the same u over the same range; None: more than
            a million.
        range_hz, range_needed_hz: of the drive now, and the one needed with as many points of the same u.
        u_hz, u_needed_hz: of a point now, and the one needed at the same drive frequencies.
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


def detection_probability(difference: float, u_slope: float, degrees_of_freedom: int | None) -> float:
    """Return the probability that a two-sided test at 95 % detects a slope's difference from 1.

    Args:
        difference: of the slope from 1.
        u_slope: its standard uncertainty.
        degrees_of_freedom: of the scatter from which u_slope was estimated; None: u_slope is known.

    >>> round(detection_probability(3.2415, 1.0, None), 3), round(detection_probability(0.0, 1.0, 7), 3)
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
    """Return values of estimated over true scatter, with the probability of each, shape (n,) each.

    They are quantiles at the nodes of Gauss and Legendre.  SciPy's noncentral t distribution does not do: it is NaN for
    large shifts.
    """
    from scipy.special import chdtri

    node, weight = np.polynomial.legendre.leggauss(_NODES)
    return np.sqrt(chdtri(degrees_of_freedom, (1 - node) / 2) / degrees_of_freedom), weight / 2


def power_of(line: Line, range_hz: float, u_hz: float) -> Power | None:
    """Return the power of the points at hand against a slope of 1.05; None if the slope has no u.

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
        now=detection_probability(difference, u_slope, dof),
        smallest_difference=reach * u_slope,
        points=line.n,
        points_needed=_points_needed(line, difference),
        range_hz=range_hz,
        range_needed_hz=range_hz * shrink,
        u_hz=u_hz,
        u_needed_hz=u_hz / shrink,
    )


def _ratio_for(power: float, dof: int | None) -> float:
    """Return the difference that a test with this power detects, over u(slope)."""
    from scipy.optimize import brentq

    return float(brentq(lambda ratio: detection_probability(ratio, 1.0, dof) - power, 0.0, _CERTAIN))


def _points_needed(line: Line, difference: float) -> int | None:
    """Return the number of points of the same kind; None above a million.

    u(slope) falls with the root of their number, and the test gains degrees of freedom.
    """

    def enough(n: int) -> bool:
        dof = None if line.u_known else n - 2
        u_slope = (line.u_slope or 0.0) * math.sqrt(line.n / n)
        return detection_probability(difference, u_slope, dof) >= POWER

    low, high = 2, 3
    while not enough(high):
        low, high = high, 2 * high
        if high > MOST_POINTS:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high
