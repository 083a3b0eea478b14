"""The quantities of scans of the field, and their readings as columns."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from levilab.pipelines.row import Column, Quantity, columns_of, entry, statistic

if TYPE_CHECKING:
    from collections.abc import Mapping


#: Of the base.
_BASE = (
    Quantity("strength", "T m", "ρ of the ring", "strength ρ"),
    Quantity("origin", "m", "height of the ring's middle on the scale of the scan", "origin z₀", fine=True),
    Quantity("thickness", "m", "thickness of the ring", "thickness h", fine=True),
    Quantity("background", "T", "field without the ring: zero of the probe, the earth's field"),
    Quantity("inner_radius", "m", "inner radius of the ring", "inner radius a", fine=True),
    Quantity("outer_radius", "m", "outer radius of the ring", "outer radius b", fine=True),
)
#: Of the tops that float above it.
_TOPS = (
    Quantity("lowest_height", "m", "lowest height at which a top floats"),
    Quantity("highest_height", "m", "highest height at which a top floats"),
    Quantity("lightest_mass", "kg", "lightest top that floats", "lightest top"),
    Quantity("heaviest_mass", "kg", "heaviest top that floats", "heaviest top"),
    Quantity("mass_to_set", "kg", "mass of a top in the middle of the window"),
    Quantity("height_at_mass", "m", "height at which such a top floats", "it floats at"),
    Quantity("height_per_mass", "m/kg", "change of its height with its mass", "it moves with its mass by"),
    Quantity("slowest_spin", "Hz", "slowest spin of such a top"),
    Quantity("fastest_spin", "Hz", "fastest spin of such a top"),
    Quantity("moment", "A m^2", "moment of the top by the height at which it floats", "moment of the top",
             column=False),
    Quantity("mass_to_add", "kg", "mass to add to the top that was measured", "mass to add to this top",
             column=False),
)  # fmt: skip
QUANTITIES: Mapping[str, Quantity] = MappingProxyType({one.name: one for one in (*_BASE, *_TOPS)})
#: The names of those that follow for a top.
OF_TOPS = tuple(one.name for one in _TOPS)

FIELD_ROW = (
    statistic("n", "1", "readings in the fit", "readings_used", kind="count"),
    *columns_of(QUANTITIES.values()),
    statistic("reduced_chi_square", "1", "χ² per degree of freedom"),
    statistic("rms_residual", "T", "root mean square of the residuals"),
    Column("floats", "truth", "whether any top floats above the ring",
           lambda part: part["result"]["floating"] is not None),
    entry("text", "text", "what the scan says", "result.text"),
)  # fmt: skip
