"""Where the integration must stop: at samples, at kinks of the drive, and after 1000 steps at the latest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.errors import SimulationError
from levilab.simulator.scene import Drive

#: No times at all: the kinks of a drive that has none.
NO_TIMES: Array = np.empty(0)

#: Steps between stops, at most: they are repeated one by one to find the moment of an escape.
STEPS_BETWEEN_STOPS = 1000


@dataclass(frozen=True)
class Stops:
    """When the integrator stops, and the drive between the stops.

    Attributes:
        times: of the stops, shape (n + 1,) [s].
        counts: steps from each stop to the next, shape (n,).
        levels, slopes: of the drive in each interval, shape (n,); see below.
        states: of the motion at the first of the stops, shape (m, 18), where the stops were found by following it;
            fewer than n + 1 if it left the limits of the escape in the interval after them.
        memory: of a drive that the top triggers, at the last of these states, shape (5,).

    Within an interval the drive's field is (level + slope·t) × its carrier, or with bursts a sine of frequency level
    and phase slope; this is smooth: no step crosses a kink, so the order of the integrator is kept.
    """

    times: Array
    counts: NDArray[np.int64]
    levels: Array
    slopes: Array
    states: Array | None = None
    memory: Array | None = None

    def pieces(self, steps: int) -> Iterator[tuple[int, int]]:
        """Yield the first and last interval, exclusive, of successive pieces of about this number of steps each."""
        done = np.concatenate([[0], np.cumsum(self.counts)])
        first = 0
        while first < self.counts.size:
            last = max(int(np.searchsorted(done, done[first] + steps)), first + 1)
            yield first, min(last, self.counts.size)
            first = min(last, self.counts.size)

    def first_at(self, time: float) -> int:
        """Return the index of the first stop at this time [s] or after it, in the direction of the run."""
        found = np.searchsorted(abs(self.times - self.times[0]), abs(time - self.times[0]))
        return min(int(found), self.counts.size)

    def part(self, first: int, last: int) -> Stops:
        """Return the intervals from first to last, without the last."""
        return Stops(
            self.times[first : last + 1], self.counts[first:last], self.levels[first:last], self.slopes[first:last]
        )


def stop_after_each_step(stops: Stops) -> Stops:
    """Return the same steps with a stop after each of them."""
    lengths = np.diff(stops.times) / stops.counts
    index = np.repeat(np.arange(stops.counts.size), stops.counts)
    first = np.cumsum(stops.counts) - stops.counts
    inside = np.arange(index.size) - first[index]
    times = np.append(stops.times[:-1][index] + inside * lengths[index], stops.times[-1])
    return Stops(times, np.ones(index.size, dtype=np.int64), stops.levels[index], stops.slopes[index])


#: The most steps and kinks: more would take days, or the machine's memory.
MOST_STEPS, MOST_KINKS = 10**11, 10**7


def check_count(duration: float, step: float) -> None:
    """Raise SimulationError if a duration would take too many steps of this length [s]."""
    if not duration / step < MOST_STEPS:
        raise SimulationError(
            f"{duration / step:.2g} steps of {step:.2g} s would be needed, at most {MOST_STEPS:.0e} are taken: a "
            "shorter duration, a slower spin or heavier inertias are expected"
        )


def stops_between(start: float, end: float, step: float, drive: Drive, samples: Array | None = None) -> Stops:
    """Return the stops from one time to another.

    Args:
        start: the first stop [s].
        end: the last stop [s], before the start to go back in time.
        step: no step is longer [s].
        drive: no step crosses its kinks.
        samples: further stops [s]; those outside are left out.

    Raises:
        SimulationError: it would take too many steps, or the drive has too many kinks.
    """
    low, high = min(start, end), max(start, end)
    check_count(high - low, step)
    corners = kinks(drive, low, high)
    if corners is NO_TIMES and (samples is None or samples.size == 0):
        count = max(math.ceil((high - low) / step * (1 - 1e-12)), 1)
        if count <= STEPS_BETWEEN_STOPS:
            return Stops(np.array([start, end]), np.array([count]), np.ones(1), np.zeros(1))
    wanted = [np.array([low, high]), corners]
    if samples is not None:
        wanted.append(samples[(samples > low) & (samples < high)])
    times = _distinct(np.concatenate(wanted), (high - low) * 1e-12)
    lengths = times[1:] - times[:-1]
    if lengths.max() > step * STEPS_BETWEEN_STOPS:
        pieces = np.ceil(lengths / (step * STEPS_BETWEEN_STOPS)).astype(np.int64)
        cut = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(times, times[1:], pieces, strict=False)]
        times = np.concatenate([*cut, times[-1:]])
        lengths = times[1:] - times[:-1]
    if end < start:
        times, lengths = times[::-1].copy(), lengths[::-1]
    counts = np.maximum(np.ceil(lengths / step * (1 - 1e-12)), 1).astype(np.int64)
    levels, slopes = _shape(drive, (times[1:] + times[:-1]) / 2)
    return Stops(times, counts, levels, slopes)


def _distinct(times: Array, apart: float) -> Array:
    """Return the times sorted, without those less than `apart` [s] after another; the last one stays."""
    times = np.sort(times)
    kept = times[np.append(np.True_, times[1:] - times[:-1] > apart)]
    kept[-1] = times[-1]
    return np.asarray(kept)


def kinks(drive: Drive, low: float, high: float) -> Array:
    """Return the times strictly between low and high at which the drive's field jumps or bends, shape (n,) [s].

    Raises:
        SimulationError: there are too many.
    """
    if drive.waveform == "off" or (drive.waveform == "sine" and drive.off_s is None):
        return NO_TIMES
    found = [drive.off_s] if drive.off_s is not None and low < drive.off_s < high else []
    offset, first, last = corners(drive, low, high)
    turns = drive.phase_rad / (2 * math.pi)
    found.extend(((np.arange(first, last + 1) / 2 + offset - turns) / drive.frequency_hz).tolist())
    times = np.array(found, dtype=np.float64)
    return np.asarray(times[(times > low) & (times < high)])


def corners(drive: Drive, low: float, high: float) -> tuple[float, int, int]:
    """Return the phase of the corners of the drive's waveform [turns], and which half turns they are, first to last.

    Raises:
        SimulationError: there are too many.
    """
    offset = {"square": 0.0, "unipolar": 0.0, "triangle": 0.25}.get(drive.waveform)
    if offset is None or drive.amplitude_t == 0:
        return 0.0, 0, -1
    f, turns = drive.frequency_hz, drive.phase_rad / (2 * math.pi)
    first, last = math.ceil(2 * (f * low + turns - offset)), math.floor(2 * (f * high + turns - offset))
    if last - first > MOST_KINKS:
        raise SimulationError(
            f"drive.frequency_hz = {f:g}: the {drive.waveform} has {last - first} corners in {high - low:g} s, at "
            f"most {MOST_KINKS:.0e} are gone through: take a sine, a lower frequency or a shorter duration"
        )
    return offset, first, last


def _shape(drive: Drive, middles: Array) -> tuple[Array, Array]:
    """Return level and slope of the drive in each interval, given the intervals' middles [s]; shape (n,) each."""
    on = np.ones(middles.size) if drive.off_s is None else (middles < drive.off_s).astype(np.float64)
    if drive.waveform in {"off", "sine"}:
        return on, np.zeros(on.size)
    turns = drive.frequency_hz * middles + drive.phase_rad / (2 * math.pi)
    first_half = turns - np.floor(turns) < 0.5
    if drive.waveform == "square":
        return on * np.where(first_half, 1.0, -1.0), np.zeros_like(on)
    if drive.waveform == "unipolar":
        return on * first_half, np.zeros_like(on)
    rising = (turns + 0.25) - np.floor(turns + 0.25) < 0.5  # of the triangle
    slope = np.where(rising, 4.0, -4.0) * drive.frequency_hz
    # the value at the middle: 0 at whole turns, ±1 at the quarters
    value = 1 - 4 * np.abs((turns + 0.25) - np.floor(turns + 0.25) - 0.5)
    return on * (value - slope * middles), on * slope
