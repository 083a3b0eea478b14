"""Where and how fast a top floats: windows of height, mass and spin from the field on the base's axis.

A field is a function of the height z [m], shape (n,), that gives B, B′, B″ on the axis, shape (3, n) or more rows
[T, T/m, T/m²]; B counts along z.  μ is the moment along the top's axis, signed: an upright top of μ < 0 in B > 0
stands against the field, as the Levitron does.

Sources: Berry, Proc. R. Soc. A 452, 1207 (1996) (adiabatic); Simon, Heflinger & Ridgway, Am. J. Phys. 65, 286 (1997);
Gans, Jones & Washizu, J. Phys. D 31, 671 (1998) (linear).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array

AxialField = Callable[[Array], Array]

#: Steps of the scans: heights in which a window or an equilibrium is looked for, and spins.
HEIGHTS = 4000
SPINS = 2000


def _zero(function: Callable[[float], float], low: float, high: float, *, xtol: float, rtol: float = 1e-14) -> float:
    """Find where a function changes sign, by Brent's method."""
    from scipy.optimize import brentq  # takes a moment to load

    return float(brentq(function, low, high, xtol=xtol, rtol=rtol))


@dataclass(frozen=True)
class SymmetricTop:
    """A symmetric top.

    Attributes:
        mass: [kg].
        transverse, axial: I₁, I₃ [kg m²].
        moment: signed [A m²].
        gravity: [m/s²].
        stiffnesses: of an upright magnet that is no point, heights, shape (n,) → ∂²E/∂θ², ∂²E/∂x², ∂²E/∂x∂θ of its
            energy, shape (3, n) [J, J/m², J/m]; None: those of a point, μB, μB″/2, μB′/2.
    """

    mass: float
    transverse: float
    axial: float
    moment: float
    gravity: float = 9.82
    stiffnesses: Callable[[Array], Array] | None = None

    def stiffness(self, field: AxialField, z: Array) -> Array:
        """Return the stiffness against tilting, against moving sideways, and between both: shape (3, n)."""
        if self.stiffnesses is not None:
            return self.stiffnesses(z)
        b, slope, bend = field(z)[:3]
        return self.moment * np.array([b, bend / 2, slope / 2])


@dataclass(frozen=True)
class Window:
    """Heights at which a top whose moment follows the field is stable; masses that float there.

    Attributes:
        low, high: [m].
        light, heavy: of a top of the given moment, which stands against the field [kg].
    """

    low: float
    high: float
    light: float
    heavy: float


@dataclass(frozen=True)
class Equilibrium:
    """A height at which field and weight balance for an upright top.

    Attributes:
        height: [m].
        axial, radial: stiffness over mass of a moment that follows the field, positive if stable [1/s²].
        spins: the windows of spin in which small motions stay small, from the quartic [Hz].
    """

    height: float
    axial: float
    radial: float
    spins: tuple[tuple[float, float], ...]

    @property
    def stable(self) -> bool:
        """Stable up and down and sideways, if the top spins neither too slowly nor too fast."""
        return self.axial > 0 and self.radial > 0


# --- adiabatic: the moment follows the field ---


def _conditions(field: AxialField, top: SymmetricTop, z: Array) -> Array:
    """Return three functions, positive where stable: lift away from the base, axial and radial stiffness; shape (3, n).

    In φ₁ = −B: φ₁φ₂ < 0, φ₁φ₃ > 0, φ₂² − 2φ₃φ₁ > 0 for U = mgz + |μ||B|.  The last is the sideways stiffness of a
    moment that follows the field, E_xx − E_xθ²/E_θθ, for a top that stands against it.
    """
    b, slope, bend = field(z)[:3]
    tilt, sideways, both = top.stiffness(field, z) / top.moment
    return np.array([-b * slope, b * bend, 4 * (both**2 - sideways * tilt)])


def windows(field: AxialField, top: SymmetricTop, low: float, high: float) -> tuple[Window, ...]:
    """Return the stable heights between low and high [m], for a moment against the field, each with its masses.

    Scanned in HEIGHTS steps, each edge then found to the last digits.  Without a moment there are none.
    """
    if top.moment == 0:
        return ()
    z = np.linspace(low, high, HEIGHTS)
    inside = np.all(_conditions(field, top, z) > 0, axis=0)
    edges = np.flatnonzero(inside[1:] != inside[:-1])
    places = [low] * bool(inside[0]) + [_edge(field, top, z[i], z[i + 1]) for i in edges] + [high] * bool(inside[-1])
    found = []
    for a, b in zip(places[::2], places[1::2], strict=True):
        masses = _masses(field, top, np.linspace(a, b, 200))
        found.append(Window(a, b, float(masses.min()), float(masses.max())))
    return tuple(found)


