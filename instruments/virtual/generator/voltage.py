"""The voltage of an Output in time, and its first harmonic, which alone can turn a top.

The phase of a waveform is counted in turns from its start: there sine, square and ramp cross their middle upwards
(33220A User's Guide, BURSt:PHASe), pulses begin, and an arbitrary waveform has its first sample.
"""

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from instruments.virtual.core.signal import Array
from instruments.virtual.generator.channel import Output

#: Noise holds each value so long [s]: its bandwidth is 100 kHz, that of a 33500B after ``*RST``.
_NOISE_CELL = 5e-6
#: Peak over r.m.s. of the noise; see the families' crest.
_NOISE_PEAK = 3.3


def voltage(output: Output, turns: Array, times: Array) -> Array:
    """Return the voltage at the terminals, shape (n,) [V].

    Args:
        output: at the terminals.
        turns: phase of the waveform, shape (n,) [turns].
        times: of the same points [s], for noise.

    >>> from instruments.virtual.generator.channel import Output
    >>> voltage(Output("SQU", 1.0, 2.0, 0.5, duty=0.25), np.array([0.2, 0.3]), np.zeros(2)).tolist()
    [2.5, -1.5]
    """
    if not output.amplitude or output.waveform not in _SHAPES:
        return np.full_like(turns, output.offset)
    shape = _SHAPES[output.waveform](turns + output.phase / 360, times, output)
    # a polarity turns the waveform about the offset, which stays (33220A User's Guide, OUTPut:POLarity)
    return np.asarray(output.offset + (-output.amplitude if output.inverted else output.amplitude) * shape)


def fundamental(output: Output) -> float:
    """Return the amplitude of the first harmonic [V]; of bursts with pauses its mean over their period."""
    if not output.amplitude or output.waveform not in _FUNDAMENTALS:
        return 0.0
    return output.amplitude * _FUNDAMENTALS[output.waveform](output) * _busy(output)


def _busy(output: Output) -> float:
    """Return the fraction of time in which bursts are on."""
    burst = output.burst
    if burst is None or burst.period is None or not output.frequency:
        return 1.0
    return min(1.0, burst.cycles / output.frequency / burst.period)


# --- waveforms of amplitude 1: turns, times [s], output → value ---


def _square(turns: Array, _: Array, output: Output) -> Array:
    return np.where(turns % 1.0 < output.duty, 1.0, -1.0)


def _slopes(turns: Array, rises: float) -> Array:
    """Return a line that rises from −1 to 1 for this part of a period and falls for the rest."""
    place = (turns + rises / 2) % 1.0
    up = 2 * place / (rises or 1.0) - 1
    down = 1 - 2 * (place - rises) / ((1 - rises) or 1.0)
    return np.where(place < rises, up, down)


def _hold_samples(turns: Array, _: Array, output: Output) -> Array:
    """Hold each sample until the next; 1e-9 allows for the rounding of times just before a sample."""
    samples = _samples(output)
    return samples[(((turns % 1.0) * samples.size + 1e-9).astype(np.int64)) % samples.size]


def _samples(output: Output) -> Array:
    return np.zeros(1) if output.samples is None else output.samples


def _noise(_: Array, times: Array, _output: Output) -> Array:
    """Return noise that is always the same at the same time: a table whose index is a hash of the time (splitmix64)."""
    # 0.38: no round time lies between two cells, where rounding would choose
    cell = np.floor(times / _NOISE_CELL + 0.38).astype(np.int64).astype(np.uint64)
    cell = (cell ^ (cell >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    cell = (cell ^ (cell >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return _noise_table()[(cell >> np.uint64(48)).astype(np.int64)]


@cache
def _noise_table() -> Array:
    return np.clip(np.random.default_rng(0).standard_normal(1 << 16) / _NOISE_PEAK, -1.0, 1.0)


def _bits(turns: Array, _: Array, _output: Output) -> Array:
    """Return PN7, the sequence after ``*RST``; a turn is a bit."""
    return _pn7()[np.floor(turns).astype(np.int64) % 127]


@cache
def _pn7() -> Array:
    """Return the sequence of the polynomial x⁷ + x⁶ + 1."""
    register, bits = 127, []
    for _ in range(127):
        bits.append(1.0 if register & 1 else -1.0)
        register = register >> 1 | ((register ^ register >> 1) & 1) << 6
    return np.array(bits)


_SHAPES: dict[str, Callable[[Array, Array, Output], Array]] = {
    "SIN": lambda turns, _, _output: np.asarray(np.sin(2 * np.pi * turns)),
    "SQU": _square,
    "PULS": _square,
    "TRI": lambda turns, _, _output: _slopes(turns, 0.5),
    "RAMP": lambda turns, _, output: _slopes(turns, output.symmetry),
    "ARB": _hold_samples,
    "USER": _hold_samples,
    "NOIS": _noise,
    "PRBS": _bits,
}


# --- their first harmonics ---


def _of_square(output: Output) -> float:
    return 4 / math.pi * math.sin(math.pi * output.duty)


def _of_slopes(rises: float) -> float:
    falls = 1 - rises
    return 2 / math.pi if not 0 < rises < 1 else 2 * math.sin(math.pi * rises) / (math.pi**2 * rises * falls)


def _of_samples(output: Output) -> float:
    samples = _samples(output)
    n = samples.size
    turned = np.exp(-2j * np.pi * np.arange(n) / n)
    return float(2 / n * abs(np.dot(samples, turned)) * np.sinc(1 / n))  # held: each is 1/n of a turn wide


#: Noise and random bits have no line that a top could follow.
_FUNDAMENTALS: dict[str, Callable[[Output], float]] = {
    "SIN": lambda _: 1.0,
    "SQU": _of_square,
    "PULS": _of_square,
    "TRI": lambda _: _of_slopes(0.5),
    "RAMP": lambda output: _of_slopes(output.symmetry),
    "ARB": _of_samples,
    "USER": _of_samples,
}
