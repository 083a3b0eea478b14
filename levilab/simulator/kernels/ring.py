"""The base's field exactly: a ring sheet is a loop of current at its outer edge and one back at its inner edge.

Closed forms in the complete elliptic integrals K and E (Simpson, Lane, Immer & Youngquist, NASA/TM-2013-217919).
Near the axis they divide what cancels by r²: there the series about the axis takes over, which at r² < (R² + z²)/1000
has converged to 1e-17; beyond, the closed forms have lost three digits at most.
"""

import math
from typing import Any, NamedTuple

from levilab.simulator.kernels.compiled import part
from levilab.simulator.kernels.paraxial import to_any_power

#: Steps of the arithmetic–geometric mean: each doubles the digits; enough for a distance of 1e-7 R from the loop.
_STEPS = 7

#: r²/(R² + z²) below which the series is used.
_NEAR_AXIS = 1e-3


class Sheet(NamedTuple):
    """A thin ring sheet: 2πρ [T m], a² and b² [m²], its height [m]; weights: of the series near the axis."""

    strength: float
    inner2: float
    outer2: float
    origin: float
    weights: tuple[float, ...]


class Thick(NamedTuple):
    """A base of finite thickness [m], as sheets at the nodes of a Gauss–Legendre rule: (place, weight) pairs."""

    strength: float
    inner2: float
    outer2: float
    origin: float
    thickness: float
    weights: tuple[float, ...]
    nodes: Any


@part
def elliptic(complement: float) -> tuple[float, float]:
    """Return K and E of the modulus k from 1 − k², by the arithmetic–geometric mean (Abramowitz & Stegun 17.6)."""
    a, g = 1.0, math.sqrt(complement)
    total, power = 0.5 * (1 - complement), 0.5
    for _ in range(_STEPS):
        c = 0.5 * (a - g)
        a, g = 0.5 * (a + g), math.sqrt(a * g)
        power *= 2
        total += power * c * c
    k = 0.5 * math.pi / a
    return k, k * (1 - total)


@part
def _loop(radius2: Any, z: Any, r2: Any) -> Any:
    """p, bz, s, g of a loop whose field on the axis is R²/(R² + z²)^(3/2); r2 > 0."""
    radius, r, z2 = math.sqrt(radius2), math.sqrt(r2), z * z
    near = 1 / ((radius - r) * (radius - r) + z2)  # 1/ shortest and longest distance to the loop, squared
    far = 1 / ((radius + r) * (radius + r) + z2)
    k, e = elliptic(far / near)
    scale = math.sqrt(far) / math.pi
    along, across = (radius2 - r2 - z2) * near, (radius2 + r2 + z2) * near
    bz = scale * (k + along * e)
    radial = across * e - k
    # dK/dz = −z (E near − K far) and dE/dz = −z far (E − K), from dK/dm and dE/dm
    dk, de = -z * (e * near - k * far), -z * far * (e - k)
    g = -z * far * bz + scale * (dk + along * de - 2 * z * (1 + along) * near * e)
    change = across * de - dk + 2 * z * (1 - across) * near * e
    s = scale / r2 * (radial * (1 - z2 * far) + z * change)
    return scale * z / r2 * radial, bz, s, g


@part
def of_sheet(field: Any, z: Any, r2: Any) -> Any:
    """Return the exact field of a sheet: the closed form, or the series about the axis where that is the better one."""
    height = z - field.origin
    close = r2 < _NEAR_AXIS * (field.inner2 + height * height)
    away = _NEAR_AXIS * field.inner2 if close else r2  # computed in either case: lanes take no branches
    pa, za, sa, ga = _loop(field.inner2, height, away)
    pb, zb, sb, gb = _loop(field.outer2, height, away)
    k = field.strength
    p, bz, s, g = k * (pb - pa), k * (zb - za), k * (sb - sa), k * (gb - ga)
    q = -(g + 2 * p) / away  # ∇·B = 0
    np, nq, nz, ns, ng = to_any_power(field, z, r2)
    return (np if close else p, nq if close else q, nz if close else bz, ns if close else s, ng if close else g)


def of_thick_ring(field: Any, z: Any, r2: Any) -> Any:
    """Return the mean of sheets over the thickness.

    It is right to 1e-10 from a quarter of the thickness off the edges on.  Nearer by, the sheets begin to be seen: with
    20 mm the gradient is right to 2e-8 at 1 mm and to 2 % at 0.1 mm (against mpmath); a top does not come that near.
    """
    p, q, bz, s, g = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(field.nodes.shape[0]):
        place, weight = field.nodes[i, 0], field.nodes[i, 1]
        sheet = Sheet(field.strength, field.inner2, field.outer2, field.origin + place, field.weights)
        one = of_sheet(sheet, z, r2)
        p, q, bz, s, g = (
            p + weight * one[0],
            q + weight * one[1],
            bz + weight * one[2],
            s + weight * one[3],
            g + weight * one[4],
        )
    return p, q, bz, s, g
