"""Many falls at once: states that are up to a step outside of the limits, taken back to the moment they crossed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from levilab.simulator import top

if TYPE_CHECKING:
    from collections.abc import Callable

Array = NDArray[np.float64]

#: Newton's steps at most; each doubles the digits, and where it leaves the bracket half of that is taken instead.
_MOST = 60


def inside(states: Array, escape: tuple[float, float]) -> NDArray[np.bool_]:
    """Whether states, shape (n, 18), are within the escape's radius and above its height [m]."""
    x, y, z = states[:, top.R].T
    return np.asarray((z > escape[1]) & (np.hypot(x, y) < escape[0]))


def speeds(states: Array, across_height: NDArray[np.bool_]) -> Array:
    """How fast [m/s] states leave across the limit of height or else of radius, never below 1e-12, shape (n,)."""
    x, y, _ = states[:, top.R].T
    vx, vy, vz = states[:, top.V].T
    outwards = (x * vx + y * vy) / np.maximum(np.hypot(x, y), 1e-300)
    return np.asarray(np.maximum(np.abs(np.where(across_height, vz, outwards)), 1e-12))


def crossed_height(states: Array, escape: tuple[float, float]) -> NDArray[np.bool_]:
    """Whether it is the height that states are farther outside of, or nearer to, than the radius."""
    return np.asarray(np.argmin(_margins(states, escape), axis=0) == 0)


def _margins(states: Array, escape: tuple[float, float]) -> Array:
    """How far [m] inside of the height and of the radius, shape (2, n)."""
    x, y, z = states[:, top.R].T
    return np.array([z - escape[1], escape[0] - np.hypot(x, y)])


def at_the_crossing(
    after: Array, lengths: Array, escape: tuple[float, float], moved: Callable[[Array, Array], Array]
) -> Array:
    """The states at the limits, shape (n, 18), of tops that a step of these lengths [s] took there.

    after: at the step's end; moved: (states, times [s]) → states, each in one step.  The integrator can go back.
    """
    before = moved(after, -lengths)
    height = crossed_height(after, escape)
    low, high = np.zeros_like(lengths), lengths.copy()
    time, states = lengths.copy(), after
    for _ in range(_MOST):
        up, sideways = _margins(states, escape)
        margin = np.where(height, up, sideways)
        low, high = np.where(margin > 0, time, low), np.where(margin > 0, high, time)
        newton = time + margin / (_signed(states, height))
        better = np.where((newton > low) & (newton < high), newton, (low + high) / 2)
        if np.all(np.abs(better - time) <= 1e-15 * lengths):
            break
        time, states = better, moved(before, better)
    states = states.copy()
    states[:, top.TIME] = before[:, top.TIME] + time
    return states


def _signed(states: Array, height: NDArray[np.bool_]) -> Array:
    """How fast the margin shrinks [m/s]; 1e-300 where it does not, which sends Newton out of the bracket."""
    x, y, _ = states[:, top.R].T
    vx, vy, vz = states[:, top.V].T
    shrinking = np.where(height, -vz, (x * vx + y * vy) / np.maximum(np.hypot(x, y), 1e-300))
    return np.where(shrinking > 0, shrinking, 1e-300)
