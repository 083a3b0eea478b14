"""Spin frequency from a list of pulse times."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.errors import NotFinite, ShapesDiffer, TimesNotIncreasing, TooFewPulses
from analysis.numbers import digits
from analysis.pulses.regression import Fit, Jump, fit_turns, median, student
from analysis.pulses.result import Finding, SpinFrequency
from analysis.pulses.turns import Numbering, number_turns

Array = NDArray[np.float64]

FEWEST = 4
#: A pulse farther from its place than this many standard deviations of the others is no pulse of the top; than more of
#: them by few pulses, which say little of their standard deviation.
GROSS = 4.5
ROUNDS = 12
#: Independent residuals that differ as much over long times from those over short ones are as seldom as this.
SELDOM = 1e-3


#: A jump of the time counts from so many standard uncertainties on: of TODO sound records none shows as much.
CERTAIN = 8.0
#: It is looked for at least so many pulses from the ends.
FROM_ENDS = 4
#: The smallest buffer of a sound card, 64 samples at 48 kHz, lasts longer [s]; steps of rounded times are shorter.
LEAST_LOST = 1e-3


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
    """Return frequency and slope of once-per-turn pulses.

    The turn number is regressed on time; missing, doubled and wrong pulses are allowed for, up to half of the turns.
    Times of edges and bounces of a switch may be mixed.

    Args:
        pulse_times: shape (n,), increasing [s].
        degree: of the phase in time: 2 if the slope stays, 3 if nothing is known of its change; None: it changes as
            under a drag, or as a top's that swings, as probable as the pulses make it.

    Raises:
        TooFewPulses, NotFinite, TimesNotIncreasing, ShapesDiffer.

    >>> found = spin_of_times(np.arange(30) / 25)
    >>> round(found.frequency.value, 9), found.pulses, found.missing
    (25.0, 30, 0)
    """
    train = fit_train(checked_times(pulse_times), degree=degree)
    fit = train.fit
    frequency, chirp, bend = fit.motion_at(fit.reference)
    assert frequency.value is not None
    return SpinFrequency(
        frequency=frequency,
        chirp=chirp,
        phase=fit.phase_at(fit.reference),
        reference_time=fit.reference,
        method="edges",
        bound=None,
        pulses=train.used.size,
        missing=train.missing,
        doubled=train.doubled,
        scatter=float(np.sqrt(fit.scatter.variance)) / frequency.value,
        snr_db=None,
        notes=findings_of(train),
        bend=None if degree == 2 else bend,
        correlations=fit.correlations(fit.reference),
        u_of_pulses=fit.u_of_pulses(fit.reference),
        freedom=fit.scatter.freedom,
    )


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
    train = _fit_numbered(times, numbering, degree)
    if (jump := _find_jump(times, train.fit)) is None:
        return train
    whole = np.rint(train.fit.phase(times) + train.fit.frequency(times) * jump.lost * (times > jump.at))
    other = _fit_numbered(times, replace(numbering, turns=whole.astype(np.int64)), degree, jump)
    found = other.fit.jump
    return other if found is not None and abs(found.lost) > max(CERTAIN * found.u, LEAST_LOST) else train


def _find_jump(times: Array, fit: Fit) -> Jump | None:
    """Return the most probable place and size of a jump of the time; None if it is no more probable than chance."""
    away = fit.phase(times)
    away -= np.rint(away)
    u = (times - fit.centre) / fit.half
    polynomial, _ = np.linalg.qr(u[:, None] ** np.arange(4))
    away -= polynomial @ (polynomial.T @ away)

    def sums_behind(values: Array) -> Array:
        return np.asarray(np.cumsum(values[::-1], axis=0)[::-1][1:])

    behind = sums_behind(polynomial)  # of the step behind each pulse but the last one
    steady = np.arange(times.size - 1, 0, -1) - np.einsum("ij,ij->i", behind, behind)
    steady[:FROM_ENDS] = steady[times.size - 1 - FROM_ENDS :] = np.inf
    size = sums_behind(away) / steady
    gain = size**2 * np.where(np.isinf(steady), 0.0, steady)
    at = int(np.argmax(gain))
    left = float(away @ away) - float(gain[at])
    lost = float(size[at]) / fit.middle_frequency
    if gain[at] * times.size < CERTAIN**2 * left or abs(lost) < LEAST_LOST / 2:
        return None
    return Jump(0.5 * float(times[at] + times[at + 1]), lost)


def _fit_numbered(times: Array, numbering: Numbering, degree: int | None, jump: Jump | None = None) -> Train:
    used = _one_a_turn(numbering)
    if used.size < FEWEST:
        raise TooFewPulses(seen=used.size, needed=FEWEST, duration=float(np.ptp(times)))
    turns = numbering.turns
    fit = fit_turns(times[used], turns[used].astype(np.float64), degree=degree, jump=jump)
    for _ in range(ROUNDS):
        phase = fit.phase(times)
        whole = np.rint(phase).astype(np.int64)
        away = phase - whole
        spread = 1.4826 * median(np.abs(fit.residuals)) + 1e-12
        far = student(fit.scatter.freedom, GROSS) * spread
        near = np.abs(away) < np.clip(far, 1e-9, numbering.tolerance)
        new = _one_a_turn(Numbering(whole, near), np.abs(away))
        if new.size < FEWEST:
            break
        if np.array_equal(new, used) and np.ptp(whole[new] - turns[used]) == 0:
            break
        used, turns = new, whole
        fit = fit_turns(times[used], turns[used].astype(np.float64), degree=degree, jump=fit.jump)
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
    return (*notes, *findings_of_fit(train.fit, "pulses"))


def findings_of_fit(fit: Fit, what: str) -> tuple[Finding, ...]:
    """Return what is to be said of a fit to turns or pulses."""
    notes = []
    if (jump := fit.jump) is not None:
        size = f"{digits(abs(1e3 * jump.lost), 3)} ms (or that and whole turns)"
        did = "misses" if jump.lost > 0 else "repeats"
        notes.append(Finding("jump", f"the record {did} {size} at {jump.at:.5g} s, which was allowed for"))
    if fit.scatter.correlated_p < SELDOM:
        alike = "resemble each other" if fit.scatter.inflation > 1 else "differ from each other, which averages out"
        notes.append(Finding("correlated", f"neighbouring {what} {alike}: variance x {digits(fit.scatter.inflation)}"))
    return tuple(notes)
