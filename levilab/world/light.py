"""What the phototransistors see of a top: white tape that a lamp lights once a turn, and a laser cut by the stem."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Callable

Array = NDArray[np.float64]

#: The laser's light is worked out so often [s]: of a wobble at 42 Hz a straight line in between misses 6e-4.
GRID_S = 2.5e-4
#: Noise is drawn so often [s].
NOISE_S = 5e-6
#: Of erfcc in Numerical Recipes, from the constant on.
_ERFC = (
    -1.26551223,
    1.00002368,
    0.37409196,
    0.09678418,
    -0.18628806,
    0.27886807,
    -1.13520398,
    1.48851587,
    -0.82215223,
    0.17087277,
)


@dataclass(frozen=True)
class Tape:
    """A strip of tape under a lamp.

    width: of its light pulse, FWHM in turns; dark, bright: voltage without and at the tape [V]; noise: of the voltage,
    1σ [V].
    """

    width: float = 0.03
    dark: float = 0.1
    bright: float = 1.2
    noise: float = 0.01

    def light(self, turns: Array, spinning: NDArray[np.bool_], start: float, seed: int) -> Array:
        """The phototransistor's voltage, shape (n,) [V]: a Gaussian pulse in the middle of every turn.

        turns: since the tape was opposite to the lamp; spinning: where there is a top; start: the time of the first
        [s], with the seed that of the noise.
        """
        sigma = self.width / np.sqrt(8 * np.log(2))
        place = turns - np.floor(turns) - 0.5
        pulse = np.exp(-0.5 * (place / sigma) ** 2) * spinning
        noise = np.random.default_rng((seed, round(start * 1e6) % (1 << 63))).standard_normal(turns.size) * self.noise
        return np.asarray(self.dark + (self.bright - self.dark) * pulse + noise)


@dataclass(frozen=True)
class Laser:
    """A laser beam beside the stem, along y, with a phototransistor behind it and an amplifier.

    The beam is widened by a lens, so that the stem stays on its flank, and the amplifier is coupled by a capacitor: the
    slow swing of the whole top, some mm at less than 1 Hz, is taken away, and what the synchronous wobble leaves is
    amplified until it saturates.  So a top that is driven gives one pulse down a turn.  A narrow beam without the
    capacitor (coupling_hz None) has to stand where the stem's circle cuts it; else pulses are missed or doubled.

    height_m: of the beam above the top's centre of mass; offset_m: of its middle from the base's axis, along x;
    waist_m: its radius at the stem, where the light is down to 1/e²; stem_radius_m: of the stem; dark, bright: the
    amplifier's least and greatest voltage [V]; gain: voltage of the whole beam, before it saturates [V]; coupling_hz:
    corner of the capacitor, None: there is none, and the voltage is dark + gain·light; bandwidth_hz: of the
    phototransistor; noise: of the voltage, 1σ [V].
    """

    height_m: float = 0.03
    offset_m: float = 0.006
    waist_m: float = 0.010
    stem_radius_m: float = 0.003
    dark: float = 0.1
    bright: float = 1.2
    gain: float = 20.0
    coupling_hz: float | None = 20.0
    bandwidth_hz: float = 10e3
    noise: float = 0.005

    def light(self, place: Array) -> Array:
        """The share of a Gaussian beam that passes a stem at these places along x [m], shape (n,)."""
        scale, aside = math.sqrt(2) / self.waist_m, place - self.offset_m
        blocked = error_function(scale * (aside + self.stem_radius_m)) - error_function(
            scale * (aside - self.stem_radius_m)
        )
        return np.asarray(1.0 - 0.5 * blocked)

    def steady(self, times: Array, seed: int) -> Array:
        """The voltage behind a stem at rest on the axis [V], shape (n,)."""
        return self._amplified(np.broadcast_to(self.light(np.zeros(1)), times.shape), times, seed, moving=False)

    def voltage(self, times: Array, stem: Callable[[Array], tuple[Array, NDArray[np.bool_]]], seed: int) -> Array:
        """The amplifier's voltage at evenly spaced times [s], shape (n,) [V].

        stem: its displacement along x [m] at times [s], and whether it is there at all.

        The light is known every GRID_S from absolute zero on and taken as straight between; both filters are exact for
        that.  They begin so long before that what they were before is 2e-9 of it.
        """
        slowest = 2 * math.pi * min(self.coupling_hz or math.inf, self.bandwidth_hz)
        first = math.floor((float(times[0]) - 20 / slowest) / GRID_S) - 1
        last = math.ceil(float(times[-1]) / GRID_S) + 1
        grid = GRID_S * np.arange(first, last + 1, dtype=np.float64)
        place, there = stem(grid)
        passing: Array = np.where(there, self.light(place), 1.0)
        light = low_pass(passing, GRID_S, self.bandwidth_hz)
        if self.coupling_hz:
            light -= low_pass(light, GRID_S, self.coupling_hz)
        return self._amplified(np.interp(times, grid, light), times, seed, moving=True)

    def _amplified(self, light: Array, times: Array, seed: int, *, moving: bool) -> Array:
        rest = (self.dark + self.bright) / 2 if self.coupling_hz else self.dark
        signal = light if moving or not self.coupling_hz else 0.0 * light
        return np.clip(rest + self.gain * signal, self.dark, self.bright) + self.noise * noise(times, (seed, 2))


def low_pass(signal: Array, step: float, bandwidth_hz: float) -> Array:
    """A signal behind one pole, shape (n,), straight between its samples, a step apart [s]; at rest before the first.

    Exact for such a signal: y ← a y + b₀ x + b₁ x₋, a = e^(−r), b₁ = (1−a)/r − a, b₀ = 1 − (1−a)/r, r = step/τ.
    """
    from scipy.signal import lfilter  # takes a moment to load

    ratio = 2 * math.pi * bandwidth_hz * step
    decay = math.exp(-ratio)
    new, old = 1 - (1 - decay) / ratio, (1 - decay) / ratio - decay
    # the state from which a constant signal goes on as it is
    filtered, _ = lfilter([new, old], [1.0, -decay], signal, zi=[signal[0] * (1 - new)])
    return np.asarray(filtered)


def error_function(x: Array) -> Array:
    """erf, to 1.2e-7 (Press et al., Numerical Recipes in C, § 6.2, erfcc), for numpy has none."""
    t = 1 / (1 + 0.5 * np.abs(x))
    beyond = t * np.exp(np.polynomial.polynomial.polyval(t, _ERFC) - x * x)
    return np.asarray(np.copysign(1 - beyond, x))


def noise(times: Array, seed: tuple[int, int]) -> Array:
    """White noise up to about 100 kHz, mean 0 and variance 1, as a function of time [s], shape (n,).

    It is drawn for each NOISE_S by a hash of their number (Steele, Lea & Flood, OOPSLA 2014, SplitMix64) and
    interpolated between, with the variance kept: so it is the same however a record is cut.
    """
    place = times / NOISE_S
    whole = np.floor(place)
    share = place - whole
    number = whole.astype(np.int64).view(np.uint64)
    start = np.uint64(int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]))
    table = _normal()
    here, there = table[_hash(number + start)], table[_hash(number + start + np.uint64(1))]
    return np.asarray((here * (1 - share) + there * share) / np.sqrt((1 - share) ** 2 + share**2))


def _hash(numbers: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Sixteen bits of a hash of each number."""
    z = numbers * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(z >> np.uint64(48))


@functools.cache
def _normal() -> Array:
    """So many normal numbers as a hash has values, with mean 0 and variance 1."""
    numbers = np.random.default_rng(0).standard_normal(1 << 16)
    return np.asarray((numbers - numbers.mean()) / numbers.std())
