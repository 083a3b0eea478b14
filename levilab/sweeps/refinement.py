"""A yes/no map from a part of its points: along its boundary all of them, elsewhere a coarse grid and an audit.

A bisection would follow one boundary and miss islands: survival is not monotone near the upper edge.  Here

1. every point of a coarse grid is computed;
2. a cell of the grid is *open* if its corners, or those of a neighbour, differ.  The points of a grid twice as fine are
   computed in open cells, and filled in with the corners' value in the others; and so on down to the full grid;
3. wherever a filled point turns out to stand beside a different one, it is computed.  So the boundary of an island of
   which one point was seen is followed to its end, and every step across a boundary of the map has computed points on
   either side;
4. an *audit* computes points chosen at random among those filled in.  Where one is wrong, its cell and the neighbours
   are computed at half the spacing, and its island as in 3.  A second audit, of as many points, gives the upper limit.

Only an island on which no computed point lies may be missed.  An island that holds a box of `stride` points along
every axis holds a point of the coarse grid, and is sure to be seen.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Flags = NDArray[np.bool_]
Points = NDArray[np.intp]


#: Computes points, which are flat indices that increase, and returns their values; the number is roughly the share of
#: the work that is done with them.
Answer = Callable[[Points, float], Flags]

#: The coarse grid has every STRIDEth point of the full one, along each axis.
STRIDE = 8
#: Points of each audit: if none of 300 is wrong, fewer than 1 % of all are (with 95 %).
AUDIT = 300
#: Confidence of the upper limit.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Audit:
    """Points computed among those that were filled in.

    Attributes:
        filled: how many points were filled in before the audit.
        computed: how many of these the audit computed.
        wrong: how many of those had been filled in wrongly.
    """

    filled: int
    computed: int
    wrong: int

    @property
    def most_wrong(self) -> int:
        """Upper limit, at CONFIDENCE, of the points that were filled in wrongly, those of the audit among them.

        The limit of Clopper and Pearson, Biometrika 26, 404 (1934), for a sample drawn without putting back: the
        largest number with which so few wrong points are found in one case of twenty at least.
        """
        from scipy.stats import hypergeom  # takes a moment to load

        low, high = self.wrong, self.filled - (self.computed - self.wrong)
        while low < high:
            middle = (low + high + 1) // 2
            possible = hypergeom.cdf(self.wrong, self.filled, middle, self.computed) > 1 - CONFIDENCE
            low, high = (middle, high) if possible else (low, middle - 1)
        return low


@dataclass(frozen=True)
class Refined:
    """A yes/no map of which a part was computed.

    Attributes:
        values: shape of the map.
        computed: likewise; what was not computed was filled in.
        strides: of the coarse grid, along each axis [points].
        audits: the first finds islands, the second gives the upper limit.
    """

    values: Flags
    computed: Flags
    strides: tuple[int, ...]
    audits: tuple[Audit, ...]

    @property
    def filled(self) -> int:
        """How many points were filled in."""
        return int(self.computed.size - np.count_nonzero(self.computed))

    @property
    def saved(self) -> float:
        """The share of all points that was not computed."""
        return self.filled / max(self.computed.size, 1)

    @property
    def most_wrong(self) -> int:
        """Upper limit, at CONFIDENCE, of the points that are filled in wrongly."""
        last = self.audits[-1]
        return min(last.most_wrong - last.wrong, self.filled)  # those that the audit found are right now

    @property
    def most_wrong_share(self) -> float:
        """The same as a share of the points that are filled in."""
        return self.most_wrong / self.filled if self.filled else 0.0


def refine(answer: Answer, shape: Sequence[int], *, stride: int = STRIDE, audit: int = AUDIT, seed: int = 0) -> Refined:
    """Refine a yes/no map along its boundary.

    The points depend on the values alone, so that those with known values need not be computed again.

    Args:
        answer: computes points.
        shape: of the map.
        stride: of the coarse grid, a power of 2.
        audit: points of each audit.
        seed: of the audits' choice.

    Raises:
        ValueError: stride is no power of 2.
    """
    if stride < 1 or stride & (stride - 1):
        raise ValueError(f"stride = {stride}: a power of 2 is expected, such as 8")
    grids = _grids(shape, stride)
    linked = tuple(axis for axis, n in enumerate(shape) if n > 1)
    state = _State(np.zeros(shape, dtype=np.bool_), np.zeros(shape, dtype=np.bool_), linked, answer)
    # each level has about twice as many points as the one before: a boundary is a line
    ends = [0.9 * 2.0 ** (level - len(grids) + 1) for level in range(len(grids))]
    _compute(state, _select(grids[0], shape), ends[0])
    for coarse, fine, end in zip(grids, grids[1:], ends[1:], strict=False):
        _follow_boundary(state, coarse, end)
        inside = _within(_open_cells(state.values[np.ix_(*coarse)], linked), coarse, fine, linked)
        _fill(state, coarse, fine)
        _compute(state, _select(fine, shape, inside), end)
    _follow_boundary(state, grids[-1], ends[-1])
    audits = []
    for number in range(2):
        found, wrong = _audit(state, np.random.default_rng([seed, number]), audit)
        audits.append(found)
        if wrong.size:
            around = _around(wrong, grids[0], shape, linked)
            _compute(state, _select(grids[min(1, len(grids) - 1)], shape) & around, 1.0)
            _follow_boundary(state, grids[-1], 1.0)
    strides = tuple(int(grid[1] - grid[0]) if grid.size > 1 else 1 for grid in grids[0])
    return Refined(state.values, state.computed, strides, tuple(audits))


class _State(NamedTuple):
    """Values, filled in or computed; which are computed; axes along which points have neighbours; what computes."""

    values: Flags
    computed: Flags
    linked: tuple[int, ...]
    answer: Answer


# --- grids, each the coordinates of its points along every axis ---

Grid = list[Points]


def _grids(shape: Sequence[int], stride: int) -> list[Grid]:
    """Return the grids from the coarse to the full one; a coarse one never has less than three points along an axis."""
    finest = [min(stride, 1 << max((n // 2).bit_length() - 1, 0)) for n in shape]
    grids = []
    while True:
        grids.append([_every(step, n) for step, n in zip(finest, shape, strict=True)])
        if max(finest, default=1) == 1:
            return grids
        finest = [max(step // 2, 1) for step in finest]


def _every(step: int, n: int) -> Points:
    """Return each step-th of n points, and the last one."""
    return np.unique(np.append(np.arange(0, n, step), n - 1)).astype(np.intp)


def _select(grid: Grid, shape: Sequence[int], chosen: Flags | None = None) -> Flags:
    """Return a mask of the full grid with the chosen points of a grid; None: all of them."""
    mask = np.zeros(shape, dtype=np.bool_)
    mask[np.ix_(*grid)] = True if chosen is None else chosen
    return mask


# --- cells: between two neighbouring points along every linked axis ---


def _open_cells(values: Flags, linked: Sequence[int]) -> Flags:
    """Return which cells of a grid are open: their corners differ, or those of a neighbour."""
    low, high = values, values
    for axis in linked:
        low, high = _before(low, axis) & _after(low, axis), _before(high, axis) | _after(high, axis)
    corners = _corners(low ^ high, linked)
    for axis in linked:
        corners = _before(corners, axis) | _after(corners, axis)
    return corners


def _corners(cells: Flags, linked: Sequence[int]) -> Flags:
    for axis in linked:
        wide = np.pad(cells, [(1, 1) if k == axis else (0, 0) for k in range(cells.ndim)])
        cells = _before(wide, axis) | _after(wide, axis)
    return cells


def _within(cells: Flags, coarse: Grid, fine: Grid, linked: Sequence[int]) -> Flags:
    """Return which points of the fine grid lie in these cells of the coarse one, or on their faces."""
    for axis in linked:
        last = coarse[axis].size - 2
        left = np.clip(np.searchsorted(coarse[axis], fine[axis], side="left") - 1, 0, last)
        right = np.clip(np.searchsorted(coarse[axis], fine[axis], side="right") - 1, 0, last)
        cells = cells.take(left, axis) | cells.take(right, axis)
    return cells


def _before(array: Flags, axis: int) -> Flags:
    return array[(slice(None),) * axis + (slice(None, -1),)]


def _after(array: Flags, axis: int) -> Flags:
    return array[(slice(None),) * axis + (slice(1, None),)]


# --- steps ---


def _compute(state: _State, wanted: Flags, until: float) -> None:
    """Compute those of the wanted points that are not computed yet."""
    points = np.flatnonzero(wanted & ~state.computed)
    if points.size:
        state.values.flat[points] = state.answer(points, until)
        state.computed.flat[points] = True


def _follow_boundary(state: _State, grid: Grid, until: float) -> None:
    """Compute all corners of open cells of a grid, which may open others, to the end."""
    where = np.ix_(*grid)
    while True:
        corners = _corners(_open_cells(state.values[where], state.linked), state.linked)
        if not np.any(corners & ~state.computed[where]):
            return
        _compute(state, _select(grid, state.values.shape, corners), until)


def _fill(state: _State, coarse: Grid, fine: Grid) -> None:
    """Fill in points of the fine grid with the value of the coarse point before them; those computed stay."""
    before = [
        coarse[axis][np.searchsorted(coarse[axis], fine[axis], side="right") - 1]
        if axis in state.linked
        else fine[axis]
        for axis in range(state.values.ndim)
    ]
    where = np.ix_(*fine)
    state.values[where] = np.where(state.computed[where], state.values[where], state.values[np.ix_(*before)])


def _audit(state: _State, random: np.random.Generator, most: int) -> tuple[Audit, Points]:
    """Compute points chosen at random among those filled in; returns the audit and the points that were wrong."""
    filled = np.flatnonzero(~state.computed)
    chosen = np.sort(random.choice(filled, min(most, filled.size), replace=False)) if filled.size else filled
    before = state.values.flat[chosen].copy()
    mask = np.zeros(state.values.shape, dtype=np.bool_)
    mask.flat[chosen] = True
    _compute(state, mask, 1.0)
    wrong = chosen[state.values.flat[chosen] != before]
    return Audit(filled.size, chosen.size, wrong.size), wrong


def _around(points: Points, grid: Grid, shape: Sequence[int], linked: Sequence[int]) -> Flags:
    """Return a mask of the full grid: the cells of the coarse grid that hold these points, and their neighbours."""
    mask = np.zeros(shape, dtype=np.bool_)
    for place in zip(*np.unravel_index(points, shape), strict=True):
        box = []
        for axis, x in enumerate(place):
            cell = int(np.searchsorted(grid[axis], x, side="right")) - 1
            low, high = max(cell - 1, 0), min(cell + 2, grid[axis].size - 1)
            box.append(slice(grid[axis][low], grid[axis][high] + 1) if axis in linked else slice(x, x + 1))
        mask[tuple(box)] = True
    return mask
