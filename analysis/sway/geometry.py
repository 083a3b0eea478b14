"""Geometric magnetism: spin splits the slow swings of a top, by an amount without a free constant.

A moment that follows the field of the base takes the spin's angular momentum along, and a force across the velocity
answers, as on a charge in a magnetic field.  To lowest order the slow swings obey α² − Ω_g α − α₀² = 0 with
Ω_g = (I₃ω₃/m)(B′/2B)²; the quartic of `analysis.stability` has them exactly for small motions, `slow_swings` at finite
amplitude.  The two slow swings alone determine Ω_g and α₀ at a known spin.  B′/2B of a scan of the field, or of the
precession, predicts Ω_g.

Source: Berry, Proc. R. Soc. A 452, 1207 (1996).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ShapesDiffer, TooFewReadings
from analysis.stability import SymmetricTop, modes
from analysis.sway.orbit import NoSwing, slow_swings
from analysis.uncertainty import Estimate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from analysis.sway.lines import Swings
    from analysis.sway.orbit import Field

Array = NDArray[np.float64]

#: The shift at finite amplitude is known to this part of it: it is computed without a vertical swing of its own.
SHIFT_U = 0.05
#: Where the beat of the slow swings comes near the vertical swing, they exchange energy with it, and the shift's next
#: order counts: relative standard uncertainty of the split, times A⁴ over the cube of the difference [Hz³/m⁴], as full
#: motions of tops over the whole window of masses have it; differences below NEAREST_HZ count as that.
RESONANCE_U, NEAREST_HZ = 2e8, 0.02
#: Tilt and height change within a window: relative standard uncertainty of Ω_g in a motion of small swings.
MOTION_U = 1.5e-3
#: The precession's frequency is that of small swings: relative standard uncertainty of B′/2B from it, per square of the
#: swings' amplitudes [1/m²].
PRECESSION_SHIFT_U = 1e3
#: u of the lines is believed within a quarter of it: as of 8 degrees of freedom (GUM G.4.2).
BELIEVED = 8.0
#: The spin at which Ω_g is given [Hz].
REFERENCE_SPIN_HZ = 30.0
#: Rounds in which Ω_g and the factor between split and Ω_g are computed from each other; each gains three digits.
_ROUNDS = 4


@dataclass(frozen=True)
class Known:
    """What is known of the top and of the base.

    Attributes:
        top: the moment that of a point.
        mass_u, axial_u: standard uncertainties of mass [kg] and I₃ [kg m²].
        field: of the base on its axis.
        heights: between which the top floats [m].
        gradient: B′/2B where it floats, from a scan [1/m].
    """

    top: SymmetricTop
    mass_u: float
    axial_u: float
    field: Field
    heights: tuple[float, float]
    gradient: Estimate | None = None


@dataclass(frozen=True, eq=False)
class Geometry:
    """What the swings say about geometric magnetism.

    Attributes:
        spin: at which Ω_g is given [Hz].
        measured: Ω_g/2π there, from the slow swings alone [Hz].
        gradients: B′/2B [1/m] that goes with it, that of the precession, and that of the scan; None where not known.
        predicted: Ω_g/2π from the scan, or from the precession [Hz]; None without either.
        ratio: measured over predicted.
        against_null: split over its standard uncertainty: so far from no splitting at all.
        shares: Ω_g/2π of each window, brought to that spin, shape (n,) [Hz].
        u_shares: their standard uncertainties but for what is common to all, shape (n,) [Hz].
        shifts: of backward and forward swing at finite amplitude that were taken away, shape (n, 2) [Hz].
        chi_square: Σ((share − measured)/u)².
    """

    spin: float
    measured: Estimate
    gradients: tuple[Estimate, Estimate | None, Estimate | None]
    predicted: Estimate | None
    ratio: Estimate | None
    against_null: float
    shares: Array
    u_shares: Array
    shifts: Array
    chi_square: float


def geometric_magnetism(
    swings: Sequence[Swings], spin_hz: Array, known: Known, reference: float = REFERENCE_SPIN_HZ
) -> Geometry:
    """Compare the split of the slow swings with geometric magnetism.

    Args:
        swings: of each window.
        spin_hz: in the middle of each, positive, shape (n,) [Hz].
        known: about top and base.
        reference: spin at which Ω_g is given [Hz].

    Raises:
        TooFewReadings, ShapesDiffer: see `analysis.errors`.
        NoSwing: no top with this field swings at these frequencies.
    """
    spin = np.asarray(spin_hz, dtype=np.float64)
    if not swings:
        raise TooFewReadings(seen=0, needed=1)
    if spin.shape != (len(swings),):
        raise ShapesDiffer(quantity="the spin", seen=spin.shape, expected=(len(swings),))
    shifts = np.array([_shift(one, nu, known) for one, nu in zip(swings, spin.tolist(), strict=True)])
    small = np.array([one.frequency[:2] for one in swings]) - shifts
    resonance = np.array([_doubt(one) for one in swings])
    share, half = float(np.mean(small.sum(axis=1) / spin)), np.empty(0)
    for _ in range(_ROUNDS):  # Ω_g is the split but for some percent, which hardly depend on it
        expected, half = np.array([_split(share, *row, known.top) for row in zip(spin, small, strict=True)]).T
        factor = share * reference / expected
        shares = factor * small.sum(axis=1)
        u_shares = np.abs(factor) * np.array([one.u_split for one in swings])
        doubt = np.abs(shares) * resonance + SHIFT_U * np.abs(factor * shifts.sum(axis=1))
        weight = 1 / (u_shares**2 + doubt**2)
        share = float(np.sum(weight * shares) / np.sum(weight)) / reference
    left = float(np.sum(weight * (shares - share * reference) ** 2))
    scale = math.sqrt((left + BELIEVED) / (spin.size - 1 + BELIEVED))
    by_chance = scale / math.sqrt(float(np.sum(weight)))
    by_shift = float(np.sum(weight * doubt) / np.sum(weight))
    u = math.hypot(by_chance, by_shift, MOTION_U * share * reference)
    measured = Estimate(share * reference, u, "Hz")
    gradients = (_gradient_of(measured, reference, known), _precession(swings, spin, half, known), known.gradient)
    predicted = _predict(gradients[2] or gradients[1], known, reference)
    return Geometry(
        spin=reference,
        measured=measured,
        gradients=gradients,
        predicted=predicted,
        ratio=_ratio(measured, predicted),
        against_null=share * reference / u,
        shares=shares,
        u_shares=u_shares,
        shifts=shifts,
        chi_square=left,
    )


def _doubt(swings: Swings) -> float:
    """Return the relative standard uncertainty of a split from the exchange of energy with the vertical swing."""
    backward, forward = swings.frequency[:2]
    away = max(abs(float(forward - backward) - swings.vertical), NEAREST_HZ)
    size = float(np.sum(swings.amplitude[:2] ** 2))
    return float(min(RESONANCE_U * size**2 / away**3, 1.0))


def _split(share: float, spin: float, small: Array, top: SymmetricTop) -> tuple[float, float]:
    """Return the split [Hz] of a top with this Ω_g/ω₃ and the product of slow swings that is seen, and its Ω_z²/2."""
    p, omega = _righting(share, top), 2 * math.pi * spin
    product = 4 * math.pi**2 * float(small[0] * small[1])
    half = top.mass * top.gravity**2 / (4 * p) + product
    for _ in range(_ROUNDS):
        slow = _slow_roots(p, half, omega, top)
        half += product - float(slow[0] * slow[1])
    return float(slow.sum()) / (2 * math.pi), half


def _righting(share: float, top: SymmetricTop) -> float:
    """Return P [J] that belongs to Ω_g/ω₃ = (I₃/m)(mg/2P)²."""
    return top.mass * top.gravity / 2 * math.sqrt(top.axial / (top.mass * max(share, 1e-12)))


def _slow_roots(p: float, half: float, omega: float, top: SymmetricTop) -> Array:
    """Return the two slow roots of (I₁α² − I₃ω₃α + P)(α² + Ω²/2) = m g²/4, the backward one first [rad/s]."""
    i1, turn = top.transverse, top.axial * omega
    last = p * half - top.mass * top.gravity**2 / 4
    roots = np.roots(np.array([i1, -turn, p + i1 * half, -turn * half, last]) / i1)
    return np.sort(roots[np.argsort(np.abs(roots))[:2]].real)


def _shift(swings: Swings, spin: float, known: Known) -> tuple[float, float]:
    """Return by how much finite amplitude shifts the slow swings of a top that floats where α₋α₊ is as seen [Hz]."""
    from scipy.optimize import brentq

    product = float(swings.frequency[0] * swings.frequency[1])
    moment, gravity = known.top.moment, known.top.gravity

    def top_at(height: float) -> SymmetricTop:
        return replace(known.top, mass=abs(moment * float(known.field(np.array([height]))[1, 0])) / gravity)

    def missing(height: float) -> float:
        first, second = sorted(modes(known.field, top_at(height), height, spin).real, key=abs)[:2]
        return float(first * second) - product

    low, high = known.heights
    try:
        height = float(brentq(missing, low, high, xtol=1e-7))
    except ValueError:
        raise NoSwing(amplitudes=(float(swings.amplitude[0]), float(swings.amplitude[1])), spin=spin) from None
    still = sorted(sorted(modes(known.field, top_at(height), height, spin).real, key=abs)[:2])
    amplitudes = float(swings.amplitude[0]), float(swings.amplitude[1])
    moving = slow_swings(known.field, top_at(height), height, spin, amplitudes)
    return moving[0] - still[0], moving[1] - still[1]


def _gradient_of(measured: Estimate, reference: float, known: Known) -> Estimate:
    """Return B′/2B of Ω_g = (I₃ω₃/m)(B′/2B)²."""
    share, u = float(measured.value or 0.0) / reference, float(measured.u or 0.0) / reference
    if share <= 0:
        return Estimate(None, None, "1/m")
    value = math.sqrt(share * known.top.mass / known.top.axial)
    parts = (u / share, known.mass_u / known.top.mass, known.axial_u / known.top.axial)
    return Estimate(value, value / 2 * math.hypot(*parts), "1/m")


def _precession(swings: Sequence[Swings], spin: Array, half: Array, known: Known) -> Estimate | None:
    """Return B′/2B = mg/2P with P from the precession, (I₁α² − I₃ω₃α + P)(α² + Ω²/2) = m g²/4; None without one."""
    top = known.top
    seen = [k for k, one in enumerate(swings) if one.frequency.size > 2]
    if not seen:
        return None
    alpha, u = 2 * np.pi * np.array([(swings[k].frequency[2], swings[k].u[2]) for k in seen]).T
    turning = top.axial * 2 * np.pi * spin[seen]
    p = top.mass * top.gravity**2 / (4 * (alpha**2 + half[seen])) + turning * alpha - top.transverse * alpha**2
    weight = 1 / ((turning - 2 * top.transverse * alpha) * u) ** 2
    mean = float(np.sum(weight * p) / np.sum(weight))
    scale = math.sqrt((float(np.sum(weight * (p - mean) ** 2)) + BELIEVED) / (p.size - 1 + BELIEVED))
    value = top.mass * top.gravity / (2 * mean)
    parts = (
        scale / math.sqrt(float(np.sum(weight))) / mean,
        PRECESSION_SHIFT_U * float(np.mean([np.sum(one.amplitude[:2] ** 2) for one in swings])),
        known.mass_u / top.mass,
        known.axial_u / top.axial,
    )
    return Estimate(value, value * math.hypot(*parts), "1/m")


def _predict(gradient: Estimate | None, known: Known, reference: float) -> Estimate | None:
    if gradient is None or gradient.value is None or gradient.u is None:
        return None
    top = known.top
    value = top.axial * reference / top.mass * gradient.value**2
    parts = (2 * gradient.u / gradient.value, known.mass_u / top.mass, known.axial_u / top.axial)
    return Estimate(value, value * math.hypot(*parts), "Hz")


def _ratio(measured: Estimate, predicted: Estimate | None) -> Estimate | None:
    if predicted is None or not (measured.value and measured.u and predicted.value and predicted.u):
        return None
    value = measured.value / predicted.value
    return Estimate(value, abs(value) * math.hypot(measured.u / measured.value, predicted.u / predicted.value), "1")
