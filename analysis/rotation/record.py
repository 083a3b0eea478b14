"""A record of a magnetometer, and what is in it beside the line of the spin.

Offset, drift and slow swings are a cubic spline; mains and the two strongest other lines (precession, nutation) have
amplitudes that change as a parabola, so that their frequencies need not be known exactly.  All of these are linear:
they are eliminated from the normal equations, each with a wide prior, so that equal columns do no harm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.checks import check_finite, check_increasing
from analysis.errors import ShapesDiffer, TooFewReadings

#: Least number of samples, and least duration [s].
FEWEST, SHORTEST_S = 60, 0.5
#: Distance of the spline's knots [s]: it follows what is slower than about 2 Hz, as the top's swings at 0.5 to 1.2 Hz.
KNOTS_S = 0.25
#: A step of the times from this length on is a gap, which is no part of the sampling [s].
GAP_S = 0.5
#: Frequencies of the mains [Hz], wherever they appear at the sampling rate.
MAINS_HZ = (50.0, 60.0)
#: Weight of the prior of the amplitudes: they are below ten times the standard deviation of a sample, noise included.
PRIOR = 0.01


@dataclass(frozen=True, eq=False)
class Line:
    """A line: frequency at a record's middle [Hz] and slope [Hz/s]."""

    frequency: float
    chirp: float = 0.0

    def at(self, later: float) -> Line:
        """Return the same line at a middle that is later [s]."""
        return Line(self.frequency + later * self.chirp, self.chirp)


class Record:
    """Samples of one window, scaled.

    Attributes:
        late: times from their mean on, shape (n,) [s].
        half: half the duration [s].
        middle: mean of the times [s].
        rate: samples per second, without gaps.
        field: without its mean, over `unit`, shape (n, k).
        unit: standard deviation of the differences of neighbours over √2, the greatest of the axes [T].
        late_of_half: `late` over `half`, shape (n,); `powers` its powers 0 to 3, shape (n, 4).
        others: lines beside that of the spin.
        mains_hz: frequencies of the mains, which are the first of those [Hz].
    """

    def __init__(
        self, times: Array, field: Array, others: Sequence[Line] = (), *, mains_hz: tuple[float, ...] = MAINS_HZ
    ) -> None:
        from scipy.sparse import csr_array

        self.mains_hz = mains_hz
        self.middle = float(times.mean())
        self.late = times - self.middle
        self.half = 0.5 * float(times[-1] - times[0])
        self.rate = rate_of(times)
        self.unit = max(float(np.max(deviation(np.diff(field, axis=0)))) / np.sqrt(2), 1e-300)
        self.field = (field - field.mean(axis=0)) / self.unit
        self.late_of_half = x = self.late / self.half
        self.powers = np.stack([np.ones_like(x), x, x * x, x * x * x], axis=1)
        count = max(round(2 * self.half / KNOTS_S), 1)
        place = (self.late - self.late[0]) / (2 * self.half) * count
        first = np.minimum(place.astype(np.int64), count - 1)
        x = place - first
        y = 1 - x
        x2, y2 = x * x, y * y
        values = np.stack([y2 * y, 4 - 3 * x2 * (1 + y), 4 - 3 * y2 * (1 + x), x2 * x], axis=1) / 6
        columns = first[:, None] + np.arange(4)
        starts = np.arange(0, 4 * x.size + 1, 4)
        self._spline = csr_array((values.ravel(), columns.ravel(), starts), shape=(x.size, count + 3))
        self._transposed = self._spline.T
        self._factor = self._band(values, first, count + 3)
        self.add_lines(others)

    def at(self, times: Array) -> Record:
        """Return the same samples at other times."""
        return Record(times, self.field * self.unit, self.others_at(0.0), mains_hz=self.mains_hz)

    def others_at(self, later: float) -> list[Line]:
        """Return the lines beside spin and mains at a middle that is later [s]."""
        return [one.at(later) for one in self.others[len(self.mains_hz) :]]

    def _band(self, values: Array, first: NDArray[np.int64], size: int) -> Array:
        """Return the Cholesky factor of the spline's normal matrix, in banded form."""
        from scipy.linalg.lapack import dpbtrf

        band = np.zeros((4, size))
        for i in range(4):
            for j in range(i, 4):
                band[j - i] += np.bincount(first + i, values[:, i] * values[:, j], minlength=size)
        band[0] += 1e-9 * values.shape[0]  # a gap leaves splines without a sample
        return np.asarray(dpbtrf(band, lower=1)[0])

    def add_lines(self, lines: Sequence[Line]) -> None:
        """Add lines beside those of the mains."""
        self.others: tuple[Line, ...] = (*map(Line, self.mains_hz), *lines)
        frequency, chirp = np.array([(line.frequency, line.chirp) for line in self.others]).reshape(-1, 2).T
        angle = 2 * np.pi * self.late[:, None] * (frequency + 0.5 * chirp * self.late[:, None])
        wave, x = np.concatenate([np.cos(angle), np.sin(angle)], axis=1), self.late_of_half[:, None]
        self._lines = np.concatenate([wave, x * wave, x * x * wave], axis=1)
        self._fixed = np.concatenate([self._lines, self.field], axis=1)
        self._on_fixed, self._by_fixed = self._on_spline(self._fixed)
        gram = self._fixed.T @ self._fixed - self._on_fixed.T @ self._by_fixed
        q = self._lines.shape[1]
        normal = gram[:q, :q] + PRIOR * np.eye(q)
        self._normal = np.linalg.inv(normal)
        self._of_field = gram[:q, q:]
        self.squares = gram[q:, q:] - self._of_field.T @ self._normal @ self._of_field
        self.parameters = q + self._spline.shape[1]

    def _on_spline(self, columns: Array) -> tuple[Array, Array]:
        from scipy.linalg.lapack import dpbtrs  # scipy.linalg's own function checks for longer than this one solves

        on = np.asarray(self._transposed @ columns)
        return on, np.asarray(dpbtrs(self._factor, on, lower=1)[0])

    def project(self, columns: Array) -> tuple[Array, Array]:
        """Return the normal matrix of columns, shape (p, p), and their products with the field, shape (p, k).

        Both with all else eliminated.
        """
        on, by = self._on_spline(columns)
        cross = self._fixed.T @ columns - self._on_fixed.T @ by
        q = self._lines.shape[1]
        of_lines = cross[:q]
        solved = self._normal @ of_lines
        normal = columns.T @ columns - on.T @ by - of_lines.T @ solved
        return normal, (cross[q:] - self._of_field.T @ solved).T

    def rest(self, line: Array | float = 0.0) -> Array:
        """Return the field without all that is beside the line, and without the line itself, shape (n, k) [unit]."""
        field = self.field - line
        _, by = self._on_spline(field)
        q = self._lines.shape[1]
        lines = self._normal @ (self._lines.T @ field - self._on_fixed[:, :q].T @ by)
        return np.asarray(field - self._lines @ lines - self._spline @ (by - self._by_fixed[:, :q] @ lines))


