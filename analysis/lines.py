"""Spectral lines of complex signals: frequencies of either sign, amplitudes and phases.

The strongest line is found in a Hann-windowed transform, placed between the bins by the ratio of the two highest
(Grandke, IEEE Trans. Instrum. Meas. 32, 350 (1983)), taken away, and so on; then each is placed again with all
others taken away (Li & Stoica's RELAX, IEEE Trans. Signal Process. 44, 281 (1996)), since every line leaks a
little into the others' bins.

A line is taken away from the transform, where its shape has a closed form: one transform of each signal is all that
takes its length.  Many signals go through side by side.  Each gives the same bits in any company: there are no matrix
products, and sums over lines and bins are written out or run over the first axis, so that their order is fixed.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.errors import NotFinite, TooFewReadings

Signal = NDArray[np.complex128]
Bins = NDArray[np.int64]

#: Below this many samples a window leaves nothing to look at; the ratio of two bins is good to 1/n².
FEWEST = 32
#: Half the width of a line's main lobe behind a Hann window, in bins: lines nearer to each other are one.
LOBE = 2
#: The greatest of 10⁵ bins of white noise stands at 4.1 times their median: higher peaks are no noise.
ABOVE_NOISE = 5.0
#: Rounds in which all lines are placed again; each lowers the leakage by a factor of about a hundred.
ROUNDS = 3
#: While lines are looked for, each is taken away this far to either side [bins]; beyond, 1/(π FAR³) of it is left,
#: 2e-8, where weaker lines are not looked for.
FAR = 256
#: Numbers of signals that are worked on together: they stay in the processor's cache.
TOGETHER = 100_000


@dataclass(frozen=True)
class Line:
    """A part  amplitude · e^{i(2π frequency t + phase)}  of a signal: [Hz], in the signal's unit, [rad] at t = 0."""

    frequency: float
    amplitude: float
    phase: float


@dataclass(frozen=True)
class Lines:
    """The lines of a signal, the strongest first; two nearer to each other than resolution [Hz] may be one."""

    lines: tuple[Line, ...]
    resolution: float


def spectral_lines(signal: Signal, rate: float, *, most: int = 12, weakest: float = 1e-3) -> Lines:
    """Return the lines of an evenly sampled signal, as far as they stand out.

    Args:
        signal: shape (n,).
        rate: samples per second, above twice the highest frequency or lines are seen at a wrong place [Hz].
        most: greatest number of lines.
        weakest: amplitude of the weakest in parts of the strongest.

    Raises:
        TooFewReadings, NotFinite: for what is no signal.

    A line whose frequency drifts by more than the resolution is broken up into several: take a shorter piece.

    >>> t = np.arange(1000) / 100
    >>> found = spectral_lines(3 * np.exp(2j * np.pi * 7.3456 * t) + np.exp(-2j * np.pi * 0.6 * t), 100.0)
    >>> [(round(line.frequency, 4), round(line.amplitude, 3)) for line in found.lines], found.resolution
    ([(7.3456, 3.0), (-0.6, 1.0)], 0.2)
    """
    return lines_of_signals(_check_signal(signal)[None], rate, most=most, weakest=weakest)[0]