def _edge(field: AxialField, top: SymmetricTop, inside: float, outside: float) -> float:
    """Return the height at which one of the conditions passes zero."""
    size = _sizes(field, inside)
    worst = lambda z: float(np.min(_conditions(field, top, np.array([z]))[:, 0] / size))  # noqa: E731
    return _zero(worst, inside, outside, xtol=1e-15, rtol=1e-14)


def _sizes(field: AxialField, z: float) -> Array:
    """Return the scale of each of the conditions at a height, by which they can be compared."""
    b, slope, bend = np.abs(field(np.array([z]))[:3, 0])
    return np.array([b * slope, b * bend + slope**2, slope**2])


def floating_mass(field: AxialField, top: SymmetricTop, height: float) -> float:
    """Return the mass [kg] that floats at a height: |μ||B′|/g; infinite where nothing weighs."""
    return float(_masses(field, top, np.array([height]))[0])


def _masses(field: AxialField, top: SymmetricTop, heights: Array) -> Array:
    if top.gravity == 0:
        return np.full(heights.shape, math.inf)
    return np.asarray(np.abs(top.moment * field(heights)[1]) / top.gravity)


def reduced_mass(mass: float, top: SymmetricTop, radius: float, strength: float) -> float:
    """Return M = m g a²/(2π|μ|ρ), without dimension."""
    return mass * top.gravity * radius**2 / (2 * math.pi * abs(top.moment) * strength)


# --- the equilibria of an upright top ---


def equilibria(field: AxialField, top: SymmetricTop, low: float, high: float) -> tuple[Equilibrium, ...]:
    """Return all heights between low and high [m] at which the force μB′ carries the weight."""
    z = np.linspace(low, high, HEIGHTS)
    weight = top.mass * top.gravity

    def missing(height: float) -> float:
        return float(top.moment * field(np.array([height]))[1, 0] - weight)

    values = top.moment * field(z)[1] - weight
    places = [_zero(missing, z[i], z[i + 1], xtol=1e-15) for i in np.flatnonzero(values[1:] * values[:-1] < 0)]
    return tuple(_describe_equilibrium(field, top, place) for place in places)


def _describe_equilibrium(field: AxialField, top: SymmetricTop, height: float) -> Equilibrium:
    bend = float(field(np.array([height]))[2, 0])
    tilt, sideways, both = top.stiffness(field, np.array([height]))[:, 0]
    # U = −μB for the upright top; sideways |B| changes by B′²/4B − B″/2 (Berry), and −μ = |μ| against the field
    axial = -top.moment * bend / top.mass
    radial = float(sideways - both**2 / tilt) / top.mass
    return Equilibrium(height, axial, radial, spin_windows(field, top, height))


# --- linear: small motions of the whole top ---


def quartic(field: AxialField, top: SymmetricTop, height: float, spin: float) -> Array:
    """Return the coefficients of (I₁α² − I₃ω₃α + P)(α² + Ω²/2) = (μB′)²/4m over I₁, highest power first.

    ω₃ is `spin` [rad/s], u = x + iy and N = n_x + i n_y ∝ e^{iαt}; P = −μB = −E_θθ, Ω²/2 = −μB″/2m = −E_xx/m,
    μB′/2 = E_xθ, which is mg/2 at the equilibrium of a point.
    """
    tilt, sideways, both = (float(value) for value in top.stiffness(field, np.array([height]))[:, 0])
    p, half, turn = -tilt, -sideways / top.mass, top.axial * spin
    i1 = top.transverse
    return np.array([i1, -turn, p + i1 * half, -turn * half, p * half - both**2 / top.mass]) / i1


def modes(field: AxialField, top: SymmetricTop, height: float, spin_hz: float) -> NDArray[np.complex128]:
    """Return the four frequencies α/2π [Hz] of the sideways motion; real if stable, negative if it turns backwards."""
    roots = np.roots(quartic(field, top, height, 2 * math.pi * spin_hz)) / (2 * math.pi)
    return np.asarray(roots[np.argsort(roots.real)], dtype=np.complex128)


