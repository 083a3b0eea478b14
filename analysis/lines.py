"""Spectral lines of a complex signal: frequencies of either sign, amplitudes and phases.

The strongest line is found in a Hann-windowed transform, placed between the bins by the ratio of the two highest
(Grandke, IEEE Trans. Instrum. Meas. 32, 350 (1983)), taken away, and so on; then each is placed anew with all
others taken away (Li & Stoica's RELAX, IEEE Trans. Signal Process. 44, 281 (1996)), since every line leaks a
little into the others' bins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.errors import NotFinite, TooFewReadings

Signal = NDArray[np.complex128]
Array = NDArray[np.float64]

#: Below this many samples a window leaves nothing to look at; the ratio of two bins is good to 1/n².
FEWEST = 32
#: Half the width of a line's main lobe behind a Hann window, in bins: lines nearer to each other are one.
LOBE = 2
#: The greatest of 10⁵ bins of white noise stands at 4.1 times their median: what is higher than this is no noise.
ABOVE_NOISE = 5.0
#: How often all lines are placed anew; a round takes what leaks in down by a factor of about a hundred.
ROUNDS = 3


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
    """The lines of an evenly sampled signal, as far as they stand out.

    Args:
        signal: shape (n,).
        rate: samples per second, above twice the highest frequency or lines are seen at a wrong place [Hz].
        most: so many lines at most.
        weakest: amplitude of the weakest in parts of the strongest.

    Raises:
        TooFewReadings, NotFinite: for what is no signal.

    A line whose frequency drifts by more than the resolution is broken up into several: take a shorter piece.

    >>> t = np.arange(1000) / 100
    >>> found = spectral_lines(3 * np.exp(2j * np.pi * 7.3456 * t) + np.exp(-2j * np.pi * 0.6 * t), 100.0)
    >>> [(round(line.frequency, 4), round(line.amplitude, 3)) for line in found.lines], found.resolution
    ([(7.3456, 3.0), (-0.6, 1.0)], 0.2)
    """
    signal = _checked(signal)
    turns = np.arange(signal.size)
    window = _hann(signal.size)
    found: list[tuple[float, complex]] = []
    rest = signal.copy()
    while len(found) < most:
        line = _next(rest, window, turns, [place for place, _ in found])
        if line is None or abs(line[1]) < weakest * max(abs(a) for _, a in [*found, line]):
            break
        found.append(line)
        rest = rest - _wave(line, turns)
    for _ in range(ROUNDS):
        rest = _placed_anew(found, rest, window, turns)
    lines = [
        Line(place * rate / signal.size, float(abs(amplitude)), float(np.angle(amplitude)))
        for place, amplitude in found
    ]
    return Lines(tuple(sorted(lines, key=lambda line: -line.amplitude)), LOBE * rate / signal.size)


def amplitude_spectrum(signal: Signal, rate: float) -> tuple[Array, Array]:
    """Frequencies [Hz], rising from −rate/2, and amplitudes: a line of amplitude 1 stands 1 high, to 1 % below.

    Args:
        signal: shape (n,).
        rate: samples per second [Hz].

    Returns:
        Both of shape (4 n,), four values to a bin, for drawing.  Hann window.

    Raises:
        TooFewReadings, NotFinite: for what is no signal.
    """
    signal = _checked(signal)
    transform = np.fft.fft(signal * _hann(signal.size), 4 * signal.size)
    frequencies = np.fft.fftshift(np.fft.fftfreq(4 * signal.size, 1 / rate))
    return np.asarray(frequencies), np.asarray(np.abs(np.fft.fftshift(transform)))


def _checked(signal: Signal) -> Signal:
    signal = np.asarray(signal, dtype=np.complex128)
    if signal.size < FEWEST:
        raise TooFewReadings(seen=signal.size, needed=FEWEST)
    wrong = np.flatnonzero(~np.isfinite(signal))
    if wrong.size:
        raise NotFinite(quantity="the signal", index=int(wrong[0]), value=float("nan"))
    return signal


def _hann(n: int) -> Array:
    """The window, with a sum of 1."""
    return np.asarray((1 - np.cos(2 * np.pi * np.arange(n) / n)) / n)


def _wave(line: tuple[float, complex], turns: NDArray[np.int64]) -> Signal:
    place, amplitude = line
    return np.asarray(amplitude * np.exp(2j * np.pi * place / turns.size * turns))


def _next(rest: Signal, window: Array, turns: NDArray[np.int64], known: list[float]) -> tuple[float, complex] | None:
    """The strongest line that is left, as its place [bins] and complex amplitude; None if there is but noise."""
    height = np.abs(np.fft.fft(rest * window))
    noise = float(np.median(height))
    height[(height < np.roll(height, 1)) | (height < np.roll(height, -1))] = 0.0  # flanks are no lines
    for place in known:  # what is left so near to a line is that line's own imperfection
        height[np.arange(round(place) - LOBE, round(place) + LOBE + 1) % height.size] = 0.0
    peak = int(np.argmax(height))
    if height[peak] <= ABOVE_NOISE * noise:
        return None
    return _placed(rest, window, turns, peak)


def _placed(signal: Signal, window: Array, turns: NDArray[np.int64], peak: int) -> tuple[float, complex]:
    """The line at a peak: its place from the higher neighbour's share, and the transform's value there."""
    n = turns.size
    near = np.exp(-2j * np.pi * (np.outer([peak - 1, peak, peak + 1], turns) % n) / n) @ (signal * window)
    below, middle, above = np.abs(near)
    side = 1 if above >= below else -1
    ratio = max(above, below) / middle
    place = peak + side * (2 * ratio - 1) / (1 + ratio)
    place = float(place - n if place >= n / 2 else place)
    return place, complex(np.exp(-2j * np.pi * place / n * turns) @ (signal * window))


def _placed_anew(found: list[tuple[float, complex]], rest: Signal, window: Array, turns: NDArray[np.int64]) -> Signal:
    """Each line once more, with all the others taken away; changes the list, and returns what they leave over."""
    for i, line in enumerate(found):
        alone = rest + _wave(line, turns)
        found[i] = _placed(alone, window, turns, round(line[0]))
        rest = alone - _wave(found[i], turns)
    return rest
