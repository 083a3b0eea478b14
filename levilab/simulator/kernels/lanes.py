"""Many tops at once: each lane of a SIMD register its own top, and the next one in as soon as a lane is free."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.kernels.columns import LANES, of_lane
from levilab.simulator.kernels.compiled import kernel, part, wide_registers
from levilab.simulator.kernels.motion import STATE_SIZE, TIME, Model, drift, kick
from levilab.simulator.kernels.pieces import HEIGHT, NEVER, RADIUS, next_piece
from levilab.simulator.kernels.splitting import load_state, renormalize, store_state
from levilab.simulator.kernels.vectors import plus

Array = NDArray[np.float64]


class Lanes(NamedTuple):
    """What is known of each lane besides its model and state; whole numbers as floats, which registers hold.

    job: in it, −1 for none; rows: samples taken; inside, halt: after the last step, whether it is inside of the limits
    and whether anything is to be done; begin, end, h, level, slope, count, every, last: of the piece it is in, as
    `Piece` has them; done: steps in it; due: done at the next sample; next_h: length of steps in the next piece, 0 if
    there is none; ahead: the first drift of the next step, which the last drift of this one includes [s]; radius2,
    height: of the escape [m², m].
    """

    job: Any
    rows: Any
    inside: Any
    halt: Any
    last: Any
    begin: Any
    end: Any
    h: Any
    level: Any
    slope: Any
    count: Any
    every: Any
    done: Any
    due: Any
    next_h: Any
    ahead: Any
    radius2: Any
    height: Any


@part
def _idle_lanes() -> Any:
    """Lanes that stand still, inside of the limits, and wait for work."""
    return Lanes(
        np.full(LANES, -1), np.zeros(LANES, dtype=np.int64),
        np.ones(LANES, dtype=np.bool_), np.ones(LANES, dtype=np.bool_), np.zeros(LANES, dtype=np.bool_),
        np.zeros(LANES), np.zeros(LANES), np.zeros(LANES), np.zeros(LANES), np.zeros(LANES),
        np.full(LANES, NEVER), np.full(LANES, NEVER), np.zeros(LANES), np.full(LANES, NEVER),
        np.zeros(LANES), np.zeros(LANES), np.full(LANES, np.inf), np.full(LANES, -np.inf),
    )  # fmt: skip


@part
def _idle(at: Any, j: Any) -> None:
    at.h[j], at.next_h[j], at.done[j], at.count[j], at.due[j] = 0.0, 0.0, 0.0, NEVER, NEVER
    at.radius2[j], at.height[j] = np.inf, -np.inf


@part
def _enter_piece(at: Any, j: Any, run: Any, start: Any, sample_rate: Any) -> None:
    """Begin the piece after the one that lane j has come to the end of."""
    piece = next_piece(run, start, at.end[j], at.rows[j], sample_rate)
    at.begin[j], at.end[j], at.h[j], at.level[j], at.slope[j] = (
        piece.begin, piece.end, piece.h, piece.level, piece.slope
    )  # fmt: skip
    at.done[j], at.count[j], at.due[j], at.every[j] = 0.0, piece.steps, piece.every, piece.every
    at.last[j], at.next_h[j] = piece.last, 0.0
    if not piece.last:
        rows = at.rows[j] + (int(piece.steps / piece.every) if piece.every < NEVER else 0)
        at.next_h[j] = next_piece(run, start, piece.end, rows, sample_rate).h


@kernel
def advance_many(  # noqa: C901, PLR0912, PLR0915
    model: Model,
    starts: Array,
    all_numbers: Array,
    runs: Array,
    drifts: Array,
    kicks: Array,
    ends: Array,
    survived: NDArray[np.bool_],
    steps: Array,
    sample_rate: float,
    columns: NDArray[np.int64],
    samples: Array,
) -> None:
    """Advance every top to its end, or to the first step after which it is outside of the escape limits.

    model: types and shared arrays; starts: shape (n, 18); all_numbers: of each top's model, shape (n, k);
    runs: what `pieces` names, shape (n, 11); ends: states at the ends, shape (n, 18); survived: whether each was inside
    to its end, shape (n,); steps: length of the last step, level and slope of the drive in it, shape (n, 3);
    sample_rate: samples a second, 0 for none; columns: of the state that are kept, shape (c,);
    samples: shape (n, samples, c), the first is the start; those after an escape are left as they are.
    """
    wide_registers()
    block, back = np.zeros(STATE_SIZE * LANES), np.zeros(STATE_SIZE * LANES)
    numbers = np.empty(all_numbers.shape[1] * LANES)
    at = _idle_lanes()
    first, stages = drifts[0], kicks.size
    waiting, running, halted = 0, 0, LANES
    for k in range(numbers.size):
        numbers[k] = all_numbers[0, k // LANES]
    while True:
        if halted > 0:
            for j in range(LANES):
                # where the step ended: the first drift of the next one has been made already
                s = drift(of_lane(model, numbers, j), load_state(block, LANES, j), -at.ahead[j])
                store_state(back, LANES, j, s)
            for j in range(LANES):
                if not at.halt[j]:
                    continue
                i, fresh = at.job[j], False
                back[TIME * LANES + j] = at.begin[j] + at.done[j] * at.h[j]
                if i >= 0 and at.done[j] == at.due[j] and at.inside[j]:
                    for k in range(columns.size):
                        samples[i, at.rows[j], k] = back[columns[k] * LANES + j]
                    at.rows[j] += 1
                    at.due[j] += at.every[j]
                if i >= 0 and ((at.done[j] == at.count[j] and at.last[j]) or not at.inside[j]):
                    for k in range(STATE_SIZE):
                        ends[i, k] = back[k * LANES + j]
                    survived[i] = at.inside[j]
                    steps[i, 0], steps[i, 1], steps[i, 2] = at.h[j], at.level[j], at.slope[j]
                    running -= 1
                    i = -1
                if i < 0:
                    fresh = waiting < starts.shape[0]
                    i = waiting if fresh else -1
                    at.job[j] = i
                    waiting += fresh
                    running += fresh
                if fresh:
                    for k in range(all_numbers.shape[1]):
                        numbers[k * LANES + j] = all_numbers[i, k]
                    for k in range(STATE_SIZE):
                        block[k * LANES + j] = starts[i, k]
                    for k in range(columns.size):
                        samples[i, 0, k] = starts[i, columns[k]]
                    at.radius2[j], at.height[j] = runs[i, RADIUS] * runs[i, RADIUS], runs[i, HEIGHT]
                    at.end[j], at.rows[j] = starts[i, TIME], 1
                elif i < 0:
                    for k in range(STATE_SIZE):
                        block[k * LANES + j] = 0.0
                    _idle(at, j)
                if fresh or (i >= 0 and at.done[j] == at.count[j]):
                    _enter_piece(at, j, runs[i], starts[i, TIME], sample_rate)
                    if fresh:
                        s = drift(of_lane(model, numbers, j), load_state(block, LANES, j), first * at.h[j])
                        store_state(block, LANES, j, s)
        if running == 0:
            return
        for j in range(LANES):
            # the last drift of a step and the first of the next are one
            at.ahead[j] = first * (at.h[j] if at.done[j] + 1 < at.count[j] else at.next_h[j])
        for stage in range(stages):
            b, a, joined = kicks[stage], drifts[stage + 1], 1.0 if stage + 1 == stages else 0.0
            for j in range(LANES):
                lane = of_lane(model, numbers, j)
                s = kick(lane, load_state(block, LANES, j), b * at.h[j], at.level[j], at.slope[j])
                store_state(block, LANES, j, drift(lane, s, a * at.h[j] + joined * at.ahead[j]))
        halted = 0
        for j in range(LANES):
            at.done[j] += 1
            s = renormalize(load_state(block, LANES, j), at.begin[j] + at.done[j] * at.h[j] + at.ahead[j])
            store_state(block, LANES, j, s)
            x, y, z = plus(s.r, -at.ahead[j], s.v)
            at.inside[j] = (z > at.height[j]) & (x * x + y * y < at.radius2[j])
            at.halt[j] = (at.done[j] == at.count[j]) | (at.done[j] == at.due[j]) | (not at.inside[j])
            halted += at.halt[j]
