"""Several spin-downs of one top: the drag law is common, each run has a start and a constant of its own.

The constants of one top differ from run to run by much more than their u by one run's readings (the thesis's by 2 %,
each good to 0.1 %; PHYSICS.md §5). So the u of a mean over runs comes from their scatter, and the mean is unweighted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.comparison import weighted_mean
from analysis.errors import AnalysisError
from analysis.remarks import Remark
from analysis.residuals import durbin_watson, runs_test_p
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown, comparison_remarks
from analysis.spindown.joint import JointExponent, joint_exponent
from analysis.spindown.lawfit import LawFit
from analysis.spindown.selection import NO_FIT, Statistics, find_failed, statistics, weigh
from analysis.spindown.verdict import Verdict, verdict
from analysis.uncertainty import Estimate, Mean, mean, student


class NothingToCombine(AnalysisError):
    """No run, or no drag law that was fitted to every run."""

    def __init__(self, *, runs: int) -> None:
        self.runs = runs
        super().__init__(
            "{runs} runs have no drag law in common, at least one run and one law were expected: "
            "fit the same laws to each run"
        )


@dataclass(frozen=True)
class CombinedLaw:
    """One drag law over all runs.

    Attributes:
        name: of the law.
        constants: mean of each constant over the runs.
        linearised: the same for the straight-line constant, where the law has one.
        statistics: over all readings of all runs.
        remarks: what to know before using the numbers.
    """

    name: str
    constants: dict[str, Mean]
    linearised: dict[str, Mean] | None
    statistics: Statistics
    remarks: tuple[Remark, ...]


@dataclass(frozen=True)
class Combined:
    """All drag laws over all runs.

    Attributes:
        fits: in the order of the laws.
        best: name of the law the runs favour together.
        verdict: what they say about each law.
        runs: how many there are.
        remarks: what to know before using the numbers.
        correlation: of neighbouring readings' noise, over all runs.
        tilt: mean of the moment's tilt [rad] over the runs, by the best law; None where it is not in the fits.
    """

    fits: tuple[CombinedLaw, ...]
    best: str
    verdict: Verdict
    runs: int
    remarks: tuple[Remark, ...]
    correlation: Estimate | None = None
    tilt: Mean | None = None

    def fit(self, name: str) -> CombinedLaw:
        """One law."""
        return next(fit for fit in self.fits if fit.name == name)


def combine(runs: Sequence[SpinDown]) -> Combined:
    """Return the means of the constants over several runs, and the law that the runs favour together.

    The criteria treat all runs as one experiment with p parameters for each run: with known uncertainties χ² is
    added up, otherwise all readings share one unknown uncertainty.

    Args:
        runs: fitted to the same laws; laws that a run lacks are left out.

    Raises:
        NothingToCombine: no run, or no law common to all.
    """
    names = [name for name in LAWS if runs and all(any(fit.name == name for fit in run.fits) for run in runs)]
    if not names:
        raise NothingToCombine(runs=len(runs))
    joint = joint_exponent(runs)
    of_runs = ({name: run.fit(name).statistics for name in names} for run in runs)
    failed = set[str]().union(*map(find_failed, of_runs, (run.frequency for run in runs)))
    failed = failed if len(failed) < len(names) else set()
    weighed, criterion = weigh({name: _statistics(runs, name, joint) for name in names}, failed)
    correlation = _correlation(runs)
    fits = tuple(_combine_law(name, [run.fit(name) for run in runs], weighed[name]) for name in names)
    changes = tuple(1.0 if run.verdict.change is None else run.verdict.change.p for run in runs)
    decision = runs[0].verdict if len(runs) == 1 else verdict(weighed, criterion, changes=changes, failed=failed)
    mixed = 0 < sum(run.u is None for run in runs) < len(runs)
    said = [
        *comparison_remarks(weighed, decision.best, correlation, mixed=mixed),
        *_about_number(runs),
    ]
    return Combined(fits, decision.best, decision, len(runs), tuple(said), correlation, _tilt(runs, decision.best))


def _correlation(runs: Sequence[SpinDown]) -> Estimate | None:
    """Return the mean over the runs by their information; u holds their scatter."""
    seen = [(one.value, one.u) for run in runs if (one := run.correlation) and one.value is not None and one.u]
    if not seen:
        return None
    values, u = np.array(seen).T
    value, of_mean, _ = weighted_mean(values, u)
    return Estimate(value, float(np.linalg.norm((of_mean / u) ** 2 * np.hypot(u, values - value))), "1")


def _tilt(runs: Sequence[SpinDown], best: str) -> Mean | None:
    seen = [run.fit(best) for run in runs if run.fit(best).has_tilt]
    if not seen:
        return None
    shared = [fit.shared_u.get("moment_tilt", 0.0) for fit in seen]
    return mean([fit.parameters["moment_tilt"] for fit in seen], shared)


def _about_number(runs: Sequence[SpinDown]) -> list[Remark]:
    """Return what so few runs, or runs of two kinds, leave open."""
    n, without_u = len(runs), sum(run.u is None for run in runs)
    said = [Remark("mixed u", values=(without_u, n))] if 0 < without_u < n else []
    if n == 1:
        said.append(Remark("one run"))
    elif n < FEW_RUNS:
        said.append(Remark("few runs", values=(n, student(n - 1))))
    return said


FEW_RUNS = 5


def _statistics(runs: Sequence[SpinDown], name: str, joint: JointExponent | None) -> Statistics:
    fits = [run.fit(name) for run in runs]
    known = [fit.statistics.chi_square for fit in fits if fit.statistics.chi_square is not None]
    all_known = len(known) == len(fits)
    series = [
        fit.residuals / run.u if all_known and run.u is not None else fit.residuals
        for run, fit in zip(runs, fits, strict=True)
    ]
    separate, spared = sum(fit.statistics.misfit for fit in fits), 0
    if joint is not None:
        separate = joint.misfit if name == "power" else joint.misfit_of(separate)
        spared = len(fits) - 1 if name == "power" else 0
    return statistics(
        n=sum(fit.statistics.n for fit in fits),
        n_parameters=sum(fit.statistics.n_parameters for fit in fits) - spared,
        rss=sum(fit.statistics.rss for fit in fits),
        chi_square=sum(known) if all_known else None,
        misfit=separate,
        durbin_watson=durbin_watson(*series),
        runs_test_p=runs_test_p(*series),
        runs=len(fits),
    )


def _combine_law(name: str, fits: Sequence[LawFit], stats: Statistics) -> CombinedLaw:
    constants = {
        constant: mean([fit.parameters[constant] for fit in fits], [fit.shared_u.get(constant, 0.0) for fit in fits])
        for constant in LAWS[name].constants
    }
    lines = [fit.linearised for fit in fits if fit.linearised is not None]
    said = [
        remark
        for constant in LAWS[name].constants
        for remark in _remarks(name, constant, [fit.parameters[constant] for fit in fits], constants[constant])
    ]
    linearised = {constant: mean([line[constant] for line in lines]) for constant in lines[0]} if lines else None
    return CombinedLaw(name, constants, linearised, stats, tuple(said))


def _remarks(law: str, constant: str, estimates: Sequence[Estimate], average: Mean) -> list[Remark]:
    said = []
    missing = sum(estimate.value is None for estimate in estimates)
    if missing:
        said.append(Remark("missing", law, constant, (missing, len(estimates))))
    values = np.array([estimate.value for estimate in estimates if estimate.value is not None])
    u = np.array([estimate.u for estimate in estimates if estimate.value is not None and estimate.u])
    if average.scatter is None or len(u) != len(values):
        return said
    from scipy.special import chdtrc

    if chdtrc(len(u) - 1, weighted_mean(values, u)[2]) < NO_FIT:
        said.append(Remark("scatters", law, constant, (average.scatter / float(np.sqrt((u**2).mean())),)))
    return said
