"""What people are shown of each quantity: its symbol, its words, its unit."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from analysis.uncertainty import Estimate

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Shown:
    """How people are shown a quantity.

    Attributes:
        words: of the quantity.
        unit: that it is shown in.
        factor: as many of them make one in SI.
    """

    words: str
    unit: str = ""
    factor: float = 1.0

    def of(self, estimate: Estimate) -> Estimate:
        """The estimate in the unit that people read."""
        value, u = (None if one is None else one * self.factor for one in (estimate.value, estimate.u))
        return Estimate(value, u, self.unit)


#: Heights in cm; what a calliper measures, and what moves a height, in mm.
SHOWN: Mapping[str, Shown] = MappingProxyType(
    {
        "strength": Shown("strength ρ", "mT cm", 1e5),
        "origin": Shown("origin z₀", "mm", 1e3),
        "thickness": Shown("thickness h", "mm", 1e3),
        "background": Shown("background", "mT", 1e3),
        "inner_radius": Shown("inner radius a", "mm", 1e3),
        "outer_radius": Shown("outer radius b", "mm", 1e3),
        "lowest_height": Shown("lowest height", "cm", 1e2),
        "highest_height": Shown("highest height", "cm", 1e2),
        "lightest_mass": Shown("lightest top", "g", 1e3),
        "heaviest_mass": Shown("heaviest top", "g", 1e3),
        "mass_to_set": Shown("mass to set", "g", 1e3),
        "height_at_mass": Shown("it floats at", "cm", 1e2),
        "height_per_mass": Shown("0.1 g more moves it by", "mm", 1e3 * 1e-4),
        "slowest_spin": Shown("slowest spin", "Hz"),
        "fastest_spin": Shown("fastest spin", "Hz"),
        "moment": Shown("moment of the top", "A m²"),
        "mass_to_add": Shown("mass to add to this top", "g", 1e3),
    }
)
