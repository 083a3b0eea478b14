"""Number the turns of pulses, some of which may be missing, doubled or wrong.

Clean lists are numbered from their intervals. Where that does not fit, the period of each short window is the one that
most pairs of pulses share, its phase is where most pulses lie, and windows are joined by counting turns between them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.pulses.regression import median

Turns = NDArray[np.int64]

#: A pulse farther from its turn than this [turns] belongs to none, while turns are being numbered.
TOLERANCE = 0.12
#: Windows are judged, and the first fit is made, by the pulses within this [turns].
CORE = 0.03
#: One frequency and slope is good enough if this share of the pulses is near their turns.
NEARLY = 0.9
#: Pulses to a window, and followers that a pulse is paired with.
WINDOW, FOLLOWERS = 32, 8
#: Width of a class of periods, as a part of the period.
CLASS = 0.03
#: Greatest distance of a pair in mean intervals: classes of longer ones hold several multiples of a period.
LONGEST = 5.0
#: A multiple of a window's frequency is taken only where the pulses lie that much better at their place.
SHARP = 0.7
#: No top floats below this frequency [Hz].  There more multiples are tried, and nearly all pulses have to lie at one
#: place: pulses at 2 and 3 turns in turn have a sharpness of 0.81 at two and three fifths of the spin, at 3 and 5 turns
#: 0.92 at three eighths.
SLOWEST, NEARLY_ALL = 15.0, 0.95
MULTIPLES, MORE_MULTIPLES = (1, 2, 3), (4, 5, 6, 7, 8)
#: The shortest period that this share of the largest count of pairs supports is the period, not its multiples.
SUPPORT = 0.6


@dataclass(frozen=True)
class Numbering:
    """Which turn each pulse belongs to.

    turns: number of the nearest turn, shape (n,); belongs: whether the pulse is one of that turn, shape (n,);
    tolerance: a pulse farther away than this never is [turns].
    """

    turns: Turns
    belongs: NDArray[np.bool_]
    tolerance: float = 0.25


def number_turns(times: Array) -> Numbering:
    """Return turn numbers of pulse times, shape (n,), increasing [s], n above 2."""
    return _from_intervals(times) or _from_windows(times)


def _from_intervals(times: Array) -> Numbering | None:
    """Return numbers of a list in which nearly each interval is one turn, or several; None where that does not fit."""
    intervals = np.diff(times)
    period = median(intervals)
    if not period > 0:
        return None
    single = np.abs(intervals / period - 1) < 0.2
    if single.all():  # pulses that scatter about their places, too: none is missing, none is too many
        return Numbering(np.arange(times.size), np.ones(times.size, dtype=bool))
    if np.count_nonzero(single) < 0.7 * intervals.size:
        return None
    middles = 0.5 * (times[1:] + times[:-1])
    frequency, slope, origin = _line(middles[single], 1 / intervals[single])
    since = times - origin
    steps = np.diff(frequency * since + 0.5 * slope * since**2)
    whole = np.rint(steps)
    off = np.abs(steps - whole)
    if off.max() < TOLERANCE and whole.min() >= 1:
        return Numbering(np.concatenate([[0], np.cumsum(whole)]).astype(np.int64), np.ones(times.size, dtype=bool))
    phase = frequency * since + 0.5 * slope * since**2
    phase -= _densest_phase(phase[None, :])[0]
    turns = np.rint(phase)
    belongs = np.abs(phase - turns) < TOLERANCE
    return Numbering(turns.astype(np.int64), belongs) if np.count_nonzero(belongs) > NEARLY * times.size else None


def _line(x: Array, y: Array) -> tuple[float, float, float]:
    """Return the line's value at the mean of x, its slope, and this mean, without outliers."""
    value, slope, origin = median(y), 0.0, float(x.mean())
    keep = np.abs(y / value - 1) < 0.25
    for _ in range(3):
        origin = float(x[keep].mean())
        d = x[keep] - origin
        value = float(y[keep].mean())
        slope = float(d @ (y[keep] - value) / (d @ d)) if x[keep].size > 2 else 0.0
        rest = np.abs(y - value - slope * (x - origin))
        limit = 4 * 1.4826 * median(rest) + 1e-9 * abs(value)
        new = rest <= limit
        if np.array_equal(new, keep) or np.count_nonzero(new) < 3:
            break
        keep = new
    return value, slope, origin


@dataclass(frozen=True)
class Windows:
    """Windows of a list of times: first and last pulse, centre [s], frequency [Hz], phase at the centre [turns].

    All of shape (m,). sharpness: length of the mean phase vector, 1 where each pulse lies at its place.
    """

    first: Turns
    last: Turns
    centre: Array
    frequency: Array
    phase: Array
    sharpness: Array


