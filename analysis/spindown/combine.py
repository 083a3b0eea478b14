"""Several spin-downs of one top: the drag law is common, each run has a start and a constant of its own.

The constants of one top differ from run to run by much more than their u by one run's readings (the thesis's by 2 %,
each good to 0.1 %; PHYSICS.md §5). So the u of a mean over runs comes from their scatter, and the mean is unweighted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.errors import NothingToCombine
from analysis.numbers import digits
from analysis.residuals import Correlation, durbin_watson, runs_test_p
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import (
    TILT_DEMANDED,
    SpinDown,
    comparison_warnings,
    correlation_warnings,
    is_correlated,
)
from analysis.spindown.lawfit import LawFit
from analysis.spindown.selection import NO_FIT, Statistics, statistics, weigh
from analysis.spindown.verdict import Verdict, verdict
from analysis.uncertainty import ROUNDING, Estimate, curvature

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mean(Estimate):
    """The mean of a constant over the runs; u is its standard error.

    Attributes:
        scatter: standard deviation of one run's constant from another's; None with one run.
        degrees_of_freedom: of scatter and u.
    """

    scatter: float | None = None
    degrees_of_freedom: int = 0


@dataclass(frozen=True)
class CombinedLaw:
    """One drag law over all runs.

    Attributes:
        name: of the law.
        constants: mean of each constant over the runs.
        linearised: the same for the straight-line constant, where the law has one.
        statistics: over all readings of all runs.
        warnings: what to know before using the numbers.
    """

    name: str
    constants: dict[str, Mean]
    linearised: dict[str, Mean] | None
    statistics: Statistics
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Combined:
    """All drag laws over all runs.

    Attributes:
        fits: in the order of the laws.
        best: name of the law the runs favour together.
        verdict: what they say about each law.
        runs: how many there are.
        warnings: what to know before using the numbers.
        correlation: of neighbouring readings' noise, over all runs.
        tilt: mean of the moment's tilt [rad] over the runs that show it, by the best law; None where none does.
    """

    fits: tuple[CombinedLaw, ...]
    best: str
    verdict: Verdict
    runs: int
    warnings: tuple[str, ...]
    correlation: Correlation | None = None
    tilt: Mean | None = None

    def fit(self, name: str) -> CombinedLaw:
        """One law."""
        return next(fit for fit in self.fits if fit.name == name)


def combine(runs: Sequence[SpinDown]) -> Combined:
    """Means of the constants over several runs, and the law the runs favour together.

    The criteria treat all runs as one experiment with p parameters for each run: with known uncertainties χ² is
    added up, otherwise all readings share one unknown uncertainty.

    Args:
        runs: fitted to the same laws; laws that a run lacks are left out.

    Raises:
        NothingToCombine: no run, or no law common to all.
    """
    names = [name for name in LAWS if runs and all(name in _names(run) for run in runs)]
    if not names:
        raise NothingToCombine(runs=len(runs))
    stats = {name: _statistics(runs, name) for name in names}
    correlation = _correlation(runs)
    if correlation and is_correlated(correlation):
        share = 1 / correlation.factor()
        stats = {name: replace(fit, n_effective=share * fit.n) for name, fit in stats.items()}
    weighed, criterion = weigh(stats)
    tilt = _tilt(runs, next(iter(weighed)))
    fits = tuple(_combined(name, [run.fit(name) for run in runs], weighed[name]) for name in names)
    exponent = next((fit.constants["exponent"] for fit in fits if fit.name == "power"), None)
    fall = max(float(1 - run.frequency[-1] / run.frequency[0]) for run in runs)
    decision = (
        runs[0].verdict
        if len(runs) == 1
        else verdict(
            weighed,
            criterion,
            fall=fall,
            exponent=exponent,
            correlation=correlation,
            tilt=tilt,
            broken=_broken(runs),
        )
    )
    mixed = 0 < sum(run.u is None for run in runs) < len(runs)
    n = sum(len(run.time) for run in runs)
    said = [
        *comparison_warnings(weighed, decision.best, mixed=mixed),
        *correlation_warnings(correlation, n),
        *_about_number(runs),
    ]
    return Combined(fits, decision.best, decision, len(runs), tuple(said), correlation, tilt)


def tilt_demanded(runs: Sequence[SpinDown]) -> bool:
    """Whether runs that do not demand the count's tilt each by itself do so together."""
    gains = [run.tilt_gain for run in runs if run.tilt_gain is not None]
    return len(gains) > 1 and sum(gains) > TILT_DEMANDED


def _broken(runs: Sequence[SpinDown]) -> str:
    """Which of several runs no law describes."""
    numbers = [k for k, run in enumerate(runs, 1) if not run.verdict.describes]
    if not numbers:
        return ""
    which = ", ".join(map(str, numbers))
    return f"none describes run {which} of {len(runs)}" if len(numbers) == 1 else f"none describes the runs {which}"


