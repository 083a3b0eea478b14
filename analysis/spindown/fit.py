"""Spin-down of a free top: every drag law fitted to one run, and which of them the readings favour."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.errors import UnknownName
from analysis.numbers import digits
from analysis.residuals import Correlation, Jump, correlation, gross_errors, largest_jump, studentised
from analysis.spindown.drag import LAWS
from analysis.spindown.hidden import bends, hidden_tilt
from analysis.spindown.lawfit import (
    UNCERTAINTIES,
    HiddenTilt,
    LawFit,
    Solution,
    Uncertainty,
    fit_law,
    noise,
    scatter,
    solution,
    with_tilt,
)
from analysis.spindown.readings import Readings, checked
from analysis.spindown.selection import NO_FIT, Statistics, weigh
from analysis.spindown.tilt import AFTER_DRIVE, LAST_GAP, LAST_GAP_U, UNKNOWN_ORIGIN, CountedLaw, Wobble
from analysis.spindown.verdict import EXCLUDED, Verdict, verdict
from analysis.uncertainty import ROUNDING, Estimate

__all__ = ["Estimate", "LawFit", "SpinDown", "Statistics", "Verdict", "fit_spin_down"]

Array = NDArray[np.float64]

FEWEST_FOR_OUTLIERS = 7  # with three parameters and one reading doubted, three are left to judge it by
FEWEST_FOR_TILT = 8  # the power law has four parameters then
TILT_DEMANDED = 4.0  # ΔAICc in favour of the tilt: of runs without one 1.5 % have more
TILT_WORTH_A_FIT = 1.0  # the same, estimated by one step: then the tilt is fitted
NOT_FAR = 25.0  # ΔAICc; in 500 runs with ρ = 0.7 the true law was never farther behind one that followed the noise
# p below which correlation is taken for real: of 20 readings four in five with ρ = 0.7 are found.  With 0.05 no test
# finds so many, not even the point-optimal one (79 % with two constants).
CORRELATED = 0.07
NO_NOISE = 5e-4  # p below which a jump is one


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
        correlation: of neighbouring readings' noise, by what the simplest law not far from the best leaves over.
        tilt_gain: ΔAICc in favour of a count that has the tilt; None where there are too few readings.
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
    correlation: Correlation | None = None
    tilt_gain: float | None = None

    @property
    def has_tilt(self) -> bool:
        """Whether the count's tilt is in the fits."""
        return any(fit.has_tilt for fit in self.fits)

    @property
    def is_correlated(self) -> bool:
        """Whether the readings' noise is taken as correlated."""
        return is_correlated(self.correlation)

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
    tilt: bool | None = None,
    driven: bool = False,
    gate: float | None = None,
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
        tilt: whether the count has the top's tilt (see `analysis.spindown.tilt`); None: if the readings demand it, and
            else the uncertainties hold what a hidden one would do (see `analysis.spindown.hidden`); False: it has none.
        driven: whether a drive brought the top to its spin; it nutates more then.
        gate: over which each reading is a mean [s]; None: not known.  The fits say what it does, and are not changed.

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
    plain = {name: solved.get(name) or solution(LAWS[name], readings) for name in chosen}
    wobble = AFTER_DRIVE if driven else UNKNOWN_ORIGIN
    gain, tilted = _tilted(plain | solved, wobble, wanted=tilt)
    best = plain | {name: tilted[name] for name in chosen if name in tilted}
    stats, criterion, correlated = _judged(best)
    rho = correlated.cautious() if correlated and is_correlated(correlated) else 0.0
    fits = {
        name: fit_law(
            found,
            uncertainty,
            bootstrap_samples,
            seed,
            rho=rho,
            plain=plain[name] if name in tilted else None,
            hidden=None if tilt is False or name in tilted else _hidden(found, rho, wobble),
            gate=gate,
        )
        for name, found in best.items()
    }
    exponent = fits["power"].parameters["exponent"] if "power" in fits else None
    decision = verdict(
        stats,
        criterion,
        fall=float(1 - readings.x[-1] / readings.x[0]),
        exponent=exponent,
        correlation=correlated,
        tilt=fits[next(iter(stats))].parameters.get("moment_tilt"),
        broken=_about_jump(_jump_of_all(best, stats), readings),
    )
    return SpinDown(
        fits=tuple(replace(fits[name], statistics=stats[name]) for name in chosen),
        best=decision.best,
        verdict=decision,
        time=readings.time,
        frequency=readings.frequency,
        u=readings.u,
        outliers=tuple(search.indices.tolist()),
        start_time=readings.start_time,
        warnings=(
            *_outlier_warnings(given, search.indices, fits[decision.best], kept=keep_outliers),
            *_too_good(fits[decision.best]),
            *comparison_warnings(stats, decision.best),
            *correlation_warnings(correlated, len(readings)),
        ),
        correlation=correlated,
        tilt_gain=gain,
    )