def lines_of_signals(signals: Signal, rate: float, *, most: int = 12, weakest: float = 1e-3) -> list[Lines]:
    """Return the lines of many signals, shape (signals, n), each as `spectral_lines` would, to the last bit."""
    signals = _check_signal(signals)
    n = signals.shape[-1]
    together = max(TOGETHER // n, 1)
    return [
        Lines(lines, LOBE * rate / n)
        for i in range(0, len(signals), together)
        for lines in _lines_of(signals[i : i + together], rate, most, weakest)
    ]


def amplitude_spectrum(signal: Signal, rate: float) -> tuple[Array, Array]:
    """Return frequencies [Hz], rising from −rate/2, and amplitudes: a line of amplitude 1 stands 1 high, to 1 % below.

    Args:
        signal: shape (n,).
        rate: samples per second [Hz].

    Returns:
        Both of shape (4 n,), four values to a bin, for drawing.  Hann window.

    Raises:
        TooFewReadings, NotFinite: for what is no signal.
    """
    signal = _check_signal(signal)
    transform = np.fft.fft(signal * _hann(signal.size), 4 * signal.size)
    frequencies = np.fft.fftshift(np.fft.fftfreq(4 * signal.size, 1 / rate))
    return np.asarray(frequencies), np.asarray(np.abs(np.fft.fftshift(transform)))


def _check_signal(signal: Signal) -> Signal:
    """Return a signal, or many of one length."""
    signal = np.asarray(signal, dtype=np.complex128)
    if signal.shape[-1] < FEWEST:
        raise TooFewReadings(seen=signal.shape[-1], needed=FEWEST)
    wrong = np.argwhere(~np.isfinite(signal))
    if wrong.size:
        raise NotFinite(quantity="the signal", index=int(wrong[0, -1]), value=float("nan"))
    return signal


def _hann(n: int) -> Array:
    """Return the window, with a sum of 1."""
    return np.asarray((1 - np.cos(2 * np.pi * np.arange(n) / n)) / n)


class _Spectra(NamedTuple):
    """Windowed transforms, shape (signals, n): real and imaginary parts."""

    re: Array
    im: Array


class _Waves(NamedTuple):
    """One line of each signal, shape (signals,) each, or several, shape (lines, signals).

    Its shape in the transform is real but for a common factor e^{iπ offset}, which re and im have with the amplitude.
    """

    bins: Bins
    offset: Array
    re: Array
    im: Array


def _lines_of(signals: Signal, rate: float, most: int, weakest: float) -> Iterator[tuple[Line, ...]]:
    """Yield the lines of signals, shape (signals, n)."""
    n = signals.shape[-1]
    transforms = np.array([np.fft.fft(signal * _hann(n)) for signal in signals])
    spectra = _Spectra(np.ascontiguousarray(transforms.real), np.ascontiguousarray(transforms.imag))
    found, counts = _find(_Spectra(spectra.re.copy(), spectra.im.copy()), most, weakest)
    for _ in range(ROUNDS):
        for i in range(int(counts.max(initial=0))):
            _place_again(spectra, found, i, i < counts)
    places = found.bins + found.offset
    frequencies = np.where(places >= n / 2, places - n, places) * rate / n
    amplitudes = _length(found.re, found.im)
    phases = np.remainder(np.arctan2(found.im, found.re) - np.pi * found.offset + np.pi, 2 * np.pi) - np.pi
    order = np.argsort(-amplitudes, axis=0, kind="stable")
    numbers = np.array([np.take_along_axis(one, order, axis=0) for one in (frequencies, amplitudes, phases)])
    for count, several in zip(counts.tolist(), numbers.transpose(2, 1, 0).tolist(), strict=True):
        yield tuple(Line(*one) for one in several[:count])


def _find(rest: _Spectra, most: int, weakest: float) -> tuple[_Waves, Bins]:
    """Return the lines of each signal, one after another the strongest that is left, and how many these are.

    Args:
        rest: transforms, from which the lines are taken away.
        most: greatest number of lines.
        weakest: amplitude of the weakest in parts of the strongest.
    """
    rows, n = np.arange(len(rest.re))[:, None], rest.re.shape[-1]
    shape = (most, len(rows))
    found = _Waves(np.zeros(shape, dtype=np.int64), np.full(shape, 0.25), np.zeros(shape), np.zeros(shape))
    counts, goes_on = np.zeros(len(rows), dtype=np.int64), np.ones(len(rows), dtype=np.bool_)
    height = _length(rest.re, rest.im)
    peaks = np.where((height < np.roll(height, 1, axis=-1)) | (height < np.roll(height, -1, axis=-1)), 0.0, height)
    allowed = np.ones(height.shape, dtype=np.bool_)
    reach = min(FAR, n // 2 - 1)
    near, shown = np.arange(-reach, reach + 1), np.arange(-reach - 1, reach + 2)
    strongest = np.zeros(len(rows))
    for i in range(most):
        peak = np.argmax(peaks, axis=-1)
        top = peaks[rows[:, 0], peak]
        # as many bins as make the median below it are below this
        goes_on &= 2 * np.count_nonzero(height < (top / ABOVE_NOISE)[:, None], axis=-1) > n
        line = _fit_peak(_bins_around(rest, peak), peak, n)
        size = _length(line.re, line.im)
        strongest = np.where(goes_on, np.maximum(strongest, size), strongest)
        goes_on &= size >= weakest * strongest
        if not np.any(goes_on):
            break
        counts += goes_on
        line = _Waves(line.bins, line.offset, np.where(goes_on, line.re, 0.0), np.where(goes_on, line.im, 0.0))
        for all_lines, one in zip(found, line, strict=True):
            all_lines[i, goes_on] = one[goes_on]
        shape_of_line = _shape(line.offset, near, n)
        bins = (line.bins[:, None] + near) % n
        rest.re[rows, bins] -= line.re[:, None] * shape_of_line
        rest.im[rows, bins] -= line.im[:, None] * shape_of_line
        height[rows, bins] = _length(rest.re[rows, bins], rest.im[rows, bins])
        # residuals so near to a line come from its own fit, and flanks are no lines
        allowed[rows, (line.bins[:, None] + np.arange(-LOBE, LOBE + 1)) % n] = False
        bins = (line.bins[:, None] + shown) % n
        flank = np.concatenate([bins[:, :1] - 1, bins, (bins[:, -1:] + 1) % n], axis=-1)
        high = height[rows, flank]
        is_peak = (high[:, 1:-1] >= high[:, :-2]) & (high[:, 1:-1] >= high[:, 2:]) & allowed[rows, bins]
        peaks[rows, bins] = np.where(is_peak, high[:, 1:-1], 0.0)
    return found, counts


#: A line is placed by the bins this far from its peak.
_AROUND = np.arange(-LOBE, LOBE + 1)


def _bins_around(spectra: _Spectra, middle: Bins) -> _Spectra:
    """Return the bins around those in the middle, shape (signals, 5)."""
    rows, bins = np.arange(len(middle))[:, None], (middle[:, None] + _AROUND) % spectra.re.shape[-1]
    return _Spectra(spectra.re[rows, bins], spectra.im[rows, bins])


def _fit_peak(near: _Spectra, peak: Bins, n: int) -> _Waves:
    """Return the line at a peak: its place from the higher neighbour's share, its amplitude by least squares.

    Args:
        near: bins around the peak, shape (signals, 5).
        peak: shape (signals,).
        n: bins in all.
    """
    below, middle, above = _length(near.re, near.im).T[LOBE - 1 : LOBE + 2]
    ratio = np.maximum(above, below) / np.maximum(middle, np.finfo(np.float64).tiny)
    offset = np.where(above >= below, 1.0, -1.0) * (2 * ratio - 1) / (1 + ratio)
    shift = np.rint(offset)
    offset, bins = offset - shift, shift.astype(np.int64)  # from the bin that is nearest now
    shape = _shape(offset, _AROUND - bins[:, None], n)
    square = _sum_of_bins(shape * shape)
    re, im = (_sum_of_bins(shape * part) / square for part in near)
    return _Waves((peak + bins) % n, offset, re, im)


def _place_again(spectra: _Spectra, found: _Waves, i: int, there: NDArray[np.bool_]) -> None:
    """Place line i of each signal once more, with all the others taken away; changes `found`."""
    n, peak = spectra.re.shape[-1], found.bins[i]
    away = (peak - found.bins + n // 2) % n - n // 2
    shape = _shape(found.offset, away[..., None] + _AROUND, n)
    shape[i] = 0.0
    near = _bins_around(spectra, peak)
    re = near.re - np.add.reduce(shape * found.re[..., None], axis=0)
    im = near.im - np.add.reduce(shape * found.im[..., None], axis=0)
    for all_lines, one in zip(found, _fit_peak(_Spectra(re, im), peak, n), strict=True):
        all_lines[i] = np.where(there, one, all_lines[i])


def _shape(offset: Array, bins: Bins, n: int) -> Array:
    """Return how high a wave of amplitude 1 stands in the transform behind a Hann window, but for e^{iπ offset}.

    It is  D(x) − D(x − 1)/2 − D(x + 1)/2  with the transform D of an even window, put together into
    −sin(πδ) sin²h cot(hx) / (n sin h(x−1) sin h(x+1)),  h = π/n.

    Args:
        offset: δ of the wave from a bin, shape (…).
        bins: at which it is asked for, counted from that bin, x = δ − bin; shape (…, k), or (k,).
        n: bins in all.
    """
    offset = np.where(offset == 0, 1e-200, offset)[..., None]  # zero over zero has this limit
    h = math.pi / n
    a = (offset - bins) * h
    # with x ± 1 from whole numbers, so that nothing is lost next to a zero
    product = np.sin((offset - (bins - 1)) * h) * np.sin((offset - (bins + 1)) * h) * np.sin(a)
    return np.asarray(-np.sin(math.pi * offset) * (math.sin(h) ** 2 / n) * np.cos(a) / product)


def _sum_of_bins(values: Array) -> Array:
    """Return the sums over the last axis, of the five bins around a peak, in their order."""
    a, b, c, d, e = np.moveaxis(values, -1, 0)
    return np.asarray(a + b + c + d + e)


def _length(re: Array, im: Array) -> Array:
    return np.sqrt(re * re + im * im)
