"""Energy and spin of states: what stays constant without drag and drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from levilab.simulator.field import flux_density
from levilab.simulator.kernels.loads import Aligned, Disc
from levilab.simulator.kernels.motion import ARM, LOOSE, L, Model, N, R, V
from levilab.simulator.model import Array, gravity

if TYPE_CHECKING:
    from levilab.simulator.scene import Scene


def energy(scene: Scene, model: Model, states: Array) -> Array:
    """Energy [J] of states of shape (n, 18), without the drive's part; constant where there is no drag and no drive."""
    s = np.atleast_2d(states)
    momentum, axis = s[:, L], s[:, N]
    along = np.einsum("ij,ij->i", momentum, axis)
    across = np.einsum("ij,ij->i", momentum, momentum) - along**2
    kinetic = np.einsum("ij,ij->i", s[:, V], s[:, V]) / (2 * model.body.inverse_mass)
    turning = across * model.body.inverse_transverse / 2 + _spinning(scene, along, s[:, LOOSE])
    weight = -(s[:, R] @ np.array(gravity(scene))) * scene.top.mass_kg
    return np.asarray(kinetic + turning + weight + magnetic_energy(model, s))


def _spinning(scene: Scene, along: Array, loose: Array) -> Array:
    washers, axial = scene.washers.inertia_kg_m2, scene.top.inertia_axial_kg_m2
    if washers == 0:
        return np.asarray(along**2 / (2 * axial))
    return np.asarray((along - loose) ** 2 / (2 * (axial - washers)) + loose**2 / (2 * washers))


def magnetic_energy(model: Model, states: Array) -> Array:
    """−M·B [J] in the base's field, shape (n,)."""
    magnet, axis, arm = model.magnet, states[:, N], states[:, ARM]
    direction = axis if isinstance(magnet, Aligned) else magnet.axial * axis + magnet.transverse * arm
    if not isinstance(magnet, Disc):
        return np.asarray(-np.einsum("ij,ij->i", direction, flux_density(model.field, states[:, R])))
    third = np.cross(axis, arm)
    total = np.zeros(len(states))
    for e1, e2, e3, weight in magnet.nodes:
        place = states[:, R] + e1 * arm + e2 * third + e3 * axis
        total -= weight * np.einsum("ij,ij->i", direction, flux_density(model.field, place))
    return total


def spin_of(scene: Scene, states: Array) -> Array:
    """ω₃ = L·n/I₃ of the states [rad/s]; with loose washers that of the core, which carries the magnet."""
    s = np.atleast_2d(states)
    along = np.einsum("ij,ij->i", s[:, L], s[:, N])
    washers = scene.washers.inertia_kg_m2
    return np.asarray((along - s[:, LOOSE] * (washers > 0)) / (scene.top.inertia_axial_kg_m2 - washers))


def spins_of(scene: Scene, states: Array) -> Array:
    """ω₃ of the top, or of its core, and that of loose washers, shape (n, 2) [rad/s]; both the same where none are."""
    s, spins = np.atleast_2d(states), spin_of(scene, states)
    washers = scene.washers.inertia_kg_m2
    return np.column_stack([spins, s[:, LOOSE] / washers if washers else spins])
