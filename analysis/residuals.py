"""Do residuals look like noise? Runs test, Durbin–Watson, and readings that do not belong.

The tests take one series or several: several runs are tested together without ever joining the end of one to the
start of the next.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import comb, erfc, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Up to so many of the rarer sign the distribution is exact. Beyond, the normal one errs by less than 0.001 where
# neither sign is much rarer, as with residuals of a fit.
EXACT_SIGNS = 200


@lru_cache(maxsize=256)
def _runs_distribution(rare: int, common: int) -> tuple[float, ...]:
    """Probability of 0, 1, 2, … runs in a random order of two signs (Wald & Wolfowitz 1940, eq. 1)."""
    ways = [0] * (2 * rare + 2)
    for k in range(1, rare + 1):
        ways[2 * k] = 2 * comb(rare - 1, k - 1) * comb(common - 1, k - 1)
        ways[2 * k + 1] = comb(rare - 1, k) * comb(common - 1, k - 1) + comb(rare - 1, k - 1) * comb(common - 1, k)
    total = comb(rare + common, rare)
    return tuple(way / total for way in ways)


def _signs(series: Array) -> tuple[int, int, int]:
    """How many of the rarer and of the commoner sign, and of runs; zeros are left out."""
    positive = series[series != 0] > 0
    plus = int(np.count_nonzero(positive))
    minus = positive.size - plus
    runs = 1 + int(np.count_nonzero(positive[1:] != positive[:-1]))
    return min(plus, minus), max(plus, minus), runs


def _exact_p(signs: list[tuple[int, int, int]]) -> float:
    probability = np.ones(1)
    for rare, common, _ in signs:
        probability = np.convolve(probability, _runs_distribution(rare, common))
    seen = sum(runs for _, _, runs in signs)
    return 2 * float(min(probability[: seen + 1].sum(), probability[seen:].sum()))


def _normal_p(signs: list[tuple[int, int, int]]) -> float:
    from scipy.special import erfc

    rare, common, runs = np.array(signs, dtype=float).T
    n = rare + common
    mean = 1 + 2 * rare * common / n
    variance = (mean - 1) * (mean - 2) / (n - 1)
    away = max(abs(float((runs - mean).sum())) - 0.5, 0.0)  # ½: runs are counted
    return float(erfc(away / np.sqrt(2 * variance.sum())))


def runs_test_p(*series: Array) -> float | None:
    """Two-sided p of the Wald–Wolfowitz runs test on the signs of residuals; small: they are in no random order.

    Several series: their numbers of runs are added, and the sum is judged by the convolution of their distributions.
    That keeps the direction (too few runs in each), which adding up two-sided p-values after Fisher would lose.
    p is twice the smaller tail, at most 1. Fitted residuals are slightly dependent, which the test neglects: with
    two or three parameters and 20 readings p is a few per cent of itself off.

    Args:
        series: each of shape (n,), zeros are left out.

    Returns:
        None where no series has both signs.

    Source: A. Wald & J. Wolfowitz, Ann. Math. Stat. 11, 147 (1940).

    >>> runs_test_p(np.array([1, 1, 1, 1, -1, -1, -1, -1]))  # 2 runs: 2 of 70 orders, two-sided
    0.05714285714285714
    """
    signs = [counts for counts in map(_signs, series) if counts[0] > 0]
    if not signs:
        return None
    exact = sum(rare for rare, _, _ in signs) <= EXACT_SIGNS
    return min(_exact_p(signs) if exact else _normal_p(signs), 1.0)


def durbin_watson(*series: Array) -> float | None:
    """Durbin–Watson statistic: near 2 for noise, well below when neighbours resemble each other.

    Σ(eᵢ − eᵢ₋₁)²/Σeᵢ², both sums over all series (J. Durbin & G. S. Watson, Biometrika 37, 409 (1950)).
    None where all residuals are zero.

    >>> durbin_watson(np.array([1.0, -1.0, 1.0, -1.0]))
    3.0
    """
    squares = sum(float(e @ e) for e in series)
    steps = sum(float(d @ d) for d in map(np.diff, series))
    return steps / squares if squares > 0 else None


def studentised(residuals: Array, leverage: Array, n_parameters: int, floor: float) -> Array:
    """Each residual in units of the scatter of the others, with its own leverage allowed for.

    Args:
        residuals: of equal variance, shape (n,).
        leverage: shape (n,).
        n_parameters: fitted; n − n_parameters − 1 must be above 0.
        floor: the scatter is taken to be no smaller than this.

    Returns:
        Shape (n,); each follows Student's t with n − n_parameters − 1 degrees of freedom if it is noise like the
        others (Cook & Weisberg, Residuals and Influence in Regression (1982), §2.2).
    """
    free = np.maximum(1 - leverage, 1e-12)
    others = (residuals @ residuals - residuals**2 / free) / (len(residuals) - n_parameters - 1)
    return np.asarray(residuals / np.sqrt(np.maximum(others, floor**2) * free))


def gross_errors(t: Array, n_parameters: int, p: float = 1e-3) -> NDArray[np.intp]:
    """Indices of studentised residuals too large for noise, worst first.

    Too large: two-sided p, multiplied by the number of readings (Bonferroni), below the given one.
    """
    from scipy.special import stdtrit

    limit = -float(stdtrit(len(t) - n_parameters - 1, p / len(t) / 2))
    found = np.flatnonzero(np.abs(t) > limit)
    return found[np.argsort(-np.abs(t[found]))]


# --- correlation -----------------------------------------------------------------------------------------

# Up to so many readings all is exact; beyond, a fit of a few constants takes less than 0.01 from the correlation.
DENSE = 300
LARGEST_CORRELATION = 0.85
# Noise that a lab may have: what resembles its neighbour more than noise of this correlation would, is a shape.
NOISE = 0.8
_RHO = np.linspace(-LARGEST_CORRELATION, LARGEST_CORRELATION, 69)


@dataclass(frozen=True)
class Correlation:
    """How much residuals of neighbouring readings resemble each other.

    Attributes:
        value: the correlation ρ of the noise, if it is of first order (each value ρ times the last one, and news).
        u: its standard uncertainty.
        p: probability that independent noise resembles itself as much, one-sided.
        p_shape: the same of noise with a correlation of `NOISE`: where it is tiny, this is no noise but a shape.
    """

    value: float
    u: float
    p: float
    p_shape: float

    def cautious(self) -> float:
        """ρ that uncertainties are enlarged by: half of its own uncertainty more, as too little costs coverage."""
        return min(max(self.value + 0.5 * self.u, 0.0), LARGEST_CORRELATION)

    def factor(self) -> float:
        """How many correlated readings tell as much as one: (1 + ρ)/(1 − ρ)."""
        rho = max(self.value, 0.0)
        return (1 + rho) / (1 - rho)


@dataclass(frozen=True, eq=False)
class _Series:
    """Residuals e = Mε of a fit: the projector M and K = MSM, where eᵀSe is the sum over neighbours."""

    n: int
    neighbours: float
    squares: float
    m: Array | None
    k: Array | None
    sums: tuple[Array, Array] | None

    def means(self) -> tuple[Array, Array]:
        """What is expected of the sums over neighbours and of squares, for noise of each correlation in `_RHO`."""
        if self.sums is None:
            return self.n * _RHO, np.full(len(_RHO), float(self.n))
        powers = _powers(self.n)
        return powers @ self.sums[0], powers @ self.sums[1]

    def excess(self, seen: float, rho: float) -> tuple[float, float]:
        """Mean and variance of eᵀ(S − seen)e for noise of this correlation."""
        if self.m is None or self.k is None:
            return self.n * (rho - seen), self.n * max(1 - rho**2, 1e-3)
        form = (self.k - seen * self.m) @ ar1(self.n, rho)
        return float(np.trace(form)), 2 * float((form * form.T).sum())


@lru_cache(maxsize=16)
def _powers(n: int) -> Array:
    """Of each correlation in `_RHO`, up to n − 1."""
    return np.asarray(_RHO[:, None] ** np.arange(n))


def ar1(n: int, rho: float) -> Array:
    """The correlation matrix of n values, ρ to the power of their distance, shape (n, n)."""
    k = np.arange(n)
    return np.asarray(float(rho) ** np.abs(k[:, None] - k[None, :]))


def _series(residuals: Array, slopes: Array) -> _Series:
    n = len(residuals)
    sums = float(residuals[1:] @ residuals[:-1]), float(residuals @ residuals)
    if n > DENSE:
        return _Series(n, *sums, None, None, None)
    q, _ = np.linalg.qr(slopes.T)
    m = np.eye(n) - q @ q.T
    k_all = np.arange(n)
    s = 0.5 * (np.abs(np.subtract.outer(k_all, k_all)) == 1)
    form = m @ s @ m
    # traces with powers of ρ by distance need the sums along the diagonals alone
    distance = np.abs(np.subtract.outer(k_all, k_all)).ravel()
    diagonals = [np.asarray(np.bincount(distance, each.ravel(), n), dtype=np.float64) for each in (form, m)]
    return _Series(n, *sums, m, form, (diagonals[0], diagonals[1]))


def correlation(*series: tuple[Array, Array]) -> Correlation | None:
    """The correlation of the noise behind the residuals of a fit, or of several.

    A fit of p constants follows slow noise, and what it leaves changes sign more often than the noise did: of 20
    readings and three constants the correlation of the residuals is 0.25 too small at ρ = 0.7.  So ρ is the one for
    which the expected sums over neighbours and of squares have the ratio seen (J. Durbin & G. S. Watson, Biometrika
    37, 409 (1950), for the moments).

    Args:
        series: residuals of equal variance, shape (n,), and the slopes of the fit, shape (p, n), for each fit.

    Returns:
        None where nothing is left over.
    """
    parts = [_series(residuals, slopes) for residuals, slopes in series if len(residuals) - len(slopes) >= 2]
    squares = sum(part.squares for part in parts)
    if not parts or not squares > 0:
        return None
    seen = sum(part.neighbours for part in parts) / squares

    means = [part.means() for part in parts]
    expected = sum(each[0] for each in means) / sum(each[1] for each in means)
    rising = np.maximum.accumulate(expected)
    value = float(np.interp(seen, rising, _RHO))
    n = sum(part.n for part in parts)
    slope = max(float(np.interp(value, _RHO, np.gradient(rising, _RHO))), 0.2)
    u = sqrt(max(1 - value**2, 0.05) / n) / slope
    return Correlation(value, u, _by_chance(parts, seen), _as_noise(parts, seen))


def _by_chance(parts: list[_Series], seen: float) -> float:
    """That independent noise has a ratio as large, which is nearly normal, with exact mean and variance."""
    free = trace = square = 0.0
    for part in parts:
        if part.m is None or part.k is None:
            free, square = free + part.n, square + part.n / 2
        else:
            free, trace = free + float(np.trace(part.m)), trace + float(np.trace(part.k))
            square += float((part.k * part.k.T).sum())
    mean, variance = trace / free, 2 * (free * square - trace**2) / (free**2 * (free + 2))
    return 0.5 * erfc((seen - mean) / sqrt(2 * variance))


def _as_noise(parts: list[_Series], seen: float) -> float:
    """That noise with a correlation of `NOISE` has a ratio as large (the quadratic form taken as normal)."""
    mean, variance = np.sum([part.excess(seen, NOISE) for part in parts], axis=0)
    return 0.5 * erfc(-float(mean) / sqrt(2 * float(variance)))
