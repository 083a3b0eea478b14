"""Turn number against time: a polynomial of degree two or three, with its uncertainty from the residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.uncertainty import Estimate

Array = NDArray[np.float64]

#: The slope's own change is fitted where it differs from 0 by so many standard uncertainties, or, by few residuals, by
#: as many as chance seldom makes of it as these.
CURVED = 4.0
#: Turns from which on a third degree is fitted, and from which on the bend it would show is looked at.
FEWEST_FOR_THIRD, FEWEST_FOR_BEND = 12, 8
#: The noise of the samples counts as so many degrees of freedom, where there are fewer of the residuals.
FEW = 30.0
#: Roundings that would leave residuals of more than so many times those that are seen, and this part of a rounding, did
#: not happen.
UNLIKE, UNSEEN = 1.2, 0.05
#: Rounded times of turns shift the phase gained in half the record by no more than this part of their rounding.
GRID_AT_MOST = 0.6
#: Residuals are grouped into so many blocks to see whether neighbours resemble each other ...
BLOCKS = 50
#: ... and into so many, of three turns or more, to see whether neighbours differ.
SHORT_BLOCKS, SHORTEST_BLOCK = 100, 3
#: Blocks scatter more, or less, than single residuals where chance would do it with less than this probability.
WHITE, ALTERNATING = 0.01, 0.001
#: The same of short blocks that scatter less: hum that is left moves pulses to and fro, from each turn to the next.
TO_AND_FRO = 0.05


@dataclass(frozen=True)
class Fit:
    """phase(t) = Σ coefficients[k] uᵏ, u = (t − centre)/half.

    Attributes:
        coefficients: [turns], shape (p,).
        unit_covariance: of them for residuals of unit variance and unit weight, shape (p, p).
        centre: [s].
        half: half the length [s].
        variance: of a residual of unit weight [turns²].
        inflation: factor on variance because neighbours resemble each other (below 1: they alternate).
        freedom: degrees of freedom of variance x inflation.
        residuals: [turns], shape (n,).
        unfitted: the bend that one degree more would show, and its u without Student's factor [Hz/s²]; None where the
            degree was given, a third one was fitted, or there are too few turns.
    """

    coefficients: Array
    unit_covariance: Array
    centre: float
    half: float
    variance: float
    inflation: float
    freedom: float
    residuals: Array
    unfitted: tuple[float, float] | None = None

    @property
    def covariance(self) -> Array:
        """Of the coefficients, such that one standard uncertainty covers 68.27 %."""
        return np.asarray(self.unit_covariance * self.variance * self.inflation * student(self.freedom) ** 2)

    def phase(self, times: Array) -> Array:
        """Phase at times [turns]."""
        return _polynomial(self.coefficients, (times - self.centre) / self.half)

    def frequency(self, times: Array) -> Array:
        """Frequency at times [Hz]."""
        slopes = self.coefficients[1:] * np.arange(1, self.coefficients.size) / self.half
        return _polynomial(slopes, (times - self.centre) / self.half)

    def frequency_and_chirp(self) -> tuple[Estimate, Estimate, float]:
        """Frequency and slope where they are independent, and that time; with a bend, where slope and bend are."""
        frequency, chirp, away = _independent(self.coefficients, self.covariance, self.half)
        return frequency, chirp, self.centre + away

    def frequency_and_chirp_at(self, time: float) -> tuple[Estimate, Estimate]:
        """Frequency and slope at any time [s], where they may depend on each other."""
        return _at(self.coefficients, self.covariance, self.half, (time - self.centre) / self.half)

    @property
    def bend(self) -> Estimate | None:
        """How the slope of the frequency itself changes, its third derivative of phase; None below degree three."""
        if self.coefficients.size < 4:
            return None
        unit = 6 / self.half**3
        return Estimate(unit * float(self.coefficients[3]), unit * float(np.sqrt(self.covariance[3, 3])), "Hz/s^2")

    def correlations(self, time: float) -> tuple[float, float, float]:
        """Of frequency and slope, frequency and bend, slope and bend at a time; none of them below degree three."""
        if self.coefficients.size < 4:
            return 0.0, 0.0, 0.0
        rows = np.stack([*_derivatives((time - self.centre) / self.half, 4), (0.0, 0.0, 0.0, 6.0)])
        covariance = rows @ self.covariance @ rows.T
        u = np.sqrt(np.diag(covariance))
        if not u.all():
            return 0.0, 0.0, 0.0
        correlation = covariance / np.outer(u, u)
        return float(correlation[0, 1]), float(correlation[0, 2]), float(correlation[1, 2])

    def times(self, factor: float) -> Fit:
        """The phase multiplied: half or twice the frequency."""
        return replace(self, coefficients=self.coefficients * factor)

    def with_expected_variance(self) -> Fit:
        """For weights that are 1/variance: what few residuals leave unknown comes from the noise of the samples.

        Unless the residuals contradict it: then they alone count.
        """
        if self.freedom >= FEW:
            return self
        from scipy.special import chdtrc

        if chdtrc(self.freedom, self.freedom * self.variance) < WHITE:
            return self
        freedom = self.freedom + FEW
        return replace(self, variance=(self.freedom * self.variance + FEW) / freedom, freedom=freedom)

    def with_grid(self, times: Array, weight: Array | None, *, step: float, steep: float) -> Fit:
        """The same with at least the uncertainty that comes from samples which are too far apart for the flanks.

        A flank between two samples may lie anywhere between them, and residuals do not show it where turns are nearly
        whole numbers of samples.  So the error of a rounded time is carried to the frequency, for all places of the
        flank between samples and all drifts up to one sample along the record; of those that would leave no larger
        residuals than these, the mean square is the least variance.

        Args:
            times: of the turns that were fitted, shape (n,) [s].
            weight: of them, shape (n,); None: all alike.
            step: from one sample to the next [s].
            steep: part of the pulse's height that lies between two samples at most; what flanks of several samples
                leave of the error falls with its square.
        """
        rounding = min(steep, 1.0) ** 2 * step * float(self.coefficients[1]) / self.half  # [turns]
        seen = float(self.covariance[1, 1])
        if seen >= (GRID_AT_MOST * rounding) ** 2:
            return self
        u = (times - self.centre) / self.half
        powers = u[:, None] ** np.arange(self.coefficients.size)
        carried = (powers if weight is None else powers * weight[:, None]) @ self.unit_covariance
        place = np.arange(8)[:, None, None] / 8 + np.linspace(-1, 1, 9)[:, None] * u + times / step
        rounded = ((place - np.rint(place)) * rounding).reshape(-1, times.size)  # [turns]
        shifts = rounded @ carried
        left = np.sqrt(np.mean((rounded - shifts @ powers.T) ** 2, axis=1))
        most = UNLIKE * float(np.sqrt(np.mean(self.residuals**2))) + UNSEEN * rounding
        possible = left <= max(most, float(left.min()))
        least = float(np.mean(shifts[possible, 1] ** 2))
        if least <= seen:
            return self
        wider = self.inflation * student(self.freedom) ** 2
        return replace(self, variance=least / (float(self.unit_covariance[1, 1]) * wider))

    def phase_at(self, time: float, origin: float = 0.0) -> Estimate:
        """Phase at a time, from 0 to 1 [turns], of what passes at a phase of origin."""
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
    """The upper middle value; several times faster than numpy's for short arrays."""
    return float(np.partition(values, values.size // 2)[values.size // 2])


def _independent(coefficients: Array, covariance: Array, half: float) -> tuple[Estimate, Estimate, float]:
    if coefficients.size < 4:
        d1, d2 = _derivatives(0.0, coefficients.size)
        against = covariance @ d2
        slope = float(d2 @ against)
        u = -float(d1 @ against) / slope if slope > 0 else 0.0
    else:  # where the slope and its bend are independent: frequency and slope are so at three times, far apart
        u = -float(covariance[2, 3] / covariance[3, 3]) / 3 if covariance[3, 3] > 0 else 0.0
    u = min(max(u, -1.0), 1.0)
    return *_at(coefficients, covariance, half, u), u * half


def _at(coefficients: Array, covariance: Array, half: float, u: float) -> tuple[Estimate, Estimate]:
    d1, d2 = _derivatives(u, coefficients.size)
    frequency = Estimate(float(d1 @ coefficients) / half, float(np.sqrt(d1 @ covariance @ d1)) / half, "Hz")
    chirp = Estimate(float(d2 @ coefficients) / half**2, float(np.sqrt(d2 @ covariance @ d2)) / half**2, "Hz/s")
    return frequency, chirp


def _derivatives(u: float, size: int) -> tuple[Array, Array]:
    d1 = np.array([k * u ** (k - 1) if k > 0 else 0.0 for k in range(size)])
    d2 = np.array([k * (k - 1) * u ** (k - 2) if k > 1 else 0.0 for k in range(size)])
    return d1, d2


def student(freedom: float, deviations: float = 1.0) -> float:
    """What a standard deviation from few degrees of freedom is multiplied by, to cover as so many that are known."""
    if freedom > 200:
        return deviations
    from scipy.special import ndtr, stdtrit

    return float(stdtrit(max(freedom, 1.0), float(ndtr(deviations))))


def fit_turns(times: Array, turns: Array, weight: Array | None = None, *, degree: int | None = None) -> Fit:
    """Fit the phase.

    times, turns: shape (n,); weight: of each (1/variance, relative), shape (n,); degree: None: two, or three where it
    differs from two significantly.
    """
    fit, third, u_third = _fit(times, turns, weight, degree or 2)
    if degree is not None or times.size < FEWEST_FOR_BEND:
        return fit
    if times.size >= FEWEST_FOR_THIRD and abs(third) > CURVED * u_third:
        cubic, *_ = _fit(times, turns, weight, 3)
        u = float(np.sqrt(cubic.unit_covariance[3, 3] * cubic.variance * max(1.0, cubic.inflation)))
        if abs(cubic.coefficients[3]) > student(cubic.freedom, CURVED) * u:
            return cubic
    unit = 6 / fit.half**3
    return replace(fit, unfitted=(unit * third, unit * u_third * max(1.0, fit.inflation) ** 0.5))


def _fit(times: Array, turns: Array, weight: Array | None, degree: int) -> tuple[Fit, float, float]:
    """The fit, and the coefficient of one degree more with its standard uncertainty if all residuals are white."""
    centre, half = 0.5 * float(times[0] + times[-1]), 0.5 * float(times[-1] - times[0])
    degree = min(degree, times.size - 1)
    u = (times - centre) / half
    columns = np.empty((times.size, degree + 2))
    columns[:, 0] = 1.0
    for k in range(1, degree + 2):
        columns[:, k] = columns[:, k - 1] * u
    if weight is not None:
        root = np.sqrt(weight)
        columns *= root[:, None]
        goal = turns * root
    else:
        goal = turns
    orthonormal, triangle = np.linalg.qr(columns)
    along = orthonormal.T @ goal
    inverse = np.linalg.inv(triangle[: degree + 1, : degree + 1])
    coefficients = inverse @ along[: degree + 1]
    standard = goal - columns[:, : degree + 1] @ coefficients
    residuals = standard if weight is None else standard / root
    left = float(standard @ standard) - float(along[-1]) ** 2
    last = float(triangle[-1, -1]) or 1e-300
    third = float(along[-1]) / last
    u_third = float(np.sqrt(max(left, 1e-300) / max(times.size - degree - 2, 1))) / abs(last)
    variance, inflation, freedom = scatter(standard, turns, degree + 1)
    return Fit(coefficients, inverse @ inverse.T, centre, half, variance, inflation, freedom, residuals), third, u_third


def scatter(residuals: Array, turns: Array, parameters: int) -> tuple[float, float, float]:
    """Variance of residuals, the factor by which blocks of neighbours scatter more or less, degrees of freedom.

    residuals: standardised, and turns: their phase, shape (n,); parameters: of the fit.  What matters for a frequency
    is how residuals scatter over times as long as the record, not from one to the next.
    """
    n = residuals.size
    freedom = max(n - parameters, 1)
    variance = float(residuals @ residuals) / freedom
    each = -(-n // BLOCKS)
    if each < 2 or variance <= 0:
        return variance, 1.0, freedom
    short = max(SHORTEST_BLOCK, -(-n // SHORT_BLOCKS))
    for size, less, more in ((each, ALTERNATING, WHITE), (short, TO_AND_FRO, 0.0)):
        place = turns // size
        starts = np.concatenate([[0], np.flatnonzero(place[1:] != place[:-1]) + 1])
        blocks = starts.size
        if blocks < parameters + 6:
            continue
        sums = np.add.reduceat(residuals, starts)
        sizes = np.diff(np.append(starts, n))
        ratio = float((sums**2 / sizes).sum()) / (blocks - parameters) / variance
        if 0.85 < ratio < 1.3:
            continue
        from scipy.special import fdtr

        p = float(fdtr(blocks - parameters, freedom, ratio))
        if p < less or p > 1 - more:
            return variance, ratio, blocks - parameters
    return variance, 1.0, freedom
