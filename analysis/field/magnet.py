"""The top's magnet in the field of the base: a point, or a uniformly magnetised disc.

A component of B along a fixed direction is a harmonic function, and the mean of a harmonic function f over a body that
is round about an axis n is Σ Q_l (n·∇)ˡf/l!, with Q_l = ⟨sˡ P_l(cos γ)⟩ over the body, s the distance from its middle
and γ the angle from n.  So the disc feels of the field B on the axis the mean Σ Q_l B⁽ˡ⁾/l!, and when it is moved or
tilted a little, by (n·∇)ᵏΦ = Φ⁽ᵏ⁾ P_k(cos θ) on the axis and Φ⁽ᵏ⁾ − x²Φ⁽ᵏ⁺²⁾/4 beside it,

  ∂²E/∂θ² = μ Σ Q_l/l! · (l+1)(l+2)/2 · B⁽ˡ⁾,  ∂²E/∂x² = μ Σ Q_l/l! · B⁽ˡ⁺²⁾/2,  ∂²E/∂x∂θ = μ Σ Q_l/l! · (l+1) B⁽ˡ⁺¹⁾/2.
"""

import math
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.field.ring import Ring, on_axis
from analysis.stability import AxialField

#: The highest term.  Each is about (R/distance to the ring)² of the one before it, 1/30 for the thesis's top; so the
#: force is good to 1e-5, and the edges of the windows to 0.01 mm.
_HIGHEST = 6


@dataclass(frozen=True)
class Disc:
    """A magnetised disc.  radius, height [m]."""

    radius: float
    height: float


def _weights(disc: Disc | None) -> dict[int, float]:
    """Return Q_l/l! of a cylinder, l even.

    In cylinder coordinates sˡP_l(cos γ) = Σ_k (−1)ᵏ l!/(4ᵏ k!² (l − 2k)!) · z^(l−2k) r^2k, whose means over the height
    and over the radius are those of powers.
    """
    if disc is None:
        return {0: 1.0}
    weights = {}
    for order in range(0, _HIGHEST + 1, 2):
        total = 0.0
        for k in range(order // 2 + 1):
            across = disc.radius ** (2 * k) / (k + 1)
            along = (disc.height / 2) ** (order - 2 * k) / (order - 2 * k + 1)
            total += (-1) ** k / (4**k * math.factorial(k) ** 2 * math.factorial(order - 2 * k)) * across * along
        weights[order] = total
    return weights


def axial_field(ring: Ring, disc: Disc | None, orders: int = 3) -> AxialField:
    """Return B, B′, B″ … as an upright magnet feels them at heights of shape (n,) [m]: shape (orders, n)."""
    weights = _weights(disc)

    def field(z: Array) -> Array:
        derivatives = on_axis(ring, z, max(weights) + orders)
        return np.asarray(sum(weight * derivatives[order : order + orders] for order, weight in weights.items()))

    return field


def stiffnesses(ring: Ring, disc: Disc, moment: float) -> AxialField:
    """Return ∂²E/∂θ², ∂²E/∂x², ∂²E/∂x∂θ of an upright magnet on the axis, for `stability.SymmetricTop`: (3, n)."""
    weights = _weights(disc)

    def of(z: Array) -> Array:
        b = on_axis(ring, z, max(weights) + 3)
        terms = [
            weight * np.array([(n + 1) * (n + 2) / 2 * b[n], b[n + 2] / 2, (n + 1) / 2 * b[n + 1]])
            for n, weight in weights.items()
        ]
        return np.asarray(moment * np.sum(terms, axis=0))

    return of
