"""The field of a magnetised ring on its axis, in closed form, with its derivatives.

A ring of inner radius a, outer radius b and thickness h is a stack of sheets.  With F(z, R) = z/√(R² + z²) the
potential of a sheet of strength ρ is 2πρ·[F(z, a) − F(z, b)], and the field B_z = −dΦ/dz, averaged over the thickness,
is a difference of F between the two faces.  The same holds for every derivative along the axis.
"""

import math
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array

#: A ring that is thinner than this part of its inner radius is a sheet with the first correction, h²/24 times the
#: second derivative: the next term is below 1e-13 of the field, while a difference over h would lose as many digits.
_THIN = 1e-3


@dataclass(frozen=True)
class Ring:
    """A ring magnet.

    Attributes:
        strength: ρ [T m], signed: positive if the field points up high above the ring.
        origin: height of the middle of its thickness [m].
        thickness, inner_radius, outer_radius: [m].
    """

    strength: float
    origin: float
    thickness: float
    inner_radius: float
    outer_radius: float


def _edges(highest: int, z: Array, radii: tuple[float, ...]) -> Array:
    """Return the derivatives of F = z/√(R² + z²) for each radius, orders 0 to highest ≥ 1.

    F′ = R²/u³ with u² = R² + z², and dⁿu⁻³/dzⁿ = (−1)ⁿ n! C_n(z/u)/uⁿ⁺³ with Gegenbauer's polynomials of λ = 3/2 (their
    generating function; Abramowitz & Stegun 22.9.3), which follow from one another by 22.7.3.

    Args:
        highest: order.
        z: any shape.
        radii: all at once, since on short arrays a call of numpy costs more than its arithmetic.

    Returns:
        Shape (highest + 1, radii, *shape of z).
    """
    shape = (len(radii), *[1] * z.ndim)
    u = np.sqrt(np.array([radius * radius for radius in radii]).reshape(shape) + z * z)
    x = z / u
    found = np.empty((highest + 1, *x.shape))
    found[0] = x
    scale = np.array([radius**2 for radius in radii]).reshape(shape) / u**3  # with the sign and the factorial
    found[1] = scale
    before, polynomial = np.ones(()), 3 * x
    for n in range(1, highest):
        scale = -n * scale / u
        found[n + 1] = scale * polynomial
        if n + 1 < highest:
            before, polynomial = polynomial, ((2 * n + 3) * x * polynomial - (n + 2) * before) / (n + 1)
    return found


def _sheet(highest: int, z: Array, ring: Ring) -> Array:
    of_radii = _edges(highest, z, (ring.inner_radius, ring.outer_radius))
    return np.asarray(of_radii[:, 0] - of_radii[:, 1])


def _is_thin(ring: Ring) -> bool:
    return abs(ring.thickness) < _THIN * ring.inner_radius


def _faces(highest: int, z: Array, ring: Ring) -> Array:
    """Return F of a sheet and its derivatives at the upper and at the lower face: shape (highest + 1, 2, n)."""
    at, h = z - ring.origin, ring.thickness
    return _sheet(highest, np.array([at + h / 2, at - h / 2]), ring)


def _mean(orders: int, z: Array, ring: Ring) -> Array:
    """Return F′ of a sheet and its derivatives, averaged over the thickness: shape (orders, n)."""
    if _is_thin(ring):
        sheet, h = _sheet(orders + 2, z - ring.origin, ring), ring.thickness
        return sheet[1 : orders + 1] + h * h / 24 * sheet[3:]
    return _between(_faces(max(orders - 1, 1), z, ring)[:orders], ring)


def _between(faces: Array, ring: Ring) -> Array:
    """Return the means over the thickness of what has these integrals, shape (orders, 2, n) → (orders, n)."""
    return np.asarray((faces[:, 0] - faces[:, 1]) / ring.thickness)


def on_axis(ring: Ring, z: Array, orders: int = 3) -> Array:
    """Return B_z and its derivatives along the axis at heights of shape (n,) [m]; shape (orders, n) [T/m^order].

    >>> thesis = Ring(1.40e-3, 0.0, 0.0, 0.030, 0.055)
    >>> on_axis(thesis, np.array([0.073]))[:, 0].round(6)
    array([ 0.018746, -0.347396,  1.980526])
    """
    return -2 * math.pi * ring.strength * _mean(orders, z, ring)


def slopes(ring: Ring, z: Array) -> Array:
    """Return ∂B_z by strength, origin, thickness, inner and outer radius; shape (5, n) [T per unit of each]."""
    at, h, k = z - ring.origin, ring.thickness, -2 * math.pi * ring.strength
    if _is_thin(ring):
        mean, bend = _mean(2, z, ring)
        with_thickness = h / 12 * _sheet(3, at, ring)[3]
    else:
        faces = _faces(1, z, ring)
        mean, bend = _between(faces, ring)
        with_thickness = ((faces[1, 0] + faces[1, 1]) / 2 - mean) / h
    radii = ring.inner_radius, ring.outer_radius
    inner, outer = (_with_radius(at, radius, ring) for radius in radii)
    return np.array([-2 * math.pi * mean, -k * bend, k * with_thickness, k * inner, -k * outer])


def _with_radius(at: Array, radius: float, ring: Ring) -> Array:
    """Return d/dR of dF/dz, averaged over the thickness."""
    if _is_thin(ring):  # of a sheet: what the thickness adds to this slope is below 1e-6 of it
        return np.asarray(-radius * (radius**2 - 2 * at * at) * (radius**2 + at * at) ** -2.5)
    h = ring.thickness
    low, high = (-radius * side * (radius**2 + side * side) ** -1.5 for side in (at - h / 2, at + h / 2))
    return np.asarray((high - low) / h)


def reversal(ring: Ring) -> float:
    """Return the height above which the field keeps its sign [m].

    It is that of a sheet, where b²/(b²+z²)^(3/2) = a²/(a²+z²)^(3/2).

    >>> round(reversal(Ring(1.40e-3, 0.0, 0.0, 0.030, 0.055)), 5)
    0.02843
    """
    a2, b2 = ring.inner_radius**2, ring.outer_radius**2
    share = (a2 / b2) ** (2 / 3)
    return ring.origin + math.sqrt((share * b2 - a2) / (1 - share))
