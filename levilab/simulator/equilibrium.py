"""Where the top of a scene floats, and how fast it may spin: the scene's own field in the theory of stability."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis import stability
from analysis.arrays import Array
from levilab.simulator.disc import nodes_of, rule_for
from levilab.simulator.field import flux_density, flux_gradient, on_axis
from levilab.simulator.keys import SceneError
from levilab.simulator.model import base_field
from levilab.simulator.numbers import Numbers, uniform
from levilab.simulator.scene import Scene
from levilab.texts.text import Text

#: Heights in which a top is looked for: from a tenth of the inner radius to four outer radii above the base.
_LOW, _HIGH = 0.1, 4.0

WEIGHTLESS = "gravity_m_s2 = 0: without weight there is nothing to float; a number above 0 is expected"


@dataclass(frozen=True)
class Stability:
    """What the theory says of a scene.

    Attributes:
        top, field: the scene's, as `analysis.stability` takes them.
        windows: heights and masses, adiabatic.
        equilibria: of the scene's own mass.
        floating: the one in which it floats, None if there is none.
        modes: sideways, at the scene's spin, complex where unstable [Hz].
        vertical, sleeping: the up-and-down mode and the sleeping top's limit there [Hz].
        nearest: the mass [kg] nearest to the scene's that floats, None where no mass does.
    """

    scene: Scene
    top: stability.SymmetricTop
    field: stability.AxialField
    windows: tuple[stability.Window, ...]
    equilibria: tuple[stability.Equilibrium, ...]
    floating: stability.Equilibrium | None
    modes: NDArray[np.complex128]
    vertical: float
    sleeping: float
    thesis_estimate: float
    nearest: float | None

    @property
    def lifted(self) -> tuple[stability.Window, ...]:
        """The windows in which the field lifts a moment of this sign: the force μB′ points up."""
        return tuple(w for w in self.windows if _lifts(w, self.top, self.field))


def top_of(scene: Scene) -> stability.SymmetricTop:
    """Return the scene's top, with the part of its moment that lies along the axis."""
    top = scene.top
    return stability.SymmetricTop(
        top.mass_kg,
        top.inertia_transverse_kg_m2,
        top.inertia_axial_kg_m2,
        scene.moment * top.moment_tilt[1],
        scene.gravity_m_s2,
        _disc_stiffnesses(scene) if top.magnet == "disc" else None,
    )


#: Nodes of a magnet are chosen for a height of 2 inner radii, below the upper window: there, and in the lower window
#: too, they move edges by 1e-8 at most, as the second differences below do.
_HEIGHT_FOR_NODES = 2.0


def _nodes(scene: Scene, angles: int) -> Array:
    """Return the nodes of the scene's magnet, with the given number of angles."""
    top, distance = scene.top, math.hypot(1, _HEIGHT_FOR_NODES) * scene.base.inner_radius_m
    return nodes_of(top, rule_for(top.magnet_radius_m, top.magnet_height_m, distance)._replace(angles=angles))


#: Steps for second differences [m, rad]: their error is 1e-7 of the stiffness, rounding 1e-8.
_DX, _DTHETA = 1e-4, 1e-3


def _disc_stiffnesses(scene: Scene) -> Callable[[Array], Array]:
    """Return the stiffnesses of a magnet of finite size, from its energy when it is moved and tilted a little."""
    field = base_field(scene)
    nodes = _nodes(scene, angles=4)  # to the second order in x and θ no fourth harmonic of the angle is felt
    moment = scene.moment * scene.top.moment_tilt[1]

    def energy(heights: Array, x: float, theta: float) -> Array:
        cos, sin = math.cos(theta), math.sin(theta)
        turned = nodes[:, :3] @ np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
        places = turned[None] + np.stack([np.full_like(heights, x), np.zeros_like(heights), heights], axis=-1)[:, None]
        flux = flux_density(field, places) @ np.array([sin, 0.0, cos])
        return np.asarray(-moment * (flux @ nodes[:, 3]))

    def stiffnesses(heights: Array) -> Array:
        upright = energy(heights, 0.0, 0.0)
        # even in x and θ each, and E(x, θ) = E(−x, −θ)
        tilt = 2 * (energy(heights, 0.0, _DTHETA) - upright) / _DTHETA**2
        sideways = 2 * (energy(heights, _DX, 0.0) - upright) / _DX**2
        both = (energy(heights, _DX, _DTHETA) - energy(heights, _DX, -_DTHETA)) / (2 * _DX * _DTHETA)
        return np.array([tilt, sideways, both])

    return stiffnesses


