"""Spin-down of a free top: every drag law fitted to one run, and which of them the readings favour."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.arrays import Array
from analysis.errors import AnalysisError
from analysis.remarks import Remark
from analysis.residuals import Change, gross_errors, gross_limit, largest_change
from analysis.spindown.drag import LAWS, DragLaw, power_law
from analysis.spindown.lawfit import LawFit, Solution, fit_law, solution
from analysis.spindown.posterior import INDEPENDENT, RHO
from analysis.spindown.readings import Readings, check_readings
from analysis.spindown.selection import NO_FIT, Statistics, find_failed, weigh
from analysis.spindown.tilt import THESIS_TOP, Release, Top
from analysis.spindown.verdict import Verdict, verdict
from analysis.uncertainty import FEW_LEFT, ROUNDING, Estimate, student

__all__ = ["Estimate", "LawFit", "SpinDown", "Statistics", "Verdict", "fit_spin_down"]


FEWEST_FOR_OUTLIERS = 7  # with three parameters and one reading doubted, three are left to judge it by


class UnknownName(AnalysisError):
    """A name that is in no table of this analysis."""

    def __init__(self, *, kind: str, seen: str, known: Iterable[str]) -> None:
        self.kind, self.seen, self.known = kind, seen, tuple(known)
        super().__init__("no {kind} is called '{seen:s}': choose from {names:s}", names=", ".join(self.known))


@dataclass(frozen=True)
class CountModel:
    """Assumptions about the count, for every law alike.

    Attributes:
        tilt: whether the count has the tilt of the top.
        top: the top that is counted.
        release: see `fit_spin_down`.
        correlated: whether the noise of neighbouring readings may be correlated.
    """

    tilt: bool
    top: Top
    release: Release | None
    correlated: bool = True

    def fit(self, law: DragLaw, readings: Readings, rho: Array = RHO) -> Solution:
        """Return the best point of one law."""
        if not self.correlated:
            rho = INDEPENDENT
        return solution(law, readings, tilt=self.tilt, top=self.top, release=self.release, rho=rho)


@dataclass(frozen=True, eq=False)
class SpinDown:
    """All laws fitted to one run.

    Attributes:
        fits: in the order of the laws.
        best: name of the law the readings favour.
        verdict: on each.
        time: of the readings used [s], shape (n,).
        frequency: spin frequency of the readings used [Hz], shape (n,).
        u: their standard uncertainties [Hz], shape (n,); None where not given.
        outliers: indices, among the readings given, of those that do not belong.
        start_time: time of the first reading [s].
        remarks: what to know before using the numbers.
        model: of the count.
        correlation: of neighbouring readings' noise, about the best law; None where it is undefined, or known to be 0.
    """

    fits: tuple[LawFit, ...]
    best: str
    verdict: Verdict
    time: Array
    frequency: Array
    u: Array | None
    outliers: tuple[int, ...]
    start_time: float
    remarks: tuple[Remark, ...]
    model: CountModel
    correlation: Estimate | None = None

    @property
    def has_tilt(self) -> bool:
        """Whether the count's tilt is in the fits."""
        return any(fit.has_tilt for fit in self.fits)

    @property
    def is_correlated(self) -> bool:
        """Whether the readings show a correlation of their noise."""
        return is_correlated(self.correlation)

    def fit(self, name: str) -> LawFit:
        """Return the fit of one law."""
        return next(fit for fit in self.fits if fit.name == name)

    @cached_property
    def drag_over_disc(self) -> Estimate:
        """The drag between the first and the last reading, by the best law, over that of a bare disc as large."""
        fit, ends = self.fit(self.best), self.time[[0, -1]]
        root = np.sqrt(2 * np.pi * np.maximum(fit.spin_frequency(ends), 1e-3))
        per_second = 2 / float(ends[1] - ends[0]) / self.model.top.disc_constant
        spread = fit.u_spin_frequency(ends)
        u = 0.0 if spread is None else float(np.linalg.norm(np.pi * spread / root**3)) * per_second
        return Estimate(float(1 / root[1] - 1 / root[0]) * per_second, u, "1")

    def misfit(self, exponent: float) -> float:
        """Return −2 ln of the greatest likelihood of a power law with this exponent, see `Statistics.misfit`."""
        law = power_law("", Fraction(exponent))
        return self.model.fit(law, check_readings(self.time, self.frequency, self.u)).statistics.misfit


