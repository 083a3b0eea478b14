"""A sweep as a row of a table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from levilab.pipelines.row import Column, entry, estimate, value

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def _statistic(name: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda part: part["models"][0]["statistics"][name]


PRECESSION_ROW = (
    Column("points", "count", "points that were used", _statistic("n")),
    *estimate("slope", "1", "of precession against drive"),
    *estimate("intercept", "Hz", "of precession against drive"),
    value("p_locked", "1", "joint test of slope 1 and intercept 0"),
    Column("reduced_chi_square", "number", "χ² per degree of freedom of the line", _statistic("reduced_chi_square")),
    Column(
        "rms_residual_hz", "number", "root of the mean square of what the line leaves over", _statistic("rms_residual")
    ),
    *estimate("robust_slope", "1", "slope of the median line"),
    *estimate("robust_intercept", "Hz", "intercept of the median line"),
    *estimate("spin_offset", "Hz", "spin beside the drive"),
    value("power", "1", "probability with which these points distinguish a slope of 1.05 from 1"),
    value("smallest_slope_difference", "1", "difference of slopes that they show in nine cases of ten"),
    value("points_needed", "1", "points that a slope of 1.05 takes"),
    value("range_needed", "Hz", "range of the drive that it takes"),
    value("u_needed", "Hz", "uncertainty of a point that it takes"),
    entry("verdict", "text", "what the points say"),
)
