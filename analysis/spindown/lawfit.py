"""One drag law fitted to the readings of one run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from analysis.arrays import Array
from analysis.budget import gate_bias
from analysis.least_squares import solve
from analysis.remarks import Remark
from analysis.residuals import durbin_watson, runs_test_p, studentise
from analysis.spindown.drag import LAWS, DragLaw
from analysis.spindown.posterior import RHO, STATED_FREEDOM, Noise, Posterior, posterior, probability
from analysis.spindown.readings import Readings
from analysis.spindown.selection import Statistics, statistics
from analysis.spindown.tilt import ACCURACY, MORE, THESIS_TOP, CountedLaw, Release, Top, count_of
from analysis.uncertainty import ROUNDING, Estimate, propagate

#: A search ends where a step promises to move the parameters by no more of their u; it has converged where a whole
#: step, without damping, promises no more than one: with u near the accuracy of the count no step leads closer.
_CLOSE, _CONVERGED = 0.05, 1.0
_MOST_STEPS = 200  # a law that fits takes 5, one that fits badly up to 100
_DAMPING = 1e-3  # of the first step, relative to the squares of the slopes
#: With fewer readings beyond all parameters law and tilt fit any noise, and s at its mode falls to zero: it is held
#: in each search, as by _HELD readings, and settles from the scatter about the law with the tilt that is expected.
_FEW, _HELD, _SEARCHES = 4, 1_000_000, 3
#: Of more readings means over neighbours are fitted, for which a spin-down is straight within the noise.
_MOST = 3000
#: Of ln of the spin that the air takes from a driven top: after ten minutes the nutation no longer grows, or it falls.
_MOST_LOST = 2.0
MAX_STATED_FACTOR = 3.0  # u(ln c) above which "known to a factor" says nothing


@dataclass(frozen=True)
class Parts:
    """What u of a parameter is made of: the squares of the first four add up to u².

    Attributes:
        scatter: of independent readings: as large as their stated u, or as the scatter about the law where none is.
        excess: scatter beyond the stated u.
        correlation: of neighbouring readings, and what is not known of it.
        tilt: what is not known of the tilt of the moment and of the nutation.
        gate: signed bias of the parameter from averaging over the gate; not part of u.  None: no gate is known.
    """

    scatter: float
    excess: float
    correlation: float
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
        remarks: what to know before using the numbers.
        start_time: time of the first reading [s].
        solution: the same parameters, dimensionless (see `analysis.spindown.drag`, and `tilt.counted`).
        reference: their units, spin frequency [Hz] and time [s].
        top: whose count it is, as the readings move κ and β.
        shared_u: by parameter, the part of its u that is the same for all runs of one top, with one sign.
        parts: by parameter, what u is made of; empty where u is undefined.
        rho: correlation of neighbouring readings' noise; None where undefined, or known.
    """

    name: str
    parameters: dict[str, Estimate]
    covariance: Array | None
    statistics: Statistics
    residuals: Array
    linearised: dict[str, Estimate] | None
    remarks: tuple[Remark, ...]
    start_time: float
    solution: Array
    reference: tuple[float, float]
    top: Top = THESIS_TOP
    shared_u: Mapping[str, float] = field(default_factory=dict)
    parts: Mapping[str, Parts] = field(default_factory=dict)
    rho: Estimate | None = None

    @property
    def law(self) -> DragLaw:
        """The law."""
        return LAWS[self.name]

    def spin_frequency(self, time: ArrayLike) -> Array:
        """Return the fitted curve [Hz] at times [s] on the clock of the readings, shape (n,)."""
        frequency, duration = self.reference
        tau = (np.asarray(time, dtype=float) - self.start_time) / duration
        return frequency * count_of(self.law, tau, self.solution, self.top)

    def forecast(self, time: ArrayLike, last: float) -> Array:
        """Return the spin [Hz] of a top that the law alone slows, through the fitted curve at one reading.

        The count's tilt is left out: beyond the readings its curve runs into the resonance, which no top reaches.

        Args:
            time: on the clock of the readings, shape (n,) [s].
            last: time of the last reading, or of the first one for times before it [s].
        """
        frequency, duration = self.reference
        now = self.spin_frequency([last]) / frequency
        constants = self.solution[1 : len(self.law.parameters)]
        tau = (np.asarray(time, dtype=float) - last) / duration
        return frequency * self.law.spin(tau, np.concatenate([now, constants]))

    def u_spin_frequency(self, time: ArrayLike) -> Array | None:
        """Return the standard uncertainty of the fitted curve [Hz] at times [s], shape (n,); None if undefined.

        That of the parameters with their correlation, and nothing for the law itself.
        """
        if self.covariance is None:
            return None
        frequency, duration = self.reference
        tau = (np.asarray(time, dtype=float) - self.start_time) / duration
        steps = 1e-5 * np.maximum(np.abs(self.solution), 1e-3)
        slopes = np.array([
            (count_of(self.law, tau, self.solution + step, self.top)
            - count_of(self.law, tau, self.solution - step, self.top)) / (2 * size)
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
            # δ, of δ²; near zero the u of δ is no larger than the root of the u of δ²
            slopes[p, p] = 1 / (2 * float(np.sqrt(max(self.solution[p], 1e-8))))
        return slopes

    @property
    def has_tilt(self) -> bool:
        """Whether the count's tilt is in it."""
        return len(self.solution) > len(self.law.parameters)


@dataclass(frozen=True, eq=False)
class Solution:
    """The best point of one law for some readings, and what the readings say about its neighbourhood.

    Attributes:
        law: of the drag.
        counted: the same with the tilt; None where the count has none.
        readings: to which it was fitted.
        q: dimensionless parameters, shape (p,), with those of the tilt at the end.
        converged: whether the search did.
        residuals: (reading − fit)/u in dimensionless numbers, u = 1 where unknown, shape (n,).
        slopes: of fit/u with the parameters, shape (p, n).
        posterior: None where the parameters cannot be separated.
    """

    law: DragLaw
    counted: CountedLaw | None
    readings: Readings
    q: Array
    converged: bool
    residuals: Array
    slopes: Array
    posterior: Posterior | None

    @property
    def form(self) -> DragLaw | CountedLaw:
        """The law as it was fitted."""
        return self.counted or self.law

    @cached_property
    def statistics(self) -> Statistics:
        """How well it fits."""
        readings = self.readings
        residuals = self.residuals / readings.weight * readings.reference_hz
        n, stated = len(readings), readings.sigma_known
        least = float(n * np.log(ROUNDING**2)) if self.posterior is None else self.posterior.misfit
        # without stated u residuals are in units of ν_ref
        misfit = least if stated else least + 2 * n * float(np.log(readings.reference_hz))
        return statistics(
            n=n,
            n_parameters=len(self.law.parameters),
            rss=float(residuals @ residuals),
            chi_square=float(self.residuals @ self.residuals) if stated else None,
            misfit=misfit,
            durbin_watson=durbin_watson(self.residuals),
            runs_test_p=runs_test_p(self.residuals),
        )

    @property
    def degrees_of_freedom(self) -> int:
        """Readings beyond the parameters of the law."""
        return len(self.readings) - len(self.law.parameters)

    def studentise(self, floor: float) -> Array:
        """Return each residual in units of the scatter of the others, shape (n,).

        What is expected of the tilt counts as more readings: the last one alone may determine the tilt.

        Args:
            floor: the scatter is taken to be no smaller than this.
        """
        found = self.posterior
        if found is None or self.degrees_of_freedom < 2:
            return np.zeros(len(self.readings))
        expected, u = self.counted.expected if self.counted else (np.empty(0), np.empty(0))
        p, sigma = len(self.q) - len(u), np.sqrt(found.variance)
        left = np.append(self.residuals, sigma * (self.q[p:] - expected) / u)
        own = np.append(
            np.einsum("pn,pq,qn->n", self.slopes, found.covariance, self.slopes) / found.variance,
            np.diagonal(found.covariance)[p:] / u**2,
        )
        return studentise(left, np.clip(own, 0.0, 1.0), len(self.q), floor)[: len(self.readings)]


def solution(
    law: DragLaw,
    readings: Readings,
    *,
    tilt: bool = False,
    top: Top = THESIS_TOP,
    release: Release | None = None,
    rho: Array = RHO,
) -> Solution:
    """Return the best point of one law: the mean of what is known after the readings.

    Args:
        law: of the drag.
        readings: what it is fitted to.
        tilt: whether the count has the tilt of the top.
        top: whose count it is.
        release: see `fit_spin_down`.
        rho: correlations of neighbouring readings' noise that are possible.
    """
    few = readings.means(_MOST)
    tau, weight = few.tau, few.weight
    q, _ = solve(
        lambda q: (law.spin(tau, q) - few.x) * weight, lambda q: law.gradient(tau, q) * weight, _start(law, few)
    )
    with_tilt = _with_tilt(law, readings, q, top, release) if tilt else None
    form: DragLaw | CountedLaw = with_tilt or law
    expected, u = with_tilt.expected if with_tilt else (np.empty(0), np.empty(0))
    q, converged, found = _search(form, few, np.concatenate([q, expected]), (expected, u), rho)
    left, slopes = _of_readings(form, readings, q)
    return Solution(law, with_tilt, readings, q, converged, left, slopes, found)


def _with_tilt(law: DragLaw, readings: Readings, q: Array, top: Top, release: Release | None) -> CountedLaw:
    """Return a law with the tilt; q: of the law alone, by which the air slowed the top while it was driven."""
    first, last, unit = float(readings.x[0]), float(readings.x[-1]), readings.reference_hz
    if release is None:
        return CountedLaw(law, first, last, unit, top)
    released = release.spin_hz / unit
    middle = np.array([np.sqrt(released * first)])
    per_duration = float(law.slowing(middle, q)[0] / middle[0])
    lost = max(per_duration, 0.0) * release.driven_s / readings.duration
    return CountedLaw(law, first, last, unit, top, released, min(lost, _MOST_LOST))


def _search(
    form: DragLaw | CountedLaw, readings: Readings, start: Array, prior: tuple[Array, Array], rho: Array
) -> tuple[Array, bool, Posterior | None]:
    """Return the mean of what is known after the readings, whether the search converged, and the posterior.

    The most probable point is searched for by damped steps (K. Levenberg & D. Marquardt; how damping follows the gain:
    H. B. Nielsen, IMM-REP-1999-05, Technical University of Denmark), and the posterior is linear about it.

    Args:
        form: the law, or the count under it.
        readings: to which it is fitted.
        start: first parameters, shape (p,).
        prior: expected values and u of the last parameters, those of the tilt, shapes (k,).
        rho: correlations of neighbouring readings' noise that are possible.
    """
    n, p, law = len(readings), len(start), len(start) - len(prior[0])
    rounding = ROUNDING * float(np.max(readings.weight))
    if readings.sigma_known or n - p >= _FEW:
        least = ACCURACY / ROUNDING * rounding if law < p else rounding
        noise = Noise(STATED_FREEDOM if readings.sigma_known else 0, STATED_FREEDOM * readings.sigma_known, least, rho)
        return _climb(form, readings, start, prior, (noise, noise))
    left, slopes = _of_readings(form, readings, start)
    if np.isfinite(slopes).all():
        left = left - slopes[:law].T @ np.linalg.lstsq(slopes[:law].T, left, rcond=None)[0]
    variance = max(float(left @ left) / max(n - law, 1), rounding**2)
    settling, q = Noise(0, 0.0, rounding, rho, variance), start
    for _ in range(_SEARCHES):
        held = Noise(_HELD, _HELD * variance, rounding, rho)
        q, converged, found = _climb(form, readings, q, prior, (held, settling))
        variance = found.variance if found else variance
    return q, converged, found


def _climb(
    form: DragLaw | CountedLaw, readings: Readings, start: Array, prior: tuple[Array, Array], noises: tuple[Noise, ...]
) -> tuple[Array, bool, Posterior | None]:
    """Return the same, for what is known of the noise in the search and at its end."""
    (expected, u), p, law = prior, len(start), len(start) - len(prior[0])
    q, tried, value, promised, damping, growth = start, start, np.inf, np.inf, _DAMPING, 2.0
    with np.errstate(all="ignore"):
        for _ in range(_MOST_STEPS):
            here = (readings.time, *_of_readings(form, readings, tried), (expected - tried[law:], u), noises[0])
            now, rows = probability(*here)
            if now < value:
                gain = (value - now) / max(promised, ROUNDING) if value < np.inf else 1.0
                damping, growth = damping * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
                q, value, best = tried, now, here
                size = np.maximum(np.linalg.norm(rows[:, :p], axis=0), 1e-300)
                basis, r = np.linalg.qr(rows[:, :p] / size)
                aim = basis.T @ rows[:, p]
                promised = float(aim @ aim)
            else:
                damping, growth = damping * growth, 2 * growth
            if promised <= _CLOSE**2 or value == np.inf:
                break
            damped = np.vstack([r, np.sqrt(damping) * np.eye(p)])
            step = np.linalg.lstsq(damped, np.append(aim, np.zeros(p)), rcond=None)[0]
            promised = float(aim @ aim - np.sum((aim - r @ step) ** 2))
            tried = q + step / size
        found = posterior(*best[:-1], noises[1]) if value < np.inf else None
    if found is None or not np.isfinite(found.step).all():
        return q, False, found
    return q + found.step, float(aim @ aim) <= _CONVERGED**2, found


def _of_readings(form: DragLaw | CountedLaw, readings: Readings, q: Array) -> tuple[Array, Array]:
    """Return residuals and slopes in units of the readings' u, shapes (n,) and (p, n)."""
    with np.errstate(all="ignore"):
        left = (readings.x - form.spin(readings.tau, q)) * readings.weight
        return np.asarray(left), np.asarray(form.gradient(readings.tau, q) * readings.weight)


def fit_law(found: Solution, gate: float | None = None) -> LawFit:
    """Return the solution in textbook constants, with uncertainties and statistics.

    Args:
        found: the solution.
        gate: over which each reading is a mean [s]; None: not known.
    """
    form, readings = found.form, found.readings
    values, slopes = form.natural(found.q, readings.reference_hz, readings.duration)
    covariance, u = None, np.full(len(values), np.nan)
    after = found.posterior
    if after is not None and (readings.sigma_known or found.degrees_of_freedom > 0):
        covariance, u = propagate(after.covariance, slopes)
    # c = κ/(T ω_refᵐ) can leave the range of floats, to infinity or to zero
    representable = np.isfinite(values) & ((values != 0) | (found.q[: len(values)] == 0) | (found.counted is not None))
    parameters = {
        name: Estimate(float(value) if fine else None, float(sigma) if fine and np.isfinite(sigma) else None, unit)
        for name, value, fine, sigma, unit in zip(
            form.parameters, values, representable, u, form.parameter_units, strict=True
        )
    }
    known = after is not None and bool(np.isfinite(u).all())
    return LawFit(
        name=found.law.name,
        parameters=parameters,
        covariance=covariance if representable.all() else None,
        statistics=found.statistics,
        residuals=readings.reference_hz * (readings.x - form.spin(readings.tau, found.q)),
        linearised=linearise(found.law, readings) if len(found.law.orders) == 1 else None,
        remarks=tuple(_remarks(found, parameters, known=covariance is not None)),
        start_time=readings.start_time,
        solution=found.counted.solution(found.q) if found.counted else found.q,
        reference=(readings.reference_hz, readings.duration),
        top=found.counted.moved_top(found.q) if found.counted else THESIS_TOP,
        shared_u=_shared_u(found, slopes) if known and found.counted else {},
        parts=_parts(found, slopes, u, gate) if known else {},
        rho=None if after is None or not known or not after.rho_u else Estimate(after.rho, after.rho_u, "1"),
    )


def _of_priors(found: Solution, slopes: Array) -> Array:
    """Return what the priors leave open in each textbook parameter, a row for each prior, shape (k, p)."""
    assert found.posterior is not None
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(found.posterior.beforehand @ slopes.T)


def _shared_u(found: Solution, slopes: Array) -> dict[str, float]:
    """Return the part of each u that all runs of one top share: not that of the nutation beyond a release's."""
    rows = np.delete(_of_priors(found, slopes), MORE - 1, axis=0)
    shared = np.linalg.norm(rows, axis=0)
    return {n: float(part) for n, part in zip(found.form.parameters, shared, strict=True) if np.isfinite(part)}


def _parts(found: Solution, slopes: Array, u: Array, gate: float | None) -> dict[str, Parts]:
    """Return what the uncertainties of the parameters are made of.

    Args:
        found: the solution.
        slopes: of the textbook parameters, shape (p, q).
        u: of these, shape (p,).
        gate: of a reading [s].
    """
    after = found.posterior
    assert after is not None
    with np.errstate(over="ignore", invalid="ignore"):
        of_tilt = np.minimum(np.linalg.norm(_of_priors(found, slopes), axis=0), u) if found.counted else 0.0 * u
        noise = np.sqrt(u**2 - of_tilt**2)
        alone = np.minimum(propagate(after.independent, slopes)[1], noise)
        scatter = alone / np.sqrt(max(after.variance, 1.0) if found.readings.sigma_known else 1.0)
        excess, more = np.sqrt(alone**2 - scatter**2), np.sqrt(noise**2 - alone**2)
        moved = None if gate is None else _moved_by_gate(found, slopes, gate)
    rows = np.array([scatter, excess, more, of_tilt]).T
    found_parts = {}
    for k, name in enumerate(found.form.parameters):
        if np.isfinite(rows[k]).all():
            bias = None if moved is None or not np.isfinite(moved[k]) else float(moved[k])
            one, two, three, four = rows[k].tolist()
            found_parts[name] = Parts(one, two, three, four, bias)
    return found_parts


def _moved_by_gate(found: Solution, slopes: Array, gate: float) -> Array:
    """Return the bias of the parameters by means over a gate [s], shape (p,)."""
    readings = found.readings
    half = min(gate / readings.duration / 2, 0.5)
    middle = np.clip(readings.tau, half, 1 - half)
    before, here, after = (found.form.spin(tau, found.q) for tau in (middle - half, middle, middle + half))
    bias = gate_bias(before, here, after) * readings.weight
    assert found.posterior is not None
    n = len(found.law.parameters)
    j = found.slopes[:n]  # of the law alone: what is known of the tilt does not move
    moved = np.zeros(len(found.q))
    moved[:n] = np.linalg.lstsq(j.T, bias, rcond=None)[0]
    return np.asarray(slopes @ moved)


def straight_line(x: Array, y: Array, weight: Array | None = None) -> tuple[float, float, float | None]:
    """Return intercept and slope of a straight line, and the slope's standard error by the scatter about it.

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


def _linear_quantity(x: Array, m: float) -> Array:
    """Return the quantity that is linear in time, with slope κ, under a power law of order m."""
    return -np.log(x) if m == 0 else x**-m / m


def linearise(law: DragLaw, readings: Readings) -> dict[str, Estimate]:
    """Fit the thesis's straight line through ln ω, 1/ω or ω^(−1/2), unweighted, so that noise weighs unevenly."""
    (m,) = law.orders
    omega = 2 * np.pi * readings.frequency
    _, slope, u = straight_line(readings.time - readings.start_time, _linear_quantity(omega, m))
    return {law.constants[0]: Estimate(slope, u, law.units[0])}


def _start(law: DragLaw, readings: Readings) -> Array:
    """Return parameters to start from: the same straight line, weighted; the disc's for laws with two constants."""
    m = law.orders[0] if len(law.orders) == 1 else 0.5
    weight = (readings.x ** (m + 1) * readings.weight) ** 2
    intercept, kappa, _ = straight_line(readings.tau, _linear_quantity(readings.x, m), weight)
    if m == 0:
        x0 = float(np.exp(-intercept))
    else:
        x0 = float((m * intercept) ** (-1 / m)) if intercept > 0 else float(readings.x[0])
    if len(law.orders) == 1:
        return np.array([x0, kappa])
    return np.array([x0, kappa, m] if not law.orders else [x0, kappa / 2, kappa / 2])


def _remarks(found: Solution, parameters: Mapping[str, Estimate], *, known: bool) -> list[Remark]:
    law = found.law.name
    said = [] if found.converged else [Remark("not converged", law)]
    if not found.readings.sigma_known and found.degrees_of_freedom == 0:
        said.append(Remark("no freedom", law, values=(len(found.law.parameters),)))
    elif not known:
        said.append(Remark("not separated", law))
    for constant in found.law.constants:
        said += _about_constant(law, constant, parameters[constant])
    return said


def _about_constant(law: str, name: str, estimate: Estimate) -> list[Remark]:
    value, u = estimate.value, estimate.u
    if value is None:
        return [Remark("out of range", law, name)]
    if u is None:
        return []
    said = []
    if value < -2 * u and name != "exponent":
        said.append(Remark("negative", law, name, (-value / u,)))
    if name == "c" and u > MAX_STATED_FACTOR * abs(value):
        said.append(Remark("undetermined", law, name))
    elif name == "c" and u > 0.5 * abs(value):
        said.append(Remark("factor", law, name, (float(np.exp(u / abs(value))),)))
    return said
