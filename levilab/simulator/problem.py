"""A scene made ready for its kernels, and its motion at one step from stop to stop."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from analysis.arrays import Array
from levilab.errors import LeftRange, SimulationError
from levilab.simulator.energy import spin_of
from levilab.simulator.escape import locate_escape
from levilab.simulator.kernels.braking import DragFlow, WasherDragFlow
from levilab.simulator.kernels.bursts import NO_BURST, Trigger, advance_triggered
from levilab.simulator.kernels.loads import Bursts, Disc
from levilab.simulator.kernels.motion import STATE_SIZE, TIME, R
from levilab.simulator.kernels.splitting import RunStops, advance
from levilab.simulator.model import model_of
from levilab.simulator.scene import Scene
from levilab.simulator.schemes import SCHEMES, Scheme
from levilab.simulator.stops import Stops, check_count, stop_after_each_step, stops_between
from levilab.simulator.trajectory import Event

#: Radius and height of no escape [m]: for coarse runs, which a fine one is compared with.
NO_LIMITS = (math.inf, -math.inf)

#: Steps in one call of a kernel, about 50 ms; between calls progress is reported, and Ctrl-C takes effect.
STEPS_IN_A_CALL = 100_000
#: A triggered drive takes the steps that suit the spin at the start, and shorter ones above it; but this spin at least.
SLOWEST_HZ = 5.0
#: Pieces of a triggered drive in one call, of some five steps each.
PIECES_IN_A_CALL = 20_000


#: A number for each run that a call of the kernel may hold: a register of four doubles takes the time of one run.
LANES_OF_RUNS: tuple[float, ...] = (0.0,) * 4


class Stretch(NamedTuple):
    """A part of a run: its state at the first of its stops, shape (18,), and the limits of the escape [m]."""

    start: Array
    stops: Stops
    escape: tuple[float, float] = NO_LIMITS


def _run_stops(stretches: Sequence[Stretch]) -> RunStops:
    """Return the stops of these stretches as the kernel takes them."""
    every = [one.stops for one in stretches]
    sizes = [stops.times.size for stops in every]
    times, counts = np.concatenate([stops.times for stops in every]), np.zeros(sum(sizes), dtype=np.int64)
    levels, slopes = np.zeros(counts.size), np.zeros(counts.size)
    firsts = np.cumsum([0, *sizes[:-1]])
    for first, stops in zip(firsts.tolist(), every, strict=True):
        to_next = slice(first, first + stops.counts.size)
        counts[to_next], levels[to_next], slopes[to_next] = stops.counts, stops.levels, stops.slopes
    radii, heights = np.array([one.escape for one in stretches], dtype=np.float64).T.copy()
    return RunStops(firsts, times, counts, levels, slopes, radii, heights)


@dataclass(frozen=True)
class Problem:
    """A scene made ready for its kernels.  memory: of a triggered drive at the start; None: no burst yet."""

    scene: Scene
    model: Any
    start: Array
    scheme: Scheme
    memory: Array | None = None

    @cached_property
    def coefficients(self) -> tuple[Array, Array]:
        """The scheme's drifts and kicks."""
        return np.array(self.scheme.drifts), np.array(self.scheme.kicks)

    @property
    def escape(self) -> tuple[float, float]:
        """Radius and height [m] outside of which the top counts as fallen."""
        return self.scene.escape.radius_m, self.scene.escape.height_m

    def with_nodes(self, more: int) -> Problem:
        """Return the problem with other nodes in a magnet of finite size.

        Args:
            more: rings, layers and angles to add; negative to take away.
        """
        return replace(self, model=model_of(self.scene, self.start[R], more))

    @property
    def triggered(self) -> bool:
        """Whether the kinks of the drive depend on the motion."""
        return isinstance(self.model.drive, Bursts)

    def stops(
        self,
        until: float,
        step: float,
        samples: Array | None = None,
        *,
        escape: tuple[float, float] = NO_LIMITS,
        progress: Callable[[float], None] | None = None,
    ) -> Stops:
        """Return the stops from the start to a time; those of a drive that the top triggers are found on the way.

        Args:
            until: the last stop [s].
            step: no step is longer [s].
            samples: further stops [s].
            escape: radius and height [m] outside of which a motion that has to be followed ends.
            progress: called with the share of the time that a motion was followed.

        Raises:
            SimulationError: as `stops_between`; a triggered drive goes forwards only.
        """
        begin = float(self.start[TIME])
        if not self.triggered:
            return stops_between(begin, until, step, self.scene.drive, samples)
        check_count(abs(until - begin), step)
        if until < begin:
            raise SimulationError(
                f"duration = {until - begin:g} s: a triggered drive goes forwards only, since its bursts follow from "
                "the motion before them; a duration above 0 is expected"
            )
        inside = np.empty(0) if samples is None else samples[(samples > begin) & (samples < until)]
        return _follow(self, step, np.append(inside, until), escape, progress)

    def advance_to_stops(self, start: Array, stops: Stops, escape: tuple[float, float]) -> tuple[Array, bool]:
        """Integrate from stop to stop, by one call of the kernel.

        Args:
            start: the state at the first stop, shape (18,).
            stops: where to stop, and the drive in between.
            escape: radius and height [m] outside of which the kernel ends.

        Returns:
            The states at the stops that were reached, shape (n, 18), the start first; and whether all were reached.
        """
        return self.advance_together([Stretch(start, stops, escape)])[0]

    def advance_together(self, stretches: Sequence[Stretch]) -> list[tuple[Array, bool]]:
        """Integrate stretches of this motion at different steps, by one call of the kernel where it has lanes for them.

        Returns:
            As `advance_to_stops`, of each; when the first one escapes, the others end where they are.
        """
        followed = [(one.stops.states, one.stops.times.size) for one in stretches]
        if any(states is not None for states, _ in followed):  # all of them: the drive is one that the top triggers
            return [(states, len(states) == size) for states, size in followed if states is not None]
        width = LANES_OF_RUNS
        if isinstance(self.model.magnet, Disc):  # a loop over nodes is no code for lanes
            width = LANES_OF_RUNS[:1]
            if len(stretches) > 1:
                return [self.advance_together([one])[0] for one in stretches]
        stops = _run_stops(stretches)
        starts, states = np.array([one.start for one in stretches]), np.empty((stops.times.size, STATE_SIZE))
        reached = advance(self.model, width, starts, stops, *self.coefficients, states)
        ends = np.append(stops.firsts[1:], stops.times.size) - 1
        return [
            (states[first : at + 1], at == end)
            for first, at, end in zip(stops.firsts.tolist(), reached.tolist(), ends.tolist(), strict=False)
        ]


