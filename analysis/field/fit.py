"""Fit of a scan of the base's field on its axis: strength, origin and thickness, with the calliper's values as priors.

The readings are fitted with the closed form of `analysis.field.ring` and a background that is the same everywhere (the
probe's zero, the earth's field).  The calliper's values and the instrument's data sheet add Gaussian residuals to
those of the readings, so that the covariance holds all that is known.  An uncertainty of height counts by the slope of
the field at that height (effective variance: Orear, Am. J. Phys. 50, 912 (1982)).  An unknown uncertainty of
readings or of heights is found by the restricted likelihood (Patterson & Thompson, Biometrika 58, 545 (1971)).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from analysis.arrays import Array
from analysis.checks import check_finite
from analysis.errors import NotPositive, ShapesDiffer
from analysis.field.errors import FieldStandsStill, FieldTurnsOver, ImpossibleRing, NoField, NotFitted, TooFewHeights
from analysis.field.ring import Ring, on_axis, reversal, slopes
from analysis.least_squares import solve
from analysis.remarks import Remark
from analysis.residuals import durbin_watson, gross_errors, runs_test_p, studentise
from analysis.uncertainty import Estimate, curvature

#: The parameters in the order of the covariance, and their units.
UNITS: Mapping[str, str] = {
    "strength": "T m",
    "origin": "m",
    "thickness": "m",
    "background": "T",
    "inner_radius": "m",
    "outer_radius": "m",
}
PARAMETERS = tuple(UNITS)
#: Strength, origin, thickness and background are four unknowns: fewer heights do not test the model.
FEWEST_HEIGHTS = 4
#: Heights closer than this count as one [m]: no stand is set more exactly.
SAME_HEIGHT_M = 1e-5
#: The effective variance depends on the fitted slope; after these iterations it has settled to 1e-6.
_MOST_TURNS = 8
#: Readings of unknown u are rounded to this part of the largest.
_ROUNDING = 1e-9
#: Logarithms of unknown scatters over the rms residual, from 0.7 %, which adds 5×10⁻⁵ to a variance, to 20; the steps
#: of their grid, and how far the logarithm of the likelihood falls on it: what lies beyond is less than 10⁻⁵.
_LOGS, _STEPS, _FAR = (-5.0, 3.0), 20, 12.0
#: A field below this multiple of the background's u counts as none, unless the means of its lower and its upper half
#: differ by more than this u.
_NO_FIELD = 5.0
#: The Durbin–Watson statistic of residuals in no order; it is smaller where neighbours are alike.
_BY_CHANCE = 2.0
#: No sound scan of 8 to 60 heights has a smaller one: of 1100 the least was 0.88.  Few heights have few signs to count.
_ALIKE = 0.5
#: A χ² less probable than this: the model, or the stated uncertainty, is wrong.
NO_FIT = 1e-3
#: A χ² more improbably small than this: the stated uncertainties are mostly common to all readings.
_TOO_GOOD = 1e-4
#: A scan that leaves more than this share of the calliper's u has learned nothing; scan and calliper may differ by this
#: number of u.
LEARNS_NOTHING, APART = 0.9, 3.0
#: Residuals whose rms is above this part of the largest reading, and that keep their sign over heights, are those of
#: another field; heights that are set to 2 mm leave 0.05 in the mean, in no order.
_MOST_LEFT = 0.05
#: What is more than this part of the largest reading is no background: the fit of another field asks for it.
_MOST_OF_IT = 0.5
#: Where no prior says how thick the ring is, the search begins at this part of its inner radius.
_START_THICKNESS = 0.3


@dataclass(frozen=True)
class Prior:
    """What is known before the scan.

    Attributes:
        value: in SI.
        u: standard uncertainty; 0: the value is exact.
    """

    value: float
    u: float


@dataclass(frozen=True)
class Known:
    """The values from calliper and data sheet.

    Attributes:
        inner_radius, outer_radius: [m].
        origin: height of the middle of the thickness [m], None: not known.
        thickness: [m], None: not known.
        background: common offset of all readings [T]; unless it is given, of a probe that was zeroed in no chamber: a
            Hall sensor's zero is off by some tenths of a millitesla, and drifts.
        gain_u: relative standard uncertainty of the instrument's scale.
    """

    inner_radius: Prior
    outer_radius: Prior
    origin: Prior | None = None
    thickness: Prior | None = None
    background: Prior = Prior(0.0, 5e-4)
    gain_u: float = 0.0

    def prior(self, name: str) -> Prior | None:
        """Return the prior of a parameter; None without one."""
        found: Prior | None = getattr(self, name, None)
        return found


@dataclass(frozen=True)
class Statistics:
    """How well the model fits.

    Attributes:
        n: readings.
        n_parameters: fitted.
        rms_residual: [T].
        chi_square: of readings and priors, None where uncertainties of readings or heights are unknown.
        degrees_of_freedom: readings and priors less parameters.
        durbin_watson, runs_test_p: of the residuals in the order of the heights.
    """

    n: int
    n_parameters: int
    rms_residual: float
    chi_square: float | None
    degrees_of_freedom: int
    durbin_watson: float | None
    runs_test_p: float | None

    @property
    def keeps_sign(self) -> bool:
        """Whether the residuals have too few runs of one sign for chance, or neighbours too much alike."""
        alike = _BY_CHANCE if self.durbin_watson is None else self.durbin_watson
        few = self.runs_test_p is not None and self.runs_test_p < NO_FIT
        return alike < _ALIKE or (few and alike < _BY_CHANCE)

    @property
    def reduced_chi_square(self) -> float | None:
        """χ² per degree of freedom."""
        return self.chi_square / self.degrees_of_freedom if self.chi_square and self.degrees_of_freedom else None


@dataclass(frozen=True, eq=False)
class FieldScan:
    """A scan and its fit.

    Attributes:
        parameters: name → estimate, those of PARAMETERS.
        covariance: in the order of PARAMETERS, shape (6, 6).
        fitted: the parameters that are not exact.
        known: the values from calliper and data sheet.
        statistics: how well the model fits.
        height: of the readings, rising [m], shape (n,).
        flux_density: of the readings [T], shape (n,).
        u: of each reading against the model, with that of its height [T], shape (n,).
        u_by_height: the part of it from the height [T], shape (n,).
        remarks: what to know before using the numbers.
    """

    parameters: Mapping[str, Estimate]
    covariance: Array
    fitted: tuple[str, ...]
    known: Known
    statistics: Statistics
    height: Array
    flux_density: Array
    u: Array
    u_by_height: Array
    remarks: tuple[Remark, ...] = ()

    @property
    def is_of_a_ring(self) -> bool:
        """Whether a ring's field describes the readings, and its strength is significant; else no masses follow."""
        return not any(remark.kind in {"no ring", "no strength"} for remark in self.remarks)

    @cached_property
    def values(self) -> Array:
        """The parameters in their order, shape (6,)."""
        return np.array([self.parameters[name].value for name in PARAMETERS], dtype=float)

    @property
    def ring(self) -> Ring:
        """The base."""
        return _ring(self.values)

    def model(self, height: Array) -> Array:
        """Return the fitted flux density, background included, at heights of shape (n,) [T]."""
        return np.asarray(on_axis(self.ring, height)[0] + self.values[3])

    def u_model(self, height: Array) -> Array:
        """Return the standard uncertainty of the fitted flux density at heights of shape (n,) [T]."""
        by_ring = slopes(self.ring, height)
        rows = np.vstack([by_ring[:3], np.ones_like(height), by_ring[3:]])
        return np.asarray(np.sqrt(np.einsum("pn,pq,qn->n", rows, self.covariance, rows)))

    @property
    def residuals(self) -> Array:
        """Reading less model [T], shape (n,)."""
        return self.flux_density - self.model(self.height)

    def correlation(self, one: str, other: str) -> float:
        """Return the correlation of two parameters."""
        i, j = PARAMETERS.index(one), PARAMETERS.index(other)
        size = math.sqrt(self.covariance[i, i] * self.covariance[j, j])
        return float(self.covariance[i, j]) / size if size else 0.0

    def learned(self, name: str) -> float | None:
        """Return the ratio of u after and before the scan, 0 to 1; None without a u before."""
        prior, u = self.known.prior(name), self.parameters[name].u
        return None if prior is None or not prior.u or u is None else u / prior.u


