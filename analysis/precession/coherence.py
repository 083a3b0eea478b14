"""Are the pulses of the laser locked to the drive?  Their phases on the drive, as vectors of length one.

Source: Mardia & Jupp, Directional Statistics (2000), §2.3 (mean direction), §6.3 (Rayleigh's test).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.errors import TooFewReadings

Array = NDArray[np.float64]

#: Pulses below which a mean vector says little.
FEWEST_PULSES = 5
#: Rayleigh's p below which pulses are held for locked.
LOCKED_P = 1e-3
#: Locked pulses stay within this part of a turn; a locked top swings by a quarter of it.
_STAYS = 0.5
#: Part of the signal's height by which it must fall back before a pulse can begin anew: noise makes no pulses.
_HYSTERESIS = 0.25
#: A drift is looked for up to this [Hz].
_WIDEST_HZ = 2.0
_GOLDEN = (math.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class Coherence:
    """How firmly pulses follow a drive.

    Attributes:
        pulses: how many.
        length: of the mean vector: 1 where all come at one phase of the drive, about 1/√pulses where they come anyhow.
        phase_rad: of the mean vector on the drive.
        p_random: how probable so long a vector is for pulses at random (Rayleigh).
        drift_hz, u_drift_hz: frequency of the pulses − frequency of the drive: their phase against time.  Its u holds
            where the phases scatter independently of one another; a locked top swings about the drive within some
            seconds, which a short record shows as a drift.
        drive_hz: frequency of the drive in the same record.
        duration_s: from the first pulse to the last.
    """

    pulses: int
    length: float
    phase_rad: float
    p_random: float
    drift_hz: float
    u_drift_hz: float
    drive_hz: float
    duration_s: float

    @property
    def locked(self) -> bool:
        """Whether the pulses follow the drive: no chance, and no drift by half a turn within the record."""
        return self.p_random < LOCKED_P and abs(self.drift_hz) * self.duration_s < _STAYS


def coherence(pulse_times: Array, drive: Array, dt: float, drive_frequency: float, start: float = 0.0) -> Coherence:
    """Coherence of pulses with a drive that was recorded beside them.

    Args:
        pulse_times: shape (n,), increasing [s].
        drive: the drive's voltage, evenly sampled, shape (m,); its first harmonic counts.
        dt: between its samples [s].
        drive_frequency: near the drive's, to better than one period in the record [Hz].
        start: time of its first sample [s].

    Raises:
        TooFewReadings: below five pulses.
    """
    if pulse_times.size < FEWEST_PULSES:
        raise TooFewReadings(seen=pulse_times.size, needed=FEWEST_PULSES)
    frequency, phase = first_harmonic(drive, dt, drive_frequency)
    turns = frequency * (pulse_times - start) + phase / (2 * np.pi)
    vectors = np.exp(2j * np.pi * turns)
    mean = complex(vectors.mean())
    drift, u_drift = _drift(pulse_times, turns)
    return Coherence(
        pulses=pulse_times.size,
        length=min(abs(mean), 1.0),
        phase_rad=float(np.angle(mean)),
        p_random=rayleigh_p(abs(mean), pulse_times.size),
        drift_hz=drift,
        u_drift_hz=u_drift,
        drive_hz=frequency,
        duration_s=float(pulse_times[-1] - pulse_times[0]),
    )


def rayleigh_p(length: float, n: int) -> float:
    """How probable a mean vector of this length is for n phases at random.

    Wilkie, Appl. Stat. 32, 311 (1983): good to three digits above p = 0.001 from n = 10 on.

    >>> round(rayleigh_p((2.919 / 10) ** 0.5, 10), 3)  # tabulated: 0.05
    0.05
    """
    resultant = n * min(length, 1.0)
    return min(1.0, math.exp(math.sqrt(1 + 4 * n + 4 * (n**2 - resultant**2)) - (1 + 2 * n)))


def first_harmonic(signal: Array, dt: float, near: float) -> tuple[float, float]:
    """Frequency [Hz] and phase of the cosine at the first sample [rad] of a periodic signal's first harmonic.

    The phases of sixteenths of the record, each a least-squares cosine, lie on a line whose slope corrects the
    frequency.  near: the frequency to better than one period in the record [Hz].
    """
    parts = np.array_split(np.arange(signal.size), 16 if near * dt * signal.size > 32 else 2)
    times = np.array([dt * (part[0] + part[-1]) / 2 for part in parts])
    phases = []
    for part, middle in zip(parts, times, strict=True):
        angle = 2 * np.pi * near * (dt * part - middle)
        columns = np.column_stack((np.cos(angle), -np.sin(angle), np.ones_like(angle)))
        (real, imaginary, _), *_ = np.linalg.lstsq(columns, signal[part], rcond=None)
        phases.append(math.atan2(imaginary, real) - 2 * np.pi * near * middle)
    slope, intercept = np.polynomial.polynomial.polyfit(times, np.unwrap(phases), 1)[::-1]
    return near + float(slope) / (2 * np.pi), float(intercept)


def pulse_times(signal: Array, dt: float, start: float = 0.0) -> Array:
    """When a beam is cut, shape (n,) [s]: the middle of each dip of its signal, between its flanks at half height.

    Args:
        signal: shape (m,) [V].
        dt: between samples [s].
        start: time of the first [s].
    """
    signal = -signal
    low, high = (float(level) for level in np.percentile(signal, [0.5, 99.5]))
    middle = (low + high) / 2
    lower = middle - _HYSTERESIS * (high - low)
    if not high > low:
        return np.empty(0)
    state, ups, downs = bool(signal[0] > middle), [], []
    for k in np.flatnonzero(np.diff((signal > middle).astype(np.int8) + (signal > lower).astype(np.int8))).tolist():
        if not state and signal[k + 1] > middle:
            state = True
            ups.append(k)
        elif state and signal[k + 1] <= lower:
            state = False
            downs.append(_last_above(signal, middle, k))
    if downs and (not ups or downs[0] < ups[0]):
        downs.pop(0)
    flanks = [
        (_crossing(signal, middle, up), _crossing(signal, middle, down)) for up, down in zip(ups, downs, strict=False)
    ]
    return np.array([start + dt * (a + b) / 2 for a, b in flanks])


def _last_above(signal: Array, level: float, k: int) -> int:
    """The last sample above a level at or before k."""
    while k > 0 and signal[k] <= level:
        k -= 1
    return k


def _crossing(signal: Array, level: float, k: int) -> float:
    """Where the signal crosses a level between samples k and k + 1, in samples."""
    rise = float(signal[k + 1] - signal[k])
    return k + (level - float(signal[k])) / rise if rise else float(k)


def _drift(times: Array, turns: Array) -> tuple[float, float]:
    """Frequency of the pulses beside the drive's, and its u [Hz].

    It is where the mean vector is longest if its phase may turn evenly meanwhile: the most probable one for phases that
    scatter by von Mises' law, and a doubled or missing pulse does not upset it as it does a phase that is counted on.
    u = σ √12/(2π T √n), σ² = −2 ln(length).
    """
    span, off = float(np.ptp(times)), times - times.mean()
    widest = max(_WIDEST_HZ, 4 / span)
    tried = np.linspace(-widest, widest, 2 * math.ceil(4 * widest * span) + 1)

    def length(drift: float) -> float:
        # pulses that are faster than the drive come earlier and earlier on it
        return float(abs(np.mean(np.exp(2j * np.pi * (turns + drift * off)))))

    lengths = np.array([length(float(drift)) for drift in tried])
    k = int(np.clip(np.argmax(lengths), 1, tried.size - 2))
    low, best, high = tried[k - 1 : k + 2].tolist()
    for _ in range(40):  # golden sections: to 1e-8 of the step
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        low, high = (low, right) if length(left) > length(right) else (left, high)
    best = (low + high) / 2
    scatter = math.sqrt(-2 * math.log(min(length(best), 1 - 1e-12)))
    return best, scatter * math.sqrt(12 / times.size) / (2 * math.pi * span)
