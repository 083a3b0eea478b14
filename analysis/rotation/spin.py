"""Estimate the spin from a record of 1 to 3 components of the magnetic field."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from analysis.arrays import Array
from analysis.rotation.errors import NoLine
from analysis.rotation.folds import Evidence, Weighed, evidence_of, images_between, weigh
from analysis.rotation.line import LineFit, fit_line
from analysis.rotation.record import MAINS_HZ, Line, Record, read_samples
from analysis.rotation.result import FieldSpin, Fold, Kind
from analysis.rotation.search import HIGHEST, LOWEST, other_lines, search

#: A line that is named may lie this part of the given frequency beside it.
NEAR = 0.1
#: Gain of the logarithm of the likelihood by a line that noise has with probability 1e-3 anywhere in the search, about:
#: the χ²/2 of six numbers among 10⁵ independent places.
LEAST_GAIN = 26.0
#: A line below this gain [natural logarithm] is called weak: near there the search takes noise for it now and then.
WEAK_GAIN = 40.0


def spin_of_field(
    times: ArrayLike, field: ArrayLike, *, near: float | None = None, mains_hz: tuple[float, ...] = MAINS_HZ
) -> FieldSpin:
    """Estimate spin and slope of a top from samples of the field beside it.

    The line has its own amplitude and phase in each axis; offset, drift, slow swings, mains and two more lines are
    nuisances.  It is searched from 15 to 85 Hz, above half the sampling rate, too: times that jitter tell a line from
    its folds, and so does a slope, since a free spin falls.

    Args:
        times: shape (n,), not decreasing [s]; up to about 12 s, in which the slope changes little.
        field: shape (n, k) or (n,), k = 1 to 3 axes [T]; samples with a NaN are left out.
        near: about where the spin is, to 10 % [Hz].
        mains_hz: frequencies of the mains; a spin there, or where they are folded to, is not seen [Hz].

    Raises:
        TooFewReadings, ShapesDiffer, NotFinite, TimesNotIncreasing: see `analysis.errors`.
        NoLine: nothing stands out of the noise.
    """
    record = Record(*read_samples(times, field), mains_hz=mains_hz)
    low, high = limits_near(near)
    fit = strongest(record, low, high)
    images = images_between((fit.frequency, fit.frequency), record.rate, low, high)
    apart = 1 / record.half  # nearer to half the rate a line and its image are one
    images = [one for one in images if one.m == 0 or abs(one.of(fit.frequency, record.rate) - fit.frequency) > apart]
    seen = evidence_of(record, fit, images, record.rate)
    u = float(fit.covariance[1, 1]) ** 0.5
    return result_of(record, seen, weigh([seen], [one.sign for one in images], fit.chirp, u))


@dataclass(frozen=True, eq=False)
class LineSamples:
    """The samples of one window as a picture shows them.

    Attributes:
        time: shape (n,) [s].
        field: without drift, mains and other lines, shape (n, k) [T].
        line: of the spin, shape (n, k) [T].
        turns: of the line since the reference time, shape (n,).
    """

    time: Array
    field: Array
    line: Array
    turns: Array


def samples_of_line(times: ArrayLike, field: ArrayLike, found: FieldSpin) -> LineSamples:
    """Return the samples of the window in which a spin was found."""
    t, b = read_samples(times, field)
    near = np.abs(t - found.reference_time) <= 0.6 * found.duration  # the mean is not quite in the middle
    record = Record(t[near], b[near])
    line = Line(found.frequency, found.chirp).at(record.middle - found.reference_time)
    fit = fit_line(record, line.frequency, line.chirp)
    record.add_lines(other_lines(record, record.rest(fit.columns @ fit.amplitudes), line))
    fit = fit_line(record, line.frequency, line.chirp)
    wave = fit.columns @ fit.amplitudes
    late = record.late
    return LineSamples(
        time=t[near],
        field=record.unit * (record.rest(wave) + wave),
        line=record.unit * wave,
        turns=fit.frequency * late + fit.chirp * late**2 / 2,
    )


def strongest(record: Record, low: float, high: float) -> LineFit:
    """Return the strongest line between two frequencies [Hz].  Raises NoLine."""
    start = search(record, low, high)
    first = fit_line(record, start.frequency, start.chirp)
    rest = record.rest(first.columns @ first.amplitudes)
    record.add_lines(other_lines(record, rest, Line(first.frequency, first.chirp)))
    fit = fit_line(record, first.frequency, first.chirp)
    if not (fit.gain > LEAST_GAIN and math.isfinite(fit.gain)):
        raise NoLine(lowest=low, highest=high, duration=2 * record.half, gain=fit.gain)
    return fit


def limits_near(near: float | None) -> tuple[float, float]:
    """Return least and greatest frequency of the search [Hz]."""
    return (LOWEST, HIGHEST) if near is None else ((1 - NEAR) * near, (1 + NEAR) * near)


def result_of(record: Record, seen: Evidence, weighed: Weighed) -> FieldSpin:
    """Return the result of the most probable of the folds."""
    fit = seen.fits[weighed.order[0]]
    folds = tuple(
        Fold(one.frequency, one.chirp, float(one.likelihood - seen.log.max()), float(weighed.shares[k]))
        for k in weighed.order
        for one in [seen.fits[k]]
    )
    cosine, sine = fit.amplitudes
    amplitude = np.hypot(cosine, sine)
    noise = np.sqrt(fit.variance)
    u_frequency, u_chirp = np.sqrt(np.diagonal(fit.covariance))
    # Fisher's information of the phase, without what is beside the line
    snr = 0.5 * float(np.sum(amplitude**2 / fit.variance))
    bound = 1 / (2 * math.pi * math.sqrt(snr * float(record.late @ record.late)))
    return FieldSpin(
        frequency=fit.frequency,
        u_frequency=float(u_frequency),
        chirp=fit.chirp,
        u_chirp=float(u_chirp),
        u_of_noise=fit.u_of_noise,
        reference_time=record.middle,
        amplitude=tuple((record.unit * amplitude).tolist()),
        u_amplitude=tuple((record.unit * fit.amplitude_u).tolist()),
        noise=tuple((record.unit * noise).tolist()),
        sense=_sense_of_rotation(fit),
        bound=bound,
        snr_db=20 * math.log10(max(float(np.max(amplitude / noise)), 1e-9)),
        rate=record.rate,
        duration=2 * record.half,
        samples=record.late.size,
        folds=folds,
        kinds=tuple(_kinds(record, fit, weighed)),
    )


def _sense_of_rotation(fit: LineFit) -> int:
    """Return the sense in the plane of the first two axes, where it is 3 u away from a line to and fro."""
    if fit.amplitudes.shape[1] < 2:
        return 0
    (a, c), (b, d) = fit.amplitudes[:, :2]  # x = a cos + b sin, y = c cos + d sin
    area = a * d - b * c
    u = math.hypot(math.hypot(c, d) * fit.amplitude_u[0], math.hypot(a, b) * fit.amplitude_u[1])
    return 0 if abs(area) < 3 * u else int(math.copysign(1, area))


def _kinds(record: Record, fit: LineFit, weighed: Weighed) -> Iterator[Kind]:
    if not weighed.certain:
        yield "fold-doubt"
    elif len(weighed.order) > 1:
        if fit.frequency > record.rate / 2:
            yield "folded"
        if not weighed.by_times:
            yield "fold-by-slope"
    if weighed.regular:
        yield "regular"
    if fit.gain < WEAK_GAIN:
        yield "weak"
    if any(abs(fit.frequency - mains) < 0.5 / record.half for mains in MAINS_HZ):
        yield "on-mains"