def _ring(values: Array) -> Ring:
    strength, origin, thickness, _, inner, outer = (float(value) for value in values)
    return Ring(strength, origin, thickness, inner, outer)


def fit_scan(
    height: ArrayLike,
    flux_density: ArrayLike,
    known: Known,
    u: ArrayLike | None = None,
    height_u: ArrayLike | float | None = 0.0,
) -> FieldScan:
    """Fit the field of a ring to a scan.

    Args:
        height: of the probe on the axis, in any order [m], shape (n,).
        flux_density: along the axis, either sign [T], shape (n,).
        known: what calliper and data sheet say.
        u: standard uncertainty of each reading without what is common to all (`known` holds that) [T], shape (n,).
            None: unknown, so all count alike and their scatter about the model gives it.
        height_u: standard uncertainty of each height without what is common to all [m].  None: unknown, likewise.

    Raises:
        ShapesDiffer, NotFinite, NotPositive: the arrays cannot be fitted.
        ImpossibleRing: no ring has such radii.
        TooFewHeights: fewer than four heights.
        NoField: the readings neither exceed the background nor change with height by more than its u.
        FieldStandsStill: the probe is saturated.
        FieldTurnsOver: the probe was turned over.
        NotFitted: the search did not end.
    """
    inner, outer = known.inner_radius.value, known.outer_radius.value
    if not 0 < inner < outer < math.inf:
        raise ImpossibleRing(inner=inner, outer=outer)
    z, b, u_b, u_z = _check_columns(height, flux_density, u, height_u)
    _refuse_bad_scans(z, b, known)
    problem = _Problem(z, b, u_b, u_z, known)
    found = _describe_scan(problem, *problem.solve())
    return replace(found, remarks=(*found.remarks, *_hidden_background(problem)))


