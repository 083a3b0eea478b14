"""Spin frequency from a trace of the detector's signal."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.arrays import Array
from analysis.errors import NotPositive, ShapesDiffer
from analysis.pulses import traps
from analysis.pulses.clean import Clean, clean, hum_beside_pulses, name_lines, without_rest_of_hum
from analysis.pulses.edges import Edges, place_edges
from analysis.pulses.errors import OnlyHum, TooFewPulses
from analysis.pulses.likelihood import search
from analysis.pulses.matched import Match, Window, match, window_of
from analysis.pulses.regression import Fit, Grid, fit_turns, median
from analysis.pulses.result import Finding, Method, SpinFrequency
from analysis.pulses.search import Events, find_events, shorten
from analysis.pulses.times import FEWEST, Train, check_times, findings_of_fit, fit_train, without_thirds
from analysis.uncertainty import Estimate, student

Choice = Literal["auto", "edges", "matched", "likelihood"]

#: Samples per second of the shortened trace in which pulses are searched for.
SEARCH_RATE = 2500.0
#: A trace that moves by no more than this part of its values is constant: that is the rounding of their sums.
ROUNDING = 1e-12
#: Fewer edges than this may be noise, unless they are higher than this multiple of it.
FEW, CLEAR = 16, 3.0
#: Pulses that last longer than this part of a turn are placed by their edges alone.
WIDE = 0.2
#: The matched filter is not trusted where more than these parts of the turns have no pulse, or one at a wrong place.
MOST_MISSING, MOST_WRONG = 0.5, 0.15
#: Nor where the frequency would change by more than this part of it.
MOST_SWEPT = 1.0
#: Nor where the pulses beside the turns outnumber those at them by this factor: a reflection is one for each turn.
MOST_DOUBLED = 1.5
#: Pulses are placed one by one if they scatter by more than this part of their width, or by this multiple of the
#: residuals of the match: a mean pulse that is learnt from few of them fits each where it happens to be.
SCATTERED, UNDERSTATED = 0.25, 3.0
#: But only if they scatter by more than four times the shift by noise (0.8 widths over the contrast, by simulation) and
#: by more than this part of a bin, and if no more than this part of the turns lacks its pulse.
BY_NOISE, BY_BINS, MOST_ODD = 3.2, 0.25, 0.1
#: A likelihood that is as great at half the frequency may be so at a quarter.
MOST_DOUBLINGS = 2
#: Two frequencies that differ by no more than this part count the same turns.
SAME = 0.1
#: With fewer samples a turn, a line at 1/k of the frequency or beyond half the rate leaves samples that look the same.
COARSE = 12.0
#: Hum and the phase that it moves are fitted in turn until a frequency moves by less than this part of its u.
HUM_ROUNDS, SETTLED = 8, 0.1
#: Standard deviations between every second pulse and the others from which on they are two marks.
APART = 4.0


def spin_of_trace(
    samples: ArrayLike,
    rate: float,
    *,
    start: float = 0.0,
    method: Choice = "auto",
    degree: int | None = None,
    times: ArrayLike | None = None,
) -> SpinFrequency:
    """Return frequency and chirp of a top from sampled light pulses.

    Args:
        samples: shape (n,), any unit; NaN where there is none.
        rate: samples per second [1/s].
        start: time of the first sample [s].
        method: "edges" is the fastest; "matched" the most precise where pulses stand out; "likelihood" for weak or hard
            traces; "auto" is matched, and likelihood where that does not do: a note says so.
        degree: of the phase in time, as of `spin_of_times`.
        times: of the samples, shape (n,), not decreasing [s], where they are uneven; the rate is then the usual one,
            and `start` does not count.

    Raises:
        TooFewPulses: fewer than four pulses were found, or none that return regularly.
        OnlyHum: that, and the trace holds hum of the mains.
        ShapesDiffer, NotPositive, NotFinite, TimesNotIncreasing.

    >>> turns = (25 - 0.05 * np.arange(10000) / 5000) * np.arange(10000) / 5000
    >>> found = spin_of_trace(np.exp(-3000 * (turns % 1 - 0.5) ** 2), 5000)
    >>> f"{found.at(1.0).value:.4f} Hz at 1 s", f"{found.chirp.value:.3f} Hz/s"
    ('24.9000 Hz at 1 s', '-0.100 Hz/s')
    """
    x, bins, bad = _check_samples(samples, rate)
    # the bins are a pass over an eighth of the samples; where they move, so do the samples
    if _constant(bins) and _constant(x):
        raise TooFewPulses(seen=0, needed=FEWEST, duration=x.size / rate)
    since = None
    if times is not None:
        t = check_times(times, increasing=False)
        if t.shape != x.shape:
            raise ShapesDiffer(quantity="times of samples", seen=t.shape, expected=x.shape)
        start, since = float(t[0]), t - t[0]
    cleaned = clean(x, rate, bins, bad, since)
    try:
        found = _find_pulses(Trace(cleaned, rate, degree, since), method)
    except TooFewPulses as error:
        if cleaned.lines:
            raise OnlyHum(seen=error.seen, needed=error.needed, duration=error.duration) from None
        raise
    named = name_lines(found.notes, cleaned.lines, found.match.fit, cleaned.samples, rate)
    return _result(replace(found, notes=named), start, rate, degree)


class Trace:
    """A trace that was cleaned, the rates of its samples and bins [1/s], and the degree of the phase.

    times: of the samples since the first one [s], where they are uneven.
    """

    def __init__(self, cleaned: Clean, rate: float, degree: int | None = None, times: Array | None = None) -> None:
        self.times = times
        self.samples, self.bins, self.bad = cleaned.samples, cleaned.bins, cleaned.bad
        self.notes, self.lines, self.degree = cleaned.notes, cleaned.lines, degree
        self.rate, self.bin_rate = rate, rate / (self.samples.size // self.bins.size)

    @cached_property
    def events(self) -> Events:
        """The pulses that stand out of the noise.  Raises TooFewPulses."""
        events = find_events(self.bins, self.bin_rate)
        if events.times.size < FEWEST:
            raise self.too_few(events.times.size)
        return events

    @cached_property
    def train(self) -> Train:
        """The events, numbered and fitted.  Raises TooFewPulses."""
        train = fit_train(self.places, degree=self.degree, step=1 / self.rate)
        return without_thirds(self.places, train, self.degree, pulses=2)

    @property
    def places(self) -> Array:
        """Times of the events since the first sample [s]: the centre of a bin is that of its samples."""
        even = self.events.times - 0.5 / self.rate
        return even if self.times is None else np.interp(even * self.rate, np.arange(self.times.size), self.times)

    @property
    def duration(self) -> float:
        """[s]."""
        return self.samples.size / self.rate if self.times is None else float(self.times[-1])

    @property
    def bin_width(self) -> float:
        """Length of a bin [s]; of uneven times the length that one bin in a hundred exceeds."""
        apart = 1 / self.rate if self.times is None else float(np.quantile(np.diff(self.times), 0.99))
        return apart * (self.samples.size // self.bins.size)

    @property
    def middles(self) -> Array:
        """Times of the middles of the bins [s]."""
        if self.times is not None:
            return shorten(self.times, self.samples.size // self.bins.size)
        return (np.arange(self.bins.size, dtype=np.float64) + 0.5) / self.bin_rate - 0.5 / self.rate

    @cached_property
    def clock(self) -> Array:
        """Times of the samples since the first one, shape (n,) [s]."""
        return np.arange(self.samples.size) / self.rate if self.times is None else self.times

    @cached_property
    def whole(self) -> NDArray[np.bool_]:
        """Which bins have all their samples, shape (n,)."""
        if self.bad is None:
            return np.ones(self.bins.size, dtype=bool)
        return np.asarray(shorten(self.bad.astype(np.float64), self.samples.size // self.bins.size) == 0)

    def too_few(self, seen: int) -> TooFewPulses:
        """Return the error of a trace without enough pulses."""
        return TooFewPulses(seen=seen, needed=FEWEST, duration=self.duration)

    def match(self, fit: Fit) -> Match | None:
        """Return the matched filter from a phase that is about right; None where there are no pulses."""
        window = window_of(self.bins, fit.phase(self.middles))
        if window is None:
            return None
        found = self._match_in_window(self.samples, fit, window)
        if found is None:
            return None
        samples, bins = self.samples, self.bins
        if self.lines:
            samples, bins = without_rest_of_hum(
                samples,
                self.rate,
                bins,
                found.fit,
                self.lines,
                times=self.middles,
                counted=self.whole,
                clock=self.times,
            )
        for _ in range(HUM_ROUNDS):
            hum = hum_beside_pulses(bins[self.whole], self.middles[self.whole], found.fit, self.lines)
            if hum is None:
                break
            better = self._match_in_window(samples - hum(self.clock), found.fit, window)
            if better is None:
                return None
            moved = abs(better.fit.middle_frequency - found.fit.middle_frequency) * found.fit.half
            found = replace(better, flat=found.flat)
            if moved < SETTLED * float(np.sqrt(found.fit.covariance[1, 1])):
                break
        return found

    def _match_in_window(self, samples: Array, fit: Fit, window: Window) -> Match | None:
        return match(samples, self.rate, fit, window, bad=self.bad, degree=self.degree, clock=self.times)


@dataclass(frozen=True)
class Found:
    """Pulses of a trace, which method found them, the phase of the fit at which a pulse's middle passes, and findings.

    doubled: pulses beside the turns' own; one_by_one: the phase by pulses that were placed by themselves, of the same
    degree, where they scatter more than the method's residuals show.
    """

    match: Match | Edges
    doubled: int
    method: Method
    origin: float
    notes: tuple[Finding, ...]
    one_by_one: Fit | None = None


def _find_pulses(trace: Trace, method: Choice) -> Found:
    """Return the pulses by a method.  Raises TooFewPulses."""
    if method == "edges":
        if train := _scattered_train(trace, math.inf):
            return _from_train(trace, train)
        edges, doubled = _by_edges(trace)
        return Found(edges, doubled, "edges", 0.0, trace.notes)
    found, doubled, used, why = _by_pulse(trace, method)
    train = _scattered_train(trace, 1.4826 * median(np.abs(found.shifts[found.used])))
    if train and method == "auto":
        return _from_train(trace, train)
    found, trap = _without_trap(trace, found)
    notes = (*why, *trap, *trace.notes)
    if train is None or not _same_turns(found.fit, train.fit):
        return Found(found, doubled, used, found.origin, notes)
    notes = (Finding("scattered", "in u", (_scatter(train),)), *notes)
    return Found(found, doubled, used, found.origin, notes, train.fit)


def _from_train(trace: Trace, train: Train) -> Found:
    """Return the result by pulses that were placed one by one."""
    edges = Edges(train.fit, train.used.size, math.nan, math.nan, math.nan, train.missing, 0)
    notes = (Finding("scattered", "one by one", (_scatter(train),)), *trace.notes)
    return Found(edges, train.doubled, "edges", 0.0, notes)


def _scattered_train(trace: Trace, left: float) -> Train | None:
    """Return the train if pulses stand out but are not at their places: a mean pulse does not show how far they are.

    left: how far a match leaves them from their places, as a standard deviation [turns].
    None where the match is to be trusted: at noise, at gaps, and where every second pulse is off by the same, which is
    a trap of its own.
    """
    try:
        events, train = trace.events, trace.train
    except TooFewPulses:
        return None
    width, bin_width = (seconds * train.fit.middle_frequency for seconds in (events.width, trace.bin_width))  # [turns]
    odd = train.missing + train.doubled
    scatter = _scatter(train)
    if odd > MOST_ODD * train.used.size or scatter < max(BY_NOISE / events.contrast * width, BY_BINS * bin_width):
        return None
    if scatter < SCATTERED * width and scatter < UNDERSTATED * left:
        return None
    sides = [train.fit.residuals[train.turns % 2 == k] for k in (0, 1)]
    if min(map(len, sides)) < 2:
        return None
    apart = abs(float(sides[0].mean() - sides[1].mean()))
    by_chance = math.hypot(*(float(side.std(ddof=1)) / math.sqrt(len(side)) for side in sides))
    return train if apart < student(train.used.size - 2, APART) * by_chance else None


def _scatter(train: Train) -> float:
    """Return standard deviation of the pulses about their fit [turns]."""
    return float(np.sqrt(train.fit.scatter.variance))


def _same_turns(one: Fit, other: Fit) -> bool:
    """Return whether two fits count the same turns."""
    return abs(one.middle_frequency - other.middle_frequency) < SAME * other.middle_frequency


def _by_edges(trace: Trace) -> tuple[Edges, int]:
    """Return the edges, and the number of pulses beside the turns' own.  Raises TooFewPulses."""
    events, train = trace.events, trace.train
    if events.width * train.fit.middle_frequency > WIDE or trace.times is not None:
        times = trace.places[train.used]
        grid = Grid(1 / trace.rate, 1.0)
        fit = fit_turns(times, train.turns.astype(np.float64), degree=trace.degree, jump=train.fit.jump, grid=grid)
        return Edges(fit, train.used.size, math.nan, math.nan, math.nan, train.missing, 0), train.doubled
    edges = place_edges(trace.samples, trace.rate, train.fit, width=events.width, sign=events.sign, degree=trace.degree)
    if edges is None or (edges.turns < FEW and edges.height < CLEAR * edges.noise):
        raise trace.too_few(train.used.size)
    return edges, train.doubled


