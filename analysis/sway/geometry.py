"""Geometric magnetism: spin splits the slow swings of a top, by an amount without a free constant.

A moment that follows the field of the base takes the spin's angular momentum along, and a force across the velocity
answers, as on a charge in a magnetic field.  To lowest order the slow swings obey α² − Ω_g α − α₀² = 0 with
Ω_g = (I₃ω₃/m)(B′/2B)²; the quartic of `analysis.stability` has them exactly for small motions, `slow_swings` at finite
amplitude.  The two slow swings alone determine Ω_g and α₀ at a known spin.  The form of the
base's field predicts Ω_g: B′/2B at the height at which α₀ is as seen.  Its strength and the top's moment drop out.

Source: Berry, Proc. R. Soc. A 452, 1207 (1996).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.comparison import weighted_mean
from analysis.errors import ShapesDiffer, TooFewReadings
from analysis.stability import vertical_mode
from analysis.sway.joint import Corrections, Joint, fit_together
from analysis.sway.known import Known
from analysis.sway.lines import Swings
from analysis.sway.orbit import NoSwing, pumps, slow_swings, small_swings
from analysis.sway.vertical import vertical_swing
from analysis.uncertainty import Estimate, partly_believed, propagate

#: The shift of the split at finite amplitude is known to this part of it; by its next order to this part of the shifts
#: of both swings, times the square of the sum of amplitudes² [1/m⁴]; and, as the swings exchange energy with the
#: vertical one, by this standard uncertainty of the difference between their beat and it [Hz].  The likeliest by the
#: errors of Ω_g in films of 186 tops in full motion (`levilab crosscheck sway --seed 100000`): 0.050, 8.4e9, 0.0077.
SHIFT_U, NEXT_SHIFT_U, APART_U_HZ = 0.05, 8.4e9, 0.0077
#: The choice between lines takes no shift from a split: its relative standard uncertainty, times A⁴ over the fourth
#: power of that difference [Hz⁴/m⁴], as full motions of 120 tops have it; differences below NEAREST_HZ count as that.
CHOICE_U, NEAREST_HZ = 1.8e7, 0.04
#: Tilt and height change within a window: relative standard uncertainty of Ω_g in a motion of small swings.
MOTION_U = 6.5e-4
#: The part by which the precession makes Ω_g smaller is known to this part of it: a mark beside the centre of mass
#: moves more than that.
LEAN_U = 0.3
#: The precession's frequency is that of small swings: relative standard uncertainty of B′/2B from it, per square of the
#: swings' amplitudes [1/m²].
PRECESSION_SHIFT_U = 1e3
#: The split over that of the quartic scatters by this part in a spin-down.
_BENT = 0.015
#: Standard uncertainty of the vertical swing that follows from the slow ones and the field [Hz].
_VERTICAL_U_HZ = 0.015
#: Large swings change it by so much more, times the square of the sum of amplitudes² and over the difference from the
#: beat [Hz²/m⁴].
_VERTICAL_SHIFT_U = 2.4e9
#: The grid: around each choice, in standard deviations, and points.
_FAR, _POINTS = 4.0, 17
#: The spin at which Ω_g is given [Hz].
REFERENCE_HZ = 30.0
#: Step of the slopes by the ring's sizes, in their standard uncertainties.
_STEP = 0.1
#: Without a split the factor is that of this Ω_g/ω₃, a hundredth of the usual one.
_SMALL = 1e-4
#: Rounds in which Ω_g and the factor between split and Ω_g are computed from each other; each gains three digits.
_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class Geometry:
    """What the swings say about geometric magnetism.

    Attributes:
        spin: at which Ω_g is given [Hz].
        measured: Ω_g/2π there, from the slow swings alone [Hz].
        predicted: Ω_g/2π from the form of the base's field [Hz].
        ratio: measured over predicted.
        gradient: B′/2B [1/m] that goes with Ω_g as measured.
        of_precession: that of the precession; None where no window shows it.
        of_base: that of the base's field.
        against_null: split over its standard uncertainty: so far from no splitting at all.
        parts, parts_predicted: of u of `measured` and of `predicted`, by name [Hz].
        shares: Ω_g/2π of each window, brought to that spin, shape (n,) [Hz].
        u_shares: their standard uncertainties but for what is common to all, shape (n,) [Hz].
        shifts: of backward and forward swing at finite amplitude that were taken away, shape (n, 2) [Hz].
        lean: part by which the precession makes Ω_g smaller, which was added, in the mean.
        heights: at which α₋α₊ is as seen, shape (n,) [m].
        splits, expected: of small swings, as seen and as `predicted` has them, shape (n,) [Hz].
        chi_square: Σ((share − measured)/u)².
        joint: all lines fitted together to the quartic.
    """

    spin: float
    measured: Estimate
    predicted: Estimate
    ratio: Estimate
    gradient: Estimate
    of_precession: Estimate | None
    of_base: Estimate
    against_null: float
    parts: Mapping[str, float]
    parts_predicted: Mapping[str, float]
    shares: Array
    u_shares: Array
    shifts: Array
    lean: float
    heights: Array
    splits: Array
    expected: Array
    chi_square: float
    joint: Joint


def geometric_magnetism(swings: Sequence[Swings], spin_hz: Array, known: Known) -> Geometry:
    """Compare the split of the slow swings with geometric magnetism.

    Args:
        swings: of each window.
        spin_hz: in the middle of each, positive, shape (n,) [Hz].
        known: about top and base.

    Raises:
        TooFewReadings, ShapesDiffer: see `analysis.errors`.
        ImpossibleRing: no top floats above such a base.
        NoSwing: no top above this base swings at these frequencies.
    """
    spin = np.asarray(spin_hz, dtype=np.float64)
    if not swings:
        raise TooFewReadings(seen=0, needed=1)
    if spin.shape != (len(swings),):
        raise ShapesDiffer(quantity="the spin", seen=spin.shape, expected=(len(swings),))
    each = list(zip(swings, spin.tolist(), strict=True))
    mistaken = np.array([one.mistake for one in swings])
    heights = np.array([known.height(one, nu) for one, nu in each])
    placed = [(one, nu, z) for (one, nu), z in zip(each, heights.tolist(), strict=True)]
    around = np.array([_shift(*one, known) for one in placed])
    shifts, of_split = around[:, 0].real, around.sum(axis=2)
    of_split.imag /= math.sqrt(3)  # the shift is anywhere within it
    small = np.array([one.frequency[:2] for one in swings]) - shifts
    seen, shift = small.sum(axis=1), np.abs(shifts.sum(axis=1))
    further = NEXT_SHIFT_U * np.array([one.size for one in swings]) ** 2 * np.abs(shifts).sum(axis=1)
    steps = np.abs(of_split[:, 1:] - of_split[:, :1]) / math.sqrt(2)  # of one u less and more the mean square counts
    shift_u = np.linalg.norm([SHIFT_U * shift, further, of_split[:, 0].imag, *steps.T], axis=0)
    leans = np.array([_lean(*one, known) for one in placed])
    value, half = REFERENCE_HZ * float(np.mean(seen / spin)), np.empty(0)
    for _ in range(_ROUNDS):  # Ω_g is the split but for some percent, which hardly depend on it
        size = max(abs(value) / REFERENCE_HZ, _SMALL)
        expected, half = np.array([_split(size, *row, known) for row in zip(spin, small, strict=True)]).T
        factor = (1 + leans) * size * REFERENCE_HZ / expected
        shares = factor * seen
        u_shares = np.abs(factor) * np.array([one.u_split for one in swings])
        doubt, mistake = np.abs(factor) * shift_u, np.abs(factor) * mistaken
        total = np.sqrt(u_shares**2 + doubt**2 + mistake**2)
        value, u_lines, chi_square = _mean(shares, total, u_shares)
    # the lean goes with the square of a size
    lean, lean_u = float(np.mean(leans)), math.hypot(LEAN_U, 2 * float(np.mean([one.size_u for one in swings])))
    parts = {
        "lines": u_lines,
        "amplitude": float(np.average(doubt, weights=1 / total**2)),
        "mistake": float(np.average(mistake, weights=1 / total**2)),
        "motion": MOTION_U * abs(value),
        "lean": lean_u * lean * abs(value),
    }
    u = math.hypot(*parts.values())
    far = np.array([PRECESSION_SHIFT_U * float(np.sum(one.amplitude[:2] ** 2)) for one in swings])
    less = Corrections(shifts, leans, lean_u, far, np.hypot(shift_u, mistaken), MOTION_U)
    measured = Estimate(value, u, "Hz")
    of_base, predicted, parts_predicted = _predict(each, heights, known)
    share = (predicted.value or 0.0) / REFERENCE_HZ
    return Geometry(
        spin=REFERENCE_HZ,
        measured=measured,
        predicted=predicted,
        ratio=_ratio(measured, predicted),
        gradient=_gradient_of(value / REFERENCE_HZ, u / REFERENCE_HZ, known),
        of_precession=_precession(swings, spin, half, known),
        of_base=of_base,
        against_null=value / (u or math.inf),
        parts=parts,
        parts_predicted=parts_predicted,
        shares=shares,
        u_shares=u_shares,
        shifts=shifts,
        lean=lean,
        heights=heights,
        splits=(1 + leans) * seen,
        expected=np.array([_split(share, *row, known)[0] for row in zip(spin, small, strict=True)]),
        chi_square=chi_square,
        joint=fit_together(swings, spin, heights, known, less),
    )


def _mean(values: Array, u: Array, independent: Array) -> tuple[float, float, float]:
    """Return the mean weighted by u, its standard uncertainty from the independent part, partly believed, and χ²."""
    mean, u_mean, chi_square = weighted_mean(values, u)
    own = u_mean**2 * float(np.linalg.norm(independent / u**2))
    return mean, partly_believed(chi_square, values.size - 1) * own, chi_square


def choose_lines(windows: Sequence[Swings], spin_hz: Array, known: Known) -> list[Swings]:
    """Return the likeliest of the swings of each window and their rivals, with the mistake that this may be.

    A line of the vertical swing beside a swing may be the stronger one, and both labels may suit a window.  Over all
    windows the split goes with the spin but for some percent, and the vertical swing with both swings and the field.
    The probability of Ω_g/ω₃, along a grid, is the product over the windows of the sum over the choices in each.

    Args:
        windows: with their rivals.
        spin_hz: in the middle of each, positive, shape (n,) [Hz].
        known: about top and base.
    """
    count = len(windows)
    owner = np.repeat(np.arange(count), [1 + len(window.rivals) for window in windows])
    starts, spin = np.searchsorted(owner, np.arange(count)), np.asarray(spin_hz, dtype=np.float64)[owner]
    choices = [one for window in windows for one in (window, *window.rivals)]
    each = zip(choices, spin.tolist(), strict=True)
    misfit, share, part = np.array([_judge(one, nu, known, 1 / count) for one, nu in each]).T
    least = np.minimum.reduceat(misfit, starts)[owner]
    if not np.isfinite(least).all():  # no top swings so in a window, which is said later
        return list(windows)
    split, own = np.array([(one.split, one.u_split) for one in choices]).T
    around = np.linspace(-_FAR, _FAR, _POINTS)[:, None] * np.hypot(own / spin, part * share)
    grid = np.unique(share + around)[:, None]
    width = np.hypot(own / spin, part * grid)
    terms = -0.5 * (misfit - least + ((share - grid) / width) ** 2) - np.log(width)
    whole = np.logaddexp.reduceat(terms, starts, axis=1)
    together = whole.sum(axis=1)
    odds = np.exp(together - together.max()) * np.gradient(grid[:, 0])
    weight = (odds / odds.sum()) @ np.exp(terms - whole[:, owner])
    best, found = terms[np.argmax(together)], []
    for k, window in enumerate(windows):
        (mine,) = np.nonzero(owner == k)
        chosen = mine[np.argmax(best[mine])]
        mistake = math.sqrt(float(weight[mine] @ (split[mine] - split[chosen]) ** 2))
        found.append(replace(choices[chosen], rivals=(), backwards=window.backwards, mistake=mistake))
    return found


def _judge(swings: Swings, spin: float, known: Known, part: float) -> tuple[float, float, float]:
    """Return misfit, Ω_g/ω₃ and the part of it by which it scatters; the misfit is infinite where no top swings so.

    The vertical swing of this base and the size of the swings, which are alike in all windows, count by this part in
    each.
    """
    backward, forward = swings.frequency[:2].tolist()
    size = max(abs(swings.split) / spin, _SMALL)
    try:
        slope = known.gradient(known.height(swings, spin))
    except NoSwing:
        return math.inf, size, _BENT
    off = swings.vertical.value - vertical_swing(backward, forward, slope, known.top.gravity)
    u = math.hypot(_VERTICAL_U_HZ, _VERTICAL_SHIFT_U * swings.size**2 / max(_away(swings), NEAREST_HZ))
    unlikely = swings.misfit + part * ((off / u) ** 2 + 2 * math.log(u) + swings.weakness)
    share = size * swings.split / _split(size, spin, swings.frequency[:2], known)[0]
    size = swings.size * math.exp(8 * swings.size_u**2)  # the root mean square of A⁴ goes into u
    return unlikely, share, math.hypot(_BENT, min(CHOICE_U * size**2 / max(_away(swings), NEAREST_HZ) ** 4, 1.0))


def _away(swings: Swings) -> float:
    """Return how far the beat of the slow swings is from the vertical swing [Hz]."""
    return abs(float(swings.frequency[1] - swings.frequency[0]) - swings.vertical.value)


def _split(share: float, spin: float, small: Array, known: Known) -> tuple[float, float]:
    """Return the split [Hz] of a top with this Ω_g/ω₃ and the product of slow swings that is seen, and its Ω²/2.

    Ω_g/ω₃ = (I₃/m)(mg/2P)² gives P, and (I₁α² − I₃ω₃α + P)(α² + Ω²/2) = m g²/4 the swings.
    """
    top = known.top
    both = top.mass * top.gravity / 2
    p = both * math.sqrt(top.axial / (top.mass * share))
    product = float(small[0] * small[1])
    half, slow = both**2 / (top.mass * p) + 4 * math.pi**2 * product, (0.0, 0.0)

    def stiffness(_: Array) -> Array:
        return np.array([[-p], [-top.mass * half], [both]])

    given = replace(top, stiffnesses=stiffness)
    for _ in range(_ROUNDS):
        slow = small_swings(known.field, given, 0.0, spin)
        half += 4 * math.pi**2 * (product - math.prod(slow))
    return sum(slow), half


def _shift(swings: Swings, spin: float, height: float, known: Known) -> NDArray[np.complex128]:
    """Return by how much finite amplitude shifts the slow swings, of a point in the mean field of the magnet [Hz].

    Each swing and the line beside it, at the other swing ± the vertical one, push each other apart.  In the steady
    motion there is no such line: that part of its shift is replaced by the one that belongs to the distance as seen.
    Lines nearer than any push leaves them have an imaginary one without it: within that part the shift is unknown.
    The rows, shape (5, 2), after the first are those with this distance, then with the amplitudes, one u less and more.
    """
    top = replace(known.top_at(height), stiffnesses=None)
    amplitudes = float(swings.amplitude[0]), float(swings.amplitude[1])
    still = np.array(small_swings(known.field, top, height, spin))
    moving = np.array(slow_swings(known.field, top, height, spin, amplitudes))
    pump, own = pumps(known.field, top, height, spin, amplitudes), vertical_mode(known.field, top, height)
    steady = pump / ((moving[1] - moving[0]) ** 2 - own**2)
    beat, vertical = float(swings.frequency[1] - swings.frequency[0]), swings.vertical.value
    apart = beat - vertical + math.hypot(APART_U_HZ, swings.vertical.u) * np.array([[0], [-1], [1], [0], [0]])
    squares = np.exp(2 * swings.size_u * np.array([[0], [0], [0], [-1], [1]]))
    least = 2 * np.sqrt(squares * pump / (beat + vertical) + 0j)
    before = np.sqrt(apart - least) * np.sqrt(apart + least)  # of the sign of `apart`
    sense = np.array([-1.0, 1.0])
    return np.asarray(squares * (moving - still - sense * steady) + sense * (apart - before) / 2)


def _lean(swings: Swings, spin: float, height: float, known: Known) -> float:
    """Return by which part the precession, of an angle θ, makes Ω_g smaller.

    Its mean moment is μ cos θ, so that it floats lower, by θ²B′/2B″; its angular momentum along the mean axis is
    I₃ω₃(1 − θ²/2) + I₁α_p θ².
    """
    if swings.frequency.size < 3:
        return 0.0
    top, alpha = known.top, 2 * math.pi * float(swings.frequency[2])
    square = (2 * float(swings.amplitude[2]) * alpha**2 / top.gravity) ** 2
    b, slope, bend = known.field(np.array([height]))[:3, 0]
    turning = top.transverse * alpha / (top.axial * 2 * math.pi * spin)
    return float(square * (0.5 - turning + slope**2 / (b * bend) - 1))


def _gradient_of(share: float, u: float, known: Known) -> Estimate:
    """Return B′/2B of Ω_g/ω₃ = (I₃/m)(B′/2B)²."""
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
    u_p = (turning - 2 * top.transverse * alpha) * u
    mean, u_mean, _ = _mean(p, u_p, u_p)
    value = top.mass * top.gravity / (2 * mean)
    parts = (
        u_mean / mean,
        PRECESSION_SHIFT_U * float(np.mean([np.sum(one.amplitude[:2] ** 2) for one in swings])),
        known.mass_u / top.mass,
        known.axial_u / top.axial,
    )
    return Estimate(value, value * math.hypot(*parts), "1/m")


def _predict(
    each: Sequence[tuple[Swings, float]], heights: Array, known: Known
) -> tuple[Estimate, Estimate, dict[str, float]]:
    """Return B′/2B of the base's field where α₋α₊ is as seen, (I₃ω₃/m)(B′/2B)² over 2π, and the parts of its u."""
    gradients = [known.gradient(z) for z in heights.tolist()]
    middle, top, gradient = len(each) // 2, known.top, float(np.mean(gradients))
    slopes = []
    for k, name in enumerate(("thickness", "inner_radius", "outer_radius")):
        step = _STEP * math.sqrt(float(known.covariance[k, k]))
        other = replace(known, ring=replace(known.ring, **{name: getattr(known.ring, name) + step}))
        slopes.append((other.gradient(other.height(*each[middle])) - gradients[middle]) / step if step else 0.0)
    u = float(propagate(known.covariance, np.array([slopes]))[1][0])
    value = top.axial * REFERENCE_HZ / top.mass * gradient**2
    relative = {"base": 2 * u / gradient, "mass": known.mass_u / top.mass, "inertia": known.axial_u / top.axial}
    parts = {name: value * part for name, part in relative.items()}
    return Estimate(gradient, u, "1/m"), Estimate(value, math.hypot(*parts.values()) or None, "Hz"), parts


def _ratio(measured: Estimate, predicted: Estimate) -> Estimate:
    """Return the ratio of two independent estimates."""
    above, below = float(measured.value or 0.0), float(predicted.value or math.nan)
    return Estimate(above / below, math.hypot(measured.u or 0.0, above / below * (predicted.u or 0.0)) / below, "1")