def scheme_for(name: str | None, model: Any) -> Scheme:
    """Return the scheme of that name, or the best one for the model.

    Drag on a top whose spin the field changes allows no Nyström composition.

    Args:
        name: of SCHEMES; None: the best one.
        model: what the kernels compute.

    Raises:
        SimulationError: there is no such scheme, or it loses its order with this model.
    """
    flows = isinstance(model.drag, DragFlow | WasherDragFlow)
    if name is None:
        return SCHEMES["kahan-li-8" if flows else "levitron-6"]
    if name not in SCHEMES:
        raise SimulationError(f"scheme {name!r}: expected one of {', '.join(SCHEMES)}")
    if flows and not SCHEMES[name].any_split:
        fitting = ", ".join(scheme.name for scheme in SCHEMES.values() if scheme.any_split)
        raise SimulationError(
            f"scheme {name}: with drag on a top whose spin the field changes it loses its order: take one of {fitting}"
        )
    return SCHEMES[name]


def _follow(
    problem: Problem, step: float, wanted: Array, escape: tuple[float, float], progress: Callable[[float], None] | None
) -> Stops:
    """Follow a motion with a drive that it triggers, and return the stops with the states there."""
    start, trigger = problem.start, trigger_of(problem)
    memory, state, at = np.array(NO_BURST if problem.memory is None else problem.memory), start, 0
    found: list[Stops] = []
    while at < wanted.size:
        # no array is larger than the steps need: most runs are short
        most = int(min(PIECES_IN_A_CALL, 8 + wanted.size - at + 4 * (wanted[-1] - state[TIME]) / step))
        some = Stops(np.empty(most + 1), np.empty(most, dtype=np.int64), np.empty(most), np.empty(most))
        states = np.empty((most + 1, STATE_SIZE))
        done, reached, through = advance_triggered(
            problem.model, trigger, memory, state, wanted[at:], step, *problem.coefficients, escape,
            some.times, some.counts, some.levels, some.slopes, states,
        )  # fmt: skip
        states = states[: done + 1]
        if not through:
            interval = some.part(done, done + 1)
            passed, fell = _escape(problem, states[-1], interval) if escape != NO_LIMITS else (states[-1], True)
            some = some.part(0, done + 1)
            if fell:
                found.append(replace(some, states=states))
                break
            done, states = done + 1, np.concatenate([states, passed[None]])
            reached += bool(some.times[-1] == wanted[at + reached])
        found.append(replace(some.part(0, done), states=states))
        state, at = states[-1], at + reached
        if progress is not None:
            progress(float((state[TIME] - start[TIME]) / (wanted[-1] - start[TIME])))
    return Stops(
        np.concatenate([found[0].times[:1], *(part.times[1:] for part in found)]),
        np.concatenate([part.counts for part in found]),
        np.concatenate([part.levels for part in found]),
        np.concatenate([part.slopes for part in found]),
        np.concatenate([start[None], *(part.states[1:] for part in found if part.states is not None)]),
        memory,
    )


