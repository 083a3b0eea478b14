"""Limits of the spin: where a top falls or is lost, from one top to the next, and against what theory says.

Sources: JCGM 100:2008 (GUM) §4.2 for mean, scatter and standard error, F.2.2.1 for steps; Widrow, Kollár & Liu, IEEE
Trans. Instrum. Meas. 45, 353 (1996) for how much of the error of a step repeated readings share; Paule & Mandel,
J. Res. NBS 87, 377 (1982) for the mean of runs that differ; Grubbs, Technometrics 11, 1 (1969) for outliers; Simon,
Heflinger & Ridgway, Am. J. Phys. 65, 286 (1997) for the linear window.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.arrays import Array
from analysis.checks import check_finite, check_positive
from analysis.comparison import scatter_between, u_of_between
from analysis.errors import AnalysisError, TooFewReadings
from analysis.uncertainty import ROUNDING, Estimate

#: Repetitions below which nothing is said of a scatter, and below which nothing is said of outliers and a trend.
FEWEST, FEWEST_FOR_SHAPE = 2, 5
#: Probability by chance below which a repetition is an outlier, and the repetitions drift.
OUTLIER_P, TREND_P = 0.01, 0.01
#: A difference that chance alone makes less often than this is one.
AGREES_P = 0.05


# --- one fall ---

#: Readings before the fall that a line is drawn through [s]: in ν^(−1/2), which is straight under the drag of a disc;
#: u contains its bend under Stokes's or Newton's.
_LINE_S = 20.0
#: The rest of the way of a top that levels off is added to its last count; u of it, as a part: the pull nears the drag
#: sooner or later than one that does not depend on the spin, in the same sense for all tops.
U_OF_WAY = 0.5
#: Fewest counts that a parabola, which bends with the gain of a driven top, is drawn through.
FEWEST_ON_PARABOLA = 6


def spin_at_fall(times: Array, spins: Array, u: float | None, between: tuple[float, float]) -> Estimate:
    """Return the spin at which a free top fell, from a line through its last readings, continued to the fall [Hz].

    The lowest spin that is seen is too high by half the time between two readings, 0.06 Hz/s at 22 Hz.

    Args:
        times: of the readings, increasing, shape (n,) [s].
        spins: readings, shape (n,) [Hz].
        u: standard uncertainty of a reading [Hz]; None: from their scatter about the line.
        between: the top was still seen at the first of these times, and no more at the second [s].

    Returns:
        Value and u; u holds the line's, that of the moment as of an even distribution, and that of the law of the drag.

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
    (at_fall, bent), (slope, _) = np.linalg.lstsq(columns, np.stack([y, t**2], axis=1), rcond=None)[0]
    value = float(at_fall) ** -2
    per_hz = 2 * value**1.5  # dν = −2 ν^(3/2) dy
    if u is None:
        left = y - columns @ np.array([at_fall, slope])
        u = per_hz * float(np.sqrt(np.sum(left**2) / max(t.size - 2, 1)))
    of_line = u * math.sqrt(float(np.linalg.inv(columns.T @ columns)[0, 0]))
    of_moment = per_hz * abs(float(slope)) * (high - low) / math.sqrt(12)
    # ν̇ ∝ ν^n with n from 1 to 2, evenly: ÿ = 2 (n − 3/2) ẏ²/y
    of_law = per_hz * abs(float(bent)) * float(slope) ** 2 / float(at_fall) / math.sqrt(12)
    return Estimate(value, math.hypot(of_line, of_moment, of_law), "Hz")


def spin_at_loss(times: Array, spins: Array, between: tuple[float, float]) -> Estimate:
    """Return the spin at which a top that a drive sped up was lost [Hz]; arguments and errors as of `spin_at_fall`.

    A parabola through the last counts: what the drag leaves of the pull becomes less on the way.
    """
    if times.size < FEWEST_ON_PARABOLA:
        raise TooFewReadings(seen=times.size, needed=FEWEST_ON_PARABOLA)
    low, high = between
    last = times >= min(times[-1] - _LINE_S, times[-FEWEST_ON_PARABOLA])
    t, y = times[last] - (low + high) / 2, spins[last]
    parabola, covariance = np.polyfit(t, y, 2, cov=True)
    of_moment = abs(float(parabola[1])) * (high - low) / math.sqrt(12)
    return Estimate(float(parabola[2]), math.hypot(math.sqrt(float(covariance[2, 2])), of_moment), "Hz")


