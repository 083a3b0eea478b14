"""What turns and pulls the top: its magnet in the base's field, and the uniform field of the drive.

Fields come multiplied by the moment's size, so they are energies [J] and their gradients forces [N]; magnets are
directions in the body.
"""

from typing import Any, NamedTuple

from analysis.arrays import Array
from levilab.simulator.kernels.compiled import by_type, part
from levilab.simulator.kernels.fields import field_functions
from levilab.simulator.kernels.paraxial import Paraxial, Paraxial2, ParaxialThick
from levilab.simulator.kernels.ring import Sheet, Thick
from levilab.simulator.kernels.vectors import Vector, cross, plus, sine_of_turns

# --- the drive ---


class Sine(NamedTuple):
    """A uniform field: amplitude [J] along each axis; [Hz] at time 0; half of the ramp [Hz/s]; phase in turns."""

    amplitude: Vector
    frequency: float
    half_ramp: float
    phase: float


class PiecewiseLinear(NamedTuple):
    """A uniform field that is linear in time between its kinks; level and slope come with each interval."""

    amplitude: Vector


class Bursts(NamedTuple):
    """A uniform field in bursts of a sine; frequency [Hz] and phase at time 0 [turns] come with each interval.

    Between bursts both are 0, and so is the field.
    """

    amplitude: Vector


def _no_drive(drive: Any, b: Any, at: Any) -> Any:
    return b


def _sine_drive(drive: Any, b: Any, at: Any) -> Any:
    t, level, _ = at
    return plus(b, level * sine_of_turns((drive.frequency + drive.half_ramp * t) * t + drive.phase), drive.amplitude)


def _kinked_drive(drive: Any, b: Any, at: Any) -> Any:
    t, level, slope = at
    return plus(b, level + slope * t, drive.amplitude)


def _burst_drive(drive: Any, b: Any, at: Any) -> Any:
    t, frequency, turns = at
    return plus(b, sine_of_turns(frequency * t + turns), drive.amplitude)


#: The field b with the drive's added to it: (drive, b, (time, level, slope)).
with_drive = by_type({type(None): _no_drive, Sine: _sine_drive, PiecewiseLinear: _kinked_drive, Bursts: _burst_drive})


# --- magnets ---


class Aligned(NamedTuple):
    """A point dipole along the axis."""


class Tilted(NamedTuple):
    """A point dipole axial·n + transverse·e₁, as fractions of the moment."""

    axial: float
    transverse: float


class Disc(NamedTuple):
    """A magnet of finite size: dipoles at the nodes of a quadrature over its volume, fixed in the body.

    axial, transverse: as of Tilted; nodes: shape (n, 4), place along e₁, e₂, n [m] and weight (sum 1).
    """

    axial: float
    transverse: float
    nodes: Array


def _push(field: Any, v: Any, five: Any, x: Any, y: Any, moment: Any) -> Any:
    p, q, _, s, g = five
    m = moment
    across = x * m[0] + y * m[1]
    return (
        v[0] + p * m[0] + s * (m[2] * x) + q * (across * x),
        v[1] + p * m[1] + s * (m[2] * y) + q * (across * y),
        v[2] + s * across + g * m[2],
    )


def _push_without_q(field: Any, v: Any, five: Any, x: Any, y: Any, moment: Any) -> Any:
    p, _, _, s, g = five
    m = moment
    return (
        v[0] + p * m[0] + s * (m[2] * x),
        v[1] + p * m[1] + s * (m[2] * y),
        v[2] + s * (x * m[0] + y * m[1]) + g * m[2],
    )


#: A vector v with ∇(M·B) added to it: (field, v, its five functions, x, y, moment).  The field is known last, so all
#: else is multiplied before.
with_force = by_type({Paraxial2: _push_without_q, Paraxial: _push, ParaxialThick: _push, Sheet: _push, Thick: _push})


@part
def dipole_load(
    field: Any, drive: Any, r: Vector, moment: Vector, at: Any, v: Vector, push: float
) -> tuple[Vector, Vector]:
    """Return the vector v with push times the force [N] on a dipole added, and the torque [N m], of base and drive."""
    x, y, z = r
    five = field_functions(field, z, x * x + y * y)
    b = with_drive(drive, (five[0] * x, five[0] * y, five[2]), at)
    pushed = (push * moment[0], push * moment[1], push * moment[2])
    return with_force(field, v, five, x, y, pushed), cross(moment, b)


def _aligned_load(magnet: Any, field: Any, drive: Any, s: Any, at: Any, v: Any, push: Any) -> Any:
    return dipole_load(field, drive, s.r, s.n, at, v, push)


@part
def moment_of(magnet: Any, n: Vector, arm: Vector) -> Vector:
    """Return the direction of a tilted moment; its length is that of the fractions."""
    a, t = magnet.axial, magnet.transverse
    return (a * n[0] + t * arm[0], a * n[1] + t * arm[1], a * n[2] + t * arm[2])


def _tilted_load(magnet: Any, field: Any, drive: Any, s: Any, at: Any, v: Any, push: Any) -> Any:
    return dipole_load(field, drive, s.r, moment_of(magnet, s.n, s.arm), at, v, push)


def _disc_load(magnet: Any, field: Any, drive: Any, s: Any, at: Any, v: Any, push: Any) -> Any:
    moment = moment_of(magnet, s.n, s.arm)
    third = cross(s.n, s.arm)
    force, torque = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(magnet.nodes.shape[0]):
        node = magnet.nodes[i]
        offset = plus(plus((node[2] * s.n[0], node[2] * s.n[1], node[2] * s.n[2]), node[0], s.arm), node[1], third)
        pull, twist = dipole_load(field, drive, plus(s.r, 1.0, offset), moment, at, (0.0, 0.0, 0.0), 1.0)
        force = plus(force, node[3], pull)
        torque = plus(plus(torque, node[3], twist), node[3], cross(offset, pull))
    return plus(v, push, force), torque


#: The vector v with push times the force [N] on a magnet added, and the torque [N m]: (magnet, field, drive, state,
#: moment of the drive, v, push).  Not the whole model, of which there are more types than of these parts of it.
pushed_and_torque = by_type({Aligned: _aligned_load, Tilted: _tilted_load, Disc: _disc_load})

# --- the weight ---


class Upright(NamedTuple):
    """Gravity straight down [m/s²]."""

    g: float


class Leaning(NamedTuple):
    """Gravity as a leaning base sees it [m/s²]."""

    x: float
    y: float
    z: float


def _upright_gravity(gravity: Any, v: Any, k: Any) -> Any:
    return (v[0], v[1], v[2] - k * gravity.g)


def _leaning_gravity(gravity: Any, v: Any, k: Any) -> Any:
    return (v[0] + k * gravity.x, v[1] + k * gravity.y, v[2] + k * gravity.z)


#: The velocity after the time k of weight alone: (gravity, velocity, k).
velocity_after_gravity = by_type({Upright: _upright_gravity, Leaning: _leaning_gravity})
