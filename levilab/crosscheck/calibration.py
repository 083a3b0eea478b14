"""Is the whole distribution of the truths as the uncertainties say, not its mean and width alone?

The rank of a truth is the probability that the analysis gives to smaller pulls: right ranks are uniform from 0 to 1.
Their distribution function lies within a simultaneous band, each of whose points has the same chance of being left
(Aldor-Noiman et al. 2013, doi:10.1080/00031305.2013.847865; Säilynoja et al. 2022, doi:10.1007/s11222-022-10090-6).
"""

import math
from functools import cache

import numpy as np
from scipy.optimize import brentq
from scipy.special import betaincinv, ndtr, stdtr
from scipy.stats import poisson

from analysis.arrays import Array
from analysis.uncertainty import student
from levilab.crosscheck.study import FALSE_ALARM, Spread, Verdict


def ranks_of(spread: Spread) -> Array:
    """Return the ranks of the truths, in rising order, from 0 to 1; by Student's law where u comes from few values."""
    pulls = np.sort(spread.pulls)
    if spread.freedom is not None:
        return np.asarray(stdtr(spread.freedom, pulls))
    if spread.widened is not None:
        return np.asarray(stdtr(spread.widened, pulls * student(spread.widened)))
    return np.asarray(ndtr(pulls))


def band_of(n: int, chance: float) -> tuple[Array, Array]:
    """Return the least and the greatest rank in each place, shape (n,), which right ranks leave with a chance."""
    return _quantiles(n, _level(n, chance))


def _quantiles(n: int, level: float) -> tuple[Array, Array]:
    """Return the bounds of each of n uniform numbers in rising order, each of which leaves them with `level`."""
    k = np.arange(1, n + 1)
    lower, upper = (np.asarray(betaincinv(k, n + 1 - k, q), dtype=float) for q in (level / 2, 1 - level / 2))
    return lower, upper


@cache
def _level(n: int, chance: float) -> float:
    """Return the chance of each place by which any of n leaves its bounds with a given chance."""
    inside = brentq(lambda x: probability_within(*_quantiles(n, math.exp(x))) - (1 - chance), math.log(chance / n), 0.0)
    return math.exp(inside)


def probability_within(lower: Array, upper: Array) -> float:
    """Return the probability that n uniform numbers in rising order lie within bounds, shape (n,), rising.

    Exact: a Poisson process that has n events in all is followed from bound to bound (Moscovich and Nadler 2017,
    doi:10.1016/j.spl.2016.11.027).
    """
    n = len(lower)
    counts = np.arange(n + 1)
    alive = np.eye(1, n + 1)[0]
    bounds = sorted([(x, k, True) for k, x in enumerate(lower)] + [(x, k, False) for k, x in enumerate(upper)])
    before = 0.0
    for x, k, is_lower in bounds:
        alive = np.convolve(alive, poisson.pmf(counts, n * (x - before)))[: n + 1]
        alive[counts > k if is_lower else counts <= k] = 0.0
        before = x
    alive = np.convolve(alive, poisson.pmf(counts, n * (1 - before)))[: n + 1]
    return float(alive[n] / poisson.pmf(n, n))


def by_ranks(spread: Spread) -> Verdict:
    """Judge pulls and ranks: too many ranks in a tail are a u that is too small, too few a u that is too large."""
    if spread.n < 2 or spread.verdict is Verdict.WRONG:
        return spread.verdict
    ranks = ranks_of(spread)
    lower, upper = band_of(spread.n, FALSE_ALARM / spread.among)
    low, high = ranks < lower, ranks > upper
    if np.any(low & (ranks < 0.5)) or np.any(high & (ranks > 0.5)):
        return Verdict.WRONG
    return Verdict.TOO_LARGE if np.any(low | high) else Verdict.RIGHT