# --- all of them ---


@dataclass(frozen=True, eq=False)
class Sample:
    """Limits of tops under the same conditions, in one run.

    Attributes:
        limits: shape (n,) [Hz].
        u: their standard uncertainties, shape (n,) [Hz]; None: not known.
        steps: each limit lies somewhere within a step of the drive of this width, shape (n,) [Hz], in the middle of
            which it is given; the steps are the same for all tops.  None: the drive made no steps.
        common: part of each u that is the same error in all limits, shape (n,) [Hz]; None: there is none.
    """

    limits: Array
    u: Array | None = None
    steps: Array | None = None
    common: Array | None = None

    @classmethod
    def within_steps(cls, limits: Array, u: Array) -> Sample:
        """Return limits that are known to a step of the drive each; u is the standard uncertainty, step/√12."""
        return cls(limits, u, u * math.sqrt(12))

    @property
    def step(self) -> float:
        """The width of a step [Hz], 0 where there was none."""
        return 0.0 if self.steps is None else math.sqrt(float(np.mean(self.steps**2)))

    @property
    def least(self) -> float:
        """Variance that the limits' own, independent uncertainties leave to their mean [Hz²]."""
        if self.u is None or self.steps is not None:
            return 0.0
        common = 0.0 if self.common is None else self.common
        return float(np.sum(self.u**2 - common**2)) / self.limits.size**2

    @property
    def shared(self) -> float:
        """Standard uncertainty of the mean from the common errors [Hz]."""
        return 0.0 if self.common is None else float(np.mean(self.common))


@dataclass(frozen=True)
class Statistics:
    """What the repetitions say together.

    Attributes:
        mean: with the standard error as its u [Hz].
        scatter: standard deviation from one repetition to the next, with its own u [Hz]; None of a single one.
        n: repetitions.
        trend: per repetition [Hz]; None of too few, and of several runs.
        trend_p: how probable so large a trend is by chance.
        outliers: numbers of those that chance would hardly put there, from 0; they stay in the statistics.
        step: the part of the standard error that the drive's steps leave, however many repetitions there are [Hz].
        freedom: degrees of freedom of the standard error; None where it does not rest on a scatter.
        runs: of how many runs.
        between: standard deviation of a run's mean from another's, beyond what their tops explain, with its u [Hz];
            None of one run, and of runs with a single repetition each, where it is part of the scatter.
        common: the part of the standard error that is the same error in all limits [Hz].
    """

    mean: Estimate
    scatter: Estimate | None
    n: int
    trend: Estimate | None
    trend_p: float | None
    outliers: tuple[int, ...]
    step: float = 0.0
    freedom: float | None = None
    runs: int = 1
    between: Estimate | None = None
    common: float = 0.0

    @property
    def drifts(self) -> bool:
        """Whether the limit goes up or down from one repetition to the next."""
        return self.trend_p is not None and self.trend_p < TREND_P


def summarize(sample: Sample) -> Statistics:
    """Return mean, scatter, standard error, trend and outliers of repeated limits.

    The mean is not weighted: tops differ by more than their limits are uncertain.  Its standard error is s/√n, no less
    than the limits' own uncertainties leave to it; where the drive made steps, with what these leave: tops that scatter
    by much less than a step all fall into the same one, and their mean is no better than its width over √12.  A common
    error stays as it is.  Of a single one the u of the mean is its own.

    Raises:
        TooFewReadings, NotFinite, NotPositive: for what cannot be limits.

    >>> thesis = np.array([21.7, 21.4, 21.7, 21.9, 21.8, 22.3, 21.8, 22.0, 22.1, 21.9])
    >>> found = summarize(Sample(thesis))
    >>> round(found.mean.value, 2), round(found.scatter.value, 2), round(found.mean.u, 2)
    (21.86, 0.25, 0.08)
    >>> found = summarize(Sample(np.full(10, 67.1), steps=np.full(10, 0.2)))
    >>> round(found.mean.u, 4), round(found.scatter.value, 4)
    (0.0577, 0.0)
    """
    limits, n = _check_limits(sample.limits), sample.limits.size
    mean = float(limits.mean())
    if n < FEWEST:
        own = None if sample.u is None else float(sample.u[0])
        step = sample.step / math.sqrt(12)
        return Statistics(Estimate(mean, own, "Hz"), None, n, None, None, (), step, common=sample.shared)
    scatter = _scatter(limits)
    by_scatter = scatter**2 / n
    step = _common_error(scatter, sample.step)
    variance = max(by_scatter, sample.least) + step**2 + sample.shared**2
    trend, p = _trend(limits) if n >= FEWEST_FOR_SHAPE and scatter > 0 else (None, None)
    return Statistics(
        mean=Estimate(mean, math.sqrt(variance), "Hz"),
        scatter=_with_own_u(scatter, n - 1),
        n=n,
        trend=trend,
        trend_p=p,
        outliers=outliers_of(limits),
        step=step,
        freedom=_freedom(variance, by_scatter, n - 1),
        common=sample.shared,
    )


