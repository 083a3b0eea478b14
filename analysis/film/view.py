"""Whether camera and view stay as they were: shift of what stands still, and how much of it is covered."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array

#: A shift is seen at edges, of at least this part of the steepest slope: what a codec changes in a flat part looks
#: like one.  Fewest pixels of edges.
_STEEP, _FEWEST = 0.1, 200
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
    steep = np.hypot(*slopes)
    edges = background & (steep > _STEEP * np.quantile(steep[background], 0.999))
    seen = edges if np.count_nonzero(edges) > _FEWEST else background
    design = np.stack([np.ones(before.shape), before, *slopes], axis=2)
    whole, every, design, values = design[background], now[background], design[seen], now[seen]
    kept = np.ones(values.size, dtype=bool)
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
    return View(float(np.hypot(*found[2:])), float(u), float(np.mean(np.abs(every - whole @ found) >= _DIFFERS)))