# --- the input ---


def _check_columns(
    height: ArrayLike, flux_density: ArrayLike, u: ArrayLike | None, height_u: ArrayLike | float | None
) -> tuple[Array, Array, Array | None, Array | None]:
    """Check all columns, and return them in the order of the heights."""
    z = np.asarray(height, dtype=float)
    columns = {"height": z, "flux density": np.asarray(flux_density, dtype=float)}
    for quantity, given in (("uncertainty of height", height_u), ("uncertainty", u)):
        if given is not None:
            columns[quantity] = np.broadcast_to(np.asarray(given, dtype=float), z.shape)
    for quantity, values in columns.items():
        if values.shape != z.shape or z.ndim != 1:
            raise ShapesDiffer(quantity=quantity, seen=values.shape, expected=z.shape)
        check_finite(quantity, values)
    for quantity, refused in (("uncertainty of height", np.less), ("uncertainty", np.less_equal)):
        wrong = np.flatnonzero(refused(columns.get(quantity, np.ones(1)), 0))
        if wrong.size:
            raise NotPositive(quantity=quantity, unit="", index=int(wrong[0]), value=float(columns[quantity][wrong[0]]))
    order = np.argsort(z, kind="stable")
    u_b, u_z = (columns[name][order] if name in columns else None for name in ("uncertainty", "uncertainty of height"))
    return z[order], columns["flux density"][order], u_b, u_z


