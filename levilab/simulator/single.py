"""One top from its start to its end: the tolerance decides the step, and the result carries its error."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.errors import SimulationError
from levilab.simulator.accuracy import (
    NODES_ORDER,
    SAFETY_FACTOR,
    comes_near_zero,
    estimate,
    has_kink,
    longest_step,
    rounding_error,
)
from levilab.simulator.energy import both_spins
from levilab.simulator.escape import exit_speeds, locate_zero, margins
from levilab.simulator.kernels.loads import Disc
from levilab.simulator.kernels.motion import CLOCK, TIME, L, N, R, V
from levilab.simulator.model import model_of
from levilab.simulator.pilot import Pilot, pilot_of, step_power
from levilab.simulator.problem import (
    Problem,
    bursts_of,
    fall_after,
    integrate,
    integrate_each_step,
    integrate_to_end,
    one_step_map,
    scheme_for,
)
from levilab.simulator.scene import Scene
from levilab.simulator.spin import DECAYS, since_infinity
from levilab.simulator.start import start_of
from levilab.simulator.stops import NO_TIMES, Stops, corners, kinks, stop_after_each_step
from levilab.simulator.trajectory import Accuracy, Event, Trajectory

#: No step is small enough for a chaotic motion: at this part of the longest step the search ends.
SMALLEST_STEP_SHARE = 1 / 256

#: After this number of shorter steps in succession that did not halve the error, the motion is taken for chaotic: a
#: single one may be chance in the estimates.
MAX_FAILED_REFINEMENTS = 2

#: The longest step over the steps of a result: room for a second run with longer steps, which is the cheaper one.
ROOM = 1.4

#: With less than this ratio of stepᵖ between two runs their difference is smaller than the error.
LEAST_RATIO = 2.0

#: Above this ratio of the error to the one that a pilot run shows neighbours may part exponentially, and rounding with
#: them: two further runs then show whether the scheme's order is reached.
MOST_GROWTH = 10.0

#: The longest step for these two runs, as a part of the longest one: they have steps twice and four times as long.
LONGEST_SHARE_OF_THREE = 1 / 4

#: The longest simulation, thirty years [s].
LONGEST_S = 1e9

#: From this number of steps between two kinks on, it can be halved and rounded up: the step is then about twice as
#: long.
MIN_STEPS_FOR_DOUBLING = 16

Watch = Mapping[str, Callable[[Trajectory], Array]]


@dataclass(frozen=True)
class _Wanted:
    """What the caller of `simulate` wants, beside the accuracy."""

    duration: float
    rate: float | None
    events: Watch | None
    progress: Callable[[float], None] | None


@dataclass(frozen=True)
class Beside:
    """A second run, to estimate the error of the first one from: its last state, shape (18,), and its step_power."""

    end: Array
    step_power: float


@dataclass(frozen=True)
class Run:
    """A motion integrated once.

    Attributes:
        states: at the samples, shape (n, 18).
        fell: the fall that ended it.
        events: on the way.
        steps: how many were taken.
        step_power: mean of stepᵖ over the time [sᵖ], p the scheme's order.
        stops: that it was integrated between.
        beside: the end of a second run at other steps, if there was one.
    """

    states: Array
    fell: Event | None
    events: tuple[Event, ...]
    steps: int
    step_power: float
    stops: Stops
    beside: Beside | None = None


def simulate(
    scene: Scene,
    duration: float = 30.0,
    *,
    tolerance: float = 1e-7,
    rate: float | None = 100.0,
    events: Watch | None = None,
    scheme: str | None = None,
    step: float | None = None,
    start: Array | None = None,
    memory: Array | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Simulate a scene, with an error at the end within the tolerance.

    Args:
        scene: what is simulated.
        duration: [s], negative to go back in time.
        tolerance: wanted error of the place [m] and the axis [rad] at the end.
        rate: samples per second (the last sample is the end), None for the start and the end alone.
        events: functions of a Trajectory, shape (n,), whose zeros are located.
        scheme: a name of SCHEMES; None: the best one for the scene.
        step: the longest step [s]; None: the tolerance decides it.
        start: a state to start from instead of the scene's, shape (18,); its time stays.
        memory: of a triggered drive then, as the motion before has it; None: no burst is under way.
        progress: called with the share of the work that is done.

    Returns:
        The motion at its samples, with its estimated error, up to the end or the fall.

    Raises:
        SimulationError: a number makes no sense, or the motion leaves the numbers' range.

    >>> from levilab.simulator import preset, simulate
    >>> motion = simulate(preset("undriven"), 5, tolerance=1e-10)
    >>> motion.survived, motion.accuracy.reached
    (True, True)
    """
    check(duration=duration, tolerance=tolerance, rate=rate, step=step)
    if scene.observed == "spin":
        given = {"events": events, "scheme": scheme, "step": step, "start": start}
        if useless := [name for name, value in given.items() if value is not None]:
            raise SimulationError(
                f"{useless[0]}: a scene with observed = spin has a closed form, nothing is integrated: take observed = "
                "motion"
            )
        return spin_alone(scene, duration, tolerance, rate)
    state = start_of(scene) if start is None else np.array(start, dtype=np.float64)
    if not np.all(np.isfinite(state)):
        raise SimulationError("the start has a value that is no number: 18 finite numbers are expected")
    if start is None and margins(state[None], (scene.escape.radius_m, scene.escape.height_m)).min() < 0:
        raise SimulationError(
            f"escape.height_m = {scene.escape.height_m}: the top starts at {state[R][2]:.4g} m, outside of the limits "
            "of the escape, where it would be lost before it began"
        )
    begin = float(state[TIME])
    corners(scene.drive, min(begin, begin + duration), max(begin, begin + duration))  # refused before anything is run
    model = model_of(scene, state[R])
    problem = Problem(scene, model, state, scheme_for(scheme, model), memory)
    wanted = _Wanted(duration, rate, events, progress)
    run, accuracy = _to_tolerance(problem, wanted, tolerance, step)
    bursts, memory = bursts_of(run.stops, model), run.stops.memory
    return Trajectory(scene, run.states, model, accuracy, run.fell, run.events, bursts, memory)


