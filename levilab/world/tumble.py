"""How a top that has left its place falls and lies, for a view: no instrument sees it, and nothing is simulated."""

import math

import numpy as np

from analysis.arrays import Array
from levilab.simulator.kernels.motion import N, R, V
from levilab.simulator.scene import Scene

#: A top of the usual shape lies on the rim of its magnet and the end of its stem: its axis is this far from upright
#: [rad], and the centre of mass so high above the ground, in radii of the magnet.
_LIES_RAD, _LIES_HIGH = math.radians(118.0), 0.83
#: A base without a thickness is as high above its middle, in its outer radii, as pages draw it.
_HALF_THICKNESS = 0.1
#: It is down no sooner [s], also where the base has drawn it into its hole.
_LEAST_FALL_S = 0.05
#: A top that leaves at rest with an upright axis falls towards x.
_LEAST = 1e-9


def tumble(scene: Scene, state: Array, since: Array) -> tuple[Array, Array, Array]:
    """Return place [m], axis, and an arm across it, of a top that has left its place, shape (n, 3) each.

    It falls freely, its axis turning evenly, until it lies on the ring of the base, on the side to which it left.  The
    base's pull, which is left out, makes the real fall of some 0.1 s shorter.

    Args:
        scene: with the top and the base.
        state: when it left, shape (18,).
        since: times from then on, shape (n,) [s].
    """
    place, speed, axis = state[R], state[V], state[N]
    base = scene.base
    ground = base.origin_m + (base.thickness_m / 2 or _HALF_THICKNESS * base.outer_radius_m)
    lies = ground + _LIES_HIGH * scene.top.magnet_radius_m
    g = max(scene.gravity_m_s2, _LEAST)
    lands = (speed[2] + math.sqrt(max(0.0, speed[2] ** 2 + 2 * g * (place[2] - lies)))) / g
    lands = max(lands, _LEAST_FALL_S)
    time = np.clip(since, 0.0, lands)
    share = time / lands

    over = axis[:2] if math.hypot(*axis[:2]) > _LEAST else np.array([1.0, 0.0])
    over = over / math.hypot(*over)
    tilt = math.acos(min(max(axis[2], -1.0), 1.0))
    angle = tilt + (_LIES_RAD - tilt) * share
    axes = np.stack([np.sin(angle) * over[0], np.sin(angle) * over[1], np.cos(angle)], axis=1)

    height = np.maximum(place[2] + speed[2] * time - g * time**2 / 2, np.minimum(lies, place[2] + lies * share))
    aside = place[:2] if math.hypot(*place[:2]) > _LEAST else over
    lies_at = (base.inner_radius_m + base.outer_radius_m) / 2 * aside / math.hypot(*aside)
    places = np.column_stack([place[:2] + (lies_at - place[:2]) * share[:, None], height])
    return places, axes, np.tile([-over[1], over[0], 0.0], (since.size, 1))