#: Residuals relative to the spin: the best counters have noise of 1e-11 over a second, and tops are no such clocks.
NO_MEASUREMENT = 1e-10


def _too_good(best: LawFit) -> list[str]:
    """That readings are calculated ones."""
    stats, reference = best.statistics, best.reference[0]
    if stats.degrees_of_freedom < 1 or stats.rms_residual > NO_MEASUREMENT * reference:
        return []
    said = (
        f"the readings lie on the {best.name} law to {digits(stats.rms_residual, 1)} Hz, too good to be measured: "
        "were they calculated? Then no uncertainty here says anything about a top"
    )
    return [said]


def _about_jump(jump: Jump | None, readings: Readings) -> str:
    if jump is None:
        return ""
    before, after = readings.time[jump.index - 1], readings.time[jump.index]
    way = "up" if jump.size > 0 else "down"
    return f"they jump {way} by {digits(abs(jump.size))} Hz between {before:.4g} s and {after:.4g} s"


def _hidden(found: Solution, rho: float, wobble: Wobble) -> HiddenTilt | None:
    """A tilt that the readings do not demand."""
    if len(found.readings) < FEWEST_FOR_TILT or isinstance(found.law, CountedLaw):
        return None
    return hidden_tilt(found, noise(found, rho), wobble)


def is_correlated(found: Correlation | None) -> bool:
    """Whether noise is taken as correlated."""
    return found is not None and found.p < CORRELATED


def _judged(found: Mapping[str, Solution]) -> tuple[dict[str, Statistics], str, Correlation | None]:
    """The statistics, weighed, by which criterion, and the correlation of what the best law leaves over."""
    stats = {name: each.statistics for name, each in found.items()}
    weighed, criterion = weigh(stats)
    correlated = _correlation(found, weighed)
    if correlated and is_correlated(correlated):
        share = 1 / correlated.factor()
        weighed, criterion = weigh({name: replace(fit, n_effective=share * fit.n) for name, fit in stats.items()})
    left = [
        one.p_shape
        for name in _not_excluded(weighed)
        if (one := _correlation({name: found[name]}, {name: weighed[name]})) is not None
    ]
    if correlated and left:
        correlated = replace(correlated, p_shape=max(left))  # no law describes readings where none leaves noise
    return weighed, criterion, correlated


def _not_excluded(weighed: Mapping[str, Statistics]) -> list[str]:
    """The laws that are not excluded, best first."""
    return [name for name, fit in weighed.items() if fit.difference is not None and fit.difference <= EXCLUDED]


def _jump_of_all(found: Mapping[str, Solution], weighed: Mapping[str, Statistics]) -> Jump | None:
    """The jump that readings make about every law that is not excluded: the least improbable."""
    jumps = [_jump(found[name], found.get("power")) for name in _not_excluded(weighed)]
    certain = [jump for jump in jumps if jump is not None]
    return max(certain, key=lambda jump: jump.p) if certain and len(certain) == len(jumps) else None