def _by_pulse(trace: Trace, method: Choice) -> tuple[Match, int, Method, tuple[Finding, ...]]:
    """Return the match, the number of pulses beside the turns' own, the method, and a finding if it is not "matched".

    Raises TooFewPulses.
    """
    found, doubled, seen, astray = None, 0, 0, False
    why: Finding | None = Finding("fell-back", "no pulses")
    try:
        train = trace.train
        doubled, seen = train.doubled, train.used.size
        astray = doubled > MOST_DOUBLED * seen
        found = trace.match(train.fit)
    except TooFewPulses as error:
        seen = error.seen
    if method == "matched":
        if found is None:
            raise trace.too_few(seen)
        return found, doubled, "matched", ()
    if found is not None and method == "auto":
        why = Finding("fell-back", "astray") if astray else _doubt(found)
        if why is None:
            return found, doubled, "matched", ()
    other = _match_by_likelihood(trace, found)
    if other is None or _sweep(other) > MOST_SWEPT:
        raise trace.too_few(seen)
    return other, doubled, "likelihood", () if why is None or method == "likelihood" else (why,)


def _match_by_likelihood(trace: Trace, found: Match | None) -> Match | None:
    """Return the match at the frequency of greatest likelihood, or the one that was found, if that is likelier."""
    fit = search(trace.bins, trace.bin_rate, None if trace.times is None else trace.middles)
    other = None if fit is None else trace.match(fit)
    return max((each for each in (other, found) if each), key=lambda each: each.evidence, default=None)