def _correlation(runs: Sequence[SpinDown]) -> Correlation | None:
    """Of all runs: the mean by their numbers of readings, and the joint probability (Stouffer's)."""
    seen = [(len(run.time), run.correlation) for run in runs if run.correlation is not None]
    if not seen:
        return None
    if len(seen) == 1:
        return seen[0][1]
    n = np.array([size for size, _ in seen], dtype=float)
    value = float(n @ [one.value for _, one in seen] / n.sum())
    u = float(np.linalg.norm(n * [one.u for _, one in seen]) / n.sum())
    return Correlation(value, u, _together([one.p for _, one in seen]), _together([one.p_shape for _, one in seen]))


def _together(probabilities: Sequence[float]) -> float:
    """One-sided probabilities of independent tests, as one (S. A. Stouffer et al., The American Soldier (1949))."""
    from scipy.special import ndtr, ndtri

    z = -ndtri(np.clip(probabilities, 1e-12, 1 - 1e-12)).sum() / sqrt(len(probabilities))
    return float(ndtr(-z))


def _tilt(runs: Sequence[SpinDown], best: str) -> Mean | None:
    seen = [run.fit(best) for run in runs if run.fit(best).has_tilt]
    if not seen:
        return None
    shared = [fit.shared_u.get("moment_tilt", 0.0) for fit in seen]
    return mean([fit.parameters["moment_tilt"] for fit in seen], shared)


def _about_number(runs: Sequence[SpinDown]) -> list[str]:
    """What so few runs, or runs of two kinds, leave open."""
    n, said = len(runs), []
    without_u = sum(run.u is None for run in runs)
    if 0 < without_u < n:
        said.append(
            f"{without_u} of {n} runs give no uncertainties of their readings: the laws are compared by the scatter "
            "alone"
        )
    if n == 1:
        said.append("this is one run: its uncertainties contain nothing of the scatter between runs, so record several")
    elif n < FEW_RUNS:
        from scipy.special import stdtrit

        width = float(stdtrit(n - 1, 0.5 + 0.5 * 0.6827))
        said.append(
            f"{n} runs give their scatter, and so u of the means, to {100 / np.sqrt(2 * (n - 1)):.0f} % only: a "
            f"68 % interval is {digits(width)} u to each side (Student's t)"
        )
    return said


FEW_RUNS = 5


def _names(run: SpinDown) -> set[str]:
    return {fit.name for fit in run.fits}


def _statistics(runs: Sequence[SpinDown], name: str) -> Statistics:
    fits = [run.fit(name) for run in runs]
    known = [fit.statistics.chi_square for fit in fits if fit.statistics.chi_square is not None]
    all_known = len(known) == len(fits)
    series = [
        fit.residuals / run.u if all_known and run.u is not None else fit.residuals
        for run, fit in zip(runs, fits, strict=True)
    ]
    spared, chi_square_more, rss_more = _common_exponent(runs, fits)
    return statistics(
        n=sum(fit.statistics.n for fit in fits),
        n_parameters=sum(fit.statistics.n_parameters for fit in fits) - spared,
        rss=sum(fit.statistics.rss for fit in fits) + rss_more,
        least_rss=sum(fit.statistics.n * (ROUNDING * fit.reference[0]) ** 2 for fit in fits),
        chi_square=sum(known) + chi_square_more if all_known else None,
        durbin_watson=durbin_watson(*series),
        runs_test_p=runs_test_p(*series),
    )


def _common_exponent(runs: Sequence[SpinDown], fits: Sequence[LawFit]) -> tuple[int, float, float]:
    """The law is common to the runs, so a free exponent is one parameter, not one a run: what that spares and costs.

    Near their minima χ² and RSS are parabolas in the exponent. With one exponent for all, their mean weighted by 1/u²,
    they grow by Cochran's Q: parameters spared, growth of χ², growth of RSS [Hz²].
    """
    exponents = [fit.parameters.get("exponent") for fit in fits]
    if len(fits) < 2 or not all(
        e and e.value is not None and e.u and fit.statistics.degrees_of_freedom > 0
        for e, fit in zip(exponents, fits, strict=True)
    ):
        return 0, 0.0, 0.0
    values = np.array([e.value for e in exponents if e])
    u = np.array([_own_u(run, fit) for run, fit in zip(runs, fits, strict=True)])
    stated = np.array([fit.statistics.inflation for fit in fits])  # u was enlarged by its root
    noise = np.array([fit.statistics.rss / fit.statistics.degrees_of_freedom for fit in fits])
    # RSS of a run grows by its noise for each (u by the scatter)²; where u was stated that is not its own scatter's
    own = np.array(
        [
            1.0 if fit.statistics.reduced_chi_square is None else stated_ / fit.statistics.reduced_chi_square
            for fit, stated_ in zip(fits, stated, strict=True)
        ]
    )
    weights = stated / u**2
    away = (values - weights @ values / weights.sum()) ** 2 / u**2
    return len(fits) - 1, float(stated @ away), float((noise * own) @ away)


