"""Frequencies that have the same samples: a line above half the sampling rate appears below it, and back.

Times that jitter tell them from each other, since only the right one keeps its phase.  The slope tells them, too: where
a spin falls, a fold of it rises.
"""

import math
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.rotation.line import LineFit, fit_line
from analysis.rotation.record import Record

#: A free spin falls.  In one record of a hundred a drive changes the spin, upwards or downwards, each as probable.
RISING = 0.01
#: One of the folds is certain from this probability on.
CERTAIN = 0.95
#: Tops spin between these [Hz]; where nothing decides, one of ten is faster.
USUAL_HZ, UNUSUAL = (20.0, 60.0), 0.1
#: Even times describe the samples better than the times given: by this ratio of likelihoods, as natural logarithm.
EVEN = 5.0
#: Times jitter by less than this part of the interval, or they are uneven otherwise.
_MOST_JITTER = 0.3


@dataclass(frozen=True)
class Image:
    """A frequency m·rate + sign·f, whose samples at even times are those of f; its slope has the same sign."""

    m: int
    sign: int

    def of(self, frequency: float, rate: float) -> float:
        """Return the image of a frequency [Hz]."""
        return self.m * rate + self.sign * frequency


@dataclass(frozen=True, eq=False)
class Evidence:
    """What one window says of a line and its images.

    Attributes:
        fits: the line itself, then its images.
        log: natural logarithms of the likelihoods at the times given, shape (h,).
        ramped: likewise of an even slope, as that of a drive.
        even: that at even times, where all are alike; −∞: the times have no one distance.
    """

    fits: tuple[LineFit, ...]
    log: Array
    ramped: Array
    even: float


@dataclass(frozen=True, eq=False)
class Weighed:
    """The folds of a line.

    Attributes:
        shares: probability of each, shape (h,).
        order: their numbers, the most probable first; where none is certain, a spin as tops have it goes before.
        by_times: whether the times alone tell them from each other.
        regular: whether the samples lie more evenly than their times say.
    """

    shares: Array
    order: tuple[int, ...]
    by_times: bool
    regular: bool

    @property
    def certain(self) -> bool:
        """Whether one is far more probable than the others."""
        return float(self.shares.max()) > CERTAIN


def images_between(frequencies: tuple[float, float], rate: float, low: float, high: float) -> list[Image]:
    """Return the line itself and its images that lie between two frequencies [Hz].

    Args:
        frequencies: least and greatest of the line [Hz].
        rate: samples per second.
        low: the least of an image [Hz].
        high: the greatest [Hz].
    """
    most = math.ceil(high / rate) + 1
    found = [Image(m, sign) for m in range(-most, most + 1) for sign in (1, -1)]
    own = Image(0, 1)
    return [own, *(one for one in found if one != own and all(low <= one.of(f, rate) <= high for f in frequencies))]


def evidence_of(record: Record, fit: LineFit, images: list[Image], rate: float) -> Evidence:
    """Return the likelihoods of a line and of its images.

    A phone may write times that jitter more than its samples do: so there is a likelihood at even times, too.
    """
    fits = [fit, *(fit_line(record, one.of(fit.frequency, rate), one.sign * fit.chirp) for one in images[1:])]
    log = np.array([one.likelihood for one in fits])
    several = len(fits) > 1
    driven = [fit_line(record, f.frequency, f.chirp, drags=False) if several and f.chirp < 0 else f for f in fits]
    ramped = np.array([one.likelihood for one in driven])
    times = _even_times(record) if several else None
    even = -math.inf
    if times is not None:
        even = fit_line(record.at(times + record.middle), fit.frequency, fit.chirp).likelihood
    return Evidence(tuple(fits), log, ramped, even)


def weigh(seen: list[Evidence], signs: list[int], slope: float, u: float) -> Weighed:
    """Return the probabilities of a line and its images.

    Args:
        seen: by windows.
        signs: of the images.
        slope: of the line itself [Hz/s].
        u: its standard uncertainty [Hz/s].
    """
    from scipy.special import log_ndtr

    log, ramped = (np.sum([getattr(one, name) for one in seen], axis=0) for name in ("log", "ramped"))
    even = sum(one.even for one in seen)
    by_times = np.logaddexp(log, even)
    falls = log_ndtr([-sign * slope / u for sign in signs])
    posterior = np.logaddexp(by_times + falls, np.logaddexp(ramped, even) + math.log(RISING))
    order = np.argsort(-posterior, kind="stable")
    first = int(order[0])
    shares = np.exp(posterior - np.logaddexp.reduce(posterior))
    if shares[first] <= CERTAIN:
        usual = [USUAL_HZ[0] <= one.frequency <= USUAL_HZ[1] for one in seen[0].fits]
        order = np.argsort(-shares * np.where(usual, 1.0, UNUSUAL), kind="stable")
    return Weighed(
        shares=shares,
        order=tuple(map(int, order)),
        by_times=bool(np.exp(by_times[first] - np.logaddexp.reduce(by_times)) > CERTAIN),
        regular=bool(even > log[first] + EVEN),
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
