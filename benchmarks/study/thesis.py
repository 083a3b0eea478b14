"""What the master's thesis on the Levitron publishes and the study's page repeats: the one table of it."""

from __future__ import annotations

from typing import Any

from levilab.stability.thesis import MEASURED_HZ, MEASURED_U_HZ, SIMULATED_HZ

THESIS: dict[str, Any] = {
    # simulated from each start: lower and upper limit without drag, and the spin at the fall with drag from 30 Hz [Hz]
    "starts": {
        name: {"lower_hz": low, "upper_hz": high, "with_drag_hz": fall}
        for (name, (low, high)), fall in zip(SIMULATED_HZ.items(), (21.86, 21.65, 21.81, 22.90), strict=True)
    },
    # the lower limit, measured ten times: mean, its standard error, and the scatter of one [Hz]
    "measured_hz": MEASURED_HZ,
    "measured_u_hz": MEASURED_U_HZ,
    "scatter_hz": 0.25,
    # what a counter of turns reads too much at the end of a spin-down, at most [Hz] (docs/experiments/limit.md)
    "counter_hz": 0.19,
    # where its top floated [cm]
    "height_cm": 7.3,
    # the third start as printed, and what it must have been [mm]
    "printed_aside_mm": 5,
    "aside_mm": 3,
    # the mass that it prints, which cannot float [g]
    "printed_mass_g": 25.5,
}
