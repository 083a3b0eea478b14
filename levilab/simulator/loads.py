"""What turns and pulls the top: its magnet in the base's field, and the uniform field of the drive."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.compiled import by_type, part
from levilab.simulator.fields import axial
from levilab.simulator.vectors import Vector, cross, plus, sine_of_turns

Array = NDArray[np.float64]

# --- magnets ---


class Aligned(NamedTuple):
    """A point dipole along the axis.  moment [A m²], signed along n."""

    moment: float


class Tilted(NamedTuple):
    """A point dipole M = transverse·e₁ + axial·n [A m²]."""

    axial: float
    transverse: float


class Disc(NamedTuple):
    """A magnet of finite size: dipoles at the nodes of a quadrature over its volume, fixed in the body.

    nodes: shape (n, 4), place along e₁, e₂, n [m] and weight (sum 1).
    """

    axial: float
    transverse: float
    nodes: Array


@part
def dipole_load(field: Any, r: Vector, moment: Vector, applied: Vector) -> tuple[Vector, Vector]:
    """Force [N] and torque [N m] on a dipole in the base's field and a uniform one."""
    x, y, z = r
    p, q, bz, s, g = axial(field, z, x * x + y * y)
    mr = x * moment[0] + y * moment[1]
    along = q * mr + s * moment[2]
    force = (p * moment[0] + along * x, p * moment[1] + along * y, s * mr + g * moment[2])
    return force, cross(moment, (p * x + applied[0], p * y + applied[1], bz + applied[2]))


def _aligned_load(magnet: Any, field: Any, s: Any, applied: Any) -> Any:
    mu = magnet.moment
    return dipole_load(field, s.r, (mu * s.n[0], mu * s.n[1], mu * s.n[2]), applied)


@part
def moment_of(magnet: Any, n: Vector, arm: Vector) -> Vector:
    """The moment [A m²] of a tilted magnet."""
    a, t = magnet.axial, magnet.transverse
    return (a * n[0] + t * arm[0], a * n[1] + t * arm[1], a * n[2] + t * arm[2])


def _tilted_load(magnet: Any, field: Any, s: Any, applied: Any) -> Any:
    return dipole_load(field, s.r, moment_of(magnet, s.n, s.arm), applied)


def _disc_load(magnet: Any, field: Any, s: Any, applied: Any) -> Any:
    moment = moment_of(magnet, s.n, s.arm)
    third = cross(s.n, s.arm)
    force, torque = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(magnet.nodes.shape[0]):
        node = magnet.nodes[i]
        offset = plus(plus((node[2] * s.n[0], node[2] * s.n[1], node[2] * s.n[2]), node[0], s.arm), node[1], third)
        pull, twist = dipole_load(field, plus(s.r, 1.0, offset), moment, applied)
        force = plus(force, node[3], pull)
        torque = plus(plus(torque, node[3], twist), node[3], cross(offset, pull))
    return force, torque


#: Force [N] and torque [N m] on a magnet: (magnet, field, state, applied field).
load = by_type({Aligned: _aligned_load, Tilted: _tilted_load, Disc: _disc_load})

# --- the drive ---


class Sine(NamedTuple):
    """A uniform field: amplitude [T] along each axis; [Hz]; phase in turns."""

    amplitude: Vector
    frequency: float
    phase: float


class Kinked(NamedTuple):
    """A uniform field that is linear in time between its kinks; level and slope come with each interval."""

    amplitude: Vector


def _no_drive(drive: Any, t: Any, level: Any, slope: Any) -> Any:
    return (0.0, 0.0, 0.0)


def _sine_drive(drive: Any, t: Any, level: Any, slope: Any) -> Any:
    now = level * sine_of_turns(drive.frequency * t + drive.phase)
    return (now * drive.amplitude[0], now * drive.amplitude[1], now * drive.amplitude[2])


def _kinked_drive(drive: Any, t: Any, level: Any, slope: Any) -> Any:
    now = level + slope * t
    return (now * drive.amplitude[0], now * drive.amplitude[1], now * drive.amplitude[2])


#: The drive's field [T] at time t: (drive, t, level, slope).
applied_field = by_type({type(None): _no_drive, Sine: _sine_drive, Kinked: _kinked_drive})
