"""A scene made ready for its kernels, and its motion at one step from stop to stop."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from levilab.errors import LeftRange, SimulationError
from levilab.simulator.escape import locate_escape
from levilab.simulator.kernels.braking import DragFlow, WasherDragFlow
from levilab.simulator.kernels.loads import PiecewiseLinear
from levilab.simulator.kernels.motion import STATE_SIZE, TIME, R
from levilab.simulator.kernels.splitting import advance
from levilab.simulator.model import model_of
from levilab.simulator.schemes import SCHEMES, Scheme
from levilab.simulator.stops import every_step

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.simulator.scene import Scene
    from levilab.simulator.stops import Stops
    from levilab.simulator.trajectory import Event

Array = NDArray[np.float64]

#: No escape: for coarse runs, which a fine one is compared with.
NOWHERE = (math.inf, -math.inf)

#: Steps in one call of a kernel; between calls progress is told and Ctrl-C is heard (about 50 ms).
STEPS_IN_A_CALL = 100_000


@dataclass(frozen=True)
class Problem:
    """A scene made ready for its kernels."""

    scene: Scene
    model: Any
    start: Array
    scheme: Scheme

    @cached_property
    def coefficients(self) -> tuple[Array, Array]:
        """The scheme's drifts and kicks."""
        return np.array(self.scheme.drifts), np.array(self.scheme.kicks)

    @property
    def escape(self) -> tuple[float, float]:
        """Radius and height [m] outside of which the top counts as fallen."""
        return self.scene.escape.radius_m, self.scene.escape.height_m

    def with_nodes(self, more: int) -> Problem:
        """The same with so many more rings, layers and angles in a magnet of finite size; fewer where negative."""
        return replace(self, model=model_of(self.scene, self.start[R], more))

    def advanced(self, start: Array, stops: Stops, escape: tuple[float, float]) -> tuple[Array, bool]:
        """The states at the stops that were reached, shape (n, 18), and whether that is all of them."""
        states = np.empty((stops.times.size, STATE_SIZE))
        a, b = self.coefficients
        reached = advance(
            self.model, start, stops.times, stops.counts, stops.levels, stops.slopes, a, b, escape, states
        )
        return states[: reached + 1], reached == stops.counts.size


def scheme_for(name: str | None, model: Any) -> Scheme:
    """The scheme of that name, or the best one for the model: drag that flows allows no Nyström composition.

    Part of the error of `levitron-6` comes back at each stop, and a drive with corners has many (docs/speed.md).
    """
    flows = isinstance(model.drag, DragFlow | WasherDragFlow)
    if name is None:
        smooth = "blanes-moan-6" if isinstance(model.drive, PiecewiseLinear) else "levitron-6"
        return SCHEMES["kahan-li-8" if flows else smooth]
    if name not in SCHEMES:
        raise SimulationError(f"scheme {name!r}: expected one of {', '.join(SCHEMES)}")
    if flows and not SCHEMES[name].any_split:
        fitting = ", ".join(scheme.name for scheme in SCHEMES.values() if scheme.any_split)
        raise SimulationError(
            f"scheme {name}: with drag on a top whose spin the field changes it loses its order: take one of {fitting}"
        )
    return SCHEMES[name]


def travelled(
    problem: Problem, stops: Stops, progress: Callable[[float], None] | None = None
) -> tuple[Array, Event | None, int]:
    """All states at the stops, until an escape; in calls short enough to be interrupted."""
    done = np.cumsum(stops.counts)
    pieces, state, at = [problem.start[None]], problem.start, 0
    while at < stops.counts.size:
        first, last = next(stops.part(at, stops.counts.size).pieces(STEPS_IN_A_CALL))
        states, through = problem.advanced(state, stops.part(at + first, at + last), problem.escape)
        pieces.append(states[1:])
        state, at = states[-1], at + len(states) - 1
        if not through:
            passed, fell = _escape(problem, state, stops.part(at, at + 1))
            if fell is not None:
                return np.concatenate(pieces), fell, int(done[at])
            pieces.append(passed[None])
            state, at = passed, at + 1
        if progress is not None:
            progress(float(done[at - 1] / done[-1]))
    return np.concatenate(pieces), None, int(done[-1])


def end_at(problem: Problem, stops: Stops) -> Array:
    """The state at the last stop, with no escape; NaN where the numbers leave their range on the way."""
    state = problem.start
    for first, last in stops.pieces(STEPS_IN_A_CALL):
        states, through = problem.advanced(state, stops.part(first, last), NOWHERE)
        if not through:
            return np.full_like(state, math.nan)
        state = states[-1]
    return state


def at_every_step(problem: Problem, stops: Stops) -> Array:
    """The states after each step, shape (n, 18), with no escape; up to where the numbers leave their range."""
    states = [problem.start[None]]
    for first, last in stops.pieces(STEPS_IN_A_CALL):
        some, through = problem.advanced(states[-1][-1], every_step(stops.part(first, last)), NOWHERE)
        states.append(some[1:])
        if not through:
            break
    return np.concatenate(states)


def _escape(problem: Problem, state: Array, interval: Stops) -> tuple[Array, Event | None]:
    """The escape within an interval, step by step.

    The kernel looks a little ahead, where the drifts of two steps have become one; a top that only grazes the limit
    there has not escaped, and the state at the interval's end is returned.
    """
    single = every_step(interval)
    states, through = problem.advanced(state, single, problem.escape)
    if through:
        return states[-1], None
    at = len(states) - 1
    after, through = problem.advanced(states[-1], single.part(at, at + 1), NOWHERE)
    if not (through and np.all(np.isfinite(after[-1]))):
        raise LeftRange(
            f"the motion cannot be followed beyond {states[-1][TIME]:.6g} s, where its numbers leave their range; "
            f"the last place was ({', '.join(f'{x:.4g}' for x in states[-1][R])}) m: "
            "start farther from the base's edges, or end at a greater escape.height_m"
        )
    moved = mover(problem, single.part(at, at + 1))
    length = float(single.times[at + 1] - single.times[at])
    return after[-1], locate_escape(states[-1], length, moved, problem.escape)


def mover(problem: Problem, interval: Stops) -> Callable[[Array, float], Array]:
    """(state, time) → the state that much later, in one step, with the drive as it is in the interval."""

    def moved(state: Array, length: float) -> Array:
        times = np.array([state[TIME], state[TIME] + length])
        return np.asarray(problem.advanced(state, replace(interval, times=times), NOWHERE)[0][-1])

    return moved