def windows_of(times: Array) -> Windows:
    """Return frequency and phase of overlapping windows of pulses."""
    n = times.size
    size = min(WINDOW, n)
    starts = np.arange(0, max(n - size, 0) + 1, max(size // 2, 1))
    if starts[-1] + size < n:
        starts = np.append(starts, n - size)
    index = starts[:, None] + np.arange(size)
    inside = times[index]
    centre = 0.5 * (inside[:, 0] + inside[:, -1])
    since = inside - centre[:, None]
    frequency = 1 / _periods(since)
    slow = _smooth(frequency) < SLOWEST
    multiples = MULTIPLES + MORE_MULTIPLES if slow.any() else MULTIPLES
    trials = [_refine(since, frequency * k) for k in multiples]
    sharpness = np.array([_smooth(found[2]) for found in trials])  # neighbours decide together
    # the lowest multiple at which most pulses lie at one place
    enough = np.where(slow, NEARLY_ALL, SHARP) * sharpness.max(axis=0)
    chosen = np.argmax(sharpness >= enough, axis=0)
    frequency, phase, sharp = (np.choose(chosen, [found[i] for found in trials]) for i in range(3))
    return Windows(starts, starts + size - 1, centre, frequency, phase, sharp)


def _smooth(values: Array) -> Array:
    """Return each row with its two neighbours on either side, weighted 1 2 3 2 1."""
    padded = np.concatenate([values[:1], values[:1], values, values[-1:], values[-1:]])
    n = len(values)
    return np.asarray(sum(w * padded[i : i + n] for i, w in enumerate((1, 2, 3, 2, 1))) / 9)


def _periods(since: Array) -> Array:
    """Return the period that most pairs of each window share, shape (m,)."""
    count, size = since.shape
    pairs = [since[:, lag:] - since[:, :-lag] for lag in range(1, min(FOLLOWERS, size - 1) + 1)]
    differences = np.concatenate(pairs, axis=1)
    mean = (since[:, -1] - since[:, 0]) / (size - 1)
    longest = LONGEST * mean.max()
    shortest = max(np.quantile(differences, 0.01), longest * 1e-5)
    classes = int(np.ceil(np.log(longest / shortest) / CLASS)) + 3
    place = np.log(np.maximum(differences, shortest) / shortest) / CLASS
    whole = np.minimum(place, classes - 2).astype(np.int64)
    share = np.clip(place - whole, 0, 1)
    flat = whole + np.arange(count)[:, None] * classes
    valid = (differences >= shortest) & (differences <= LONGEST * mean[:, None])
    lower = np.bincount(flat.ravel(), ((1 - share) * valid).ravel(), count * classes)
    upper = np.bincount(flat.ravel() + 1, (share * valid).ravel(), count * classes)
    votes = np.asarray((lower + upper).reshape(count, classes), dtype=np.float64)
    votes[:, 1:-1] = votes[:, :-2] + votes[:, 1:-1] + votes[:, 2:]
    votes = _smooth(votes)  # neighbouring windows have nearly the same period
    enough = votes >= SUPPORT * votes.max(axis=1, keepdims=True)
    first = np.argmax(enough, axis=1)
    best = np.empty(count)
    for i, place_ in enumerate(first):  # the top of the first peak
        end = place_
        while end + 1 < classes and votes[i, end + 1] > votes[i, end]:
            end += 1
        near = slice(max(end - 1, 0), end + 2)
        weight = votes[i, near]
        best[i] = shortest * np.exp(
            CLASS * float(weight @ np.arange(near.start, near.start + weight.size)) / weight.sum()
        )
    return best


def _refine(since: Array, frequency: Array) -> tuple[Array, Array, Array]:
    """Return frequency, phase at the centre and sharpness, by sums of the pulses' phase vectors and their squares."""
    half = CLASS * 1.5
    for step in (half, half / 8):
        grid = np.linspace(-step, step, 33 if step == half else 9)
        trial = frequency[:, None] * (1 + grid)
        vector = np.exp(2j * np.pi * since[:, None, :] * trial[:, :, None])
        power = np.abs(vector.sum(-1)) ** 2 + np.abs((vector**2).sum(-1)) ** 2
        frequency = np.take_along_axis(trial, np.argmax(power, axis=1)[:, None], axis=1)[:, 0]
    phases = since * frequency[:, None]
    mean = np.exp(2j * np.pi * phases).mean(axis=1)
    phase = -_densest_phase(phases)
    return frequency, phase, np.abs(mean)


def _densest_phase(phases: Array) -> Array:
    """Return where most phases [turns] lie, for each row."""
    bins = 32
    fraction = phases - np.floor(phases)
    rows = np.arange(phases.shape[0])[:, None] * bins
    counts = np.bincount((rows + (fraction * bins).astype(np.int64) % bins).ravel(), minlength=bins * len(phases))
    counts = counts.reshape(-1, bins)
    smooth = counts + np.roll(counts, 1, axis=1) + np.roll(counts, -1, axis=1)
    peak = (np.argmax(smooth, axis=1) + 0.5) / bins
    for _ in range(2):
        away = fraction - peak[:, None]
        away -= np.rint(away)
        near = np.abs(away) < 0.06
        peak = peak + (away * near).sum(axis=1) / np.maximum(near.sum(axis=1), 1)
    return np.asarray(peak)


def _from_windows(times: Array) -> Numbering:
    """Return the better of two: windows joined one by one, or one frequency and slope for all of them."""
    found = windows_of(times)
    joined, common = _join_windows(times, found), _common_line(times, found)
    # a joined phase can bend to whatever lies near: it has to be much better
    return joined if np.count_nonzero(joined.belongs) > 1.2 * np.count_nonzero(common.belongs) else common


def _common_line(times: Array, found: Windows) -> Numbering:
    """Return numbers by the frequency and the slope about the windows' at which the pulses' phases agree best."""
    if found.centre.size >= 4:
        frequency, slope, origin = _line(found.centre, found.frequency)
    else:
        frequency, slope, origin = median(found.frequency), 0.0, float(found.centre.mean())
    since = times - origin
    span = float(times[-1] - times[0])
    for harmonic in (1, 2, 4):  # each twice as sharp as the one before
        f_step, c_step = 0.25 / span / harmonic, 1.0 / span**2 / harmonic
        f_count, c_count = (8, 6) if harmonic == 1 else (3, 3)
        f = f_step * np.arange(-f_count, f_count + 1)
        c = c_step * np.arange(-c_count, c_count + 1) if found.centre.size >= 2 else np.zeros(1)
        base = np.exp(2j * np.pi * harmonic * (frequency * since + 0.5 * slope * since**2))
        by_f = np.exp(2j * np.pi * harmonic * np.outer(f, since)) * base
        by_c = np.exp(1j * np.pi * harmonic * np.outer(c, since**2))
        power = np.abs(by_f @ by_c.T)
        i, j = np.unravel_index(np.argmax(power), power.shape)
        frequency, slope = frequency + float(f[i]), slope + float(c[j])
    phase = frequency * since + 0.5 * slope * since**2
    phase = phase - _densest_phase(phase[None, :])[0]
    turns = np.rint(phase)
    return Numbering(turns.astype(np.int64), np.abs(phase - turns) < CORE, 2 * CORE)


def _join_windows(times: Array, found: Windows) -> Numbering:
    middle = (
        np.median(np.lib.stride_tricks.sliding_window_view(np.pad(found.frequency, 2, mode="reflect"), 5), axis=1)
        if found.centre.size > 4
        else found.frequency
    )
    sound = np.abs(found.frequency / middle - 1) < 0.1
    found = Windows(*(getattr(found, name)[sound] for name in Windows.__dataclass_fields__))
    base, phase = 0.0, 0.0
    knots, counts = [], []
    for i in range(found.centre.size):
        if i:
            mean = 0.5 * (found.frequency[i] + found.frequency[i - 1])
            ahead = phase + mean * (found.centre[i] - found.centre[i - 1])
            base = float(found.phase[i] - np.rint(found.phase[i] - ahead))
        else:
            base = float(found.phase[0])
        phase = base
        knots.append(found.centre[i])
        counts.append(base)
    number = phase_between(times, np.array(knots), np.array(counts), found.frequency)
    turns = np.rint(number)
    return Numbering(turns.astype(np.int64), np.abs(number - turns) < CORE, 2 * CORE)


def phase_between(times: Array, knots: Array, counts: Array, frequency: Array) -> Array:
    """Return phase [turns] at times from phases and frequencies at knots: cubic between them, straight beyond."""
    if knots.size == 1:
        return np.asarray(counts[0] + frequency[0] * (times - knots[0]))
    i = np.clip(np.searchsorted(knots, times) - 1, 0, knots.size - 2)
    h = knots[i + 1] - knots[i]
    s = (times - knots[i]) / h
    inside = (
        counts[i] * (1 + 2 * s) * (1 - s) ** 2
        + counts[i + 1] * s**2 * (3 - 2 * s)
        + h * s * (1 - s) * (frequency[i] * (1 - s) - frequency[i + 1] * s)
    )
    before = counts[0] + frequency[0] * (times - knots[0])
    after = counts[-1] + frequency[-1] * (times - knots[-1])
    return np.asarray(np.where(s < 0, before, np.where(s > 1, after, inside)))
