"""Many tops at once: each lane of a SIMD register its own top, and the next one in as soon as a lane is free."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.simulator.kernels.columns import LANES, of_lane
from levilab.simulator.kernels.compiled import aside, kernel, part, wide_registers
from levilab.simulator.kernels.motion import STATE_SIZE, TIME, Model, drift, kick
from levilab.simulator.kernels.pieces import HEIGHT, NEVER, RADIUS, next_piece
from levilab.simulator.kernels.splitting import load_state, renormalize, store_state
from levilab.simulator.kernels.vectors import plus


class Lanes(NamedTuple):
    """What is known of each lane besides its model and state; whole numbers as floats, which registers hold.

    job: in it, −1 for none; rows: samples taken; fresh: whether it has just got its job; inside, halt: after the last
    step, whether it is inside of the limits and whether anything is to be done; begin, end, h, level, slope, count,
    every, last: of the piece it is in, as `Piece` has them; done: steps in it; due: done at the next sample; next_h:
    length of steps in the next piece, 0 if there is none; ahead: the first drift of the next step, which the last drift
    of this one includes [s]; radius2, height: of the escape [m², m].
    """

    job: Any
    rows: Any
    fresh: Any
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


class Jobs(NamedTuple):
    """What is to be done, and how often a second a state is kept; as `advance_many` has them."""

    starts: Any
    numbers: Any
    runs: Any
    sample_rate: Any


class Kept(NamedTuple):
    """What is written of each job, as `advance_many` has it."""

    ends: Any
    survived: Any
    steps: Any
    columns: Any
    samples: Any


@part
def _idle(at: Any, j: Any, block: Any) -> None:
    """Let lane j stand still, inside of the limits, without a job."""
    for k in range(STATE_SIZE):
        block[k * LANES + j] = 0.0
    at.job[j] = -1
    at.h[j], at.next_h[j], at.done[j], at.count[j], at.due[j] = 0.0, 0.0, 0.0, NEVER, NEVER
    at.radius2[j], at.height[j] = np.inf, -np.inf


@part
def _waiting_lanes(block: Any) -> Any:
    """Return lanes that stand still, and have halted: they wait for jobs."""
    at = Lanes(
        np.empty(LANES, dtype=np.int64), np.empty(LANES, dtype=np.int64),
        np.empty(LANES, dtype=np.bool_), np.empty(LANES, dtype=np.bool_),
        np.empty(LANES, dtype=np.bool_), np.empty(LANES, dtype=np.bool_),
        np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES),
        np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES),
        np.empty(LANES),
    )  # fmt: skip
    for j in range(LANES):
        _idle(at, j, block)
        at.rows[j], at.fresh[j], at.inside[j], at.halt[j], at.last[j] = 0, False, True, True, False
        at.begin[j], at.end[j], at.level[j], at.slope[j], at.every[j], at.ahead[j] = 0.0, 0.0, 0.0, 0.0, NEVER, 0.0
    return at


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


@part
def _keep_sample(at: Any, j: Any, back: Any, kept: Any) -> None:
    for k in range(kept.columns.size):
        kept.samples[at.job[j], at.rows[j], k] = back[kept.columns[k] * LANES + j]
    at.rows[j] += 1
    at.due[j] += at.every[j]


@part
def _keep_end(at: Any, j: Any, back: Any, kept: Any) -> None:
    i = at.job[j]
    for k in range(STATE_SIZE):
        kept.ends[i, k] = back[k * LANES + j]
    kept.survived[i] = at.inside[j]
    kept.steps[i, 0], kept.steps[i, 1], kept.steps[i, 2] = at.h[j], at.level[j], at.slope[j]


@part
def _load_job(at: Any, j: Any, i: Any, block: Any, numbers: Any, jobs: Any, kept: Any) -> None:
    """Put model and start of job i into lane j; the start is the first sample."""
    at.job[j] = i
    for k in range(jobs.numbers.shape[1]):
        numbers[k * LANES + j] = jobs.numbers[i, k]
    for k in range(STATE_SIZE):
        block[k * LANES + j] = jobs.starts[i, k]
    for k in range(kept.columns.size):
        kept.samples[i, 0, k] = jobs.starts[i, kept.columns[k]]
    at.radius2[j], at.height[j] = jobs.runs[i, RADIUS] * jobs.runs[i, RADIUS], jobs.runs[i, HEIGHT]
    at.end[j], at.rows[j] = jobs.starts[i, TIME], 1


@aside
def _attend_lanes(at: Any, block: Any, back: Any, numbers: Any, jobs: Any, kept: Any, waiting: int) -> int:
    """Keep samples and ends of lanes that have halted, and give each its next piece or job; the first job that waits.

    block, back: the states, and the same without the first drift of the next step; waiting: the first job that waits.
    Nothing in it depends on the kind of scene, so that it is compiled once for all.
    """
    for j in range(LANES):
        at.fresh[j] = False
        if not at.halt[j]:
            continue
        back[TIME * LANES + j] = at.begin[j] + at.done[j] * at.h[j]
        is_at_end = at.done[j] == at.count[j]
        if at.job[j] >= 0 and at.done[j] == at.due[j] and at.inside[j]:
            _keep_sample(at, j, back, kept)
        if at.job[j] >= 0 and ((is_at_end and at.last[j]) or not at.inside[j]):
            _keep_end(at, j, back, kept)
            at.job[j] = -1
        if at.job[j] < 0 and waiting < jobs.starts.shape[0]:
            _load_job(at, j, waiting, block, numbers, jobs, kept)
            waiting += 1
            at.fresh[j] = True
        i = at.job[j]
        if i < 0:
            _idle(at, j, block)
        elif is_at_end or at.fresh[j]:
            _enter_piece(at, j, jobs.runs[i], jobs.starts[i, TIME], jobs.sample_rate)
    return waiting


@kernel
def advance_many(  # noqa: C901
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
    block, back = np.empty(STATE_SIZE * LANES), np.empty(STATE_SIZE * LANES)
    numbers = np.empty(all_numbers.shape[1] * LANES)
    at = _waiting_lanes(block)
    jobs, kept = Jobs(starts, all_numbers, runs, sample_rate), Kept(ends, survived, steps, columns, samples)
    first, stages = drifts[0], kicks.size
    waiting: Any = np.int64(0)  # a constant would be of a type of its own, and `_attend_lanes` compiled for both
    halted = LANES
    for k in range(numbers.size):
        numbers[k] = all_numbers[0, k // LANES]
    while True:
        if halted > 0:
            for j in range(LANES):
                # where the step ended: the first drift of the next one has been made already
                s = drift(of_lane(model, numbers, j), load_state(block, LANES, j), -at.ahead[j])
                store_state(back, LANES, j, s)
            waiting = _attend_lanes(at, block, back, numbers, jobs, kept, waiting)
            running = 0
            for j in range(LANES):
                running += at.job[j] >= 0
                if at.fresh[j]:
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