def vertical_mode(field: AxialField, top: SymmetricTop, height: float) -> float:
    """Return the frequency [Hz] of the up-and-down motion; NaN where it is unstable."""
    square = -top.moment * float(field(np.array([height]))[2, 0]) / top.mass
    return math.sqrt(square) / (2 * math.pi) if square > 0 else math.nan


def spin_windows(field: AxialField, top: SymmetricTop, height: float) -> tuple[tuple[float, float], ...]:
    """Return the windows of spin [Hz] with four real roots, between 0 and 20 times the sleeping top's limit.

    Four real roots: looked for in SPINS steps; each edge is then the zero of the discriminant.
    """
    limit = sleeping_limit(field, top, height)
    if not math.isfinite(limit):
        return ()
    at_zero, at_one = (quartic(field, top, height, spin) for spin in (0.0, 2 * math.pi))
    spins = np.linspace(0, 20 * limit, SPINS)
    stable = _all_real(at_zero[:, None] + np.outer(at_one - at_zero, spins))  # the coefficients are linear in the spin
    change = np.flatnonzero(stable[1:] != stable[:-1])

    def discriminant(spin: float) -> float:
        return float(_discriminant(at_zero + spin * (at_one - at_zero)))

    edges = [_zero(discriminant, spins[i], spins[i + 1], xtol=1e-13, rtol=1e-14) for i in change]
    edges = [0.0] * bool(stable[0]) + edges + [math.inf] * bool(stable[-1])
    return tuple(zip(edges[::2], edges[1::2], strict=True))


def _all_real(coefficients: Array) -> NDArray[np.bool_]:
    """Return whether quartics have four real roots, from their coefficients, shape (5, n) (E. L. Rees 1922).

    A positive discriminant alone leaves four or none.
    """
    a, b, c, d, e = coefficients
    depressed = 8 * a * c - 3 * b**2
    none = 64 * a**3 * e - 16 * a**2 * c**2 + 16 * a * b**2 * c - 16 * a**2 * b * d - 3 * b**4
    return np.asarray((_discriminant(coefficients) > 0) & (depressed < 0) & (none < 0))


def _discriminant(coefficients: Array) -> Array:
    """Return the discriminant of a x⁴ + b x³ + c x² + d x + e, of coefficients of shape (5, …).

    It is (4(c² − 3bd + 12ae)³ − (2c³ − 9bcd + 27ad² + 27b²e − 72ace)²)/27.
    """
    a, b, c, d, e = coefficients
    first = c * c - 3 * b * d + 12 * a * e
    second = 2 * c**3 - 9 * b * c * d + 27 * a * d * d + 27 * b * b * e - 72 * a * c * e
    return np.asarray((4 * first**3 - second**2) / 27)


def sleeping_limit(field: AxialField, top: SymmetricTop, height: float) -> float:
    """Return 2√(I₁P)/I₃ [Hz]: below it a top on a fixed point would not sleep.  NaN where the field rights it."""
    p = -float(top.stiffness(field, np.array([height]))[0, 0])
    return 2 * math.sqrt(top.transverse * p) / top.axial / (2 * math.pi) if p > 0 else math.nan


def thesis_limit(field: AxialField, top: SymmetricTop, height: float) -> float:
    """Return the thesis's own estimate √(mg/I₃·|φ₁/φ₂|)/2π [Hz]; it lacks the factor 2√(I₁/I₃)."""
    b, slope = (float(value) for value in field(np.array([height]))[:2, 0])
    return math.sqrt(top.mass * top.gravity / top.axial * abs(b / slope)) / (2 * math.pi)


def wobble_resonance(field: AxialField, top: SymmetricTop, height: float) -> float:
    """Return √(P/(I₃ − I₁)) [Hz]: at this spin a moment across the axis tilts the top without end.

    A transverse part δ of the moment makes it lean by δ P/((I₃ − I₁)ω² − P), once per turn.  NaN where there is none:
    of a long top, or where the field rights it.
    """
    p = -float(top.stiffness(field, np.array([height]))[0, 0])
    inertia = top.axial - top.transverse
    return math.sqrt(p / inertia) / (2 * math.pi) if p > 0 and inertia > 0 else math.nan
