"""What readings say of a model that is linear near its best point, with all that is uncertain beside it averaged over.

The readings differ from the model by noise of the standard deviation s (in units of their u, or of ν_ref where u is
not stated), whose neighbours are correlated: ρ = exp(−Δt/τ) after the time Δt (P. J. Brockwell & R. A. Davis, Time
Series (1991), §3).  Nothing is decided beforehand: u may be wrong, noise may be correlated, the tilt may be there, and
each is a parameter with a prior.

- s: a stated u is taken to be known to a quarter (8 degrees of freedom, GUM G.4.2), so that readings and statement
  both count; not stated, s has Jeffreys's prior.
- τ: its logarithm is evenly distributed from a tenth of the usual interval of the readings (separate gates share
  nothing but drifts) to ten intervals, half of a usual run: what lasts longer cannot be distinguished from the curve.
- the parameters beside those of the law (`analysis.spindown.tilt`) are normal.  The law's own have flat priors.

For each ρ all is closed form: generalised least squares with a ridge, s at its mode.  Mean and covariance are those of
the mixture over ρ, with the evidence as weights (A. Gelman et al., Bayesian Data Analysis (2013), §14.7).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from analysis.arrays import Array

#: Degrees of freedom of a stated u: it is known to 1/√16 of itself (GUM G.4.2).
STATED_FREEDOM = 8
#: Correlation times of the noise, in intervals between readings, and the correlation of neighbours.
_TIMES = 10 ** np.linspace(-1.0, 1.0, 9)
RHO = np.exp(-1 / _TIMES)
INDEPENDENT = np.zeros(1)
#: Columns whose own part is smaller than this cannot be told from the others.
_ALIKE = 1e-12
#: Rounds in which s settles: to 1e-3 of itself.
_ROUNDS = 3
#: Numbers that are worked on at once.
_AT_ONCE = 2_000_000


class Noise(NamedTuple):
    """What is known of the noise beforehand.

    Attributes:
        freedom, squares: degrees of freedom that tell s², and the sum of their squares.
        least: of s: the rounding of numbers.
        rho: correlations of neighbours, equally probable.
        few: s² from which s settles where law and tilt together fit any noise: from below it would fall to zero.
    """

    freedom: int
    squares: float
    least: float
    rho: Array
    few: float | None = None


@dataclass(frozen=True, eq=False)
class Posterior:
    """What is known after the readings, near the point that the model was linearised at.

    Attributes:
        step: from that point to the mean, shape (p,).
        covariance: of the parameters, shape (p, p).
        beforehand: the part of it that the priors leave, and no number of readings' noise makes, one row for each of
            the parameters with a prior, whose squares add up, shape (k, p).
        independent: covariance by the noise alone, if it were not correlated, shape (p, p).
        rho, rho_u: correlation of neighbours, and its standard uncertainty.
        variance: s², if the noise were not correlated.
        misfit: −2 ln of the likelihood of the law's parameters at its maximum, all else averaged over.
    """

    step: Array
    covariance: Array
    beforehand: Array
    independent: Array
    rho: float
    rho_u: float
    variance: float
    misfit: float


def posterior(
    time: Array, residuals: Array, slopes: Array, priors: tuple[Array, Array], noise: Noise
) -> Posterior | None:
    """Average over the noise and all parameters but those that are asked for.

    Args:
        time: of the readings, shape (n,).
        residuals: readings less the model, in units of u or of ν_ref, shape (n,).
        slopes: of the model in the same units, shape (p, n).
        priors: of the last k parameters: expected value less the present one, and its standard uncertainty.
        noise: what is known of it.

    Returns:
        None where the readings do not separate the parameters.
    """
    (p, n), (expected, u), (freedom, squares, least, rho, few) = slopes.shape, priors, noise
    k = len(u)
    scale = np.linalg.norm(slopes, axis=1)
    scale[p - k :] = np.where(scale[p - k :] > 0, scale[p - k :], 1.0)
    if not (np.isfinite(scale).all() and (scale > 0).all()):
        return None
    order = np.r_[p - k : p, : p - k]  # those with priors first: a corner of the triangle is theirs alone
    columns = np.vstack([slopes[order] / scale[order, None], residuals])
    triangles, log_det = _triangles(time, columns, rho)
    ridge = np.zeros((len(rho), k, p + 1))
    ridge[:, np.arange(k), np.arange(k)] = 1 / (u * scale[p - k :])
    ridge[:, :, p] = expected / u

    # s by the residuals of the point itself: a law that fits badly is far from linear where a step would fit best
    free = np.full(len(rho), n - (p - k))
    present = (triangles[:, :, p] ** 2).sum(axis=1) if few is None else few * free
    for _ in range(_ROUNDS):
        s2 = np.maximum((squares + present) / np.maximum(freedom + free, 0.5), least**2)
        both = np.concatenate([triangles[:, :p] / np.sqrt(s2)[:, None, None], ridge], axis=1)
        q, r = np.linalg.qr(both[:, :, :p])
        if (np.abs(np.diagonal(r, axis1=1, axis2=2)) < _ALIKE * np.abs(r).max(axis=(1, 2))[:, None]).any():
            return None
        x = np.linalg.solve(r, np.swapaxes(q, 1, 2) @ both[:, :, p:])[:, :, 0]
        left = triangles[:, :, p] - np.einsum("jab,jb->ja", triangles[:, :, :p], x)
        rss = (left**2).sum(axis=1)
        free = n - (q[:, :p] ** 2).sum(axis=(1, 2))
        present = present if few is None else rss
    distance = (ridge[:, :, p] - ridge[:, np.arange(k), np.arange(k)] * x[:, :k]) ** 2
    roots = 2 * np.log(np.abs(np.diagonal(r, axis1=1, axis2=2)))
    total = n + freedom
    mode = np.maximum((squares + rss) / total, least**2)
    misfits = total * np.log(mode) + total + log_det + distance.sum(axis=1) + roots[:, :k].sum(axis=1)
    misfits += 2 * np.log(u * scale[p - k :]).sum()
    evidence = misfits + roots[:, k:].sum(axis=1)
    weight = np.exp(-(evidence - evidence.min()) / 2)
    # by the likelihood alone ρ comes out too small, for the law follows correlated noise: it is adjusted for the law's
    # parameters (D. R. Cox & N. Reid, J. R. Stat. Soc. B 49, 1 (1987)), and counts from that of independent noise
    misfit = evidence.min() - 2 * np.log(weight.mean()) - roots[0, k:].sum()
    weight /= weight.sum()

    inverse = np.linalg.inv(r)
    mean = weight @ x
    away = x - mean
    units = scale[order]
    spread = np.einsum("j,jab,jcb->ac", weight, inverse, inverse) + np.einsum("j,ja,jb->ab", weight, away, away)
    full = inverse @ np.swapaxes(inverse, 1, 2)
    of_prior = full[:, :, :k] * ridge[:, None, np.arange(k), np.arange(k)]
    squared, signed = (np.einsum("j,jak->ka", weight, each) for each in (of_prior**2, of_prior))
    beforehand = np.sqrt(squared) * np.sign(signed)
    alone = full[0] - of_prior[0] @ of_prior[0].T
    back = np.argsort(order)
    return Posterior(
        step=(mean / units)[back],
        covariance=(spread / np.outer(units, units))[np.ix_(back, back)],
        beforehand=(beforehand / units)[:, back],
        independent=(alone / np.outer(units, units))[np.ix_(back, back)],
        rho=float(weight @ rho),
        rho_u=float(np.sqrt(max(weight @ rho**2 - (weight @ rho) ** 2, 0.0))),
        variance=float(s2[0]),
        misfit=float(misfit),
    )


def probability(
    time: Array, residuals: Array, slopes: Array, priors: tuple[Array, Array], noise: Noise
) -> tuple[float, Array]:
    """Return −2 ln of a point's probability, averaged over ρ with s at its mode, and rows that lead to a better point.

    The arguments are those of `posterior`.  The rows have the shape (m, p + 1): where the model is linear a step x
    makes the number less as it does |rows (−x, 1)|².
    """
    (p, n), (expected, u), (freedom, squares, least, rho, _) = slopes.shape, priors, noise
    if not (np.isfinite(slopes).all() and np.isfinite(residuals).all()):
        return float("inf"), np.empty((0, p + 1))
    k, away = len(u), expected / u
    triangles, log_det = _triangles(time, np.vstack([slopes, residuals]), rho)
    total = squares + np.maximum((triangles[:, :, p] ** 2).sum(axis=1), n * least**2)
    free = max(n - (p - k) + freedom, 0.5)
    each = free * np.log(total) + log_det
    weight = np.exp((each.min() - each) / 2)
    rows = (np.sqrt(weight / weight.sum() * free / total)[:, None, None] * triangles).reshape(-1, p + 1)
    ridge = np.column_stack([np.zeros((k, p - k)), np.diag(1 / u), away])
    return float(each.min() - 2 * np.log(weight.mean()) + away @ away), np.vstack([rows, ridge])


def _triangles(time: Array, columns: Array, rho: Array) -> tuple[Array, Array]:
    """Return the triangles R of QR = W columnsᵀ and ln |WᵀW|⁻¹, W making news of values, for each correlation.

    By one orthogonal decomposition of the columns themselves, whose squares lose no digits.

    Args:
        time: shape (n,).
        columns: shape (k, n).
        rho: of neighbours, shape (r,).

    Returns:
        Shapes (r, k, k) and (r,).
    """
    q, r = np.linalg.qr(columns.T)
    steps = np.diff(time)
    each = rho[:, None] ** (steps / np.median(steps))
    left = 1 - each**2
    if len(rho) * q.size <= _AT_ONCE:
        news = (q[1:] - each[:, :, None] * q[:-1]) / np.sqrt(left)[:, :, None]
        squares = np.swapaxes(news, 1, 2) @ news + np.outer(q[0], q[0])
    else:
        squares = np.array([_squares(q, *pair) for pair in zip(each, left, strict=True)])
    found = np.zeros((len(rho), len(columns), len(columns)))
    found[:, : len(r)] = np.swapaxes(np.linalg.cholesky(squares), 1, 2) @ r
    return found, np.log(left).sum(axis=1)


def _squares(q: Array, each: Array, left: Array) -> Array:
    """Return the squares of the news of one correlation, shape (k, k)."""
    news = (q[1:] - each[:, None] * q[:-1]) / np.sqrt(left)[:, None]
    return np.asarray(news.T @ news + np.outer(q[0], q[0]))
