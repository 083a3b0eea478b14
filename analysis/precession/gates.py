"""The gates of a counter at one point of a sweep: the rate of the pulses, freed from the swing of a locked top.

A locked top swings about its drive like a pendulum, with a period of some seconds: gates in a row are not independent,
and their scatter over √n is up to three times the uncertainty of their mean.  The swing shifts the phase, so a gate
from b to e contains

    n = ν (e − b) + φ(e) − φ(b) + noise,  φ(t) = p cos 2πft + q sin 2πft  [turns]

periods.  Least squares give ν, p and q; f is where the residuals of both series, spin and laser, are smallest.  The
noise is that of the pulses at both ends of a gate: it is as large for a long gate as for a short one.

Source of the joint choice of f: Seber & Wild, Nonlinear Regression (1989), §2.1.5 (unknown scatters).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array

#: With fewer gates no swing is searched: rate, swing and its frequency are four numbers.
FEWEST = 7
#: Periods of the swing: in the series from this number on, in steps of this number; in a gate up to this number.
_LEAST_PERIODS, _STEP_PERIODS, _MOST_IN_A_GATE = 1.5, 0.1, 0.9
#: Gates times frequencies that are worked out at once, at most: a megabyte for each of the numbers in between.
_MOST_GATES_TIMES_FREQUENCIES = 40_000
#: A gate has miscounted if it is off by whole pulses to within this and by these standard deviations; at most this
#: share of the gates is left out.
_OF_A_PULSE, _STANDS_OUT, _MOST_WRONG = 0.25, 5.0, 0.25
#: A swing is clear if the scatter of a gate is less than this share of its size.
_CLEAR = 0.3
#: From this number of points on, their scatter is modelled as a power of the drive's frequency.
_FEWEST_POINTS = 5
#: A point keeps its own scatter if chance makes it so much larger than the common one with less than this probability.
_LARGER_P = 1e-3
#: The scatter is at least the rounding of the counts [turns].
_LEAST_SCATTER = 1e-7


@dataclass(frozen=True, eq=False)
class Gates:
    """The gates of a counter, shape (n,) each.

    Attributes:
        begin, end: of each gate [s].
        frequency: counted in it [Hz], NaN without a count.
    """

    begin: Array
    end: Array
    frequency: Array

    def __len__(self) -> int:
        return self.frequency.size

    @property
    def length(self) -> Array:
        """Length of each gate [s]."""
        return self.end - self.begin

    @property
    def periods(self) -> Array:
        """Number of periods in each gate."""
        return self.frequency * self.length

    def part(self, which: NDArray[np.bool_]) -> Gates:
        """Return some of the gates."""
        return Gates(self.begin[which], self.end[which], self.frequency[which])


@dataclass(frozen=True)
class Swing:
    """The phase of a locked top about its drive, size·cos 2πf(t − crest) [turns]; positive: ahead of the drive.

    Attributes:
        frequency: f [Hz].
        size: [turns].
        crest: time of the greatest lead [s].
    """

    frequency: float
    size: float
    crest: float


@dataclass(frozen=True)
class Rate:
    """The rate of the pulses at a point.

    Attributes:
        value: [Hz].
        scatter: standard deviation of the periods in a gate [turns].
        freedom: degrees of freedom of the scatter.
        per_scatter: u(value) over the scatter [Hz].
        swing: that the rate is freed from; None if none was searched.
        wrong: gates that are left out, each with its number of pulses too many.
        missing: gates without a count.
    """

    value: float
    scatter: float
    freedom: int
    per_scatter: float
    swing: Swing | None
    wrong: tuple[tuple[int, int], ...]
    missing: int

    @property
    def u(self) -> float:
        """Standard uncertainty from this point's own scatter [Hz]."""
        return self.scatter * self.per_scatter


