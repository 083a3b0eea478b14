"""A drive that the top triggers: bursts of one cycle, whose times depend on the motion and are found with it.

The tape passes the light where the body's angle about the vertical, φ + ψ, passes the mark.  A burst begins a latency
later; while it lasts, the light is not looked at.  Begin and end of a burst are kinks of the field, and no step crosses
one: the last step before the light ends where the tape is expected by its present rate, and is made again until it ends
there.  So the order of the scheme is kept.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.simulator.kernels.compiled import aside, kernel, part
from levilab.simulator.kernels.motion import Model, State, drift, kick, own_turn
from levilab.simulator.kernels.splitting import load_state, renormalize, store_state
from levilab.simulator.kernels.vectors import Vector, cross, dot, plus


class Trigger(NamedTuple):
    """The trigger of the bursts, and their cycles.

    mark: φ + ψ where the tape passes the light [turns]; latency [s]; frequency: of the sine [Hz], unless cycle is above
    0: its period as a part of the time of the last turn; phase: at its start [turns]; off: when the drive ends [s];
    rate: of the top's turn at the start [turns/s], which the steps are chosen for: a faster top takes shorter ones.
    """

    mark: float
    latency: float
    frequency: float
    cycle: float
    phase: float
    off: float
    rate: float


#: Memory of the drive between pieces: begin and end of the latest burst [s], its frequency [Hz], the passage that
#: set it off [s], and whether less than half a turn was left to the light.
BEGIN, END, FREQUENCY, PASSAGE, NEAR = range(5)
#: Of a drive that has seen no pulse yet.
NO_BURST = (-math.inf, -math.inf, 0.0, -math.inf, 0.0)

#: The tape's passage is extrapolated over this part of a turn at most; its rate changes by some 1e-3 a turn, so that
#: the passage is known to 1e-12 of a turn.  Where the rate itself serves, for want of a turn before, it has to be known
#: as well.
_CLOSE_TURNS, _CLOSER_TURNS = 1e-5, 1e-10
#: Most repetitions of a step before the light: the second one ends within 1e-9 of a turn, unless the top tumbles.
_MOST_TRIES = 8
#: Steps of one piece at most, while the tape is looked for and else; over the first its rate hardly changes.
_MOST_LOOKING, _MOST = 8.0, 1000.0


@aside
def _angle(n: Vector, arm: Vector, turning: Vector) -> tuple[float, float]:
    """Return the body's angle φ + ψ [turns] and its rate [turns/s]; turning: the body's angular velocity [rad/s]."""
    to_n, to_arm = cross(turning, n), cross(turning, arm)
    up = 1 + n[2]
    c, s = up * arm[0] - n[0] * arm[2], up * arm[1] - n[1] * arm[2]
    to_c = up * to_arm[0] + to_n[2] * arm[0] - n[0] * to_arm[2] - to_n[0] * arm[2]
    to_s = up * to_arm[1] + to_n[2] * arm[1] - n[1] * to_arm[2] - to_n[1] * arm[2]
    return math.atan2(s, c) / (2 * math.pi), (c * to_s - s * to_c) / (2 * math.pi * (c * c + s * s))


@part
def _tape(model: Model, s: State, mark: float) -> tuple[float, float]:
    """Return the part of a turn that is left to the light, in [0, 1), and the rate of turns [1/s] without its sign."""
    inverse, along = model.body.inverse_transverse, dot(s.L, s.n)
    own = own_turn(model.turning, along, s.loose, inverse)
    turning = plus((own * s.n[0], own * s.n[1], own * s.n[2]), inverse, s.L)
    angle, rate = _angle(s.n, s.arm, turning)
    left = mark - angle if rate > 0 else angle - mark
    return left - math.floor(left), abs(rate)


class _Piece(NamedTuple):
    """The next steps, to an end [s], under sin(2π(frequency·t + turns)); aims: whether at the tape's passage."""

    end: float
    steps: float
    frequency: float
    turns: float
    aims: bool


@part
def _start_burst(trigger: Trigger, memory: Array, passage: float, now: float, rate: float) -> None:
    if trigger.cycle > 0:
        # the turn that the last burst began with, and those that ended within it
        turns = max(math.floor((passage - memory[PASSAGE]) * rate + 0.5), 1.0)
        rate = rate if memory[PASSAGE] == -math.inf else turns / (passage - memory[PASSAGE])
    memory[FREQUENCY] = trigger.frequency if trigger.cycle == 0 else rate / trigger.cycle
    memory[BEGIN], memory[PASSAGE], memory[NEAR] = max(passage + trigger.latency, now), passage, 0.0
    memory[END] = memory[BEGIN] + 1 / memory[FREQUENCY]


@part
def _look_ahead(expected: float, t: float, end: float, longest: float) -> tuple[float, bool]:
    """Return the end of a piece in which the tape is looked for [s], and whether it aims at the expected passage."""
    if not expected < end:
        return end, False
    if expected - t <= longest:
        return expected, True
    count = math.ceil((expected - t) / longest)  # all steps but the last, which then aims
    return t + (expected - t) * (count - 1) / count, False


