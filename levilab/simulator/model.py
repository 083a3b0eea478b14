"""From a scene to the numbers that its kernels need."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.kernels import braking
from levilab.simulator.kernels.fields import field_of
from levilab.simulator.kernels.loads import Aligned, Disc, Kinked, Leaning, Sine, Tilted, Upright
from levilab.simulator.kernels.motion import Body, Loose, Model, Rigid

if TYPE_CHECKING:
    from levilab.simulator.scene import Scene

Array = NDArray[np.float64]


def model_of(scene: Scene) -> Model:
    """The numbers of a scene, typed by what it models."""
    top = scene.top
    return Model(
        field=base_field(scene, times=_moment(scene)),
        body=Body(
            1 / top.mass_kg,
            1 / top.inertia_transverse_kg_m2,
            top.inertia_axial_kg_m2,
            Upright(scene.gravity_m_s2) if scene.base.tilt_rad == 0 else Leaning(*gravity(scene)),
        ),
        magnet=_magnet(scene),
        turning=_turning(scene),
        drag=_drag(scene),
        drive=_drive(scene),
    )


def base_field(scene: Scene, times: float = 1.0) -> Any:
    """The field of the scene's base, one of the kinds of `levilab.simulator.kernels.fields`, times a factor."""
    base = scene.base
    strength = base.strength_t_m * times
    return field_of(base.inner_radius_m, base.outer_radius_m, strength, base.field, base.thickness_m, base.origin_m)


def _moment(scene: Scene) -> float:
    """What the fields are multiplied by [A m²]: of an aligned dipole all of it, else the fractions stay apart."""
    top = scene.top
    return top.moment_a_m2 if has_attitude(scene) else top.moment_a_m2 * top.moment_tilt[1]


def gravity(scene: Scene) -> tuple[float, float, float]:
    """Gravity in the base's frame [m/s²]: where the base leans, gravity leans the other way."""
    g, tilt, azimuth = scene.gravity_m_s2, scene.base.tilt_rad, scene.base.tilt_azimuth_rad
    across = g * math.sin(tilt)
    return across * math.cos(azimuth), across * math.sin(azimuth), -g * math.cos(tilt)


def has_attitude(scene: Scene) -> bool:
    """Whether the motion depends on how far the top has turned about its own axis."""
    return bool(scene.top.moment_tilt[0] != 0 or scene.top.magnet == "disc" or scene.washers.inertia_kg_m2 > 0)


def _magnet(scene: Scene) -> Any:
    top = scene.top
    transverse, axial = top.moment_tilt
    if top.magnet == "disc":
        return Disc(axial, transverse, disc_nodes(top.magnet_radius_m, top.magnet_height_m))
    return Tilted(axial, transverse) if has_attitude(scene) else Aligned()


def disc_nodes(radius: float, height: float) -> Array:
    """A quadrature over a disc's volume, shape (36, 4): place along e₁, e₂, axis [m], and weight.

    Gauss–Legendre in r² (3 rings) and along the axis (2 layers), 6 equal angles.  For the field of a ring that
    is five radii away the average is good to 1e-7; see the tests.
    """
    x, wx = np.polynomial.legendre.leggauss(3)
    z, wz = np.polynomial.legendre.leggauss(2)
    rings, angles = radius * np.sqrt((x + 1) / 2), 2 * np.pi * np.arange(6) / 6
    return np.array(
        [
            [ring * math.cos(angle), ring * math.sin(angle), layer * height / 2, u * w / 24]
            for ring, u in zip(rings, wx, strict=True)
            for angle in angles
            for layer, w in zip(z, wz, strict=True)
        ]
    )


def _turning(scene: Scene) -> Any:
    if not has_attitude(scene):
        return None
    axial = scene.top.inertia_axial_kg_m2
    if scene.washers.inertia_kg_m2 > 0:
        return Loose(1 / (axial - scene.washers.inertia_kg_m2))
    return Rigid(1 / axial - 1 / scene.top.inertia_transverse_kg_m2)


_LAWS = {
    "stokes": braking.Stokes,
    "newton": braking.Newton,
    "disc": braking.LaminarDisc,
    "mixed": braking.Mixed,
}


def _drag(scene: Scene) -> Any:
    constants = scene.drag.constants
    if scene.washers.inertia_kg_m2 > 0:
        return _loose_drag(scene)
    if scene.drag.law == "none" or not any(constants):
        return None
    law = _LAWS[scene.drag.law](*constants)
    return braking.Flowing(law) if has_attitude(scene) else braking.Clocked(law)


def _loose_drag(scene: Scene) -> braking.LooseFlowing:
    """The torque of the air is shared: each part slows as by a law of its own, scaled by I₃ over its inertia."""
    axial, washers = scene.top.inertia_axial_kg_m2, scene.washers.inertia_kg_m2
    core, share = axial - washers, scene.washers.drag_share
    law = _LAWS.get(scene.drag.law, braking.Stokes)
    constants = scene.drag.constants if scene.drag.law != "none" else (0.0,)
    return braking.LooseFlowing(
        washers=law(*(c * share * axial / washers for c in constants)),
        core=law(*(c * (1 - share) * axial / core for c in constants)),
        inverse_washers=1 / washers,
        inverse_core=1 / core,
        coupling=scene.washers.coupling_n_m_s,
    )


def _drive(scene: Scene) -> Any:
    drive = scene.drive
    if drive.waveform == "off" or drive.amplitude_t == 0:
        return None
    x, y, z = (_moment(scene) * drive.amplitude_t * part for part in drive.unit_direction)
    if drive.waveform == "sine":
        return Sine((x, y, z), drive.frequency_hz, drive.phase_rad / (2 * math.pi))
    return Kinked((x, y, z))


# --- the start ---


# --- what stays constant ---
