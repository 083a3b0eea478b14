"""One drag law fitted to the readings of one run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.budget import gate_bias
from analysis.least_squares import MOST_EVALUATIONS, TOLERANCE, profile, solve
from analysis.numbers import digits
from analysis.residuals import DENSE, ar1, durbin_watson, runs_test_p
from analysis.spindown.drag import LAWS, DragLaw
from analysis.spindown.readings import Readings
from analysis.spindown.selection import Statistics, statistics
from analysis.spindown.tilt import MORE, UNKNOWN_PART, UNKNOWN_TILT, CountedLaw, Law, counted
from analysis.uncertainty import ROUNDING, Curvature, Estimate, bootstrap, curvature, propagate

Array = NDArray[np.float64]
Uncertainty = Literal["covariance", "profile", "bootstrap"]
Intervals = Sequence[tuple[float, float] | None]

MOST_WITH_TILT = 60  # a law that the readings suit needs 5 to 15
# Its slopes are differences, good to 1e-7: a closer search creeps.  Parameters are within 1e-4 u of the minimum.
TOLERANCE_WITH_TILT = 1e-9
MAX_STATED_FACTOR = 3.0  # u(ln c) above which "known to a factor" says nothing


@dataclass(frozen=True, eq=False)
class HiddenTilt:
    """A tilt that may be there, though readings do not show it; `analysis.spindown.hidden` works it out.

    Attributes:
        probability: after the readings.
        spread: what it adds to the covariance of the dimensionless parameters, shape (p, p).
        shared: the part of that which is the same in all runs of one top, shape (p, p).
    """

    probability: float
    spread: Array
    shared: Array


@dataclass(frozen=True)
class Parts:
    """What u of a parameter is made of: the squares of the first five add up to u².

    Attributes:
        scatter: of independent readings: by their u where it was given, else by what they scatter about the law.
        excess: by as much they scatter more than their u says.
        correlation: of neighbouring readings.
        beforehand: what was known of the tilt's parameters before the readings, where they are fitted.
        tilt: what the model of the tilt leaves open, or what one that noise hides would do.
        gate: by as much the mean over a gate moves the parameter, with its sign; no part of u.  None: no gate is known.
    """

    scatter: float
    excess: float
    correlation: float
    beforehand: float
    tilt: float
    gate: float | None = None


@dataclass(frozen=True, eq=False)
class LawFit:
    """One drag law fitted to one run.

    Attributes:
        name: of the law, a key of `analysis.spindown.drag.LAWS`.
        parameters: start_frequency [Hz] (spin at `start_time`), then the constants of the law; where the count's tilt
            is in it, moment_tilt δ [rad], resonance ν_r [Hz] and wobble K [Hz], see `analysis.spindown.tilt`.
        covariance: of the parameters, in that order, shape (p, p); None where undefined.
        statistics: how well it fits.
        residuals: reading − fit [Hz], shape (n,).
        linearised: the constant by an unweighted straight line, where the law has one.
        warnings: what to know before using the numbers.
        start_time: time of the first reading [s].
        solution: the same parameters, dimensionless (see `analysis.spindown.drag`, and `tilt.counted`).
        reference: their units, spin frequency [Hz] and time [s].
        shared_u: by parameter, the part of its u that is the same for all runs of one top, with one sign.
        parts: by parameter, what u is made of; empty where u is undefined, and of results that were read back.
    """

    name: str
    parameters: dict[str, Estimate]
    covariance: Array | None
    statistics: Statistics
    residuals: Array
    linearised: dict[str, Estimate] | None
    warnings: tuple[str, ...]
    start_time: float
    solution: Array
    reference: tuple[float, float]
    shared_u: Mapping[str, float] = field(default_factory=dict)
    parts: Mapping[str, "Parts"] = field(default_factory=dict)

    @property
    def law(self) -> DragLaw:
        """The law."""
        return LAWS[self.name]

    def spin_frequency(self, time: ArrayLike) -> Array:
        """The fitted curve [Hz] at times [s] on the clock of the readings, shape (n,)."""
        frequency, duration = self.reference
        tau = (np.asarray(time, dtype=float) - self.start_time) / duration
        return frequency * counted(self.law, tau, self.solution)

    def forecast(self, time: ArrayLike, last: float) -> Array:
        """The spin [Hz] of a top that the law alone slows from where the fitted curve stands at the last reading.

        The count's tilt is left out: beyond the readings its curve runs into the resonance, which no top reaches.

        Args:
            time: on the clock of the readings, shape (n,) [s].
            last: time of the last reading [s].
        """
        frequency, duration = self.reference
        now = self.spin_frequency([last]) / frequency
        constants = self.solution[1 : len(self.law.parameters)]
        tau = (np.asarray(time, dtype=float) - last) / duration
        return frequency * self.law.spin(tau, np.concatenate([now, constants]))

    def u_spin_frequency(self, time: ArrayLike) -> Array | None:
        """The standard uncertainty of the fitted curve [Hz] at times [s], shape (n,); None where it is undefined.

        That of the parameters with their correlation, and nothing for the law itself.
        """
        if self.covariance is None:
            return None
        frequency, duration = self.reference
        tau = (np.asarray(time, dtype=float) - self.start_time) / duration
        steps = 1e-5 * np.maximum(np.abs(self.solution), 1e-3)
        slopes = np.array([
            (counted(self.law, tau, self.solution + step) - counted(self.law, tau, self.solution - step)) / (2 * size)
            for step, size in zip(np.diag(steps), steps, strict=True)
        ])  # fmt: skip
        try:
            of_parameters = np.linalg.solve(self._natural_slopes.T, frequency * slopes)
        except np.linalg.LinAlgError:
            return None
        variance = np.einsum("pn,pq,qn->n", of_parameters, self.covariance, of_parameters)
        return np.sqrt(np.maximum(variance, 0.0)) if np.isfinite(variance).all() else None

    @property
    def _natural_slopes(self) -> Array:
        """Of the parameters with the solution, shape (p, p)."""
        p, (frequency, duration) = len(self.law.parameters), self.reference
        slopes = np.eye(len(self.solution)) * frequency  # ν_r and K
        slopes[:p, :p] = self.law.natural(self.solution[:p], frequency, duration)[1]
        if self.has_tilt:
            slopes[p, p] = 1 / (2 * np.sqrt(self.solution[p]))  # δ, of δ²
        return slopes

    @property
    def has_tilt(self) -> bool:
        """Whether the count's tilt is in it."""
        return len(self.solution) > len(self.law.parameters)


