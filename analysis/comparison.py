"""Values of one quantity by several groups: whether they agree, and how far each lies off.

Each group has a top of its own: value = mean + difference of its top + error, the differences normal with a standard
deviation τ that the values tell themselves (R. C. Paule & J. Mandel, J. Res. NBS 87, 377 (1982)).  Where the values
agree within their u, τ is zero.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Comparison:
    """What several values with standard uncertainties say together.

    Attributes:
        between: τ, the standard deviation of the groups beyond their u.
        chi_square: Σ((value − mean)/u)² about the mean weighted by 1/u².
        freedom: its degrees of freedom.
        p: the probability that chance makes it so large.
        scatter: standard deviation of the values, unweighted; None of one value.
        distances: from each value to the mean of the others, in units of the u of that difference, with the τ of the
            others; None of one value.
    """

    between: float
    chi_square: float
    freedom: int
    p: float
    scatter: float | None
    distances: tuple[float | None, ...]


def compare(values: ArrayLike, u: ArrayLike) -> Comparison:
    """Compare values.

    Args:
        values: shape (n,), n at least 1, finite.
        u: their standard uncertainties, shape (n,), positive.
    """
    from scipy.special import chdtrc

    x: NDArray[np.float64] = np.asarray(values, float)
    of_x: NDArray[np.float64] = np.asarray(u, float)
    chi_square, freedom = weighted_mean(x, of_x)[2], len(x) - 1
    if not freedom:
        return Comparison(0.0, chi_square, 0, 1.0, None, (None,))
    return Comparison(
        scatter_between(x, of_x),
        chi_square,
        freedom,
        float(chdtrc(freedom, chi_square)),
        float(x.std(ddof=1)),
        tuple(_from_others(x, of_x, k) for k in range(len(x))),
    )


#: Tops of one kind differ by some part of a value: the four published drags of one top by 2 %, other washers make more.
_TOPS = 0.05


def _prior_of_tops(taus: NDArray[np.float64], size: ArrayLike, u: float) -> NDArray[np.float64]:
    """Return the density of ln τ: τ is half a Student's t with 2 degrees of freedom, its scale a part of the size."""
    steps = taus / (_TOPS * np.asarray(size) + u)
    return np.asarray(steps * (1 + steps**2) ** -1.5)


def _from_others(x: NDArray[np.float64], u: NDArray[np.float64], k: int) -> float:
    """Return the distance of a value from the mean of the others, in units of the u of their difference.

    τ is that of the others, which a value far off does not widen, and few of them leave it uncertain: the probability
    of a value as far off is averaged over all τ by their likelihood (A. Gelman et al., Bayesian Data Analysis, 3rd ed.
    (2013), eq. 5.20 and 5.21), with the prior 1/(u + τ): flat below their u, and of an unknown scale above.  The
    distance is that of a normal number as improbable.  Where τ is far above u, it is Student's t with n − 2 degrees of
    freedom.  One other value tells nothing of τ, which then has the prior of `gross_errors`: two tops differ, too.
    """
    from scipy.special import log_ndtr, ndtri_exp

    others, of_others = np.delete(x, k), np.delete(u, k)
    typical = 1 / math.sqrt(np.mean(of_others**-2.0))
    steps = np.geomspace(1e-3, 1e3 * (1 + np.ptp(x) / typical), 100)  # outside them lies less than 10⁻³
    taus = typical * steps
    of_tops = _prior_of_tops(taus, np.abs(x).min(), 1 / math.sqrt(np.mean(u**-2.0)))
    log_prior = np.log(steps / (1 + steps) if len(others) > 1 else of_tops)
    weights = 1 / (of_others**2 + taus[:, None] ** 2)
    total = weights.sum(axis=1)
    means = weights @ others / total
    chi_square = (weights * (others - means[:, None]) ** 2).sum(axis=1)
    log_p = log_prior + (np.log(weights).sum(axis=1) - np.log(total) - chi_square) / 2
    distances = (x[k] - means) / np.sqrt(u[k] ** 2 + taus**2 + 1 / total)
    log_p -= np.logaddexp.reduce(log_p)
    below, above = (np.logaddexp.reduce(log_p + log_ndtr(side * distances)) for side in (1.0, -1.0))
    return float(ndtri_exp(below) if below < above else -ndtri_exp(above))


#: Tops of another kind, of another mass and radius, differ by more; values that differ by less are not grossly wrong.
_OTHER_TOPS = 0.15
#: How many of all values are of such a top, and how many are grossly wrong, before any is seen: of routine data 1 to
#: 10 % are outliers (F. R. Hampel et al., Robust Statistics (1986), section 1.2c).
_SHARE_OTHER, _SHARE_GROSS = 0.1, 0.05
#: By how much u may be too small, of few readings.
_U_TOO_SMALL = 3.0
#: Values about which means are tried: of 1000 groups it takes 1 s, of all 10 s, and probabilities agree to 10⁻⁵.
_CENTRES = 300


