"""Least squares by Levenberg and Marquardt (MINPACK's lmder through scipy), with exact slopes."""

from collections.abc import Callable

import numpy as np

from analysis.arrays import Array

Residual = Callable[[Array], Array]  # q of shape (p,) → (model − data)/u of shape (n,)
Gradient = Callable[[Array], Array]  # q of shape (p,) → slopes of the residuals, shape (p, n)

# A step that changes χ² or q by less than this ends the search: then q is within 1e-5 standard uncertainties of the
# minimum, and exact to about 1e-12 where the data are free of noise.
TOLERANCE = 1e-12
MOST_EVALUATIONS = 500  # a sound fit needs 5 to 30
# MINPACK's words for an end: all but "improper input" (0) and "too many evaluations" (5).
_ENDED = frozenset({1, 2, 3, 4, 6, 7, 8})


def solve(
    residual: Residual, gradient: Gradient, start: Array, most: int = MOST_EVALUATIONS, tolerance: float = TOLERANCE
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