def is_correlated(correlation: Estimate | None) -> bool:
    """Return whether readings show a correlation of their noise: it is worth a remark, and in every u anyway."""
    if correlation is None or correlation.value is None or correlation.u is None:
        return False
    return correlation.value > 2 * correlation.u


def fit_spin_down(
    time: ArrayLike,
    spin_frequency: ArrayLike,
    u: ArrayLike | None = None,
    *,
    laws: Iterable[str] = tuple(LAWS),
    keep_outliers: bool = False,
    tilt: bool = True,
    release: Release | None = None,
    gate: float | None = None,
    top: Top = THESIS_TOP,
    correlated: bool = True,
) -> SpinDown:
    """Fit drag laws to one spin-down: a count of a top that wobbles, with noise whose neighbours may be correlated.

    Args:
        time: shape (n,), n ≥ 3, increasing [s].
        spin_frequency: shape (n,), above 0 [Hz].
        u: standard uncertainty of the readings [Hz], one or shape (n,). None: unknown, then all readings count
            alike and the scatter about each law stands for it.
        laws: names from `analysis.spindown.drag.LAWS`.
        keep_outliers: fit gross outliers too, instead of leaving them out. Both ways a remark names them.
        tilt: whether the count has the tilt of the top (see `analysis.spindown.tilt`); False: it is known to have none.
        release: how the top came to its first reading: the slower it was set free, and the longer it was driven, the
            more it nutates. None: set free at the first reading.
        gate: over which each reading is a mean [s]; None: not known.  The fits say what it does, and are not changed.
        top: whose count it is.
        correlated: whether the noise of neighbouring readings may be correlated; False: it is known to be white.

    Raises:
        AnalysisError: readings or names that cannot be used, see `readings.checked` and `UnknownName`.

    Source: thesis §4 and PHYSICS.md §5 for the laws and the straight lines; `analysis.spindown.posterior` for the fit.

    >>> from analysis.spindown.drag import spin
    >>> t = np.arange(0, 200, 10)
    >>> run = fit_spin_down(t, spin("disc", t, 40.0, 2.34e-4), u=0.03, tilt=False)
    >>> run.best, round(run.fit("disc").parameters["c32"].value, 9)
    ('disc', 0.000234)
    >>> run.verdict.excluded
    ('newton', 'stokes')
    """
    chosen = _check_names("drag law", laws, LAWS)
    given = check_readings(time, spin_frequency, u)
    model = CountModel(tilt, top, release, correlated)
    outliers = _search_outliers(given, model)
    while True:
        readings = given if keep_outliers or not len(outliers) else given.without(outliers)
        found = {name: model.fit(LAWS[name], readings) for name in chosen}
        of_fits = {name: each.statistics for name, each in found.items()}
        failed = find_failed(of_fits, readings.frequency)
        stats, criterion = weigh(of_fits, failed)
        fits = {name: fit_law(each, gate) for name, each in found.items()}
        best = next(iter(stats))
        agree = _agree(given, outliers, fits[best], stats[best])
        if keep_outliers or not agree.any():
            break
        outliers = outliers[~agree]
    # of few laws that were asked for the best may be the wrong one: that is no change of the top
    power = found.get("power") or model.fit(LAWS["power"], readings)
    change = _change(found[best] if "power" in found else power, power)
    decision = verdict(stats, criterion, change=change, failed=failed)
    best = decision.best
    return SpinDown(
        fits=tuple(replace(fits[name], statistics=stats[name]) for name in chosen),
        best=best,
        verdict=decision,
        time=readings.time,
        frequency=readings.frequency,
        u=readings.u,
        outliers=tuple(outliers.tolist()),
        start_time=readings.start_time,
        remarks=(
            *_about_outliers(given, outliers, fits[best], kept=keep_outliers),
            *_too_good(best, stats[best], fits[best].reference[0]),
            *comparison_remarks(stats, best, fits[best].rho),
        ),
        model=model,
        correlation=fits[best].rho,
    )