def deviation(columns: Array) -> Array:
    """Return the root mean square of each column, shape (k,): `std` of columns of mean 0, five times as fast."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", columns, columns) / columns.shape[0]))


def rate_of(times: Array) -> float:
    """Return samples per second where there is no gap [1/s]."""
    steps = np.diff(times)
    even = steps[steps < GAP_S]
    return even.size / float(even.sum()) if even.any() else steps.size / float(steps.sum())


def read_samples(times: Any, field: Any) -> tuple[Array, Array]:
    """Return times, shape (n,) [s], and field, shape (n, k) [T], without samples that are no numbers.

    Raises:
        ShapesDiffer, NotFinite, TimesNotIncreasing, TooFewReadings.
    """
    t = np.asarray(times, dtype=np.float64)
    b = np.asarray(field, dtype=np.float64)
    b = b[:, None] if b.ndim == 1 else b
    if t.ndim != 1 or b.ndim != 2 or b.shape[0] != t.size or not 1 <= b.shape[1] <= 3:
        raise ShapesDiffer(quantity="the field", seen=b.shape, expected=(t.size, min(max(b.shape[-1], 1), 3)))
    check_finite("time", t)
    good = np.isfinite(b).all(axis=1)
    t, b = t[good], b[good]
    check_increasing(t, strictly=False)
    needed = FEWEST if t.size < 2 or t[-1] <= t[0] else max(FEWEST, round(SHORTEST_S * t.size / float(t[-1] - t[0])))
    if t.size < needed or t[-1] <= t[0]:
        raise TooFewReadings(seen=t.size, needed=needed)
    return t, b
