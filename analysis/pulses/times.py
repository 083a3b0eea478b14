"""Spin frequency from a list of pulse times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.errors import NotFinite, ShapesDiffer, TimesNotIncreasing, TooFewPulses
from analysis.numbers import digits
from analysis.pulses.regression import Fit, fit_turns, median, student
from analysis.pulses.result import Finding, SpinFrequency
from analysis.pulses.turns import Numbering, number_turns
from analysis.uncertainty import Estimate

Array = NDArray[np.float64]

FEWEST = 4
#: A pulse farther from its place than this many standard deviations of the others is no pulse of the top; than more of
#: them by few pulses, which say little of their standard deviation.
GROSS = 4.5
ROUNDS = 12
#: A variance that is smaller by chance is seldom smaller than this part.
NOTED = 0.6


@dataclass(frozen=True)
class Train:
    """A pulse train, numbered and fitted.

    used: indices of the pulses; turns: of those; missing: turns without a pulse; doubled: pulses beyond one a turn.
    """

    fit: Fit
    used: NDArray[np.intp]
    turns: NDArray[np.int64]
    missing: int
    doubled: int


def spin_of_times(pulse_times: ArrayLike, *, degree: int | None = None) -> SpinFrequency:
    """Frequency and chirp of once-per-turn pulses.

    The turn number is regressed on time, quadratically; missing, doubled and wrong pulses are allowed for, up to half
    of the turns. Times of edges and bounces of a switch may be mixed.

    Args:
        pulse_times: shape (n,), increasing [s].
        degree: of the phase in time; None: 2, or 3 where the slope itself changes significantly.

    Raises:
        TooFewPulses, NotFinite, TimesNotIncreasing, ShapesDiffer.

    >>> found = spin_of_times(np.arange(30) / 25)
    >>> round(found.frequency.value, 9), found.pulses, found.missing
    (25.0, 30, 0)
    """
    times = checked_times(pulse_times)
    train = fit_train(times, degree=degree)
    frequency, chirp, reference = train.fit.frequency_and_chirp()
    assert frequency.value is not None
    return SpinFrequency(
        frequency,
        chirp,
        train.fit.phase_at(reference),
        reference,
        "edges",
        None,
        train.used.size,
        train.missing,
        train.doubled,
        float(np.sqrt(train.fit.variance)) / frequency.value,
        None,
        findings_of(train),
        train.fit.bend,
        train.fit.correlations(reference),
        unfitted_of(train.fit),
        train.fit.freedom,
    )


def unfitted_of(fit: Fit) -> Estimate | None:
    """The bend that a fit left out."""
    return None if fit.unfitted is None else Estimate(*fit.unfitted, "Hz/s^2")


def checked_times(pulse_times: ArrayLike) -> Array:
    """The times as an array of floats.  Raises what is wrong with them."""
    times = np.asarray(pulse_times, dtype=np.float64)
    if times.ndim != 1:
        raise ShapesDiffer(quantity="pulse times", seen=times.shape, expected=(times.size,))
    if (wrong := np.flatnonzero(~np.isfinite(times))).size:
        raise NotFinite(quantity="pulse time", index=int(wrong[0]), value=float(times[wrong[0]]))
    if times.size < FEWEST:
        raise TooFewPulses(seen=times.size, needed=FEWEST, duration=float(np.ptp(times)) if times.size else 0.0)
    if (wrong := np.flatnonzero(np.diff(times) <= 0)).size:
        i = int(wrong[0])
        raise TimesNotIncreasing(index=i + 1, before=float(times[i]), after=float(times[i + 1]))
    return times


def fit_train(times: Array, *, degree: int | None = None) -> Train:
    """Number the turns and fit the phase, leaving out what does not belong.  Raises TooFewPulses."""
    numbering = number_turns(times)
    if np.count_nonzero(numbering.belongs) < FEWEST:
        numbering = Numbering(numbering.turns, np.ones(times.size, dtype=bool))
    used = _one_a_turn(numbering)
    if used.size < FEWEST:
        raise TooFewPulses(seen=used.size, needed=FEWEST, duration=float(np.ptp(times)))
    turns = numbering.turns
    fit = fit_turns(times[used], turns[used].astype(np.float64), degree=degree)
    for _ in range(ROUNDS):
        phase = fit.phase(times)
        whole = np.rint(phase).astype(np.int64)
        away = phase - whole
        spread = 1.4826 * median(np.abs(fit.residuals)) + 1e-12
        far = student(used.size - fit.coefficients.size, GROSS) * spread
        near = np.abs(away) < np.clip(far, 1e-9, numbering.tolerance)
        new = _one_a_turn(Numbering(whole, near), np.abs(away))
        if new.size < FEWEST:
            break
        if np.array_equal(new, used) and np.ptp(whole[new] - turns[used]) == 0:
            break
        used, turns = new, whole
        fit = fit_turns(times[used], turns[used].astype(np.float64), degree=degree)
    if used.size < FEWEST:
        raise TooFewPulses(seen=used.size, needed=FEWEST, duration=float(np.ptp(times)))
    span = int(turns[used[-1]] - turns[used[0]]) + 1
    return Train(fit, used, turns[used], span - used.size, times.size - used.size)


def _one_a_turn(numbering: Numbering, away: Array | None = None) -> NDArray[np.intp]:
    """Indices of the pulses that belong, the nearest of each turn."""
    index = np.flatnonzero(numbering.belongs)
    turns = numbering.turns[index]
    if index.size < 2 or np.all(np.diff(turns) > 0):
        return index
    nearness = np.zeros(index.size) if away is None else away[index]
    order = np.lexsort((nearness, turns))
    first = np.ones(order.size, dtype=bool)
    first[1:] = np.diff(turns[order]) > 0
    return np.sort(index[order[first]])


def findings_of(train: Train) -> tuple[Finding, ...]:
    """The findings about a train."""
    notes = []
    if train.missing:
        notes.append(Finding("missing", f"{train.missing} turn{'s have' if train.missing > 1 else ' has'} no pulse"))
    if train.doubled:
        notes.append(Finding("doubled", f"{train.doubled} pulses lie beside the turns' own and were left out"))
    if train.fit.coefficients.size > 3:
        notes.append(Finding("curved", "the slope itself changes: a third degree was fitted"))
    notes += correlated(train.fit, "pulses")
    return tuple(notes)


def correlated(fit: Fit, what: str) -> tuple[Finding, ...]:
    """The finding where neighbouring turns or pulses are not independent."""
    if fit.inflation > 1:
        text = f"neighbouring {what} resemble each other: variance x {digits(fit.inflation)}"
    elif fit.inflation < NOTED:
        text = f"neighbouring {what} differ from each other, which averages out: variance x {digits(fit.inflation)}"
    else:
        return ()
    return (Finding("correlated", text),)
