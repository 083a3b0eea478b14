"""The signal at an input, a voltage as a function of time, and where a Schmitt trigger fires in it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: The voltage at an input: (start [s], step [s], n) → shape (n,) [V].
Signal = Callable[[float, float, int], Array]


def no_signal(_start: float, _step: float, n: int) -> Array:
    """Return 0 V: nothing is connected."""
    return np.zeros(n)


def crossings(voltage: Array, level: float, hysteresis: float) -> Array:
    """Find where a sampled voltage rises through a level [samples], interpolated.

    A crossing counts when the voltage was below level − hysteresis since the last one (a Schmitt trigger).

    >>> crossings(np.array([0.0, 1.0, 0.0, 4.0]), 0.5, 0.1)
    array([0.5  , 2.125])
    """
    return find_firings(voltage, level, level - hysteresis, armed=False)[0]


def find_firings(voltage: Array, level: float, below: float, *, armed: bool) -> tuple[Array, bool]:
    """Find where a Schmitt trigger fires.

    Args:
        voltage: shape (n,) [V].
        level: where it fires [V].
        below: where it is armed [V].
        armed: whether it is armed at the start.

    Returns:
        The places where it fires [samples], and whether it is armed at the end.
    """
    above = voltage >= level
    # +1 where the trigger fires, -1 where it is armed again, 0 where it keeps its state
    state = above.view(np.int8) - (voltage < below).view(np.int8)
    decided = np.flatnonzero(state)
    if not decided.size:
        return np.empty(0), armed
    signs = state[decided]
    fired = decided[1:][np.diff(signs) > 0]
    if armed and signs[0] > 0:
        fired = np.concatenate((decided[:1], fired))
    before, after = voltage[np.maximum(fired - 1, 0)], voltage[fired]
    # the very first sample can only fire if the level has moved since it was armed
    rise = np.where(after > before, after - before, 1.0)
    return np.maximum(fired - 1 + np.clip((level - before) / rise, 0.0, 1.0), 0.0), bool(signs[-1] < 0)
