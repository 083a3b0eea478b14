"""Energy and spin of states: what stays constant without drag and drive."""

import numpy as np
from numpy.typing import ArrayLike

from analysis.arrays import Array
from levilab.simulator.field import flux_density
from levilab.simulator.kernels.loads import Aligned, Disc
from levilab.simulator.kernels.motion import ARM, LOOSE, L, Model, N, R, V
from levilab.simulator.model import gravity
from levilab.simulator.numbers import row
from levilab.simulator.scene import Scene


def energy(scene: Scene, model: Model, states: Array) -> Array:
    """Return the energy [J] of states, shape (n, 18), without the drive's part; constant without drag and drive.

    If some numbers of scene and model are those of n tops, each has a state.
    """
    s = np.atleast_2d(states)
    momentum, axis = s[:, L], s[:, N]
    along = _product(momentum, axis)
    across = _product(momentum, momentum) - along**2
    kinetic = _product(s[:, V], s[:, V]) / (2 * model.body.inverse_mass)
    turning = across * model.body.inverse_transverse / 2 + _spinning(scene, along, s[:, LOOSE])
    weight = -_product(s[:, R], row(*gravity(scene))) * scene.top.mass_kg
    return np.asarray(kinetic + turning + weight + magnetic_energy(model, s))


def _product(a: Array, b: Array) -> Array:
    """Return the products of vectors, shape (…, 3), added in an order that does not depend on how many these are."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _spinning(scene: Scene, along: Array, loose: Array) -> Array:
    washers, axial = scene.washers.inertia_kg_m2, scene.top.inertia_axial_kg_m2
    if washers == 0:
        return np.asarray(along**2 / (2 * axial))
    return np.asarray((along - loose) ** 2 / (2 * (axial - washers)) + loose**2 / (2 * washers))


def magnetic_energy(model: Model, states: Array) -> Array:
    """−M·B [J] in the base's field, shape (n,)."""
    magnet, axis, arm = model.magnet, states[:, N], states[:, ARM]
    direction = axis if isinstance(magnet, Aligned) else (magnet.axial * axis.T + magnet.transverse * arm.T).T
    if not isinstance(magnet, Disc):
        return np.asarray(-_product(direction, flux_density(model.field, states[:, R])))
    third = np.cross(axis, arm)
    total = np.zeros(len(states))
    for e1, e2, e3, weight in magnet.nodes:
        place = states[:, R] + e1 * arm + e2 * third + e3 * axis
        total -= weight * _product(direction, flux_density(model.field, place))
    return total


def core_spin(states: Array, axial: ArrayLike, washers: ArrayLike) -> Array:
    """Return ω₃ [rad/s] of the top, or of its core where washers are loose, which carries the magnet.

    Args:
        states: shape (…, 18).
        axial: inertia of the whole [kg m²], shape (…).
        washers: that of loose washers, 0 where none are.
    """
    along, washers = np.einsum("...i,...i->...", states[..., L], states[..., N]), np.asarray(washers)
    return np.asarray((along - states[..., LOOSE] * (washers > 0)) / (axial - washers))


def both_spins(states: Array, axial: ArrayLike, washers: ArrayLike) -> Array:
    """Return ω₃ of the core as `core_spin` and that of loose washers, shape (…, 2) [rad/s]; without them the same."""
    core, washers = core_spin(states, axial, washers), np.asarray(washers)
    loose = states[..., LOOSE] / np.where(washers > 0, washers, 1.0)
    return np.stack([core, np.where(washers > 0, loose, core)], axis=-1)


def spin_of(scene: Scene, states: Array) -> Array:
    """Return ω₃ = L·n/I₃ of the states [rad/s]; with loose washers that of the core, which carries the magnet."""
    return core_spin(np.atleast_2d(states), scene.top.inertia_axial_kg_m2, scene.washers.inertia_kg_m2)