def _jump(found: Solution, power: Solution | None) -> Jump | None:
    """A jump [Hz] of the readings about a law that no noise makes.

    Beside the jump the exponent is left free, for about a law that lies beside it all else would count as noise.
    """
    if float(found.residuals @ found.residuals) <= len(found.residuals) * (ROUNDING * found.weight_scale) ** 2:
        return None
    free = found.slopes if power is None or power is found else np.vstack([found.slopes, power.slopes])
    jump = largest_jump(found.residuals, free)
    if jump is None or jump.p >= NO_NOISE:
        return None
    weight = found.readings.weight
    usual = float(np.median(weight)) if isinstance(weight, np.ndarray) else weight
    return replace(jump, size=jump.size * found.readings.reference_hz / usual)


def _correlation(found: Mapping[str, Solution], weighed: Mapping[str, Statistics]) -> Correlation | None:
    """Of what the law with the fewest parameters leaves over that is not far behind the best.

    A law with more constants follows correlated noise, and seems the better for it.
    """
    near = [name for name, fit in weighed.items() if fit.difference is not None and fit.difference <= NOT_FAR]
    if not near:
        return None
    one = found[min(near, key=lambda name: found[name].n_parameters)]
    if float(one.residuals @ one.residuals) <= len(one.residuals) * (ROUNDING * one.weight_scale) ** 2:
        return None
    return correlation((one.residuals, one.slopes))


def _tilted(
    plain: Mapping[str, Solution], wobble: Wobble, *, wanted: bool | None
) -> tuple[float | None, dict[str, Solution]]:
    """ΔAICc in favour of the count's tilt, and the solutions with it, where it is demanded or wanted."""
    readings = next(iter(plain.values())).readings
    if len(readings) < FEWEST_FOR_TILT:
        return None, {}
    least = min(_aicc(found) for found in plain.values())
    laws = {name: _counted(found, wobble) for name, found in plain.items()}
    steps = {name: _one_step(found, laws[name]) for name, found in plain.items()}
    gain = least - min(steps.values())
    if wanted is False or (wanted is None and gain < TILT_WORTH_A_FIT):
        return (gain if np.isfinite(gain) else None), {}
    promising = {name: plain[name] for name, step in steps.items() if np.isfinite(step)}
    tilted = {name: each for name, found in promising.items() if (each := with_tilt(found, laws[name])) is not None}
    if not tilted:
        return 0.0, {}
    gain = min(map(_misfit, plain.values())) - min(map(_misfit, tilted.values()))
    return gain, (tilted if wanted or gain > TILT_DEMANDED else {})


def _counted(plain: Solution, wobble: Wobble = UNKNOWN_ORIGIN) -> CountedLaw:
    """The law of a solution with the count's tilt."""
    return CountedLaw(LAWS[plain.law.name], float(plain.readings.x[-1]), LAST_GAP, LAST_GAP_U, wobble)


def _misfit(found: Solution) -> float:
    """AICc with noise of unknown size and correlation: neither correlated noise nor a wrong u asks for a tilt."""
    n, e, k = len(found.residuals), found.residuals, found.n_parameters + 2
    if n - k < 2:
        return float("inf")
    squares, inner, neighbours = float(e @ e), float(e[1:-1] @ e[1:-1]), float(e[1:] @ e[:-1])
    rho = np.linspace(0.0, 0.95, 20)
    least = n * (ROUNDING * found.weight_scale) ** 2
    news = np.maximum((squares + rho**2 * inner - 2 * rho * neighbours) / (1 - rho**2), least)
    fit = float((n * np.log(news / n) + (n - 1) * np.log(1 - rho**2)).min())
    known = float(found.expected[1] @ found.expected[1]) / (1.0 if found.readings.sigma_known else scatter(found) ** 2)
    return fit + known + 2 * k + 2 * k * (k + 1) / (n - k - 1)


def _aicc(found: Solution) -> float:
    fit = found.statistics
    return float("inf") if fit.aicc is None else fit.aicc


