"""What the phototransistors see of a top: white tape that a lamp lights once a turn, and a laser cut by the stem."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from instruments.virtual.counter.edges import Thresholds

#: The laser's light is computed in such steps [s]; a straight line in between misses 6e-4 of a wobble at 42 Hz.
GRID_S = 2.5e-4
#: A time that is short against a pulse [s].
_CLOSE_S = 1e-6
#: Time between two random numbers of the noise [s].
NOISE_S = 5e-6
#: Coefficients of erfcc in Numerical Recipes, the constant first.
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
    """A strip of white tape on the rim, a lamp beside it, and a lens that shows the tape to a phototransistor.

    Attributes:
        width: of its light pulse, FWHM in turns.
        dark, bright: voltage without the tape, and with the tape in the middle of the lens's view [V]; they differ by
            the gain.
        saturation: greatest voltage [V].
        bandwidth_hz: of the phototransistor, one pole.
        view_m: distance above or below the middle of the view at which the tape gives 1/e² of its light.
        ripple: of the lamp's light, relative, at twice the frequency of the mains.
        noise: of the voltage, 1σ [V].
    """

    width: float = 0.03
    dark: float = 0.1
    bright: float = 1.2
    saturation: float = 4.8
    bandwidth_hz: float = 10e3
    view_m: float = 0.010
    ripple: float = 0.0
    mains_hz: float = 50.0
    noise: float = 0.01

    @property
    def sigma(self) -> float:
        """Standard deviation of the pulse in turns."""
        return self.width / math.sqrt(8 * math.log(2))

    @property
    def delay(self) -> float:
        """Time constant of the phototransistor [s]; it delays a much longer pulse by this time."""
        return 1 / (2 * math.pi * self.bandwidth_hz)

    def height(self, lift: Array) -> Array:
        """Return the height of a pulse, relative, for a tape that far above the middle of the view [m]; shape (n,)."""
        return np.asarray(np.exp(-2 * (lift / self.view_m) ** 2))

    def pulse(self, turns: Array, rate: Array) -> Array:
        """Return the pulses behind the phototransistor's pole, shape (n,): a Gaussian of height 1 in mid turn.

        Args:
            turns: since the tape was opposite to the lamp.
            rate: of turns [Hz], 0: there is no top.

        A Gaussian behind a pole is an exponentially modified one, √(π/2) q exp(−u²/2) erfcx((q − u)/√2) at u σ behind
        its middle, q = σ/τ.
        """
        late = self.delay * np.maximum(rate, 0.0)
        place = turns - np.floor(turns) - 0.5
        answer = np.zeros(turns.shape)
        tail = 6 * self.sigma + 16 * float(late.max(initial=0.0))
        for turns_ago in range(1 + math.floor(tail + 0.5)):  # the tails of earlier pulses are added
            behind = place + turns_ago
            near = np.flatnonzero((behind > -6 * self.sigma) & (behind < tail) & (rate > 0))
            answer[near] += _behind_a_pole(behind[near] / self.sigma, self.sigma / late[near])
        return answer

    def mean_voltage(self, turns: Array, rate: Array, times: Array, height: Array | float = 1.0) -> Array:
        """Return the voltage without its noise, shape (n,) [V].

        Args:
            turns: since the tape was opposite to the lamp, shape (n,).
            rate: of turns [Hz], 0: there is no top.
            times: shape (n,) [s].
            height: of the pulses, relative; 1 in the middle of the view.
        """
        light = self.dark + (self.bright - self.dark) * height * self.pulse(turns, rate)
        if self.ripple:
            light = light * (1 + self.ripple * np.sin(4 * math.pi * self.mains_hz * times))
        return np.minimum(light, self.saturation)

    def noise_at(self, times: Array, seed: int) -> Array:
        """Return the noise of the voltage, shape (n,) [V]."""
        return self.noise * noise(times, (seed, 1))

    # --- the times of the pulses, without a trace ---

    def offset(self, triggers: Thresholds, rate: float, least: float = 1.0) -> float | None:
        """Return how far from the middle of a turn a trigger fires [turns], to 1e-3 of a turn.

        Args:
            triggers: where the trigger fires, and where it arms again.
            rate: of turns [Hz].
            least: height of the lowest pulse.

        Returns:
            None if it may not fire once a turn, or if only a trace can show where: a level in the noise, near the top
            of a pulse or above saturation; a hysteresis smaller than the noise; ripple; a phototransistor slower than
            the pulse.
        """
        margin, share = 5 * self.noise, (triggers.fire - self.dark) / (self.bright - self.dark)
        low, high = min(triggers.fire, triggers.arm), max(triggers.fire, triggers.arm)
        top = min(self.dark + (self.bright - self.dark) * least * 0.9, self.saturation)
        behind = self.delay * rate
        certain = low > self.dark + margin and high < top - margin and high - low > 3.9 * self.noise
        if not certain or self.ripple or not behind < 0.3 * self.sigma < 0.03:
            return None
        return behind - triggers.sign * self.sigma * math.sqrt(-2 * math.log(share))

    def crossing_times(self, near: Array, clean: Callable[[Array], Array], level: float, seed: int) -> Array:
        """Return when the voltage crosses a level, shape (n,) [s].

        Args:
            near: a time near each crossing, shape (n,) [s].
            clean: the voltage without its noise at times [V].
            level: [V].
            seed: of the noise.

        Where the voltage does not change there is no crossing, so the result may be shorter than `near`.  Times from
        `offset` are right within some µs.  One step of Newton's method on the voltage without noise refines them; the
        noise then moves each crossing by its value over the slope.
        """
        three = near + np.array([[-_CLOSE_S], [0.0], [_CLOSE_S]])
        before, here, after = clean(three.T.ravel()).reshape(-1, 3).T
        slope = (after - before) / (2 * _CLOSE_S)
        crosses = slope != 0  # no pulse is near where a top falls or is put back
        slope = slope[crosses]
        near = near[crosses] - (here - level)[crosses] / slope
        return np.asarray(near - self.noise_at(near, seed) / slope)


def _behind_a_pole(u: Array, q: Array) -> Array:
    """Return a Gaussian exp(−u²/2) behind a pole whose time constant is σ/q, shape (n,)."""
    z = (q - u) / math.sqrt(2)
    t = 1 / (1 + 0.5 * np.abs(z))
    scaled = np.exp(-0.5 * u * u) * t * np.exp(np.polynomial.polynomial.polyval(t, _ERFC))
    # erfc(z) = 2 − erfc(−z) behind the pulse
    tail = 2 * np.exp(np.minimum(q * (0.5 * q - u), 0.0)) - scaled
    return np.asarray(math.sqrt(math.pi / 2) * q * np.where(z < 0, tail, scaled))


@dataclass(frozen=True)
class Laser:
    """A laser beam beside the stem, along y, with a phototransistor behind it and an amplifier.

    A lens widens the beam, so that the stem stays on its flank.  A capacitor couples the amplifier: it removes the slow
    swing of the whole top, some mm at less than 1 Hz.  The amplifier saturates on the signal of the synchronous wobble,
    so a driven top gives one pulse down per turn.  A narrow beam without the capacitor (coupling_hz None) must stand
    where the stem's circle cuts it; else pulses are missed or doubled.

    Attributes:
        height_m: of the beam above the top's centre of mass.
        offset_m: of the beam's middle from the base's axis, along x.
        waist_m: the beam's radius at the stem, where its light is down to 1/e².
        stem_radius_m: of the stem.
        dark, bright: the amplifier's least and greatest voltage [V].
        gain: voltage of the whole beam, before it saturates [V].
        coupling_hz: corner frequency of the capacitor; None: there is none, and the voltage is dark + gain·light.
        bandwidth_hz: of the phototransistor.
        noise: of the voltage, 1σ [V].
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
        """Return the share of a Gaussian beam that passes a stem at these places along x [m], shape (n,)."""
        scale, aside = math.sqrt(2) / self.waist_m, place - self.offset_m
        blocked = error_function(scale * (aside + self.stem_radius_m)) - error_function(
            scale * (aside - self.stem_radius_m)
        )
        return np.asarray(1.0 - 0.5 * blocked)

    def voltage_at_rest(self, times: Array, seed: int) -> Array:
        """Return the voltage behind a stem at rest on the axis [V], shape (n,)."""
        return self._amplify(np.broadcast_to(self.light(np.zeros(1)), times.shape), times, seed, moving=False)

    def voltage(self, times: Array, stem: Callable[[Array], tuple[Array, NDArray[np.bool_]]], seed: int) -> Array:
        """Return the amplifier's voltage at evenly spaced times [s], shape (n,) [V].

        Args:
            times: shape (n,) [s].
            stem: times [s] → displacement along x [m], and whether a stem is there.
            seed: of the noise.

        The light is computed on a grid of GRID_S from time 0 and taken as straight in between, for which both filters
        are exact.  The filters begin 20 time constants early, so that their initial state has decayed to 2e-9.
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
        return self._amplify(np.interp(times, grid, light), times, seed, moving=True)

    def _amplify(self, light: Array, times: Array, seed: int, *, moving: bool) -> Array:
        rest = (self.dark + self.bright) / 2 if self.coupling_hz else self.dark
        signal = light if moving or not self.coupling_hz else 0.0 * light
        return np.clip(rest + self.gain * signal, self.dark, self.bright) + self.noise * noise(times, (seed, 2))


def low_pass(signal: Array, step: float, bandwidth_hz: float) -> Array:
    """Return a signal behind one pole, shape (n,).

    The signal's samples are a step apart [s]; it is straight between them, and constant before the first.  The filter
    is exact for such a signal: y ← a y + b₀ x + b₁ x₋, a = e^(−r), b₁ = (1−a)/r − a, b₀ = 1 − (1−a)/r, r = step/τ.
    """
    from scipy.signal import lfilter  # takes a moment to load

    ratio = 2 * math.pi * bandwidth_hz * step
    decay = math.exp(-ratio)
    new, old = 1 - (1 - decay) / ratio, (1 - decay) / ratio - decay
    # the initial state of a signal that was constant
    filtered, _ = lfilter([new, old], [1.0, -decay], signal, zi=[signal[0] * (1 - new)])
    return np.asarray(filtered)


def error_function(x: Array) -> Array:
    """Return erf(x) to 1.2e-7 (Press et al., Numerical Recipes in C, § 6.2, erfcc); numpy has none."""
    t = 1 / (1 + 0.5 * np.abs(x))
    beyond = t * np.exp(np.polynomial.polynomial.polyval(t, _ERFC) - x * x)
    return np.asarray(np.copysign(1 - beyond, x))


def noise(times: Array, seed: tuple[int, int]) -> Array:
    """Return white noise up to about 100 kHz, mean 0 and variance 1, as a function of time [s], shape (n,).

    A hash of the number of each NOISE_S (Steele, Lea & Flood, OOPSLA 2014, SplitMix64) gives a normal number; between
    them the noise is interpolated with its variance kept.  So it is the same however a record is cut.
    """
    place = times / NOISE_S
    whole = np.floor(place)
    share = place - whole
    number = whole.astype(np.int64)
    first, last = (int(number.min()), int(number.max())) if number.size else (0, 0)
    if last - first < number.size:  # a dense record: several samples share a number
        normal = _normal_at(np.arange(first, last + 2), seed)
        here, there = normal[number - first], normal[number - first + 1]
    else:
        here, there = _normal_at(number, seed), _normal_at(number + 1, seed)
    return np.asarray((here * (1 - share) + there * share) / np.sqrt((1 - share) ** 2 + share**2))


def _normal_at(numbers: NDArray[np.int64], seed: tuple[int, int]) -> Array:
    return _normal()[_hash(numbers.view(np.uint64) + _first_number(seed))]


@functools.cache
def _first_number(seed: tuple[int, int]) -> np.uint64:
    """Return the whole number at which a seed begins to count."""
    return np.uint64(int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]))


def _hash(numbers: NDArray[np.uint64]) -> NDArray[np.uint64]:
    z = numbers * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(z >> np.uint64(48))


@functools.cache
def _normal() -> Array:
    """Return a normal number for each value of a hash; their mean is 0, their variance 1."""
    numbers = np.random.default_rng(0).standard_normal(1 << 16)
    return np.asarray((numbers - numbers.mean()) / numbers.std())
