"""A long record of a magnetometer in windows: frequency against time, with the line followed as it slows."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from analysis.arrays import Array
from analysis.drag import EXPONENT
from analysis.errors import AnalysisError
from analysis.rotation.errors import NoLine
from analysis.rotation.folds import Evidence, evidence_of, images_between, weigh
from analysis.rotation.line import LineFit, fit_line
from analysis.rotation.record import FEWEST, Line, Record, deviation, rate_of, read_samples
from analysis.rotation.result import FieldSpin, Kind
from analysis.rotation.search import other_lines, refine
from analysis.rotation.spin import LEAST_GAIN, limits_near, result_of, strongest

#: Length of a window [s], unless given.  A free top at 30 Hz loses 1 Hz meanwhile, evenly to 1 %.
WINDOW_S = 10.0
#: Frequency [Hz] and slope [Hz/s] by which a line may differ from what the window before it lets expect.
_BY_HZ, _BY_SLOPE = 0.5, 0.06
#: Number of windows of a flight, evenly distributed, in which the folds are weighed.
_WEIGHED = 12
#: Length of the pieces in which a line that is seen to begin or to end keeps its phase, least length of what is left of
#: a window then, and what is cut off beside that moment, as a hand or the fall moves the field [s].
_PIECE_S, _SHORTEST_S, _MARGIN_S = 0.5, 3.0, 0.5
#: A line ends within the record if that is more probable by this factor [natural logarithm].
_CLEAR = 6.0
#: A step of the field from sample to sample is at most this multiple of their median: 3σ of noise.
_MOST_STEP = 4.5


@dataclass(frozen=True, eq=False)
class Flight:
    """A line that was followed without a gap.

    Attributes:
        first, last: its windows, the last one not included.
        start, end: between which it is seen [s].
        u_end: standard uncertainty of the end [s].
        began, ended: whether it is absent before, and after, though the record goes on.
    """

    first: int
    last: int
    start: float
    end: float
    u_end: float
    began: bool
    ended: bool


@dataclass(frozen=True, eq=False)
class FieldTrack:
    """Frequency against time; arrays of shape (m,), one value for each window with a line.

    No two windows share samples, so that their errors are independent.

    Attributes:
        time: mean of the times in the window [s].
        frequency: [Hz].
        u: its standard uncertainty [Hz].
        chirp: its slope [Hz/s].
        spins: what was found in each window.
        flights: the tops that were up one after the other.
        empty: (start, end) of times without a line [s].
    """

    time: Array
    frequency: Array
    u: Array
    chirp: Array
    spins: tuple[FieldSpin, ...]
    flights: tuple[Flight, ...]
    empty: tuple[tuple[float, float], ...]

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Kinds of warnings of all windows, each once."""
        return tuple(dict.fromkeys(kind for spin in self.spins for kind in spin.kinds))


@dataclass(frozen=True, eq=False)
class _Window:
    """A window in which the line was found.

    Attributes:
        cut: its samples, from and to.
        follows: whether the line is that of the window before.
    """

    cut: slice
    record: Record
    fit: LineFit
    follows: bool


def track_of_field(times: ArrayLike, field: ArrayLike, *, near: float | None = None) -> FieldTrack:
    """Follow the frequency through a long record.

    Args:
        times: shape (n,), not decreasing [s].
        field: shape (n, k) or (n,), k = 1 to 3 axes [T].
        near: about where the spin is at first, to 10 % [Hz].

    Raises:
        TooFewReadings, ShapesDiffer, NotFinite, TimesNotIncreasing: see `analysis.errors`.
        NoLine: nothing stands out of the noise in any window.
    """
    t, b = read_samples(times, field)
    low, high = limits_near(near)
    edges = np.linspace(t[0], t[-1], max(round(float(t[-1] - t[0]) / WINDOW_S), 1) + 1)
    cuts = np.searchsorted(t, edges)
    cuts[-1] = t.size
    found: list[_Window] = []
    for first, last in pairwise(cuts.tolist()):
        before = found[-1] if found and found[-1].cut.stop == first else None
        one = _follow(t, b, slice(first, last), before) if before else None
        one = one or _find(t, b, slice(first, last), low, high)
        if one:
            found.append(one)
    if not found:
        raise NoLine(lowest=low, highest=high, duration=float(t[-1] - t[0]), gain=0.0)
    starts = [k for k, one in enumerate(found) if not one.follows] + [len(found)]
    rate = rate_of(t)
    spins: list[FieldSpin] = []
    flights: list[Flight] = []
    for k, end in pairwise(starts):
        earliest = int(np.searchsorted(t, flights[-1].end)) if flights else 0
        windows, flight = _trim(t, b, found[k:end], len(spins), earliest)
        if windows:
            spins += _unfold(windows, rate, low, high)
            flights.append(flight)
    if not spins:
        raise NoLine(lowest=low, highest=high, duration=float(t[-1] - t[0]), gain=0.0)
    rows = [(one.reference_time, one.frequency, one.u_frequency, one.chirp) for one in spins]
    time, frequency, u, chirp = np.array(rows, dtype=np.float64).T
    borders = [float(t[0]), *(x for one in flights for x in (one.start, one.end)), float(t[-1])]
    gaps = zip(borders[::2], borders[1::2], strict=True)
    empty = tuple((start, end) for start, end in gaps if end - start > _SHORTEST_S)
    return FieldTrack(time, frequency, u, chirp, tuple(spins), tuple(flights), empty)