def axial_field(scene: Scene) -> stability.AxialField:
    """B, B′ and B″ on the axis as an upright top feels them: at its centre, or averaged over its magnet.

    The average's force and its stiffness up and down are those of a point in it; what tilting does is in `top_of`.
    """
    field = base_field(scene)
    if scene.top.magnet == "point":
        return lambda z: on_axis(field, z)
    nodes = _nodes(scene, angles=1)  # on the axis all angles are the same
    step = 1e-4  # for B″: differences of the gradient, good to 1e-9 of it over a field's length of some cm

    def disc_mean(z: Array) -> Array:
        heights = np.atleast_1d(z)
        places = nodes[None, :, :3] + heights[:, None, None] * np.array([0.0, 0.0, 1.0])

        def mean(values: Array) -> Array:
            return np.asarray(values @ nodes[:, 3])

        up = np.array([0.0, 0.0, step])
        slopes = [mean(flux_gradient(field, places + k * up)[..., 2, 2]) for k in (-1, 0, 1)]
        return np.array([mean(flux_density(field, places)[..., 2]), slopes[1], (slopes[2] - slopes[0]) / (2 * step)])

    return disc_mean


def modes_at(scene: Scene, height: float, spin_hz: float) -> NDArray[np.complex128]:
    """Return the four sideways modes [Hz] of the scene's top at a height [m] and spin [Hz]; complex if unstable."""
    return stability.modes(axial_field(scene), top_of(scene), height, spin_hz)


def stability_of(scene: Scene) -> Stability:
    """Return windows, equilibria and modes of a scene's top, upright on the axis of its base (lean left out)."""
    if scene.gravity_m_s2 == 0:
        raise SceneError(WEIGHTLESS)
    top, field = top_of(scene), axial_field(scene)
    low, high = _range(scene)
    found = stability.windows(field, top, low, high)
    balance = stability.equilibria(field, top, low, high)
    floating = next((e for e in reversed(balance) if e.stable), None)
    height = floating.height if floating else math.nan
    spin = scene.start.spin_hz
    return Stability(
        scene,
        top,
        field,
        found,
        balance,
        floating,
        stability.modes(field, top, height, spin) if floating else np.empty(0, dtype=np.complex128),
        stability.vertical_mode(field, top, height) if floating else math.nan,
        stability.sleeping_limit(field, top, height) if floating else math.nan,
        stability.thesis_limit(field, top, height) if floating else math.nan,
        None if floating else nearest_mass(found, top, field),
    )


def _range(scene: Scene) -> tuple[float, float]:
    top_face = scene.base.origin_m + scene.base.thickness_m / 2
    return top_face + _LOW * scene.base.inner_radius_m, top_face + _HIGH * scene.base.outer_radius_m


def _lifts(window: stability.Window, top: stability.SymmetricTop, field: stability.AxialField) -> bool:
    return top.moment * float(field(np.array([(window.low + window.high) / 2]))[1, 0]) > 0


def nearest_mass(
    windows: tuple[stability.Window, ...], top: stability.SymmetricTop, field: stability.AxialField
) -> float | None:
    """Return the mass [kg] nearest to the top's that floats, a thousandth inside of its window; None if none does."""
    candidates = []
    for window in (w for w in windows if _lifts(w, top, field)):
        margin = (window.heavy - window.light) / 1000
        candidates.append(min(max(top.mass, window.light + margin), window.heavy - margin))
    return min(candidates, key=lambda mass: abs(mass - top.mass), default=None)


def floating_height(scene: Scene) -> Any:
    """Return the height [m] at which the scene's top floats.  Raises SceneError, with the nearest mass that does.

    If numbers of the scene are those of many tops, so is the height.
    """
    given = scene.top.mass_kg
    # an average over a magnet's nodes may be rounded in another way beside others: one at a time
    masses = uniform(given) if scene.top.magnet == "disc" else given
    common = _for_all(scene)
    heights = floating_heights(common, np.atleast_1d(np.asarray(masses)))
    missing = np.isnan(heights).view(Numbers)
    if missing:
        first = common.top.model_copy(update={"mass_kg": float(np.ravel(masses)[0])})
        found = stability_of(common.model_copy(update={"top": first}))
        raise SceneError("top.mass_kg = {mass_kg:g}: {advice}", mass_kg=first.mass_kg, advice=advice(found))
    return heights.view(Numbers) if isinstance(masses, Numbers) else float(heights[0])


def _for_all(scene: Scene) -> Scene:
    """Return a scene with one value for all tops in what decides where they float, but for their mass.

    Raises Mixed where they have several.
    """
    shared = {
        name: getattr(scene, name).model_copy(
            update={
                key: tuple(map(uniform, value)) if isinstance(value, tuple) else uniform(value)
                for key, value in getattr(scene, name)
                if key != "mass_kg"
            }
        )
        for name in ("base", "top")
    }
    start = scene.start.model_copy(update={"spin_hz": 0.0})
    conditions = {key: uniform(getattr(scene, key)) for key in ("gravity_m_s2", "temperature_rise_k")}
    return scene.model_copy(update={**shared, **conditions, "start": start})


# --- many masses ---