@aside
def _next_piece(trigger: Any, memory: Any, t: float, until: float, longest: float, left: float, rate: float) -> Any:
    """Return the piece that begins now.

    t: now [s]; until: the next stop [s]; longest: step [s]; left, rate: of the tape, as `_tape` has them.
    """
    most = _MOST
    end, frequency, turns, aims = until, 0.0, 0.0, False
    if t < trigger.off:
        end = min(until, trigger.off)
        if t >= memory[END]:
            if memory[NEAR] and left > 0.5:  # it has just passed, by less than rounding or a corrected step
                _start_burst(trigger, memory, t - (1 - left) / rate, t, rate)
            else:
                memory[NEAR], most = 1.0 if left < 0.5 else 0.0, _MOST_LOOKING
                end, aims = _look_ahead(t + left / rate, t, end, longest)
        if t < memory[BEGIN]:
            end = min(end, memory[BEGIN])
        elif t < memory[END]:
            end, frequency = min(end, memory[END]), memory[FREQUENCY]
            turns = trigger.phase - frequency * memory[BEGIN]
            longest = min(longest, 0.5 / frequency)
    steps = max(math.ceil((end - t) / longest * (1 - 1e-12)), 1.0)
    if steps > most:
        end, steps = t + most * longest, most
    return _Piece(end, steps, frequency, turns, aims)


@kernel
def advance_triggered(  # noqa: C901
    model: Model,
    trigger: Trigger,
    memory: Array,
    block: Array,
    stops: Array,
    step: float,
    drifts: Array,
    kicks: Array,
    escape: tuple[float, float],
    times: Array,
    counts: NDArray[np.int64],
    levels: Array,
    slopes: Array,
    states: Array,
) -> tuple[int, int, bool]:
    """Integrate one top from piece to piece of the drive that it triggers.

    memory: shape (5,), is changed; block: the state at the start, shape (18,); stops: times at which a piece ends,
    shape (m,) [s], all after the start; step: the longest [s], for the top's rate at the start.  Written are the
    pieces: times, shape (n + 1,), counts, levels and slopes, shape (n,), as `Stops` has them, and states, shape
    (n + 1, 18).  It ends after n pieces, at the last stop, or where the top leaves the limits of the escape, within the
    piece after the last state.

    Returns:
        The pieces that were gone through; the stops reached; whether the top was inside of the limits to the end.
    """
    s = load_state(block, 1, 0)
    store_state(states[0], 1, 0, s)
    stages, radius2, height = kicks.size, escape[0] * escape[0], escape[1]
    a, b = np.empty(stages + 1), np.empty(stages)
    t, done, reached, tries = s.t, 0, 0, 0
    times[0] = t
    corrected = 0.0
    while reached < stops.size and done < counts.size:
        left, rate = _tape(model, s, trigger.mark)
        longest = step * min(1.0, trigger.rate / rate)
        piece = _next_piece(trigger, memory, t, stops[reached], longest, left, rate)
        end, aims, count = piece.end, piece.aims, int(piece.steps)
        if tries > 0:  # the same piece again, to an end nearer to the light
            end = min(corrected, stops[reached], trigger.off)
            aims = end == corrected
        times[done + 1], counts[done], levels[done], slopes[done] = end, count, piece.frequency, piece.turns
        h = (end - t) / count
        for j in range(stages):
            a[j], b[j] = drifts[j] * h, kicks[j] * h
        first, last = drifts[0] * h, drifts[stages] * h
        after = drift(model, s, first)
        for i in range(count):
            # the last drift of a step and the first of the next are one
            ahead = first if i + 1 < count else 0.0
            a[stages] = last + ahead
            for stage in range(stages):
                after = drift(model, kick(model, after, b[stage], piece.frequency, piece.turns), a[stage + 1])
            after = renormalize(after, t + (i + 1) * h + ahead)
            if not (after.r[2] > height and after.r[0] * after.r[0] + after.r[1] * after.r[1] < radius2):
                return done, reached, False
        after = renormalize(after, end)
        if aims:
            left, rate = _tape(model, after, trigger.mark)
            left -= math.floor(left + 0.5)
            late = left / rate
            close = _CLOSER_TURNS if trigger.cycle > 0 and memory[PASSAGE] == -math.inf else _CLOSE_TURNS
            there = abs(left) <= close and late + trigger.latency >= -1e-12 / rate
            if not there and tries < _MOST_TRIES:
                tries += 1
                corrected = max(end + late, t + (end - t) / 8)
                continue
            _start_burst(trigger, memory, end + late, end, rate)
        tries = 0
        s, t, done = after, end, done + 1
        store_state(states[done], 1, 0, s)
        if end == stops[reached]:
            reached += 1
    return done, reached, True