def trigger_of(problem: Problem) -> Trigger:
    """Return the trigger and the bursts of a triggered drive."""
    drive, turn = problem.scene.drive, 2 * math.pi
    return Trigger(
        mark=drive.light_rad / turn,
        latency=drive.latency_s,
        frequency=drive.frequency_hz,
        cycle=drive.cycle_turns,
        phase=drive.phase_rad / turn,
        off=math.inf if drive.off_s is None else drive.off_s,
        rate=max(abs(float(spin_of(problem.scene, problem.start)[0])) / turn, SLOWEST_HZ),
    )


def bursts_of(stops: Stops, model: Any) -> Array:
    """Return begin, end, frequency and phase of the pieces of bursts, shape (n, 4); none without such a drive."""
    rows = np.stack([stops.times[:-1], stops.times[1:], stops.levels, stops.slopes], axis=1)
    return rows[rows[:, 2] > 0] if isinstance(model.drive, Bursts) else np.empty((0, 4))


def fall_after(problem: Problem, states: Array, stops: Stops) -> Event | None:
    """Return the escape in the interval after the last of these states; None if they are those of all stops."""
    at = len(states) - 1
    return _escape(problem, states[-1], stops.part(at, at + 1))[1] if at < stops.counts.size else None


def integrate(
    problem: Problem, stops: Stops, progress: Callable[[float], None] | None = None, beside: Stops | None = None
) -> tuple[Array, Event | None, int, Array | None]:
    """Integrate a problem up to the last stop or an escape, in calls short enough to be interrupted.

    Args:
        problem: where it starts, and what moves it.
        stops: shape (n + 1,), the first at the start.
        progress: called with the share of the steps that are done.
        beside: of a second run at other steps and without an escape, which takes hardly any time of its own.

    Returns:
        The states at the stops, shape (up to n + 1, 18); the escape, None where there was none; the steps taken; the
        second run's last state, NaN where its numbers left their range, None where the first one escaped.

    Raises:
        LeftRange: the numbers leave their range, as at the base's edges.
    """
    done = np.cumsum(stops.counts)
    pieces, state, at = [problem.start[None]], problem.start, 0
    end, passed = problem.start, 0  # of the second run
    while at < stops.counts.size:
        first, last = next(stops.part(at, stops.counts.size).pieces(STEPS_IN_A_CALL))
        runs = [Stretch(state, stops.part(at + first, at + last), problem.escape)]
        if beside is not None:
            until = max(beside.first_at(float(runs[0].stops.times[-1])), passed)
            runs.append(Stretch(end, beside.part(passed, until)))
        (states, through), *rest = problem.advance_together(runs)
        pieces.append(states[1:])
        state, at = states[-1], at + len(states) - 1
        for others, all_reached in rest:  # broken off with the first run, it goes on from its last stop
            passed += len(others) - 1
            end = others[-1] if all_reached or not through else np.full_like(end, math.nan)
        if not through:
            after, fell = _escape(problem, state, stops.part(at, at + 1))
            if fell is not None:
                return np.concatenate(pieces), fell, int(done[at]), None
            pieces.append(after[None])
            state, at = after, at + 1
        if progress is not None:
            progress(float(done[at - 1] / done[-1]))
    if beside is None:
        return np.concatenate(pieces), None, int(done[-1]), None
    end = integrate_to_end(replace(problem, start=end), beside.part(passed, beside.counts.size))
    return np.concatenate(pieces), None, int(done[-1]), end