def _refuse_bad_scans(z: Array, b: Array, known: Known) -> None:
    starts = np.flatnonzero(np.diff(z, prepend=-np.inf) > SAME_HEIGHT_M)
    if starts.size < FEWEST_HEIGHTS:
        lowest, highest = (float(z[0]), float(z[-1])) if z.size else (math.nan, math.nan)
        raise TooFewHeights(seen=starts.size, needed=FEWEST_HEIGHTS, lowest=lowest, highest=highest)
    distinct = z[starts]
    mean = np.array([part.mean() for part in np.split(b, starts[1:])])
    change = float(np.ptp([half.mean() for half in np.array_split(mean, 2)]))
    if np.abs(b).max() < _NO_FIELD * known.background.u and change < known.background.u:
        raise NoField(largest=float(np.abs(b).max()), background_u=known.background.u)
    _refuse_plateau(distinct, mean)
    # the reversal is known as well as the origin is; the field near it is small, and may have either sign
    origin = known.origin or Prior(0.0, 0.05)
    ring = Ring(1.0, origin.value, 0.0, known.inner_radius.value, known.outer_radius.value)
    surely = reversal(ring) + 3 * origin.u + (known.thickness.value if known.thickness else 0.0) / 2
    weak = 3 * known.background.u + abs(known.background.value)
    strong = np.flatnonzero(np.abs(mean) > weak)
    for i, j in pairwise(strong.tolist()):
        if mean[i] * mean[j] < 0 and distinct[i] > surely:
            raise FieldTurnsOver(low=float(distinct[i]), high=float(distinct[j]), reversal=reversal(ring))


def _refuse_plateau(z: Array, b: Array) -> None:
    """Refuse three successive heights with the same value, the largest of the scan: the probe is saturated."""
    same = (b[1:] == b[:-1]) & (np.abs(b[1:]) == np.abs(b).max())
    for i in range(len(same) - 1):
        if same[i] and same[i + 1]:
            last = i + 2 + next((k for k, one in enumerate(same[i + 2 :]) if not one), len(same) - i - 2)
            raise FieldStandsStill(low=float(z[i]), high=float(z[last]), value=float(b[i]))


# --- the fit ---


