"""Heights, masses and spins of the tops that float above a base, and the moment, from a scan of its field.

The theory is that of `analysis.stability`; the top's magnet is a point or a disc (`analysis.field.magnet`).  It is
evaluated at the known parameters of scan and top, and once more with each uncertain one shifted; the slopes carry the
whole covariance to the results.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.arrays import Array
from analysis.field.fit import FieldScan
from analysis.field.magnet import Disc, axial_field, stiffnesses
from analysis.field.ring import Ring
from analysis.remarks import Remark
from analysis.stability import AxialField, SymmetricTop, Window, equilibria, windows
from analysis.uncertainty import Estimate, propagate

#: Relative change of hard ferrite's remanence per kelvin (IEC 60404-8-1: −0.2 %/K), of base and top alike.
FERRITE_PER_K = -0.002
#: Tops are searched from a tenth of the inner radius to four outer radii above the upper face, as in the simulator.
_LOW, _HIGH = 0.1, 4.0
#: A window is searched around the previous one, by this many of its widths on either side.
_AROUND = 2.0

#: The results in the order of their covariance, and their units.
RESULTS: Mapping[str, str] = {
    "lowest_height": "m",
    "highest_height": "m",
    "lightest_mass": "kg",
    "heaviest_mass": "kg",
    "mass_to_set": "kg",
    "height_at_mass": "m",
    "height_per_mass": "m/kg",
    "slowest_spin": "Hz",
    "fastest_spin": "Hz",
    "moment": "A m^2",
    "mass_to_add": "kg",
}
#: The input beside the parameters of the ring.
_OF_TOP = ("mass", "transverse", "axial", "moment", "height")


@dataclass(frozen=True, eq=False)
class KnownTop:
    """What is known of the top.

    Attributes:
        transverse, axial: I₁, I₃ [kg m²].
        moment: its magnitude [A m²]; ignored if mass and height are known, from which it follows.
        mass: [kg].
        height: at which it floats, on the scale of the scan's heights [m].
        gravity: [m/s²].
        covariance: of mass, I₁ and I₃, if they come from the same parts, shape (3, 3).
        magnet: a disc; None: a point.
    """

    transverse: Estimate
    axial: Estimate
    moment: Estimate | None = None
    mass: Estimate | None = None
    height: Estimate | None = None
    gravity: float = 9.82
    covariance: Array | None = None
    magnet: Disc | None = None

    @property
    def weighed(self) -> bool:
        """Whether the moment follows from weight and height."""
        return self.height is not None and self.mass is not None


@dataclass(frozen=True)
class Floating:
    """The results for a top.

    Attributes:
        values: name → estimate, of RESULTS: the heights and masses of the window far above the base; the spins of a top
            of mass_to_set, floating at height_at_mass; height_per_mass, the slope of height by mass; mass_to_add
            only if the top's mass is known, moment only if its height is, too.
        remarks: what to know before using the numbers.
    """

    values: Mapping[str, Estimate]
    remarks: tuple[Remark, ...] = ()

    def __getitem__(self, name: str) -> float:
        value = self.values[name].value
        assert value is not None
        return value


class FloatsNowhere(Exception):
    """No top floats high above this base, or none of these inertias spins stably."""


def follow(scan: FieldScan, top: KnownTop) -> Floating | None:
    """Compute where and how a top floats; None if no top floats above such a base.

    Raises:
        ValueError: neither the moment nor mass and height of the top are known.
    """
    if top.moment is None and not top.weighed:
        raise ValueError("a moment, or mass and height, is needed")
    values, covariance = _input(scan, top)
    evaluate = _evaluator(top)
    try:
        found = evaluate(values)
        u = _uncertainties(evaluate, values, found, covariance)
    except FloatsNowhere:
        return None
    estimates = {
        name: Estimate(float(value), float(size) if math.isfinite(size) else None, unit)
        for (name, unit), value, size in zip(RESULTS.items(), found, u, strict=True)
        if math.isfinite(value)
    }
    floating = Floating(estimates)
    return replace(floating, remarks=tuple(_doubts(floating, top)))


def _input(scan: FieldScan, top: KnownTop) -> tuple[Array, Array]:
    """Return all input and its covariance: strength, origin, thickness, radii, mass, I₁, I₃, moment, height.

    An unknown one is NaN, with a variance of 0.
    """
    ring = [0, 1, 2, 4, 5]
    known = [getattr(top, name) for name in _OF_TOP]
    if top.weighed:
        known[3] = None
    values = np.array([*scan.values[ring], *(math.nan if one is None else one.value for one in known)], dtype=float)
    covariance = np.zeros((10, 10))
    covariance[:5, :5] = scan.covariance[np.ix_(ring, ring)]
    covariance[range(5, 10), range(5, 10)] = [((one.u or 0.0) if one else 0.0) ** 2 for one in known]
    if top.covariance is not None:
        covariance[5:8, 5:8] = top.covariance
    return values, covariance


#: Step of the differences, in standard uncertainties: curvature changes a slope by 1e-4, rounding by less.
_STEP = 0.01


def _uncertainties(evaluate: Callable[[Array], Array], values: Array, found: Array, covariance: Array) -> Array:
    """Return the standard uncertainties of the results, to first order, shape (results,)."""
    u = np.sqrt(np.diagonal(covariance))
    moved = np.flatnonzero(u > 0)
    slopes = np.zeros((len(RESULTS), len(values)))
    for k in moved:
        step = np.zeros_like(values)
        step[k] = _STEP * u[k]
        slopes[:, k] = (evaluate(values + step) - found) / step[k]
    sizes = np.full(len(RESULTS), np.nan)
    for row, line in enumerate(slopes):
        if np.isfinite(line).all():
            sizes[row] = propagate(covariance, line[None])[1][0]
    return sizes


def floating_top(ring: Ring, top: KnownTop) -> SymmetricTop:
    """Return the top for the theory, with a mass of 1 kg; its moment is opposite to the field high above the ring.

    Raises:
        FloatsNowhere: the field has no slope at the height from which the moment follows.
    """
    field, moment = axial_field(ring, top.magnet), math.nan
    if top.mass is not None and top.height is not None:
        weight, slope = (top.mass.value or 0.0) * top.gravity, float(field(np.array([top.height.value]))[1, 0])
        moment = weight / abs(slope) if slope else math.inf
    elif top.moment is not None:
        moment = top.moment.value or math.nan
    if not math.isfinite(moment):
        raise FloatsNowhere
    # high above the base the field has the sign of the strength
    moment = -math.copysign(moment, ring.strength)
    stiffness = None if top.magnet is None else stiffnesses(ring, top.magnet, moment)
    inertias = float(top.transverse.value or 0.0), float(top.axial.value or 0.0)
    return SymmetricTop(1.0, *inertias, moment, top.gravity, stiffness)


def floating_spins(ring: Ring, top: KnownTop, mass: float, window: tuple[float, float]) -> tuple[float, float] | None:
    """Return the slowest and the fastest spin [Hz] of a top of this mass [kg] in a window of heights [m].

    None if it does not float there.
    """
    field, body = axial_field(ring, top.magnet), replace(floating_top(ring, top), mass=mass)
    stable = [place for place in equilibria(field, body, *window) if place.stable and place.spins]
    return stable[-1].spins[0] if stable else None


def _range(ring: Ring) -> tuple[float, float]:
    face = ring.origin + ring.thickness / 2
    return face + _LOW * ring.inner_radius, face + _HIGH * ring.outer_radius


def _evaluator(top: KnownTop) -> Callable[[Array], Array]:
    """Return the function input → results; each call searches the window near that of the call before."""
    near: list[Window] = []

    def evaluate(values: Array) -> Array:
        ring = Ring(*(float(value) for value in values[:5]))
        given = dict(zip(_OF_TOP, values[5:].tolist(), strict=True))
        body = floating_top(ring, _with_values(top, given))
        field = axial_field(ring, top.magnet)
        window = _upper_window(field, body, ring, near)
        near[:] = [window]
        middle = (window.light + window.heavy) / 2
        body = replace(body, mass=middle)
        place = next(iter(equilibria(field, body, window.low, window.high)), None)
        if place is None or not place.spins:
            raise FloatsNowhere
        bend = float(field(np.array([place.height]))[2, 0])
        per_mass = -top.gravity / abs(body.moment * bend)
        moment = abs(body.moment) if top.weighed else math.nan
        return np.array([
            window.low, window.high, window.light, window.heavy, middle, place.height, per_mass,
            *place.spins[0], moment, middle - given["mass"],
        ])  # fmt: skip

    return evaluate


def _with_values(top: KnownTop, values: Mapping[str, float]) -> KnownTop:
    known = {name: replace(one, value=values[name]) for name in _OF_TOP if (one := getattr(top, name)) is not None}
    return replace(top, **known)


def _upper_window(field: AxialField, top: SymmetricTop, ring: Ring, near: list[Window]) -> Window:
    """Return the window farthest above the base."""
    if near:
        margin = _AROUND * (near[0].high - near[0].low)
        low, high = near[0].low - margin, near[0].high + margin
    else:
        low, high = _range(ring)
    found = windows(field, top, low, high)
    lifted = [w for w in found if top.moment * float(field(np.array([(w.low + w.high) / 2]))[1, 0]) > 0]
    if not lifted:
        raise FloatsNowhere
    return lifted[-1]


#: No Levitron in print weighs so little or so much: they weigh 16 to 30 g.
_LIGHTEST_KG, _HEAVIEST_KG = 5e-3, 0.1


def _doubts(found: Floating, top: KnownTop) -> list[Remark]:
    said = []
    if top.height is not None and top.height.value is not None:
        height, low, high = top.height.value, found["lowest_height"], found["highest_height"]
        if not low <= height <= high:
            said.append(Remark("another zero", values=(height, low, high)))
    width = found["heaviest_mass"] - found["lightest_mass"]
    u = found.values["mass_to_set"].u
    mass = found["mass_to_set"]
    if not _LIGHTEST_KG <= mass <= _HEAVIEST_KG:
        said.append(Remark("no such mass", values=(mass,)))
    if u is not None and u > width / 4:
        said.append(Remark("rough mass", values=(u, width)))
    return said