def integrate_to_end(problem: Problem, stops: Stops) -> Array:
    """Integrate a problem up to the last stop, without an escape.

    Returns:
        The state there, shape (18,); NaN if the numbers left their range on the way.
    """
    state = problem.start
    if stops.states is not None:
        return stops.states[-1] if len(stops.states) == stops.times.size else np.full_like(state, math.nan)
    for first, last in stops.pieces(STEPS_IN_A_CALL):
        states, through = problem.advance_to_stops(state, stops.part(first, last), NO_LIMITS)
        if not through:
            return np.full_like(state, math.nan)
        state = states[-1]
    return state


def integrate_each_step(problem: Problem, stops: Stops) -> Array:
    """Integrate a problem with a stop after each step, without an escape.

    Returns:
        The states, shape (n, 18), up to the last stop or to where the numbers leave their range.
    """
    states = [problem.start[None]]
    for first, last in stops.pieces(STEPS_IN_A_CALL):
        some, through = problem.advance_to_stops(
            states[-1][-1], stop_after_each_step(stops.part(first, last)), NO_LIMITS
        )
        states.append(some[1:])
        if not through:
            break
    return np.concatenate(states)


def _escape(problem: Problem, state: Array, interval: Stops) -> tuple[Array, Event | None]:
    """Look for an escape within an interval, step by step.

    The kernel joins the drifts of two steps into one, and tests the place within it, a little ahead of the step's end.
    A top that only grazes the limit there has not escaped.

    Args:
        problem: what moves the top.
        state: at the start of the interval, shape (18,).
        interval: one interval of the stops.

    Returns:
        The state after the escape or at the interval's end, shape (18,); the escape, None where there is none.

    Raises:
        LeftRange: the numbers leave their range.
    """
    single = stop_after_each_step(interval)
    states, through = problem.advance_to_stops(state, single, problem.escape)
    if through:
        return states[-1], None
    at = len(states) - 1
    after, through = problem.advance_to_stops(states[-1], single.part(at, at + 1), NO_LIMITS)
    if not (through and np.all(np.isfinite(after[-1]))):
        raise LeftRange(
            f"the motion cannot be followed beyond {states[-1][TIME]:.6g} s, where its numbers leave their range; the "
            f"last place was ({', '.join(f'{x:.4g}' for x in states[-1][R])}) m: start farther from the base's edges, "
            "or end at a greater escape.height_m"
        )
    step = one_step_map(problem, single.part(at, at + 1))
    length = float(single.times[at + 1] - single.times[at])
    return after[-1], locate_escape(states[-1], length, step, problem.escape)


def one_step_map(problem: Problem, interval: Stops) -> Callable[[Array, float], Array]:
    """Return the map (state, length) → state that much later [s], in one step, under the drive of an interval."""

    def step(state: Array, length: float) -> Array:
        times = np.array([state[TIME], state[TIME] + length])
        return np.asarray(problem.advance_to_stops(state, replace(interval, times=times), NO_LIMITS)[0][-1])

    return step
