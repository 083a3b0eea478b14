"""Turn number against time: a polynomial of the third degree, with its uncertainty from the residuals.

The third degree, the bend of the frequency, has a prior: pulses that show it better than drags are known decide it,
others leave it to the prior.  A jump of the time, where a recorder lost or repeated samples, is one more parameter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.pulses.jump import Jump
from analysis.uncertainty import Estimate, student

#: The frequency's bend as a multiple of slope²/frequency, with its standard uncertainty.  Slower and slower: n under a
#: drag in proportion to the n-th power of the spin, which is 1 to 2; an even ramp, 0, is three u away.
UNDER_DRAG, UNDER_DRAG_U = 1.5, 0.5
#: Faster and faster: only a drive does that.
UNDER_DRIVE, UNDER_DRIVE_U = 0.0, 0.6
#: A top that swings about its drive, by 0.3 of a turn or less at about 0.33 Hz, has any bend below 2.7 Hz/s²: each
#: decade is as probable.  Of none at all and a swing, either is as probable.
SWINGS_U = np.array([2.0, 0.2, 0.02, 0.002])
SWING = 0.5
#: With fewer turns the bend is that of the prior: five parameters and the scatter leave too few.
FEWEST_FOR_BEND = 8
#: Turns on each side of a jump.
FEWEST_BESIDE = 2
#: Scatter over long times is about that from one turn to the next, within a factor of 2, before it is seen; and so is
#: the scatter of pulses about the noise of the samples: a variance known to a factor of 2 has four degrees of freedom.
PRIOR_FREEDOM = 4.0
#: Least number of turns of a block, and greatest number of blocks.  Residuals are added over a block, so that shifts to
#: and fro from turn to turn vanish.
BLOCK, BLOCKS = 6, 50
#: Roundings did not happen that would leave residuals larger than the sum of this multiple of the residuals seen and
#: this part of a rounding.
UNLIKE, UNSEEN = 1.2, 0.05
#: Rounded times of turns shift the phase gained in half the record by no more than this part of their rounding.
GRID_AT_MOST = 0.6


@dataclass(frozen=True)
class Grid:
    """Places of the samples.

    Attributes:
        step: from one sample to the next [s].
        steep: part of a pulse's height that lies between two samples at most; what flanks of several samples leave of
            the error falls with its square.
    """

    step: float
    steep: float

    def rounding(self, frequency: float) -> float:
        """Return the part of a turn [turns] within which samples leave a flank open."""
        return min(self.steep, 1.0) ** 2 * self.step * frequency

    def variance(self, times: Array, powers: Array, carried: Array, rounding: float, seen: float) -> float:
        """Return the least variance of the second coefficient that comes from samples too far apart for the flanks.

        A flank between two samples may lie anywhere between them, and residuals do not show it where turns are nearly
        whole numbers of samples.  So the error of a rounded time is carried to the frequency, for all places of the
        flank between samples and all drifts up to one sample along the record; of those that would leave no larger
        residuals than these, the mean square is the least variance.  Where every rounding would leave larger ones, the
        flanks are seen to a part of a sample, by which the smallest of these errors is multiplied: the residuals over
        those of the rounding, less what lies between the places and drifts that are tried.

        Args:
            times: of the turns, shape (n,) [s].
            powers: of their places in the record, from -1 to 1, shape (n, 3).
            carried: change of the coefficients with each phase, shape (n, 3).
            rounding: [turns].
            seen: root mean square of the residuals [turns].
        """
        place = _places(powers[:, 1]) + times / self.step
        rounded = ((place - np.rint(place)) * rounding).reshape(-1, times.size)
        return _hidden_variance(rounded, powers, carried, rounding, seen)


def _places(u: Array) -> Array:
    """Return places between two steps, and drifts up to one step, of a record from u = -1 to 1, shape (8, 9, n)."""
    return np.arange(8)[:, None, None] / 8 + np.linspace(-1, 1, 9)[:, None] * u


def _hidden_variance(errors: Array, powers: Array, carried: Array, rounding: float, seen: float) -> float:
    """Return the variance of the second coefficient by errors, shape (m, n), of which residuals show no more than seen.

    The other arguments as of `Grid.variance`.
    """
    shifts = errors @ carried
    left = np.sqrt(np.mean((errors - shifts @ powers.T) ** 2, axis=1))
    unseen, least = UNSEEN * rounding, float(left.min())
    part = min(UNLIKE * seen / (least - unseen), 1.0) if least > unseen else 1.0
    return part**2 * float(np.mean(shifts[left <= max(UNLIKE * seen + unseen, least), 1] ** 2))


@dataclass(frozen=True)
class Scatter:
    """Scatter of the residuals.

    Attributes:
        variance: of one of unit weight [turns²].
        inflation: factor on it because neighbours resemble each other (below 1: they alternate).
        freedom: degrees of freedom of variance x inflation.
        correlated_p: probability of such a factor if residuals are independent.
        least: variance that samples too far apart for the flanks leave open [turns²].
    """

    variance: float
    inflation: float
    freedom: float
    correlated_p: float
    least: float = 0.0

    @property
    def scale(self) -> float:
        """Variance of one residual, such that one standard uncertainty covers 68.27 % [turns²]."""
        return max(self.variance * self.inflation * student(self.freedom) ** 2, self.least)


@dataclass(frozen=True)
class Fit:
    """phase(t) = Σ coefficients[k] uᵏ, u = (t − centre)/half, t without the jump.

    Attributes:
        coefficients: [turns], shape (4,).
        covariance: of them, such that one standard uncertainty covers 68.27 %, shape (4, 4).
        centre: [s].
        half: half the length [s].
        residuals: [turns], shape (n,).
        scatter: of the residuals.
        unit_covariance: of the first three, had the bend been known, for residuals of unit variance, shape (3, 3).
        slope_bias: of the slope by the fourth degree of a drag, with its standard uncertainty [Hz/s].
        jump: in the times; None: there is none.
    """

    coefficients: Array
    covariance: Array
    centre: float
    half: float
    residuals: Array
    scatter: Scatter
    unit_covariance: Array
    slope_bias: tuple[float, float] = (0.0, 0.0)
    jump: Jump | None = None

    def phase(self, times: Array) -> Array:
        """Return the phase at times of the record [turns]."""
        return _polynomial(self.coefficients, self._place(times))

    def frequency(self, times: Array) -> Array:
        """Return the frequency at times of the record [Hz]."""
        slopes = self.coefficients[1:] * np.arange(1, self.coefficients.size) / self.half
        return _polynomial(slopes, self._place(times))

    def _place(self, times: Array) -> Array:
        return ((times if self.jump is None else self.jump.mend(times)) - self.centre) / self.half

    @property
    def middle_frequency(self) -> float:
        """Frequency in the middle of the record [Hz]."""
        return float(self.coefficients[1]) / self.half

    @property
    def reference(self) -> float:
        """Time at which frequency and slope are independent, had the bend been known [s]."""
        slope = float(self.unit_covariance[2, 2])
        u = -float(self.unit_covariance[1, 2]) / (2 * slope) if slope > 0 else 0.0
        return self.centre + min(max(u, -1.0), 1.0) * self.half

    def motion_at(self, time: float) -> tuple[Estimate, Estimate, Estimate]:
        """Return frequency, slope and bend at a time [s]."""
        rows = self._rows(time)
        u = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", rows, self.covariance, rows), 0.0))
        values = rows @ self.coefficients
        values[1], u[1] = values[1] - self.slope_bias[0], np.hypot(u[1], self.slope_bias[1])
        frequency, slope, bend = (
            Estimate(float(v), float(s), unit) for v, s, unit in zip(values, u, ("Hz", "Hz/s", "Hz/s^2"), strict=True)
        )
        return frequency, slope, bend

    def u_of_pulses(self, time: float) -> tuple[float, float]:
        """Return the standard uncertainties of frequency and slope at a time [s], had the bend been known."""
        rows = self._rows(time)[:2, :3]
        frequency, slope = np.sqrt(np.einsum("ij,jk,ik->i", rows, self.unit_covariance, rows) * self.scatter.scale)
        return float(frequency), float(slope)

    def correlations(self, time: float) -> tuple[float, float, float]:
        """Return those of frequency and slope, frequency and bend, slope and bend at a time; 0 where one is certain."""
        rows = self._rows(time)
        covariance = rows @ self.covariance @ rows.T
        u = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        with np.errstate(invalid="ignore", divide="ignore"):
            correlation = np.nan_to_num(covariance / np.outer(u, u), posinf=0.0, neginf=0.0)
        return float(correlation[0, 1]), float(correlation[0, 2]), float(correlation[1, 2])

    def _rows(self, time: float) -> Array:
        """Return derivatives of the phase by time: frequency, slope, bend, shape (3, 4)."""
        u, h = (time - self.centre) / self.half, self.half
        return np.array([
            [0.0, 1 / h, 2 * u / h, 3 * u**2 / h],
            [0.0, 0.0, 2 / h**2, 6 * u / h**2],
            [0.0, 0.0, 0.0, 6 / h**3],
        ])  # fmt: skip

    def times(self, factor: float) -> Fit:
        """Return the phase multiplied: half or twice the frequency."""
        return replace(self, coefficients=self.coefficients * factor)

    def of_rounded_intervals(self, times: Array, used: NDArray[np.intp], step: float) -> Fit:
        """Return the same where the times are sums of rounded intervals, whose errors add up from pulse to pulse.

        Intervals that change by less than a step are all rounded alike: the residuals do not show it.

        Args:
            times: of all pulses, shape (m,) [s].
            used: the numbers of those that are fitted, without a weight, shape (n,).
            step: of the intervals [s].
        """
        powers, turn = self._place(times[used])[:, None] ** np.arange(3), step * self.middle_frequency
        # a smooth sum of roundings has no second differences; of a jitter of 1 they have a variance of 6
        white = float(np.std(np.diff(self.residuals, 2))) / 6**0.5
        jitter = white / turn * np.random.default_rng(0).standard_normal(times.size - 1)
        intervals = 1 / self.frequency(times[1:]) / step
        place = _places(self._place(times[1:])) + intervals + jitter
        summed = np.cumsum((place - np.rint(place)) * turn, axis=-1).reshape(-1, times.size - 1)
        # differences of a clock are rounded, too, but do not add up: their residuals are white, and only the rest may
        # wander; its standard error is 1.4 white² / √n
        rest = max(float(np.mean(self.residuals**2)) - white**2, 0.0) + white**2 * (2 / used.size) ** 0.5
        seen, unit = rest**0.5, self.unit_covariance
        errors = np.column_stack([np.zeros(len(summed)), summed])[:, used]
        more = _hidden_variance(errors, powers, powers @ unit, turn, seen) / float(unit[1, 1])
        covariance = self.covariance.copy()
        covariance[:3, :3] += more * unit
        return replace(self, covariance=covariance, scatter=replace(self.scatter, least=self.scatter.scale + more))

    def phase_at(self, time: float, origin: float = 0.0) -> Estimate:
        """Return the phase at a time, from 0 to 1 [turns], of what passes at a phase of origin."""
        powers = ((time - self.centre) / self.half) ** np.arange(self.coefficients.size)
        value = float(powers @ self.coefficients) - origin
        return Estimate(value - np.floor(value), float(np.sqrt(powers @ self.covariance @ powers)), "turns")


def _polynomial(coefficients: Array, u: Array) -> Array:
    total = np.full(u.shape, coefficients[-1])
    for each in coefficients[-2::-1]:
        total *= u
        total += each
    return total


def median(values: Array) -> float:
    """Return the upper middle value; several times faster than numpy's for short arrays."""
    return float(np.partition(values, values.size // 2)[values.size // 2])


def fit_turns(
    times: Array,
    turns: Array,
    weight: Array | None = None,
    *,
    degree: int | None = None,
    jump: Jump | None = None,
    grid: Grid | None = None,
    absolute: bool = False,
) -> Fit:
    """Fit the phase.

    Args:
        times: of the record, shape (n,) [s].
        turns: phases, shape (n,).
        weight: 1/variance of each, shape (n,); None: all alike.
        degree: 2: the slope stays the same; 3: nothing is known of its change; None: the prior is.
        jump: in the times, nearly; it is fitted, too.
        grid: of the samples that the phases come from.
        absolute: whether weights are 1/variance by the noise of the samples, or relative.
    """
    if jump is not None and not FEWEST_BESIDE <= np.count_nonzero(times > jump.at) <= times.size - FEWEST_BESIDE:
        jump = None
    model = _Model(degree, jump, grid, absolute)
    for _ in range(1 if jump is None else 3):  # the second is exact up to the change of frequency in the lost piece
        fit, step = _fit(times, turns, weight, model)
        if model.jump is None or step is None:
            break
        turn = 1 / fit.middle_frequency
        lost = model.jump.lost + (step.value or 0.0) * turn
        model = replace(model, jump=Jump(model.jump.at, lost, (step.u or 0.0) * turn))
    return replace(fit, jump=model.jump)


@dataclass(frozen=True)
class _Model:
    """See `fit_turns`."""

    degree: int | None
    jump: Jump | None
    grid: Grid | None
    absolute: bool


@dataclass(frozen=True)
class _Solution:
    """Coefficients of all columns but the last, and of the last one, that of u³.

    Attributes:
        plain: where the last is 0, shape (m,).
        unit: covariance of these for residuals of unit variance, shape (m, m).
        toward: change of all with the last, shape (m + 1,).
        seen, unit_seen: the last, and its variance for residuals of unit variance; 0 and infinite where it is not
            looked for.
    """

    plain: Array
    unit: Array
    toward: Array
    seen: float
    unit_seen: float

    @classmethod
    def of(cls, columns: Array, goal: Array, *, free: bool) -> _Solution:
        """Return the least squares of columns, shape (n, m + 1); free: whether the last one is looked for."""
        m = columns.shape[1] - 1
        orthonormal, triangle = np.linalg.qr(columns if free else columns[:, :m])
        along, inverse = orthonormal.T @ goal, np.linalg.inv(triangle[:m, :m])
        of_last = triangle[:m, m] if free else orthonormal.T @ columns[:, m]
        seen, unit_seen = 0.0, np.inf
        if free:
            seen, unit_seen = float(along[m] / triangle[m, m]), float(triangle[m, m]) ** -2
        return cls(inverse @ along[:m], inverse @ inverse.T, np.append(-inverse @ of_last, 1.0), seen, unit_seen)

    def coefficients(self, last: float) -> Array:
        """Return all of them, shape (m + 1,)."""
        return np.append(self.plain, 0.0) + last * self.toward


def _fit(times: Array, turns: Array, weight: Array | None, model: _Model) -> tuple[Fit, Estimate | None]:
    """Return the fit, and the step of the phase that is left at a jump [turns]."""
    clock = times if model.jump is None else model.jump.mend(times)
    centre, half = 0.5 * float(clock[0] + clock[-1]), 0.5 * float(clock[-1] - clock[0])
    columns = ((clock - centre) / half)[:, None] ** np.arange(4)
    first = 0
    if model.jump is not None:
        columns, first = np.column_stack([times > model.jump.at, columns]), 1
    root = np.ones(times.size) if weight is None else np.sqrt(weight)
    free = times.size >= FEWEST_FOR_BEND and model.degree != 2
    goal, columns = turns * root, columns * root[:, None]
    found = _Solution.of(columns, goal, free=free)
    standard = goal - columns @ found.coefficients(found.seen)
    scatter = scatter_of(standard, np.rint(turns), first + 3 + free, absolute=model.absolute)
    if model.grid is not None:
        powers, unit = (columns / root[:, None])[:, first : first + 3], found.unit[first:, first:]
        seen = float(np.sqrt(np.mean((standard / root) ** 2)))
        rounding = model.grid.rounding(float(found.plain[first + 1]) / half)
        if scatter.scale * unit[1, 1] < (GRID_AT_MOST * rounding) ** 2:
            carried = (powers * root[:, None] ** 2) @ unit
            least = model.grid.variance(times, powers, carried, rounding, seen) / float(unit[1, 1])
            scatter = replace(scatter, least=least)
    last, v_last, slope_bias = found.seen, found.unit_seen * scatter.scale if free else 0.0, (0.0, 0.0)
    if model.degree is None:
        expected = _Expected.of(found.plain[first:], half)
        last, v_last, slope_bias = expected.combine(last, v_last if free else np.inf, scatter.freedom)
    coefficients = found.coefficients(last)
    covariance = v_last * np.outer(found.toward, found.toward)
    covariance[:-1, :-1] += found.unit * scatter.scale
    fit = Fit(
        coefficients=coefficients[first:],
        covariance=covariance[first:, first:],
        centre=centre,
        half=half,
        residuals=(goal - columns @ coefficients) / root,
        scatter=scatter,
        unit_covariance=found.unit[first:, first:],
        slope_bias=slope_bias,
        jump=model.jump,
    )
    return fit, Estimate(float(coefficients[0]), float(covariance[0, 0]) ** 0.5, "turns") if first else None


@dataclass(frozen=True)
class _Expected:
    """What is known of the coefficient of u³ before the pulses are seen.

    Attributes:
        n, u_n: bend under a drag or an even drive, in units of slope²/frequency.
        one: the coefficient where n is 1 [turns].
        u_swing: more, of tops that swing about their drives, shape (m,) [turns].
        fourth: slope³/frequency² times T²/56 [Hz/s].
    """

    n: float
    u_n: float
    one: float
    u_swing: Array
    fourth: float

    @classmethod
    def of(cls, parabola: Array, half: float) -> _Expected:
        """Return it for a phase, frequency and slope as multiples of uᵏ, shape (3,)."""
        frequency, slope = float(parabola[1]) / half, 2 * float(parabola[2]) / half**2
        n, u_n = (UNDER_DRAG, UNDER_DRAG_U) if slope < 0 else (UNDER_DRIVE, UNDER_DRIVE_U)
        unit, share = half**3 / 6, slope / (frequency or np.inf)
        return cls(n, u_n, unit * slope * share, unit * SWINGS_U, slope * share**2 * (2 * half) ** 2 / 56)

    def combine(self, seen: float, variance: float, freedom: float) -> tuple[float, float, tuple[float, float]]:
        """Return mean and variance with a measured value, and bias and u of the slope.

        The prior is a sum of normal distributions; each is combined with the measured value and weighed by its
        evidence, the density of Student's distribution there.  Under a drag ν′ = −cνⁿ the bend is nν′²/ν, and its own
        change ν‴ = n(2n − 1)ν′³/ν² makes the slope ν‴T²/56 too high.
        """
        mean, swings = self.n * self.one, np.zeros(self.u_swing.size)
        prior = np.append(0.0, self.u_swing) ** 2 + (self.u_n * self.one) ** 2
        both = prior + min(variance, 1e300) + 1e-300
        share, weight, of_drag = prior / both, np.append(1 - SWING, swings + SWING / swings.size), 1.0
        if variance < np.inf:
            log = -0.5 * (np.log(both) + (freedom + 1) * np.log1p((seen - mean) ** 2 / both / freedom))
            evidence = np.exp(log - log.max())
            weight = weight * evidence / (weight @ evidence)
            of_drag = float(evidence[0])
        means, variances = mean + share * (seen - mean), (1 - share) * prior
        value = float(weight @ means)
        n = float(means[0]) / self.one if self.one else 0.0
        u_n = float(1 - share[0]) ** 0.5 * self.u_n
        fourth = of_drag * self.fourth
        bias = fourth * n * (2 * n - 1), abs(fourth * (4 * n - 1) * u_n)
        return value, float(weight @ (variances + (means - value) ** 2)), bias


def scatter_of(residuals: Array, turns: Array, parameters: int, *, absolute: bool) -> Scatter:
    """Return how residuals scatter.

    What matters for a frequency is how they scatter over times as long as the record, not from one to the next: the
    variance of sums over blocks, combined with a prior in which it is that of single residuals.

    Args:
        residuals: standardised, shape (n,).
        turns: their phase, whole numbers, shape (n,).
        parameters: of the fit.
        absolute: whether a variance of 1 is expected.
    """
    n = residuals.size
    freedom = float(max(n - parameters, 1))
    variance = float(residuals @ residuals) / freedom
    if absolute:
        weight = PRIOR_FREEDOM / max(variance, 1.0)  # pulses that scatter beyond the noise say nothing of the noise
        variance = (freedom * variance + weight) / (freedom + weight)
        freedom += weight
    place = np.floor((turns - turns[0]) / max(BLOCK, -(-n // BLOCKS)))
    starts = np.concatenate([[0], np.flatnonzero(place[1:] != place[:-1]) + 1])
    blocks = starts.size - parameters
    if blocks < 1 or variance <= 0:
        return Scatter(variance, 1.0, freedom, 1.0)
    sizes = np.diff(np.append(starts, n))
    ratio = float((np.add.reduceat(residuals, starts) ** 2 / sizes).sum()) / blocks / variance
    inflation = (PRIOR_FREEDOM + blocks * ratio) / (PRIOR_FREEDOM + blocks)
    from scipy.special import fdtr

    p = float(fdtr(blocks, freedom, ratio))
    # Welch and Satterthwaite; the blocks' variance is a part of the residuals' variance
    whole = (PRIOR_FREEDOM + blocks) ** 2 / ((PRIOR_FREEDOM**2 + 2 * PRIOR_FREEDOM * blocks) / freedom + blocks)
    return Scatter(variance, inflation, whole, 2 * min(p, 1 - p))
