"""From a scene to the numbers that its kernels need."""

import math
from typing import Any

from levilab.simulator.disc import distance_to, nodes_of, rule_for
from levilab.simulator.field import field_of
from levilab.simulator.kernels import braking
from levilab.simulator.kernels.loads import Aligned, Bursts, Disc, Leaning, PiecewiseLinear, Sine, Tilted, Upright
from levilab.simulator.kernels.motion import Body, Loose, Model, Rigid
from levilab.simulator.numbers import cos, hypot, largest, sin
from levilab.simulator.scene import Scene


def model_of(scene: Scene, place: Any = None, more_nodes: int = 0) -> Model:
    """Return the numbers of a scene, typed by what it models; of many tops, if some of its numbers are `Numbers`.

    place: where the motion begins, three numbers [m], which a magnet of finite size takes its number of nodes from; the
    scene's own position if none is given.  more_nodes: rings, layers and angles beyond that number, negative for fewer,
    to tell their error from.
    """
    top = scene.top
    return Model(
        field=base_field(scene, times=_moment(scene)),
        body=Body(
            1 / top.mass_kg,
            1 / top.inertia_transverse_kg_m2,
            top.inertia_axial_kg_m2,
            Upright(scene.gravity_m_s2) if scene.base.tilt_rad == 0 else Leaning(*gravity(scene)),
        ),
        magnet=_magnet(scene, scene.start.position_m if place is None else place, more_nodes),
        turning=_turning(scene),
        drag=_drag(scene),
        drive=_drive(scene),
    )


def base_field(scene: Scene, times: float = 1.0) -> Any:
    """Return the field of the scene's base, one of the kinds of `levilab.simulator.kernels.fields`, times a factor."""
    base = scene.base
    strength = scene.strength * times
    radii = base.inner_radius_m, base.outer_radius_m
    return field_of(*radii, strength, base.field, thickness=base.thickness_m, origin=base.origin_m)


def _moment(scene: Scene) -> float:
    """Return the factor of the fields [A m²]: the whole of an aligned dipole, else the fractions stay apart."""
    return scene.moment if has_attitude(scene) else scene.moment * scene.top.moment_tilt[1]


def gravity(scene: Scene) -> tuple[float, float, float]:
    """Gravity in the base's frame [m/s²]: where the base leans, gravity leans the other way."""
    g, tilt, azimuth = scene.gravity_m_s2, scene.base.tilt_rad, scene.base.tilt_azimuth_rad
    across = g * sin(tilt)
    return across * cos(azimuth), across * sin(azimuth), -g * cos(tilt)


def has_attitude(scene: Scene) -> bool:
    """Return whether the motion depends on how far the top has turned about its own axis."""
    top = scene.top
    turned = top.moment_tilt[0] != 0 or top.magnet == "disc" or scene.drive.waveform == "triggered"
    return bool(turned or scene.washers.inertia_kg_m2 > 0)


#: The transverse part that makes the simulator integrate the turn of an aligned moment: less than the rounding of the
#: axial one.
_NEGLIGIBLE_TILT = 1e-17


def with_attitude(scene: Scene) -> Scene:
    """Return the scene whose motion carries the turn about the axis along, and is otherwise the same."""
    if has_attitude(scene):
        return scene
    return scene.changed({"top.moment_tilt": [_NEGLIGIBLE_TILT, scene.top.moment_tilt[1]]})


def _magnet(scene: Scene, place: Any, more_nodes: int) -> Any:
    top = scene.top
    transverse, axial = top.moment_tilt
    if top.magnet == "disc":
        rule = rule_for(top.magnet_radius_m, top.magnet_height_m, distance_to(scene.base, place))
        return Disc(axial, transverse, nodes_of(top, rule.with_more(more_nodes)))
    return Tilted(axial, transverse) if has_attitude(scene) else Aligned()


def _turning(scene: Scene) -> Any:
    if not has_attitude(scene):
        return None
    axial = scene.top.inertia_axial_kg_m2
    if scene.washers.inertia_kg_m2 > 0:
        return Loose(1 / (axial - scene.washers.inertia_kg_m2))
    return Rigid(1 / axial - 1 / scene.top.inertia_transverse_kg_m2)


def _drag(scene: Scene) -> Any:
    constants = scene.drag.constants
    if scene.washers.inertia_kg_m2 > 0:
        return _loose_drag(scene)
    if scene.drag.law == "none" or not any(constants):
        return None
    law = braking.LAWS[scene.drag.law][0](*constants)
    return braking.DragFlow(law) if has_attitude(scene) else braking.PrescribedDrag(law)


def _loose_drag(scene: Scene) -> braking.WasherDragFlow:
    """Return the shared torque of the air: each part slows as by a law of its own, scaled by I₃ over its inertia."""
    axial, washers = scene.top.inertia_axial_kg_m2, scene.washers.inertia_kg_m2
    core, share = axial - washers, scene.washers.drag_share
    law = braking.Stokes if scene.drag.law == "none" else braking.LAWS[scene.drag.law][0]
    constants = scene.drag.constants or (0.0,)
    return braking.WasherDragFlow(
        washers=law(*(c * share * axial / washers for c in constants)),
        core=law(*(c * (1 - share) * axial / core for c in constants)),
        inverse_washers=1 / washers,
        inverse_core=1 / core,
        coupling=scene.washers.coupling_n_m_s,
    )


def unit_vector(direction: Any) -> tuple[Any, Any, Any]:
    """Return three numbers that are not all 0, scaled to a vector of length 1."""
    size = largest(*map(abs, direction))  # first, so that no square over- or underflows
    x, y, z = (part / size for part in direction)
    length = hypot(x, y, z)
    return x / length, y / length, z / length


def _drive(scene: Scene) -> Any:
    drive = scene.drive
    if drive.waveform == "off" or drive.amplitude_t == 0:
        return None
    x, y, z = (_moment(scene) * drive.amplitude_t * part for part in unit_vector(drive.direction))
    if drive.waveform == "sine":
        return Sine((x, y, z), drive.frequency_hz, drive.ramp_hz_per_s / 2, drive.phase_rad / (2 * math.pi))
    if drive.waveform == "triggered":
        return Bursts((x, y, z))
    return PiecewiseLinear((x, y, z))
