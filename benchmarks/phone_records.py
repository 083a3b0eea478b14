"""Synthetic records of a phone's magnetometer, for tests and studies: no physics of a bench, numbers alone."""

import numpy as np

from analysis.arrays import Array

#: Amplitude of the line in each axis, relative.
AXES = np.array([1.0, 0.5, 0.3])


def synthetic_field(
    random: np.random.Generator,
    *,
    frequency: float = 31.0,
    chirp: float = -0.1,
    duration: float = 10.0,
    rate: float = 100.0,
    jitter: float = 3e-4,
    snr_db: float = 6.0,
    noise: float = 0.5e-6,
    bend: float = 1.5,
    disturbed: bool = True,
) -> tuple[Array, Array]:
    """Return times, shape (n,) [s], and a field in three axes, shape (n, 3) [T].

    Args:
        random: for the noise and all that is not said.
        frequency: at the mean time [Hz].
        chirp: its slope there [Hz/s].
        duration: [s].
        rate: samples per second.
        jitter: of each time, 1σ [s].
        snr_db: 20 log₁₀ of the greatest axis's amplitude over the noise.
        noise: of a sample, 1σ [T].
        bend: n of the slope's change n chirp²/frequency.
        disturbed: with offset, drift, mains at 50 Hz, slow swings and precession.
    """
    n = round(duration * rate)
    times = np.sort(np.arange(n) / rate + random.normal(0, jitter, n))
    late = times - times.mean()
    size = noise * 10 ** (snr_db / 20) * AXES
    turns = frequency * late + chirp * late**2 / 2 + bend * chirp**2 / frequency * late**3 / 6
    shifts = random.uniform() + np.array([0.0, -0.25, 0.07])
    field = size * np.cos(2 * np.pi * (turns[:, None] + shifts)) + random.normal(0, noise, (n, 3))
    if disturbed:
        x = late[:, None] / duration
        field += [1.05e-3, 2e-5, -6.2e-4] + 3e-6 * random.normal(size=3) * x + 1e-6 * random.normal(size=3) * x**2
        precession = 7.5 * 30 / frequency  # as slow as the spin is fast
        lines = [(50 + random.normal(0, 0.02), 0.0, 0.4e-6), (precession, -precession * chirp / frequency, 0.3e-6)]
        lines += [(swing, 0.0, 0.3e-6) for swing in (0.59, 0.77, 1.19)]
        for where, slope, amplitude in lines:
            turns = where * late + slope * late**2 / 2
            axes = amplitude * random.uniform(-1, 1, 3), random.uniform(size=3)
            field += axes[0] * np.cos(2 * np.pi * (turns[:, None] + axes[1]))
    return times, field


def frequency_bounds(times: Array, frequency: float, chirp: float, snr_db: float) -> tuple[float, float]:
    """Return the bounds of the frequency's error in a synthetic field, from the truth [Hz].

    The first is the Cramér–Rao bound where the law of the drag is known; the second the Bayesian one (Van Trees) where
    its power is from 1 to 2, evenly distributed, which leaves the change of the slope to the samples.

    Args:
        times: shape (n,) [s].
        frequency: at the mean time [Hz].
        chirp: its slope there [Hz/s].
        snr_db: of the greatest axis.
    """
    late = times - times.mean()
    by = 2 * np.pi * np.stack([late, late**2 / 2, late**3 / 6, np.ones_like(late)])  # frequency, slope, bend, phase
    information = 0.5 * 10 ** (snr_db / 10) * float(AXES @ AXES) * by @ by.T
    known = np.delete(np.delete(information, 2, 0), 2, 1)
    information[2, 2] += 12 * (frequency / chirp**2) ** 2
    return float(np.linalg.inv(known)[0, 0]) ** 0.5, float(np.linalg.inv(information)[0, 0]) ** 0.5


def synthetic_flight(
    random: np.random.Generator,
    *,
    duration: float = 120.0,
    up: tuple[float, float] = (0.0, 1e9),
    start_hz: float = 38.0,
    loss: float = 3.2e-3,
    rate: float = 100.0,
    jitter: float = 3e-4,
    amplitude: float = 0.3e-6,
    noise: float = 0.5e-6,
) -> tuple[Array, Array, Array]:
    """Return times [s], a field in three axes [T] and the spin [Hz] of a top that coasts, shapes (n,), (n, 3), (n,).

    Args:
        random: for the noise and all that is not said.
        duration: of the record [s].
        up: from when and until when the top is up [s].
        start_hz: the spin at time 0.
        loss: part of the spin that is lost in a second, always the same [1/s].
        rate: samples per second.
        jitter: of each time, 1σ [s].
        amplitude: of the line [T].
        noise: of a sample, 1σ [T].
    """
    n = round(duration * rate)
    times = np.sort(np.arange(n) / rate + random.normal(0, jitter, n))
    spin = start_hz * np.exp(-loss * times)
    turns = -start_hz * np.expm1(-loss * times) / loss
    is_up = (times >= up[0]) & (times < up[1])
    line = np.where(is_up, 1.0, 0.0)[:, None] * np.cos(2 * np.pi * (turns[:, None] + np.array([0.1, -0.15, 0.17])))
    field = amplitude * AXES * line + random.normal(0, noise, (n, 3))
    jolt = np.where(is_up, 1.0, 0.0)[:, None] * np.array(
        [4e-6, 1e-6, -9e-6]
    )  # the top's own field, which falls with it
    swing = 1e-6 * np.sin(2 * np.pi * 0.77 * times)[:, None] * random.normal(size=3)
    return times, field + np.array([1.05e-3, 2e-5, -6.2e-4]) + jolt + swing, spin
