"""Matched filter: the mean pulse, learned from the trace, placed at each turn, and the places regressed on turn number.

A phase that is nearly right is improved: at each turn a piece of the trace is fitted by pulse, slope of the pulse and
a constant. The slope's share is the turn's shift, which is regressed with the weight that it deserves; the pulse is
learned again; and so on until nothing moves. To first order that is the maximum of the likelihood.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.pulses.regression import Fit, Grid, fit_turns, median
from analysis.uncertainty import student

#: Points of the pulse's table: a place is off by at most 1/8192 of the window.
TABLE = 4096
#: Bins of a coarse profile of the whole turn.
COARSE = 128
#: A turn farther off than this number of standard deviations is no pulse of the top; with few turns the limit is the
#: quantile of Student's t of the same probability.
GROSS = 4.5
ROUNDS = 8
#: Least decrease of the sum of squares by a mean pulse that exists, in variances of the noise; the best of all
#: frequencies in noise alone reaches about 100.
EVIDENCE = 160.0
#: Least mean power of the harmonics of the pulse that are kept, over that of noise.
NOISY = 3.0
#: Flanks that climb more than this part of the height from one sample to the next lie where the samples are.
SHARP = 0.25
#: A piece has three parameters, height, shift and a constant: five samples leave two for the noise.
FEWEST_SAMPLES = 5
#: A piece with less of the pulse's power, or of its slope's, than this part of the median is none.
LEAST = 0.3
#: A turn with less of a pulse than this part of the mean one counts as missing.
FAINT = 0.3


@dataclass(frozen=True)
class Window:
    """Where in a turn the pulse is: phase of its middle and half the width [turns]."""

    middle: float
    half: float


@dataclass(frozen=True)
class Pulse:
    """The mean pulse and its slope per turn, as tables over the window; where its middle is in it, from 0 to 1."""

    shape: Array
    slope: Array
    middle: float


@dataclass(frozen=True)
class Pieces:
    """Pieces of the trace, one a turn.

    x: samples, and cell: their places in the pulse's table, of shape (turns, n); valid: which of them count, None: all;
    times [s] and numbers [turns]: where the middle of the window should be, of shape (turns,).
    """

    x: Array
    cell: NDArray[np.intp]
    valid: NDArray[np.bool_] | None
    times: Array
    numbers: Array


@dataclass(frozen=True)
class Match:
    """What a matched filter found.

    fit: phase against time; turns: number of those used.
    numbers, heights, shifts, used: of all turns, shape (m,): whole part of the phase, height in units of the mean
    pulse, what the fit leaves of the phase [turns], whether it was used.
    evidence: by how many variances of the noise the pulses lower the sum of squares.
    flat: whether most tops are at the greatest value that occurs.
    noise, height: of a sample, and of the mean pulse, in the trace's unit.
    bound: of the frequency [Hz]; missing, wrong: numbers of turns; pulse, window: the mean pulse.
    grid: from one sample to the next, by which flanks may be off that are as sharp [turns]; 0: they are not.
    """

    fit: Fit
    turns: int
    numbers: NDArray[np.int64]
    heights: Array
    shifts: Array
    used: NDArray[np.bool_]
    evidence: float
    flat: bool
    noise: float
    height: float
    bound: float
    missing: int
    wrong: int
    pulse: Pulse
    window: Window
    grid: float

    @property
    def origin(self) -> float:
        """Phase of the fit at which the middle of a pulse passes [turns]."""
        return self.window.middle + (self.pulse.middle - 0.5) * 2 * self.window.half


def window_of(bins: Array, phase: Array) -> Window | None:
    """Return where in the turn the trace stands out, None where it nowhere does; bins, phase: shape (n,)."""
    place = ((phase - np.floor(phase)) * COARSE).astype(np.intp)
    counts = np.bincount(place, minlength=COARSE)
    profile = np.bincount(place, bins, COARSE) / np.maximum(counts, 1)
    ordered = np.sort(profile)
    middle = float(ordered[COARSE // 2])
    away = np.abs(profile - middle)
    noise = 1.4826 * median(away)
    stands = away > max(0.04 * float(away.max()), min(4 * noise, 0.5 * float(away.max())))
    at = np.flatnonzero(stands)
    if not at.size:
        return None
    gaps = np.diff(np.append(at, at[0] + COARSE))
    widest = int(np.argmax(gaps))
    first = int(at[(widest + 1) % at.size])
    length = COARSE - int(gaps[widest]) + 1
    half = min((0.5 * length + max(3.0, 0.3 * length)) / COARSE, 0.5)
    if half > 0.35:
        half = 0.5
    return Window(((first + 0.5 * length) / COARSE) % 1.0, half)


def match(
    samples: Array,
    rate: float,
    fit: Fit,
    window: Window,
    *,
    bad: NDArray[np.bool_] | None = None,
    degree: int | None = None,
    clock: Array | None = None,
) -> Match | None:
    """Improve a phase.

    Args:
        samples: shape (n,).
        rate: samples per second.
        fit: a phase that is nearly right, of times from the first sample.
        window: where in the turn the pulse is.
        bad: samples that are no numbers, shape (n,).
        degree: of the phase, as of `fit_turns`.
        clock: times of the samples from the first one on, shape (n,), where they are uneven [s].

    Returns:
        None where there are fewer than four turns, or no pulses.
    """
    result = None
    for _ in range(ROUNDS):
        found = _improve(samples, rate, fit, window, degree=degree, bad=bad, clock=clock)
        if found is None:
            return result
        edge = np.array([-1.0, -0.5, 0.0, 0.5, 1.0]) * found.fit.half + found.fit.centre
        edge = edge if found.fit.jump is None else found.fit.jump.spoil(edge)
        change = found.fit.phase(edge) - fit.phase(edge)
        moved = float(np.abs(change - np.rint(change)).max())
        fit, result = found.fit, found
        # a shift is found to its square in units of the pulse's flank, about a fifth of half the window
        left = moved * (moved / (0.2 * window.half)) ** 2
        if left < max(0.03 * float(np.sqrt(fit.covariance[0, 0])), 1e-9):
            break
    return result


def _improve(
    samples: Array,
    rate: float,
    fit: Fit,
    window: Window,
    *,
    degree: int | None,
    bad: NDArray[np.bool_] | None,
    clock: Array | None,
) -> Match | None:
    duration = samples.size / rate if clock is None else float(clock[-1])
    times, numbers, frequency = turn_times(fit, window.middle, duration)
    if times.size < 4 or frequency.min() <= 0:
        return None
    even = times * rate if clock is None else np.interp(times, clock, np.arange(clock.size))
    middle = np.rint(even).astype(np.intp)
    reach = int(np.ceil(window.half * rate / frequency.min()))
    if reach < FEWEST_SAMPLES // 2:
        return None
    inside = (middle - reach >= 0) & (middle + reach < samples.size)
    times, numbers, frequency, middle = times[inside], numbers[inside], frequency[inside], middle[inside]
    if times.size < 4:
        return None
    offsets = np.arange(-reach, reach + 1)
    index = middle[:, None] + offsets
    x = samples[index]
    per_sample = frequency / rate
    late = offsets * per_sample[:, None] + ((middle - times * rate) * per_sample)[:, None]
    if clock is not None:
        late = (clock[index] - times[:, None]) * frequency[:, None]
    place = late / (2 * window.half) + 0.5
    valid = None
    if window.half < 0.5 or bad is not None or clock is not None:
        outside = (place < 0) | (place >= 1)
        if bad is not None:
            outside |= bad[index]
        valid = ~outside
        if not valid.any():
            return None
    cell = (
        np.clip((place * TABLE).astype(np.intp), 0, TABLE - 1)
        if window.half < 0.5
        else (place * TABLE).astype(np.intp) % TABLE
    )
    pulse = learn(x, cell, valid, 2 * window.half)
    return _regress(Pieces(x, cell, valid, times, numbers), pulse, window, fit, degree=degree, rate=rate)


def turn_times(fit: Fit, middle: float, duration: float) -> tuple[Array, Array, Array]:
    """Return the times at which the middle of a pulse [turns] passes, and the phases and frequencies there."""
    jump, fit = fit.jump, replace(fit, jump=None)
    end = duration + (0.0 if jump is None else jump.lost)
    first, last = fit.phase(np.array([0.0, end]))
    numbers = np.arange(np.ceil(first - middle), np.floor(last - middle) + 1) + middle
    grid = np.linspace(0.0, end, 65)
    times = np.interp(numbers, fit.phase(grid), grid)
    for _ in range(2):  # Newton's from 1e-3 turns: 1e-9, 1e-20
        times = times - (fit.phase(times) - numbers) / fit.frequency(times)
    frequency = fit.frequency(times)
    if jump is None:
        return times, numbers, frequency
    there = (times <= jump.at) | (times > jump.at + jump.lost)
    return jump.spoil(times[there]), numbers[there], frequency[there]


def learn(x: Array, cell: NDArray[np.intp], valid: NDArray[np.bool_] | None, width: float) -> Pulse:
    """Return the mean pulse; x: pieces, and cell: their places in the table, shape (turns, n); width: [turns]."""
    # bins hold four samples or more, and are no finer than the samples: missing pulses would leave a comb at those
    most = min(x.size / 4, 1.5 * x.shape[1])
    if valid is not None:
        x, cell = x[valid], cell[valid]
    x, cell = x.ravel(), cell.ravel()
    bins = int(2 ** np.clip(np.floor(np.log2(most)), 4, 10))
    place = cell // (TABLE // bins)
    counts = np.maximum(np.bincount(place, minlength=bins), 1)
    mean = np.bincount(place, x, bins) / counts
    square = np.bincount(place, x * x, bins) / counts
    noise = float(np.maximum(square - mean**2, 0).mean())
    mean = mean - mean.mean()
    spectrum = np.fft.rfft(mean)
    power = np.abs(spectrum) ** 2
    floor = noise * bins * bins / x.size + 1e-300
    h = np.arange(spectrum.size)
    last = int(np.argmax(np.cumsum(np.minimum(power / floor, 1e6)[1:] - NOISY))) + 1
    gain = np.where(h <= last, np.maximum(1 - floor / np.maximum(power, 1e-300), 0.0), 0.0) / np.sinc(h / bins)
    full = np.zeros(TABLE // 2 + 1, dtype=complex)
    full[: spectrum.size] = spectrum * gain * np.exp(1j * np.pi * h / TABLE - 1j * np.pi * h / bins) * (TABLE / bins)
    turn = np.arange(full.size) * 2j * np.pi / width
    shape = np.fft.irfft(full, TABLE)
    around = np.exp(2j * np.pi * (np.arange(TABLE) + 0.5) / TABLE) @ shape**2
    return Pulse(shape, np.fft.irfft(full * turn, TABLE), float(np.angle(around) / (2 * np.pi)) % 1.0)


def _is_clipped(x: Array) -> bool:
    """Return whether more than half of the turns reach one and the same greatest value three times or more."""
    return bool(np.count_nonzero(np.count_nonzero(x == x.max(), axis=1) > 2) > 0.5 * len(x))


@dataclass(frozen=True)
class Projection:
    """The fit of pulse, slope of the pulse and a constant to each piece; all of shape (turns,).

    Attributes:
        usable: whether the piece holds enough of the pulse and of its slope.
        height: in units of the mean pulse.
        shift: of the height times the shift [turns].
        power: sum of squares of the pulse in the piece; the variance of height is the variance of the noise over this.
        information: the same of shift.
        rest: sum of squares that is left.
        freedom: samples less parameters.
    """

    usable: NDArray[np.bool_]
    height: Array
    shift: Array
    power: Array
    information: Array
    rest: Array
    freedom: Array


def _project(pieces: Pieces, pulse: Pulse) -> Projection:
    """Fit the pulse to each piece."""
    x, shape, slope = pieces.x, pulse.shape[pieces.cell], pulse.slope[pieces.cell]
    counts = np.full(x.shape[0], float(x.shape[1]))
    if pieces.valid is not None:
        x, shape, slope = np.where(pieces.valid, x, 0.0), shape * pieces.valid, slope * pieces.valid
        counts = np.maximum(pieces.valid.sum(axis=1), 1).astype(np.float64)
    ones = np.ones(x.shape[1])
    rows = {"x": x, "shape": shape, "slope": slope}
    sums = {name: row @ ones for name, row in rows.items()}

    def covariance(a: str, b: str) -> Array:
        return np.asarray(np.einsum("ij,ij->i", rows[a], rows[b]) - sums[a] * sums[b] / counts)

    power, mixed, steepness = covariance("shape", "shape"), covariance("shape", "slope"), covariance("slope", "slope")
    with_shape, with_slope = covariance("x", "shape"), covariance("x", "slope")
    determinant = power * steepness - mixed**2
    seen = power > LEAST * np.median(power)
    usable = seen & (steepness > LEAST * np.median(steepness)) & (determinant > 0)
    determinant, power = np.where(usable, determinant, 1.0), np.where(seen, power, 1.0)
    # a pulse whose edges lie between the samples has a height, and says nothing of its place
    alone = np.where(seen, with_shape, 0.0) / power
    height = np.where(usable, (steepness * with_shape - mixed * with_slope) / determinant, alone)
    shift = np.where(usable, power * with_slope - mixed * with_shape, 0.0) / determinant
    return Projection(
        usable=usable,
        height=height,
        shift=shift,
        power=power,
        information=np.where(usable, determinant / power, 0.0),
        rest=covariance("x", "x") - height * with_shape - shift * with_slope,
        freedom=np.maximum(counts - 3, 1),
    )


def _amplitudes(found: Projection, noise2: float) -> tuple[Array, float] | None:
    """Return the height of each pulse, shrunk to the mean as far as noise scatters them, and the mean.

    None where there are no pulses.
    """
    usable = found.usable
    if not usable.any():
        return None
    height, power = found.height[usable], found.power[usable]
    mean = float(np.average(height, weights=power))
    if mean**2 * float(power.sum()) / noise2 < EVIDENCE:
        return None
    total = float(np.mean((height - mean) ** 2))
    share = max(0.0, 1 - float(np.mean(noise2 / power)) / total) if total > 0 else 0.0
    return mean + share * (found.height - mean), mean


def _fit_without_far(
    times: Array, phase: Array, weight: Array, there: NDArray[np.bool_], fit: Callable[[Array, Array, Array], Fit]
) -> tuple[Fit, NDArray[np.bool_]]:
    """Return the fit to turns that are there and not far off, and which these are; weight: 1/variance, shape (n,)."""
    use = there
    for _ in range(4):
        found, before = fit(times[use], phase[use], weight[use]), use
        standard = np.abs(phase - found.phase(times)) * np.sqrt(weight)
        spread = max(1.4826 * median(standard[use]), 0.5)
        use = there & (standard < student(found.scatter.freedom, GROSS) * spread)
        if np.array_equal(use, before) or np.count_nonzero(use) < 4:
            return found, before
    return found, use


def _regress(
    pieces: Pieces, pulse: Pulse, window: Window, near: Fit, *, degree: int | None, rate: float
) -> Match | None:
    """Return the phase by the places of the pulses; near: a phase that is nearly right."""
    found = _project(pieces, pulse)
    noise2 = max(median(found.rest / found.freedom), 1e-300)
    sizes = _amplitudes(found, noise2)
    if sizes is None:
        return None
    amplitude, mean = sizes
    there = found.usable & (amplitude > 0.03 * mean)
    if np.count_nonzero(there) < 4:
        return None
    weight = amplitude**2 * found.information / noise2
    phase = pieces.numbers + np.divide(found.shift, amplitude, out=np.zeros_like(amplitude), where=there)
    height_of_pulse = float(np.ptp(pulse.shape))
    steep = float(np.abs(pulse.slope).max()) * near.middle_frequency / (rate * max(height_of_pulse, 1e-300))
    fit_some = partial(fit_turns, degree=degree, jump=near.jump, grid=Grid(1 / rate, steep), absolute=True)
    fit, use = _fit_without_far(pieces.times, phase, weight, there, fit_some)
    return Match(
        fit=fit,
        turns=int(np.count_nonzero(use)),
        numbers=np.floor(pieces.numbers - window.middle + 0.5).astype(np.int64),
        heights=found.height / mean,
        shifts=phase - fit.phase(pieces.times),
        used=use,
        evidence=float(found.height[found.usable] ** 2 @ found.power[found.usable]) / noise2,
        flat=_is_clipped(pieces.x),
        noise=float(np.sqrt(noise2)),
        height=mean * height_of_pulse,
        bound=float(np.sqrt(fit.unit_covariance[1, 1])) / fit.half,
        missing=int(np.count_nonzero(found.height < FAINT * mean)),
        wrong=int(np.count_nonzero(there & ~use)),
        pulse=pulse,
        window=window,
        grid=fit.middle_frequency / rate if steep > SHARP else 0.0,
    )
