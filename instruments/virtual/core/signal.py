"""The signal at the input of a counter or an oscilloscope: a voltage as a function of time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: The voltage at an input: (start [s], step [s], n) → shape (n,) [V].
Signal = Callable[[float, float, int], Array]


def no_signal(_start: float, _step: float, n: int) -> Array:
    """Return 0 V: nothing is connected."""
    return np.zeros(n)
