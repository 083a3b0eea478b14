"""The integrator's loop for one top: steps of a composition from stop to stop.

A call may hold several runs of the same top at different steps, as an estimate of the error needs: they share a
register, and take about the time of the longest one alone.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.simulator.kernels.compiled import aside, kernel, part
from levilab.simulator.kernels.motion import STATE_SIZE, TIME, Model, State, drift, kick


class RunStops(NamedTuple):
    """The stops of runs, one run after the other.

    Attributes:
        firsts: where the stops of each run begin, shape (runs,).
        times: of the stops, forwards or backwards, shape (n,) [s].
        counts: steps to the next stop, 0 at the last stop of a run, shape (n,).
        levels, slopes: of the drive on the way to the next stop, shape (n,).
        radii, heights: of the escape of each run, outside of which it ends, shape (runs,) [m].
    """

    firsts: NDArray[np.int64]
    times: Array
    counts: NDArray[np.int64]
    levels: Array
    slopes: Array
    radii: Array
    heights: Array


@part
def load_state(block: Array, stride: int, j: int) -> State:
    """Return the state of lane j from a block of rows, flat, row after row."""
    s = stride
    return State(
        (block[j], block[s + j], block[2 * s + j]),
        (block[3 * s + j], block[4 * s + j], block[5 * s + j]),
        (block[6 * s + j], block[7 * s + j], block[8 * s + j]),
        (block[9 * s + j], block[10 * s + j], block[11 * s + j]),
        (block[12 * s + j], block[13 * s + j], block[14 * s + j]),
        block[15 * s + j],
        block[16 * s + j],
        block[17 * s + j],
    )


@part
def store_state(block: Array, stride: int, j: int, state: State) -> None:
    """Write the state of lane j into a block of rows."""
    s = stride
    block[j], block[s + j], block[2 * s + j] = state.r
    block[3 * s + j], block[4 * s + j], block[5 * s + j] = state.v
    block[6 * s + j], block[7 * s + j], block[8 * s + j] = state.n
    block[9 * s + j], block[10 * s + j], block[11 * s + j] = state.L
    block[12 * s + j], block[13 * s + j], block[14 * s + j] = state.arm
    block[15 * s + j] = state.clock
    block[16 * s + j] = state.loose
    block[17 * s + j] = state.t


@part
def renormalize(s: State, t: float) -> State:
    """Return the axis at length 1 again, which rounding takes away by 1e-16 a step, and the time [s] as due.

    A time added up from a million drifts is off by 1e-8 s, and with it the drive's phase.
    """
    n = s.n
    excess = 1.5 - 0.5 * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    return State(s.r, s.v, (n[0] * excess, n[1] * excess, n[2] * excess), s.L, s.arm, s.clock, s.loose, t)


#: Rows of a block below the state.  step: [s]; level, slope: of the drive; ahead: the first drift of the next step,
#: which the last one of this step includes [s]; begin: of the interval [s]; done, count: steps in it; radius2, height:
#: of the escape [m², m]; inside, halt: after the last step, whether the run is inside of them and whether it comes to a
#: stop or is outside.
_STEP, _LEVEL, _SLOPE, _AHEAD, _BEGIN, _DONE, _COUNT, _RADIUS2, _HEIGHT, _INSIDE, _HALT = range(
    STATE_SIZE, STATE_SIZE + 11
)
_ROWS = STATE_SIZE + 11
#: A number of steps that no interval has.
_NEVER = float(1 << 60)


@aside
def _attend_runs(block: Array, lanes: int, at: NDArray[np.int64], stops: Any, states: Array, first: float) -> int:
    """Keep the states of runs that have halted, and begin their next intervals; return how many runs go on.

    at: the stop that each run has reached; first: the composition's first drift.  Nothing in it depends on the kind of
    scene, so that it is compiled once for all.
    """
    going = 0
    for j in range(lanes):
        block[_AHEAD * lanes + j] = 0.0
        if block[_HALT * lanes + j] > 0:
            inside = block[_INSIDE * lanes + j] > 0
            if inside and block[_DONE * lanes + j] == block[_COUNT * lanes + j]:
                at[j] += 1
                for k in range(STATE_SIZE):
                    states[at[j], k] = block[k * lanes + j]
                states[at[j], TIME] = stops.times[at[j]]
            i = at[j]
            if inside and stops.counts[i] > 0:
                step = (stops.times[i + 1] - stops.times[i]) / stops.counts[i]
                block[_STEP * lanes + j], block[_AHEAD * lanes + j] = step, first * step
                block[_BEGIN * lanes + j], block[_DONE * lanes + j] = stops.times[i], 0.0
                block[_COUNT * lanes + j] = stops.counts[i]
                block[_LEVEL * lanes + j], block[_SLOPE * lanes + j] = stops.levels[i], stops.slopes[i]
            else:  # it stands still, inside of the limits
                for k in range(_ROWS):
                    block[k * lanes + j] = 0.0
                block[_COUNT * lanes + j] = _NEVER
                block[_RADIUS2 * lanes + j], block[_HEIGHT * lanes + j] = np.inf, -np.inf
        going += block[_COUNT * lanes + j] < _NEVER
    return going


@kernel
def advance(  # noqa: C901
    model: Model, width: tuple[float, ...], starts: Array, stops: RunStops, drifts: Array, kicks: Array, states: Array
) -> NDArray[np.int64]:
    """Integrate runs of one top at once, each from stop to stop with steps of its own, in the lanes of one register.

    width: a number for each lane; their count is a constant for the compiler, which must see that the rows of a block
    do not overlap; starts: state at the first stop of each run, shape (runs, 18); stops: of all runs; drifts, kicks:
    the composition's coefficients; states: at the stops, shape (n, 18).

    Returns the stop that each run has reached.  A state that is no number counts as outside of the escape.  When the
    first run escapes, the others end, too.
    """
    lanes, stages, first = len(width), kicks.size, drifts[0]
    block, at = np.zeros(_ROWS * lanes), np.zeros(lanes, dtype=np.int64)
    for j in range(lanes):
        block[_COUNT * lanes + j], block[_HALT * lanes + j] = 1.0, 1.0
    for j in range(stops.firsts.size):
        at[j] = stops.firsts[j]
        for k in range(STATE_SIZE):  # no row as a whole: it would be an array of its own, which takes long to compile
            states[at[j], k] = block[k * lanes + j] = starts[j, k]
        block[_RADIUS2 * lanes + j], block[_HEIGHT * lanes + j] = stops.radii[j] * stops.radii[j], stops.heights[j]
        block[_INSIDE * lanes + j] = 1.0
    halted = True
    while True:
        if halted:
            escaped = block[_INSIDE * lanes] == 0
            going = _attend_runs(block, lanes, at, stops, states, first)
            if escaped or going == 0:
                return at
            for j in range(lanes):  # the first drift of an interval, of length 0 for runs in the midst of one
                store_state(block, lanes, j, drift(model, load_state(block, lanes, j), block[_AHEAD * lanes + j]))
        for j in range(lanes):
            # the last drift of a step and the first of the next are one
            more = block[_DONE * lanes + j] + 1 < block[_COUNT * lanes + j]
            block[_AHEAD * lanes + j] = first * block[_STEP * lanes + j] if more else 0.0
        for stage in range(stages):
            b, a, joined = kicks[stage], drifts[stage + 1], 1.0 if stage + 1 == stages else 0.0
            for j in range(lanes):
                h, level, slope = block[_STEP * lanes + j], block[_LEVEL * lanes + j], block[_SLOPE * lanes + j]
                s = kick(model, load_state(block, lanes, j), b * h, level, slope)
                store_state(block, lanes, j, drift(model, s, a * h + joined * block[_AHEAD * lanes + j]))
        for j in range(lanes):
            done = block[_DONE * lanes + j] + 1
            due = block[_BEGIN * lanes + j] + done * block[_STEP * lanes + j] + block[_AHEAD * lanes + j]
            s = renormalize(load_state(block, lanes, j), due)
            store_state(block, lanes, j, s)
            near = s.r[0] * s.r[0] + s.r[1] * s.r[1] < block[_RADIUS2 * lanes + j]
            inside = near & (s.r[2] > block[_HEIGHT * lanes + j])
            block[_DONE * lanes + j], block[_INSIDE * lanes + j] = done, 1.0 if inside else 0.0
            block[_HALT * lanes + j] = 1.0 if (done == block[_COUNT * lanes + j]) | (not inside) else 0.0
        halted = False
        for j in range(lanes):
            halted |= block[_HALT * lanes + j] > 0