@dataclass(frozen=True, eq=False)
class Solution:
    """The best point of one law for some readings, and the curvature there.

    Attributes:
        law: what was fitted.
        readings: to these.
        q: dimensionless parameters, shape (p,).
        converged: whether the search ended.
        residuals: (reading − fit)/u in dimensionless numbers, u = 1 where unknown, shape (n,).
        slopes: of fit/u with the parameters, shape (p, n).
        expected: slopes and residual of what was known beforehand, shapes (p, k), (k,); k is 0 or 2.
        curvature: covariance for u as given, and leverages.
    """

    law: Law
    readings: Readings
    q: Array
    converged: bool
    residuals: Array
    slopes: Array
    expected: tuple[Array, Array]
    curvature: Curvature

    @property
    def weight_scale(self) -> float:
        """The largest weight: by so much residuals are larger than in units of ν_ref."""
        return float(np.max(self.readings.weight))

    @cached_property
    def statistics(self) -> Statistics:
        """How well it fits."""
        readings = self.readings
        residuals = self.residuals / readings.weight * readings.reference_hz
        return statistics(
            n=len(readings),
            n_parameters=self.n_parameters,
            rss=float(residuals @ residuals),
            least_rss=len(readings) * (ROUNDING * readings.reference_hz) ** 2,
            chi_square=float(self.residuals @ self.residuals) if readings.sigma_known else None,
            durbin_watson=durbin_watson(self.residuals),
            runs_test_p=runs_test_p(self.residuals),
        )

    @property
    def n_parameters(self) -> int:
        """Those that the readings alone determine."""
        return len(self.q) - len(self.expected[1])

    @property
    def degrees_of_freedom(self) -> int:
        """Readings beyond the parameters."""
        return len(self.readings) - self.n_parameters


Function = Callable[[Array], Array]


def _objective(law: Law, readings: Readings, y: Array, scale: float) -> tuple[Function, Function]:
    """Residuals and their slopes for the spins y; scale: of one reading's, for what is known beforehand."""
    tau, weight = readings.tau, readings.weight
    if not isinstance(law, CountedLaw):
        return (lambda q: (law.spin(tau, q) - y) * weight), (lambda q: law.gradient(tau, q) * weight)
    known = law.expected

    def residual(q: Array) -> Array:
        return np.append((law.spin(tau, q) - y) * weight, [(q[i] - value) * scale / u for i, value, u in known])

    def gradient(q: Array) -> Array:
        rows = np.zeros((len(q), len(known)))
        for k, (i, _, u) in enumerate(known):
            rows[i, k] = scale / u
        return np.hstack([law.gradient(tau, q) * weight, rows])

    return residual, gradient


