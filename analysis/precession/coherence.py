"""Are the pulses of the laser locked to the drive?  Their phases on the drive, as vectors of length one.

Source: Mardia & Jupp, Directional Statistics (2000), §2.3 (mean direction), §6.3 (Rayleigh's test).
"""

import math
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.errors import TooFewReadings

#: Fewer pulses than this have no meaningful mean vector.
FEWEST_PULSES = 5
#: With a smaller p of Rayleigh's test, pulses count as locked.
LOCKED_P = 1e-3
#: The phase of a locked top swings like a pendulum, within this range [turns]; a drifting phase leaves it.
_LOCKED_TURNS = 1.0
#: Phases are means over this [s]: short against the swing of a locked top, some seconds.
_WINDOW_S = 0.4
#: Samples of a part of the drive's record that a phase needs, at least.
_FEWEST_SAMPLES = 8
#: The signal must fall back by this part of its height before a new pulse can begin, so that noise makes no pulses.
_HYSTERESIS = 0.25


@dataclass(frozen=True)
class Coherence:
    """How firmly pulses follow a drive.

    Attributes:
        pulses: how many.
        length: of the mean vector: 1 if all pulses come at one phase of the drive, about 1/√pulses if at random ones.
        phase_rad: phase of the drive in which the mean vector points.
        p_random: probability that pulses at random phases have such a length (Rayleigh).
        drift_hz, u_drift_hz: frequency of the pulses less that of the drive, from the slope of their phase, and its u
            from the scatter about that.  A locked top swings about the drive within some seconds, which a short record
            shows as a drift.
        excursion_turns: highest less lowest phase, of means over some tenths of a second.
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
    excursion_turns: float

    @property
    def locked(self) -> bool:
        """Whether the pulses follow the drive: not by chance, and with a phase that stays within one turn."""
        return self.p_random < LOCKED_P and self.excursion_turns < _LOCKED_TURNS


def coherence(pulse_times: Array, drive: Array, dt: float, drive_frequency: float, start: float = 0.0) -> Coherence:
    """Compute the coherence of pulses with a drive that was recorded at the same time.

    Args:
        pulse_times: shape (n,), increasing [s].
        drive: the drive's voltage, evenly sampled, NaN where one is missing, shape (m,); its first harmonic counts.
        dt: from one sample to the next [s].
        drive_frequency: of the drive, to better than one period in the record [Hz].
        start: time of the first sample [s].

    Raises:
        TooFewReadings: fewer than five pulses, or too few samples of the drive.
    """
    if pulse_times.size < FEWEST_PULSES:
        raise TooFewReadings(seen=pulse_times.size, needed=FEWEST_PULSES)
    frequency, phase = first_harmonic(drive, dt, drive_frequency)
    turns = frequency * (pulse_times - start) + phase / (2 * np.pi)
    vectors = np.exp(2j * np.pi * turns)
    mean = complex(vectors.mean())
    drift, u_drift, excursion = _drift_and_excursion(pulse_times, turns)
    return Coherence(
        pulses=pulse_times.size,
        length=min(abs(mean), 1.0),
        phase_rad=float(np.angle(mean)),
        p_random=rayleigh_p(abs(mean), pulse_times.size),
        drift_hz=drift,
        u_drift_hz=u_drift,
        drive_hz=frequency,
        duration_s=float(pulse_times[-1] - pulse_times[0]),
        excursion_turns=excursion,
    )


def rayleigh_p(length: float, n: int) -> float:
    """Return the probability that n random phases have a mean vector of at least this length.

    Wilkie, Appl. Stat. 32, 311 (1983): good to three digits above p = 0.001 from n = 10 on.

    >>> round(rayleigh_p((2.919 / 10) ** 0.5, 10), 3)  # tabulated: 0.05
    0.05
    """
    resultant = n * min(length, 1.0)
    return min(1.0, math.exp(math.sqrt(1 + 4 * n + 4 * (n**2 - resultant**2)) - (1 + 2 * n)))


def first_harmonic(signal: Array, dt: float, near: float) -> tuple[float, float]:
    """Return frequency [Hz] and phase at the first sample [rad] of a periodic signal's first harmonic, a cosine.

    The record is cut into sixteen parts.  A least-squares cosine gives the phase of each, and the slope of these phases
    corrects the frequency.  A part with too few samples is left out.

    Args:
        signal: shape (n,), missing samples are NaN.
        dt: from one sample to the next [s].
        near: the frequency to better than one period in the record [Hz].

    Raises:
        TooFewReadings: fewer than two parts have a phase.
    """
    parts = np.array_split(np.arange(signal.size), 16 if near * dt * signal.size > 32 else 2)
    parts = [seen for part in parts if (seen := part[np.isfinite(signal[part])]).size >= _FEWEST_SAMPLES]
    if len(parts) < 2:
        raise TooFewReadings(seen=int(np.isfinite(signal).sum()), needed=2 * _FEWEST_SAMPLES)
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
    """Return when a beam is cut, shape (n,) [s]: the middle of each dip, between its flanks at half height.

    A dip in which samples are missing is left out.

    Args:
        signal: shape (m,) [V], NaN where a sample is missing.
        dt: between samples [s].
        start: time of the first [s].
    """
    missing = ~np.isfinite(signal)
    if missing.all():
        return np.empty(0)
    index = np.arange(signal.size)
    signal = -np.interp(index, index[~missing], signal[~missing])
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
    lost = np.concatenate([[0], np.cumsum(missing)])  # samples missing before each
    whole = [(a, b) for a, b in flanks if lost[math.ceil(b) + 1] == lost[math.floor(a)]]
    return np.array([start + dt * (a + b) / 2 for a, b in whole])


def _last_above(signal: Array, level: float, k: int) -> int:
    """Return the index of the last sample above a level, at or before k."""
    while k > 0 and signal[k] <= level:
        k -= 1
    return k


def _crossing(signal: Array, level: float, k: int) -> float:
    """Return where the signal crosses a level between samples k and k + 1, in samples."""
    rise = float(signal[k + 1] - signal[k])
    return k + (level - float(signal[k])) / rise if rise else float(k)


def _drift_and_excursion(times: Array, turns: Array) -> tuple[float, float, float]:
    """Return the drift of the phase and its u [Hz], and the highest less the lowest phase [turns].

    The phase is that of the mean vector in each window.  A doubled or missing pulse changes it little, while it would
    shift a phase that is counted from pulse to pulse.
    """
    span = float(np.ptp(times))
    windows = max(4, min(times.size // FEWEST_PULSES, math.ceil(span / _WINDOW_S)))
    number = np.minimum(((times - times[0]) / span * windows).astype(np.int64), windows - 1)
    vectors = np.exp(2j * np.pi * turns)
    sums = np.bincount(number, vectors.real) + 1j * np.bincount(number, vectors.imag)
    filled = np.bincount(number) > 0
    phase = np.unwrap(np.angle(sums[filled])) / (2 * np.pi)
    middle = (np.flatnonzero(filled) + 0.5) * span / windows
    off = middle - middle.mean()
    s_tt = float(np.sum(off**2))
    slope = float(np.sum(off * phase)) / s_tt
    left = phase - phase.mean() - slope * off
    u = math.sqrt(float(np.sum(left**2)) / max(phase.size - 2, 1) / s_tt)
    # pulses that are faster than the drive come earlier and earlier on it
    return -slope, u, float(np.ptp(phase))
