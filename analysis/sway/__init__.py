"""Slow swings of a floating top, and the geometric magnetism that splits them."""

from analysis.sway.geometry import Geometry, choose_lines, geometric_magnetism
from analysis.sway.known import Known
from analysis.sway.lines import Swings, mirrored, swings_in_window, swings_of
from analysis.sway.orbit import slow_swings
from analysis.sway.sensor import Sensor, image, slow_part, without_image

__all__ = [
    "Geometry",
    "Known",
    "Sensor",
    "Swings",
    "choose_lines",
    "geometric_magnetism",
    "image",
    "mirrored",
    "slow_part",
    "slow_swings",
    "swings_in_window",
    "swings_of",
    "without_image",
]
