"""The drag of a top of which nothing is known: its exponent, and the curve that its spins lie on."""

from typing import NamedTuple

import numpy as np

from analysis.arrays import Array

#: A drag in proportion to the n-th power of the spin changes its slope by n slope²/spin a second.  n is evenly
#: distributed from 1 to 2: its standard deviation is 1/√12.
EXPONENT, EXPONENT_U = 1.5, 0.29
#: That of n where a drive may have drawn the top: an even ramp, n = 0, is two u away.
RAMPED_U = 0.75
#: The fit is repeated with the exponent that it finds, and no exponent is beyond these.
_ROUNDS, _WITHIN = 8, (-3.0, 6.0)


class Curve(NamedTuple):
    """The curve through some spins.

    Attributes:
        slope: at the mean of the times, weighted as the spins are [Hz/s]; u: its standard uncertainty [Hz/s].
        residuals: shape (n,) [Hz].
        chi_square: of them, and of the exponent.
    """

    slope: float
    u: float
    residuals: Array
    chi_square: float


def fit_curve(time: Array, frequency: Array, u: Array) -> Curve:
    """Fit dν/dt = −cνⁿ, with a prior of n: a line in (ν^(1 − n) − 1)/(1 − n), which another n bends.

    Args:
        time: two of them at least differ, shape (n,) [s].
        frequency: shape (n,) [Hz].
        u: its standard uncertainties, shape (n,) [Hz].
    """
    from scipy.special import boxcox, inv_boxcox

    late, exponent = time - np.average(time, weights=u**-2), EXPONENT
    for _ in range(_ROUNDS):
        line, hz = boxcox(frequency, 1 - exponent), frequency**exponent  # of the line's ordinate
        steep = np.polynomial.polynomial.polyfit(late, line, 1, w=hz / u)[1]
        bend = 0.5 * steep**2 * frequency.mean() ** (exponent - 1) * late**2
        design = np.column_stack([np.ones_like(late), late, RAMPED_U * bend])
        prior = np.append(line * hz / u, (EXPONENT - exponent) / RAMPED_U)
        weighted = np.vstack([design * (hz / u)[:, None], [0.0, 0.0, 1.0]])
        middle, slope, more = found = np.linalg.lstsq(weighted, prior)[0]
        exponent, fitted = float(np.clip(exponent + RAMPED_U * more, *_WITHIN)), exponent
    there = float(inv_boxcox(middle, 1 - fitted))
    slopes = np.array([fitted * slope * there ** (2 * fitted - 1), there**fitted, 0.0])
    return Curve(
        float(slope * there**fitted),
        float(slopes @ np.linalg.inv(weighted.T @ weighted) @ slopes) ** 0.5,
        hz * (line - design @ found),
        float(np.sum((prior - weighted @ found) ** 2)),
    )