@dataclass(frozen=True, eq=False)
class _Problem:
    """The least-squares problem.

    Attributes:
        z: heights [m].
        b: readings [T].
        u_b: their u [T], None if not known.
        u_z: u of the heights [m], None if not known.
        known: the priors.
    """

    z: Array
    b: Array
    u_b: Array | None
    u_z: Array | None
    known: Known

    @property
    def indices(self) -> list[int]:
        """Indices of the parameters to fit: all that are not exact."""
        priors = enumerate(map(self.known.prior, PARAMETERS))
        return [index for index, prior in priors if prior is None or prior.u > 0]

    def priors(self) -> list[tuple[int, Prior]]:
        """Return index and prior of each fitted parameter."""
        found = ((index, self.known.prior(PARAMETERS[index])) for index in self.indices)
        return [(index, prior) for index, prior in found if prior]

    def model(self, values: Array) -> Array:
        return np.asarray(on_axis(_ring(values), self.z, orders=1)[0] + values[3])

    def slopes(self, values: Array) -> Array:
        """Return the slopes of the model by all parameters, shape (6, n)."""
        by_ring = slopes(_ring(values), self.z)
        return np.vstack([by_ring[:3], np.ones_like(self.z), by_ring[3:]])

    def sigma(self, values: Array) -> tuple[Array, Array]:
        """Return u of each reading against the model, and the part of it from the height [T], shape (n,) each."""
        slope = np.abs(on_axis(_ring(values), self.z, orders=2)[1])
        ones = np.ones_like(slope)
        u_b = _ROUNDING * np.abs(self.b).max() * ones if self.u_b is None else self.u_b
        by_height = np.zeros_like(slope) if self.u_z is None else slope * self.u_z
        unknown = [shape for shape, u in ((ones, self.u_b), (slope, self.u_z)) if u is None]
        if not unknown:
            return np.hypot(u_b, by_height), by_height
        found = self._scatters(values, np.hypot(u_b, by_height), np.array(unknown))
        if self.u_b is None:
            u_b = np.hypot(u_b, found[0])
        if self.u_z is None:
            by_height = found[-1]
        return np.hypot(u_b, by_height), by_height

    def _scatters(self, values: Array, known: Array, shapes: Array) -> Array:
        """Return the standard deviations of unknown size that residuals show [T], shape (k, n).

        Each is the root of its mean square over the likelihood, which few residuals leave wide; its prior is flat in
        the logarithm.  The residuals are those of a fit that is linear about `values`.

        Args:
            values: of the parameters.
            known: standard uncertainty of each reading [T], shape (n,).
            shapes: of the standard deviations, shape (k, n).
        """
        n, k = len(known), len(shapes)
        pulls_of_priors = [(prior.value - values[index]) / prior.u for index, prior in self.priors()]
        left = np.append(self.b - self.model(values), pulls_of_priors)
        slopes = self.weighted_slopes(values, np.ones(n))[self.indices]
        slopes = slopes / np.linalg.norm(slopes, axis=1, keepdims=True)
        size = math.hypot(float(np.sqrt(np.mean(left[:n] ** 2))), float(known.min()))
        shapes = size * shapes / np.sqrt(np.mean(shapes**2, axis=1, keepdims=True))

        def log_likelihood(logs: Array) -> Array:
            scatter = np.sqrt(known**2 + np.exp(2 * logs) @ shapes**2)
            sigma = np.hstack([scatter, np.ones((len(logs), left.size - n))])
            basis, triangle = np.linalg.qr((slopes / sigma[:, None]).transpose(0, 2, 1))
            pulls = (left / sigma)[:, :, None]
            rest = pulls - basis @ (basis.transpose(0, 2, 1) @ pulls)
            diagonals = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
            return np.asarray(-np.log(sigma).sum(1) - np.log(diagonals).sum(1) - (rest**2).sum((1, 2)) / 2)

        low, high = np.full(k, _LOGS[0]), np.full(k, _LOGS[1])
        for _ in range(2):  # over all, then where the likelihood is
            logs = np.stack(np.meshgrid(*np.linspace(low, high, _STEPS + 1).T, indexing="ij"), -1).reshape(-1, k)
            log_p = log_likelihood(logs)
            near, step = logs[log_p > log_p.max() - _FAR], (high - low) / _STEPS
            low, high = np.maximum(near.min(0) - step, _LOGS[0]), np.minimum(near.max(0) + step, _LOGS[1])
        p = np.exp(log_p - log_p.max())
        return np.asarray(np.sqrt(p @ np.exp(2 * logs) / p.sum())[:, None] * shapes)

    def start(self) -> Array:
        """Return starting values: the calliper's, or else the origin with the best fit of the strength alone."""
        known = self.known
        thickness = known.thickness.value if known.thickness else _START_THICKNESS * known.inner_radius.value
        spread = np.linspace(-1, 1, 41) * known.outer_radius.value
        origins = [known.origin.value] if known.origin else [float(origin) for origin in spread]
        radii = known.inner_radius.value, known.outer_radius.value
        best = (math.inf, np.zeros(6))
        for origin in origins:
            unit = on_axis(Ring(1.0, origin, thickness, *radii), self.z, orders=1)[0]
            strength = float(unit @ self.b / (unit @ unit))
            left = self.b - strength * unit
            values = np.array([strength, origin, thickness, known.background.value, *radii])
            best = min(best, (float(left @ left), values), key=lambda one: one[0])
        return best[1]

    def solve(self) -> tuple[Array, Array, Array]:
        """Fit; return the parameters, the uncertainty of each reading at them, and its part from the height."""
        values = self.start()
        scale = self._scale(values)
        for _ in range(_MOST_TURNS):
            sigma, _ = self.sigma(values)
            before, values = values, self._iterate(values, sigma, scale)
            if np.all(np.abs(values - before) <= 1e-7 * scale):
                break
        values[2] = abs(values[2])  # the field does not change with its sign
        return values, *self.sigma(values)

    def _scale(self, start: Array) -> Array:
        """Return for each parameter a step that changes the field noticeably."""
        lengths = 0.1 * self.known.inner_radius.value
        return np.array([abs(start[0]) or 1e-3, lengths, lengths, 1e-4, lengths, lengths])

    def _iterate(self, values: Array, sigma: Array, scale: Array) -> Array:
        moved, priors, steps = self.indices, self.priors(), scale[self.indices]

        def whole(q: Array) -> Array:
            every = values.copy()
            every[moved] = q * steps
            return every

        def residual(q: Array) -> Array:
            every = whole(q)
            known = [(every[index] - prior.value) / prior.u for index, prior in priors]
            return np.concatenate([(self.model(every) - self.b) / sigma, known])

        def gradient(q: Array) -> Array:
            return self.weighted_slopes(whole(q), sigma)[moved] * steps[:, None]

        found, ended = solve(residual, gradient, values[moved] / steps)
        if not ended or not np.isfinite(found).all():
            raise NotFitted(what="flux density against height", advice="are heights and radii of one base, in metres?")
        return whole(found)

    def weighted_slopes(self, values: Array, sigma: Array) -> Array:
        """Return the slopes of all residuals by all parameters, shape (6, n + priors)."""
        known = np.zeros((6, len(self.priors())))
        for column, (index, prior) in enumerate(self.priors()):
            known[index, column] = 1 / prior.u
        return np.hstack([self.slopes(values) / sigma, known])