def _own_u(run: SpinDown, fit: LawFit) -> float:
    """U of the exponent by the readings' independent noise alone: neither correlation nor a tilt is part of χ²."""
    stated = fit.parameters["exponent"].u
    assert stated
    if fit.has_tilt:
        return stated
    reference, duration = fit.reference
    slopes = fit.law.gradient((run.time - fit.start_time) / duration, fit.solution)
    found = curvature(slopes if run.u is None else slopes * reference / run.u).covariance
    if found is None:
        return stated
    of = fit.statistics
    variance = of.inflation if run.u is not None else of.rss / of.degrees_of_freedom / reference**2
    return float(np.sqrt(found[2, 2] * variance)) or stated


def _combined(name: str, fits: Sequence[LawFit], stats: Statistics) -> CombinedLaw:
    constants = {
        constant: mean([fit.parameters[constant] for fit in fits], [fit.shared_u.get(constant, 0.0) for fit in fits])
        for constant in LAWS[name].constants
    }
    lines = [fit.linearised for fit in fits if fit.linearised is not None]
    said = [
        warning
        for constant in LAWS[name].constants
        for warning in _warnings(name, constant, [fit.parameters[constant] for fit in fits], constants[constant])
    ]
    return CombinedLaw(name, constants, _means(lines, tuple(lines[0])) if lines else None, stats, tuple(said))


def _means(runs: Sequence[Mapping[str, Estimate]], names: Sequence[str]) -> dict[str, Mean]:
    return {name: mean([run[name] for run in runs]) for name in names}


def mean(estimates: Sequence[Estimate], shared_u: Sequence[float] = ()) -> Mean:
    """The mean of one constant over the runs that have it, with u = s/√N from their scatter s (GUM 4.2).

    Few runs may agree by chance: u is no smaller than the runs' own uncertainties leave to their mean, √Σu²/N.
    Of one run: its own value and u.  The part of u that is the same in all runs, as that of a tilt, does not show in
    their scatter, and no number of runs makes it smaller: it is added.

    Args:
        estimates: one a run.
        shared_u: that part of each one's u.

    >>> mean([Estimate(value, 0.01, "Hz") for value in (1.0, 2.0, 3.0)])
    Mean(value=2.0, u=0.577..., unit='Hz', interval=None, scatter=1.0, degrees_of_freedom=2)
    """
    unit = estimates[0].unit
    shared = shared_u or [0.0] * len(estimates)
    kept = [(each, part) for each, part in zip(estimates, shared, strict=True) if each.value is not None]
    values = np.array([estimate.value for estimate, _ in kept])
    if not len(values):
        return Mean(None, None, unit)
    if len(values) == 1:
        only = next(estimate for estimate in estimates if estimate.value is not None)
        return Mean(only.value, only.u, unit, only.interval)
    with np.errstate(over="ignore", invalid="ignore"):
        average, scatter = float(values.mean()), float(values.std(ddof=1))
    if not np.isfinite([average, scatter]).all():
        return Mean(None, None, unit)
    own = [np.sqrt(max(estimate.u**2 - part**2, 0.0)) for estimate, part in kept if estimate.u is not None]
    least = float(np.sqrt(np.sum(np.square(own)))) / len(values) if len(own) == len(values) else 0.0
    u = hypot(max(scatter / float(np.sqrt(len(values))), least), float(np.mean([part for _, part in kept])))
    return Mean(average, u, unit, scatter=scatter, degrees_of_freedom=len(values) - 1)


def _warnings(law: str, constant: str, estimates: Sequence[Estimate], average: Mean) -> list[str]:
    said = []
    missing = sum(estimate.value is None for estimate in estimates)
    if missing:
        said.append(f"{law}: {missing} of {len(estimates)} runs have no {constant} and are not in its mean")
    values = np.array([estimate.value for estimate in estimates if estimate.value is not None])
    u = np.array([estimate.u for estimate in estimates if estimate.value is not None and estimate.u])
    if average.scatter is None or len(u) != len(values):
        return said
    from scipy.special import gammaincc

    weights = (u.min() / u) ** 2
    q = float(
        (((values - weights @ values / weights.sum()) / u) ** 2).sum()
    )  # W. G. Cochran, Biometrics 10, 101 (1954)
    if gammaincc((len(u) - 1) / 2, q / 2) < NO_FIT:
        ratio = average.scatter / float(np.sqrt((u**2).mean()))
        said.append(
            f"{law}: {constant} scatters between the runs {digits(ratio)} times as much as each fit's own uncertainty "
            "explains: the runs differ, so trust the scatter, not the fit of one run"
        )
    return said
