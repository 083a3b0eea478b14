"""Slow swings of a floating top, and the geometric magnetism that splits them."""

from analysis.sway.geometry import Geometry, geometric_magnetism
from analysis.sway.known import Known
from analysis.sway.lines import Swings, mirrored, swings_in_window, swings_of
from analysis.sway.orbit import slow_swings

__all__ = [
    "Geometry",
    "Known",
    "Swings",
    "geometric_magnetism",
    "mirrored",
    "slow_swings",
    "swings_in_window",
    "swings_of",
]