# --- the result ---


def _describe_scan(problem: _Problem, values: Array, sigma: Array, by_height: Array) -> FieldScan:
    known, moved = problem.known, problem.indices
    jacobian = problem.weighted_slopes(values, sigma)
    found = curvature(jacobian[moved])
    if found.covariance is None:
        raise NotFitted(what="flux density against height", advice="the readings do not tell the parameters apart")
    statistics = _statistics(problem, values, sigma)
    factor, misfit = _misfit(statistics)
    covariance = np.zeros((6, 6))
    covariance[np.ix_(moved, moved)] = found.covariance * factor
    covariance[0, 0] += (known.gain_u * values[0]) ** 2
    u = np.sqrt(np.diagonal(covariance))
    parameters = {
        name: Estimate(float(value), float(size), unit)
        for (name, unit), value, size in zip(UNITS.items(), values, u, strict=True)
    }
    fitted = tuple(PARAMETERS[index] for index in moved)
    scan = FieldScan(parameters, covariance, fitted, known, statistics, problem.z, problem.b, sigma, by_height)
    leverage = found.leverage[: len(problem.z)]
    return replace(scan, remarks=(*misfit, *_doubts(scan), *_outliers(scan, leverage)))


def _statistics(problem: _Problem, values: Array, sigma: Array) -> Statistics:
    left, priors = problem.b - problem.model(values), problem.priors()
    n, n_free = len(left), len(problem.indices)
    all_known = problem.u_b is not None and problem.u_z is not None
    misses = np.append(left / sigma, [(values[index] - prior.value) / prior.u for index, prior in priors])
    return Statistics(
        n=n,
        n_parameters=n_free,
        rms_residual=float(np.sqrt(np.mean(left**2))),
        chi_square=float(misses @ misses) if all_known else None,
        degrees_of_freedom=n + len(priors) - n_free,
        durbin_watson=durbin_watson(left / sigma),
        runs_test_p=runs_test_p(left),
    )


def _misfit(statistics: Statistics) -> tuple[float, list[Remark]]:
    """Return the factor by which residuals beyond the uncertainties widen variances, and a remark."""
    from scipy.special import chdtr, chdtrc

    reduced = statistics.reduced_chi_square
    if reduced is None or statistics.chi_square is None:
        p = statistics.runs_test_p
        return 1.0, [Remark("scan bends", values=(p,))] if p is not None and statistics.keeps_sign else []
    if float(chdtrc(statistics.degrees_of_freedom, statistics.chi_square)) < NO_FIT:
        return reduced, [Remark("scan scatters", values=(reduced,))]
    if float(chdtr(statistics.degrees_of_freedom, statistics.chi_square)) < _TOO_GOOD:
        return 1.0, [Remark("scan overstated", values=(reduced,))]
    return 1.0, []


@dataclass(frozen=True)
class UPart:
    """A part of the u of a parameter; the squares of all parts add up to u².

    Attributes:
        name: "readings" and "heights", what each reading has of its own; "excess", their scatter beyond that;
            "gain", the scale of the instrument; else the parameter that calliper or data sheet give.
        size: of the part, in the unit of the parameter, with the sign in which the parameter follows the input.
    """

    name: str
    size: float