#: Residuals relative to the spin: the best counters have noise of 1e-11 over a second, and tops are no such clocks.
NO_MEASUREMENT = 1e-10


def _too_good(best: str, stats: Statistics, reference_hz: float) -> list[Remark]:
    """Return that readings are calculated ones."""
    if stats.degrees_of_freedom < 1 or stats.rms_residual > NO_MEASUREMENT * reference_hz:
        return []
    return [Remark("calculated", best, values=(stats.rms_residual,))]


def _change(found: Solution, power: Solution | None) -> Change | None:
    """Return the most improbable change [Hz] of the readings about a law.

    Beside it the exponent is left free, for about a law that lies beside it all else would count as noise.
    """
    weight = np.broadcast_to(found.readings.weight, found.residuals.shape)
    if float(found.residuals @ found.residuals) <= len(weight) * (ROUNDING * float(weight.max())) ** 2:
        return None
    beside = [] if power is None or power is found else [power.slopes[: len(power.law.parameters)]]
    slopes = np.vstack([found.slopes[: len(found.law.parameters)], *beside])
    if found.counted is not None:
        slopes = np.vstack([slopes, found.slopes[len(found.law.parameters) :][:3]])
    change = largest_change(found.readings.time, found.residuals, slopes)
    return change and replace(change, size=change.size * found.readings.reference_hz / float(np.median(weight)))


def _check_names(kind: str, names: Iterable[str], known: Iterable[str]) -> tuple[str, ...]:
    table, seen = tuple(known), tuple(dict.fromkeys(names))
    for name in seen or ("",):
        if name not in table:
            raise UnknownName(kind=kind, seen=name, known=table)
    return seen


