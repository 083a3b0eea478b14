"""Readings of a spin-down, checked, and in the dimensionless numbers that fits work with."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.arrays import Array
from analysis.checks import check_finite, check_increasing, check_positive
from analysis.errors import AnalysisError, ShapesDiffer, TooFewReadings

FEWEST = 3


class NoSpinDown(AnalysisError):
    """A spin that does not fall: first and last are medians of the first and last third [Hz]."""

    def __init__(self, *, first: float, last: float) -> None:
        self.first, self.last = first, last
        super().__init__(
            "the spin goes from {first:.6g} Hz to {last:.6g} Hz (medians of the first and last third of the readings), "
            "a falling spin was expected"
        )


@dataclass(frozen=True, eq=False)
class Readings:
    """Spin frequency against time.

    Attributes:
        time: shape (n,), increasing [s].
        frequency: shape (n,), above 0 [Hz].
        u: standard uncertainties of the frequencies, shape (n,) [Hz]; None: unknown.
        start_time: of the run [s].
        reference_hz: unit of spin frequency [Hz].
        duration: unit of time [s].
        tau: time since the start in units of `duration`.
        x: frequency in units of `reference_hz`.
        weight: 1/u in the same units, one and the same where u is unknown.
    """

    time: Array
    frequency: Array
    u: Array | None
    start_time: float
    reference_hz: float
    duration: float
    tau: Array
    x: Array
    weight: Array | float

    def __len__(self) -> int:
        return len(self.time)

    @property
    def sigma_known(self) -> bool:
        """Whether the uncertainties were given."""
        return self.u is not None

    def means(self, most: int) -> "Readings":
        """Return at most `most` means over neighbours, each with its u; the readings themselves where they are fewer.

        Neighbours count as independent here: what they are not shows in the scatter of the means.
        """
        size = -(-len(self) // most)
        if size == 1:
            return self
        starts = np.arange(0, len(self), size)
        counts = np.diff(np.append(starts, len(self)))

        def mean(values: Array) -> Array:
            return np.asarray(np.add.reduceat(values, starts) / counts)

        weight = np.broadcast_to(self.weight, self.x.shape)
        return replace(
            self,
            time=mean(self.time),
            frequency=mean(self.frequency),
            u=None if self.u is None else np.sqrt(mean(self.u**2) / counts),
            tau=mean(self.tau),
            x=mean(self.x),
            weight=np.sqrt(counts / mean(weight**-2.0)),
        )

    def without(self, left_out: NDArray[np.intp]) -> "Readings":
        """Return the same readings, some left out; start and units stay."""
        keep = np.ones(len(self), dtype=bool)
        keep[left_out] = False
        return Readings(
            time=self.time[keep],
            frequency=self.frequency[keep],
            u=None if self.u is None else self.u[keep],
            start_time=self.start_time,
            reference_hz=self.reference_hz,
            duration=self.duration,
            tau=self.tau[keep],
            x=self.x[keep],
            weight=self.weight[keep] if isinstance(self.weight, np.ndarray) else self.weight,
        )


def check_readings(time: ArrayLike, frequency: ArrayLike, u: ArrayLike | None) -> Readings:
    """Return readings that a spin-down can be fitted to.

    Raises:
        ShapesDiffer, TooFewReadings, NotFinite, TimesNotIncreasing, NotPositive: as they say.
        NoSpinDown: the spin does not fall.
    """
    t = _column("time", time, None)
    if len(t) < FEWEST:
        raise TooFewReadings(seen=len(t), needed=FEWEST)
    f = _column("spin frequency", frequency, len(t))
    sigma = _column("standard uncertainty", 1.0 if u is None else u, len(t), spread=True)
    for quantity, column in (("time", t), ("spin frequency", f), ("standard uncertainty", sigma)):
        check_finite(quantity, column)
    check_increasing(t)
    for quantity, column in (("spin frequency", f), ("standard uncertainty", sigma)):
        check_positive(quantity, column)
    must_fall(f)
    reference_hz, duration = float(np.exp(np.log(f).mean())), float(t[-1] - t[0])
    return Readings(
        time=t,
        frequency=f,
        u=None if u is None else sigma,
        start_time=float(t[0]),
        reference_hz=reference_hz,
        duration=duration,
        tau=(t - t[0]) / duration,
        x=f / reference_hz,
        weight=1.0 if u is None else reference_hz / sigma,
    )


def _column(quantity: str, values: ArrayLike, n: int | None, *, spread: bool = False) -> Array:
    """Return a column of its own, which cannot be changed: results must not change with the caller's array."""
    column = np.array(values, dtype=float)
    if spread and column.ndim == 0 and n is not None:
        column = np.full(n, column)
    if column.ndim != 1 or (n is not None and len(column) != n):
        raise ShapesDiffer(quantity=quantity, seen=column.shape, expected=(column.size if n is None else n,))
    column.flags.writeable = False
    return column


def must_fall(frequency: Array) -> None:
    """Refuse a frequency that does not fall, by medians of the first and last third: one miscount decides nothing."""
    third = -(-len(frequency) // 3)
    first, last = float(np.median(frequency[:third])), float(np.median(frequency[-third:]))
    if last >= first * (1 - 1e-12):
        raise NoSpinDown(first=first, last=last)
