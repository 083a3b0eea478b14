"""Search all frequencies and slopes of a top for those of greatest likelihood: for weak and difficult traces.

Noise that is white makes the likelihood of a periodic signal of unknown shape a sum of powers over its harmonics (Wise,
Caprio & Parks, IEEE Trans. Acoust. Speech Signal Process. 24, 418 (1976)). First it is summed over pieces of the record
without their phases, which forgives a slope that is not known yet; then with them, at ever more harmonics.
"""

import numpy as np

from analysis.arrays import Array
from analysis.pulses.regression import Fit, Scatter

#: What is searched: frequency [Hz] and slope [Hz/s].
LOWEST, HIGHEST, STEEPEST = 5.0, 200.0, 0.6
#: Length of a piece [s], and harmonics that are summed over.
PIECE, HARMONICS = 1.0, 16
#: A harmonic counts no more than this many times the noise: a line that is no pulse train has but one.
CAP = 30.0
#: Pieces and harmonics of the sum with phases.
SHORT, COHERENT = 0.25, (1, 2, 4, 8)


def search(bins: Array, rate: float, middles: Array | None = None) -> Fit | None:
    """Return the phase of greatest likelihood, about right; None: the record is shorter than four of the slowest turns.

    bins: shape (n,), without what is no pulse; rate: bins per second; middles: times of the bins [s], where they are
    uneven: the first search takes them for even.
    """
    if middles is not None:
        rate = (bins.size - 1) / float(middles[-1] - middles[0])
    duration = bins.size / rate
    lowest = max(LOWEST, 4 / duration)
    highest = min(HIGHEST, rate / 8)
    if lowest >= highest:
        return None
    ordered = np.sort(bins[:: max(bins.size // 8192, 1)])
    middle = float(ordered[ordered.size // 2])
    low, high = (middle + 2 * (float(ordered[round(p * (ordered.size - 1))]) - middle) for p in (0.005, 0.995))
    y = np.clip(bins, low, high) - middle
    frequency, slope = _search_pieces(y, rate, lowest, highest)
    time = (np.arange(y.size, dtype=np.float64) + 0.5) / rate if middles is None else middles
    time = time - 0.5 * duration
    frequency, slope = _refine_with_phases(y, rate, time, frequency, slope)
    half = 0.5 * duration
    return Fit(
        coefficients=np.array([0.0, frequency * half, 0.5 * slope * half**2, 0.0]),
        covariance=np.eye(4),
        centre=half,
        half=half,
        residuals=np.zeros(1),
        scatter=Scatter(1.0, 1.0, 1.0, 1.0),
        unit_covariance=np.eye(3),
    )


def _search_pieces(y: Array, rate: float, lowest: float, highest: float) -> tuple[float, float]:
    """Return frequency at the middle and slope from the powers of pieces."""
    count = max(int(y.size / rate / PIECE), 1)
    size = y.size // count
    pieces = y[: count * size].reshape(count, size)
    pieces = pieces - pieces.mean(axis=1, keepdims=True)
    padded = int(2 ** np.ceil(np.log2(4 * size)))
    power = np.abs(np.fft.rfft(pieces, padded)) ** 2
    top = int(min(highest * HARMONICS, rate / 2) * padded / rate) - 2
    power = np.minimum(power / (np.median(power[:, :top], axis=1, keepdims=True) + 1e-300), CAP)
    step = rate / size / (2 * HARMONICS)
    trial = np.arange(lowest, highest, step)
    score = np.zeros((count, trial.size))
    for h in range(1, HARMONICS + 1):
        place = np.rint(trial * (h * padded / rate)).astype(np.intp)
        known = place <= top
        score[:, known] += (power[:, place[known]] - 1.44) / np.sqrt(h)  # 1.44: mean over median of noise
    middle = (np.arange(count) + 0.5) * size / rate - 0.5 * count * size / rate
    slopes = np.zeros(1)
    if count > 1:
        steepest = min(STEEPEST, 0.5 * (highest - lowest) / (count * size / rate))  # stays within the trials
        slopes = np.arange(-steepest, steepest, 2 * step / (count * size / rate))
    best = (-np.inf, 0.0, 0.0)
    for slope in slopes:
        total = np.zeros(trial.size)
        for row, shift in zip(score, np.rint(slope * middle / step).astype(np.intp), strict=True):
            if shift >= 0:
                total[: trial.size - shift] += row[shift:]
            else:
                total[-shift:] += row[:shift]
        at = int(np.argmax(total))
        if total[at] > best[0]:
            best = float(total[at]), float(trial[at]), float(slope)
    return best[1], best[2]


def _refine_with_phases(y: Array, rate: float, time: Array, frequency: float, slope: float) -> tuple[float, float]:
    """Return frequency and slope, both made exact with the phases of the pieces."""
    duration = y.size / rate
    size = max(int(SHORT * rate), 1)
    starts = np.arange(0, y.size - size // 2, size)
    turn = np.exp(-2j * np.pi * (frequency * time + 0.5 * slope * time**2))
    wave = y.astype(complex)
    spectra = []
    for _ in range(COHERENT[-1]):
        wave = wave * turn
        spectra.append(np.add.reduceat(wave, starts))
    centre = np.add.reduceat(time, starts) / np.diff(np.append(starts, y.size))
    df = dc = 0.0
    for most in COHERENT:
        reach = np.arange(-5, 6)
        f = df + reach * 0.25 / duration / most
        c = dc + reach * (1.0 / duration**2 / most) if centre.size > 3 else np.zeros(1)
        power = np.zeros((f.size, c.size))
        for h in range(1, most + 1):
            by_f = np.exp(-2j * np.pi * h * np.outer(f, centre)) * spectra[h - 1]
            by_c = np.exp(-1j * np.pi * h * np.outer(c, centre**2))
            power += np.abs(by_f @ by_c.T) ** 2
        i, j = np.unravel_index(int(np.argmax(power)), power.shape)
        df, dc = float(f[i]), float(c[j])
    return frequency + df, slope + dc
