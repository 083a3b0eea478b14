"""Clean a trace: remove hum of the mains and a wandering baseline, and find times without a signal."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.pulses.errors import TooFewPulses
from analysis.pulses.regression import Fit, median
from analysis.pulses.result import Finding
from analysis.pulses.search import WIDE, find_events, noise_of, shorten
from analysis.pulses.times import check_times, fit_train

Mask = NDArray[np.bool_]
#: Frequencies [Hz] and amplitudes.
Lines = tuple[tuple[float, float], ...]

#: Mains and its multiples [Hz], and how far from nominal a grid strays [Hz].
MAINS, STRAYS = (50.0, 60.0), 0.25
#: The search for lines ends at this frequency [Hz], and needs a record of this length [s].
HIGHEST, SHORTEST = 210.0, 1.0
#: The spectrum of a trace without noise counts as this part of the trace's range at least.
FAINTEST = 3e-4
#: Least power of a line of the mains over that of all within 1.5 Hz beside it.
NARROW = 2.0
#: Least height of such a line over that of its next multiples; those of a pulse train are nearly equal.
SINGLE = 2.5
#: Greatest height of a harmonic of the pulses over that of the harmonics beside it; hum is higher.
OWN = 1.5
#: Least height of hum in a third of the record over that in all of it.
STAYS = 0.6
#: Places of a turn at which the mean over turns is taken.
PROFILE = 128
#: Length of the pieces that hum is fitted to [s]; they overlap by half.
PIECE = 1.0
#: The baseline is the median of blocks of this length [s]; it wanders if it leaves this many standard errors.
BLOCK, WANDERS = 0.1, 6.0
#: A detector whose signal stays the same for longer is dead [s].
DEAD = 0.3


@dataclass(frozen=True)
class Clean:
    """samples and the shortened bins without hum and baseline; bad: samples that do not count, None: all do.

    lines: of hum, frequency [Hz] and amplitude.
    """

    samples: Array
    bins: Array
    bad: Mask | None
    notes: tuple[Finding, ...]
    lines: Lines


def clean(samples: Array, rate: float, bins: Array, bad: Mask | None, times: Array | None = None) -> Clean:
    """Remove hum and a wandering baseline; a trace without them is returned unchanged.

    samples: shape (n,); rate: of them [1/s]; bins: means of n // len(bins) samples; bad: which samples are no numbers;
    times: of the samples since the first one [s], where they are uneven.
    """
    factor = samples.size // bins.size
    bin_rate = rate / factor
    notes: list[Finding] = []
    counted = np.ones(bins.size, dtype=bool)
    whole = None
    if bad is not None:
        share = shorten(bad.astype(np.float64), factor)
        whole = share == 0
        counted = whole  # the others hold a value that was put in
        notes.append(Finding("not-finite", values=(int(np.count_nonzero(bad)),)))
    dead = _dead_bins(bins, bin_rate, whole)
    if dead.any():
        notes.append(Finding("gap", values=(np.count_nonzero(dead) / bin_rate,)))
        counted = counted & ~dead
        long = np.zeros(samples.size, dtype=bool)
        long[: bins.size * factor] = np.repeat(dead, factor)
        bad = long if bad is None else bad | long
    if np.count_nonzero(counted) < 64:
        return Clean(samples, bins, bad, tuple(notes), ())
    if not counted.all():
        bins = np.interp(np.arange(bins.size), np.flatnonzero(counted), bins[counted])
    lines = _without_pulse_lines(mains_lines(bins, bin_rate), bins, bin_rate)
    if lines:
        notes.append(_hum(lines))
        samples, bins = _without_hum(samples, rate, bins, counted, [frequency for frequency, _ in lines], times=times)
    steps = _baseline(bins, bin_rate, counted)
    if steps is not None:
        times, values = steps
        notes.append(Finding("wander", values=(float(np.ptp(values)),)))
        samples = samples - np.interp(np.arange(samples.size) / rate, times, values)
        bins = bins - np.interp((np.arange(bins.size) + 0.5) / bin_rate, times, values)
    if not counted.all():
        bins = np.where(counted, bins, np.median(bins[counted]))
    return Clean(samples, bins, bad, tuple(notes), lines)


def _hum(lines: Lines, of: str = "") -> Finding:
    return Finding("hum", of, tuple(value for line in lines for value in line))


def name_lines(notes: Iterable[Finding], lines: Lines, fit: Fit, samples: Array, rate: float) -> tuple[Finding, ...]:
    """Return notes in which the lines of hum that may be harmonics of the pulses stand by themselves.

    A line beside the spin that is larger than all that is left may be that of the pulses.

    fit: the phase of the pulses, which is not known before hum is removed; samples: what is left; rate: of them [1/s].
    """
    duration, left = samples.size / rate, math.sqrt(2) * float(np.nanstd(samples))
    harmonics = {line: _harmonic(line[0], fit, duration) for line in lines}
    kinds = {line: "spin" if k == 1 and line[1] > left else "harmonic" * bool(k) for line, k in harmonics.items()}
    named = [
        _hum(some, kind)
        for kind in ("", "harmonic", "spin")
        if (some := tuple(line for line in lines if kinds[line] == kind))
    ]
    return tuple(one for note in notes for one in (named if note.name == "hum" else [note]))


def without_rest_of_hum(
    samples: Array,
    rate: float,
    bins: Array,
    fit: Fit,
    lines: Lines,
    *,
    times: Array,
    counted: Mask,
    clock: Array | None,
) -> tuple[Array, Array]:
    """Return samples and bins less the hum that `clean` left in them, as pulses leak into the pieces it is fitted to.

    fit: the phase of the pulses; times: of the bins [s]; counted: which of them have all their samples; clock: times of
    the samples, where they are uneven; the others as of `clean`.
    """
    cell = _cells(fit, times)
    turn = _mean_turn(bins, cell)[cell]
    samples, rest = _without_hum(samples, rate, bins - turn, counted, [place for place, _ in lines], times=clock)
    return samples, rest + turn


def _cells(fit: Fit, times: Array) -> NDArray[np.intp]:
    phase = fit.phase(times)
    return ((phase - np.floor(phase)) * PROFILE).astype(np.intp)


def _mean_turn(values: Array, cell: NDArray[np.intp]) -> Array:
    return np.asarray(np.bincount(cell, values, PROFILE) / np.maximum(np.bincount(cell, minlength=PROFILE), 1))


def hum_beside_pulses(bins: Array, times: Array, fit: Fit, lines: Lines) -> Callable[[Array], Array] | None:
    """Return hum against time [s] that moves the phase of the pulses, by least squares; None: no line can.

    Those beside a multiple of half the spin: at an odd one hum moves every second pulse. Hum that stays in step with
    a harmonic is a part of the pulse; what turns against it is not. The profile of the pulse, the motion and the change
    of the height are fitted with it. Hum is no greater than the trace moves, and strays from its frequency.

    bins: of the trace, and their times [s], shape (n,); fit: their phase; lines: which `clean` removed, nearly.
    """
    half, duration = fit.times(0.5), float(times[-1])
    multiples = [(mains, k) for mains in MAINS for k in range(1, int(HIGHEST / mains) + 1)]
    places = [
        (next((place for place, _ in lines if abs(place - k * mains) < k * STRAYS), k * mains), k)
        for mains, k in multiples
    ]
    near = np.array(sorted({place: k for place, k in places if _harmonic(place, half, duration)}.items()))
    if not near.size:
        return None
    frequencies, strays = near.T
    cell = _cells(fit, times)
    shape = _mean_turn(bins, cell)
    slope = (np.roll(shape, -1) - np.roll(shape, 1))[cell]
    u = (times - fit.centre) / fit.half

    angle = 2 * np.pi * np.outer(frequencies, times)
    plain = np.concatenate([np.cos(angle), np.sin(angle)])
    waves = np.concatenate([plain, plain * u])
    rows = np.array([*waves, slope * u, slope * u**2, slope * u**3, (shape[cell] - shape.mean()) * u])
    rows = rows - np.array([_mean_turn(row, cell)[cell] for row in rows])
    turned = (2 * np.pi * STRAYS * fit.half * strays) ** 2 / 3  # hum strays evenly up to there, and its phase by this
    widths = float(bins.var()) * np.repeat([turned**0, turned], 2, axis=0).ravel()
    prior = np.concatenate([noise_of(bins) ** 2 / widths, np.zeros(4)])
    along = rows @ (bins - shape[cell])
    found = np.linalg.lstsq(rows @ rows.T + np.diag(prior), along)[0][: widths.size]
    cosines, sines = found.reshape(2, 2, -1).transpose(1, 0, 2)

    def hum(clock: Array) -> Array:
        away, total = (clock - fit.centre) / fit.half, np.zeros(clock.size)
        for frequency, amplitudes in zip(frequencies, (cosines - 1j * sines).T, strict=True):
            amplitude = amplitudes[0] + away * amplitudes[1]
            total += (amplitude * np.exp(2j * np.pi * frequency * clock)).real
        return total

    return hum


def _without_pulse_lines(lines: Lines, bins: Array, rate: float) -> Lines:
    """Return the lines that are no harmonics of the pulses which stand out of the bins; rate: of the bins.

    Where more turns lack a pulse than have one, hum itself may be numbered, and is no measure of hum.
    """
    if not lines:
        return ()
    try:
        train = fit_train(check_times(find_events(bins, rate).times))
    except TooFewPulses:
        return lines
    own = _pulse_lines(lines, bins, rate, train.fit) if train.missing <= train.used.size else ()
    return tuple(line for line in lines if line not in own)


def _pulse_lines(lines: Lines, bins: Array, rate: float, fit: Fit) -> Lines:
    """Return the lines that are harmonics of the pulses; rate: of the bins; fit: the phase of the pulses.

    A harmonic may lie at a multiple of the mains, too. It then is about as high as the harmonics beside it, and hum
    is higher.
    """
    duration = bins.size / rate
    harmonics = {line: _harmonic(line[0], fit, duration) for line in lines}
    if not any(harmonics.values()):
        return ()
    thin = shorten(bins, max(int(rate / (4 * HIGHEST)), 1))
    thin = thin - thin.mean()
    time = (np.arange(thin.size) + 0.5) * duration / thin.size
    turn = np.exp(-2j * np.pi * fit.phase(time))
    hann = 1 - np.cos(2 * np.pi * time / duration)

    def height(k: int) -> float:
        return 2 * abs(complex(np.mean(thin * turn**k)))

    doubtful = {line: k for line, k in harmonics.items() if k}
    own: list[tuple[float, float]] = []
    while True:  # a line that is the pulses' own is a measure of those beside it
        for line, k in doubtful.items():
            beside = [j for j in range(k - 2, k + 3) if j > 0 and j not in doubtful.values()]
            # a harmonic whose frequency changes during the record is no higher than this at one frequency
            share = abs(complex(np.mean(hann * turn**k * np.exp(2j * np.pi * line[0] * time))))
            still = 2 * abs(complex(np.mean(thin * np.exp(-2j * np.pi * line[0] * time))))
            if line[1] < OWN * share * max(map(height, beside), default=0.0) or height(k) > OWN * still:
                own.append(line)
                del doubtful[line]
                break
        else:
            return tuple(own)


def _harmonic(place: float, fit: Fit, duration: float) -> int:
    """Return which harmonic of the pulses passes a frequency during the record; 0: none does."""
    slowest, fastest = np.sort(fit.frequency(np.array([0.0, duration])))
    k = round(2 * place / (slowest + fastest)) if slowest > 0 else 0
    return k if k * slowest - 3 / duration < place < k * fastest + 3 / duration else 0


def _dead_bins(bins: Array, rate: float, whole: Mask | None) -> Mask:
    """Return bins in runs of one and the same value that last too long; whole: those with all their samples."""
    dead = np.zeros(bins.size, dtype=bool)
    place = np.arange(bins.size) if whole is None else np.flatnonzero(whole)
    values = bins if whole is None else bins[whole]
    step = max(int(DEAD * rate / 4), 1)
    if not np.any(values[1::step] == values[:-1:step][: values[1::step].size]):
        return dead
    same = np.zeros(values.size + 1, dtype=np.int8)
    same[1:-1] = values[1:] == values[:-1]
    if not same.any():
        return dead
    change = np.flatnonzero(np.diff(same))
    for first, last in zip(place[change[::2]], place[change[1::2]], strict=True):
        if last - first > DEAD * rate:
            dead[first : last + 1] = True
    return dead


def mains_lines(bins: Array, rate: float) -> Lines:
    """Return frequencies [Hz] and amplitudes of hum; a top that turns in step with the mains is none."""
    duration = bins.size / rate
    if duration < SHORTEST:
        return ()
    thin = shorten(bins, max(int(rate / (4 * HIGHEST)), 1))
    thin_rate = rate * thin.size / bins.size
    if not np.isfinite(thin).all():
        return ()
    n = thin.size
    transform = np.fft.rfft(thin - thin.mean())
    amplitude = np.zeros(transform.size)  # behind a Hann window, which is a sum of three neighbours
    amplitude[1:-1] = np.abs(transform[1:-1] - 0.5 * (transform[:-2] + transform[2:])) * (2 / n)
    width = thin_rate / n  # of a bin
    level = max(median(amplitude[: int(HIGHEST / width)]), FAINTEST * float(np.ptp(thin)))

    def near(frequency: float, reach: float) -> slice:
        return slice(max(round((frequency - reach) / width), 1), round((frequency + reach) / width) + 1)

    found: list[tuple[float, float]] = []
    top = thin_rate / 2 - 4 * width  # of the spectrum; a line has neighbours on both sides
    for mains in MAINS:
        hum: set[int] = set()
        highest = int(min(HIGHEST, top) / (mains + STRAYS))
        for multiple in range(highest, 0, -1):  # from above: hum is no measure of the lines below it
            nominal = mains * multiple
            reach = max(STRAYS * multiple, 2 * width)
            band = near(nominal, reach)
            peak = band.start + int(np.argmax(amplitude[band]))
            height, place = float(amplitude[peak]), _peak(amplitude, peak) * width
            inside = abs(place - nominal) < STRAYS * multiple + width / 4  # else it is the flank of a line beside
            high = height > 8 * level and _narrow(amplitude, peak, near(peak * width, 1.5 + 3 * width))
            if not (inside and high):
                continue
            further = sorted(
                float(amplitude[near(k * nominal, k * reach)].max())
                for k in (2, 3, 4)
                if k * (nominal + reach) < min(2 * HIGHEST, top) and k * multiple not in hum
            )
            alone = not further or height > SINGLE * further[len(further) // 2]
            if alone and _stays(thin, place / thin_rate, height):
                hum.add(multiple)
                found.append((place, height))
    return tuple(sorted(found))


def _narrow(amplitude: Array, peak: int, beside: slice) -> bool:
    inside = float((amplitude[max(peak - 3, 0) : peak + 4] ** 2).sum())
    return inside > NARROW * (float((amplitude[beside] ** 2).sum()) - inside)


def _stays(thin: Array, frequency: float, height: float) -> bool:
    """Return whether a line is as high in a third of the record.

    frequency: in parts of the rate.
    """
    third = thin.size // 3
    wave = (1 - np.cos(2 * np.pi * (np.arange(third) + 0.5) / third)) * np.exp(
        -2j * np.pi * frequency * np.arange(third)
    )
    pieces = (thin[:third], thin[third : 2 * third], thin[-third:])
    return max(2 / third * abs(complex(wave @ (piece - piece.mean()))) for piece in pieces) > STAYS * height


def _peak(amplitude: Array, peak: int) -> float:
    """Return the place of a line between the bins: parabola through the logarithms."""
    a, b, c = np.log(amplitude[peak - 1 : peak + 2] + 1e-300)
    return peak + float(0.5 * (a - c) / (a - 2 * b + c))


def _without_hum(
    samples: Array, rate: float, bins: Array, counted: Mask, frequencies: list[float], *, times: Array | None
) -> tuple[Array, Array]:
    """Return samples and bins less the hum, whose amplitude and phase may change along the record."""
    factor = samples.size // bins.size
    bin_rate = rate / factor
    place = (np.arange(samples.size, dtype=np.float64) if times is None else times * rate) + 0.5
    place = place / factor - 0.5
    of_bins = np.arange(bins.size, dtype=np.float64) if times is None else shorten(place, factor)
    length = bins.size if times is None else int(of_bins[-1]) + 1
    count = max(int(2 * length / bin_rate / PIECE), 3)
    half = length // count
    ends = np.searchsorted(of_bins, np.arange(count) * half)  # of halves, the last of which goes on to the end
    pieces = list(zip(ends[:-1], [*ends[2:], bins.size], strict=True))
    rest = bins - np.median(bins[counted])
    use = counted
    for _ in range(3):  # pulses are no part of the baseline that the hum rides on
        fits = [
            _hum_of(bins[a:b][use[a:b]], of_bins[a:b][use[a:b]], k * half, half, [f / bin_rate for f in frequencies])
            for k, (a, b) in enumerate(pieces)
        ]
        rest = bins - _blend(fits, of_bins, half, [(f / bin_rate, 1.0) for f in frequencies])
        middle = float(np.median(rest[counted]))
        spread = 1.4826 * float(np.median(np.abs(rest[counted] - middle)))
        use = counted & (np.abs(rest - middle) < 2.5 * spread)
    # the mean over a bin left this much of it
    waves = [(f / bin_rate, float(np.sinc(f / bin_rate) / np.sinc(f / rate))) for f in frequencies]
    return samples - _blend(fits, place, half, waves), rest


def _hum_of(bins: Array, place: Array, first: int, half: int, frequencies: list[float]) -> Array:
    """Return complex amplitude and its slope of each line in a piece, shape (lines, 2), by least squares.

    place: of the bins; first: of the piece [bins]; half: half the length of pieces; frequencies [1/bin].
    """
    if place.size < 8 * len(frequencies) + 8:
        return np.zeros((len(frequencies), 2), dtype=complex)
    u = (place - first) / half - 1
    rows = [np.ones(place.size), u, u**2]
    for frequency in frequencies:
        angle = 2 * np.pi * frequency * place
        c, s = np.cos(angle), np.sin(angle)
        rows += [c, s, c * u, s * u]
    design = np.array(rows)
    normal = design @ design.T
    found = np.linalg.solve(normal + 1e-9 * np.trace(normal) * np.eye(len(rows)), design @ bins)[3:].reshape(-1, 4)
    return np.asarray(found[:, ::2] - 1j * found[:, 1::2])


def _blend(fits: list[Array], place: Array, half: float, waves: list[tuple[float, float]]) -> Array:
    """Return the hum at places [bins], each piece, of twice `half` bins, with a weight that falls to 0 at its ends.

    place: rising; waves: frequency [1/bin], and what amplitude is divided by, of each line.
    """
    total = np.zeros(place.size)
    position = place / half - 1  # the middle of piece i is at i
    last = len(fits) - 1
    ends = [0, *np.searchsorted(position, np.arange(1, last)).tolist(), place.size]
    for k in range(last):  # between the middles of two pieces, and beyond those of the first and the last one
        part = slice(ends[k], ends[k + 1])
        u = position[part] - k
        share = np.clip(u, 0.0, 1.0)
        for before, after, (frequency, gain) in zip(fits[k], fits[k + 1], waves, strict=True):
            angle = (2 * np.pi * frequency) * place[part]
            for wave, a, b in ((np.cos(angle), before.real, after.real), (-np.sin(angle), before.imag, after.imag)):
                here = a[0] + a[1] * u
                total[part] += (here + share * (b[0] + b[1] * (u - 1) - here)) * wave / gain
    return total


def _baseline(bins: Array, rate: float, counted: Mask) -> tuple[Array, Array] | None:
    """Return times [s] and values of the baseline where it wanders; None where it does not."""
    size = int(BLOCK * rate)
    count = bins.size // size if size else 0
    if count < 8:
        return None
    step = max(size // 50, 1)
    blocks = bins[: count * size].reshape(count, size)[:, ::step]
    there = counted[: count * size].reshape(count, size).mean(axis=1) > 0.8
    if np.count_nonzero(there) < 8:
        return None
    ordered = np.sort(blocks[there], axis=1)
    n = ordered.shape[1]
    values = ordered[:, n // 2]
    scatter = median(values - ordered[:, n // 6]) / 0.967
    reach = float(ordered[:, -1].mean() - ordered[:, 0].mean())
    if scatter > max(
        WIDE * noise_of(bins), 0.05 * reach
    ):  # pulses about as long as the pauses: no level belongs to the pauses
        values = 0.5 * (ordered[:, n // 20] + ordered[:, -1 - n // 20])
    error = 1.2533 * scatter / np.sqrt(n)
    times = ((np.arange(count) + 0.5) * size / rate)[there]
    around = np.concatenate([values[:1], values, values[-1:]])
    wander = float(np.ptp(around[:-2] + around[1:-1] + around[2:])) / 3
    if wander < WANDERS * error or wander < 0.02 * reach:
        return None
    return times, values
