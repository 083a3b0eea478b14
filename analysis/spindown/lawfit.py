"""One drag law fitted to the readings of one run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.least_squares import profile, solve
from analysis.residuals import durbin_watson, runs_test_p
from analysis.spindown.drag import LAWS, DragLaw
from analysis.spindown.readings import Readings
from analysis.spindown.selection import Statistics, statistics
from analysis.uncertainty import Curvature, Estimate, bootstrap, curvature, propagate

Array = NDArray[np.float64]
Uncertainty = Literal["covariance", "profile", "bootstrap"]
Intervals = Sequence[tuple[float, float] | None]

FACTOR_TOLD = 3.0  # u(ln c) above which "known to a factor" says nothing
ROUNDING = 64 * float(np.finfo(float).eps)  # relative: residuals below it are the computer's, not the top's


@dataclass(frozen=True, eq=False)
class LawFit:
    """One drag law fitted to one run.

    Attributes:
        name: of the law, a key of `analysis.spindown.drag.LAWS`.
        parameters: start_frequency [Hz] (spin at `start_time`), then the constants of the law.
        covariance: of the parameters, in that order, shape (p, p); None where undefined.
        statistics: how well it fits.
        residuals: reading − fit [Hz], shape (n,).
        linearised: the constant by an unweighted straight line, where the law has one.
        warnings: what to know before using the numbers.
        start_time: time of the first reading [s].
        solution: the same parameters as fitted, dimensionless (see `analysis.spindown.drag`).
        reference: their units, spin frequency [Hz] and time [s].
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

    @property
    def law(self) -> DragLaw:
        """The law."""
        return LAWS[self.name]

    def spin_frequency(self, time: ArrayLike) -> Array:
        """The fitted curve [Hz] at times [s] on the clock of the readings, shape (n,)."""
        frequency, duration = self.reference
        tau = (np.asarray(time, dtype=float) - self.start_time) / duration
        return frequency * self.law.spin(tau, self.solution)


@dataclass(frozen=True, eq=False)
class Solution:
    """The best point of one law for some readings, and the curvature there.

    Attributes:
        law: what was fitted.
        readings: to these.
        q: dimensionless parameters, shape (p,).
        converged: whether the search ended.
        residuals: (reading − fit)/u in dimensionless numbers, u = 1 where unknown, shape (n,).
        curvature: covariance for u as given, and leverages.
    """

    law: DragLaw
    readings: Readings
    q: Array
    converged: bool
    residuals: Array
    curvature: Curvature

    @property
    def degrees_of_freedom(self) -> int:
        """Readings beyond the parameters."""
        return len(self.readings) - len(self.q)


def solution(law: DragLaw, readings: Readings) -> Solution:
    """The least-squares solution of one law."""
    tau, x, weight = readings.tau, readings.x, readings.weight
    q, converged = solve(
        lambda q: (law.spin(tau, q) - x) * weight, lambda q: law.gradient(tau, q) * weight, _start(law, readings)
    )
    return Solution(
        law, readings, q, converged, (x - law.spin(tau, q)) * weight, curvature(law.gradient(tau, q) * weight)
    )


def fit_law(found: Solution, uncertainty: Uncertainty, samples: int, seed: int) -> LawFit:
    """The solution in textbook constants, with uncertainties and statistics."""
    law, readings = found.law, found.readings
    values, slopes = law.natural(found.q, readings.reference_hz, readings.duration)
    stats = _statistics(found)
    variance = _variance(found, stats)
    covariance, u = None, np.full(len(values), np.nan)
    if variance is not None and found.curvature.covariance is not None:
        covariance, u = propagate(found.curvature.covariance * variance, slopes)
    intervals = _INTERVALS[uncertainty](found, values, u, samples, seed)
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
    return LawFit(
        name=law.name,
        parameters=parameters,
        covariance=covariance if representable.all() else None,
        statistics=stats,
        residuals=readings.reference_hz * (readings.x - law.spin(readings.tau, found.q)),
        linearised=linearised(law, readings) if len(law.orders) == 1 else None,
        warnings=_warnings(found, parameters, intervals, asked=uncertainty),
        start_time=readings.start_time,
        solution=found.q,
        reference=(readings.reference_hz, readings.duration),
    )


def _statistics(found: Solution) -> Statistics:
    readings = found.readings
    residuals = found.residuals / readings.weight * readings.reference_hz
    return statistics(
        n=len(readings),
        n_parameters=len(found.q),
        rss=float(residuals @ residuals),
        least_rss=len(readings) * (ROUNDING * readings.reference_hz) ** 2,
        chi_square=float(found.residuals @ found.residuals) if readings.sigma_known else None,
        durbin_watson=durbin_watson(found.residuals),
        runs_test_p=runs_test_p(found.residuals),
    )


def _variance(found: Solution, stats: Statistics) -> float | None:
    """Of the residuals in units of the stated one: 1, or by how much they are too large to be chance (Birge)."""
    if found.readings.sigma_known:
        return stats.inflation
    if found.degrees_of_freedom == 0:
        return None
    return max(float(found.residuals @ found.residuals) / found.degrees_of_freedom, ROUNDING**2)


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

    def residual(natural: Array) -> Array:
        return (law.spin(readings.tau, law.dimensionless(natural, *units)) - readings.x) * readings.weight

    def gradient(natural: Array) -> Array:
        q = law.dimensionless(natural, *units)
        rows = law.gradient(readings.tau, q) * readings.weight
        return np.asarray(np.linalg.solve(law.natural(q, *units)[1].T, rows))

    return profile(residual, gradient, values, u, _statistics(found).inflation if readings.sigma_known else None)


def _bootstrap(found: Solution, values: Array, u: Array, samples: int, seed: int) -> Intervals:
    law, readings = found.law, found.readings
    if not np.isfinite(u).all() or found.degrees_of_freedom == 0:
        return [None] * len(values)
    fitted = law.spin(readings.tau, found.q)

    def refit(errors: Array) -> Array:
        drawn = fitted + errors / readings.weight
        q, _ = solve(
            lambda q: (law.spin(readings.tau, q) - drawn) * readings.weight,
            lambda q: law.gradient(readings.tau, q) * readings.weight,
            found.q,
        )
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
            f"{name}: {len(found.q)} parameters pass through {len(found.q)} readings, so nothing tells their "
            "uncertainty: record more readings, or state the uncertainty of each"
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
    if constant == "c" and u > FACTOR_TOLD * abs(value):
        said.append(f"{law}: c is not determined, as it depends exponentially on the exponent")
    elif constant == "c" and u > 0.5 * abs(value):
        said.append(
            f"{law}: c is known only to a factor of about {np.exp(u / abs(value)):.2g}, as it depends "
            "exponentially on the exponent"
        )
    return said