def solution(law: Law, readings: Readings, start: Array | None = None, scale: float = 1.0) -> Solution:
    """The least-squares solution of one law.

    Args:
        law: with the count's tilt or without.
        readings: what it is fitted to.
        start: of the search; None: by straight lines, for a law without the tilt.
        scale: of one residual, in the units of the weights; only for what is known of the tilt beforehand.
    """
    residual, gradient = _objective(law, readings, readings.x, scale)
    begin = _start(law, readings) if start is None and isinstance(law, DragLaw) else start
    assert begin is not None
    limits = (MOST_EVALUATIONS, TOLERANCE) if isinstance(law, DragLaw) else (MOST_WITH_TILT, TOLERANCE_WITH_TILT)
    q, converged = solve(residual, gradient, begin, *limits)
    n = len(readings)
    left, slopes = -residual(q), gradient(q)
    bent = curvature(slopes)
    return Solution(
        law,
        readings,
        q,
        converged,
        left[:n],
        slopes[:, :n],
        (slopes[:, n:], left[n:]),
        Curvature(bent.covariance, bent.leverage[:n]),
    )


def with_tilt(plain: Solution, law: CountedLaw) -> Solution | None:
    """The same law as a counter sees it; None where the readings ask for no tilt, or a negative one.

    Args:
        plain: the solution without.
        law: the same law, with the tilt.
    """
    readings = plain.readings
    start = np.array([*plain.q, 0.003, law.gap, law.wobble.value])
    found, scale = None, 1.0 if readings.sigma_known else scatter(plain)
    for _ in range(1 if readings.sigma_known else 2):
        found = solution(law, readings, start, scale)
        if not found.converged or not np.isfinite(found.residuals).all() or found.degrees_of_freedom < 1:
            return None
        start, scale = found.q, scatter(found)
    return found if found is not None and found.q[-MORE] > 0 and found.curvature.covariance is not None else None


def scatter(found: Solution) -> float:
    """Standard deviation of the residuals, in the units of the weights."""
    free = max(found.degrees_of_freedom, 1)
    return max(float(np.sqrt(found.residuals @ found.residuals / free)), ROUNDING)


def fit_law(
    found: Solution,
    uncertainty: Uncertainty,
    samples: int,
    seed: int,
    *,
    rho: float = 0.0,
    plain: Solution | None = None,
    hidden: HiddenTilt | None = None,
    gate: float | None = None,
) -> LawFit:
    """The solution in textbook constants, with uncertainties and statistics.

    Args:
        found: the solution.
        uncertainty: see `analysis.spindown.fit.fit_spin_down`.
        samples: of a bootstrap.
        seed: of a bootstrap.
        rho: correlation of neighbouring readings' noise.
        plain: the same law without the count's tilt, where `found` has it.
        hidden: a tilt that the readings may hide, which is to be in the uncertainties.
        gate: over which each reading is a mean [s]; None: not known.
    """
    law, readings = found.law, found.readings
    values, slopes = law.natural(found.q, readings.reference_hz, readings.duration)
    stats = found.statistics
    covariance, u, independent = _uncertainties(found, slopes, rho)
    intervals = _INTERVALS[uncertainty](found, values, independent, samples, seed)
    by_readings, of_tilt = u, np.zeros(len(values))
    shared = np.zeros(len(values))
    if plain is not None:
        shared = _unknown_part(values, _natural(plain))
        covariance, u = None if covariance is None else covariance + np.outer(shared, shared), np.hypot(u, shared)
        of_tilt = np.abs(shared)
    if hidden is not None:
        more, u_more = propagate(hidden.spread, slopes)
        covariance = None if covariance is None or more is None else covariance + more
        u, shared, of_tilt = np.hypot(u, u_more), propagate(hidden.shared, slopes)[1], u_more
    intervals = [
        _stretched(interval, float(value), float(wide / own) if own > 0 else 1.0)
        for interval, value, wide, own in zip(intervals, values, u, independent, strict=True)
    ]
    # c = κ/(T ω_refᵐ) can leave the range of floats, to infinity or to zero
    representable = np.isfinite(values) & ((values != 0) | (found.q == 0))
    parameters = {
        name: Estimate(
            float(value) if fine else None, float(sigma) if fine and np.isfinite(sigma) else None, unit, interval
        )
        for name, value, fine, sigma, unit, interval in zip(
            law.parameters, values, representable, u, law.parameter_units, intervals, strict=True
        )
    }
    of_drag = law.law if isinstance(law, CountedLaw) else law
    return LawFit(
        name=law.name,
        parameters=parameters,
        covariance=covariance if representable.all() else None,
        statistics=stats,
        residuals=readings.reference_hz * (readings.x - law.spin(readings.tau, found.q)),
        linearised=linearised(of_drag, readings) if len(law.orders) == 1 else None,
        warnings=_warnings(found, parameters, intervals, asked=uncertainty),
        start_time=readings.start_time,
        solution=law.solution(found.q) if isinstance(law, CountedLaw) else found.q,
        reference=(readings.reference_hz, readings.duration),
        shared_u={
            name: abs(float(part)) for name, part in zip(law.parameters, shared, strict=True) if np.isfinite(part)
        },
        parts=_parts(found, slopes, (independent, by_readings, of_tilt), gate),
    )


