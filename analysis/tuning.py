"""The mass of a top that floats today, from trials with washers, a scan of the base, and the room's temperature.

Tops float from a lightest to a heaviest mass: a lighter one rises and flies off, a heavier one sinks.  Both masses are
proportional to the strength of base and top, and so fall with the temperature (Simon, Heflinger & Ridgway, Am. J. Phys.
65, 286 (1997), §IV).  Unknown are the middle of this window, its width and the coefficient of temperature; each trial
is an ordered probit with lapses (Wichmann & Hill, Percept. Psychophys. 63, 1293 (2001)), and the posterior is evaluated
on a grid that is narrowed to where it is not negligible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from analysis.arrays import Array
from analysis.uncertainty import Estimate

#: Relative change per kelvin of base or top, and its standard uncertainty: hard ferrite has −0.2 %/K (IEC 60404-8-1),
#: neodymium −0.11; tops measured over 21 K gave −0.26 for both together.
MAGNET_PER_K, MAGNET_PER_K_U = -0.002, 0.0007
#: The window of small motions is 3 % of the mass wide (thesis's ring); by hand between a fifth of it, as a hobbyist
#: found (0.12 g of 22 g), and all of it floats: median and standard deviation of the logarithm of that share.
THEORY_WIDTH = 0.03
SHARE, SHARE_LOG_U = 0.42, 0.9
#: A window by hand lies somewhere within that of theory: standard deviation of its middle, in widths of the latter.
OFF_MIDDLE = 0.17
#: Standard uncertainties of a trial: the balance [kg], and the magnets' temperature by a thermometer beside them [K].
MASS_U, TEMPERATURE_U = 5e-6, 0.3
#: Share of the tops that would float and rise, or sink, by the hand that lets them go; and of wrong answers.
LAPSE = 0.02

#: Points of the grid in middle, width and coefficient: after narrowing 10, 1.5 and 1.5 to a standard deviation, which
#: is enough for a smooth density (a sum of a Gaussian errs by e^−40), and for one with the soft edges of the middle's.
_POINTS = (121, 15, 15)
#: Times that the grid is narrowed, to where a marginal is above e^−12 of its maximum.
_ROUNDS, _NEGLIGIBLE = 3, 12.0
#: Ends of the first grid in standard deviations, and the points of the last that are left out, by their weight.
_REACH, _WEIGHTLESS = 4.0, 1e-4
#: Masses that are compared for the next trial: those with the best chances.
_COMPARED = 40


class Outcome(Enum):
    """The outcome of a trial.  A top slides off sideways since the base is not level, whatever its mass."""

    RISES = "rises"
    FLOATS = "floats"
    SINKS = "sinks"
    SIDEWAYS = "sideways"


@dataclass(frozen=True)
class Trial:
    """A top that was let go.

    Attributes:
        mass: with its washers [kg].
        temperature: of the magnets [°C].
        outcome: of it.
    """

    mass: float
    temperature: float
    outcome: Outcome


@dataclass(frozen=True)
class Prior:
    """The window without trials.

    Attributes:
        low, high: the middle lies somewhere between these masses [kg], evenly without `middle`.
        middle: from a scan of the base, with its u [kg].
        temperature: to which these belong [°C].
        width: median of the window's width, relative to its middle.
        width_log_u: standard deviation of the logarithm of the width.
        widest: that of small motions, relative: no hand floats more.
        per_k, per_k_u: relative change of the masses per kelvin, and its standard uncertainty.
    """

    low: float
    high: float
    middle: Estimate | None = None
    temperature: float = 20.0
    width: float = SHARE * THEORY_WIDTH
    width_log_u: float = SHARE_LOG_U
    widest: float = THEORY_WIDTH
    per_k: float = 2 * MAGNET_PER_K
    per_k_u: float = math.sqrt(2) * MAGNET_PER_K_U

    @classmethod
    def of_scan(cls, middle: Estimate, lightest: float, heaviest: float, temperature: float) -> Prior:
        """Return the prior by a scan: mass to set with its u, window of small motions [kg], and temperature [°C]."""
        value, theory = middle.value or 0.0, heaviest - lightest
        u = math.hypot(middle.u or 0.0, OFF_MIDDLE * theory)
        reach = _REACH * u
        widest = theory / value
        return cls(value - reach, value + reach, Estimate(value, u, "kg"), temperature, SHARE * widest, widest=widest)


@dataclass(frozen=True, eq=False)
class Posterior:
    """The window after trials: points with their weights, each of shape (n,).

    Attributes:
        weight: of a point; all sum to 1.
        middle: of the window, at `temperature` [kg].
        width: relative to the middle.
        per_k: relative change of the masses per kelvin.
        temperature: [°C].
    """

    weight: Array
    middle: Array
    width: Array
    per_k: Array
    temperature: float

    def middle_at(self, temperature: float) -> Array:
        """Return the middle of each point at a temperature [°C], shape (n,) [kg]."""
        return np.asarray(self.middle * np.exp(self.per_k * (temperature - self.temperature)))

    def estimate(self, values: Array, unit: str) -> Estimate:
        """Return mean and standard deviation of a quantity, given at each point, shape (n,)."""
        mean = float(self.weight @ values)
        return Estimate(mean, math.sqrt(float(self.weight @ (values - mean) ** 2)), unit)

    def values(self, temperature: float) -> dict[str, Estimate]:
        """Return the results at a temperature [°C]: masses [kg], relative change [1/K], and mass per kelvin [kg/K]."""
        middle = self.middle_at(temperature)
        half = middle * self.width / 2
        return {
            "mass_to_set": self.estimate(middle, "kg"),
            "lightest_mass": self.estimate(middle - half, "kg"),
            "heaviest_mass": self.estimate(middle + half, "kg"),
            "window_width": self.estimate(2 * half, "kg"),
            "relative_change": self.estimate(self.per_k, "1/K"),
            "mass_per_kelvin": self.estimate(self.per_k * middle, "kg/K"),
        }

    def outcomes(self, masses: Array, temperature: float) -> Array:
        """Return the probabilities that a top rises, floats, sinks at each point, shape (3, masses, n)."""
        middle = self.middle_at(temperature)
        return np.stack(_probabilities(masses[:, None], middle, self.width, self.per_k))

    def chances(self, masses: Array, temperature: float) -> Array:
        """Return the probability to float for each mass [kg] at a temperature [°C], shape (masses,)."""
        return np.array([self.outcomes(masses[k : k + 1], temperature)[1, 0] @ self.weight for k in range(masses.size)])

    def chance_by_others(self, trial: Trial) -> float:
        """Return the probability of a trial's outcome by prior and all other trials.

        A harmonic mean takes the trial itself out of the posterior (Gelfand, Dey & Chang, Bayesian Statistics 4, 1992).
        """
        outcomes = self.outcomes(np.array([trial.mass]), trial.temperature)[:, 0]
        return 1 / float(self.weight @ (1 / np.maximum(outcomes[list(Outcome).index(trial.outcome)], 1e-300)))

    def promise(self, masses: Array, temperature: float) -> Array:
        """Return the chances to float at a trial, plus those to float at it or at the best one after it.

        The best one after it is chosen with its outcome known.  The mass to try next has the most of both.

        Args:
            masses: that can be set, shape (n,) [kg].
            temperature: [°C].

        Returns:
            From 0 to 2, shape (n,); 0 for masses beyond the _COMPARED ones with the best chances.
        """
        first = self.chances(masses, temperature)
        best = np.argsort(-first, kind="stable")[:_COMPARED]
        rises, floats, sinks = self.outcomes(masses[best], temperature)
        second = sum((weighted @ floats.T).max(axis=1) for weighted in (rises * self.weight, sinks * self.weight))
        both = np.zeros(masses.size)
        both[best] = 2 * first[best] + second
        return both


def learn(trials: Sequence[Trial], prior: Prior) -> Posterior:
    """Return the posterior of the window.

    Args:
        trials: in any order.
        prior: without them.
    """
    informative = [one for one in trials if one.outcome is not Outcome.SIDEWAYS]
    reference = float(np.mean([one.temperature for one in informative])) if informative else prior.temperature
    reach = _REACH * prior.per_k_u * abs(reference - prior.temperature) * prior.high
    log_width, log_u = math.log(prior.width), _REACH * prior.width_log_u
    shift = math.exp(prior.per_k * (reference - prior.temperature))
    ends = [
        (prior.low * shift - reach, prior.high * shift + reach),
        (log_width - log_u, min(log_width + log_u, math.log(prior.widest))),
        (prior.per_k - _REACH * prior.per_k_u, prior.per_k + _REACH * prior.per_k_u),
    ]
    for left in reversed(range(_ROUNDS)):
        axes = [np.linspace(low, high, n) for (low, high), n in zip(ends, _POINTS, strict=True)]
        middle, log_of_width, per_k = np.meshgrid(*axes, indexing="ij", copy=False)
        width = np.exp(log_of_width)
        log = _log_prior(prior, middle * np.exp(per_k * (prior.temperature - reference)), log_of_width, per_k)
        for one in informative:
            at = middle * np.exp(per_k * (one.temperature - reference))
            seen = _probabilities(one.mass, at, width, per_k)[list(Outcome).index(one.outcome)]
            log += np.log(np.maximum(seen, 1e-300))
        log -= log.max()
        if left:
            ends = [_narrow(axis, log, k) for k, axis in enumerate(axes)]
    weight = np.exp(log)
    kept = weight > _WEIGHTLESS
    return Posterior(weight[kept] / weight[kept].sum(), middle[kept], width[kept], per_k[kept], reference)


def _log_prior(prior: Prior, middle: Array, log_width: Array, per_k: Array) -> Array:
    log = -0.5 * ((log_width - math.log(prior.width)) / prior.width_log_u) ** 2
    log = log - 0.5 * ((per_k - prior.per_k) / prior.per_k_u) ** 2
    if prior.middle is None:
        return np.asarray(np.where((prior.low <= middle) & (middle <= prior.high), log, log - 1e3))
    return np.asarray(log - 0.5 * ((middle - (prior.middle.value or 0.0)) / (prior.middle.u or 1.0)) ** 2)


def _probabilities(mass: float | Array, middle: Array, width: Array, per_k: Array) -> tuple[Array, Array, Array]:
    """Return the probabilities that a top of this mass rises, floats and sinks, each of the shape of all together."""
    from scipy.special import ndtr

    s = np.hypot(MASS_U, per_k * middle * TEMPERATURE_U)
    half = middle * width / 2
    light, heavy = ndtr((middle - half - mass) / s), ndtr((mass - middle - half) / s)
    floats = np.maximum(1 - light - heavy, 0.0)
    off = LAPSE * floats
    return light * (1 - LAPSE) + LAPSE * heavy + off, floats - 2 * off, heavy * (1 - LAPSE) + LAPSE * light + off


def _narrow(axis: Array, log: Array, k: int) -> tuple[float, float]:
    """Return the ends of an axis where the posterior is not negligible, with a step on either side."""
    highest = log.max(axis=tuple(other for other in range(log.ndim) if other != k))
    (inside,) = np.nonzero(highest > -_NEGLIGIBLE)
    return float(axis[max(inside[0] - 1, 0)]), float(axis[min(inside[-1] + 1, axis.size - 1)])


def combinations(washers: Sequence[float]) -> list[tuple[float, ...]]:
    """Return choices from the washers [kg], the lightest first, `()` among them.

    Of those that a balance cannot distinguish, or that are within a thousandth of all washers, one with few washers.

    >>> combinations([1e-4, 1e-4, 2e-4])
    [(), (0.0001,), (0.0002,), (0.0001, 0.0002), (0.0001, 0.0001, 0.0002)]
    """
    step = max(MASS_U, sum(washers) / 1000)
    found: dict[int, tuple[float, ...]] = {0: ()}
    for one in sorted(washers):
        for chosen in [*found.values()]:
            more = (*chosen, one)
            key = round(sum(more) / step)
            if key not in found or len(more) < len(found[key]):
                found[key] = more
    return sorted(found.values(), key=sum)