def combine(runs: Sequence[Sample]) -> Statistics:
    """Return the same of several runs under the same conditions, which may still differ by more than their tops.

    A random-effects mean: all runs share one scatter s from top to top; a run of n tops has the variance τ² + s²/n and
    the weight of its inverse, where τ is the scatter between runs that makes χ² of the runs' means what is expected
    (Paule & Mandel).  Where the runs differ no more than their tops explain, τ is 0.

    Raises:
        TooFewReadings, NotFinite, NotPositive: for what cannot be limits.

    >>> early, late = np.array([60.1, 59.9, 60.0]), np.array([61.1, 60.9, 61.0])
    >>> found = combine([Sample(early), Sample(late)])
    >>> round(found.mean.value, 2), round(found.mean.u, 2), round(found.scatter.value, 2), round(found.between.value, 2)
    (60.5, 0.5, 0.1, 0.7)
    """
    limits = [_check_limits(run.limits) for run in runs]
    numbers = np.array([one.size for one in limits])
    within = int(numbers.sum()) - len(runs)
    if len(runs) == 1:
        return summarize(runs[0])
    if within == 0:
        columns = (
            [column for run in runs if (column := getattr(run, name)) is not None] for name in ("u", "steps", "common")
        )
        joined = (np.concatenate(column) if len(column) == len(runs) else None for column in columns)
        found = summarize(Sample(np.concatenate(limits), *joined))
        return replace(found, trend=None, trend_p=None, runs=len(runs))
    origin = limits[0][0]  # equal limits have equal means, not rounded ones
    means = origin + np.array([(one - origin).mean() for one in limits])
    square = sum((one.size - 1) * _scatter(one) ** 2 for one in limits if one.size > 1) / within
    own = np.maximum(square / numbers, [run.least for run in runs])
    differ = scatter_between(means, np.sqrt(own))
    between = differ**2
    weights = _weights(own + between)
    mean = float(weights @ means)
    by_scatter = float(weights**2 @ (own + between))
    step = _common_error(math.sqrt(square + between), math.sqrt(float(np.mean([run.step**2 for run in runs]))))
    common = float(weights @ [run.shared for run in runs])
    variance = by_scatter + step**2 + common**2
    first = np.cumsum(numbers) - numbers
    return Statistics(
        mean=Estimate(mean, math.sqrt(variance), "Hz"),
        scatter=_with_own_u(math.sqrt(square), within),
        n=int(numbers.sum()),
        trend=None,
        trend_p=None,
        outliers=tuple(int(start) + i for start, one in zip(first, limits, strict=True) for i in outliers_of(one)),
        step=step,
        freedom=_freedom(variance, by_scatter, len(runs) - 1 if between > 0 else within),
        runs=len(runs),
        between=Estimate(differ, u_of_between(means, np.sqrt(own)), "Hz"),
        common=common,
    )


def _check_limits(limits: Array) -> Array:
    if limits.size == 0:
        raise TooFewReadings(seen=0, needed=1)
    check_finite("limit", limits)
    check_positive("limit", limits)
    return limits


def _scatter(values: Array) -> float:
    """Return the standard deviation; 0 of values that differ by no more than rounding."""
    return _beyond_rounding(float(values.std(ddof=1)), values)


def _beyond_rounding(scatter: float, values: Array) -> float:
    """Return the scatter of values about a reference; 0 where rounding of the values makes it."""
    return scatter if scatter > ROUNDING * float(np.abs(values).max()) else 0.0


def _with_own_u(scatter: float, freedom: int) -> Estimate:
    """Return a standard deviation and its uncertainty (GUM E.4.3)."""
    return Estimate(scatter, scatter / math.sqrt(2 * freedom), "Hz")


def _freedom(variance: float, by_scatter: float, freedom: int) -> float | None:
    """Return the degrees of freedom of a variance that only partly comes from a scatter (GUM G.4)."""
    return None if by_scatter == 0 else freedom * (variance / by_scatter) ** 2