def _one_step(plain: Solution, law: CountedLaw) -> float:
    """AICc with the tilt, as one step of a search from the solution without finds it; at no cost to speak of."""
    readings, stats = plain.readings, plain.statistics
    n, k = stats.n, stats.n_parameters + 1 + (not stats.sigma_known)
    if plain.curvature.covariance is None or n - k < 2:
        return float("inf")
    (more,) = bends(plain, law, [(0.004, law.gap, 0.0)])
    if not np.isfinite(more).all():
        return float("inf")
    q, _ = np.linalg.qr(plain.slopes.T)
    own = more - q @ (q.T @ more)
    size, along = float(own @ own), float(own @ plain.residuals)
    if along <= 0 or size <= 1e-12 * float(more @ more):
        return float("inf")
    left = float(plain.residuals @ plain.residuals) - along**2 / size
    least = n * (ROUNDING * readings.reference_hz) ** 2
    misfit = left if stats.sigma_known else n * float(np.log(max(left * readings.reference_hz**2, least) / n))
    return misfit + 2 * k + 2 * k * (k + 1) / (n - k - 1)


def _known(kind: str, names: Iterable[str], known: Iterable[str]) -> tuple[str, ...]:
    table, seen = tuple(known), tuple(dict.fromkeys(names))
    for name in seen or ("",):
        if name not in table:
            raise UnknownName(kind=kind, seen=name, known=table)
    return seen


@dataclass(frozen=True, eq=False)
class _Search:
    """Gross outliers: their indices, and the power law fitted to the others."""

    indices: NDArray[np.intp]
    power: Solution | None