def simulate_at_step(
    scene: Scene,
    duration: float,
    step: float,
    rate: float | None,
    *,
    errors: bool,
    start: Array | None = None,
    memory: Array | None = None,
) -> tuple[Run, Array]:
    """Simulate a scene once, at one step [s]; return the motion and its estimated errors of place [m] and axis [rad].

    Raises:
        LeftRange: the motion leaves the numbers' range.
    """
    state = start_of(scene) if start is None else start
    model = model_of(scene, state[R])
    problem = Problem(scene, model, state, scheme_for(None, model), memory)
    run = _run(problem, _Wanted(duration, rate, None, None), step)
    return run, np.sum(_errors(problem, run, step), axis=0) if errors else np.full(2, math.nan)


def check(*, duration: float, **positive: float | None) -> None:
    """Raise SimulationError, with the quantity's name, for a number that makes no sense; None is none."""
    if not 0 < abs(duration) <= LONGEST_S:
        raise SimulationError(f"duration = {duration} s: a time other than 0 and up to {LONGEST_S:.0e} s is expected")
    for name, value in positive.items():
        if value is not None and not (math.isfinite(value) and value > 0):
            raise SimulationError(f"{name} = {value}: a number above 0 is expected")


def _to_tolerance(problem: Problem, wanted: _Wanted, tolerance: float, step: float | None) -> tuple[Run, Accuracy]:
    """Shorten the step until the estimated error is within the tolerance, or no shorter step helps.

    Returns:
        The run within the tolerance, else the best one; its accuracy.
    """
    longest, order = longest_step(problem.scene, problem.model, problem.start, problem.scheme), problem.scheme.order
    pilot = None if step else pilot_of(problem, wanted.duration, tolerance, longest / ROOM)
    h = step or min(pilot.step if pilot else longest / ROOM, abs(wanted.duration) / 2)
    with_three, is_disc = step is not None, isinstance(problem.model.magnet, Disc)
    best: tuple[Run, Accuracy] | None = None
    smallest, failed, tries = math.inf, 0, 0
    while True:
        tries += 1
        run = _run(problem, wanted, h, None if with_three or is_disc else longest)
        found = None if with_three else _errors_by_two(problem, run, h, pilot)
        if found is None:
            if not with_three and h > longest * LONGEST_SHARE_OF_THREE:
                with_three, h = True, longest * LONGEST_SHARE_OF_THREE
                continue
            with_three, found = True, _errors(problem, run, h)
        of_steps, of_nodes = found
        position, axis = (float(error) for error in of_steps + of_nodes)
        accuracy = Accuracy(position, axis, tolerance, problem.scheme.name, h, run.steps, float(max(of_nodes)), tries)
        worst = float(max(of_steps))
        if best is None or worst <= 0.5 * smallest:
            best, smallest, failed = (run, accuracy), worst, 0
        else:
            failed += 1
        if accuracy.reached:
            return run, accuracy
        if worst <= tolerance / 2:  # the rest is the nodes', of a magnet that has come near the base
            return run, accuracy
        if step or failed == MAX_FAILED_REFINEMENTS or h < longest * SMALLEST_STEP_SHARE:
            return best
        h *= min(max(0.9 * (tolerance / worst) ** (1 / order), 0.1), 0.7)


