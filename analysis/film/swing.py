"""One line in a signal of pictures, such as the precession in the tilt: its frequency by least squares.

What is slower than the line is a polynomial of time, and its mirror image is fitted beside it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.lines import FEWEST, spectral_lines

Signal = NDArray[np.complex128]

#: Order of the polynomial for what is slower, in a window of a second: 1.3 turns of the slow swings are left to 0.1 %.
_SLOW = 6
_STEPS = 6
#: Where residuals beside the line are looked at, in parts of what the window resolves.
_BESIDE = np.array([-2.5, -1.75, -1.0, 1.0, 1.75, 2.5])
#: A line stands out from this many standard uncertainties of its amplitude on.
_STANDS_OUT = 6.0


@dataclass(frozen=True)
class Swing:
    """A line.

    Attributes:
        frequency: [Hz].
        u: its standard uncertainty [Hz].
        amplitude: in the unit of the signal.
        u_amplitude: its standard uncertainty.
    """

    frequency: float
    u: float
    amplitude: float
    u_amplitude: float


def swing_of(times: Array, signal: Signal, between: tuple[float, float], order: int = _SLOW) -> Swing | None:
    """Return the strongest line between two frequencies of either sense; None where it does not stand out.

    Args:
        times: increasing, shape (n,) [s].
        signal: shape (n,).
        between: least and greatest frequency, without its sense [Hz].
        order: of the polynomial for what is slower.
    """
    if times.size < max(FEWEST, 2 * (order + 3)):
        return None
    t = times - times.mean()
    late = t / np.abs(t).max()
    slow = np.polynomial.chebyshev.chebvander(late, order).astype(np.complex128)
    rest = signal - slow @ np.linalg.lstsq(slow, signal, rcond=None)[0]
    even = np.linspace(t[0], t[-1], t.size)
    regular = np.interp(even, t, rest.real) + 1j * np.interp(even, t, rest.imag)
    lines = spectral_lines(regular, (t.size - 1) / float(t[-1] - t[0])).lines
    seen = [line.frequency for line in lines if between[0] < abs(line.frequency) < between[1]]
    if not seen:
        return None
    frequency = seen[0]
    for _ in range(_STEPS):
        wave = np.exp(2j * np.pi * frequency * t)
        design = np.column_stack([slow, wave.conj(), wave, late * wave])
        found = np.linalg.lstsq(design, signal, rcond=None)[0]
        turn = np.abs(t).max() * 2 * np.pi  # of the phase at the end, for each Hz
        frequency += float((found[-1] / found[-2]).imag) / turn
    rest = signal - design @ found
    inverse = np.linalg.inv(design.conj().T @ design).real
    # a line that a slower motion modulates has neighbours, which move it more than the noise does
    beside = np.exp(-2j * np.pi * (frequency + _BESIDE[:, None] / np.ptp(t)) * t) @ rest
    white = float(np.sum(np.abs(rest) ** 2)) / (t.size - design.shape[1])
    noise = (white + float(np.mean(np.abs(beside) ** 2)) / t.size) / 2
    amplitude, u = abs(complex(found[-2])), float(np.sqrt(noise * inverse[-2, -2] / 2))
    if amplitude < _STANDS_OUT * u or not between[0] < abs(frequency) < between[1]:
        return None
    return Swing(frequency, float(np.sqrt(noise * inverse[-1, -1] / 2)) / (turn * amplitude), amplitude, u)