def _search_outliers(readings: Readings) -> _Search:
    """Readings that lie too far from a power law fitted to the others, at most a tenth of them beside the miscounts.

    The worst goes first, then all is fitted anew: one at a time, or a hundredth of very many.  Near the fall it is the
    law that fails, not the reading: where the count's tilt explains what lies far away, that stays.
    """
    n = len(readings)
    if n < FEWEST_FOR_OUTLIERS:
        return _Search(np.empty(0, dtype=np.intp), None)
    left_out = _miscounts(readings)
    found = _far_from(readings, left_out, None)
    near_the_fall = (found.indices >= n - max(n // 4, 1)) & ~np.isin(found.indices, left_out)
    if not near_the_fall.any() or n - len(left_out) < FEWEST_FOR_TILT:
        return found
    kept = readings.without(left_out) if len(left_out) else readings
    plain = solution(LAWS["power"], kept)
    with np.errstate(all="ignore"):
        tilted = with_tilt(plain, _counted(plain))
    if tilted is None or _misfit(plain) - _misfit(tilted) < TILT_DEMANDED:
        return found
    other = _far_from(readings, left_out, tilted)
    if len(other.indices) >= len(found.indices):
        return found
    return replace(other, power=plain if len(other.indices) == len(left_out) else None)


def _far_from(readings: Readings, left_out: NDArray[np.intp], tilted: Solution | None) -> _Search:
    """The search, by the power law or, from a solution of it on, by the power law with the count's tilt."""
    n = len(readings)
    allowed = len(left_out) + max(1, n // 10)
    while True:
        kept = np.delete(np.arange(n), left_out)
        used = readings.without(left_out) if len(left_out) else readings
        if tilted is None:
            found = solution(LAWS["power"], used)
        else:
            found = solution(tilted.law, used, tilted.q, 1.0 if readings.sigma_known else scatter(tilted))
        most = min(allowed - len(left_out), max(1, n // 100))
        if found.degrees_of_freedom <= 1:
            worst, t = kept[:0], np.empty(0)
        else:
            floor = 1.0 if readings.sigma_known else ROUNDING  # a stated uncertainty is a scatter to be expected
            t = studentised(found.residuals, found.curvature.leverage, found.n_parameters, floor)
            worst = gross_errors(t, found.n_parameters)[:most]
        if not len(worst):
            return _Search(np.sort(left_out), found)
        left_out = np.append(left_out, kept[worst])


MISCOUNT, FAR, WINDOW = 0.25, 8.0, 5  # relative; robust standard deviations; readings that a median is taken over


def _miscounts(readings: Readings) -> NDArray[np.intp]:
    """Indices of readings off by a good part of themselves, as twice or half.

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
    found = solution(LAWS["power"], replace(readings, x=smooth))
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
        found = solution(LAWS["power"], readings.without(np.flatnonzero(far)))
    return np.flatnonzero(far)


#: A reading more times the others' residuals away than this is only said to be: all of them lie on the law then.
_MOST_TIMES = 1000


def _outlier_warnings(readings: Readings, outliers: NDArray[np.intp], best: LawFit, *, kept: bool) -> list[str]:
    """How far outliers lie from the best law, which was fitted to the others, or to all where they were kept.

    What they were found by is no measure of it: where the tilt alone follows the last reading, a fit without that
    reading is not known from one with it.
    """
    done = "was kept as asked" if kept else "was left out"
    off = np.abs(readings.frequency[outliers] - best.spin_frequency(readings.time[outliers]))
    own = np.delete(best.residuals, outliers) if kept else best.residuals
    rms = float(np.sqrt(np.mean(own**2)))
    units = np.full(len(off), rms) if readings.u is None else readings.u[outliers]
    measure = "the rms residual of the others" if readings.u is None else "its uncertainty"
    falling = _last_ones(outliers, len(readings))
    return [
        f"the reading of {readings.frequency[i]:.6g} Hz at {round(readings.time[i], 3):.12g} s lies "
        f"{digits(distance)} Hz from the {best.name} law, {_times(distance, unit)} {measure}, and {done}"
        f"{'; it stands at the end: the top may already have been falling' if i in falling else ''}"
        for i, distance, unit in zip(outliers.tolist(), off.tolist(), units.tolist(), strict=True)
    ]


def _times(distance: float, unit: float) -> str:
    """How many times a distance is a unit, in words."""
    many = distance >= _MOST_TIMES * unit
    return f"{f'more than {_MOST_TIMES}' if many else digits(distance / unit)} times"


def _last_ones(outliers: NDArray[np.intp], n: int) -> frozenset[int]:
    """Those after which no reading belongs to the law."""
    last = n - 1
    while last in outliers:
        last -= 1
    return frozenset(i for i in outliers.tolist() if i > last)


def comparison_warnings(fits: Mapping[str, Statistics], best: str, *, mixed: bool = False) -> list[str]:
    """What makes the comparison of laws, or their uncertainties, weaker than it looks.

    Args:
        fits: statistics by the law's name.
        best: name of the favoured law.
        mixed: whether some of several runs have uncertainties of their readings and others have none.
    """
    said = []
    if not fits[best].sigma_known and not mixed:
        said.append(
            "no uncertainties of the readings were given: they are taken from the scatter about each law, so a law "
            "that does not fit shows only beside one that fits better"
        )
    if fits[best].inflation > 1:
        birge = float(np.sqrt(fits[best].inflation))
        said.append(
            f"even the best law, {best}, misses the readings by {digits(birge)} times their stated uncertainties, more "
            "than chance explains: all uncertainties are enlarged by that ratio; check the readings' uncertainties"
        )
    known, probability = fits[best].sigma_known, _less_than_chance(fits[best])
    if known and probability < NO_FIT:
        ratio = float(np.sqrt(fits[best].reduced_chi_square or 0.0))
        said.append(
            f"the readings scatter only {digits(ratio)} times as much about the best law as their stated uncertainties "
            "say: are these too large?"
        )
    undefined = [name for name, fit in fits.items() if fit.aicc is None]
    if undefined:
        n = fits[best].n
        said.append(f"{n} readings are too few to compare {_listed(undefined)} by AICc: record more readings")
    return said


def correlation_warnings(found: Correlation | None, n: int) -> list[str]:
    """That neighbouring readings resemble each other, and what follows from it."""
    if found is None or not is_correlated(found):
        return []
    said = (
        f"neighbouring residuals resemble each other more than independent readings would (p = {digits(found.p)}): "
        f"their correlation is {found.value:.2f} ± {found.u:.2f}, so {n} readings are worth as much as "
        f"{digits(n / found.factor())} independent ones, and all uncertainties are enlarged accordingly"
    )
    return [said]


def _less_than_chance(fit: Statistics) -> float:
    """Probability of a χ² as small as this."""
    if fit.chi_square is None or fit.degrees_of_freedom < 1:
        return 1.0
    from scipy.special import gammainc

    return float(gammainc(fit.degrees_of_freedom / 2, fit.chi_square / 2))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)
