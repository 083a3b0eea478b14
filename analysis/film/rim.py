"""The rim of a top in one picture, to a small part of a pixel: how far its edge is shifted along each of many rays.

The edge along a ray is a + b E(r − δ), where E is the mean over all rays: a, b and δ follow by linear least squares, so
that a mark or a shadow, which change a and b, do not pull the edge.  The shifts are those of a circle and, where the
top tilts, of an ellipse.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from analysis.arrays import Array, Picture
from analysis.film.circles import Circle

#: Directions of rays.
RAYS = 128
#: Bands of the top in which a mark is looked for, in radii, and radii sampled in each.
_BANDS, _IN_BAND = ((0.35, 0.55), (0.55, 0.75), (0.75, 0.92)), 4
#: Length of a ray to either side of the rim, of its radius, and the least [pixels].
_WIDTH, _LEAST_WIDTH = 0.1, 3.0
#: Radii along a ray, to either side.
_STEPS = 8
#: Rays whose edge is off by more than this factor times the median absolute residual see something else: Tukey's
#: biweight with 3.4 standard deviations of normal residuals, since a mark lies beside the rim.
_OFF, _ROUNDS = 5.0, 4
#: Least share of the rays that see the rim.
_LEAST_RAYS = 0.4
#: Contrast of a ray that sees the rim, in that of the mean.
_SIZES = (0.2, 5.0)
#: A fit that moves the centre by less than this part of a ray's length is the last one: less is left.
_CLOSE = 0.02
#: A pixel is one reading: neighbouring rays that fall into it agree.  Pixels that the noise of a film is alike over.
_CORRELATED = 1.5


@dataclass(frozen=True, eq=False)
class Rim:
    """The rim in one picture.

    Attributes:
        circle: of it.
        u: standard uncertainties of both coordinates of the centre [pixels].
        contrast: step of brightness at the edge.
        profiles: brightness along the bands of the top, shape (bands, rays).
    """

    circle: Circle
    u: tuple[float, float]
    contrast: float
    profiles: Array


@lru_cache(maxsize=1)
def _rays() -> tuple[Array, Array, Array]:
    """Return cosines and sines of the rays, shape (RAYS, 1), and the shifts of a circle and an ellipse, (RAYS, 5)."""
    turn = 2 * np.pi * np.arange(RAYS) / RAYS
    columns = (np.ones(RAYS), np.cos(turn), np.sin(turn), np.cos(2 * turn), np.sin(2 * turn))
    return np.cos(turn)[:, None], np.sin(turn)[:, None], np.stack(columns, axis=1)


def fit_rim(picture: Picture, start: Circle, *, width: float = 1.0, rounds: int = 5) -> Rim | None:
    """Fit the rim near a circle.

    Args:
        picture: shape (h, w).
        start: where the rim is about.
        width: of the search, as a factor.
        rounds: the most fits, each begun from the one before.

    Returns:
        None where no rim is seen there.
    """
    circle, reach = start, width * max(_WIDTH * start.radius, _LEAST_WIDTH)
    across = np.linspace(-reach, reach, 2 * _STEPS + 1)
    for _ in range(rounds):
        rays = sample(picture, *_along(circle, circle.radius + across))
        edge = shifts_of(rays, across)
        fit = fit_shifts(_rays()[2], *edge) if edge else None
        if fit is None:
            return None
        (grow, dx, dy, *_), spread, used = fit
        if max(abs(dx), abs(dy), abs(grow)) > 1.5 * reach:
            return None
        circle = Circle(float(circle.x + dx), float(circle.y + dy), float(circle.radius + grow))
        if max(abs(dx), abs(dy)) < _CLOSE * reach:
            break
    pixels = min(float(used.sum()), 2 * np.pi * circle.radius / _CORRELATED)
    inner = np.concatenate([np.linspace(*band, _IN_BAND) for band in _BANDS]) * circle.radius
    profiles = (
        sample(picture, *_along(circle, inner)).reshape(RAYS, len(_BANDS), _IN_BAND).mean(axis=2, dtype=np.float32).T
    )
    contrast = float(np.ptp(np.median(rays, axis=0)))
    u = spread * math.sqrt(2 / pixels)
    return Rim(circle, (u, u), contrast, profiles)


def _along(circle: Circle, radii: Array) -> tuple[Array, Array]:
    """Return rows and columns along the rays at some radii, shape (RAYS, radii)."""
    cosine, sine, _ = _rays()
    return circle.y + radii * sine, circle.x + radii * cosine


def sample(picture: Picture, rows: Array, columns: Array) -> Array:
    """Return brightness at places, in their shape."""
    from scipy.ndimage import map_coordinates

    return np.asarray(map_coordinates(picture, np.stack([rows, columns]), np.float64, order=1, mode="nearest"))


def shifts_of(rays: Array, across: Array) -> tuple[Array, Array] | None:
    """Return how far the edge of each ray is shifted [pixels], and the weights; None without an edge."""
    mean = np.median(rays, axis=0)
    slope = np.gradient(mean, across[1] - across[0])
    basis = np.stack([np.ones_like(mean), mean - mean.mean(), slope], axis=1)
    normal = basis.T @ basis
    if abs(np.linalg.det(normal)) < 1e-9 * np.prod(np.diagonal(normal)) or np.ptp(mean) < 1e-9:
        return None
    _, size, product = np.linalg.solve(normal, basis.T @ rays.T)
    good = (size > _SIZES[0]) & (size < _SIZES[1])
    middle = float(across @ slope**2 / (slope @ slope))  # of the mean's edge
    shift = np.where(good, middle - product / np.where(good, size, 1.0), 0.0)
    return shift, np.where(good, np.minimum(size, 1.0) ** 2, 0.0)


def fit_shifts(
    design: Array, shift: Array, weight: Array, kept: Array | float = 0.0, least_off: float = 1e-6
) -> tuple[Array, float, Array] | None:
    """Return what explains the shifts, the scatter that is left, and the weights; None where too few rays see an edge.

    Args:
        design: shape (rays, n).
        shift: of `shifts_of`, shape (rays,) [pixels].
        weight: shape (rays,).
        kept: weight of no change, in rays, shape (n,).
        least_off: rays that are off by less see the edge [pixels].
    """
    used = weight
    for _ in range(_ROUNDS):
        if np.count_nonzero(used) < _LEAST_RAYS * shift.size:
            return None
        weighted = design.T * used
        found = np.linalg.solve(weighted @ design + np.diag(np.broadcast_to(kept, design.shape[1])), weighted @ shift)
        rest = shift - design @ found
        limit = _OFF * float(np.median(np.abs(rest[weight > 0]))) + least_off
        used = weight * np.maximum(1 - (rest / limit) ** 2, 0.0) ** 2
    return np.asarray(found), math.sqrt(float(used @ rest**2) / float(used.sum())), used