def rates_at_point(spin: Gates, laser: Gates) -> tuple[Rate, Rate]:
    """Return the rates of the tape's and of the laser's pulses, counted one after the other at one drive.

    Args:
        spin: gates of the tape, at least three with a count.
        laser: gates of the laser, likewise.
    """
    series = (spin, laser)
    first = _swing_frequency([_with_count(gates) for gates in series])
    kept = [_without_miscounts(gates, first) for gates in series]
    frequency = _swing_frequency([gates for gates, _ in kept])
    rates = [_rate(gates, frequency, wrong, len(all_)) for (gates, wrong), all_ in zip(kept, series, strict=True)]
    return rates[0], rates[1]


def swing_of(gates: Gates) -> Swing | None:
    """Return the swing that the gates of one series show; None if there are few gates, or if it is not clear."""
    used = _with_count(gates)
    if len(used) <= FEWEST:
        return None
    rate = _rate(used, _swing_frequency([used]), (), len(used))
    return rate.swing if rate.swing and rate.scatter < _CLEAR * rate.swing.size else None


def shared_scatter(rates: Sequence[Rate], drive: Array) -> Array:
    """Return the scatter of a gate at each point of a sweep, from the gates of all points, shape (n,) [turns].

    One point has few gates.  A line weighted by the scatter of few gates would follow those points too closely whose
    gates agree by chance.  The scatter depends on the drive, for the wobble gets smaller with it and the nutation does
    not: it is modelled as a power of the frequency.  A point whose own scatter is larger, and not by chance, keeps it.

    Args:
        rates: of the points.
        drive: shape (n,) [Hz].
    """
    from scipy.special import chdtrc, digamma

    own = np.maximum([rate.scatter for rate in rates], _LEAST_SCATTER)
    freedom = np.array([rate.freedom for rate in rates], dtype=np.float64)
    if own.size < _FEWEST_POINTS or not np.ptp(drive) > 0:
        shared = np.full(own.size, math.sqrt(float(np.average(own**2, weights=freedom))))
    else:
        # the mean of log(χ²/dof) is digamma(dof/2) − log(dof/2), below 0; its variance is about 2/dof
        logs = np.log(own**2) - (digamma(freedom / 2) - np.log(freedom / 2))
        columns = np.column_stack([np.ones(own.size), np.log(drive / drive.mean())])
        root = np.sqrt(freedom / 2)
        found, *_ = np.linalg.lstsq(columns * root[:, None], logs * root, rcond=None)
        shared = np.exp(columns @ found / 2)
    return np.where(chdtrc(freedom, freedom * (own / shared) ** 2) < _LARGER_P, own, shared)


# --- one series ---


def _columns(gates: Gates, frequency: float | None) -> Array:
    """Return the periods of a gate by the rate and, with a frequency, by the swing, shape (n, 1) or (n, 3)."""
    if frequency is None:
        return gates.length[:, None]
    begin, end = (2 * np.pi * frequency * (times - gates.begin[0]) for times in (gates.begin, gates.end))
    return np.column_stack([gates.length, np.cos(end) - np.cos(begin), np.sin(end) - np.sin(begin)])


def _residual_sums(gates: Gates, frequencies: Array) -> Array:
    """Return Σ residual² with a swing of each of these frequencies, shape (f,) [turns²].

    By least squares as `numpy.linalg.lstsq` does it, with its limit for columns that depend on each other, but for all
    frequencies at once.
    """
    begin, end = (2 * np.pi * frequencies[:, None] * (times - gates.begin[0]) for times in (gates.begin, gates.end))
    length = np.broadcast_to(gates.length, begin.shape)
    columns = np.stack([length, np.cos(end) - np.cos(begin), np.sin(end) - np.sin(begin)], axis=-1)
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    limit = np.finfo(np.float64).eps * max(columns.shape[1:])
    basis *= (sizes > limit * sizes[:, :1])[:, None, :]
    rest = gates.periods - (basis @ (gates.periods @ basis)[:, :, None])[:, :, 0]
    return np.asarray(np.sum(rest**2, axis=1))