def _natural(found: Solution) -> Array:
    return found.law.natural(found.q, found.readings.reference_hz, found.readings.duration)[0]


def _uncertainties(found: Solution, slopes: Array, rho: float) -> tuple[Array | None, Array, Array]:
    """Covariance and u of the textbook parameters for noise of a correlation, and u for independent noise.

    Of correlated noise the least-squares solution has the covariance H (J R Jᵀ + E Eᵀ) H, H = (JJᵀ + E Eᵀ)⁻¹, and the
    residuals have the mean square tr(MR)/n: a fit follows such noise (GUM F.1.2.3; D. Cochrane & G. H. Orcutt,
    J. Am. Stat. Assoc. 44, 32 (1949)).
    """
    h, undefined = found.curvature.covariance, np.full(len(slopes), np.nan)
    if h is None:
        return None, undefined, undefined
    n, (beforehand, _) = len(found.readings), found.expected
    scale = np.sqrt(np.diagonal(h))  # the parameters differ by orders of magnitude

    variance = _variance(found, float(found.degrees_of_freedom), correlated=False)
    if variance is None:
        return None, undefined, undefined
    covariance, independent = propagate(h * variance, slopes)
    if rho <= 0:
        return covariance, independent, independent
    j = found.slopes * scale[:, None]
    noise = j @ ar1(n, rho) @ j.T if n <= DENSE else j @ j.T * (1 + rho) / (1 - rho)
    known = beforehand * scale[:, None]
    unit = h / np.outer(scale, scale)
    # M = 1 − JᵀHJ: what the fit follows is lost from the residuals, with independent noise p of n parts
    free = n - float(np.trace(unit @ noise))
    larger = _variance(found, free, correlated=True)
    assert larger is not None
    # what was known beforehand does not become less certain with the readings
    full = unit @ (noise * larger + known @ known.T * (1.0 if found.readings.sigma_known else variance)) @ unit
    wide, u = propagate(full * np.outer(scale, scale), slopes)
    grown = np.fmax(u, independent)  # no less than for independent noise, whatever rounding does
    if wide is not None:
        ratio = np.divide(grown, u, out=np.ones_like(u), where=u > 0)
        wide = wide * np.outer(ratio, ratio)
    return wide, grown, independent


def _parts(found: Solution, slopes: Array, sizes: tuple[Array, Array, Array], gate: float | None) -> dict[str, Parts]:
    """What the uncertainties of the parameters are made of.

    Args:
        found: the solution.
        slopes: of the textbook parameters, shape (p, p).
        sizes: u for independent noise, u with correlated noise, and what a tilt adds to that, shape (p,) each.
        gate: of a reading [s].
    """
    independent, by_readings, of_tilt = sizes
    h = found.curvature.covariance
    if h is None or not np.isfinite(by_readings).all():
        return {}
    known = h @ found.expected[0]
    prior = propagate(known @ known.T, slopes)[1] if known.size else np.zeros(len(slopes))
    enlarged = found.statistics.inflation if found.readings.sigma_known else 1.0
    variance = _variance(found, float(found.degrees_of_freedom), correlated=False) or 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        prior = np.minimum(prior * np.sqrt(variance), independent)
        scatter = np.sqrt(independent**2 - prior**2) / np.sqrt(enlarged)
        excess = scatter * np.sqrt(enlarged - 1)
        more = np.sqrt(np.maximum(by_readings**2 - independent**2, 0.0))
        moved = None if gate is None else _moved_by_gate(found, slopes, gate)
    rows = np.array([scatter, excess, more, prior, of_tilt]).T
    return {
        name: _part(row, None if moved is None or not np.isfinite(moved[k]) else float(moved[k]))
        for k, (name, row) in enumerate(zip(found.law.parameters, rows, strict=True))
        if np.isfinite(row).all()
    }