def parts_of(scan: FieldScan) -> dict[str, tuple[UPart, ...]]:
    """Return the parts of each parameter's u.

    The covariance of the fit is H = (Σ s sᵀ/σ² + Σ p pᵀ)⁻¹ = H (Σ s sᵀ u_b²/σ⁴ + Σ s sᵀ (B′u_z)²/σ⁴ + Σ p pᵀ) H: a sum
    of what readings, heights and each of the priors leave.
    """
    problem = _Problem(scan.height, scan.flux_density, None, np.zeros_like(scan.height), scan.known)
    moved, values = problem.indices, scan.values
    jacobian = problem.weighted_slopes(values, scan.u)
    h = curvature(jacobian[moved]).covariance
    if h is None:
        return {}
    factor, _ = _misfit(scan.statistics)
    n = len(scan.height)
    gain = np.zeros((6, n + len(problem.priors())))  # of each parameter, by each residual of unit variance
    gain[moved] = h @ jacobian[moved]
    of_height = scan.u_by_height / scan.u
    sizes: dict[str, Array] = {
        "readings": np.linalg.norm(gain[:, :n] * np.sqrt(1 - of_height**2), axis=1),
        "heights": np.linalg.norm(gain[:, :n] * of_height, axis=1),
    }
    for column, (index, _) in enumerate(problem.priors(), n):
        sizes[PARAMETERS[index]] = gain[:, column]
    whole = np.zeros((6, 6))
    whole[np.ix_(moved, moved)] = h
    sizes["excess"] = np.sqrt(np.diagonal(whole) * (factor - 1))
    sizes["gain"] = np.zeros(6)
    sizes["gain"][0] = scan.known.gain_u * values[0]
    return {
        name: tuple(UPart(part, float(size[k])) for part, size in sizes.items() if size[k])
        for k, name in enumerate(PARAMETERS)
    }


def _doubts(scan: FieldScan) -> list[Remark]:
    """Return remarks: scan and calliper contradict each other, no ring has the field, or it is not significant."""
    said = []
    for name in scan.fitted:
        prior, found = scan.known.prior(name), scan.parameters[name].value
        hidden = name == "background" and scan.statistics.chi_square is None  # see _hidden_background
        if prior is not None and found is not None and abs(found - prior.value) > APART * prior.u and not hidden:
            said.append(Remark("contradicts", name=name, values=(found, prior.value, prior.u)))
    left, largest = scan.statistics.rms_residual, float(np.abs(scan.flux_density).max())
    if left > _MOST_LEFT * largest and scan.statistics.keeps_sign:
        said.append(Remark("no ring", values=(left, largest)))
    strength = scan.parameters["strength"]
    if strength.value is not None and strength.u is not None and abs(strength.value) < 3 * strength.u:
        said.append(Remark("no strength"))
    return said


def _hidden_background(problem: _Problem) -> list[Remark]:
    """Return a remark where the readings alone put the background far from the known one.

    The fit may take it for scatter of an unknown size, with a strength that makes up for a part of it.
    """
    prior = problem.known.background
    if prior.u == 0 or (problem.u_b is not None and problem.u_z is not None):
        return []
    known = replace(problem.known, background=Prior(prior.value, float(np.abs(problem.b).max())))
    free = replace(problem, known=known)
    found = _describe_scan(free, *free.solve()).parameters["background"]
    if found.value is None or abs(found.value) > _MOST_OF_IT * known.background.u:
        return []
    if abs(found.value - prior.value) <= APART * math.hypot(prior.u, found.u or 0.0):
        return []
    return [Remark("contradicts", name="background", values=(found.value, prior.value, prior.u))]


def _outliers(scan: FieldScan, leverage: Array) -> list[Remark]:
    if scan.statistics.n - scan.statistics.n_parameters < 3:
        return []
    scaled = scan.residuals / scan.u
    found = gross_errors(studentise(scaled, leverage, scan.statistics.n_parameters, 1e-9), scan.statistics.n_parameters)
    return [Remark("stray reading", values=(float(scan.height[i]), float(abs(scaled[i])))) for i in found]
