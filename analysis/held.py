"""A spin that is held by the amplitude of a drive: the drag that the amplitude balances, and laws through several.

The pull p goes with the share s of the full amplitude, and dν/dt = s p − d: the full amplitude gains g = p − d, which
is measured before and after the hold.  Over a hold of length T the spin changes by Δν = (g + d)∫s dt − d T, so

    d = (g ∫s dt − Δν)/(T − ∫s dt).

The gain is seen over some spins about the held one.  From the mean of these it is brought to the held spin by the drag,
and by the pull: that of a top whose moment is tilted, which leans, goes with 1/(1 − (ν_r/ν)²), of an upright one it is
the same everywhere.

Source: PHYSICS.md §7.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from analysis.arrays import Array
from analysis.drag import EXPONENT, EXPONENT_U
from analysis.least_squares import solve
from analysis.spindown.drag import LAWS, DragLaw
from analysis.spindown.selection import Statistics, statistics, weigh
from analysis.spindown.tilt import THESIS_TOP
from analysis.uncertainty import Estimate, curvature, propagate, student

#: Readings that follow each other by more than this multiple of the usual time have a loss of the top between them.
_GAP = 1.5
#: No top is held below this spin [Hz].
_LOWEST_HZ = 24.0
#: Laws are compared where the exponent of the drag is known to this u: two of it are from Stokes's law to the disc's.
_EXPONENT_U = 0.25


@dataclass(frozen=True)
class Hold:
    """A held spin.

    Attributes:
        spin: mean of the readings [Hz].
        scatter: their standard deviation [Hz].
        share: of the full amplitude, its mean.
        gain: of the spin at the full amplitude [Hz/s]; None where none was measured.
        drag: at this spin [Hz/s]; None where no gain was measured.
        parts: name of a part of the drag's u → its size [Hz/s].
    """

    spin: Estimate
    scatter: Estimate
    share: float
    gain: Estimate | None
    drag: Estimate | None
    parts: dict[str, float]


def hold_of(time: Array, spin: Array, u: Array, share: Array, gains: Sequence[tuple[Array, Array]]) -> Hold:
    """Return the mean spin of the readings, and the drag that the amplitude balanced there.

    Args:
        time: of the readings, at least two, shape (n,) [s].
        spin: shape (n,) [Hz].
        u: of the spin, shape (n,) [Hz].
        share: of the full amplitude, shape (n,).
        gains: times [s] and counts [Hz] at the full amplitude, each of shape (m,), m > 2.

    >>> ramp = np.arange(10.0), 44.0 + 0.2 * np.arange(10.0)
    >>> n = np.ones(9)
    >>> found = hold_of(np.arange(9.0), 44.9 * n, 0.01 * n, 0.5 * n, [ramp])
    >>> round(found.drag.value, 6)
    0.2
    """
    n = len(spin)
    mean, scatter = float(spin.mean()), float(spin.std(ddof=1))
    held = Estimate(mean, scatter / sqrt(n), "Hz"), Estimate(scatter, scatter / sqrt(2 * (n - 1)), "Hz")
    gain, beside = _gain(gains, mean)
    lapse = np.diff(time)
    joined = lapse < _GAP * np.median(lapse)
    whole, driven = float(lapse[joined].sum()), float(((share[1:] + share[:-1]) / 2 * lapse)[joined].sum())
    mean_share = driven / whole
    if gain is None or gain.value is None or gain.u is None or mean_share >= 1:
        return Hold(*held, mean_share, gain, None, {})
    moved = float(np.diff(spin)[joined].sum())
    ends = np.diff(np.concatenate([[0.0], joined.astype(float), [0.0]]))  # readings that begin or end a stretch
    nu = max(mean, _LOWEST_HZ)
    # half of the change of ln pull: the top leans, or is upright
    lean = beside / (nu * ((nu / THESIS_TOP.resonance_hz) ** 2 - 1))
    left = whole - driven * (1 + EXPONENT * beside / mean + lean)
    drag = (driven * gain.value * (1 + lean) - moved) / left
    parts = {
        "gain": driven / left * gain.u,
        "drift": float(np.linalg.norm(ends * u)) / left,
        "exponent": driven / left * EXPONENT_U * abs(drag * beside) / mean,
        "lean": driven / left * abs((gain.value + drag) * lean) / sqrt(3),  # even between the two
    }
    return Hold(*held, mean_share, gain, Estimate(drag, hypot(*parts.values()), "Hz/s"), parts)


def _gain(gains: Sequence[tuple[Array, Array]], held: float) -> tuple[Estimate | None, float]:
    """Return the common slope of the counts at the full amplitude, and their mean distance above the held spin [Hz].

    u is widened by Student's factor, as the counts are few.
    """
    if not gains:
        return None, 0.0
    late = [t - t.mean() for t, _ in gains]
    spreads = np.array([float(x @ x) for x in late])
    slopes = np.array([float(x @ y) for x, (_, y) in zip(late, gains, strict=True)]) / spreads
    left = [y - y.mean() - slope * x for x, slope, (_, y) in zip(late, slopes.tolist(), gains, strict=True)]
    freedom = sum(len(x) - 2 for x in late)
    sigma = sqrt(sum(float(x @ x) for x in left) / freedom)
    weight = spreads / spreads.sum()
    beside = float(weight @ [y.mean() - held for _, y in gains])
    u = student(freedom) * sigma / sqrt(float(spreads.sum()))
    return Estimate(float(weight @ slopes), u, "Hz/s"), beside


@dataclass(frozen=True, eq=False)
class HeldLaw:
    """A drag law through the drag at several held spins.

    Attributes:
        name: of the law.
        constants: of the law.
        covariance: of the constants, shape (p, p); None where they cannot be separated.
        statistics: how well it fits.
        solution: the constants, dimensionless (`analysis.spindown.drag`), behind a start of 1.
        reference_hz: the unit of spin.
    """

    name: str
    constants: dict[str, Estimate]
    covariance: Array | None
    statistics: Statistics
    solution: Array
    reference_hz: float

    def drag(self, spin: Array) -> Array:
        """Return the drag at spins [Hz], shape (n,) [Hz/s]."""
        return self.reference_hz * LAWS[self.name].slowing(spin / self.reference_hz, self.solution)


class HeldLaws(NamedTuple):
    """The drag laws through the drag at several held spins.

    Attributes:
        laws: the best first; those with a single constant where they are not compared, each as with the others.
        between: part of the drag by which tops differ.
        compared: whether the exponent of the drag is known well enough to name a best law.
    """

    laws: tuple[HeldLaw, ...]
    between: float
    compared: bool


def fit_held(spin: Array, drag: Array, u: Array, common: Array | None = None) -> HeldLaws:
    """Fit each law to the drag at held spins.

    Tops differ by a part τ of the drag, with which χ² about a power law, whose exponent has a prior, is what is
    expected.  u of the drag has this part, widened by Student's factor, as few tops tell it.

    Args:
        spin: shape (n,) [Hz].
        drag: shape (n,) [Hz/s].
        u: of the drag, shape (n,) [Hz/s].
        common: u of an error that is common to all spins, shape (n,) [Hz/s]; None: there is none.

    >>> spins = np.array([25.0, 35.0, 45.0])
    >>> found = fit_held(spins, 2e-4 * (2 * np.pi * spins) ** 1.5 / (2 * np.pi), 0.001 * np.ones(3))
    >>> found.laws[0].name, round(found.laws[0].constants["c32"].value, 7)
    ('disc', 0.0002)
    """
    from scipy.special import chdtri, ndtr

    n, x = len(spin), np.log(spin)
    usual = np.exp(EXPONENT * (x - x.mean()))
    usual *= abs(float(drag.mean() / usual.mean()))
    shared = np.zeros(n) if common is None else common

    def whiten(part: float) -> Array:
        return np.linalg.inv(np.linalg.cholesky(np.diag(u**2 + (part * usual) ** 2) + np.outer(shared, shared)))

    part, freedom = _between(x - x.mean(), drag, usual, whiten)
    stated, widened = whiten(0.0), whiten(student(freedom) * part)
    weights = (usual / np.hypot(u, part * usual)) ** 2
    known = float(weights @ (x - np.average(x, weights=weights)) ** 2)  # 1/u² of a free exponent
    # the scatter may be as large as the upper end of its 68 % interval
    compared = n > 1 and known * float(chdtri(n - 1, ndtr(1.0))) / (n - 1) > _EXPONENT_U**-2
    by_name = {
        law.name: _fit(law, spin, drag, widened, stated)
        for law in LAWS.values()
        if compared or len(law.constants) == 1  # others have no finite constants where spins are alike
    }
    weighed, _ = weigh({name: one.statistics for name, one in by_name.items()})
    return HeldLaws(tuple(replace(by_name[name], statistics=of) for name, of in weighed.items()), part, compared)


def _between(x: Array, drag: Array, usual: Array, whiten: Callable[[float], Array]) -> tuple[float, float]:
    """Return the part by which tops differ, and its degrees of freedom: those that the exponent's prior leaves.

    They are n − 1 at one spin, and near n − 2 where the drags themselves show the exponent.

    Args:
        x: logarithm of the spins, about its mean, shape (n,).
        drag: shape (n,) [Hz/s].
        usual: the drag by the exponent that is expected, shape (n,) [Hz/s].
        whiten: part → the matrix that makes errors of the drag independent, shape (n, n).
    """
    from scipy.optimize import brentq

    slopes = np.column_stack([usual, EXPONENT_U * x * usual])

    def fit(part: float) -> tuple[float, float]:
        """Return χ², and its expectation."""
        white = whiten(part)
        design = white @ slopes
        left = np.eye(len(x)) - design @ np.linalg.solve(design.T @ design + np.diag([0.0, 1.0]), design.T)
        return float(np.sum((left @ white @ drag) ** 2)), float(np.sum(left**2))

    def excess(part: float) -> float:
        return float(np.subtract(*fit(part)))

    if len(x) < 2 or excess(0.0) <= 0:
        return 0.0, fit(0.0)[1]
    part = float(brentq(excess, 0.0, 10 * np.linalg.norm(drag / usual), xtol=1e-6))  # there u is ten times the drag
    return part, fit(part)[1]


def _fit(law: DragLaw, spin: Array, drag: Array, white: Array, stated: Array) -> HeldLaw:
    """Fit a law.

    Args:
        law: of the drag.
        spin: shape (n,) [Hz].
        drag: shape (n,) [Hz/s].
        white: makes errors of the drag independent, with a standard deviation of 1, shape (n, n).
        stated: the same for the errors without the difference of the tops, of which χ² is.
    """
    reference = float(np.exp(np.mean(np.log(spin))))
    x, scale = spin / reference, float(np.mean(drag)) / reference
    p = len(law.constants)

    def model(k: Array) -> Array:
        return reference * law.slowing(x, np.concatenate([[1.0], k]))

    def slopes(k: Array) -> Array:
        steps = np.diag(1e-6 * np.maximum(np.abs(k), scale))
        return np.array([(model(k + step) - model(k - step)) / (2 * step.sum()) for step in steps]) @ white.T

    start = np.array([scale, 0.5] if not law.orders else [scale / p] * p)
    k, _ = solve(lambda k: white @ (model(k) - drag), slopes, start)
    solution = np.concatenate([[1.0], k])
    values, natural = law.natural(solution, reference, 1.0)
    inverse = curvature(slopes(k)).covariance
    covariance, of_u = (None, np.full(p, np.nan)) if inverse is None else propagate(inverse, natural[1:, 1:])
    residuals = drag - model(k)
    misfit, chi_square = (float(np.sum((one @ residuals) ** 2)) for one in (white, stated))
    found = statistics(
        n=len(x), n_parameters=p, rss=float(residuals @ residuals), chi_square=chi_square, misfit=misfit,
        durbin_watson=None, runs_test_p=None, runs=0,
    )  # fmt: skip
    constants = {
        name: Estimate(float(value), float(one) if np.isfinite(one) else None, unit)
        for name, value, one, unit in zip(law.constants, values[1:], of_u, law.units, strict=True)
    }
    return HeldLaw(law.name, constants, covariance, found, solution, reference)
