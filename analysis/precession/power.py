"""The power of the test of a slope against 1, and the number of points, range or u that a wanted power needs.

Source: Cohen, Statistical Power Analysis (1988), §9.  The difference that a two-sided test at 95 % detects with the
probability p is the sum of the quantiles 0.975 and p of Student's distribution, in units of u(slope).
"""

import math
from dataclasses import dataclass

from analysis.precession.line import CONFIDENCE, FEWEST, Line

#: The slope that was published without an uncertainty, and the wanted probability that the test detects it.
OTHER_SLOPE, POWER = 1.05, 0.9
#: A sweep of more points is no useful answer.
MOST_POINTS = 1_000_000
#: Each round changes the number of points by a tenth of the change before, or less.
ROUNDS = 8


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


def power_of(line: Line, range_hz: float, u_hz: float) -> Power | None:
    """Return the power of the points at hand against a slope of 1.05; None if the slope has no u.

    Args:
        line: through the points.
        range_hz: of the drive.
        u_hz: of a point: the typical u, or the scatter about the line.
    """
    if not line.u_slope:
        return None
    from scipy.special import stdtr, stdtrit

    def quantiles(points: float) -> tuple[float, float]:
        freedom = max(line.freedom + points - line.n, 1.0)
        return float(stdtrit(freedom, (1 + CONFIDENCE) / 2)), float(stdtrit(freedom, POWER))

    difference = OTHER_SLOPE - 1
    limit, reach = quantiles(line.n)
    smallest = (limit + reach) * line.u_slope
    shrink = smallest / difference  # by which u(slope) is too large
    needed = float(line.n)
    for _ in range(ROUNDS):  # more points have more degrees of freedom
        needed = line.n * (sum(quantiles(max(needed, FEWEST))) * line.u_slope / difference) ** 2
    points = max(math.ceil(min(needed, 2.0 * MOST_POINTS)), FEWEST)
    return Power(
        slope=OTHER_SLOPE,
        now=float(stdtr(line.freedom, difference / line.u_slope - limit)),
        smallest_difference=smallest,
        points=line.n,
        points_needed=points if points <= MOST_POINTS else None,
        range_hz=range_hz,
        range_needed_hz=range_hz * shrink,
        u_hz=u_hz,
        u_needed_hz=u_hz / shrink,
    )
