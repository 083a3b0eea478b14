"""What several tests of the application share."""

from pathlib import Path

import numpy as np


def spin_down_csv(
    path: Path,
    *,
    n: int = 20,
    step: float = 10.0,
    noise: float = 0.03,
    u: bool = True,
    seed: int = 1,
    jump: float = 0.0,
) -> Path:
    """A plain CSV of a spin-down by the disc law, with a step of times [s] and a jump in the middle [Hz]."""
    t = step * np.arange(n)
    nu = 40 * (1 + 2.34e-4 * np.sqrt(2 * np.pi * 40) * t / 2) ** -2 + np.random.default_rng(seed).normal(0, noise, n)
    nu += jump * (2 * np.arange(n) >= n)
    header, rows = "time_s,spin_frequency_hz", [f"{x!r},{y!r}" for x, y in zip(t.tolist(), nu.tolist(), strict=True)]
    if u:
        header, rows = header + ",spin_frequency_u_hz", [f"{row},{noise}" for row in rows]
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    return path
