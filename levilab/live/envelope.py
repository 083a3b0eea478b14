"""Any number of readings in a bounded memory: exact while they are few, else by lowest, highest and mean."""

from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array

#: Groups of neighbouring readings that are kept.
GROUPS = 8192
#: The latest readings, kept as they are.
LATEST = 1024


@dataclass(frozen=True, eq=False)
class Groups:
    """Neighbouring readings by groups of equal size; the last one may be smaller.

    Attributes:
        size: readings in a group; 1: each by itself.
        low, high, mean: shape (channels, groups); NaN where a group has no value of a channel.
    """

    size: int
    low: Array
    high: Array
    mean: Array

    def __len__(self) -> int:
        return int(self.mean.shape[1])


class Envelope:
    """The readings of a run: at most GROUPS groups, whose size doubles when there are more, and the latest as they are.

    Memory is the same for a thousand readings and for ten hours of them.

    Args:
        channels: how many columns a reading has.
    """

    def __init__(self, channels: int, groups: int = GROUPS) -> None:
        self.channels, self.count, self.size = channels, 0, 1
        self._most = groups
        self._full = 0  # groups that are complete
        self._low, self._high, self._sum = (np.full((channels, groups), np.nan) for _ in range(3))
        self._known = np.zeros((channels, groups))  # values in each group
        self._rest = np.empty((0, channels))  # readings of the group that is not complete yet
        self._latest = np.empty((0, channels))

    def add(self, rows: Array) -> None:
        """Take in readings, shape (n, channels); NaN for a value that is missing."""
        self.count += len(rows)
        self._latest = np.concatenate([self._latest, rows])[-LATEST:]
        rows = np.concatenate([self._rest, rows])
        while len(rows) >= self.size:
            room = self._most - self._full
            if room == 0:
                self._halve()
                continue
            complete = min(len(rows) // self.size, room)
            self._store(rows[: complete * self.size], complete)
            rows = rows[complete * self.size :]
        self._rest = rows.copy()

    def _store(self, rows: Array, groups: int) -> None:
        place = slice(self._full, self._full + groups)
        low, high, total, known = _of_groups(rows.reshape(groups, self.size, self.channels))
        self._low[:, place], self._high[:, place], self._sum[:, place], self._known[:, place] = low, high, total, known
        self._full += groups

    def _halve(self) -> None:
        """Join neighbours; an odd last group goes back to the readings that are not complete, as its mean would."""
        half = self._full // 2
        for array, join in ((self._low, np.fmin), (self._high, np.fmax), (self._sum, np.add), (self._known, np.add)):
            array[:, :half] = join(array[:, 0 : 2 * half : 2], array[:, 1 : 2 * half : 2])
        self._full, self.size = half, 2 * self.size

    def groups(self) -> Groups:
        """Return all readings so far, the incomplete group too."""
        low, high, total, known = (array[:, : self._full] for array in (self._low, self._high, self._sum, self._known))
        if len(self._rest):
            last = _of_groups(self._rest[None])
            low, high, total, known = (
                np.concatenate([a, b], axis=1) for a, b in zip((low, high, total, known), last, strict=True)
            )
        mean = np.divide(total, known, out=np.full(total.shape, np.nan), where=known > 0)
        return Groups(self.size, low.copy(), high.copy(), mean)

    def latest(self, n: int = LATEST) -> Groups:
        """Return the last readings as they are, at most LATEST."""
        values = self._latest[-n:].T.copy()
        return Groups(1, values, values, values)


def _of_groups(rows: Array) -> tuple[Array, Array, Array, Array]:
    """Return lowest, highest, sum, number of known values, (channels, groups), of rows (groups, size, channels)."""
    known = ~np.isnan(rows)
    return (
        np.fmin.reduce(rows, axis=1).T,
        np.fmax.reduce(rows, axis=1).T,
        np.where(known, rows, 0.0).sum(axis=1).T,
        known.sum(axis=1).T.astype(np.float64),
    )


def by_columns(x: Array, low: Array, high: Array, columns: int) -> tuple[Array, Array, Array]:
    """Return the lowest and the highest value in each column of a picture.

    Args:
        x: where the values stand, shape (n,), not decreasing.
        low: their lowest values, shape (n,).
        high: their highest values, shape (n,).
        columns: across the picture.

    Returns:
        The middle of each column that has values, and its lowest and highest.
    """
    if len(x) <= 2 * columns or not x[-1] > x[0]:
        return x, low, high
    column = np.minimum(((x - x[0]) * (columns / (x[-1] - x[0]))).astype(np.intp), columns - 1)
    begin = np.flatnonzero(np.diff(column, prepend=-1))
    middle = x[0] + (column[begin] + 0.5) * ((x[-1] - x[0]) / columns)
    return middle, np.fmin.reduceat(low, begin), np.fmax.reduceat(high, begin)