def _part(row: Array, gate: float | None) -> Parts:
    scatter, excess, correlation, beforehand, tilt = row.tolist()
    return Parts(scatter, excess, correlation, beforehand, tilt, gate)


def _moved_by_gate(found: Solution, slopes: Array, gate: float) -> Array:
    """By how much means over a gate [s] move the parameters, shape (p,)."""
    readings = found.readings
    half = min(gate / readings.duration / 2, 0.5)
    middle = np.clip(readings.tau, half, 1 - half)
    before, here, after = (found.law.spin(tau, found.q) for tau in (middle - half, middle, middle + half))
    bias = gate_bias(before, here, after) * readings.weight
    assert found.curvature.covariance is not None
    return np.asarray(slopes @ (found.curvature.covariance @ (found.slopes @ bias)))


def _unknown_part(values: Array, plain: Array) -> Array:
    """What of the tilt's change in the constants is not known, shape (p,): it is the same in all runs of one top."""
    change = np.zeros(len(values))
    with np.errstate(invalid="ignore", over="ignore"):
        change[: len(plain)] = UNKNOWN_PART * (values[: len(plain)] - plain)
        change[len(plain)] = UNKNOWN_TILT * values[len(plain)]
    return change if np.isfinite(change).all() else np.zeros(len(values))


def noise(found: Solution, rho: float) -> float:
    """Standard deviation of a reading in units of its u; correlated noise as if it were so much larger."""
    variance = _variance(found, float(found.degrees_of_freedom), correlated=False)
    return float("nan") if variance is None else float(np.sqrt(variance * (1 + rho) / (1 - rho)))


def _stretched(interval: tuple[float, float] | None, value: float, by: float) -> tuple[float, float] | None:
    """An interval for independent noise, as much wider as u is."""
    if interval is None or not np.isfinite(by) or by == 1.0:
        return interval
    return value - (value - interval[0]) * by, value + (interval[1] - value) * by


def _variance(found: Solution, free: float, *, correlated: bool) -> float | None:
    """Of the residuals in units of the stated one: 1, or by how much they are too large to be chance (Birge)."""
    squares = float(found.residuals @ found.residuals)
    if found.readings.sigma_known:
        if correlated:  # χ² of correlated noise scatters more than its own distribution says
            return max(1.0, squares / max(free, 1.0))
        return found.statistics.inflation
    if found.degrees_of_freedom == 0:
        return None
    return max(squares / max(free, 1.0), ROUNDING**2)


def straight_line(x: Array, y: Array, weight: Array | None = None) -> tuple[float, float, float | None]:
    """Intercept and slope of a straight line, and the slope's standard error by the scatter about it.

    Args:
        x: shape (n,).
        y: shape (n,).
        weight: 1/u², shape (n,); None: all alike.
    """
    w = np.ones_like(x) if weight is None else weight
    total = w.sum()
    centre, height = float(w @ x / total), float(w @ y / total)
    dx = x - centre
    spread = float(w @ dx**2)
    slope = float(w @ (dx * (y - height))) / spread
    rest = y - height - slope * dx
    free = len(x) - 2
    return height - slope * centre, slope, float(np.sqrt(w @ rest**2 / free / spread)) if free > 0 else None


def _straightened(x: Array, m: float) -> Array:
    """What falls or rises in a straight line, of slope κ, under a power law of order m."""
    return -np.log(x) if m == 0 else x**-m / m


def linearised(law: DragLaw, readings: Readings) -> dict[str, Estimate]:
    """The thesis's way: the unweighted straight line through ln ω, 1/ω or ω^(−1/2), on which noise weighs unevenly."""
    (m,) = law.orders
    omega = 2 * np.pi * readings.frequency
    _, slope, u = straight_line(readings.time - readings.start_time, _straightened(omega, m))
    return {law.constants[0]: Estimate(slope, u, law.units[0])}


