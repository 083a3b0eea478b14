"""A light dot on the stem of a top, in one picture: the middle of what is brighter than half of its height."""

import numpy as np

from analysis.arrays import Picture
from analysis.film.circles import Circle

#: How far from the rim's middle the dot is looked for, in radii of the rim: a mark begins beyond.
_REACH = 0.32
#: The middle is found again from the pixels near the one before, so often.
_ROUNDS = 4
#: Share of the pixels there that are darker than the dot.
_AROUND = 0.8
#: A dot stands out by this much, of 255, and covers pixels from a few to this share of where it is looked for.
_LEAST_STEP, _FEWEST, _LARGEST = 25.0, 3.0, 0.2


def find_dot(picture: Picture, rim: Circle) -> complex | None:
    """Return x + iy of the light dot near the middle of the rim [pixels], y downwards; None: there is none.

    Args:
        picture: shape (h, w).
        rim: circle of the rim.
    """
    reach = _REACH * rim.radius
    left, up = (max(round(at - reach), 0) for at in (rim.x, rim.y))
    part = np.asarray(picture[up : round(rim.y + reach) + 1, left : round(rim.x + reach) + 1], dtype=np.float64)
    rows, columns = np.mgrid[up : up + part.shape[0], left : left + part.shape[1]]
    near = np.hypot(columns - rim.x, rows - rim.y) <= reach
    if not near.any():
        return None
    low, high = np.quantile(part[near], [_AROUND, 0.99])
    above = np.where(near, np.maximum(part - (low + high) / 2, 0.0), 0.0)
    bright = float(np.count_nonzero(above))
    if high - low < _LEAST_STEP or not _FEWEST <= bright <= _LARGEST * np.count_nonzero(near):
        return None
    radius = 1.5 * np.sqrt(bright / np.pi) + 1
    row, column = np.unravel_index(int(np.argmax(above)), above.shape)
    x, y = float(left + column), float(up + row)
    for _ in range(_ROUNDS):
        weight = above * (np.hypot(columns - x, rows - y) <= radius)
        total = float(weight.sum())
        if total <= 0:
            return None
        x, y = float((weight * columns).sum() / total), float((weight * rows).sum() / total)
    return complex(x, y)
