"""What the master's thesis on the Levitron publishes and the study's page repeats: the one table of it."""

from __future__ import annotations

import statistics
from typing import Any

from levilab.simulator.published.printed import published, several
from levilab.stability.thesis import MEASURED_HZ, MEASURED_U_HZ, SIMULATED_HZ, WITH_DRAG_HZ

THESIS: dict[str, Any] = {
    # simulated from each start: lower and upper limit without drag, and the spin at the fall with drag from 30 Hz [Hz]
    "starts": {
        name: {"lower_hz": low, "upper_hz": high, "with_drag_hz": WITH_DRAG_HZ[name]}
        for name, (low, high) in SIMULATED_HZ.items()
    },
    # the lower limit, measured ten times: mean, its standard error, and the scatter of one [Hz]
    "measured_hz": MEASURED_HZ,
    "measured_u_hz": MEASURED_U_HZ,
    "scatter_hz": round(statistics.stdev(one.value for one in several("thesis", "measured.limits")), 2),
    # what a counter of turns reads too much at the end of a spin-down, at most [Hz] (docs/experiments/limit.md)
    "counter_hz": 0.19,
    # where its top floated [cm]
    "height_cm": published("thesis")["device.height"].value,
    # the third start as printed, and what it must have been [mm]
    "printed_aside_mm": 5,
    "aside_mm": 3,
    # the mass that it prints, which cannot float [g]
    "printed_mass_g": published("thesis")["device.mass"].value,
}