def _start(law: DragLaw, readings: Readings) -> Array:
    """Parameters to start from: the same straight line, weighted; the disc's for laws with two constants."""
    m = law.orders[0] if len(law.orders) == 1 else 0.5
    weight = (readings.x ** (m + 1) * readings.weight) ** 2
    intercept, kappa, _ = straight_line(readings.tau, _straightened(readings.x, m), weight)
    if m == 0:
        x0 = float(np.exp(-intercept))
    else:
        x0 = float((m * intercept) ** (-1 / m)) if intercept > 0 else float(readings.x[0])
    if len(law.orders) == 1:
        return np.array([x0, kappa])
    return np.array([x0, kappa, m] if not law.orders else [x0, kappa / 2, kappa / 2])


def _no_intervals(found: Solution, values: Array, u: Array, samples: int, seed: int) -> Intervals:  # noqa: ARG001
    return [None] * len(values)


def _profile(found: Solution, values: Array, u: Array, samples: int, seed: int) -> Intervals:  # noqa: ARG001
    law, readings = found.law, found.readings
    units = readings.reference_hz, readings.duration
    if not (np.isfinite(u) & (u > 0)).all() or found.degrees_of_freedom == 0:
        return [None] * len(values)
    of, slopes = _objective(law, readings, readings.x, 1.0 if readings.sigma_known else scatter(found))

    def residual(natural: Array) -> Array:
        return of(law.dimensionless(natural, *units))

    def gradient(natural: Array) -> Array:
        q = law.dimensionless(natural, *units)
        return np.asarray(np.linalg.solve(law.natural(q, *units)[1].T, slopes(q)))

    return profile(residual, gradient, values, u, found.statistics.inflation if readings.sigma_known else None)


def _bootstrap(found: Solution, values: Array, u: Array, samples: int, seed: int) -> Intervals:
    law, readings = found.law, found.readings
    if not np.isfinite(u).all() or found.degrees_of_freedom == 0:
        return [None] * len(values)
    fitted, scale = law.spin(readings.tau, found.q), 1.0 if readings.sigma_known else scatter(found)

    def refit(errors: Array) -> Array:
        q, _ = solve(*_objective(law, readings, fitted + errors / readings.weight, scale), found.q)
        return law.natural(q, readings.reference_hz, readings.duration)[0]

    return bootstrap(refit, found.residuals, found.curvature.leverage, samples=samples, seed=seed)


_INTERVALS: dict[str, Callable[[Solution, Array, Array, int, int], Intervals]] = {
    "covariance": _no_intervals,
    "profile": _profile,
    "bootstrap": _bootstrap,
}
UNCERTAINTIES = tuple(_INTERVALS)


def _warnings(
    found: Solution, parameters: dict[str, Estimate], intervals: Intervals, *, asked: Uncertainty
) -> tuple[str, ...]:
    name, said = found.law.name, []
    if not found.converged:
        said.append(f"{name}: the search for the best fit did not end, the numbers are those of the best point found")
    if not found.readings.sigma_known and found.degrees_of_freedom == 0:
        said.append(
            f"{name}: {found.n_parameters} parameters pass through {found.n_parameters} readings, so nothing shows "
            "their uncertainty: record more readings, or state the uncertainty of each"
        )
    elif found.curvature.covariance is None:
        said.append(f"{name}: the readings do not separate the parameters, so these have no uncertainty")
    if asked != "covariance" and None in intervals:
        said.append(f"{name}: no {asked} interval was found for {_without_interval(parameters)}")
    for constant in found.law.constants:
        said.extend(_constant_warnings(name, constant, parameters[constant]))
    return tuple(said)


def _without_interval(parameters: dict[str, Estimate]) -> str:
    return ", ".join(name for name, estimate in parameters.items() if estimate.interval is None)


def _constant_warnings(law: str, constant: str, estimate: Estimate) -> list[str]:
    value, u = estimate.value, estimate.u
    if value is None:
        return [
            f"{law}: {constant} is too large or too small for a number, as it depends exponentially on the exponent"
        ]
    if u is None:
        return []
    said = []
    if value < -2 * u and constant != "exponent":
        said.append(f"{law}: {constant} is negative by {-value / u:.1f} standard uncertainties, which no drag can be")
    if constant == "c" and u > MAX_STATED_FACTOR * abs(value):
        said.append(f"{law}: c is not determined, as it depends exponentially on the exponent")
    elif constant == "c" and u > 0.5 * abs(value):
        said.append(
            f"{law}: c is known only to a factor of about {digits(np.exp(u / abs(value)))}, as it depends "
            "exponentially on the exponent"
        )
    return said
