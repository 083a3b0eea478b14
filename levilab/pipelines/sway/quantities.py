"""The quantities of slow swings."""

from __future__ import annotations

from levilab.pipelines.row import Quantity, columns_of, entry, statistic

#: Of `analysis.sway.Geometry`.
QUANTITIES = (
    Quantity("geometric_magnetism", "Hz", "geometric magnetism Ω_g/2π at a spin of 30 Hz, from the slow swings",
             "Ω_g/2π at 30 Hz", of="measured"),
    Quantity("predicted", "Hz", "the same from the form of the base's field", "Ω_g/2π predicted"),
    Quantity("ratio", "1", "measured over predicted", "measured/predicted"),
    Quantity("gradient", "1/m", "B′/2B that goes with the slow swings", "B′/2B by the swings"),
    Quantity("gradient_of_precession", "1/m", "B′/2B that goes with the precession", "B′/2B by the precession",
             of="of_precession", optional=True),
    Quantity("gradient_of_base", "1/m", "B′/2B of the base where the top floats", "B′/2B of the base", of="of_base"),
    Quantity("split_significance", "1", "split over its standard uncertainty", "split over its u", of="against_null",
             has_u=False),
    Quantity("joint_ratio", "1", "measured over predicted, of all lines fitted together",
             "measured/predicted, all lines", of="joint.ratio"),
    Quantity("joint_gradient", "1/m", "B′/2B of all lines fitted together", "B′/2B by all lines", of="joint.gradient"),
    Quantity("windows", "1", "windows in which the swings stand out", of=lambda found: float(len(found.shares)),
             has_u=False),
)  # fmt: skip

SWAY_ROW = (
    *columns_of(QUANTITIES),
    statistic("reduced_chi_square", "1", "χ² per degree of freedom of the windows"),
    entry("mirrored", "truth", "whether the view was mirrored", "result.mirrored"),
    entry("text", "text", "what the swings say", "result.text"),
)