@dataclass(frozen=True)
class MassWindows:
    """Where tops of several masses float, and how fast they may spin there; NaN for a mass that floats nowhere.

    Attributes:
        masses: shape (n,) [kg].
        heights: of the highest equilibrium that is stable if the moment follows the field, shape (n,) [m].
        slowest, fastest: the first window of spin in which small motions stay small, shape (n,) [Hz]; fastest is inf
            where it is beyond 20 times the sleeping top's limit, both NaN where there is none.
        adiabatic: the masses at which a moment that follows the field is stable, as `Stability.lifted` has them.
    """

    masses: Array
    heights: Array
    slowest: Array
    fastest: Array
    adiabatic: tuple[stability.Window, ...]


def windows_over(scene: Scene, masses: ArrayLike) -> MassWindows:
    """Return what `stability_of` says of a scene's top, for many masses [kg] at once.

    Raises:
        SceneError: nothing weighs.

    >>> from levilab.simulator.scene import preset
    >>> windows_over(preset("undriven"), [0.0252, 0.0260]).slowest.round(2)
    array([21.57,   nan])
    """
    if scene.gravity_m_s2 == 0:
        raise SceneError(WEIGHTLESS)
    masses = np.atleast_1d(np.asarray(masses, dtype=np.float64))
    top, field = top_of(scene), axial_field(scene)
    heights = floating_heights(scene, masses)
    spins = np.full((masses.size, 2), math.nan)
    for k in np.flatnonzero(np.isfinite(heights)):
        found = stability.spin_windows(field, replace(top, mass=float(masses[k])), float(heights[k]))
        spins[k] = found[0] if found else math.nan
    adiabatic = tuple(w for w in stability.windows(field, top, *_range(scene)) if _lifts(w, top, field))
    return MassWindows(masses, heights, spins[:, 0], spins[:, 1], adiabatic)


#: Newton's steps at most; each doubles the digits, and where it leaves the bracket half of that is taken instead.
_MOST = 60


def floating_heights(scene: Scene, masses: Array) -> Array:
    """Return the heights [m] at which tops of these masses [kg] float, shape (n,); NaN for those that float nowhere.

    Each of them depends on its own mass alone, to the last bit.
    """
    top, field = top_of(scene), axial_field(scene)
    z = np.linspace(*_range(scene), stability.HEIGHTS)
    lift, heights = top.moment * field(z)[1], np.full(masses.shape, math.nan)
    # each crossing between two heights, of all masses between the lifts there
    order = np.argsort(masses, kind="stable")
    weights = masses * top.gravity
    low, high = np.minimum(lift[:-1], lift[1:]), np.maximum(lift[:-1], lift[1:])
    first = np.searchsorted(weights[order], low, side="right")
    last = np.searchsorted(weights[order], high, side="left")
    number = np.maximum(last - first, 0)
    interval = np.repeat(np.arange(number.size), number)
    inside = np.arange(interval.size) - np.repeat(np.cumsum(number) - number, number)
    who = order[first[interval] + inside]
    if who.size == 0:
        return heights
    places = _crossings(field, top, weights[who], z[interval], z[interval + 1])
    bend = field(places)[2]
    tilt, sideways, both = top.stiffness(field, places)
    stable = (-top.moment * bend > 0) & (sideways - both**2 / tilt > 0)
    # intervals come in the order of their heights: the highest one is written last
    heights[who[stable]] = places[stable]
    return heights


def _crossings(field: stability.AxialField, top: stability.SymmetricTop, weights: Array, a: Array, b: Array) -> Array:
    """Return the heights [m] between a and b, shape (n,), at which the force μB′ carries these weights [N]."""
    rising = top.moment * field(b)[1] > weights
    low, high = a.copy(), b.copy()
    place, found = (a + b) / 2, np.zeros(a.shape, dtype=np.bool_)
    for _ in range(_MOST):
        _, slope, bend = field(place)[:3]
        missing, change = top.moment * slope - weights, top.moment * bend
        above = (missing > 0) == rising
        low, high = np.where(above, low, place), np.where(above, place, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = place - missing / change
        better = np.where((newton > low) & (newton < high), newton, (low + high) / 2)
        found |= np.abs(better - place) <= 1e-15
        if np.all(found):
            break
        place = np.where(found, place, better)
    return place


def advice(found: Stability) -> str:
    """Return why a top does not float, and which one does."""
    if found.top.moment == 0:
        return (
            "top.moment_tilt.1 = 0: a field lifts an upright top by the part of its moment that lies along its axis; "
            "another number than 0 is expected"
        )
    if found.nearest is None:
        return (
            "no top with this moment floats over this base, whatever its mass: the moment must point against the field "
            "(top.moment_a_m2 of the other sign)"
        )
    return Text(
        "a top of {mass:.6g} g does not float over this base; the nearest that does has {nearest:.2f} g",
        mass=1000 * found.scene.top.mass_kg,
        nearest=1000 * found.nearest,
    )
