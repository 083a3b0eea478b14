"""A straight line through points with their uncertainties: weighted, or with uncertainties along both axes.

Source: Draper & Smith, Applied Regression Analysis (1998), §3 (bands), §5 (joint regions), §8 (influence); York,
Evensen, López Martínez & De Basabe Delgado, Am. J. Phys. 72, 367 (2004), §III (uncertainties along both axes).

Everything is computed about the weighted mean of x, where slope and height are uncorrelated: about zero, far outside
a sweep from 26 to 40 Hz, they would be correlated by −0.99.
"""

import math
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.errors import AnalysisError, TooFewReadings
from analysis.uncertainty import BELIEVED

#: Fewer points leave no degree of freedom beside two parameters.
FEWEST = 3
#: A χ² less probable than this is named.
NO_FIT = 1e-3
#: Confidence of the bands.
CONFIDENCE = 0.95
#: York's iteration ends at this relative change of the slope.  It takes 5 to 10 rounds; after a hundred it has failed.
_CLOSE, _MOST_ROUNDS = 1e-14, 100
#: A scatter below this share of the values is rounding.
_ROUNDING = 1e-13


class NoRange(AnalysisError):
    """Points that all lie at one drive frequency [Hz]."""

    def __init__(self, *, at: float, seen: int) -> None:
        self.at, self.seen = at, seen
        super().__init__(
            "all {seen} points are at a drive frequency of {at:g} Hz, a line needs several: sweep the drive"
        )


@dataclass(frozen=True)
class Line:
    """y = intercept + slope·x.

    Attributes:
        slope, u_slope: [1]; u is None if the points leave it undefined.
        intercept, u_intercept: at x = 0 [Hz].
        centre: weighted mean of x [Hz].
        height, u_height: of the line there [Hz]; uncorrelated with the slope.
        correlation: of slope and intercept.
        n: points.
        chi_square: Σ(residual/u)²; None where no u was given.
        p_fit: probability of such a χ², or a larger one, if the line and the u are right.
        scale: factor on the points' u: the root of χ² per degree of freedom, combined with a prior of 1; without u, the
            scatter about the line [Hz].
        freedom: degrees of freedom of the scale.
        orthogonal: whether u along x counts, too.
    """

    slope: float
    u_slope: float | None
    intercept: float
    u_intercept: float | None
    centre: float
    height: float
    u_height: float | None
    correlation: float | None
    n: int
    chi_square: float | None
    p_fit: float | None
    scale: float
    freedom: float
    orthogonal: bool

    @property
    def degrees_of_freedom(self) -> int:
        """Points beyond the two parameters."""
        return self.n - 2

    @property
    def quantile(self) -> float:
        """Half the width of a 95 % interval, in standard uncertainties."""
        from scipy.special import stdtrit

        return float(stdtrit(self.freedom, (1 + CONFIDENCE) / 2))

    def at(self, x: Array) -> Array:
        """Return the line at x [Hz]."""
        return np.asarray(self.height + self.slope * (x - self.centre))

    def u_at(self, x: Array) -> Array:
        """Return the standard uncertainty of the line at x [Hz], NaN if it is undefined."""
        if self.u_slope is None or self.u_height is None:
            return np.full_like(x, np.nan)
        return np.hypot(self.u_height, self.u_slope * (x - self.centre))

    def confidence_band(self, x: Array) -> Array:
        """Return half the width, at each x, of the band that contains the line with 95 % [Hz]."""
        return self.quantile * self.u_at(x)

    def prediction_band(self, x: Array, u: float) -> Array:
        """Return half the width of the band that contains one more point of this u with 95 % [Hz]."""
        return self.quantile * np.hypot(self.u_at(x), self.scale * u)

    def p_against(self, slope: float = 1.0, intercept: float = 0.0) -> float | None:
        """Return the probability of such a departure from a line, or a larger one, if that line is true.

        Slope and intercept are tested jointly, by F with two degrees of freedom and those of the scale.  None if the
        points leave it undefined.
        """
        if not self.u_slope or not self.u_height:
            return None
        from scipy.special import fdtrc

        off = (self.slope - slope) / self.u_slope
        aside = (self.height - intercept - slope * self.centre) / self.u_height
        return float(fdtrc(2, self.freedom, (off**2 + aside**2) / 2))


@dataclass(frozen=True)
class Influence:
    """The effect of each point on the line, shape (n,) each.

    Attributes:
        leverage: how far the line follows the point, 0 to 1.
        residual: y − line [Hz].
        studentised: the residual in units of its own standard deviation, by the scale of the other points; NaN if it is
            undefined.
        slope_change, intercept_change: of the line without the point, less that of the line with it.
    """

    leverage: Array
    residual: Array
    studentised: Array
    slope_change: Array
    intercept_change: Array


def fit_line(x: Array, y: Array, u: Array | None = None) -> Line:
    """Fit the weighted line through points.

    Args:
        x: shape (n,) [Hz].
        y: shape (n,) [Hz].
        u: standard uncertainty of y, shape (n,) [Hz]; None: not known, so all weigh alike and the scatter gives u.

    Raises:
        TooFewReadings: fewer than three points.
        NoRange: all points are at one x.

    >>> line = fit_line(np.array([26.0, 30.0, 34.0]), np.array([26.01, 30.0, 33.99]), np.full(3, 0.01))
    >>> round(line.slope, 4), round(line.intercept, 4), round(line.u_slope, 5)
    (0.9975, 0.075, 0.00167)
    """
    _check(x)
    weight = np.ones_like(x) if u is None else u**-2.0
    centre, height, s_xx = _means(x, y, weight)
    slope = float(np.sum(weight * (x - centre) * (y - height)) / s_xx)
    return _line(x, y, weight, (centre, height, slope, s_xx), u_given=u is not None, orthogonal=False)


