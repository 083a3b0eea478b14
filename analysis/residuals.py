"""Do residuals look like noise? Runs test, Durbin–Watson, readings that do not belong, and changes that are no noise.

The tests take one series or several: several runs are tested together without ever joining the end of one to the
start of the next.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import comb, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array

# Up to this number of the rarer sign the distribution is exact. Beyond, the normal one errs by less than 0.001 where
# neither sign is much rarer, as with residuals of a fit.
EXACT_SIGNS = 200


@lru_cache(maxsize=256)
def _runs_distribution(rare: int, common: int) -> tuple[float, ...]:
    """Return the probability of 0, 1, 2, … runs in a random order of two signs (Wald & Wolfowitz 1940, eq. 1)."""
    ways = [0] * (2 * rare + 2)
    for k in range(1, rare + 1):
        ways[2 * k] = 2 * comb(rare - 1, k - 1) * comb(common - 1, k - 1)
        ways[2 * k + 1] = comb(rare - 1, k) * comb(common - 1, k - 1) + comb(rare - 1, k - 1) * comb(common - 1, k)
    total = comb(rare + common, rare)
    return tuple(way / total for way in ways)


def _signs(series: Array) -> tuple[int, int, int]:
    """Count the rarer sign, the commoner sign, and the runs; zeros are left out."""
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
    """Return the two-sided p of the Wald–Wolfowitz runs test on the signs of residuals; small: no random order.

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
    """Return the Durbin–Watson statistic: near 2 for noise, well below when neighbours resemble each other.

    Σ(eᵢ − eᵢ₋₁)²/Σeᵢ², both sums over all series (J. Durbin & G. S. Watson, Biometrika 37, 409 (1950)).
    None where all residuals are zero.

    >>> durbin_watson(np.array([1.0, -1.0, 1.0, -1.0]))
    3.0
    """
    squares = sum(float(e @ e) for e in series)
    steps = sum(float(d @ d) for d in map(np.diff, series))
    return steps / squares if squares > 0 else None


def studentise(residuals: Array, leverage: Array, n_parameters: int, floor: float) -> Array:
    """Return each residual in units of the scatter of the others, with its own leverage allowed for.

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


def gross_errors(t: Array, n_parameters: int) -> NDArray[np.intp]:
    """Return the indices of studentised residuals too large for noise, worst first."""
    found = np.flatnonzero(np.abs(t) > gross_limit(len(t), n_parameters))
    return found[np.argsort(-np.abs(t[found]))]


def gross_limit(n: int, n_parameters: int) -> float:
    """Return the studentised residual that one of n has by noise once in 1000 times, two-sided (Bonferroni)."""
    from scipy.special import stdtrit

    return -float(stdtrit(n - n_parameters - 1, 1e-3 / n / 2))


# --- changes ---------------------------------------------------------------------------------------------

#: Noise that a lab may have: what neighbours share beyond this is no noise.
NOISE = 0.8
#: Places, evenly distributed over the readings, between two of which every stretch is tried: at most this number.
_PLACES = 40
#: More readings than this are judged by means over neighbours.
_MOST_MEANS = 300


@dataclass(frozen=True)
class Change:
    """A stretch in which the readings move away from a model, to stay there.

    Attributes:
        first, last: indices of the readings at its ends: neighbours where it is a jump, the last reading of all
            where it is a bend.
        size: by which they move, in the units of the residuals.
        p: probability of a change as large anywhere in noise, correlated or not.
    """

    first: int
    last: int
    size: float
    p: float


def largest_change(time: Array, residuals: Array, slopes: Array) -> Change | None:
    """Return the most improbable change of readings about a model, which the model's own parameters may follow.

    A jump, a bend, or a climb from one reading to another: to the model a ramp is added between any two readings, and
    its size has Student's t in news of noise (`whiten`) with the correlation `NOISE`.  Less correlated noise gives
    smaller t.  p allows for the number of ramps tried (Bonferroni).  At least two readings
    stand at either end of a change: a single one would be an outlier.

    Args:
        time: shape (n,).
        residuals: of equal variance, shape (n,).
        slopes: of the model, shape (p, n).

    Returns:
        None for too few readings, or where nothing is left over.

    Source: G. E. P. Box & G. C. Tiao, Biometrika 52, 181 (1965), for a step in correlated noise.
    """
    from scipy.special import stdtr

    size_of_block = -(-len(residuals) // _MOST_MEANS)
    if size_of_block > 1:
        means = (_means(rows, size_of_block) for rows in (time, residuals, slopes))
        return _of_blocks(largest_change(*means), size_of_block)
    n, freedom = len(residuals), len(residuals) - len(slopes) - 1
    if freedom < 4:
        return None
    places = np.unique(np.linspace(1, n - 1, min(n - 1, _PLACES)).round().astype(int))
    first, last = np.array([(i, j) for i in places for j in places if i < j and i < n - 2]).T
    jumps = np.arange(1, n - 2)
    first, last = np.concatenate([first, jumps]), np.concatenate([last, jumps + 1])
    pairs = np.unique(np.stack([first, last]), axis=1)
    first, last = pairs
    at = np.arange(n)
    ramps = np.clip((at - first[:, None]) / (last - first)[:, None], 0.0, 1.0)
    white = whitening(time, NOISE)
    q, _ = np.linalg.qr(white(slopes).T)
    left, tried = white(residuals), white(ramps)
    left = left - q @ (q.T @ left)
    tried = tried - (tried @ q) @ q.T
    size, along = (tried**2).sum(axis=1), tried @ left
    usable = size > 1e-9 * (ramps**2).sum(axis=1)
    gain = np.where(usable, along**2 / np.where(usable, size, 1.0), 0.0)
    k = int(np.argmax(gain))
    rest = max(float(left @ left) - float(gain[k]), 0.0) / freedom
    if not rest > 0:
        return None
    p = 2 * len(gain) * float(stdtr(freedom, -sqrt(float(gain[k]) / rest)))
    return Change(int(first[k]), int(last[k]), float(along[k] / size[k]), min(p, 1.0))


def _means(rows: Array, size: int) -> Array:
    """Return means over neighbours along the last axis; what is left at the end, less than one of them, is dropped."""
    n = rows.shape[-1] // size
    return np.asarray(rows[..., : n * size].reshape(*rows.shape[:-1], n, size).mean(axis=-1))


def _of_blocks(found: Change | None, size: int) -> Change | None:
    """Return a change of means with the indices of the readings in the middle of them."""
    return found and replace(found, first=found.first * size + size // 2, last=found.last * size + size // 2)


def whitening(time: Array, rho: float) -> Callable[[Array], Array]:
    """Return the map of values at these times to news: what each holds beside its correlation with the last one.

    Args:
        time: shape (n,).
        rho: correlation of neighbours at the usual interval; after the time Δt it is ρ to the power of Δt in intervals.
    """
    steps = np.diff(time)
    r = rho ** (steps / np.median(steps))
    root = np.sqrt(1 - r**2)
    return lambda rows: np.concatenate([rows[..., :1], (rows[..., 1:] - r * rows[..., :-1]) / root], axis=-1)


def independent(count: int, correlation: float) -> float:
    """Return the number of independent readings whose mean is known as well as that of an AR(1) process.

    Args:
        count: of the readings.
        correlation: of neighbours, 0 to 1.

    >>> [round(independent(10, r), 3) for r in (0.0, 0.9, 1.0)]
    [10.0, 1.374, 1.0]
    """
    apart = np.arange(1, count)
    return count / (1 + 2 * float(np.sum((1 - apart / count) * correlation**apart)))