def _search_outliers(readings: Readings, model: CountModel) -> NDArray[np.intp]:
    """Return readings that lie too far from a power law fitted to the others, at most a tenth beside the miscounts.

    The worst goes first, then all is fitted again: one at a time, or a hundredth of very many.  The noise counts as
    independent here: correlated noise could follow a reading that lies off.
    """
    n = len(readings)
    if n < FEWEST_FOR_OUTLIERS:
        return np.empty(0, dtype=np.intp)
    left_out = _miscounts(readings)
    allowed = len(left_out) + max(1, n // 10)
    while True:
        kept = np.delete(np.arange(n), left_out)
        found = model.fit(LAWS["power"], readings.without(left_out) if len(left_out) else readings, INDEPENDENT)
        most = min(allowed - len(left_out), max(1, n // 100))
        floor = 1.0 if readings.sigma_known else ROUNDING  # a stated uncertainty is a scatter to be expected
        worst = gross_errors(found.studentise(floor), len(found.law.parameters))[:most]
        if not len(worst):
            return np.sort(left_out)
        left_out = np.append(left_out, kept[worst])


def _agree(given: Readings, outliers: NDArray[np.intp], best: LawFit, stats: Statistics) -> NDArray[np.bool_]:
    """Return which of the readings left out are none: near the resonance the search may end in another optimum."""
    if not len(outliers) or stats.degrees_of_freedom < 2:
        return np.zeros(len(outliers), dtype=bool)
    off = np.abs(given.frequency[outliers] - best.spin_frequency(given.time[outliers]))
    scatter = stats.rms_residual * np.sqrt(stats.n / stats.degrees_of_freedom)
    unit = scatter if given.u is None else np.maximum(given.u[outliers], scatter)
    limit = gross_limit(stats.n + 1, stats.n - stats.degrees_of_freedom)
    return np.asarray(off < limit * unit)


MISCOUNT, FAR, WINDOW = 0.25, 8.0, 5  # relative; robust standard deviations; readings that a median is taken over


def _miscounts(readings: Readings) -> NDArray[np.intp]:
    """Return indices of readings off by a good part of themselves, as twice or half.

    Several of them hide one another from a search one at a time. So the power law is fitted to running medians, which
    none of them moves, and then to what lies near it, until that stays the same. If more than a quarter of the
    readings lie far away no law fits, and none is left out.
    """
    n = len(readings)
    # by numpy: scipy.ndimage takes longer to import than a usual run to fit
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(readings.x, WINDOW // 2, mode="edge"), WINDOW)
    smooth = np.median(windows, axis=1)
    far = np.abs(readings.x / smooth - 1) > MISCOUNT / 2
    if not far.any():
        return np.flatnonzero(far)
    found = solution(LAWS["power"], replace(readings, x=smooth), rho=INDEPENDENT)
    for _ in range(10):
        # of an exponent below 1 the fitted top may have stopped: what is read then is far off, not infinitely so
        off = np.abs(readings.x / np.maximum(LAWS["power"].spin(readings.tau, found.q), ROUNDING) - 1)
        scatter = max(1.4826 * float(np.median(off)), ROUNDING)  # of normal noise by its median
        now = off > max(MISCOUNT, FAR * scatter)
        if now.sum() > n // 4:
            return np.empty(0, dtype=np.intp)
        if (now == far).all():
            break
        far = now
        found = solution(LAWS["power"], readings.without(np.flatnonzero(far)), rho=INDEPENDENT)
    return np.flatnonzero(far)


def _about_outliers(readings: Readings, outliers: NDArray[np.intp], best: LawFit, *, kept: bool) -> list[Remark]:
    """Return how far outliers lie from the best law, which was fitted to the others, or to all where they were kept."""
    off = np.abs(readings.frequency[outliers] - best.spin_frequency(readings.time[outliers]))
    own = np.delete(best.residuals, outliers) if kept else best.residuals
    rms = float(np.sqrt(np.mean(own**2)))
    unit = np.full(len(off), rms) if readings.u is None else readings.u[outliers]
    falling, stated = _last_ones(outliers, len(readings)), readings.u is not None
    return [
        Remark(
            "falling" if i in falling and not kept else "outlier",
            best.name,
            values=(
                float(readings.time[i]), float(readings.frequency[i]), float(away), float(away / max(size, 1e-300)),
                stated, kept, i in falling,
            ),
        )
        for i, away, size in zip(outliers.tolist(), off, unit, strict=True)
    ]  # fmt: skip


def _last_ones(outliers: NDArray[np.intp], n: int) -> frozenset[int]:
    """Return those after which no reading belongs to the law."""
    last = n - 1
    while last in outliers:
        last -= 1
    return frozenset(i for i in outliers.tolist() if i > last)


def comparison_remarks(
    fits: Mapping[str, Statistics], best: str, correlation: Estimate | None, *, mixed: bool = False
) -> list[Remark]:
    """Return what makes the comparison of laws, or their uncertainties, weaker than it looks.

    Args:
        fits: statistics by the law's name.
        best: name of the favoured law.
        correlation: of neighbouring readings.
        mixed: whether some of several runs have uncertainties of their readings and others have none.
    """
    said, fit = [], fits[best]
    if not fit.sigma_known and not mixed:
        said.append(Remark("no u"))
        if 0 < fit.degrees_of_freedom <= FEW_LEFT:
            said.append(Remark("few left", values=(fit.n, student(fit.degrees_of_freedom))))
    if fit.chi_square is not None and fit.degrees_of_freedom > 0:
        from scipy.special import gammainc, gammaincc

        half = fit.degrees_of_freedom / 2, fit.chi_square / 2
        ratio = (float(np.sqrt(fit.reduced_chi_square or 0.0)),)
        if gammaincc(*half) < NO_FIT:
            said.append(Remark("understated", best, values=ratio))
        if gammainc(*half) < NO_FIT:
            said.append(Remark("overstated", best, values=ratio))
            correlation = None  # residuals far below u look like noise that hardly changes
    if correlation and is_correlated(correlation):
        said.append(Remark("correlated", values=(correlation.value or 0.0, correlation.u or 0.0, fit.n)))
    undefined = [name for name, each in fits.items() if each.aicc is None]
    if undefined:
        by_bic = len(undefined) == len(fits) and fit.sigma_known
        said += [Remark("few readings", name=", ".join(undefined), values=(fit.n, by_bic))]
    return said