def fit_orthogonal(x: Array, y: Array, u_x: Array, u_y: Array, *, known: bool = True) -> Line:
    """Fit the most probable line through points with uncertainties along both axes.

    Args:
        x: shape (n,) [Hz].
        y: shape (n,) [Hz].
        u_x: standard uncertainty of x, shape (n,) [Hz].
        u_y: standard uncertainty of y, shape (n,) [Hz].
        known: whether these are uncertainties, or only their ratios.

    Raises:
        TooFewReadings: below three.
        NoRange: all at one x.
    """
    _check(x)
    slope = fit_line(x, y, u_y).slope
    for _ in range(_MOST_ROUNDS):
        weight, before = 1 / (u_y**2 + slope**2 * u_x**2), slope
        centre, height, _ = _means(x, y, weight)
        off, aside = x - centre, y - height
        beta = weight * (off * u_y**2 + slope * aside * u_x**2)
        slope = float(np.sum(weight * beta * aside) / np.sum(weight * beta * off))
        if abs(slope - before) <= _CLOSE * abs(slope):
            break
    weight = 1 / (u_y**2 + slope**2 * u_x**2)
    true_x = centre + weight * (off * u_y**2 + slope * aside * u_x**2)  # the most probable, eq. (13f) there
    inner = float(np.sum(weight * true_x) / np.sum(weight))
    s_xx = float(np.sum(weight * (true_x - inner) ** 2))
    at_inner = height + slope * (inner - centre)
    return _line(x, y, weight, (inner, at_inner, slope, s_xx), u_given=known, orthogonal=True)


def influence(x: Array, y: Array, line: Line, weight: Array) -> Influence:
    """Compute the effect of each point on a line.

    If uncertainties along both axes count, the weights, in which the slope appears, are held fixed: the changes are
    then right to first order.

    Args:
        x: shape (n,) [Hz].
        y: shape (n,) [Hz].
        line: through these points.
        weight: 1/u² of each, shape (n,).
    """
    off = x - float(np.sum(weight * x) / np.sum(weight))
    s_xx = float(np.sum(weight * off**2))
    leverage = np.minimum(weight * (1 / np.sum(weight) + off**2 / s_xx), 1.0)
    residual = y - line.at(x)
    alone = np.maximum(1 - leverage, 1e-12)  # a point that the line must go through
    slope_change = -weight * off * residual / (s_xx * alone)
    middle_change = -weight * residual / (np.sum(weight) * alone)
    intercept_change = middle_change - slope_change * (x - off)
    own = residual * np.sqrt(weight / alone)
    prior = line.freedom - line.degrees_of_freedom
    left = prior + float(np.sum(weight * residual**2)) - own**2  # without the point
    with np.errstate(invalid="ignore", divide="ignore"):
        studentised = np.where(left > 0, own / np.sqrt(left / (line.freedom - 1)), np.nan)
    return Influence(leverage, residual, studentised, slope_change, intercept_change)


# --- what both fits share ---


def _check(x: Array) -> None:
    if x.size < FEWEST:
        raise TooFewReadings(seen=x.size, needed=FEWEST)
    if np.ptp(x) <= _ROUNDING * np.abs(x).max():
        raise NoRange(at=float(x[0]), seen=x.size)


def _means(x: Array, y: Array, weight: Array) -> tuple[float, float, float]:
    """Return the weighted means of x and y, and Σw(x − mean)²."""
    total = np.sum(weight)
    centre, height = float(np.sum(weight * x) / total), float(np.sum(weight * y) / total)
    return centre, height, float(np.sum(weight * (x - centre) ** 2))


def _line(
    x: Array, y: Array, weight: Array, solution: tuple[float, float, float, float], *, u_given: bool, orthogonal: bool
) -> Line:
    """Return the line with its uncertainties; `solution` is centre, height there, slope, Σw(x − centre)²."""
    centre, height, slope, s_xx = solution
    dof = x.size - 2
    residual = y - height - slope * (x - centre)
    left = float(np.sum(weight * residual**2))
    p_fit, prior = None, 0.0
    if u_given:
        from scipy.special import chdtrc

        p_fit = float(chdtrc(dof, left))
        prior = BELIEVED / max(left / dof, 1.0)  # points that scatter far beyond their u leave it no weight
    scale = math.sqrt((left + prior) / (dof + prior))
    rounding = _ROUNDING * float(np.abs(y).max()) * math.sqrt(float(weight.max()))
    u_slope = u_height = u_intercept = correlation = None
    if scale > rounding:
        u_slope, u_height = scale / math.sqrt(s_xx), scale / math.sqrt(float(np.sum(weight)))
        u_intercept = math.hypot(u_height, centre * u_slope)
        correlation = -centre * u_slope / u_intercept
    return Line(
        slope=slope,
        u_slope=u_slope,
        intercept=height - slope * centre,
        u_intercept=u_intercept,
        centre=centre,
        height=height,
        u_height=u_height,
        correlation=correlation,
        n=x.size,
        chi_square=left if u_given else None,
        p_fit=p_fit,
        scale=scale,
        freedom=dof + prior,
        orthogonal=orthogonal,
    )
