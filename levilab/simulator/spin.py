"""The spin alone, in closed form, for every law of drag.

Where only the spin is observed nothing has to be integrated: with an aligned dipole the axial spin obeys
ω̇ = −g(ω) and nothing else.  Everything follows from two integrals over the spin itself,

    time to fall from ω₀ to ω     ∫ dω/g(ω)
    angle turned meanwhile        ∫ ω dω/g(ω)

so a law is a row of functions.  The laws share no algebra with the ones that are fitted in
 `analysis.spindown.drag`.  Spins in rad/s, angles in rad, times in s.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.arrays import Array
from levilab.simulator.laws import LAWS
from levilab.simulator.numbers import sqrt


@dataclass(frozen=True)
class SpinDecay:
    """A law of drag in closed form.

    Attributes:
        after: (ω₀, t, *constants) → ω.
        elapsed: (ω₀, ω, *constants) → t.
        turned: (ω₀, ω, *constants) → angle.
        damping: (|ω|, *constants) → |ω̇/ω| [1/s].
    """

    after: Callable[..., Array]
    elapsed: Callable[..., float]
    turned: Callable[..., Array]
    damping: Callable[..., Any]


def _mixed_after(spin: float, t: ArrayLike, c1: float, c2: float) -> Array:
    # Bernoulli: 1/ω obeys the linear equation d(1/ω)/dt = C₁/ω + C₂
    t = np.asarray(t, dtype=np.float64)
    return np.asarray(1 / (np.exp(c1 * t) / spin + c2 * t * _over_its_argument(np.expm1, c1 * t)))


def _mixed_elapsed(spin: float, end: float, c1: float, c2: float) -> float:
    # log1p: where one of the constants is small the logarithm is that of nearly one
    u = (1 / end - 1 / spin) / (c1 / spin + c2)
    return float(u * _over_its_argument(np.log1p, c1 * u))


def _mixed_turned(spin: float, end: ArrayLike, c1: float, c2: float) -> Array:
    w = (spin - np.asarray(end)) / (c1 + c2 * np.asarray(end))
    return np.asarray(w * _over_its_argument(np.log1p, c2 * w))


def _over_its_argument(function: Callable[[Array], Array], x: ArrayLike) -> Array:
    """function(x)/x for a function that is x + O(x²): 1 at 0, where one of the two constants is none."""
    x = np.asarray(x, dtype=np.float64)
    other = np.where(x == 0, 1.0, x)
    return np.where(x == 0, 1.0, function(other) / other)


#: Law → its closed form.
DECAYS: dict[str, SpinDecay] = {
    "stokes": SpinDecay(
        after=lambda spin, t, c: spin * np.exp(-c * np.asarray(t)),
        elapsed=lambda spin, end, c: np.log(spin / end) / c,
        turned=lambda spin, end, c: (spin - end) / c,
        damping=lambda _, c: c,
    ),
    "newton": SpinDecay(
        after=lambda spin, t, c: 1 / (1 / spin + c * np.asarray(t)),
        elapsed=lambda spin, end, c: (1 / end - 1 / spin) / c,
        turned=lambda spin, end, c: np.log(spin / end) / c,
        damping=lambda spin, c: c * spin,
    ),
    "disc": SpinDecay(
        after=lambda spin, t, c: (spin**-0.5 + 0.5 * c * np.asarray(t)) ** -2,
        elapsed=lambda spin, end, c: 2 * (end**-0.5 - spin**-0.5) / c,
        turned=lambda spin, end, c: 2 * (spin**0.5 - end**0.5) / c,
        damping=lambda spin, c: c * sqrt(spin),
    ),
    "mixed": SpinDecay(
        after=_mixed_after, elapsed=_mixed_elapsed, turned=_mixed_turned, damping=lambda spin, c1, c2: c1 + c2 * spin
    ),
}


def since_infinity(law: str, spin: float, constants: tuple[float, ...]) -> float:
    """Return how long ago a spin was infinite, by the law [s]; inf under a linear drag.

    Args:
        law: its name.
        spin: now [rad/s].
        constants: of the law.
    """
    return np.inf if LAWS[law].is_linear(constants) else float(DECAYS[law].elapsed(np.inf, spin, *constants))