def _swing_frequency(series: Sequence[Gates]) -> float | None:
    """Return the swing's frequency, at which Σ n log(residual²) of the series is least [Hz]; None if all are short.

    Each series has a scatter of its own.
    """
    series = [gates for gates in series if len(gates) >= FEWEST]
    if not series:
        return None
    span = max(float(gates.end[-1] - gates.begin[0]) for gates in series)
    most = _MOST_IN_A_GATE / max(float(gates.length.mean()) for gates in series)
    tried = np.arange(_LEAST_PERIODS / span, most, _STEP_PERIODS / span)
    least = _LEAST_SCATTER**2
    if not tried.size:
        return None
    totals = np.zeros(tried.size)
    for gates in series:
        pieces = np.array_split(tried, 1 + tried.size * len(gates) // _MOST_GATES_TIMES_FREQUENCIES)
        totals += len(gates) * np.log(np.concatenate([_residual_sums(gates, piece) for piece in pieces]) + least)
    return float(tried[int(np.argmin(totals))])


def _rate(gates: Gates, frequency: float | None, wrong: tuple[tuple[int, int], ...], count: int) -> Rate:
    frequency = frequency if len(gates) >= FEWEST else None
    columns = _columns(gates, frequency)
    found, *_ = np.linalg.lstsq(columns, gates.periods, rcond=None)
    freedom = len(gates) - columns.shape[1]
    scatter = math.sqrt(float(np.sum((gates.periods - columns @ found) ** 2)) / freedom)
    swing = None
    if frequency is not None:
        cosine, sine = found[1:].tolist()
        crest = float(gates.begin[0]) + math.atan2(sine, cosine) / (2 * math.pi * frequency)
        swing = Swing(frequency, math.hypot(cosine, sine), crest)
    per_scatter = math.sqrt(float(np.linalg.pinv(columns.T @ columns)[0, 0]))
    return Rate(float(found[0]), scatter, freedom, per_scatter, swing, wrong, missing=count - len(gates) - len(wrong))


def _with_count(gates: Gates) -> Gates:
    """Return the gates that have a count."""
    return gates.part(np.isfinite(gates.frequency))


def _without_miscounts(gates: Gates, frequency: float | None) -> tuple[Gates, tuple[tuple[int, int], ...]]:
    """Separate the gates that counted whole pulses too many or too few.

    One after the other, the gate is removed without which the others fit best.

    Args:
        gates: of a series.
        frequency: of the swing [Hz].

    Returns:
        The other gates; of each miscount its index and the pulses too many.
    """
    place = np.flatnonzero(np.isfinite(gates.frequency))
    used, most = _with_count(gates), int(_MOST_WRONG * len(gates))
    wrong: list[tuple[int, int]] = []
    while len(wrong) < most and len(used) > FEWEST:
        columns = _columns(used, frequency)
        orthonormal, _ = np.linalg.qr(columns)
        alone = 1 - np.sum(orthonormal**2, axis=1)  # 1 − leverage
        left = used.periods - orthonormal @ (orthonormal.T @ used.periods)
        gains = left**2 / alone
        k = int(np.argmax(gains))
        off = float(left[k] / alone[k])  # from the fit of the others
        pulses = round(off)
        freedom = len(used) - 1 - columns.shape[1]
        scatter = math.sqrt(max(float(np.sum(left**2) - gains[k]), 0.0) / freedom / float(alone[k]))
        if not pulses or abs(off - pulses) > _OF_A_PULSE or abs(off) < _STANDS_OUT * scatter:
            break
        wrong.append((int(place[k]), pulses))
        place, used = np.delete(place, k), used.part(np.arange(len(used)) != k)
    return used, tuple(sorted(wrong))


def whole_counts(gates: Gates, expected: float) -> int:
    """Return how many pulses too many, or too few, every gate of a point has; 0 if another rate explains it better.

    Gates differ in length: a rate that is off changes a long gate by more pulses than a short one, a miscount changes
    all by the same number.

    Args:
        gates: at a point.
        expected: its rate by the line through the other points [Hz].
    """
    some = _with_count(gates)
    off = some.periods - expected * some.length
    mean = float(off.mean())
    rate = float(np.sum(off * some.length) / np.sum(some.length**2))
    as_counts = float(np.sum((off - mean) ** 2))
    as_rate = float(np.sum((off - rate * some.length) ** 2))
    pulses = round(mean)
    return pulses if pulses and abs(mean - pulses) < _OF_A_PULSE and as_counts < as_rate else 0
