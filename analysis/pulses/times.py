"""Spin frequency from a list of pulse times."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.arrays import Array
from analysis.checks import check_finite, check_increasing
from analysis.errors import ShapesDiffer
from analysis.pulses.errors import TooFewPulses
from analysis.pulses.jump import Jump
from analysis.pulses.regression import Fit, fit_turns, median
from analysis.pulses.result import Finding, SpinFrequency
from analysis.pulses.turns import Numbering, number_turns
from analysis.uncertainty import student

FEWEST = 4
#: A pulse farther from its place than this number of standard deviations of the others is no pulse of the top; with
#: few pulses the limit is the quantile of Student's t of the same probability.
GROSS = 4.5
ROUNDS = 12
#: `correlated` is reported where independent residuals would do it with less than this probability.
SELDOM = 1e-3


#: A jump of the time counts from this number of standard uncertainties on.  Of 9000 sound lists of 0.6 to 12 s, with
#: coloured jitter, swings and roundings, three had one, and of 2000 in which a drive was switched four.
CERTAIN = 8.0
#: Pulses between a jump and the ends of the list, at least.
FROM_ENDS = 8
#: No jump is shorter [s], or than this number of steps of a clock, which a rounding may have.  The smallest buffer of a
#: sound card lasts 1.3 ms, but whole turns cannot be seen, so what is seen of a lost buffer may be shorter.
LEAST_LOST, STEPS = 1e-4, 2.5
#: The place of a jump is looked for again with the fit that has one, until it stays: four times at most.
TRIES = 4
#: No hand spins a Levitron so fast [Hz]: there may be two equal marks, exactly opposite.
FASTEST_BY_HAND_HZ = 60.0
#: No drive in print left one faster [Hz]: the thesis's top with loose washers.
FASTEST_BY_DRIVE_HZ = 66.0
#: Pulses on each side that show a jump alone: to a quarter of its size and twice their uncertainty.
BESIDE = 12
#: Turns that may be lost or repeated at a jump besides, and the natural logarithm of the odds from which they are.
MORE_TURNS, LOG_ODDS = (-3, -2, -1, 1, 2, 3), 10.0
#: Pulses nearer to their turns than this are used once a jump was found [turns]; the fit leaves out the others.
NEAR = 0.05
#: Where pulses that are missed at random would leave a third of the turns empty less often than this, the turns are
#: thirds of one: 10 pulses show it of one pulse a turn, 26 of two.
CHANCE_OF_THIRDS = 1e-4


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


def spin_of_times(pulse_times: ArrayLike, *, degree: int | None = None, interval_step: float = 0.0) -> SpinFrequency:
    """Return frequency and slope of once-per-turn pulses.

    The turn number is regressed on time; missing, doubled and wrong pulses are allowed for, up to half of the turns.
    Times of edges and bounces of a switch may be mixed.

    Args:
        pulse_times: shape (n,), increasing [s].
        degree: of the phase in time: 2 if the slope stays, 3 if nothing is known of its change; None: it changes as
            under a drag, or as a top's that swings, as probable as the pulses make it.
        interval_step: where the times are sums of rounded intervals, the step to which these are rounded [s].

    Raises:
        TooFewPulses, NotFinite, TimesNotIncreasing, ShapesDiffer.

    >>> found = spin_of_times(np.arange(30) / 25)
    >>> round(found.frequency.value, 9), found.pulses, found.missing
    (25.0, 30, 0)
    """
    times = check_times(pulse_times)
    train = fit_train(times, degree=degree, step=interval_step)
    fit = train.fit.of_rounded_intervals(times, train.used, interval_step) if interval_step else train.fit
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
        jump=fit.jump,
    )


def check_times(pulse_times: ArrayLike, *, increasing: bool = True) -> Array:
    """Return the times as an array of floats.  Raises an error for faulty ones; increasing: two may not be equal."""
    times = np.asarray(pulse_times, dtype=np.float64)
    if times.ndim != 1:
        raise ShapesDiffer(quantity="pulse times", seen=times.shape, expected=(times.size,))
    check_finite("pulse time", times)
    if times.size < FEWEST:
        raise TooFewPulses(seen=times.size, needed=FEWEST, duration=float(np.ptp(times)) if times.size else 0.0)
    check_increasing(times, strictly=increasing)
    return times


def fit_train(times: Array, *, degree: int | None = None, step: float = 0.0) -> Train:
    """Find the turns of pulses and fit the phase, without the pulses that belong to none.

    Args:
        times: shape (n,), increasing [s].
        degree: as of `spin_of_times`.
        step: of the clock that the times are of, or of the intervals whose sums they are [s]; no jump of the time is
            shorter than a few of them.

    Raises:
        TooFewPulses: fewer than four belong.
    """
    numbering = number_turns(times)
    if np.count_nonzero(numbering.belongs) < FEWEST:
        numbering = Numbering(numbering.turns, np.ones(times.size, dtype=bool))
    train = without_thirds(times, _fit_numbered(times, numbering, degree), degree)
    least = max(LEAST_LOST, STEPS * step)
    for _ in range(TRIES):
        jump, numbering = _find_jump(times, train.fit)
        if abs(jump.lost) < least / 2:
            break
        other = _fit_numbered(times, numbering, degree, jump)
        found = other.fit.jump
        if found is None or abs(found.lost) < max(CERTAIN * found.u, least) or not _is_sudden(times, other, found):
            break
        again, train = train.fit.jump is not None and found.at == train.fit.jump.at, other
        if again:
            break
    return train if train.fit.jump is None else _with_whole_turns(times, train, degree)


def without_thirds(times: Array, train: Train, degree: int | None, pulses: int = 1) -> Train:
    """Return the train by whole turns where its turns are thirds of one, as with two marks a third of a turn apart.

    pulses: at most, in a turn; a list of times whose every third pulse is missing looks as if there were two.
    """
    counts = np.bincount(train.turns % 3, minlength=3)
    if np.count_nonzero(counts) > pulses or 3 * (pulses / 3) ** train.used.size > CHANCE_OF_THIRDS:
        return train
    whole = np.rint(train.fit.phase(times)).astype(np.int64) - int(np.argmax(counts))
    belongs = np.isin(np.arange(times.size), train.used) & (whole % 3 == 0)
    return _fit_numbered(times, Numbering(whole // 3, belongs), degree)


def _is_sudden(times: Array, train: Train, jump: Jump) -> bool:
    """Return whether the pulses beside a jump show it, too; a drive that is switched off bends the phase slowly."""
    beside = int(np.searchsorted(times[train.used], jump.at))
    near = slice(max(beside - BESIDE, 0), beside + BESIDE)
    there = times[train.used][near]
    if min(beside, train.used.size - beside) < FROM_ENDS:
        return False
    local = fit_turns(there, train.turns[near].astype(np.float64), degree=2, jump=replace(jump, lost=0.0)).jump
    return local is not None and abs(local.lost - jump.lost) < 0.25 * abs(jump.lost) + 2 * local.u


def _with_whole_turns(times: Array, train: Train, degree: int | None) -> Train:
    """Return the train with the number of turns lost at its jump that fits best: the slope shows it."""
    jump = train.fit.jump
    assert jump is not None
    behind = (times[train.used] > jump.at).astype(np.int64)
    trials = [train]
    for more in MORE_TURNS:
        turns = train.turns + more * behind
        lost = replace(jump, lost=jump.lost + more / train.fit.middle_frequency)
        fit = fit_turns(times[train.used], turns.astype(np.float64), degree=degree, jump=lost)
        trials.append(replace(train, fit=fit, turns=turns, missing=train.missing + more))
    log = [train.used.size * np.log(max(trial.fit.scatter.variance, 1e-300)) for trial in trials]
    best = int(np.argmin(log))
    return trials[best] if log[best] < log[0] - 2 * LOG_ODDS else train


def _find_jump(times: Array, fit: Fit) -> tuple[Jump, Numbering]:
    """Return the jump of the time that lowers the sum of squares most, and the pulses numbered with it."""
    phase = fit.phase(times)
    whole = np.rint(phase)
    away = phase - whole
    if fit.jump is not None:
        away -= fit.jump.lost * fit.frequency(times) * (times > fit.jump.at)
    u = (times - fit.centre) / fit.half
    polynomial, _ = np.linalg.qr(u[:, None] ** np.arange(4))
    away -= polynomial @ (polynomial.T @ away)

    def sum_behind(values: Array) -> Array:
        return np.asarray(np.cumsum(values[::-1], axis=0)[::-1][1:])

    behind = sum_behind(polynomial)  # of a step behind each pulse but the last one
    steady = np.arange(times.size - 1, 0, -1) - np.einsum("ij,ij->i", behind, behind)
    far_in = slice(FROM_ENDS - 1, max(times.size - FROM_ENDS, FROM_ENDS))
    size = sum_behind(away)[far_in] / steady[far_in]
    if not size.size:
        return Jump(0.0, 0.0), Numbering(whole.astype(np.int64), np.ones(times.size, dtype=bool))
    best = int(np.argmax(size**2 * steady[far_in]))
    at = best + FROM_ENDS - 1
    left = away - size[best] * ((np.arange(times.size) > at) - polynomial @ behind[at])
    near = np.abs(left) < max(GROSS * 1.4826 * median(np.abs(left)), NEAR)
    jump = Jump(0.5 * float(times[at] + times[at + 1]), -float(size[best]) / fit.middle_frequency)
    return jump, Numbering(whole.astype(np.int64), near)


def _fit_numbered(times: Array, numbering: Numbering, degree: int | None, jump: Jump | None = None) -> Train:
    used = _nearest_pulses(numbering)
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
        new = _nearest_pulses(Numbering(whole, near), np.abs(away))
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


def _nearest_pulses(numbering: Numbering, away: Array | None = None) -> NDArray[np.intp]:
    """Return indices of the pulses that belong, the nearest of each turn."""
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
    """Return the findings about a train."""
    notes = []
    if train.missing:
        notes.append(Finding("missing", values=(train.missing, train.used.size)))
    if train.doubled:
        notes.append(Finding("doubled", values=(train.doubled,)))
    return (*notes, *findings_of_fit(train.fit, "pulses"))


def findings_of_fit(fit: Fit, of: str, start: float = 0.0) -> tuple[Finding, ...]:
    """Return the findings about a fit to "turns" or "pulses"."""
    notes = []
    if (jump := fit.jump) is not None:
        notes.append(Finding("jump", values=(jump.lost, start + jump.at)))
    if fit.scatter.correlated_p < SELDOM:
        notes.append(Finding("correlated", of, (fit.scatter.inflation,)))
    if (seen := fit.middle_frequency) > FASTEST_BY_HAND_HZ:
        notes.append(Finding("fast", values=(seen, seen / 2)))
    return tuple(notes)
