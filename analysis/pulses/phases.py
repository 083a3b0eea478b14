"""A record cut into its phases: speeding up, held, coasting, nothing."""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from analysis.arrays import Array

Kind = Literal["speeding-up", "held", "coasting", "nothing"]

#: A frequency that changes by less than this part of itself in a second is held; a top that coasts loses 3e-3.
STILL = 6e-4
#: Number of neighbouring windows that a slope is taken from.
NEIGHBOURS = 3
#: A phase of fewer windows belongs to the one before.
SHORTEST = 2


class Windows(Protocol):
    """Frequency against time [s], [Hz], [Hz/s], arrays of shape (m,), and (start, end) of times without one [s]."""

    @property
    def time(self) -> Array:
        """Of each window."""

    @property
    def frequency(self) -> Array:
        """At these times."""

    @property
    def chirp(self) -> Array:
        """Its slope there."""

    @property
    def empty(self) -> tuple[tuple[float, float], ...]:
        """Times without a frequency."""


@dataclass(frozen=True)
class Phase:
    """What the top did from start to end [s], and between which windows of the track (first, last + 1)."""

    kind: Kind
    start: float
    end: float
    windows: tuple[int, int]


def phases(track: Windows) -> tuple[Phase, ...]:
    """Cut a track of `track_of_times` or `track_of_blocks`, or of a magnetometer, into phases."""
    kinds = _kinds(track)
    found: list[Phase] = []
    first = 0
    for i in range(1, len(kinds) + 1):
        if i == len(kinds) or kinds[i] != kinds[first] or _gap_before(track, i):
            found.append(Phase(kinds[first], _edge(track, first, -1), _edge(track, i - 1, 1), (first, i)))
            first = i
    for start, end in track.empty:
        at = int(np.searchsorted(track.time, start))
        found.append(Phase("nothing", start, end, (at, at)))
    return tuple(_extend_to_gaps(sorted(found, key=lambda phase: phase.start)))


def _kinds(track: Windows) -> list[Kind]:
    slope = np.array([_slope(track, i) for i in range(track.time.size)]) / track.frequency
    kinds: list[Kind] = ["speeding-up" if s > STILL else "coasting" if s < -STILL else "held" for s in slope]
    first = 0
    while first < len(kinds):
        end = first
        while end < len(kinds) and kinds[end] == kinds[first]:
            end += 1
        if end - first < SHORTEST and first > 0:
            kinds[first:end] = [kinds[first - 1]] * (end - first)
        first = end
    return kinds


def _slope(track: Windows, i: int) -> float:
    """Return the slope of the frequency at a window from its neighbours [Hz/s]."""
    reach = NEIGHBOURS // 2
    near = np.arange(max(i - reach, 0), min(i + reach + 1, track.time.size))
    if near.size < 2:
        return float(track.chirp[i])
    away = track.time[near] - track.time[near].mean()
    return float(away @ track.frequency[near] / (away @ away))


def _gap_before(track: Windows, i: int) -> bool:
    return any(track.time[i - 1] < start < track.time[i] for start, _ in track.empty)


def _edge(track: Windows, i: int, side: int) -> float:
    """Return the time half-way to the next window, or as far beyond the last one."""
    j = i + side
    if 0 <= j < track.time.size:
        return float(0.5 * (track.time[i] + track.time[j]))
    if track.time.size == 1:
        return float(track.time[0])
    back = track.time[i] - track.time[i - side]
    return float(track.time[i] + 0.5 * back)


def _extend_to_gaps(found: list[Phase]) -> list[Phase]:
    """Make phases end where an empty time begins."""
    result = []
    for i, phase in enumerate(found):
        start, end = phase.start, phase.end
        if phase.kind != "nothing":
            if i and found[i - 1].kind == "nothing":
                start = found[i - 1].end
            if i + 1 < len(found) and found[i + 1].kind == "nothing":
                end = found[i + 1].start
        result.append(Phase(phase.kind, start, end, phase.windows))
    return result
