"""The quantities of a sweep, and its points as columns."""

from __future__ import annotations

from levilab.pipelines.precession.words import intercept_of, slope_of
from levilab.pipelines.row import Quantity, columns_of, entry, statistic

#: Of `analysis.precession.sweep.SweepFit`.
QUANTITIES = (
    Quantity("slope", "1", "slope of precession against drive", of=slope_of),
    Quantity("intercept", "Hz", "intercept of precession against drive", of=intercept_of),
    Quantity("p_locked", "1", "joint test of slope 1 and intercept 0", has_u=False),
    Quantity("robust_slope", "1", "slope of the median line", of="robust.slope"),
    Quantity("robust_intercept", "Hz", "intercept of the median line", of="robust.intercept"),
    Quantity("spin_offset", "Hz", "spin less the frequency of the drive", u="u_spin_offset", optional=True),
    Quantity("power", "1", "probability with which these points distinguish a slope of 1.05 from 1",
             of="power.now", has_u=False, optional=True),
    Quantity("smallest_slope_difference", "1", "difference of slopes that they show in nine cases of ten",
             of="power.smallest_difference", has_u=False, optional=True),
    Quantity("points_needed", "1", "points that a slope of 1.05 takes", of="power.points_needed", has_u=False,
             optional=True),
    Quantity("range_needed", "Hz", "range of the drive that it takes", of="power.range_needed_hz", has_u=False,
             optional=True),
    Quantity("u_needed", "Hz", "uncertainty of a point that it takes", of="power.u_needed_hz", has_u=False,
             optional=True),
)  # fmt: skip

PRECESSION_ROW = (
    statistic("n", "1", "points that were used", "points", kind="count"),
    *columns_of(QUANTITIES),
    statistic("reduced_chi_square", "1", "χ² per degree of freedom of the line"),
    statistic("rms_residual", "Hz", "root mean square of the residuals of the line"),
    entry("verdict", "text", "what the points say"),
)
