"""Frequencies that have the same samples: a line above half the sampling rate appears below it, and back.

Times that jitter tell them from each other, since only the right one keeps its phase.  The slope tells them, too: where
a spin falls, a fold of it rises.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.rotation.line import LineFit, fit_line
from analysis.rotation.result import Fold

if TYPE_CHECKING:
    from analysis.rotation.record import Array, Record

#: A free spin falls.  One record in a hundred rises, since a drive speeds the top up.
RISING = 0.01
#: One of the folds is certain from this probability on.
CERTAIN = 0.95
#: Even times describe the samples better than the times given: by this ratio of likelihoods, as natural logarithm.
EVEN = 5.0
#: Times jitter by less than this part of the interval, or they are uneven otherwise.
_MOST_JITTER = 0.3


@dataclass(frozen=True, eq=False)
class Weighed:
    """The folds of a line, the most probable first.

    Attributes:
        fits: of each.
        folds: the same with their probabilities.
        by_times: whether the times alone tell them from each other.
        regular: whether the samples lie more evenly than their times say.
    """

    fits: tuple[LineFit, ...]
    folds: tuple[Fold, ...]
    by_times: bool
    regular: bool


def images(record: Record, fit: LineFit, low: float, high: float) -> list[tuple[float, float]]:
    """Return other frequencies [Hz] and slopes [Hz/s] with the same samples, if their times were even."""
    most = math.ceil(high / record.rate) + 1
    places = [
        (m * record.rate + sign * fit.frequency, sign * fit.chirp) for m in range(-most, most + 1) for sign in (1, -1)
    ]
    return [one for one in places if low <= one[0] <= high and abs(one[0] - fit.frequency) > 1 / record.half]


def weigh_folds(record: Record, fit: LineFit, low: float, high: float) -> Weighed:
    """Return the folds of a line between two frequencies [Hz] with their probabilities.

    A phone may write times that jitter more than its samples do.  So each fold has the likelihood of its samples at the
    times given, or at even times, where all folds are alike; and each has that of its slope's sense.
    """
    fits = [fit, *(fit_line(record, *place) for place in images(record, fit, low, high))]
    log = np.array([one.likelihood for one in fits])
    even = _even_times(record)
    at_even = -np.inf
    if even is not None:
        at_even = fit_line(record.at(even + record.middle), fit.frequency, fit.chirp).likelihood
    by_times = np.logaddexp(log, at_even)
    posterior = by_times + np.log([_sense(one) for one in fits])
    shares = np.exp(posterior - np.logaddexp.reduce(posterior))
    order = np.argsort(-posterior, kind="stable")
    first = order[0]
    return Weighed(
        fits=tuple(fits[k] for k in order),
        folds=tuple(Fold(fits[k].frequency, fits[k].chirp, float(log[k] - log.max()), float(shares[k])) for k in order),
        by_times=bool(np.exp(by_times[first] - np.logaddexp.reduce(by_times)) > CERTAIN),
        regular=bool(at_even > log[first] + EVEN),
    )


def _even_times(record: Record) -> Array | None:
    """Return the same times without their jitter; None: they have no one distance."""
    step = np.diff(record.late)
    usual = float(np.median(step))
    if usual <= 0:
        return None
    number = np.concatenate([[0.0], np.cumsum(np.rint(step / usual))])
    slope, offset = np.polyfit(number, record.late, 1)
    even: Array = slope * number + offset
    return even if float(np.std(even - record.late)) < _MOST_JITTER * usual else None


def _sense(fit: LineFit) -> float:
    """Return the prior probability of a slope's sense: that of a spin that falls is 1."""
    from scipy.special import ndtr

    falls = float(ndtr(-fit.chirp / float(fit.covariance[1, 1]) ** 0.5))
    return falls + RISING * (1 - falls)