def _weights(variances: Array) -> Array:
    """Return inverse variances, of the sum 1; all equal where there is no variance at all."""
    if not (variances > 0).all():
        return np.full(variances.size, 1 / variances.size)
    inverse = variances.min() / variances
    return np.asarray(inverse / inverse.sum())


def _common_error(scatter: float, step: float) -> float:
    """Return the standard uncertainty of a mean from the drive's steps, which no number of limits lowers [Hz].

    A limit within a step is given as the middle of the step, wrong by step/√12.  Two tops share that error if they fall
    into the same step, and do not if they scatter over several: of tops with a true scatter σ its correlation is
    ρ = (6/π²) Σ exp(−4π²k²σ²/step²)/k², and the scatter that is seen has s² = σ² + (1 − ρ) step²/12.

    Args:
        scatter: that is seen, s [Hz].
        step: [Hz].
    """
    if step == 0:
        return 0.0
    wanted, low, high = (scatter / step) ** 2, 0.0, 0.5
    if wanted >= high + 1 / 12:  # ρ is 1e-9 there
        return 0.0
    k = np.arange(1, 200)

    def correlation(square: float) -> float:
        return float(6 / math.pi**2 * np.sum(np.exp(-4 * (math.pi * k) ** 2 * square) / k**2)) if square else 1.0

    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if middle + (1 - correlation(middle)) / 12 < wanted else (low, middle)
    return step * math.sqrt(correlation(low) / 12)


def _trend(limits: Array) -> tuple[Estimate, float]:
    """Return the slope of a straight line through the limits by their number, and its p-value (Student's t)."""
    number = np.arange(limits.size) - (limits.size - 1) / 2
    square = float(number @ number)
    slope = float(number @ limits) / square
    left = limits - limits.mean() - slope * number
    u = _beyond_rounding(math.sqrt(float(left @ left) / (limits.size - 2)), limits) / math.sqrt(square)
    return Estimate(slope, u, "Hz"), 0.0 if u == 0 else _by_chance(slope / u, limits.size - 2)


def _by_chance(t: float, freedom: float | None) -> float:
    """Return how probable |t| or more is under Student's law, the normal one where freedom is None."""
    from scipy.special import ndtr, stdtr  # scipy.stats takes a second to load

    return float(2 * (ndtr(-abs(t)) if freedom is None else stdtr(freedom, -abs(t))))


def outliers_of(limits: Array) -> tuple[int, ...]:
    """Return the numbers of outliers: Grubbs's test, two-sided, repeated without each one found.

    At most a third are looked for; of fewer than five none.
    """
    from scipy.special import stdtrit

    left = list(range(limits.size))
    found: list[int] = []
    while len(left) >= FEWEST_FOR_SHAPE and len(found) < limits.size // 3:
        values, n = limits[left], len(left)
        scatter = _scatter(values)
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
    """A mean beside a spin that theory names, or that another experiment reached.

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


def compare(found: Statistics, name: str, expected: float, u_expected: float = 0.0) -> Comparison:
    """Return the mean of repeated limits beside a spin that theory or another experiment names, with its u [Hz]."""
    assert found.mean.value is not None  # as summarized
    difference = found.mean.value - expected
    u = None if found.mean.u is None else math.hypot(found.mean.u, u_expected)
    p = None
    if found.n >= FEWEST and u:
        p = _by_chance(difference / u, found.freedom)
    return Comparison(name, expected, Estimate(difference, u, "Hz"), p)


class NoWindow(AnalysisError):
    """A top that no spin keeps up."""

    def __init__(self) -> None:
        super().__init__("no spin keeps this top up, so there is no window to compare with: another mass is expected")


def nearest_edge(mean: float, window: tuple[float, float]) -> str:
    """Return "lower" or "upper": the edge of the window that is nearer to a mean limit, by their ratio [Hz]."""
    low, high = window
    return "lower" if mean < math.sqrt(low * high) else "upper"


def spins_of_window(windows: Sequence[tuple[float, float]], spin: float) -> tuple[float, float]:
    """Return the window [Hz] that holds a spin, or whose edge is nearest to it.  Raises NoWindow."""
    if not windows:
        raise NoWindow
    return min(windows, key=lambda w: 0.0 if w[0] <= spin <= w[1] else min(abs(spin - w[0]), abs(spin - w[1])))
