"""Many tops at once: each lane of a SIMD register its own top, and the next one in as soon as a lane is free."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.core import types
from numba.extending import overload
from numpy.typing import NDArray

from levilab.simulator.kernels.compiled import PART_OPTIONS, kernel, part
from levilab.simulator.kernels.motion import STATE_SIZE, Model, drift, kick
from levilab.simulator.kernels.splitting import load_state, renormalize, store_state
from levilab.simulator.kernels.vectors import plus

Array = NDArray[np.float64]

#: Tops that a kernel advances together.  A constant, because the compiler must see that the rows of a block do not
#: overlap; 16 are two registers of eight doubles, so that the latency of one hides behind the other.
LANES = 16


# --- models whose numbers differ from lane to lane ---


def numbers_of(model: Any) -> list[float]:
    """The floats of a model, in the order in which it is written; arrays are shared by all lanes and left out."""
    if isinstance(model, tuple):
        return [number for inner in model for number in numbers_of(inner)]
    return [float(model)] if isinstance(model, float | int) else []


def of_lane(model: Any, numbers: Any, j: Any) -> Any:
    """The model of lane j: like the given one, with its numbers from column j of a flat block."""
    raise NotImplementedError("it exists inside of kernels only")


def _expression(kind: Any, path: str, names: dict[str, Any], count: list[int]) -> str:
    """How a model of this type is put together, as an expression of Python."""
    if isinstance(kind, types.Float | types.Integer):
        count[0] += 1
        return f"numbers[{(count[0] - 1) * LANES} + j]"
    if isinstance(kind, types.BaseTuple):
        elements: Any = getattr(kind, "types", ())
        inner = "".join(f"{_expression(k, f'{path}[{i}]', names, count)}, " for i, k in enumerate(elements))
        if not hasattr(kind, "instance_class"):
            return f"({inner})"
        names[kind.instance_class.__name__] = kind.instance_class
        return f"{kind.instance_class.__name__}({inner})"
    return path  # None, or an array that all lanes share


def _of_lane(model: Any, numbers: Any, j: Any) -> Any:
    # numba has no way to walk through tuples of different types: the expression is written out once for each type
    names: dict[str, Any] = {}
    text = _expression(model, "model", names, [0])
    exec(f"def put_together(model, numbers, j):\n    return {text}", names)  # noqa: S102
    return names["put_together"]


overload(of_lane, jit_options=PART_OPTIONS, strict=False)(_of_lane)


# --- the loop ---


@part
def _start_job(
    model: Any,
    block: Any,
    numbers: Any,
    h: Any,
    j: Any,
    job: Any,
    starts: Any,
    all_numbers: Any,
    steps: Any,
    first: Any,
) -> Any:
    """Put a job's numbers into lane j, and its state a first drift on.

    An idle lane computes job 0 again; its result is discarded.
    """
    source = max(job, 0)
    for i in range(all_numbers.shape[1]):
        numbers[i * LANES + j] = all_numbers[source, i]
    for i in range(STATE_SIZE):
        block[i * LANES + j] = starts[source, i]
    h[j] = steps[source]
    store_state(block, LANES, j, drift(of_lane(model, numbers, j), load_state(block, LANES, j), first * h[j]))


@kernel
def advance_many(  # noqa: C901
    model: Model,
    starts: Array,
    all_numbers: Array,
    steps: Array,
    counts: NDArray[np.int64],
    drifts: Array,
    kicks: Array,
    escape: tuple[float, float],
    ends: Array,
    taken_steps: NDArray[np.int64],
) -> None:
    """Advance every top to its end, or to the first step after which it is outside of the escape limits.

    model: types and shared arrays; starts: shape (n, 18); all_numbers: of each top's model, shape (n, k);
    steps [s], counts: of each, shape (n,); ends: states at the ends, shape (n, 18); taken_steps: shape (n,), less
    than counts where a top escaped, which is in the last of these steps.
    """
    block, numbers, h = np.empty(STATE_SIZE * LANES), np.empty(all_numbers.shape[1] * LANES), np.empty(LANES)
    job, done = np.empty(LANES, dtype=np.int64), np.zeros(LANES, dtype=np.int64)
    begin, goal = np.empty(LANES), np.empty(LANES, dtype=np.int64)
    over = np.ones(LANES, dtype=np.bool_)
    radius2, height = escape[0] * escape[0], escape[1]
    first, last, stages = drifts[0], drifts[kicks.size], kicks.size
    waiting, running, ended = 0, 0, LANES
    while True:
        if ended > 0:
            for j in range(LANES):
                if over[j]:
                    job[j] = waiting if waiting < counts.size else -1
                    _start_job(model, block, numbers, h, j, job[j], starts, all_numbers, steps, first)
                    done[j], goal[j] = 0, counts[job[j]] if job[j] >= 0 else 1 << 60
                    begin[j] = starts[max(job[j], 0), STATE_SIZE - 1]
                    running += job[j] >= 0
                    waiting += 1
        if running == 0:
            return
        for stage in range(stages):
            # the last drift of a step and the first of the next are one
            a, b = drifts[stage + 1] if stage + 1 < stages else first + last, kicks[stage]
            for j in range(LANES):
                lane = of_lane(model, numbers, j)
                s = kick(lane, load_state(block, LANES, j), b * h[j], 1.0, 0.0)
                store_state(block, LANES, j, drift(lane, s, a * h[j]))
        ended = 0
        for j in range(LANES):
            done[j] += 1
            s = renormalize(load_state(block, LANES, j), begin[j] + (done[j] + first) * h[j])
            store_state(block, LANES, j, s)
            # where the step ended: the first drift of the next one has been made already
            x, y, z = plus(s.r, -first * h[j], s.v)
            inside = (z > height) & (x * x + y * y < radius2)
            over[j] = (done[j] == goal[j]) | (not inside)
            ended += over[j]
        if ended > 0:
            for j in range(LANES):
                if over[j] and job[j] >= 0:
                    # the first drift of the step that does not come is taken back
                    s = drift(of_lane(model, numbers, j), load_state(block, LANES, j), -first * h[j])
                    store_state(ends[job[j]], 1, 0, s)
                    taken_steps[job[j]] = done[j]
                    running -= 1
