"""Moments on the way: the escape that ends a motion, and events of any kind, located between two steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from levilab.simulator import top
from levilab.simulator.trajectory import Event

if TYPE_CHECKING:
    from collections.abc import Callable

Array = NDArray[np.float64]


def margins(state: Array, escape: tuple[float, float]) -> dict[str, float]:
    """How far [m] a state is inside of either limit; negative outside."""
    x, y, z = state[top.R]
    return {"radius": escape[0] - float(np.hypot(x, y)), "height": float(z) - escape[1]}


def speed(state: Array, name: str) -> float:
    """How fast [m/s] a state moves across the limit of that name; never quite 0."""
    x, y, _ = state[top.R]
    vx, vy, vz = state[top.V]
    across = vz if name == "height" else (x * vx + y * vy) / max(float(np.hypot(x, y)), 1e-300)
    return max(abs(float(across)), 1e-12)


def escaped(before: Array, length: float, moved: Callable[[Array, float], Array], escape: tuple[float, float]) -> Event:
    """The escape within a step of this length [s] from a state; moved: (state, time) → state."""
    after = moved(before, length)
    name = min(margins(after, escape), key=lambda key: margins(after, escape)[key])
    return located(name, before, length, moved, lambda state: margins(state, escape)[name])


def located(
    name: str, before: Array, length: float, moved: Callable[[Array, float], Array], value: Callable[[Array], float]
) -> Event:
    """The moment within a step at which a value passes through zero, to the last digits of the time."""
    from scipy.optimize import brentq

    if value(before) == 0:
        return Event(name, float(before[top.TIME]), before)
    # relative to the step: xtol below the rounding of the time itself
    part = brentq(lambda part: value(moved(before, part * length)), 0.0, 1.0, xtol=1e-14, rtol=1e-14)
    state = moved(before, float(part) * length)
    return Event(name, float(state[top.TIME]), state)
