"""Spin frequency from a trace of the detector's signal."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.errors import NotPositive, ShapesDiffer, TooFewPulses
from analysis.pulses.clean import clean
from analysis.pulses.edges import Edges, place_edges
from analysis.pulses.matched import Match, match, window_of
from analysis.pulses.result import Finding, Method, SpinFrequency
from analysis.pulses.search import find_events, shorten
from analysis.pulses.times import FEWEST, Train, fit_train

Array = NDArray[np.float64]
Choice = Literal["auto", "edges", "matched", "likelihood"]

#: Samples per second of the shortened trace in which pulses are searched for.
SEARCH_RATE = 4000.0


def spin_of_trace(
    samples: ArrayLike,
    rate: float,
    *,
    start: float = 0.0,
    method: Choice = "auto",
    degree: int | None = None,
) -> SpinFrequency:
    """Frequency and chirp of a top from evenly sampled light pulses.

    Args:
        samples: shape (n,), any unit; NaN where there is none.
        rate: samples per second [1/s].
        start: time of the first sample [s].
        method: "edges" is the fastest; "matched" the most precise where pulses stand out; "likelihood" for weak or hard
            traces; "auto" is matched, and likelihood where that does not do: a note says so.
        degree: of the phase in time; None: 2, or 3 where the slope itself changes significantly.

    Raises:
        TooFewPulses, ShapesDiffer, NotPositive.
    """
    x, bad = _checked(samples, rate)
    factor = max(int(rate // SEARCH_RATE), 1)
    cleaned = clean(x, rate, shorten(x, factor), bad)
    x, bins, bad = cleaned.samples, cleaned.bins, cleaned.bad
    events = find_events(bins, rate / factor)
    if events.times.size < FEWEST:
        raise TooFewPulses(seen=events.times.size, needed=FEWEST, duration=x.size / rate)
    train = fit_train(events.times - 0.5 / rate)  # a bin's centre is that of its samples
    if method == "edges":
        edges = place_edges(x, rate, train.fit, width=events.width, sign=events.sign)
        if edges is None:
            raise TooFewPulses(seen=train.used.size, needed=FEWEST, duration=x.size / rate)
        return _result(edges, train, start, method, 0.0, cleaned.notes)
    middles = ((np.arange(bins.size, dtype=np.float64) + 0.5) * factor - 0.5) / rate
    window = window_of(bins, train.fit.phase(middles))
    if window is None:
        raise TooFewPulses(seen=0, needed=FEWEST, duration=x.size / rate)
    found = match(x, rate, train.fit, window, bad=bad, degree=degree)
    if found is None:
        raise TooFewPulses(seen=train.used.size, needed=FEWEST, duration=x.size / rate)
    return _result(found, train, start, "matched" if method == "auto" else method, found.origin, cleaned.notes)


def _checked(samples: ArrayLike, rate: float) -> tuple[Array, NDArray[np.bool_] | None]:
    x = np.ascontiguousarray(samples, dtype=np.float64)
    if x.ndim != 1:
        raise ShapesDiffer(quantity="samples", seen=x.shape, expected=(x.size,))
    if not (math.isfinite(rate) and rate > 0):
        raise NotPositive(quantity="sample rate", unit="1/s", index=0, value=rate)
    if x.size < 16:
        raise TooFewPulses(seen=0, needed=FEWEST, duration=x.size / rate)
    if math.isfinite(float(x @ np.ones_like(x)) if x.size < 1000 else float(x.sum())):
        return x, None
    bad = ~np.isfinite(x)
    if bad.all():
        raise TooFewPulses(seen=0, needed=FEWEST, duration=x.size / rate)
    x = x.copy()
    x[bad] = np.median(x[~bad])
    return x, bad


def _result(
    found: Match | Edges, train: Train, start: float, method: Method, origin: float, before: tuple[Finding, ...]
) -> SpinFrequency:
    fit = found.fit
    frequency, chirp, reference = fit.frequency_and_chirp()
    assert frequency.value is not None
    notes = list(before)
    if found.missing:
        notes.append(Finding("missing", f"{found.missing} turns have no pulse"))
    if found.wrong:
        notes.append(Finding("wrong", f"{found.wrong} pulses are not at their place and were left out"))
    if fit.coefficients.size > 3:
        notes.append(Finding("curved", "the slope itself changes: a third degree was fitted"))
    if fit.inflation != 1:
        notes.append(Finding("correlated", f"neighbouring turns resemble each other: variance x {fit.inflation:.2g}"))
    return SpinFrequency(
        frequency=frequency,
        chirp=chirp,
        phase=fit.phase_at(reference, origin),
        reference_time=start + reference,
        method=method,
        bound=found.bound,
        pulses=found.turns,
        missing=found.missing,
        doubled=train.doubled,
        scatter=1.4826 * float(np.median(np.abs(fit.residuals))) / frequency.value,
        snr_db=20 * math.log10(found.height / found.noise),
        notes=tuple(notes),
    )
