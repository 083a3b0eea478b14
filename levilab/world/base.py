"""The ring magnet under a top that only spins, and where the magnetometer's probe stands."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

#: Sheets that a thick ring is made of, at the nodes of a Gauss–Legendre rule: to 1e-12 from a thickness above it on.
_SHEETS = 16


@dataclass(frozen=True)
class Base:
    """A ring magnet.  Defaults: the thesis's sheet, in a room without a field of its own.

    Attributes:
        strength_t_m: ρ.
        origin_m: height of the middle of its thickness.
        background_t: a field along the axis that is the same everywhere, such as the earth's.
    """

    strength_t_m: float = 1.40e-3
    inner_radius_m: float = 0.030
    outer_radius_m: float = 0.055
    thickness_m: float = 0.0
    origin_m: float = 0.0
    background_t: float = 0.0

    def flux_density(self, height: float) -> float:
        """Along the axis, at a height on it [T]: loops of current at the edges of each sheet."""
        places, weights = np.polynomial.legendre.leggauss(_SHEETS)
        z = height - self.origin_m - places * self.thickness_m / 2
        loops = [radius**2 / (radius**2 + z * z) ** 1.5 for radius in (self.outer_radius_m, self.inner_radius_m)]
        field = 2 * math.pi * self.strength_t_m * float(weights @ (loops[0] - loops[1])) / 2
        return field + self.background_t


@dataclass(frozen=True)
class Stand:
    """Where a probe is put on the base's axis.

    Attributes:
        height_m: None: in its zero-gauss chamber.
        scatter_m: by how much the probe misses the wanted height, 1σ.
    """

    height_m: float | None = 0.072
    scatter_m: float = 0.0
    seed: int = 0

    def at(self, height_m: float | None) -> Stand:
        """Return the stand at another height, missed by its scatter; the same height twice has the same miss."""
        if height_m is None or not self.scatter_m:
            return replace(self, height_m=height_m)
        random = np.random.default_rng((self.seed, 2, round(1e7 * abs(height_m))))
        return replace(self, height_m=height_m + self.scatter_m * float(random.standard_normal()))

    def flux_density(self, base: Base) -> float:
        """Return the flux density at the probe [T]."""
        return 0.0 if self.height_m is None else base.flux_density(self.height_m)


#: Scatter from one virtual bench to the next, 1σ: strength, relative, and the errors of a calliper [m].
_STRENGTH, _RADIUS_M, _THICKNESS_M, _ORIGIN_M = 0.02, 1e-4, 2e-4, 1e-3
#: Thickness [m], as in the settings of the experiment `field`; vertical field of the earth, 1σ [T].
_THICK_M, _EARTH_T = 0.015, 4e-5


def random_base(seed: int) -> Base:
    """Return the base of one virtual bench: a thick ring whose sizes and strength the seed scatters."""
    by = np.random.default_rng((seed, 3)).standard_normal(6).tolist()
    nominal = Base()
    return Base(
        strength_t_m=nominal.strength_t_m * (1 + _STRENGTH * by[0]),
        inner_radius_m=nominal.inner_radius_m + _RADIUS_M * by[1],
        outer_radius_m=nominal.outer_radius_m + _RADIUS_M * by[2],
        thickness_m=_THICK_M + _THICKNESS_M * by[3],
        origin_m=_ORIGIN_M * by[4],
        background_t=_EARTH_T * by[5],
    )
