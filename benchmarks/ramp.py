"""How fast a drive may raise the spin of a top that it holds, in full motion (docs/decisions/0004-spin-world.md).

    python benchmarks/ramp.py

The top of the scene `spindown`, a drive of 0.4 mT that comes on at its spin with the moment at eight angles to it,
raised from 30 to 40 Hz in steps of a second.  Held is a top that never is more than 1.5 Hz away from the drive.
"""

from __future__ import annotations

import math

import numpy as np

from levilab.simulator import preset, simulate
from levilab.simulator.kernels.motion import TIME

FROM_HZ, TO_HZ, FIELD_T = 30.0, 40.0, 4e-4
STEP_S, HELD_WITHIN_HZ, ANGLES = 1.0, 1.5, 8


def lost_at(rate: float, turns: float) -> float | None:
    """Return the drive's frequency [Hz] at which the top is lost; None for one that is held to the end.

    rate [Hz/s]; turns: the drive's phase when it comes on.
    """
    scene, state, time = preset("spindown").changed({"start.spin_hz": FROM_HZ}), None, 0.0
    for drive in np.arange(FROM_HZ, TO_HZ + rate * STEP_S / 2, rate * STEP_S).tolist():
        driven = scene.changed(
            {
                "drive.waveform": "sine",
                "drive.amplitude_t": FIELD_T,
                "drive.frequency_hz": drive,
                "drive.phase_rad": 2 * math.pi * ((turns - drive * time) % 1.0),
            }
        )
        motion = simulate(driven, STEP_S, tolerance=1e-6, rate=500.0, start=state)
        if motion.fell is not None or np.abs(motion.spin_hz - drive).max() > HELD_WITHIN_HZ:
            return drive
        state, time, turns = motion.states[-1], float(motion.states[-1, TIME]), turns + drive * STEP_S
    return None


def main() -> None:
    for rate in (0.2, 0.1, 0.05, 0.025):
        ends = [lost_at(rate, angle / ANGLES) for angle in range(ANGLES)]
        lost = ", ".join(f"{end:.1f}" for end in ends if end is not None)
        print(f"{rate:6.3f} Hz/s: {ends.count(None)} of {ANGLES} held to {TO_HZ:g} Hz; lost at {lost or '-'} Hz")


if __name__ == "__main__":
    main()
