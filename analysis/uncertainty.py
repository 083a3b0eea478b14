"""Standard uncertainties: of an estimate, of a mean, from curvature.

Source: JCGM 100:2008 (GUM) for the words; Bates & Watts, Nonlinear Regression Analysis (1988), §2.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array

#: Of the numbers: what these differ by less is the computer's, and no scatter of theirs.
ROUNDING = 64 * float(np.finfo(float).eps)

#: u that was given is believed within a quarter of it: as of 8 degrees of freedom (GUM G.4.2).
BELIEVED = 8.0

#: Degrees of freedom with which an interval of 68 % is 1.3 u or wider.
FEW_LEFT = 2


def partly_believed(chi_square: float, freedom: int) -> float:
    """Return the factor of standard uncertainties that were given, from χ² and its degrees of freedom."""
    return math.sqrt((chi_square + BELIEVED) / (freedom + BELIEVED))


def student(freedom: float, deviations: float = 1.0) -> float:
    """Return the factor that widens a standard deviation from few degrees of freedom to the same coverage."""
    if freedom > 200:
        return deviations
    from scipy.special import ndtr, stdtrit

    return float(stdtrit(max(freedom, 1.0), float(ndtr(deviations))))


@dataclass(frozen=True)
class Estimate:
    """A quantity as estimated.

    Attributes:
        value: None where no float can hold it.
        u: standard uncertainty; None where the readings leave it undefined.
        unit: of both.
        interval: the two ends of a 68 % interval, where one was asked for and found.
    """

    value: float | None
    u: float | None
    unit: str
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class Mean(Estimate):
    """The mean of a quantity over several runs; u is its standard error.

    Attributes:
        scatter: standard deviation of one run's value from another's; None with one run.
        degrees_of_freedom: of scatter and u.
    """

    scatter: float | None = None
    degrees_of_freedom: int = 0


def mean(estimates: Sequence[Estimate], shared_u: Sequence[float] = ()) -> Mean:
    """Return the mean of a quantity over the runs that have it, with u = s/√N from their scatter s (GUM 4.2).

    Few runs may agree by chance: u is no smaller than the runs' own uncertainties leave to their mean, √Σu²/N.
    Of one run: its own value and u.  The part of u that is the same in all runs, as that of a tilt, does not show in
    their scatter, and no number of runs makes it smaller: it is added.

    Args:
        estimates: one a run.
        shared_u: that part of each one's u.

    >>> mean([Estimate(value, 0.01, "Hz") for value in (1.0, 2.0, 3.0)])
    Mean(value=2.0, u=0.577..., unit='Hz', interval=None, scatter=1.0, degrees_of_freedom=2)
    """
    unit = estimates[0].unit
    shared = shared_u or [0.0] * len(estimates)
    kept = [(each, part) for each, part in zip(estimates, shared, strict=True) if each.value is not None]
    values = np.array([estimate.value for estimate, _ in kept])
    if not len(values):
        return Mean(None, None, unit)
    if len(values) == 1:
        only = next(estimate for estimate in estimates if estimate.value is not None)
        return Mean(only.value, only.u, unit, only.interval)
    with np.errstate(over="ignore", invalid="ignore"):
        average, scatter = float(values.mean()), float(values.std(ddof=1))
    if not np.isfinite([average, scatter]).all():
        return Mean(None, None, unit)
    own = [np.sqrt(max(estimate.u**2 - part**2, 0.0)) for estimate, part in kept if estimate.u is not None]
    least = float(np.sqrt(np.sum(np.square(own)))) / len(values) if len(own) == len(values) else 0.0
    u = math.hypot(max(scatter / float(np.sqrt(len(values))), least), float(np.mean([part for _, part in kept])))
    return Mean(average, u, unit, scatter=scatter, degrees_of_freedom=len(values) - 1)


@dataclass(frozen=True)
class Curvature:
    """What the slopes at a solution say.

    Attributes:
        covariance: (JᵀJ)⁻¹, shape (p, p); None where the parameters cannot be separated.
        leverage: how far each fitted value follows its own reading, 0 to 1, shape (n,).
    """

    covariance: Array | None
    leverage: Array


def curvature(gradient: Array) -> Curvature:
    """Return the covariance for residuals of unit variance, and leverages, from slopes of shape (p, n).

    By QR of the scaled slopes, never by their squares: a normal matrix loses half the digits.
    """
    scale = np.linalg.norm(gradient, axis=1)
    if not (np.isfinite(scale).all() and (scale > 0).all()):
        return Curvature(None, np.zeros(gradient.shape[1]))
    rows = gradient / scale[:, None]
    triangle = np.linalg.qr(rows.T, mode="r")
    diagonal = np.abs(np.diagonal(triangle))
    if diagonal.min() < 1e-12 * diagonal.max():  # 1e-12: the parameters differ by less than rounding tells
        return Curvature(None, np.zeros(gradient.shape[1]))
    inverse = np.linalg.inv(triangle)
    orthonormal = inverse.T @ rows
    with np.errstate(over="ignore"):
        covariance = inverse @ inverse.T / np.outer(scale, scale)
    return Curvature(covariance, np.minimum(np.einsum("pn,pn->n", orthonormal, orthonormal), 1.0))


def propagate(covariance: Array, slopes: Array) -> tuple[Array | None, Array]:
    """Return the covariance of functions of parameters, and their standard uncertainties, to first order.

    Args:
        covariance: of the parameters, shape (p, p).
        slopes: of the functions with respect to them, shape (q, p).

    Returns:
        Covariance, shape (q, q), None where it overflows; and the uncertainties, shape (q,), which may be finite even
        so, and are NaN for functions with infinite slopes.
    """
    scale = np.abs(slopes).max(axis=1)
    finite = np.isfinite(scale)
    rows = np.where(finite[:, None], slopes, 0.0) / np.where(finite & (scale > 0), scale, 1.0)[:, None]
    unit = rows @ covariance @ rows.T
    with np.errstate(over="ignore", invalid="ignore"):
        full = unit * np.outer(scale, scale)
        u = scale * np.sqrt(np.maximum(np.diagonal(unit), 0.0))
    return (full if np.isfinite(full).all() else None), np.where(finite, u, np.nan)
