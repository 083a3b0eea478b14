"""A scan over the spin: which tops are up, and what its limits are.

Near the upper edge survival is not monotone in the spin: there are holes and islands, whose number depends on the step
of the scan.  So a scan, never a bisection alone, and its step beside every limit.
"""

import math

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array

Flags = NDArray[np.bool_]


def intervals(flags: Flags) -> list[tuple[int, int]]:
    """Return first and last index of every run of flags that are set.

    >>> intervals(np.array([True, False, True, True]))
    [(0, 0), (2, 3)]
    """
    change = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(int), [0]))))
    return [(int(a), int(b) - 1) for a, b in zip(change[::2], change[1::2], strict=True)]


def lower_limit(spins: Array, up: Flags) -> float:
    """Return the spin from which on every top of a scan is up [Hz]; NaN if the last one is not."""
    lost = np.flatnonzero(~up)
    first = lost[-1] + 1 if lost.size else 0
    return float(spins[first]) if first < spins.size else math.nan


def all_up_until(spins: Array, up: Flags) -> float:
    """Return the spin up to which every top of a scan is up [Hz]; NaN if the first one is lost."""
    lost = np.flatnonzero(~up)
    last = lost[0] - 1 if lost.size else spins.size - 1
    return float(spins[last]) if last >= 0 else math.nan


def last_up(spins: Array, up: Flags) -> float:
    """Return the highest spin of a top that is up [Hz]; NaN if none is."""
    found = np.flatnonzero(up)
    return float(spins[found[-1]]) if found.size else math.nan


def upper_edges(spins: Array, up: Flags) -> Array:
    """Return the spins above which a scan changes from up to lost [Hz], each in the middle of a step, shape (n,)."""
    ends = np.flatnonzero(up[:-1] & ~up[1:])
    return np.asarray((spins[ends] + spins[ends + 1]) / 2)