def _find(t: Array, b: Array, cut: slice, low: float, high: float) -> _Window | None:
    """Return the strongest line in a window; None without one."""
    try:
        record = Record(*read_samples(t[cut], b[cut]))
        return _Window(cut, record, strongest(record, low, high), follows=False)
    except AnalysisError:
        return None


def _follow(t: Array, b: Array, cut: slice, before: _Window) -> _Window | None:
    """Return the line of the window before in the next one; None where it is not seen."""
    if cut.stop - cut.start < FEWEST:
        return None
    fit = before.fit
    line = Line(fit.frequency, fit.chirp)
    rest = before.record.rest(fit.columns @ fit.amplitudes)
    later = float(t[cut].mean()) - before.record.middle
    others = other_lines(before.record, rest, line, _BY_HZ + abs(line.chirp) * later)
    record = Record(t[cut], b[cut], [one.at(later) for one in others])
    bend = EXPONENT * line.chirp**2 / line.frequency if line.chirp < 0 else 0.0
    expected = Line(line.frequency + later * (line.chirp + later * bend / 2), line.chirp + later * bend)
    left = record.rest()
    start = refine(record, left / np.maximum(deviation(left), 1e-12), expected, _BY_HZ, _BY_SLOPE)
    found = fit_line(record, start.frequency, start.chirp)
    if found.gain < LEAST_GAIN or abs(found.frequency - expected.frequency) > 2 * _BY_HZ:
        return None
    return _Window(cut, record, found, follows=True)


# --- where the line begins and ends ---


