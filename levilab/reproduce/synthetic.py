"""Spin-downs that honour published constants: readings made up so that straight lines through them return these.

The thesis prints C₁ and C₂ of four runs and none of their readings.  The law is that of a laminar disc from about
40 Hz, a reading each 10 s, with noise; start and constant are solved for.  They are not the author's data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NOISE_HZ, STEP_S = 0.03, 10.0
#: Readings of each of the thesis's runs.
READINGS = (20, 20, 19, 19)
#: The start lies this near to 40 Hz, and so many seeds are tried at most.
START_HZ, NEAR_HZ, SEEDS = 40.0, 0.25, 1000


@dataclass(frozen=True)
class MadeUp:
    """A spin-down that was made up.

    Attributes:
        time: shape (n,) [s].
        spin: rounded to 0.01 Hz, shape (n,) [Hz].
        start: before the noise [Hz].
        c32: the disc's constant before the noise [(rad/s)^-1/2/s].
        seed: of the noise.
    """

    time: Array
    spin: Array
    start: float
    c32: float
    seed: int


def disc(t: Array, start_hz: float, c32: float) -> Array:
    """Spin of a laminar disc [Hz]."""
    return np.asarray(start_hz * (1 + c32 * np.sqrt(2 * np.pi * start_hz) * t / 2) ** -2.0)


def straight_lines(t: Array, nu: Array) -> tuple[float, float]:
    """C₁ [1/s] and C₂ [1/rad] of unweighted straight lines through ln ω and 1/ω."""
    omega = 2 * np.pi * nu
    return -float(np.polyfit(t, np.log(omega), 1)[0]), float(np.polyfit(t, 1 / omega, 1)[0])


def as_printed(c1: float, c2: float) -> tuple[str, str]:
    """Return the two constants with the digits of the thesis."""
    return f"{c1:.6f}", f"{c2:.3e}"


def solve(c1: float, c2: float, n: int) -> MadeUp:
    """Find readings that give the published constants to every printed digit, after rounding.

    The first seed is taken for which rounding does not move a digit and the start lies within 0.25 Hz of 40.

    Raises:
        RuntimeError: there is no such seed.
    """
    from scipy.optimize import root

    t = STEP_S * np.arange(n, dtype=np.float64)
    for seed in range(SEEDS):
        noise = np.random.default_rng((n, round(c1 * 1e6), seed)).normal(0, NOISE_HZ, n)

        def miss(x: Array, noise: Array = noise) -> Array:
            got = straight_lines(t, disc(t, START_HZ * x[0], 2.3e-4 * x[1]) + noise)
            return np.array([got[0] / c1 - 1, got[1] / c2 - 1])

        found = root(miss, np.ones(2), tol=1e-12)
        start, c32 = START_HZ * float(found.x[0]), 2.3e-4 * float(found.x[1])
        nu = np.asarray(np.round(disc(t, start, c32) + noise, 2), dtype=np.float64)
        kept = as_printed(*straight_lines(t, nu)) == as_printed(c1, c2)
        if found.success and kept and abs(start - START_HZ) < NEAR_HZ:
            return MadeUp(t, nu, start, c32, seed)
    raise RuntimeError(f"no seed gives C1 = {c1}, C2 = {c2}")
