"""The base's field as a series about its axis, up to any power of the distance from it.

On the axis the potential of a ring sheet is φ₀(z) = 2πρ [z/√(a²+z²) − z/√(b²+z²)]; off it
Φ(r, z) = Σ (−1)ⁿ φ₂ₙ(z) r²ⁿ/(4ⁿ n!²), cut off after n = N.  All of the field is derived from that one potential,
so that a truncated field has an energy, too.  The derivatives of (z² + R²)^(−3/2), which φ₁ is made of, obey
(z² + R²) g⁽ⁿ⁺¹⁾ + (2n + 3) z g⁽ⁿ⁾ + n(n + 2) g⁽ⁿ⁻¹⁾ = 0, Leibniz' rule applied to (z² + R²) g′ = −3 z g.
"""

import math
from typing import Any, NamedTuple

from levilab.simulator.kernels.compiled import part


class Paraxial2(NamedTuple):
    """A sheet's field to r² in the potential: 2πρ [T m], a² and b² [m²], height of the sheet [m]."""

    strength: float
    inner2: float
    outer2: float
    origin: float


class Paraxial(NamedTuple):
    """A sheet's field to r^2N in the potential; weights: (−1)ⁿ/(4ⁿ n!²) for n = 0 … N, whose number is in the type."""

    strength: float
    inner2: float
    outer2: float
    origin: float
    weights: tuple[float, ...]


class ParaxialThick(NamedTuple):
    """As Paraxial, of a base of this thickness [m]: the mean over it, in closed form."""

    strength: float
    inner2: float
    outer2: float
    origin: float
    thickness: float
    weights: tuple[float, ...]


def weights(terms: int) -> tuple[float, ...]:
    """(−1)ⁿ/(4ⁿ n!²) for n = 0 … terms."""
    return tuple((-1) ** n / (4**n * math.factorial(n) ** 2) for n in range(terms + 1))


@part
def _ring_to_second_power(strength: Any, radius2: Any, z: Any, z2: Any, half: Any) -> Any:
    """√(R² + z²), and what p, bz, s, g of one ring are besides; half: r²/2.

    The root takes longest: all the rest is made of 1/(R² + z²) meanwhile, and multiplied by it at the very end.  What
    does not wait for the quotient is multiplied before it is there, and few of its powers wait for each other.
    """
    inverse = 1 / (radius2 + z2)
    k = strength * radius2
    kz = 3 * k * z
    a, b = 1.5 * k * (4 * z2 - radius2), 2.5 * half * kz * (4 * z2 - 3 * radius2)
    square = inverse * inverse
    cube = square * inverse
    bend = a * square
    return (
        math.sqrt(radius2 + z2),
        -0.5 * kz * cube,
        (half * bend - k) * square,
        bend * square,
        (kz - b * square) * cube,
    )


def to_second_power(field: Any, z: Any, r2: Any) -> Any:
    """Return the commonest field, written out: φ₁ = 2πρ R² (R² + z²)^(−3/2) and its derivatives, of each ring."""
    height = z - field.origin
    z2, half = height * height, 0.5 * r2
    u, a1, a2, a3, a4 = _ring_to_second_power(field.strength, field.inner2, height, z2, half)
    w, b1, b2, b3, b4 = _ring_to_second_power(field.strength, field.outer2, height, z2, half)
    return u * a1 - w * b1, 0.0, u * a2 - w * b2, u * a3 - w * b3, u * a4 - w * b4


@part
def _next(n: Any, height: Any, inverse: Any, now: Any, before: Any) -> Any:
    """g⁽ⁿ⁺¹⁾ from g⁽ⁿ⁾ and g⁽ⁿ⁻¹⁾; inverse: 1/(z² + R²)."""
    return -((2 * n + 3) * height * now + n * (n + 2) * before) * inverse