def _errors_by_two(problem: Problem, run: Run, step: float, pilot: Pilot | None) -> tuple[Array, Array] | None:
    """Estimate the error of the last state from the run beside it.

    Returns:
        As `_errors`; None where the scheme's order may not be reached.
    """
    if run.beside is None:
        return None
    begin, end = float(problem.start[TIME]), run.states[-1]
    if _crosses_kink(problem, run, _mean_step(problem, run.step_power, step)):
        return None
    apart = abs(run.beside.step_power / run.step_power - 1)
    errors = np.array([np.linalg.norm(end[part] - run.beside.end[part]) for part in (R, N)]) / apart
    expected = pilot.error_at(end[TIME] - begin) * run.step_power if pilot else math.inf
    if not max(errors) <= MOST_GROWTH * expected:  # neither where it is no number
        return None
    return SAFETY_FACTOR * errors + rounding_error(problem.scheme, run.steps, end), np.zeros(2)


def _mean_step(problem: Problem, power: float, step: float) -> float:
    """Return the mean step of a run [s]; that of a triggered drive is shorter than the one that it is made from."""
    return step if problem.triggered else power ** (1 / problem.scheme.order)


def _stops_beside(
    problem: Problem, until: float, mean_step: float, power: float, longest: float
) -> tuple[Stops, float]:
    """Return the stops of a second run, with longer steps where these are short enough, and its step_power."""
    for length in (min(2 * mean_step, longest), mean_step / 2):
        stops = problem.stops(until, length)
        its_power = step_power(stops, problem.scheme.order)
        if its_power >= LEAST_RATIO * power:
            break
    return stops, its_power


def _errors(problem: Problem, run: Run, step: float) -> tuple[Array, Array]:
    """Estimate the error of the last state, from the same motion with longer steps, and with fewer nodes in a magnet.

    Returns:
        The error that the steps make, and the one that the nodes of a magnet of finite size make; each of place [m]
        and axis [rad], shape (2,).
    """
    end = run.states[-1]
    twice, four, length = _coarser_ends(problem, end[TIME], step)
    rounding = rounding_error(problem.scheme, run.steps, end)
    order = None if _crosses_kink(problem, run, length) else problem.scheme.order
    of_steps = rounding + [estimate(end[part], twice[part], four[part], order) for part in (R, N)]
    of_nodes = np.zeros(2)
    if isinstance(problem.model.magnet, Disc):
        fewer, fewest = (_state_with_steps(problem.with_nodes(-less), end[TIME], length) for less in (1, 2))
        of_nodes += [estimate(twice[part], fewer[part], fewest[part], NODES_ORDER) for part in (R, N)]
    if run.fell is not None:  # the error of the place, over the speed across the limit, is an error of the fall's time
        speed = float(exit_speeds(end[None], np.array([run.fell.name == "height"]))[0])
        turning = float(np.linalg.norm(np.cross(end[L], end[N]))) * problem.model.body.inverse_transverse
        late = np.array([np.linalg.norm(end[V]), turning]) / speed
        of_steps, of_nodes = of_steps + of_steps[0] * late, of_nodes + of_nodes[0] * late
    finite = np.all(np.isfinite(of_steps + of_nodes))
    return (of_steps, of_nodes) if finite else (np.full(2, math.inf), np.zeros(2))


#: States at most so far apart [s] show whether a spin passes zero between them.
_CLOSE_S = 0.0101


def _crosses_kink(problem: Problem, run: Run, step: float) -> bool:
    """Return whether the spin, or that of loose washers, passes zero under a drag that is not smooth there."""
    if not has_kink(problem.model.drag):
        return False
    states = run.states
    if np.abs(np.diff(states[:, TIME])).max() > _CLOSE_S:
        stops = run.stops if run.fell is None else problem.stops(states[-1, TIME], step)
        states = integrate_each_step(problem, stops)
    scene = problem.scene
    spins = both_spins(states, scene.top.inertia_axial_kg_m2, scene.washers.inertia_kg_m2)
    return bool(np.any(comes_near_zero(spins)))


def _coarser_ends(problem: Problem, until: float, step: float) -> tuple[Array, Array, float]:
    """Integrate up to a time with steps twice and four times as long, to estimate the error from.

    If a fall or the next kink of the drive leaves no room for longer steps, half of the step serves as both.

    Returns:
        The two states, shape (18,) each, and the shorter of their steps [s].
    """
    begin = float(problem.start[TIME])
    lasted = abs(until - begin)
    pieces = 1 + kinks(problem.scene.drive, min(begin, until), max(begin, until)).size
    if not problem.triggered and lasted / pieces > MIN_STEPS_FOR_DOUBLING * step:
        return _state_with_steps(problem, until, 2 * step), _state_with_steps(problem, until, 4 * step), 2 * step
    length = min(step, lasted) / 2
    half = _state_with_steps(problem, until, length)
    return half, half, length


