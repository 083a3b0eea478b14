"""The magnetic field beside the bench, where a phone lies: that of the base, and of the top that moves above it.

The top is a dipole at its centre of mass: for its disc (radius 1.44 cm) the field at 0.2 m differs by less than 1 %.
The drive coil's field is left out, since its winding is not known, and so are the earth's and the mains'.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.simulator import parts
from levilab.simulator.parts import Top
from levilab.world import base

#: μ₀/4π [T m/A].
_MU_0_OVER_4_PI = 1e-7
#: Moment of the thesis's top along its axis [A m²], and the transverse and axial fractions of it.
MOMENT_A_M2, MOMENT_TILT = Top().moment_a_m2, (0.03, 0.97)


def dipole_field(moment: Array, away: Array) -> Array:
    """Return the field of point dipoles, shape (n, 3) [T].

    Args:
        moment: shape (n, 3) [A m²].
        away: from the dipole to the place, shape (n, 3) [m].

    >>> dipole_field(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 0.1]])).round(9).tolist()
    [[0.0, 0.0, 0.0002]]
    """
    square = np.sum(away * away, axis=1, keepdims=True)
    along = np.sum(moment * away, axis=1, keepdims=True)
    return np.asarray(_MU_0_OVER_4_PI * (3 * along * away / square - moment) / square**1.5)


def moment_of(axis: Array, arm: Array, moment_a_m2: float, tilt: tuple[float, float]) -> Array:
    """Return the moment of a top, shape (n, 3) [A m²].

    Args:
        axis: up the stem, shape (n, 3).
        arm: across it, to where the transverse part of the moment points, shape (n, 3).
        moment_a_m2: signed.
        tilt: its transverse and axial fractions.
    """
    arm = arm / np.linalg.norm(arm, axis=1, keepdims=True)  # shorter between two states, from which it was interpolated
    return np.asarray(moment_a_m2 * (tilt[0] * arm + tilt[1] * axis))


def field_beside(
    place: Array, ring: base.Base | parts.Base, position: Array, moment: Array, up: NDArray[np.bool_]
) -> Array:
    """Return the field of base and top at a place, shape (n, 3) [T].

    Args:
        place: of the sensor, shape (3,) [m above the middle of the base].
        ring: the base.
        position: of the top, shape (n, 3) [m].
        moment: of the top, shape (n, 3) [A m²].
        up: whether there is a top, shape (n,).
    """
    field = np.tile(base_beside(tuple(place.tolist()), ring), (up.size, 1))
    field[up] += dipole_field(moment[up], place - position[up])
    return field


@lru_cache(maxsize=16)  # it is asked for with each block of samples
def base_beside(place: tuple[float, ...], ring: base.Base | parts.Base) -> Array:
    """Return the field of the base at a place off its axis, exactly, shape (3,) [T].  A series holds near the axis."""
    from levilab.simulator.field import field_of, flux_density  # with numba

    radii = ring.inner_radius_m, ring.outer_radius_m
    field = field_of(*radii, ring.strength_t_m, "exact", thickness=ring.thickness_m, origin=ring.origin_m)
    return flux_density(field, place)
