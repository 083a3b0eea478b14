"""What holds from when on: a list in time, as cheap to look into when it is long."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from typing import Generic, TypeVar

import numpy as np

from analysis.arrays import Array

T = TypeVar("T")


#: Number of items that are dropped at once, because the items behind them in the list have to be moved.
_AT_ONCE = 1000


class Timeline(Generic[T]):
    """Items, each from its start [s] until the next.

    >>> history = Timeline(0.0, "a")
    >>> history.append(1.0, "b")
    >>> [(item, list(range(5))[part]) for item, part in history.pieces(np.array([-1.0, 0.5, 1.0, 1.5, 2.0]))]
    [('a', [0, 1]), ('b', [2, 3, 4])]
    """

    def __init__(self, start: float, item: T) -> None:
        self._starts, self._items = [start], [item]

    def __iter__(self) -> Iterator[T]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    @property
    def last(self) -> T:
        """The one that holds for ever, as far as is known."""
        return self._items[-1]

    def at(self, time: float) -> T:
        """Return the item that holds at this time; before all others the first."""
        return self._items[max(bisect_right(self._starts, time) - 1, 0)]

    def cut(self, time: float) -> None:
        """Drop what was to begin at this time or later."""
        k = bisect_left(self._starts, time)
        del self._starts[k:], self._items[k:]

    def append(self, start: float, item: T) -> None:
        """Let the item hold from this time on, which is no earlier than all others."""
        self._starts.append(start)
        self._items.append(item)

    def forget(self, before: float) -> None:
        """Drop what ended before this time [s]."""
        stale = bisect_right(self._starts, before) - 1
        if stale >= _AT_ONCE:
            del self._starts[:stale], self._items[:stale]

    def between(self, start: float, stop: float) -> Iterator[tuple[T, float]]:
        """Yield each item that holds at some time from start to stop, with the time at which it ends."""
        low, high = max(bisect_right(self._starts, start) - 1, 0), bisect_left(self._starts, stop)
        yield from zip(self._items[low:high], [*self._starts[low + 1 : high + 1], math.inf], strict=False)

    def pieces(self, times: Array) -> Iterator[tuple[T, slice]]:
        """Yield the items that hold at these times, shape (n,): an item and the slice of its times."""
        if not times.size:
            return
        low = max(bisect_right(self._starts, float(times.min())) - 1, 0)
        high = bisect_right(self._starts, float(times.max()))
        if high <= low + 1:  # mostly
            yield self._items[low], slice(0, times.size)
            return
        index = np.searchsorted(np.array(self._starts[low + 1 : high]), times, side="right")
        ends = [*(np.flatnonzero(np.diff(index)) + 1).tolist(), times.size]
        for begin, end in zip([0, *ends[:-1]], ends, strict=True):
            yield self._items[low + int(index[begin])], slice(begin, end)
