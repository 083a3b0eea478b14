"""The integrator's loop for one top: steps of a composition from stop to stop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.kernels.compiled import kernel, part
from levilab.simulator.kernels.motion import Model, State, drift, kick

Array = NDArray[np.float64]


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


@kernel
def advance(
    model: Model,
    block: Array,
    stops: Array,
    counts: NDArray[np.int64],
    levels: Array,
    slopes: Array,
    drifts: Array,
    kicks: Array,
    escape: tuple[float, float],
    states: Array,
) -> int:
    """Integrate one top from stop to stop and write its state at each; returns the number of stops reached.

    block: its state at stops[0], shape (18,); stops: times, shape (n + 1,) [s], forwards or backwards;
    counts: steps to each next stop, shape (n,); levels, slopes: of the drive between stops, shape (n,);
    drifts, kicks: the composition's coefficients; escape: the radius and the height [m] outside of which it
    ends; states: shape (n + 1, 18), row 0 is the start.  A state that is no number counts as outside.
    """
    s = load_state(block, 1, 0)
    store_state(states[0], 1, 0, s)
    stages = kicks.size
    radius2, height = escape[0] * escape[0], escape[1]
    a, b = np.empty(stages + 1), np.empty(stages)
    for i in range(counts.size):
        h = (stops[i + 1] - stops[i]) / counts[i]
        level, slope = levels[i], slopes[i]
        for j in range(stages):  # not drifts * h, which would make an array at each stop
            a[j], b[j] = drifts[j] * h, kicks[j] * h
        a[stages] = drifts[stages] * h
        first, last = a[0], a[stages]
        s = drift(model, s, first)
        for step in range(counts[i]):
            # the last drift of a step and the first of the next are one
            ahead = first if step + 1 < counts[i] else 0.0
            a[stages] = last + ahead
            for stage in range(stages):
                s = drift(model, kick(model, s, b[stage], level, slope), a[stage + 1])
            s = renormalize(s, stops[i] + (step + 1) * h + ahead)
            if not (s.r[2] > height and s.r[0] * s.r[0] + s.r[1] * s.r[1] < radius2):
                return i
        s = renormalize(s, stops[i + 1])
        store_state(states[i + 1], 1, 0, s)
    return counts.size
