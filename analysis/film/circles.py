"""Find circles in a picture: where most lines along the gradient of brightness meet (Hough's transform)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array, Picture
from analysis.film.errors import NoTop

#: Steepest edges whose pixels vote, as a part of all pixels.
_EDGES = 0.15
#: Of a circle whose edge is seen: share of its circumference.
_LEAST_SHARE = 0.3
#: A pixel changes if its scatter is above the median by this factor: a film's noise differs by less between its pixels.
_CHANGES = 4.0
#: Least scatter of a pixel that changes, of 255.
_LEAST_CHANGE = 3.0
#: How far the change reaches from the centre of the top, in radii of its rim: by the mark, the rim's motion, shadows.
_REACH = (0.45, 1.7)


@dataclass(frozen=True)
class Circle:
    """A circle.

    Attributes:
        x: its centre from the left [pixels].
        y: from above [pixels].
        radius: [pixels].
    """

    x: float
    y: float
    radius: float

    def scaled(self, factor: float) -> Circle:
        """Return the circle in a picture that is larger by a factor; pixels are counted from their middles."""
        shift = (factor - 1) / 2
        return Circle(factor * self.x + shift, factor * self.y + shift, factor * self.radius)

    def distance(self, shape: tuple[int, ...]) -> Array:
        """Return how far the pixels of a picture are from the centre, shape (h, w) [pixels]."""
        rows, columns = np.ogrid[: shape[0], : shape[1]]
        return np.asarray(np.hypot(columns - self.x, rows - self.y))


def coarse(picture: Picture, factor: int) -> Array:
    """Return means over squares of pixels, shape (h // factor, w // factor)."""
    if factor == 1:
        return np.asarray(picture, dtype=np.float64)
    h, w = (size // factor for size in picture.shape)
    rows = np.add.reduce(picture[: h * factor, : w * factor].reshape(h, factor, w * factor), axis=1, dtype=np.float32)
    return np.asarray(rows.reshape(h, w, factor).sum(axis=2), dtype=np.float64) / factor**2


def find_top(pictures: Array) -> Circle:
    """Find the rim of the top: the best circle as large as the region that changes.

    Args:
        pictures: of less than a second, shape (n, h, w).

    Raises:
        NoTop: nothing changes, or what changes has no rim.
    """
    part = changing_part(pictures)
    if part is None:
        raise NoTop(moving=0.0)
    rows, columns = part
    reach = max(rows.stop - rows.start, columns.stop - columns.start) / 2
    middle = ((columns.start + columns.stop - 1) / 2, (rows.start + rows.stop - 1) / 2)
    radii = np.arange(max(reach / _REACH[1], 4.0), min(reach / _REACH[0], min(pictures.shape[1:]) / 2), 0.5)
    found = circles(np.median(pictures, axis=0), radii, middle, reach) if radii.size else []
    if not found:
        raise NoTop(moving=(rows.stop - rows.start) * (columns.stop - columns.start) / pictures[0].size)
    return found[0]


def changing_part(pictures: Array) -> tuple[slice, slice] | None:
    """Return rows and columns of the largest part of pictures, shape (n, h, w), that changes; None: there is none."""
    from scipy.ndimage import find_objects, gaussian_filter, label

    scatter = gaussian_filter(np.std(pictures, axis=0), 1.0)
    parts, count = label(scatter > max(_CHANGES * float(np.median(scatter)), _LEAST_CHANGE))
    if count == 0:
        return None
    rows, columns = find_objects(parts)[int(np.argmax(np.bincount(parts.ravel())[1:]))]
    return rows, columns


def find_base(picture: Array, top: Circle) -> Circle | None:
    """Return the largest circle round the top whose edge is well seen; None: there is none."""
    radii = np.arange(1.5 * top.radius, 0.75 * max(picture.shape), 0.5)
    found = circles(picture, radii, (top.x, top.y), top.radius) if radii.size else []
    return max(found, key=lambda one: one.radius, default=None)


def circles(picture: Array, radii: Array, middle: tuple[float, float], off: float) -> list[Circle]:
    """Return circles, best first, one a radius, that are the best among the radii beside theirs.

    Args:
        picture: shape (h, w).
        radii: that are tried [pixels].
        middle: x and y about where the centre is [pixels].
        off: how far the centre may be from there [pixels].
    """
    from scipy.ndimage import gaussian_filter, maximum_filter1d, sobel

    gx, gy = sobel(picture, 1), sobel(picture, 0)
    steep = np.hypot(gx, gy)
    rows, columns = np.nonzero(steep > max(float(np.quantile(steep, 1 - _EDGES)), 8 * _LEAST_CHANGE))
    ux, uy = (g[rows, columns] / steep[rows, columns] for g in (gx, gy))
    n = int(np.ceil(off)) + 2
    size = 2 * n + 1
    best = np.zeros((radii.size, 3))
    for k, radius in enumerate(radii):
        votes = np.zeros(size * size)
        for sign in (1, -1):
            x = np.rint(columns + sign * radius * ux - middle[0]).astype(int) + n
            y = np.rint(rows + sign * radius * uy - middle[1]).astype(int) + n
            inside = (x >= 0) & (x < size) & (y >= 0) & (y < size)
            # an edge has one polarity all round: light to dark or dark to light
            votes = np.maximum(votes, np.bincount(y[inside] * size + x[inside], minlength=size * size))
        smooth = gaussian_filter(votes.reshape(size, size), 1.2) * (2 * np.pi * 1.2**2)
        row, column = np.unravel_index(int(np.argmax(smooth)), smooth.shape)
        # edges are about three pixels wide where pixels vote
        share = float(smooth[row, column]) / (2 * np.pi * radius)
        best[k] = share, middle[0] + column - n, middle[1] + row - n
    peaks = (best[:, 0] == maximum_filter1d(best[:, 0], 9)) & (best[:, 0] > _LEAST_SHARE)
    order = sorted(np.flatnonzero(peaks), key=lambda k: -best[k, 0])
    return [Circle(float(best[k, 1]), float(best[k, 2]), float(radii[k])) for k in order]