def _trim(t: Array, b: Array, windows: list[_Window], first: int, earliest: int) -> tuple[list[_Window], Flight]:
    """Return the windows of a flight as far as the line lasts, and the flight; the first window's number is given.

    The flight before has the samples up to `earliest`, also those of a window in which its end hides the line.
    The likelihood of a line over that of noise is multiplied up over short pieces: it is greatest at the end.
    """
    inner = windows[len(windows) // 2]  # a window that has the line from end to end, if any
    from_, to, end, u_end = _extent(t, b, windows, inner, earliest)
    began, ended = from_ > 0, to < t.size
    start, end = float(t[from_]), end if ended else float(t[-1])
    kept = []
    lowest = int(np.searchsorted(t, start + _MARGIN_S)) if began else 0
    highest = int(np.searchsorted(t, end - _MARGIN_S)) if ended else t.size
    cuts = [one.cut for one in windows]
    if cuts[-1].stop < highest:
        cuts.append(slice(cuts[-1].stop, highest))
    if cuts[0].start > lowest:
        cuts.insert(0, slice(lowest, cuts[0].start))
    for cut in cuts:
        part = slice(max(cut.start, lowest), min(cut.stop, highest))
        whole = next((one for one in windows if one.cut == part), None)
        if whole:
            kept.append(whole)
        elif part.stop - part.start >= FEWEST and t[part.stop - 1] - t[part.start] >= _SHORTEST_S:
            near = min(windows, key=lambda one: abs(one.record.middle - float(t[part].mean())))
            later = float(t[part].mean()) - near.record.middle
            record = Record(t[part], b[part], near.record.others_at(later))
            fit = fit_line(record, near.fit.frequency + near.fit.chirp * later, near.fit.chirp)
            if fit.gain > LEAST_GAIN / 2:  # where it lies is known
                kept.append(_Window(part, record, fit, follows=True))
    return kept, Flight(first, first + len(kept), start, end, u_end, began, ended)


def _extent(t: Array, b: Array, windows: list[_Window], inner: _Window, earliest: int) -> tuple[int, int, float, float]:
    """Return the samples from and to which a line is seen, and the time of its end with its u [s].

    They are at most a window before and behind those of a flight.
    """
    from scipy.special import i0e

    first, last = windows[0], windows[-1]
    size = inner.cut.stop - inner.cut.start
    expected = np.sum(inner.fit.amplitudes**2, axis=0) * inner.record.unit**2
    noise = inner.fit.variance * inner.record.unit**2
    length = max(round(_PIECE_S * inner.record.rate), 1)

    def likelihoods(one: _Window, cut: slice, way: int) -> Array:
        """Return logarithms of the likelihoods that the line ends, in a way, before each sample and behind the last."""
        late = t[cut] - one.record.middle
        wave = np.exp(-2j * np.pi * (one.fit.frequency * late + 0.5 * one.fit.chirp * late**2))
        # of differences of neighbours, in which the jolt of the fall is one that is too large
        steps = np.diff(b[cut], axis=0, prepend=b[cut][:1])
        most = _MOST_STEP * np.median(np.abs(steps), axis=0)
        steps = np.clip(steps, -most, most) / abs(1 - np.exp(-2j * np.pi * one.fit.frequency / one.record.rate))
        # mains stay: a piece resolves them, and at a fold of theirs they would take the line
        sums = np.concatenate([np.zeros((1, b.shape[1])), np.cumsum((steps * wave[:, None])[::way], axis=0)])
        piece, count = np.divmod(np.arange(late.size), length)
        count += 1
        power = np.abs(sums[1:] - sums[piece * length]) ** 2
        # of the piece's power so far, whatever its phase: the line's is χ² about its own, that of noise about none
        line = count[:, None] * expected / (2 * noise)
        argument = np.sqrt(line * 2 * power / count[:, None] / noise)
        ratio = np.sum(np.log(i0e(argument)) + argument - line / 2, axis=1)
        before = np.append(0.0, np.cumsum(ratio[length - 1 :: length]))
        return np.append(0.0, before[piece] + ratio)

    stop = min(last.cut.stop + size, t.size)
    sums = likelihoods(last, slice(last.cut.start, stop), 1)
    times = t[np.minimum(np.arange(last.cut.start, stop + 1), t.size - 1)]
    chance = np.exp(sums - sums.max())
    chance /= chance.sum()
    end = float(chance @ times)
    u_end = math.sqrt(float(chance @ (times - end) ** 2) + (times[1] - times[0]) ** 2 / 12)
    cut = slice(min(max(first.cut.start - size, earliest), first.cut.stop - 1), first.cut.stop)
    from_ = cut.stop - _edge(likelihoods(first, cut, -1))
    return from_, max(last.cut.start + _edge(sums), from_ + 1), end, u_end


def _edge(sums: Array) -> int:
    """Return the number of the sample before which a line ends, which is behind the last one but for good reason."""
    best = int(sums.argmax())
    return best if sums[best] - sums[-1] > _CLEAR else sums.size - 1


# --- folds ---


def _unfold(windows: list[_Window], rate: float, low: float, high: float) -> list[FieldSpin]:
    """Return the spins of a flight at the most probable of its folds."""
    frequency = np.array([one.fit.frequency for one in windows])
    images = images_between((float(frequency.min()), float(frequency.max())), rate, low, high)
    chosen = np.unique(np.linspace(0, len(windows) - 1, min(_WEIGHED, len(windows))).round().astype(int)).tolist()
    seen: dict[int, Evidence] = {k: evidence_of(windows[k].record, windows[k].fit, images, rate) for k in chosen}
    slope, u = _slope(windows)
    weighed = weigh(list(seen.values()), [one.sign for one in images], slope, u)
    best = weighed.order[0]
    spins = []
    for k, one in enumerate(windows):
        if k not in seen:
            fits = [one.fit] * len(images)
            if best:
                image = images[best]
                fits[best] = fit_line(one.record, image.of(one.fit.frequency, rate), image.sign * one.fit.chirp)
            seen[k] = Evidence(tuple(fits), np.zeros(len(images)), np.zeros(len(images)), -math.inf)
        spins.append(result_of(one.record, seen[k], weighed))
    return spins


def _slope(windows: list[_Window]) -> tuple[float, float]:
    """Return the slope of a flight and its standard uncertainty, from its windows' frequencies and slopes [Hz/s]."""
    rows = [(one.record.middle, one.fit.frequency, one.fit.chirp, *np.diagonal(one.fit.covariance)) for one in windows]
    time, frequency, chirp, variance, of_chirp = np.array(rows, dtype=np.float64).T
    late = time - time.mean()
    weight = np.array([1 / np.sum(1 / of_chirp), np.inf])
    values = [float(np.average(chirp, weights=1 / of_chirp)), 0.0]
    if len(windows) > 1:
        square = float(late @ late)
        values[1] = float(late @ frequency) / square
        weight[1] = float(late**2 @ variance) / square**2
    both = 1 / float(np.sum(1 / weight))
    return both * float(np.sum(np.array(values) / weight)), math.sqrt(both)
