"""A long record in windows: frequency against time, with the turns counted through the whole record."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.arrays import Array
from analysis.errors import NotPositive
from analysis.pulses.errors import OnlyHum, TooFewPulses
from analysis.pulses.regression import median
from analysis.pulses.result import Finding, SpinFrequency
from analysis.pulses.times import FEWEST, check_times, spin_of_times
from analysis.pulses.trace import Choice, spin_of_trace

#: Length of a window [s], unless given: sixty turns of a Levitron, in which its slope changes by less than 1 %.
WINDOW = 2.0
#: Turns between two windows are certain where their number is known to this, as a standard uncertainty [turns].
CERTAIN = 0.1
#: Natural logarithm of the ratio of neighbouring frequencies that no drag and no drive of 2 s makes: 20 %.
UNLIKE = 0.18


def collect_findings(of_each: Mapping[int, Iterable[Finding]], number: int) -> tuple[Finding, ...]:
    """Return the findings of windows or records, each kind once, with the first one that has it.

    of_each: number of the window or record, from 1 on → its findings; number: of them in all.
    """
    first: dict[tuple[str, str], Finding] = {}
    having: dict[tuple[str, str], set[int]] = {}
    for k, findings in of_each.items():
        for one in findings:
            first.setdefault((one.name, one.of), one)
            having.setdefault((one.name, one.of), set()).add(k)
    if number == 1:
        return tuple(first.values())
    return tuple(replace(one, where=(min(having[kind]), len(having[kind]), number)) for kind, one in first.items())


@dataclass(frozen=True, eq=False)
class Track:
    """Frequency against time; all arrays of shape (m,), one value for each window in which there are pulses.

    Attributes:
        time: where frequency and slope are independent [s], about the middle of the window.
        frequency: [Hz].
        u: its standard uncertainty [Hz].
        chirp: its slope [Hz/s].
        chirp_u: standard uncertainty of that [Hz/s].
        turns: turns since the first window, counted through as long as `connected` holds.
        connected: whether the number of turns since the window before is certain; the first is not.
        pulses: used in each window.
        spins: what was found in each window.
        empty: (start, end) of windows without pulses [s].
    """

    time: Array
    frequency: Array
    u: Array
    chirp: Array
    chirp_u: Array
    turns: Array
    connected: NDArray[np.bool_]
    pulses: NDArray[np.int64]
    spins: tuple[SpinFrequency, ...]
    empty: tuple[tuple[float, float], ...]

    @property
    def notes(self) -> tuple[Finding, ...]:
        """Findings of the windows, each name once."""
        findings = collect_findings({k: spin.notes for k, spin in enumerate(self.spins, 1)}, len(self.spins))
        ratio = self.frequency[1:] / self.frequency[:-1]
        if (unlike := np.flatnonzero(np.abs(np.log(ratio)) > UNLIKE)).size:
            seen = (value for i in (unlike[0], unlike[0] + 1) for value in (self.frequency[i], self.time[i]))
            findings = (*findings, Finding("unlike", values=(*map(float, seen), unlike.size)))
        return findings


def track_of_times(pulse_times: ArrayLike, *, window: float = WINDOW, interval_step: float = 0.0) -> Track:
    """Follow the frequency through a long list of pulse times.

    Args:
        pulse_times: shape (n,), increasing [s].
        window: length of a window [s].
        interval_step: as of `spin_of_times`.

    Raises:
        TooFewPulses: no window has enough of them.
        NotFinite, TimesNotIncreasing, ShapesDiffer, NotPositive.
    """
    t = check_times(pulse_times)
    spins = _in_windows(t, window, lambda inside: spin_of_times(t[inside], interval_step=interval_step))
    return _connect(spins, t.size, float(t[-1] - t[0]))


def track_of_samples(samples: ArrayLike, times: ArrayLike, *, window: float = WINDOW, method: Choice = "auto") -> Track:
    """Follow the frequency through a long trace whose samples are uneven.

    Args:
        samples: shape (n,).
        times: of them, shape (n,), not decreasing [s].
        window: length of a window [s].
        method: as of `spin_of_trace`.

    Raises:
        TooFewPulses: no window has enough of them.
        NotFinite, TimesNotIncreasing, ShapesDiffer, NotPositive.
    """
    x, t = np.asarray(samples, dtype=np.float64), check_times(times, increasing=False)

    def spin(inside: slice) -> SpinFrequency:
        return spin_of_trace(x[inside], usual_rate(t[inside]), times=t[inside], method=method)

    return _connect(_in_windows(t, window, spin), 0, float(t[-1] - t[0]))


def _in_windows(
    t: Array, window: float, spin: Callable[[slice], SpinFrequency]
) -> Iterator[SpinFrequency | tuple[float, float]]:
    """Yield the spin in each window of some times, or from when to when there are hardly any pulses or samples."""
    _check_window(window)
    ends = np.linspace(t[0], t[-1], max(round((t[-1] - t[0]) / window), 1) + 1)
    cuts = np.searchsorted(t, ends)
    cuts[-1] = t.size
    for i, inside in enumerate(map(slice, cuts[:-1], cuts[1:])):
        try:
            yield spin(inside)
        except (TooFewPulses, NotPositive):
            yield float(ends[i]), float(ends[i + 1])


def usual_rate(times: Array) -> float:
    """Return samples per second of uneven times, shape (n,) [1/s]; 0 where there are none."""
    apart = np.diff(times)
    usual = median(apart) or float(apart.mean()) if apart.size else 0.0
    return 1 / usual if usual else 0.0


def track_of_blocks(
    blocks: Iterable[ArrayLike], rate: float, *, start: float = 0.0, window: float = WINDOW, method: Choice = "auto"
) -> Track:
    """Follow the frequency through a long trace that comes in blocks, of which one window at a time is held.

    Args:
        blocks: each of shape (n,), any lengths, one after the other without a gap; a file read in pieces, for example.
        rate: samples per second.
        start: time of the first sample [s].
        window: length of a window [s].
        method: as of `spin_of_trace`.

    Raises:
        TooFewPulses: no window has enough of them.
        NotPositive, ShapesDiffer.
    """
    if not (math.isfinite(rate) and rate > 0):
        raise NotPositive(quantity="sample rate", unit="1/s", index=0, value=rate)
    _check_window(window)
    size = max(round(window * rate), 16)
    total, hum = 0, False

    def spins() -> Iterator[SpinFrequency | tuple[float, float]]:
        nonlocal total, hum
        for piece in _pieces(blocks, size):
            begin = start + total / rate
            total += piece.size
            try:
                yield spin_of_trace(piece, rate, start=begin, method=method)
            except TooFewPulses as error:
                hum = hum or isinstance(error, OnlyHum)
                yield begin, start + total / rate

    try:
        return _connect(spins(), 0, size / rate)
    except TooFewPulses as error:
        if hum:
            raise OnlyHum(seen=error.seen, needed=error.needed, duration=error.duration) from None
        raise


def _pieces(blocks: Iterable[ArrayLike], size: int) -> Iterator[Array]:
    """Yield the same samples in pieces of one size; the last has up to one and a half."""
    held: list[Array] = []
    count = 0
    for block in blocks:
        held.append(np.asarray(block, dtype=np.float64).ravel())
        count += held[-1].size
        if count >= 2 * size:
            joined = np.concatenate(held)
            whole = (count - size) // size * size
            for first in range(0, whole, size):
                yield joined[first : first + size]
            held, count = [joined[whole:]], count - whole
    if count:
        joined = np.concatenate(held)
        if count > 1.5 * size:
            yield joined[:size]
            joined = joined[size:]
        yield joined


def _check_window(window: float) -> None:
    if not (math.isfinite(window) and window > 0):
        raise NotPositive(quantity="window", unit="s", index=0, value=window)


def _connect(found: Iterable[SpinFrequency | tuple[float, float]], seen: int, duration: float) -> Track:
    spins: list[SpinFrequency] = []
    empty: list[tuple[float, float]] = []
    for each in found:
        if isinstance(each, SpinFrequency):
            spins.append(each)
        elif empty and empty[-1][1] == each[0]:
            empty[-1] = empty[-1][0], each[1]
        else:
            empty.append(each)
    if not spins:
        raise TooFewPulses(seen=seen, needed=FEWEST, duration=duration)
    numbers = np.array(
        [
            (s.reference_time, s.frequency.value, s.frequency.u, s.chirp.value, s.chirp.u, s.phase.value, s.phase.u)
            for s in spins
        ],
        dtype=np.float64,
    )
    time, frequency, u, chirp, chirp_u, phase, phase_u = numbers.T
    step = np.diff(time)
    # the mean of two parabolas, each from one side: exact for a third degree
    ahead = 0.5 * (frequency[1:] + frequency[:-1]) * step + (chirp[:-1] - chirp[1:]) * step**2 / 12
    ahead_u = np.sqrt(
        (u[1:] ** 2 + u[:-1] ** 2) * step**2 / 4
        + (chirp_u[1:] ** 2 + chirp_u[:-1] ** 2) * step**4 / 144
        + phase_u[1:] ** 2
        + phase_u[:-1] ** 2
    )
    fraction = np.diff(phase)
    off = ahead - fraction - np.rint(ahead - fraction)
    sound = np.array([spin.jump is None for spin in spins[:-1]], dtype=bool)
    certain = sound & (ahead_u < CERTAIN) & (np.abs(off) < 0.25)
    turns = phase[0] + np.concatenate([[0.0], np.cumsum(np.rint(ahead - fraction) + fraction)])
    return Track(
        time, frequency, u, chirp, chirp_u, turns, np.concatenate([[False], certain]),
        np.array([s.pulses for s in spins]), tuple(spins), tuple(empty),
    )  # fmt: skip
