"""A spin that is held by the amplitude of a drive: the drag that the amplitude balances, and laws through several.

The pull p goes with the share s of the full amplitude, and dν/dt = s p − d: the full amplitude gains g = p − d, which
is measured before and after the hold.  Over a hold of length T the spin changes by Δν = (g + d)∫s dt − d T, so

    d = (g ∫s dt − Δν)/(T − ∫s dt).

The gain is seen over some spins about the held one.  From the mean of these it is brought to the held spin by the drag,
and by the pull: that of a top whose moment is tilted, which leans, goes with 1/(1 − (ν_r/ν)²), of an upright one it is
the same everywhere.

Source: PHYSICS.md §7.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, sqrt

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


def fit_held(spin: Array, drag: Array, u: Array, common: Array | None = None) -> tuple[tuple[HeldLaw, ...], float]:
    """Return each law fitted to the drag, the best law first, and the part of the drag by which tops differ.

    u of the drag is widened by that part, which makes χ² about the law that fits best what is expected.  Where the
    spins are too near each other to compare laws, there are only those with a single constant.

    Args:
        spin: shape (n,) [Hz].
        drag: shape (n,) [Hz/s].
        u: of the drag, shape (n,) [Hz/s].
        common: u of an error that is common to all spins, shape (n,) [Hz/s]; None: there is none.

    >>> spins = np.array([25.0, 35.0, 45.0])
    >>> found, _ = fit_held(spins, 2e-4 * (2 * np.pi * spins) ** 1.5 / (2 * np.pi), 0.001 * np.ones(3))
    >>> found[0].name, round(found[0].constants["c32"].value, 7)
    ('disc', 0.0002)
    """
    n, x = len(spin), np.log(spin)
    usual = np.exp(EXPONENT * (x - x.mean()))
    usual *= abs(float(drag.mean() / usual.mean()))
    shared = np.zeros(n) if common is None else common

    def whiten(part: float) -> Array:
        return np.linalg.inv(np.linalg.cholesky(np.diag(u**2 + (part * usual) ** 2) + np.outer(shared, shared)))

    def fits(part: float, most: int) -> list[HeldLaw]:
        laws = (law for law in LAWS.values() if len(law.constants) <= most)
        return [_fit(law, spin, drag, whiten(part), whiten(0.0)) for law in laws]

    def between(most: int) -> float:
        def excess(part: float) -> float:
            return min(one.statistics.misfit - one.statistics.degrees_of_freedom for one in fits(part, most))

        if most < 1 or excess(0.0) <= 0:
            return 0.0
        from scipy.optimize import brentq

        return float(brentq(excess, 0.0, np.linalg.norm(drag / usual), xtol=1e-6))  # there a law without drag fits

    most, part = 1, between(min(1, n - 1))
    weights = (usual / np.hypot(u, part * usual)) ** 2
    if weights @ (x - np.average(x, weights=weights)) ** 2 > _EXPONENT_U**-2:
        most, part = n, between(n - 1)
    by_name = {one.name: one for one in fits(part, most)}
    weighed, _ = weigh({name: one.statistics for name, one in by_name.items()})
    return tuple(replace(by_name[name], statistics=stats) for name, stats in weighed.items()), part


def _fit(law: DragLaw, spin: Array, drag: Array, white: Array, stated: Array) -> HeldLaw:
    """Fit a law; white, shape (n, n), makes errors of the drag independent, with a standard deviation of 1.

    stated does it for the errors without what tops differ by.
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
