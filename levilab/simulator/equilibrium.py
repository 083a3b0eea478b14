"""Where the top of a scene floats, and how fast it may spin: the scene's own field in the theory of stability."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis import stability
from levilab.simulator.disc import nodes_of, rule_for
from levilab.simulator.field import flux_density, flux_gradient, on_axis
from levilab.simulator.keys import SceneError
from levilab.simulator.model import base_field

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.simulator.scene import Scene

Array = NDArray[np.float64]

#: Heights in which a top is looked for: from a tenth of the inner radius to four outer radii above the base.
_LOW, _HIGH = 0.1, 4.0

#: A heavier top was most likely given in grams [kg].
HEAVIEST_KG = 1.0


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
    """The scene's top, with the part of its moment that lies along the axis."""
    top = scene.top
    return stability.SymmetricTop(
        top.mass_kg,
        top.inertia_transverse_kg_m2,
        top.inertia_axial_kg_m2,
        top.moment_a_m2 * top.moment_tilt[1],
        scene.gravity_m_s2,
        _disc_stiffnesses(scene) if top.magnet == "disc" else None,
    )


#: Nodes of a magnet are chosen for a height of 2 inner radii, below the upper window: there, and in the lower window
#: too, they move edges by 1e-8 at most, as the second differences below do.
_HEIGHT_FOR_NODES = 2.0


def _nodes(scene: Scene, angles: int) -> Array:
    """The nodes of the scene's magnet, with so many angles."""
    top, distance = scene.top, math.hypot(1, _HEIGHT_FOR_NODES) * scene.base.inner_radius_m
    return nodes_of(top, rule_for(top.magnet_radius_m, top.magnet_height_m, distance)._replace(angles=angles))


#: Steps for second differences [m, rad]: their error is 1e-7 of the stiffness, rounding 1e-8.
_DX, _DTHETA = 1e-4, 1e-3


def _disc_stiffnesses(scene: Scene) -> Callable[[Array], Array]:
    """The stiffnesses of a magnet of finite size, from its energy when it is moved and tilted a little."""
    field = base_field(scene)
    nodes = _nodes(scene, angles=4)  # to the second order in x and θ no fourth harmonic of the angle is felt
    moment = scene.top.moment_a_m2 * scene.top.moment_tilt[1]

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

    def averaged(z: Array) -> Array:
        heights = np.atleast_1d(z)
        places = nodes[None, :, :3] + heights[:, None, None] * np.array([0.0, 0.0, 1.0])

        def mean(values: Array) -> Array:
            return np.asarray(values @ nodes[:, 3])

        up = np.array([0.0, 0.0, step])
        slopes = [mean(flux_gradient(field, places + k * up)[..., 2, 2]) for k in (-1, 0, 1)]
        return np.array([mean(flux_density(field, places)[..., 2]), slopes[1], (slopes[2] - slopes[0]) / (2 * step)])

    return averaged


def modes_at(scene: Scene, height: float, spin_hz: float) -> NDArray[np.complex128]:
    """The four sideways modes [Hz] of the scene's top at a height [m] and a spin [Hz]; complex where unstable."""
    return stability.modes(axial_field(scene), top_of(scene), height, spin_hz)


def stability_of(scene: Scene) -> Stability:
    """Windows, equilibria and modes of a scene's top, upright on the axis of its base (a lean of it is left out)."""
    if scene.gravity_m_s2 == 0:
        raise SceneError("gravity_m_s2 = 0: without weight there is nothing to float; a number above 0 is expected")
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
    """The mass [kg] nearest to the top's that floats; a thousandth inside of its window, whose edge holds nothing."""
    candidates = []
    for window in (w for w in windows if _lifts(w, top, field)):
        margin = (window.heavy - window.light) / 1000
        candidates.append(min(max(top.mass, window.light + margin), window.heavy - margin))
    return min(candidates, key=lambda mass: abs(mass - top.mass), default=None)


def floating_height(scene: Scene) -> float:
    """The height [m] at which the scene's top floats.  Raises SceneError, with the nearest mass that does."""
    found = stability_of(scene)
    if found.floating:
        return found.floating.height
    raise SceneError(f"top.mass_kg = {scene.top.mass_kg:g}: {advice(found)}")


def advice(found: Stability) -> str:
    """Why a top does not float, and which one does."""
    if found.nearest is None:
        return (
            "no top with this moment floats over this base, whatever its mass: "
            "the moment must point against the field (top.moment_a_m2 of the other sign)"
        )
    kilograms = found.scene.top.mass_kg
    said = (
        f"a top of {1000 * kilograms:.6g} g does not float over this base; "
        f"the nearest that does has {1000 * found.nearest:.2f} g"
    )
    asked = f".  Were grams meant?  {kilograms:g} g are top.mass_kg = {kilograms / 1000:g}"
    return said + (asked if kilograms > HEAVIEST_KG else "")
