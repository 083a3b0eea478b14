"""The quantities of a film."""

from __future__ import annotations

from levilab.pipelines.row import Quantity, columns_of

#: Of `levilab.pipelines.video.analysis.Video`.
QUANTITIES = (
    Quantity("frequency", "Hz", "spin in the middle of the film", "spin", of="spin", optional=True),
    Quantity("chirp", "Hz/s", "its slope", "slope of the spin", optional=True),
    Quantity("reference_time", "s", "time of the spin", "middle of the film", of="turning.middle", has_u=False,
             optional=True),
    Quantity("precession", "Hz", "precession in the middle of the film", optional=True),
    Quantity("stem_precession", "Hz", "precession by the dot on the stem", of="leaning.middle", optional=True),
    Quantity("tilt", "rad", "amplitude of the precession", "tilt", of="leaning.tilt", optional=True),
    Quantity("vertical_swing", "Hz", "swing up and down", of="rising.swing", optional=True),
    Quantity("vertical_amplitude", "m", "amplitude of the swing up and down", of="rising.amplitude", optional=True,
             fine=True),
    Quantity("fall_time", "s", "when the top fell", "fall", of="fall", optional=True),
    Quantity("spin_at_fall", "Hz", "spin at which it fell", optional=True),
    Quantity("scale", "m", "length of a pixel at the top", "a pixel", fine=True),
    Quantity("pictures", "1", "pictures with a rim", of=lambda found: float(found.time.size), has_u=False),
)  # fmt: skip

VIDEO_ROW = tuple(columns_of(QUANTITIES))
