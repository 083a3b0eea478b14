"""Limits of the spin: where a top falls or is lost, from one top to the next, and against what theory says.

Sources: JCGM 100:2008 (GUM) §4.2 for mean, scatter and standard error; Grubbs, Technometrics 11, 1 (1969) for outliers;
Simon, Heflinger & Ridgway, Am. J. Phys. 65, 286 (1997) for the linear window.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError, NotFinite, NotPositive, TooFewReadings
from analysis.uncertainty import Estimate

if TYPE_CHECKING:
    from collections.abc import Sequence

Array = NDArray[np.float64]

#: Repetitions below which nothing is said of a scatter, and below which nothing is said of outliers and a trend.
FEWEST, FEWEST_FOR_SHAPE = 2, 5
#: Probability by chance below which a repetition is an outlier, and the repetitions drift.
OUTLIER_P, TREND_P = 0.01, 0.01
#: A difference that chance alone makes less often than this is one.
AGREES_P = 0.05


# --- one fall ---

#: Readings before the fall that a line is drawn through [s]: in ν^(−1/2), which is straight under the drag of a disc;
#: under Stokes's or Newton's it bends by 1 mHz in that time.
_LINE_S = 20.0


def spin_at_fall(times: Array, spins: Array, u: float | None, between: tuple[float, float]) -> Estimate:
    """The spin at which a free top fell, from a line through its last readings, continued to the fall [Hz].

    The lowest spin that is seen is too high by half the time between two readings, 0.06 Hz/s at 22 Hz.

    Args:
        times: of the readings, increasing, shape (n,) [s].
        spins: readings, shape (n,) [Hz].
        u: standard uncertainty of a reading [Hz]; None: from their scatter about the line.
        between: the top was still seen at the first of these times, and no more at the second [s].

    Returns:
        Value and u; u holds the line's and, as that of an even distribution, that of the moment.

    Raises:
        TooFewReadings: fewer than three.

    >>> t = np.arange(0.0, 20.0)
    >>> round(spin_at_fall(t, (0.2085 + 2.9e-4 * t) ** -2, 0.03, (19.0, 21.0)).value, 6)
    21.774874
    """
    if times.size < 3:
        raise TooFewReadings(seen=times.size, needed=3)
    low, high = between
    last = times >= min(times[-1] - _LINE_S, times[-3])
    t, y = times[last] - (low + high) / 2, spins[last] ** -0.5
    columns = np.column_stack([np.ones_like(t), t])
    (at_fall, slope), *_ = np.linalg.lstsq(columns, y, rcond=None)
    value = float(at_fall) ** -2
    per_hz = 2 * value**1.5  # dν = −2 ν^(3/2) dy
    if u is None:
        left = y - columns @ np.array([at_fall, slope])
        u = per_hz * float(np.sqrt(np.sum(left**2) / max(t.size - 2, 1)))
    of_line = u * math.sqrt(float(np.linalg.inv(columns.T @ columns)[0, 0]))
    of_moment = per_hz * abs(float(slope)) * (high - low) / math.sqrt(12)
    return Estimate(value, math.hypot(of_line, of_moment), "Hz")


# --- all of them ---


@dataclass(frozen=True)
class Statistics:
    """What the repetitions say together.

    Attributes:
        mean: with the standard error as its u [Hz].
        scatter: standard deviation from one repetition to the next, with its own u [Hz]; None of a single one.
        n: repetitions.
        trend: per repetition [Hz]; None of too few.
        trend_p: how probable so large a trend is by chance.
        outliers: numbers of those that chance would hardly put there, from 0; they stay in the statistics.
    """

    mean: Estimate
    scatter: Estimate | None
    n: int
    trend: Estimate | None
    trend_p: float | None
    outliers: tuple[int, ...]

    @property
    def drifts(self) -> bool:
        """Whether the limit goes up or down from one repetition to the next."""
        return self.trend_p is not None and self.trend_p < TREND_P


def summarize(limits: Array, u: Array | None = None) -> Statistics:
    """Mean, scatter, standard error, trend and outliers of repeated limits.

    The mean is not weighted: tops differ by more than their limits are uncertain.  Of a single one the u of the mean is
    its own.

    Args:
        limits: shape (n,) [Hz].
        u: their standard uncertainties, shape (n,) [Hz].

    Raises:
        TooFewReadings, NotFinite, NotPositive: for what cannot be limits.

    >>> thesis = np.array([21.7, 21.4, 21.7, 21.9, 21.8, 22.3, 21.8, 22.0, 22.1, 21.9])
    >>> found = summarize(thesis)
    >>> round(found.mean.value, 2), round(found.scatter.value, 2), round(found.mean.u, 2)
    (21.86, 0.25, 0.08)
    """
    n = limits.size
    if n == 0:
        raise TooFewReadings(seen=0, needed=1)
    for i, value in enumerate(limits.tolist()):
        if not math.isfinite(value):
            raise NotFinite(quantity="limit", index=i, value=value)
        if value <= 0:
            raise NotPositive(quantity="limit", unit="Hz", index=i, value=value)
    mean = float(limits.mean())
    if n < FEWEST:
        own = None if u is None else float(u[0])
        return Statistics(Estimate(mean, own, "Hz"), None, n, None, None, ())
    scatter = float(limits.std(ddof=1))
    spread = Estimate(scatter, scatter / math.sqrt(2 * (n - 1)), "Hz")  # GUM E.4.3
    trend, p = _trend(limits) if n >= FEWEST_FOR_SHAPE and scatter > 0 else (None, None)
    return Statistics(Estimate(mean, scatter / math.sqrt(n), "Hz"), spread, n, trend, p, outliers_of(limits))


def _trend(limits: Array) -> tuple[Estimate, float]:
    """Slope of a straight line through the limits by their number, and its p-value (Student's t)."""
    number = np.arange(limits.size) - (limits.size - 1) / 2
    square = float(number @ number)
    slope = float(number @ limits) / square
    left = limits - limits.mean() - slope * number
    u = math.sqrt(float(left @ left) / (limits.size - 2) / square)
    return Estimate(slope, u, "Hz"), 0.0 if u == 0 else _by_chance(slope / u, limits.size - 2)


def _by_chance(t: float, freedom: int) -> float:
    """How probable |t| or more is under Student's law."""
    from scipy.special import stdtr  # scipy.stats takes a second to load

    return float(2 * stdtr(freedom, -abs(t)))


def outliers_of(limits: Array) -> tuple[int, ...]:
    """Numbers of limits that do not belong to the others: Grubbs's test, two-sided, again without the one found.

    At most a third are looked for; of fewer than five none.
    """
    from scipy.special import stdtrit

    left = list(range(limits.size))
    found: list[int] = []
    while len(left) >= FEWEST_FOR_SHAPE and len(found) < limits.size // 3:
        values, n = limits[left], len(left)
        scatter = float(values.std(ddof=1))
        if scatter == 0:
            break
        off = np.abs(values - values.mean())
        worst = int(off.argmax())
        t2 = float(stdtrit(n - 2, OUTLIER_P / (2 * n))) ** 2
        if off[worst] / scatter <= (n - 1) / math.sqrt(n) * math.sqrt(t2 / (n - 2 + t2)):
            break
        found.append(left.pop(worst))
    return tuple(sorted(found))


# --- against theory ---


@dataclass(frozen=True)
class Comparison:
    """A mean beside a spin that theory names.

    Attributes:
        name: of what theory names.
        expected: its spin [Hz].
        difference: the mean minus it, with the standard error [Hz].
        p: how probable so large a difference is by chance (Student's t); None where the scatter is not known.
    """

    name: str
    expected: float
    difference: Estimate
    p: float | None

    @property
    def agrees(self) -> bool | None:
        """Whether chance explains the difference; None where that is not known."""
        return None if self.p is None else self.p >= AGREES_P


def compare(found: Statistics, name: str, expected: float) -> Comparison:
    """The mean of repeated limits beside a spin that theory names [Hz]."""
    assert found.mean.value is not None  # as summarized
    difference = found.mean.value - expected
    u = found.mean.u
    p = None
    if found.n >= FEWEST and u:
        p = _by_chance(difference / u, found.n - 1)
    return Comparison(name, expected, Estimate(difference, u, "Hz"), p)


class NoWindow(AnalysisError):
    """A top that no spin keeps up."""

    def __init__(self) -> None:
        super().__init__("no spin keeps this top up, so there is no window to compare with: another mass is expected")


def nearest_edge(mean: float, window: tuple[float, float]) -> str:
    """Whether a mean limit is a "lower" or an "upper" one: by the nearer edge of the window, in parts of it [Hz]."""
    low, high = window
    return "lower" if mean < math.sqrt(low * high) else "upper"


def spins_of_window(windows: Sequence[tuple[float, float]], spin: float) -> tuple[float, float]:
    """The window [Hz] that holds a spin, or whose edge is nearest to it.  Raises NoWindow."""
    if not windows:
        raise NoWindow
    return min(windows, key=lambda w: 0.0 if w[0] <= spin <= w[1] else min(abs(spin - w[0]), abs(spin - w[1])))
