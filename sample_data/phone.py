"""Make sample_data/phone/: a synthetic record of a phone's magnetometer beside a top, as phyphox writes it.

The top spins down by the law of a laminar disc from 40 Hz; its field and the base's come from levilab/world, 20 cm
beside the axis, at the height of the top.  To them are added noise of 0.5 µT, mains of 0.2 µT, and times that jitter by
0.3 ms.  Run it from anywhere: ``python sample_data/phone.py``.  It writes the same bytes each time.
"""

from pathlib import Path

import numpy as np

from instruments.clock import VirtualClock
from levilab.world.spin_world import SpinScene, SpinWorld

HERE = Path(__file__).parent / "phone"
SECONDS, RATE, JITTER_S = 36.0, 100.0, 3e-4
NOISE_T, MAINS_T, MAINS_HZ = 0.5e-6, 0.2e-6, 50.01
PLACE_M = np.array([0.20, 0.0, 0.072])


def make() -> str:
    """Return the record as text."""
    random = np.random.default_rng(2026)
    n = round(SECONDS * RATE)
    times = np.sort(np.arange(n) / RATE + random.normal(0, JITTER_S, n))
    times -= times[0]
    world = SpinWorld(SpinScene(start_hz=40.0, jitter=0.0), VirtualClock())
    field = world.magnetic_field(times, PLACE_M) + random.normal(0, NOISE_T, (n, 3))
    field += MAINS_T * np.cos(2 * np.pi * MAINS_HZ * times)[:, None] * [0.3, 0.9, -0.3]
    titles = ["Time (s)", *(f"Magnetic Field {axis} (µT)" for axis in "xyz"), "Absolute field (µT)"]
    rows = np.column_stack([times, 1e6 * field, 1e6 * np.linalg.norm(field, axis=1)])
    lines = [",".join(f'"{title}"' for title in titles), *(",".join(f"{x:.9E}" for x in row) for row in rows)]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    (HERE / "magnetometer.csv").write_text(make(), encoding="utf-8", newline="\n")
