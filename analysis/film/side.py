"""The side of a top that a camera beside it sees, in one picture: its place, its turn, and the mark that passes.

Its outline is a rectangle, fitted as the rim is by rays across its edges.  A top that leans to the camera, or is above
or below it, shows a part of its face as well, so the long edges bend outwards as ellipses: each by itself, since the
upper and the lower one are seen under different angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from analysis.arrays import Array, Picture
from analysis.film.circles import Circle, changing_part
from analysis.film.errors import NoTop
from analysis.film.rim import RAYS, Rim, fit_shifts, shifts_of

#: Rays across each long and each short edge, and the part of the edge that they cover.
_LONG, _SHORT, _COVERED = 44, 20, 0.95
#: Length of a ray to either side of an edge, of half the height, and the least [pixels]; radii along it to either side.
_WIDTH, _LEAST_WIDTH, _STEPS = 0.5, 3.0, 8
#: Weight of the place and the size before, in rays: where the mark lies at one end, the other one gives the place.
_ANY_SIZE = np.full(7, 1e-3)
_SAME_SIZE = np.array([2.0, 1e-3, 1e-3, 20.0, 1e-3, 1e-3, 1e-3])
#: An edge that is off by less is a real one [pixels]: corners are round.
_LEAST_OFF = 0.4
#: Pixels along an edge that the noise of a film is alike over: 5.7 with little noise, 2.5 with much, of 120 simulated.
_CORRELATED = 5.0
#: A fit that moves the middle by less than this part of a ray's length is the last one.
_CLOSE = 0.02
#: The side is at least so high [pixels].
_LEAST_HEIGHT = 4.0
#: The mark is looked for where the side is seen under less than this angle [rad], in the inner part of its height.
_SEEN, _INNER, _ROWS = 1.2, 0.7, 8


@dataclass(frozen=True)
class Side:
    """The side of a top.

    Attributes:
        x: its middle from the left [pixels].
        y: from above [pixels].
        radius: half of its width [pixels].
        half_height: [pixels].
        turn: clockwise in the picture [rad].
    """

    x: float
    y: float
    radius: float
    half_height: float
    turn: float = 0.0

    def scaled(self, factor: float) -> Side:
        """Return the side in a picture that is larger by a factor; pixels are counted from their middles."""
        shift = (factor - 1) / 2
        size = factor * self.radius, factor * self.half_height
        return Side(factor * self.x + shift, factor * self.y + shift, *size, self.turn)

    def places(self, across: Array, down: Array) -> tuple[Array, Array]:
        """Return rows and columns of places given from the middle along the side's own edges [pixels]."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        return self.y + s * across + c * down, self.x + c * across - s * down


@lru_cache(maxsize=1)
def _edges() -> tuple[Array, Array]:
    """Return where rays cross the outline of a square of 2 × 2, and their outward normals, shape (2, rays)."""
    long, short = (_COVERED * np.linspace(-1, 1, count) for count in (_LONG, _SHORT))
    across = np.concatenate([long, long, -np.ones(_SHORT), np.ones(_SHORT)])
    down = np.concatenate([-np.ones(_LONG), np.ones(_LONG), short, short])
    is_long = np.arange(across.size) < 2 * _LONG
    return np.stack([across, down]), np.stack([np.where(is_long, 0, across), np.where(is_long, down, 0)])


def find_side(pictures: Array) -> Side:
    """Find the side of the top: what changes, less the motion of its edges.

    Args:
        pictures: of less than a second, shape (n, h, w).

    Raises:
        NoTop: nothing changes, or what changes has no such outline.
    """
    part = changing_part(pictures)
    if part is None:
        raise NoTop(moving=0.0)
    picture = np.median(pictures, axis=0)
    rows, columns = _grown(picture, np.std(pictures, axis=0), *part)
    wide, high = (columns.stop - columns.start) / 2, (rows.stop - rows.start) / 2
    middle = (columns.start + columns.stop - 1) / 2, (rows.start + rows.stop - 1) / 2
    for less in np.arange(0.0, high - _LEAST_HEIGHT / 2):
        found = fit_side(picture, Side(*middle, wide - less / 2, high - less), rounds=8, find_size=True)
        if found is not None:
            return _with_size(found[1], pictures)
    raise NoTop(moving=4 * wide * high / pictures[0].size)


def _grown(picture: Array, scatter: Array, rows: slice, columns: slice) -> tuple[slice, slice]:
    """Return the part of a picture that is as bright as where the mark passes, unlike the rest; without a stem."""
    from scipy.ndimage import find_objects, label

    passes = scatter[rows, columns] > scatter[rows, columns].max() / 2
    top, outside = float(np.median(picture[rows, columns][passes])), float(np.median(picture))
    parts, _ = label(np.abs(picture - top) < abs(outside - top) / 2)
    inside = np.bincount(parts[rows, columns].ravel())
    if inside[1:].max(initial=0) == 0:
        return rows, columns
    number = 1 + int(np.argmax(inside[1:]))
    rows, columns = find_objects(parts)[number - 1]
    widths = np.count_nonzero(parts[rows, columns] == number, axis=1)
    wide = np.flatnonzero(widths > widths.max() / 2)  # a stem is narrower
    return slice(rows.start + int(wide[0]), rows.start + int(wide[-1]) + 1), columns


