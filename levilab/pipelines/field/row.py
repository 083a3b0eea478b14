"""A scan of the field as a row of a table."""

from __future__ import annotations

from levilab.pipelines.row import Column, entry, estimate

#: Quantities of the ring and of the tops that float above it: name in the result, unit, what it is.
_QUANTITIES = (
    ("strength", "T m", "ρ of the ring"),
    ("origin", "m", "height of the ring's middle on the scale of the scan"),
    ("thickness", "m", "of the ring"),
    ("background", "T", "field without the ring: zero of the probe, the earth's field"),
    ("inner_radius", "m", "of the ring"),
    ("outer_radius", "m", "of the ring"),
    ("lowest_height", "m", "at which a top floats"),
    ("highest_height", "m", "at which a top floats"),
    ("lightest_mass", "kg", "of a top that floats"),
    ("heaviest_mass", "kg", "of a top that floats"),
    ("mass_to_set", "kg", "of a top in the middle of the window"),
    ("height_at_mass", "m", "at which such a top floats"),
    ("height_per_mass", "m/kg", "how much lower a heavier top floats"),
    ("slowest_spin", "Hz", "of such a top"),
    ("fastest_spin", "Hz", "of such a top"),
)

FIELD_ROW = (
    Column("readings_used", "count", "readings in the fit", lambda part: part["models"][0]["statistics"]["n"]),
    *(column for name, unit, meaning in _QUANTITIES for column in estimate(name, unit, f"{name}: {meaning}")),
    Column("reduced_chi_square", "number", "χ² per degree of freedom",
           lambda part: part["models"][0]["statistics"]["reduced_chi_square"]),
    Column("rms_residual_t", "number", "root of the mean square of what the fit leaves over",
           lambda part: part["models"][0]["statistics"]["rms_residual"]),
    Column("floats", "truth", "whether any top floats above the ring",
           lambda part: part["result"]["floating"] is not None),
    entry("text", "text", "what the scan says", "result.text"),
)  # fmt: skip