def _sweep(found: Match) -> float:
    """Return the change of the frequency along the record, as a part of it."""
    slope = found.fit.motion_at(found.fit.centre)[1].value or 0.0
    return abs(slope) * 2 * found.fit.half / found.fit.middle_frequency


def _doubt(found: Match) -> Finding | None:
    """Return the reason to distrust a match; None where there is none."""
    turns, sweep = found.heights.size, _sweep(found)
    if sweep > MOST_SWEPT:
        return Finding("fell-back", "sweep", (sweep * found.fit.middle_frequency,))
    if found.missing > MOST_MISSING * turns:
        return Finding("fell-back", "missing", (found.missing, turns))
    if found.wrong > MOST_WRONG * turns:
        return Finding("fell-back", "wrong", (found.wrong, turns))
    return None


def _without_trap(trace: Trace, found: Match) -> tuple[Match, tuple[Finding, ...]]:
    """Return the match at half or twice the frequency where that is the top's, and the findings about it."""
    notes: tuple[Finding, ...] = ()
    for _ in range(MOST_DOUBLINGS):
        if not traps.repeats(found):
            break
        twice = trace.match(found.fit.times(2.0))
        if twice is None or traps.alternates(twice):
            break
        found = twice  # which may be half of it in turn: a quarter of the frequency fits, too
        notes = (Finding("half"),)
    if notes:
        return found, notes
    if why := traps.alternates(found) or traps.displaces(trace.bins, found.fit.phase(trace.middles)):
        half = trace.match(found.fit.times(0.5))
        if half is not None:
            return half, (Finding("double", why),)
    return found, ()


