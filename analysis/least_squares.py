"""Least squares by Levenberg and Marquardt (MINPACK's lmder), with exact slopes; intervals by lmfit.

A fit calls MINPACK through scipy, as lmfit does itself: the same steps to the same numbers, at half the time.  Setting
parameters up and wrapping each evaluation cost more than the evaluations, and a cross-check makes hundreds of fits.
"""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Residual = Callable[[Array], Array]  # q of shape (p,) → (model − data)/u of shape (n,)
Gradient = Callable[[Array], Array]  # q of shape (p,) → slopes of that, shape (p, n)

# A step that changes χ² or q by less than this ends the search: then q is within 1e-5 standard uncertainties of the
# minimum, and exact to about 1e-12 where the data are free of noise.
TOLERANCE = 1e-12
MOST_EVALUATIONS = 500  # a sound fit needs 5 to 30
# MINPACK's words for an end: all but "improper input" (0) and "too many evaluations" (5).
_ENDED = frozenset({1, 2, 3, 4, 6, 7, 8})


def _minimizer(residual: Residual, gradient: Gradient, start: Array) -> Any:
    from lmfit import Minimizer, Parameter

    def values(parameters: Any) -> Array:
        return np.array([parameter.value for parameter in parameters.values()])

    def slopes(parameters: Any) -> Array:
        free = [parameter.vary for parameter in parameters.values()]  # a profile holds one of them fixed
        rows = gradient(values(parameters))
        return rows if all(free) else rows[free]

    return Minimizer(
        lambda parameters: residual(values(parameters)),
        [Parameter(f"q{i}", value=float(value)) for i, value in enumerate(start)],
        max_nfev=MOST_EVALUATIONS,
        Dfun=slopes,
        col_deriv=1,
        ftol=TOLERANCE,
        xtol=TOLERANCE,
    )


def solve(
    residual: Residual,
    gradient: Gradient,
    start: Array,
    most: int = MOST_EVALUATIONS,
    tolerance: float = TOLERANCE,
) -> tuple[Array, bool]:
    """Find the parameters of the smallest sum of squares, and whether the search converged.

    A search that does not end within `most` evaluations returns the best point found.  One that begins where a
    residual is no number has not ended, though MINPACK says so.
    """
    from scipy.optimize import leastsq

    with np.errstate(all="ignore"):  # a search may step to where a law overflows, and comes back
        q, _, info, _, ended = leastsq(
            residual,
            start,
            Dfun=gradient,
            col_deriv=True,
            full_output=True,
            ftol=tolerance,
            xtol=tolerance,
            gtol=0.0,
            maxfev=most,
        )
    return np.atleast_1d(q), ended in _ENDED and bool(np.isfinite(info["fvec"]).all())


def profile(
    residual: Residual, gradient: Gradient, best: Array, u: Array, variance: float | None
) -> list[tuple[float, float] | None]:
    """Return profile-likelihood intervals of 68.27 %, over which χ² minimised by the other parameters is small enough.

    Args:
        residual: of parameters that are wanted themselves, not of a transform of them.
        gradient: its slopes.
        best: its solution, shape (p,).
        u: standard uncertainties to take the first step by, shape (p,).
        variance: of the residuals, by which χ² may grow. None: unknown, then an F-test decides.

    Returns:
        For each parameter the two ends, None where an end does not exist or was not found.
    """
    from lmfit import MinimizerException, conf_interval
    from scipy.special import erf

    # In units of u, and away from zero, lmfit's first step and its relative tolerance suit every parameter.
    offset = 10.0

    def unscale(z: Array) -> Array:
        return best + (z - offset) * u

    def grown(old: Any, new: Any) -> float:
        return float(erf(np.sqrt(max(new.chisqr - old.chisqr, 0.0) / (variance or 1.0) / 2)))

    minimizer = _minimizer(
        lambda z: residual(unscale(z)), lambda z: gradient(unscale(z)) * u[:, None], np.full(len(best), offset)
    )
    probability = None if variance is None else grown

    def ends(name: str, value: float, sigma: float) -> tuple[float, float] | None:
        try:
            found = conf_interval(minimizer, result, p_names=[name], sigmas=[1], prob_func=probability)[name]
        except (MinimizerException, ArithmeticError, RuntimeError, ValueError):  # no such end
            return None
        low, high = (float(value + (end - result.params[name].value) * sigma) for _, end in (found[0], found[-1]))
        return (low, high) if np.isfinite([low, high]).all() and low < value < high else None

    with warnings.catch_warnings(), np.errstate():  # lmfit warns of ends it does not find and alters numpy's state
        warnings.simplefilter("ignore")
        result = minimizer.leastsq()
        return [ends(*each) for each in zip(result.params, best, u, strict=True)]
