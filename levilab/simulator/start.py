"""The state in which a scene begins."""

import math
from typing import Any

import numpy as np

from analysis.arrays import Array
from levilab.simulator.equilibrium import floating_height
from levilab.simulator.field import flux_density
from levilab.simulator.kernels.motion import L, N, R
from levilab.simulator.model import base_field
from levilab.simulator.numbers import copysign, cos, row, sin, sqrt
from levilab.simulator.scene import Scene


def start_of(scene: Scene) -> Array:
    """Return the state at time 0 in the base's frame, shape (18,), or (n, 18) if some numbers are those of n tops."""
    start = scene.start
    place, velocity = start.position_m, start.velocity_m_s
    if start.place == "equilibrium":
        place, velocity = (0.0, 0.0, floating_height(scene)), (0.0, 0.0, 0.0)
    n = (0.0, -sin(start.tilt_rad), cos(start.tilt_rad))
    spin = 2 * math.pi * start.spin_hz
    along, across = (
        scene.top.inertia_axial_kg_m2 * spin,
        scene.top.inertia_transverse_kg_m2 * _precession(scene, spin, place),
    )
    # ω = ω₃ n + φ̇ (e_z − n cos θ)
    momentum = (
        along * n[0] + across * (0.0 - n[0] * n[2]),
        along * n[1] + across * (0.0 - n[1] * n[2]),
        along * n[2] + across * (1.0 - n[2] * n[2]),
    )
    arm = (1.0, 0.0, 0.0)  # φ = ψ = 0: the node line, at right angles to the axis
    state: Array = row(*place, *velocity, *n, *momentum, *arm, spin, scene.washers.inertia_kg_m2 * spin, 0.0)
    return state


def _precession(scene: Scene, spin: Any, place: Any) -> Any:
    """Return the rate φ̇ of the azimuth at the start [rad/s]."""
    start = scene.start
    if start.precession == "thesis":  # φ̇ = ψ̇ and ω₃ = ψ̇ + φ̇ cos θ
        return spin / (1 + cos(start.tilt_rad))
    if start.precession == "none":
        return 0.0
    return steady_rates(scene, spin, place)[0]


def steady_rates(scene: Scene, spin: Any, place: Any) -> tuple[Any, Any]:
    """Return the rates of steady precession, without nutation, and of a steady nutation [rad/s].

    They are the slow and the fast root of I₁ cosθ φ̇² − I₃ω₃ φ̇ + P = 0, P = −μB_z (Goldstein, Classical Mechanics,
    § 5.7, with the torque of the field in place of the weight's).  A top too slow for a steady precession, (I₃ω₃)² <
    4 I₁ cosθ P, has the rate I₃ω₃/(2 I₁ cosθ) for both, at which the missing torque is smallest.

    Args:
        scene: with top, base and tilt.
        spin: ω₃ [rad/s].
        place: of the top, three numbers [m].
    """
    top = scene.top
    bz = flux_density(base_field(scene), row(*place))[..., 2]
    restoring = -scene.moment * top.moment_tilt[1] * bz
    a = top.inertia_transverse_kg_m2 * cos(scene.start.tilt_rad)
    b = top.inertia_axial_kg_m2 * spin
    square = b * b - 4 * a * restoring
    if square < 0:
        return b / (2 * a), b / (2 * a)
    root = copysign(sqrt(square), b)
    return (2 * restoring / (b + root) if b + root else 0.0), (b + root) / (2 * a)


def nutating_start(scene: Scene) -> Array:
    """Return the state at time 0, shape (18,), of a top that nutates: its axis circles at the fast rate."""
    state = start_of(scene)
    spin, tilt, n = 2 * math.pi * scene.start.spin_hz, scene.start.tilt_rad, state[N]
    transverse = np.array([0.0, 0.0, 1.0]) - n * math.cos(tilt)
    rate = steady_rates(scene, spin, state[R])[1]
    state[L] = scene.top.inertia_axial_kg_m2 * spin * n + scene.top.inertia_transverse_kg_m2 * rate * transverse
    return state
