"""The field of the base as functions of places: which kind it is, B, its gradient, and its derivatives on the axis."""

import math

import numpy as np
from numpy.typing import ArrayLike

from analysis.arrays import Array
from levilab.errors import LevilabError
from levilab.simulator.kernels.fields import Field, evaluate
from levilab.simulator.kernels.paraxial import Paraxial, Paraxial2, ParaxialThick, weights
from levilab.simulator.kernels.ring import Sheet, Thick
from levilab.simulator.numbers import Numbers, numbers_of, row, template_of, uniform

#: Highest power of the series.  Beyond, its terms grow again at r ~ 2 cm, and the exact field costs less.
HIGHEST = 20
#: Terms of the series near the axis, where r² < (R² + z²)/1000.
_NEAR_AXIS_TERMS = 6
#: Sheets that a thick base is made of: to 1e-12 where the distance from it is its thickness, 1e-10 at a quarter.
_SHEETS = 24
#: A thinner base is a sheet: the closed forms divide a difference by the thickness, and lose eps z/h.
_THINNEST = 1e-5


class FieldError(LevilabError):
    """A base that cannot be."""


def field_of(
    inner_radius: float, outer_radius: float, strength: float, kind: str, *, thickness: float = 0.0, origin: float = 0.0
) -> Field:
    """Return the field of a ring magnet.

    Args:
        inner_radius: [m].
        outer_radius: [m].
        strength: dipole density over the thickness [T m].
        kind: "paraxial-2" … "paraxial-20", the highest power of r in the potential, or "exact".
        thickness: [m].
        origin: height of the middle of the thickness [m].

    Raises:
        FieldError: there is no such ring, or no such kind.
    """
    _check(inner_radius, outer_radius, strength, thickness, origin)
    ring = (2 * math.pi * strength, inner_radius * inner_radius, outer_radius * outer_radius, origin)
    power = _power(kind)
    if power is None:
        series = weights(_NEAR_AXIS_TERMS)
        return Sheet(*ring, series) if thickness == 0 else Thick(*ring, thickness, series, _sheets(uniform(thickness)))
    if thickness > 0:
        return ParaxialThick(*ring, thickness, weights(power // 2))
    return Paraxial2(*ring) if power == 2 else Paraxial(*ring, weights(power // 2))


def _check(inner: float, outer: float, strength: float, thickness: float, origin: float) -> None:
    for name, value in (("inner radius", inner), ("strength", strength), ("thickness", thickness), ("origin", origin)):
        if not -math.inf < value < math.inf:
            raise FieldError(f"{name} = {value}: a finite number is expected")
    if not 0 < inner < outer < math.inf:
        raise FieldError(f"inner radius {inner} m, outer radius {outer} m: 0 < inner < outer is expected")
    if thickness != 0 and not thickness >= _THINNEST:
        raise FieldError(f"thickness = {thickness} m: 0 for a sheet, or at least {_THINNEST:g} m, is expected")


def _power(kind: str) -> int | None:
    if kind == "exact":
        return None
    name, _, number = kind.partition("-")
    if name == "paraxial" and number.isdecimal() and int(number) % 2 == 0 and 2 <= int(number) <= HIGHEST:
        return int(number)
    raise FieldError(f"field {kind!r}: exact or paraxial-2, paraxial-4, … paraxial-{HIGHEST} is expected")


def _sheets(thickness: float) -> Array:
    place, weight = np.polynomial.legendre.leggauss(_SHEETS)
    return np.column_stack([place * thickness / 2, weight / 2])


def _five(field: Field, positions: ArrayLike) -> tuple[Array, Array]:
    """Return the places, shape (…, 3), and the field's five functions there, shape (…, 5).

    If the field has the numbers of n tops, there are n places, or one that all share.
    """
    places = np.ascontiguousarray(positions, dtype=np.float64)
    rows = row(*numbers_of(field))
    if isinstance(rows, Numbers) and places.ndim == 1:
        places = np.tile(places, (len(rows), 1))
    flat = places.reshape(-1, 3)
    values = np.empty((len(flat), 5))
    evaluate(template_of(field), np.ascontiguousarray(np.atleast_2d(rows)), flat, values)
    values = values.reshape(*places.shape[:-1], 5)
    if isinstance(rows, Numbers) or isinstance(positions, Numbers):
        return places.view(Numbers), values.view(Numbers)
    return places, values


def flux_density(field: Field, positions: ArrayLike) -> Array:
    """B at places of shape (…, 3) [m], same shape [T].

    >>> base = field_of(0.030, 0.055, 1.40e-3, "exact")
    >>> flux_density(base, [0.0, 0.0, 0.073]).round(7)
    array([0.       , 0.       , 0.0187455])
    """
    places, five = _five(field, positions)
    b = places * five[..., :1]
    b[..., 2] = five[..., 2]
    return b


def flux_gradient(field: Field, positions: ArrayLike) -> Array:
    """∂B_i/∂x_j at places of shape (…, 3) [m], shape (…, 3, 3) [T/m]; symmetric."""
    places, five = _five(field, positions)
    p, q, _, s, g = np.moveaxis(five, -1, 0)
    across = places[..., :2]
    gradient = np.empty((*places.shape, 3))
    gradient[..., :2, :2] = q[..., None, None] * across[..., :, None] * across[..., None, :]
    gradient[..., 0, 0] += p
    gradient[..., 1, 1] += p
    gradient[..., :2, 2] = gradient[..., 2, :2] = s[..., None] * across
    gradient[..., 2, 2] = g
    return gradient


def on_axis(field: Field, z: ArrayLike) -> Array:
    """B_z on the axis and its first two derivatives at heights of shape (n,) [m]; shape (3, n) [T/mᵏ].

    On the axis s = −∂²B_z/∂z²/2, where the divergence vanishes.
    """
    heights = np.atleast_1d(np.asarray(z, dtype=np.float64))
    places = np.zeros((heights.size, 3))
    places[:, 2] = heights
    _, five = _five(field, places)
    return np.array([five[:, 2], five[:, 4], -2 * five[:, 3]])