def _constant(values: Array) -> bool:
    low, high = float(values.min()), float(values.max())
    return high - low <= ROUNDING * max(abs(low), abs(high))


def _check_samples(samples: ArrayLike, rate: float) -> tuple[Array, Array, NDArray[np.bool_] | None]:
    """Return the samples, their shortened trace, and which of them are no finite numbers (None: all are)."""
    x = np.ascontiguousarray(samples, dtype=np.float64)
    if x.ndim != 1:
        raise ShapesDiffer(quantity="samples", seen=x.shape, expected=(x.size,))
    if not (math.isfinite(rate) and rate > 0):
        raise NotPositive(quantity="sample rate", unit="1/s", index=0, value=rate)
    if x.size < 64:
        raise TooFewPulses(seen=0, needed=FEWEST, duration=x.size / rate)
    factor = max(int(rate // SEARCH_RATE), 1)
    with np.errstate(invalid="ignore", over="ignore"):
        bins = shorten(x, factor)
        if math.isfinite(float(bins.sum()) + float(x[bins.size * factor :].sum())):
            return x, bins, None
    bad = ~np.isfinite(x)
    if bad.all():
        raise TooFewPulses(seen=0, needed=FEWEST, duration=x.size / rate)
    x = np.where(bad, np.median(x[~bad]), x)
    return x, shorten(x, factor), bad if bad.any() else None


def _result(pulses: Found, start: float, rate: float, degree: int | None) -> SpinFrequency:
    found = pulses.match
    fit, own = found.fit, pulses.one_by_one
    reference = fit.reference
    frequency, chirp, bend = fit.motion_at(reference)
    phase, scatter = fit.phase_at(reference, pulses.origin), 1.4826 * median(np.abs(fit.residuals))
    u_of_pulses = fit.u_of_pulses(reference)
    if own is not None:
        frequency, chirp, bend = map(_widen, (frequency, chirp, bend), own.motion_at(reference))
        phase, scatter = _widen(phase, own.phase_at(reference)), float(np.sqrt(own.scatter.variance))
        u_of_pulses = own.u_of_pulses(reference)
    assert frequency.value is not None
    more = [*pulses.notes, *traps.mains(frequency, chirp)]
    if isinstance(found, Match) and found.flat:
        more.append(Finding("clipped"))
    if (each := rate / frequency.value) < COARSE:
        more.append(Finding("coarse", values=(each,)))
    if found.missing:
        more.append(Finding("missing", values=(found.missing, found.turns)))
    if found.wrong:
        more.append(Finding("wrong", values=(found.wrong,)))
    more += findings_of_fit(fit, "turns", start)
    return SpinFrequency(
        frequency=frequency,
        chirp=chirp,
        phase=phase,
        reference_time=start + reference,
        method=pulses.method,
        bound=None if math.isnan(found.bound) else found.bound,
        pulses=found.turns,
        missing=found.missing,
        doubled=pulses.doubled,
        scatter=scatter / frequency.value,
        snr_db=20 * math.log10(found.height / found.noise) if found.noise > 0 and found.height > 0 else None,
        notes=tuple(more),
        bend=None if degree == 2 else bend,
        correlations=(own or fit).correlations(reference),
        u_of_pulses=u_of_pulses,
        freedom=(own or fit).scatter.freedom,
        jump=None if fit.jump is None else replace(fit.jump, at=start + fit.jump.at),
    )


def _widen(found: Estimate, own: Estimate) -> Estimate:
    """Return the estimate with u enlarged by the scatter of the pulses' places and the distance to their estimate."""
    assert found.value is not None
    assert found.u is not None
    assert own.value is not None
    assert own.u is not None
    apart = found.value - own.value
    if found.unit == "turns":
        apart -= round(apart)
    return replace(found, u=max(found.u, math.hypot(own.u, apart)))
