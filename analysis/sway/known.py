"""What is known of a top and of the base above which it sways."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.arrays import Array
from analysis.field.errors import ImpossibleRing
from analysis.field.magnet import Disc, axial_field, stiffnesses
from analysis.field.ring import Ring
from analysis.stability import AxialField, SymmetricTop, windows
from analysis.sway.lines import Swings
from analysis.sway.orbit import NoSwing, small_swings

#: Tops float between these heights above the upper face, in outer radii.
_FLOATING = (0.05, 4.0)


@dataclass(frozen=True)
class Known:
    """What is known of the top and of the base.

    Attributes:
        top: its moment is not used, but the one that carries the weight at the height at which the top floats.
        mass_u, axial_u, transverse_u: standard uncertainties of mass [kg], I₃ and I₁ [kg m²].
        ring: of the base; of its strength the sign counts alone.
        covariance: of thickness, inner and outer radius, shape (3, 3) [m²].
        magnet: of the top, a disc; None: a point.
    """

    top: SymmetricTop
    mass_u: float
    axial_u: float
    ring: Ring
    covariance: Array
    magnet: Disc | None = None
    transverse_u: float = 0.0

    @cached_property
    def field(self) -> AxialField:
        """Heights, shape (n,) [m] → the field that the upright magnet feels and four derivatives, shape (5, n)."""
        return axial_field(self.ring, self.magnet, 5)

    @cached_property
    def heights(self) -> tuple[float, float]:
        """The heights at which a top floats, and half of them more below, for large swings [m].

        Raises ImpossibleRing where it floats nowhere.
        """
        face = self.ring.origin + self.ring.thickness / 2
        low, high = (face + share * self.ring.outer_radius for share in _FLOATING)
        found = windows(self.field, replace(self.top, moment=-math.copysign(1.0, self.ring.strength)), low, high)
        if not found:
            raise ImpossibleRing(inner=self.ring.inner_radius, outer=self.ring.outer_radius)
        return found[-1].low - (found[-1].high - found[-1].low) / 2, found[-1].high

    def top_at(self, height: float) -> SymmetricTop:
        """Return the top with the moment that carries its weight at a height [m]."""
        moment = self.top.mass * self.top.gravity / float(self.field(np.array([height]))[1, 0])
        stiffness = None if self.magnet is None else stiffnesses(self.ring, self.magnet, moment)
        return replace(self.top, moment=moment, stiffnesses=stiffness)

    def gradient(self, height: float) -> float:
        """Return B′/2B at a height; of a disc E_xθ/E_θθ [1/m]."""
        tilt, _, both = self.top_at(height).stiffness(self.field, np.array([height]))[:, 0]
        return abs(float(both / tilt))

    def height(self, swings: Swings, spin: float) -> float:
        """Return the height at which α₋α₊ of small swings is as seen [m].  Raises NoSwing."""
        from scipy.optimize import brentq

        product = float(swings.frequency[0] * swings.frequency[1])

        def excess(z: float) -> float:
            return math.prod(small_swings(self.field, self.top_at(z), z, spin)) - product

        try:
            return float(brentq(excess, *self.heights, xtol=1e-7))
        except ValueError:
            amplitudes = float(swings.amplitude[0]), float(swings.amplitude[1])
            raise NoSwing(amplitudes=amplitudes, spin=spin) from None
