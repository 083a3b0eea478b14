"""Values of one quantity by several groups: their weighted mean, whether they agree, how far each lies off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Comparison:
    """What several values with standard uncertainties say together.

    Attributes:
        mean: weighted by 1/u².
        u: of the mean, from the u of the values alone.
        chi_square: Σ((value − mean)/u)².
        freedom: its degrees of freedom.
        p: the probability that chance makes it so large.
        scatter: standard deviation of the values, unweighted; None of one value.
        distances: from each value to the mean of the others, in units of the u of that difference; None of one value.
    """

    mean: float
    u: float
    chi_square: float
    freedom: int
    p: float
    scatter: float | None
    distances: tuple[float | None, ...]


def compare(values: ArrayLike, u: ArrayLike) -> Comparison:
    """Compare values.

    The distance (x − m)/√(u² − u_m²) from the mean m of all is that from the mean of the others: m holds a part
    u_m²/u² of the value itself.

    Args:
        values: shape (n,), n at least 1.
        u: their standard uncertainties, shape (n,), positive.
    """
    from scipy.special import chdtrc

    x: NDArray[np.float64] = np.asarray(values, float)
    of_x: NDArray[np.float64] = np.asarray(u, float)
    weights = (of_x.min() / of_x) ** 2
    mean = float(weights @ x / weights.sum())
    of_mean = float(of_x.min() / math.sqrt(weights.sum()))
    chi_square, freedom = float((((x - mean) / of_x) ** 2).sum()), len(x) - 1
    if not freedom:
        return Comparison(mean, of_mean, chi_square, 0, 1.0, None, (None,))
    others = np.sqrt(of_x**2 - of_mean**2)
    return Comparison(
        mean,
        of_mean,
        chi_square,
        freedom,
        float(chdtrc(freedom, chi_square)),
        float(x.std(ddof=1)),
        tuple(((x - mean) / others).tolist()),
    )
