"""The quantities of a held spin."""

from __future__ import annotations

from levilab.pipelines.row import Quantity, columns_of

#: Of `analysis.held.Hold`.
QUANTITIES = (
    Quantity("spin_frequency", "Hz", "the held spin, mean of the readings", "ν", of="spin"),
    Quantity("scatter", "Hz", "standard deviation of the readings of the held spin", "s.d. of ν"),
    Quantity("share", "1", "share of the full amplitude that held the spin", "s", has_u=False),
    Quantity("gain", "Hz/s", "rate at which the full amplitude raises the spin there", "g", optional=True),
    Quantity("drag", "Hz/s", "drag at this spin, from the amplitude that balanced it", "d", optional=True),
)

HOLD_ROW = tuple(columns_of(QUANTITIES))