def gross_errors(values: ArrayLike, u: ArrayLike) -> NDArray[np.float64]:
    """Return for each value the probability that it is grossly wrong, as by a wrong unit; 0 of less than three.

    A value is normal about the mean μ, with its u and the τ of the tops; or with the scatter of tops of another kind,
    too; or it is wrong by about its size, and Cauchy's (good and bad data: D. S. Sivia, Data Analysis, 2nd ed. (2006),
    section 8.3.2).  μ has the prior 1/|μ|, τ a half Student's t with 2 degrees of freedom, whose scale is a part of μ
    (A. Gelman, Bayesian Anal. 1, 515 (2006)).  Both are integrated over, so that no value far off widens τ.

    Args:
        values: shape (n,), finite.
        u: their standard uncertainties, shape (n,), positive.
    """
    x, of_x = np.asarray(values, float)[:, None], np.asarray(u, float)[:, None]
    if len(x) < 3:  # of two nothing says which one is wrong
        return np.zeros(len(x))
    widest, typical = float(np.ptp(x) + of_x.max()), 1 / math.sqrt(np.mean(of_x**-2.0))
    some = np.argsort(x[:, 0])[:: 1 + len(x) // _CENTRES]  # many are near others
    steps = np.geomspace(of_x[some, 0] / 4, 4 * widest, max(2, 400 // len(x)))
    means = np.unique([x[some, 0], *(x[some, 0] + steps), *(x[some, 0] - steps)])
    taus = typical * np.geomspace(0.03, 10 * widest / typical, 40)
    size, square = np.abs(means), (x - means) ** 2
    far, scale = (_OTHER_TOPS * size + _U_TOO_SMALL * of_x) ** 2, size + _U_TOO_SMALL * of_x
    wrong = _SHARE_GROSS / (math.pi * scale * (1 + square / scale**2))
    prior = _prior_of_tops(taus[:, None], size, typical)
    log_p = np.log(prior / prior.sum(axis=0) * np.gradient(means) / (size + _U_TOO_SMALL * typical))
    tops, sums, shares = np.empty(len(taus)), np.empty(len(taus)), np.empty((len(taus), len(x)))
    for k, tau in enumerate(taus):
        sound = sum(
            share * np.exp(-square / variance / 2) / np.sqrt(2 * math.pi * variance)
            for share, variance in (
                (1 - _SHARE_OTHER - _SHARE_GROSS, of_x**2 + tau**2),
                (_SHARE_OTHER, of_x**2 + tau**2 + far),
            )
        )
        log_p[k] += np.log(wrong + sound).sum(axis=0)
        tops[k] = log_p[k].max()
        p = np.exp(log_p[k] - tops[k])
        sums[k], shares[k] = p.sum(), wrong / (wrong + sound) @ p
    weight = np.exp(tops - tops.max())
    return np.asarray(weight @ shares / (weight @ sums))


def weighted_mean(x: NDArray[np.float64], u: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the mean weighted by 1/u², its u, and χ² about it (W. G. Cochran, Biometrics 10, 101 (1954)).

    Args:
        x: shape (n,), n at least 1.
        u: of each, shape (n,), positive.
    """
    weights = (u.min() / u) ** 2
    mean = float(weights @ x / weights.sum())
    return mean, float(u.min() / math.sqrt(weights.sum())), float((((x - mean) / u) ** 2).sum())


def scatter_between(x: NDArray[np.float64], u: NDArray[np.float64], chi_square: float | None = None) -> float:
    """Return τ ≥ 0 so that χ² of the values with √(u² + τ²) equals a target; 0 if it is below the target with u alone.

    Args:
        x: shape (n,).
        u: of each, without their difference, shape (n,), not negative.
        chi_square: the target, positive; None: its expectation n − 1.
    """
    from scipy.optimize import brentq

    expected = len(x) - 1 if chi_square is None else chi_square

    def excess(tau: float) -> float:
        both = np.hypot(u, tau)
        return weighted_mean(x, both)[2] - expected if both.all() else math.inf

    widest = float(np.ptp(x))
    if not widest or excess(0.0) <= 0:
        return 0.0
    return widest * float(brentq(lambda part: excess(part * widest), 0.0, max(2.0, math.sqrt(len(x) / expected))))


def u_of_between(x: NDArray[np.float64], u: NDArray[np.float64]) -> float:
    """Return the standard uncertainty of τ: to the farther end of its 68 % interval, which covers near zero, too.

    The interval has the τ with which χ² is between its quantiles (W. Viechtbauer, Stat. Med. 26, 37 (2007)).  Values
    that agree better than their u by chance do not give τ better than those that agree as expected.

    Args:
        x: shape (n,), n at least 2.
        u: of each, without their difference, shape (n,), not negative.
    """
    from scipy.special import chdtri, ndtr

    freedom = len(x) - 1
    if not np.ptp(x):  # the limit for values that agree ever better
        return float(np.sqrt(np.mean(u**2) * (freedom / chdtri(freedom, ndtr(1.0)) - 1)))
    less = min(1.0, weighted_mean(x, u)[2] / freedom) if u.all() else 1.0
    ends = (scatter_between(x, u, less * float(chdtri(freedom, ndtr(side)))) for side in (-1.0, 1.0))
    tau = scatter_between(x, u)
    return max(abs(end - tau) for end in ends)