def _with_size(side: Side, pictures: Array) -> Side:
    """Return the side with the median of its sizes in some pictures: the mark hides an edge in a few of them."""
    fits = [fit for one in pictures if (fit := fit_side(one, side, width=1.5, rounds=8, find_size=True))]
    if not fits:
        return side
    radius, half_height = np.median([(one.radius, one.half_height) for _, one in fits], axis=0)
    return replace(side, radius=float(radius), half_height=float(half_height))


def fit_side(
    picture: Picture, start: Side, *, width: float = 1.0, rounds: int = 5, find_size: bool = False
) -> tuple[Rim, Side] | None:
    """Fit the side near a place.

    Args:
        picture: shape (h, w).
        start: where the side is about.
        width: of the search, as a factor.
        rounds: the most fits, each begun from the one before.
        find_size: the height is fitted, too.

    Returns:
        The place with its u, and the side; None where none is seen there.
    """
    (across, down), (right, below) = _edges()
    side, reach = start, width * max(_WIDTH * start.half_height, _LEAST_WIDTH)
    smooth = _Smooth(picture, start, 2 * reach)
    along = np.linspace(-reach, reach, 2 * _STEPS + 1)
    leans = [edge * np.sqrt(1 - (across * below) ** 2) for edge in (below < 0, below > 0)]
    for _ in range(rounds):
        a, b = across * side.radius, down * side.half_height
        design = np.stack(
            [right, below, a * below - b * right, np.abs(right), find_size * np.abs(below), *leans], axis=1
        )
        rays = smooth.sample(*side.places(a[:, None] + right[:, None] * along, b[:, None] + below[:, None] * along))
        edge = shifts_of(rays, along)
        fit = fit_shifts(design, *edge, _ANY_SIZE if find_size else _SAME_SIZE, _LEAST_OFF) if edge else None
        if fit is None:
            return None
        (dx, dy, turn, wider, higher, *_), spread, used = fit
        if used[2 * _LONG :].sum() < _SHORT / 2:  # no end is seen
            return None
        if max(abs(dx), abs(dy), abs(wider), abs(turn) * side.radius) > 1.5 * reach:
            return None
        c, s = math.cos(side.turn), math.sin(side.turn)
        side = Side(
            side.x + c * dx - s * dy, side.y + s * dx + c * dy, side.radius + wider, side.half_height + higher,
            side.turn + turn,
        )  # fmt: skip
        if side.half_height < 1 or max(abs(dx), abs(dy)) < _CLOSE * reach:
            break
    covariance = np.linalg.pinv(design.T * used @ design)[:2, :2]
    rays_in_a_pixel = max(float(used.sum()) * _CORRELATED / (4 * (side.radius + side.half_height)), 1.0)
    ux, uy = (spread * math.sqrt(float(one) * rays_in_a_pixel) for one in np.diagonal(covariance))
    contrast = float(np.ptp(np.median(rays, axis=0)))
    return Rim(Circle(side.x, side.y, side.radius), (ux, uy), contrast, _profile(smooth, side)), side


class _Smooth:
    """A picture near a side as a cubic spline: straight edges of one place in the pixels bias straight lines by 0.2."""

    def __init__(self, picture: Picture, side: Side, room: float) -> None:
        from scipy.ndimage import spline_filter

        reach, high = round(side.radius + room), round(side.half_height + abs(side.turn) * side.radius + room)
        self._up, self._left = max(round(side.y) - high, 0), max(round(side.x) - reach, 0)
        part = picture[self._up : round(side.y) + high + 1, self._left : round(side.x) + reach + 1]
        self._spline = spline_filter(part, output=np.float64)

    def sample(self, rows: Array, columns: Array) -> Array:
        """Return brightness at places, in their shape."""
        from scipy.ndimage import map_coordinates

        at = np.stack([rows - self._up, columns - self._left])
        return np.asarray(map_coordinates(self._spline, at, mode="nearest", prefilter=False))


def _profile(smooth: _Smooth, side: Side) -> Array:
    """Return brightness round the side, shape (1, RAYS): the front at angle 0, and 0 at the back, which is not seen.

    Angles are those of a camera above, clockwise: the front moves to the left as they grow.
    """
    angle = 2 * np.pi * np.arange(RAYS) / RAYS
    seen = np.cos(angle) > math.cos(_SEEN)
    wide, high = np.meshgrid(-side.radius * np.sin(angle[seen]), side.half_height * np.linspace(-_INNER, _INNER, _ROWS))
    profile = np.zeros((1, RAYS))
    profile[0, seen] = smooth.sample(*side.places(wide, high)).mean(axis=0)
    return profile
