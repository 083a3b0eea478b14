"""Whether camera and view stay as they were: shift of what stands still, and how much of it is covered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: A pixel that differs by more, of 255, after the light was matched, is covered by something.
_DIFFERS = 20.0


@dataclass(frozen=True)
class View:
    """A picture compared with an earlier one.

    Attributes:
        shift: of the background, its length [pixels].
        u: standard uncertainty of it [pixels].
        covered: share of the background that differs.
    """

    shift: float
    u: float
    covered: float


def compare_views(before: Array, now: Array, background: NDArray[np.bool_]) -> View:
    """Compare two pictures where nothing should move (Lucas and Kanade 1981); light may have changed all over.

    Args:
        before: shape (h, w).
        now: shape (h, w).
        background: pixels without the top, shape (h, w).
    """
    slopes = np.gradient(before)
    design = np.stack([np.ones(before.shape), before, *slopes], axis=2)[background]
    values, kept = now[background], np.ones(int(background.sum()), dtype=bool)
    for _ in range(3):
        found = np.linalg.lstsq(design[kept], values[kept], rcond=None)[0]
        rest = values - design @ found
        again = np.abs(rest) < _DIFFERS
        if again.sum() < 0.3 * again.size:
            break
        kept = again
    normal = design[kept].T @ design[kept]
    noise = float(np.var(rest[kept]))
    u = np.sqrt(noise * np.diagonal(np.linalg.pinv(normal))[2:].max())
    return View(float(np.hypot(*found[2:])), float(u), float(np.mean(np.abs(rest) >= _DIFFERS)))
