"""Escapes: the moment at which a top leaves the limits, of one motion or of many, located within a step."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from analysis.arrays import Array
from levilab.simulator.kernels.motion import TIME, R, V
from levilab.simulator.trajectory import Event

#: Radius and height of the escape [m]: the same for all tops, or shape (n,) each.
Limits = tuple[Any, Any]

#: Newton's steps at most; each doubles the digits, and where it leaves the bracket half of that is taken instead.
_MOST = 60


def exit_speeds(states: Array, across_height: NDArray[np.bool_]) -> Array:
    """Return how fast [m/s] states leave across the limit of height or radius, at least 1e-12, shape (n,)."""
    x, y, _ = states[:, R].T
    vx, vy, vz = states[:, V].T
    outwards = (x * vx + y * vy) / np.maximum(np.hypot(x, y), 1e-300)
    return np.asarray(np.maximum(np.abs(np.where(across_height, vz, outwards)), 1e-12))


def crossed_height(states: Array, escape: Limits) -> NDArray[np.bool_]:
    """Return whether states are farther outside of, or nearer to, the height than the radius."""
    return np.asarray(np.argmin(margins(states, escape), axis=0) == 0)


def margins(states: Array, escape: Limits) -> Array:
    """Return how far inside of the height and of the radius states are [m], shape (2, n); negative outside."""
    x, y, z = states[:, R].T
    return np.array([z - escape[1], escape[0] - np.hypot(x, y)])


def at_the_crossing(after: Array, lengths: Array, escape: Limits, moved: Callable[[Array, Array], Array]) -> Array:
    """Return the states at the limits, shape (n, 18), of tops that a step of these lengths [s] took there.

    Args:
        after: at the step's end, shape (n, 18).
        lengths: of the steps, shape (n,) [s].
        escape: the limits, radius and height [m], shape (n,) each.
        moved: (states, times [s]) → states, each in one step.  The integrator can go back.
    """
    before = moved(after, -lengths)
    height = crossed_height(after, escape)
    low, high = np.zeros_like(lengths), lengths.copy()
    time, states, found = lengths.copy(), after, np.zeros(lengths.shape, dtype=np.bool_)
    for _ in range(_MOST):
        up, sideways = margins(states, escape)
        margin = np.where(height, up, sideways)
        low, high = np.where(margin > 0, time, low), np.where(margin > 0, high, time)
        newton = time + margin / (_margin_rates(states, height))
        better = np.where((newton > low) & (newton < high), newton, (low + high) / 2)
        # a top at its crossing is not changed any more, so that its result does not depend on the others
        found |= np.abs(better - time) <= 1e-15 * lengths
        if np.all(found):
            break
        time = np.where(found, time, better)
        states = moved(before, time)
    states = states.copy()
    states[:, TIME] = before[:, TIME] + time
    return states


def _margin_rates(states: Array, height: NDArray[np.bool_]) -> Array:
    """Return how fast the margin shrinks [m/s]; 1e-300 where it does not, which sends Newton out of the bracket."""
    x, y, _ = states[:, R].T
    vx, vy, vz = states[:, V].T
    shrinking = np.where(height, -vz, (x * vx + y * vy) / np.maximum(np.hypot(x, y), 1e-300))
    return np.where(shrinking > 0, shrinking, 1e-300)


def locate_escape(before: Array, length: float, moved: Callable[[Array, float], Array], escape: Limits) -> Event:
    """Return the escape within a step from a state.

    Args:
        before: that state, shape (18,).
        length: of the step [s].
        moved: (state, time) → state.
        escape: the limits, radius and height [m].
    """
    after = moved(before, length)
    limit = int(np.argmin(margins(after[None], escape)))
    name = ("height", "radius")[limit]
    return locate_zero(name, before, length, moved, lambda state: float(margins(state[None], escape)[limit, 0]))


def locate_zero(
    name: str, before: Array, length: float, moved: Callable[[Array, float], Array], value: Callable[[Array], float]
) -> Event:
    """Return the moment within a step at which a value passes through zero, to the last digits of the time."""
    if value(before) == 0:
        return Event(name, float(before[TIME]), before)
    # relative to the step: xtol below the rounding of the time itself
    part = brentq(lambda part: value(moved(before, part * length)), 0.0, 1.0, xtol=1e-14, rtol=1e-14)
    state = moved(before, float(part) * length)
    return Event(name, float(state[TIME]), state)
