"""Vectors, turns and the sine inside the kernels: straight-line code, so that lanes stay lanes."""

import math

from levilab.simulator.kernels.compiled import part

Vector = tuple[float, float, float]


@part
def cross(a: Vector, b: Vector) -> Vector:
    """Return the product a×b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@part
def dot(a: Vector, b: Vector) -> float:
    """Return the product a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def plus(a: Vector, k: float, b: Vector) -> Vector:
    """Return the sum a + k b."""
    return (a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2])


#: Taylor coefficients in x² of sin(x)/x and of (1 − cos x)/x².
_SINC: tuple[float, ...] = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(12))
_COSC: tuple[float, ...] = tuple((-1) ** k / math.factorial(2 * k + 2) for k in range(8))


@part
def rotation(square: float) -> tuple[float, float]:
    """Sin(x)/x and (1 − cos x)/x² from x² ≤ 4: eight terms, error 2e-10 at 2, 3e-15 at 1, and rounding below.

    An error in x¹⁶, at steps where the scheme's own, in x⁶ or x⁸, is a thousand times larger.  No square root,
    no division by a small angle, and the terms pair up so that few wait for each other.
    """
    s, c, t, t2 = _SINC, _COSC, square, square * square
    t4 = t2 * t2
    sinc = (s[0] + t * s[1] + t2 * (s[2] + t * s[3])) + t4 * (s[4] + t * s[5] + t2 * (s[6] + t * s[7]))
    cosc = (c[0] + t * c[1] + t2 * (c[2] + t * c[3])) + t4 * (c[4] + t * c[5] + t2 * (c[6] + t * c[7]))
    return sinc, cosc


@part
def rotate(a: Vector, axis: Vector, sine: float, cosine: float) -> Vector:
    """Return the vector a turned about an axis w by the angle |w| (Rodrigues): a + sine w×a + cosine w×(w×a)."""
    once = cross(axis, a)
    return plus(plus(a, sine, once), cosine, cross(axis, once))


@part
def sine_of_turns(turns: float) -> float:
    """Sin(2π turns), without a call, so that lanes stay lanes; error below 3e-16."""
    x = turns - math.floor(turns + 0.5)  # −½ … ½, exact
    x = 0.5 - x if x > 0.25 else (-0.5 - x if x < -0.25 else x)
    x *= 2 * math.pi
    s, t = _SINC, x * x
    t2 = t * t
    t4 = t2 * t2
    low = s[0] + t * s[1] + t2 * (s[2] + t * s[3])
    middle = s[4] + t * s[5] + t2 * (s[6] + t * s[7])
    return x * (low + t4 * (middle + t4 * (s[8] + t * s[9] + t2 * (s[10] + t * s[11]))))