@part
def _add_terms(coefficients: Any, r2: Any, even: Any, odd: Any, sums: Any, n: Any, power: Any) -> Any:
    """Return the five sums with the terms of n added: φ₂ₙ, φ₂ₙ₊₁ and φ₂ₙ₊₂ are even[0], odd and even[1]."""
    p, q, bz, s, g = sums
    c = coefficients
    p1, p2 = power  # r^(2n − 2), r^(2n − 4); 0 where n is too small for them
    return (
        p - 2 * n * c * even[0] * p1,
        q - 4 * n * (n - 1) * c * even[0] * p2,
        bz - c * odd * (p1 * r2 if n > 0 else 1.0),
        s - 2 * n * c * odd * p1,
        g - c * even[1] * (p1 * r2 if n > 0 else 1.0),
    )


@part
def to_any_power(field: Any, z: Any, r2: Any) -> Any:
    """Return the series of a sheet, term by term."""
    height = z - field.origin
    a2, b2, k = field.inner2, field.outer2, field.strength
    qa, qb = 1 / (a2 + height * height), 1 / (b2 + height * height)
    ga, gb = qa * math.sqrt(qa), qb * math.sqrt(qb)
    la, lb = 0.0, 0.0  # the derivatives before
    even = 0.0  # φ₀ is in none of the five
    sums = (0.0, 0.0, 0.0, 0.0, 0.0)
    p1, p2 = 0.0, 0.0
    for n in range(len(field.weights)):
        odd = k * (a2 * ga - b2 * gb)
        ga, la = _next(2 * n, height, qa, ga, la), ga
        gb, lb = _next(2 * n, height, qb, gb, lb), gb
        following = k * (a2 * ga - b2 * gb)
        sums = _add_terms(field.weights[n], r2, (even, following), odd, sums, n, (p1, p2))
        ga, la = _next(2 * n + 1, height, qa, ga, la), ga
        gb, lb = _next(2 * n + 1, height, qb, gb, lb), gb
        even = following
        p1, p2 = (1.0 if n == 0 else p1 * r2), (1.0 if n == 1 else (p2 * r2 if n > 1 else 0.0))
    return sums


def of_thick_base(field: Any, z: Any, r2: Any) -> Any:
    """Return the series of a thick base: φₙ is the sheet's φₙ₋₁ at one face less the other, over the thickness."""
    top, bottom = z - field.origin - field.thickness / 2, z - field.origin + field.thickness / 2
    a2, b2, k = field.inner2, field.outer2, field.strength / field.thickness
    qa, qb = 1 / (a2 + bottom * bottom), 1 / (b2 + bottom * bottom)
    pa, pb = 1 / (a2 + top * top), 1 / (b2 + top * top)
    ga, gb, ha, hb = qa * math.sqrt(qa), qb * math.sqrt(qb), pa * math.sqrt(pa), pb * math.sqrt(pb)
    la, lb, ma, mb = 0.0, 0.0, 0.0, 0.0
    even = 0.0
    # φ₁ from φ₀ itself
    odd = k * (bottom * (math.sqrt(qa) - math.sqrt(qb)) - top * (math.sqrt(pa) - math.sqrt(pb)))
    sums = (0.0, 0.0, 0.0, 0.0, 0.0)
    p1, p2 = 0.0, 0.0
    for n in range(len(field.weights)):
        following = k * (a2 * (ga - ha) - b2 * (gb - hb))
        sums = _add_terms(field.weights[n], r2, (even, following), odd, sums, n, (p1, p2))
        for i in range(2):
            ga, la = _next(2 * n + i, bottom, qa, ga, la), ga
            gb, lb = _next(2 * n + i, bottom, qb, gb, lb), gb
            ha, ma = _next(2 * n + i, top, pa, ha, ma), ha
            hb, mb = _next(2 * n + i, top, pb, hb, mb), hb
            if i == 0:
                odd = k * (a2 * (ga - ha) - b2 * (gb - hb))
        even = following
        p1, p2 = (1.0 if n == 0 else p1 * r2), (1.0 if n == 1 else (p2 * r2 if n > 1 else 0.0))
    return sums