def _state_with_steps(problem: Problem, until: float, step: float) -> Array:
    """Return the state at a time, shape (18,), integrated with steps of this length [s] and without an escape."""
    return integrate_to_end(problem, problem.stops(until, step))


# --- one run at one step ---


def _run(problem: Problem, wanted: _Wanted, step: float, longest: float | None = None) -> Run:
    """Integrate once, with steps up to `step` [s]; beside it a second time, if the longest of its steps is given."""
    begin = float(problem.start[TIME])
    samples, until = _samples(begin, wanted.duration, wanted.rate), begin + wanted.duration
    stops = problem.stops(until, step, samples, escape=problem.escape, progress=wanted.progress)
    if wanted.events:
        stops = stop_after_each_step(stops)
    power = step_power(stops, problem.scheme.order)
    states = stops.states  # found by following the motion, or None
    fell = None if states is None else fall_after(problem, states, stops)
    other, its_power = None, math.nan
    if longest is not None and fell is None:
        other, its_power = _stops_beside(problem, until, _mean_step(problem, power, step), power, longest)
    if states is None:
        states, fell, steps, end = integrate(problem, stops, wanted.progress, other)
    else:
        steps, end = int(stops.counts.sum()), integrate_to_end(problem, other) if other else None
    if fell is not None:
        states = np.concatenate([states, fell.state[None]])
    found = _events(problem, states, stops, wanted.events) if wanted.events else ()
    kept = states[_are_wanted(states[:, TIME], samples, abs(wanted.duration) * 1e-11)]
    beside = None if end is None else Beside(end, its_power)
    return Run(kept, fell, found, steps, power, replace(stops, states=None), beside)


def _are_wanted(times: Array, samples: Array, apart: float) -> NDArray[np.bool_]:
    """Return whether each time is a sample, the first or the last one, shape (n,).

    A kink within `apart` [s] of a sample, which is rounding, counts as that sample.
    """
    if samples.size == 0:
        ends = np.zeros(times.size, dtype=np.bool_)
        ends[0] = ends[-1] = True
        return ends
    wanted = np.sort(np.concatenate([samples, times[[0, -1]]]))
    after = np.clip(np.searchsorted(wanted, times), 1, wanted.size - 1)
    return np.asarray(np.minimum(np.abs(wanted[after] - times), np.abs(times - wanted[after - 1])) <= apart)


def _samples(begin: float, duration: float, rate: float | None) -> Array:
    """Return the times of the samples [s], without the first and the last state."""
    if rate is None:
        return NO_TIMES
    inside = np.arange(1, math.ceil(abs(duration) * rate * (1 - 1e-12))) / rate
    return np.asarray(begin + math.copysign(1.0, duration) * inside)


def _events(problem: Problem, states: Array, stops: Stops, events: Watch) -> tuple[Event, ...]:
    """Locate all zeros of the events' functions, in the order of their time."""

    def on(function: Callable[[Trajectory], Array], rows: Array) -> Array:
        nothing = Accuracy(0, 0, 0, "", 0, 0)
        return np.asarray(function(Trajectory(problem.scene, rows, problem.model, nothing)), dtype=np.float64)

    found = []
    for name, function in events.items():
        values = on(function, states)
        for i in np.flatnonzero(np.signbit(values[1:]) != np.signbit(values[:-1])):
            interval = stops.part(int(i), int(i) + 1)
            length = float(states[i + 1, TIME] - states[i, TIME])
            value = lambda state, function=function: float(on(function, state[None])[0])  # noqa: E731
            found.append(locate_zero(name, states[i], length, one_step_map(problem, interval), value))
    return tuple(sorted(found, key=lambda event: event.time))


# --- the spin alone ---


def spin_alone(scene: Scene, duration: float, tolerance: float, rate: float | None) -> Trajectory:
    """Compute the spin in closed form; the top stays where it starts, and nothing is integrated.

    Raises:
        SimulationError: the spin was infinite at some time on the way back.
    """
    start = start_of(scene)
    times = np.concatenate([[0.0], _samples(0.0, duration, rate), [duration]])
    states = np.tile(start, (times.size, 1))
    states[:, TIME] = times
    spin = abs(start[CLOCK])
    if scene.drag.law != "none" and spin > 0 and any(scene.drag.constants):
        longest_ago = since_infinity(scene.drag.law, spin, scene.drag.constants)
        if -duration >= longest_ago:
            raise SimulationError(
                f"duration = {duration} s: under this drag the spin was infinite {longest_ago:.6g} s ago; a shorter "
                "way back is expected"
            )
        now = DECAYS[scene.drag.law].after(spin, times, *scene.drag.constants)
        states[:, L] = start[L] * (now / spin)[:, None]
        states[:, CLOCK] = np.copysign(now, start[CLOCK])
    return Trajectory(scene, states, model_of(scene), Accuracy(0.0, 0.0, tolerance, "closed form", duration, 0))
