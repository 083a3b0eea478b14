"""Spin-down of a free top: every drag law fitted to one run, and which of them the readings favour."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.errors import UnknownName
from analysis.residuals import gross_errors, studentised
from analysis.spindown.drag import LAWS
from analysis.spindown.lawfit import ROUNDING, UNCERTAINTIES, LawFit, Solution, Uncertainty, fit_law, solution
from analysis.spindown.readings import Readings, checked
from analysis.spindown.selection import NO_FIT, Statistics, weigh
from analysis.spindown.verdict import Verdict, verdict
from analysis.uncertainty import Estimate

__all__ = ["Estimate", "LawFit", "SpinDown", "Statistics", "Verdict", "fit_spin_down"]

Array = NDArray[np.float64]

FEWEST_FOR_OUTLIERS = 7  # with three parameters and one reading doubted, three are left to judge it by


@dataclass(frozen=True, eq=False)
class SpinDown:
    """All laws fitted to one run.

    Attributes:
        fits: in the order of the laws.
        best: name of the law the readings favour.
        verdict: what they say about each.
        time: of the readings used [s], shape (n,).
        frequency: spin frequency of the readings used [Hz], shape (n,).
        u: their standard uncertainties [Hz], shape (n,); None where not given.
        outliers: indices, among the readings given, of those that do not belong.
        start_time: time of the first reading [s].
        warnings: what to know before using the numbers.
    """

    fits: tuple[LawFit, ...]
    best: str
    verdict: Verdict
    time: Array
    frequency: Array
    u: Array | None
    outliers: tuple[int, ...]
    start_time: float
    warnings: tuple[str, ...]

    def fit(self, name: str) -> LawFit:
        """The fit of one law."""
        return next(fit for fit in self.fits if fit.name == name)


def fit_spin_down(
    time: ArrayLike,
    spin_frequency: ArrayLike,
    u: ArrayLike | None = None,
    *,
    laws: Iterable[str] = tuple(LAWS),
    uncertainty: Uncertainty = "covariance",
    bootstrap_samples: int = 1000,
    seed: int = 0,
    keep_outliers: bool = False,
) -> SpinDown:
    """Fits drag laws to one spin-down by weighted least squares of the spin frequency itself.

    Args:
        time: shape (n,), n ≥ 3, increasing [s].
        spin_frequency: shape (n,), above 0 [Hz].
        u: standard uncertainty of the readings [Hz], one or shape (n,). None: unknown, then all readings count
            alike and the scatter about each law stands for it.
        laws: names from `analysis.spindown.drag.LAWS`.
        uncertainty: "covariance"; or also an interval for each parameter, by "profile" (likelihood) or "bootstrap".
        bootstrap_samples: how many.
        seed: of the bootstrap.
        keep_outliers: fit gross outliers too, instead of leaving them out. Both ways a warning names them.

    Raises:
        AnalysisError: readings or names that cannot be used, see `readings.checked` and `UnknownName`.

    Source: thesis §4 and PHYSICS.md §5 for the laws and the straight lines; Bates & Watts (1988) §2 for the fit.

    >>> from analysis.spindown.drag import spin
    >>> t = np.arange(0, 200, 10)
    >>> run = fit_spin_down(t, spin("disc", t, 40.0, 2.34e-4), u=0.03)
    >>> run.best, round(run.fit("disc").parameters["c32"].value, 9)
    ('disc', 0.000234)
    >>> [name for name, reason in run.verdict.excluded]
    ['newton', 'stokes']
    """
    chosen = _known("drag law", laws, LAWS)
    _known("kind of uncertainty", [uncertainty], UNCERTAINTIES)
    given = checked(time, spin_frequency, u)
    search = _search_outliers(given)
    left_out = search.indices[:0] if keep_outliers else search.indices
    readings = given.without(left_out) if len(left_out) else given
    solved = {"power": search.power} if search.power and len(search.power.readings) == len(readings) else {}
    fits = [
        fit_law(solved.get(name) or solution(LAWS[name], readings), uncertainty, bootstrap_samples, seed)
        for name in chosen
    ]
    weighed, criterion = weigh({fit.name: fit.statistics for fit in fits})
    exponent = next((fit.parameters["exponent"] for fit in fits if fit.name == "power"), None)
    fall = float(1 - readings.x[-1] / readings.x[0])
    decision = verdict(weighed, criterion, fall=fall, exponent=exponent)
    return SpinDown(
        fits=tuple(replace(fit, statistics=weighed[fit.name]) for fit in fits),
        best=decision.best,
        verdict=decision,
        time=readings.time,
        frequency=readings.frequency,
        u=readings.u,
        outliers=tuple(search.indices.tolist()),
        start_time=readings.start_time,
        warnings=(
            *_outlier_warnings(given, search, kept=keep_outliers),
            *comparison_warnings(weighed, decision.best),
        ),
    )


def _known(kind: str, names: Iterable[str], known: Iterable[str]) -> tuple[str, ...]:
    table, seen = tuple(known), tuple(dict.fromkeys(names))
    for name in seen or ("",):
        if name not in table:
            raise UnknownName(kind=kind, seen=name, known=table)
    return seen


@dataclass(frozen=True, eq=False)
class _Search:
    """Gross outliers: indices, how many standard deviations away, and the power law fitted to the others."""

    indices: NDArray[np.intp]
    deviations: Array
    power: Solution | None


def _search_outliers(readings: Readings) -> _Search:
    """Readings that lie too far from a power law fitted to the others, at most a tenth of them beside the miscounts.

    The worst goes first, then all is fitted anew: one at a time, or a hundredth of very many.
    """
    n = len(readings)
    if n < FEWEST_FOR_OUTLIERS:
        return _Search(np.empty(0, dtype=np.intp), np.empty(0), None)
    left_out, deviations = _miscounts(readings)
    allowed = len(left_out) + max(1, n // 10)
    while True:
        kept = np.delete(np.arange(n), left_out)
        found = solution(LAWS["power"], readings.without(left_out) if len(left_out) else readings)
        most = min(allowed - len(left_out), max(1, n // 100))
        floor = 1.0 if readings.sigma_known else ROUNDING  # a stated uncertainty is a scatter to be expected
        t = studentised(found.residuals, found.curvature.leverage, len(found.q), floor)
        worst = gross_errors(t, len(found.q))[:most]
        if not len(worst) or found.degrees_of_freedom <= 1:
            order = np.argsort(left_out)
            return _Search(left_out[order], deviations[order], found)
        left_out = np.append(left_out, kept[worst])
        deviations = np.append(deviations, np.abs(t[worst]))


MISCOUNT, FAR, WINDOW = 0.25, 8.0, 5  # relative; robust standard deviations; readings that a median is taken over


def _miscounts(readings: Readings) -> tuple[NDArray[np.intp], Array]:
    """Readings off by a good part of themselves, as twice or half, and by how many standard deviations.

    Several of them hide one another from a search one at a time. So the power law is fitted to running medians, which
    none of them moves, and then to what lies near it, until that stays the same. If more than a quarter of the
    readings lie far away no law fits, and none is left out.
    """
    from scipy.ndimage import median_filter

    n = len(readings)
    smooth = median_filter(readings.x, size=WINDOW, mode="nearest")
    far = np.abs(readings.x / smooth - 1) > MISCOUNT / 2
    if not far.any():
        return np.flatnonzero(far), np.empty(0)
    found = solution(LAWS["power"], replace(readings, x=smooth))
    for _ in range(10):
        # of an exponent below 1 the fitted top may have stopped: what is read then is far off, not infinitely so
        off = np.abs(readings.x / np.maximum(LAWS["power"].spin(readings.tau, found.q), ROUNDING) - 1)
        scatter = max(1.4826 * float(np.median(off)), ROUNDING)  # of normal noise by its median
        now = off > max(MISCOUNT, FAR * scatter)
        if now.sum() > n // 4:
            return np.empty(0, dtype=np.intp), np.empty(0)
        if (now == far).all():
            break
        far = now
        found = solution(LAWS["power"], readings.without(np.flatnonzero(far)))
    return np.flatnonzero(far), off[far] / scatter


def _outlier_warnings(readings: Readings, search: _Search, *, kept: bool) -> list[str]:
    done = "was kept as asked" if kept else "was left out"
    return [
        f"the reading of {readings.frequency[i]:.6g} Hz at {readings.time[i]:.12g} s lies {deviation:.3g} standard "
        f"deviations from the others and {done}"
        for i, deviation in zip(search.indices, search.deviations, strict=True)
    ]


def comparison_warnings(fits: Mapping[str, Statistics], best: str) -> list[str]:
    """What makes the comparison of laws, or their uncertainties, weaker than it looks."""
    said = []
    if not fits[best].sigma_known:
        said.append(
            "no uncertainties of the readings were given: they are taken from the scatter about each law, so a law "
            "that does not fit shows only beside one that fits better"
        )
    if fits[best].inflation > 1:
        birge = float(np.sqrt(fits[best].inflation))
        said.append(
            f"even the best law, {best}, misses the readings by {birge:.2g} times their stated uncertainties, more "
            "than chance explains: all uncertainties are enlarged by that ratio; check the readings' uncertainties"
        )
    known, probability = fits[best].sigma_known, _less_than_chance(fits[best])
    if known and probability < NO_FIT:
        ratio = float(np.sqrt(fits[best].reduced_chi_square or 0.0))
        said.append(
            f"the readings scatter only {ratio:.2g} times as much about the best law as their stated uncertainties "
            "say: are these too large?"
        )
    undefined = [name for name, fit in fits.items() if fit.aicc is None]
    if undefined:
        n = fits[best].n
        said.append(f"{n} readings are too few to compare {_listed(undefined)} by AICc: record more readings")
    return said


def _less_than_chance(fit: Statistics) -> float:
    """Probability of a χ² as small as this."""
    if fit.chi_square is None or fit.degrees_of_freedom < 1:
        return 1.0
    from scipy.special import gammainc

    return float(gammainc(fit.degrees_of_freedom / 2, fit.chi_square / 2))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)
