"""Many tops at once: different starts and parameters, in SIMD lanes and over the cores."""

from __future__ import annotations

import itertools
import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levilab.errors import SimulationError
from levilab.simulator.accuracy import NODES_ORDER, comes_near_zero, estimate, has_kink, longest_step
from levilab.simulator.energy import spins_of
from levilab.simulator.escape import at_the_crossing, crossed_height, exit_speeds, within_limits
from levilab.simulator.kernels.lanes import LANES, advance_many, numbers_of
from levilab.simulator.kernels.loads import Disc
from levilab.simulator.kernels.motion import LOOSE, STATE_SIZE, TIME, L, N, R, V
from levilab.simulator.keys import SceneError
from levilab.simulator.model import model_of
from levilab.simulator.problem import NO_LIMITS, Problem, integrate, integrate_to_end, scheme_for
from levilab.simulator.schemes import SCHEMES
from levilab.simulator.single import MIN_STEPS_FOR_DOUBLING, check, simulate
from levilab.simulator.start import start_of
from levilab.simulator.stops import stops_between

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from levilab.simulator.scene import Scene

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

#: The step of all tops is chosen on a few, simulated one by one: the corners of a map and so many evenly through it.
PILOTS = 6
#: How long these are simulated [s]; errors grow with the time, so they get this share of the tolerance.
PILOT_DURATION = 3.0
#: The largest part of its longest step that a top takes: runs at four times as much are compared with.
LARGEST_SHARE = 0.25
#: A spin below this [rad/s] may be turned through zero by the field; a top that floats is never as slow.
SLOW_RAD_S = 2 * math.pi * 5.0


@dataclass(frozen=True)
class Ensemble:
    """The ends of many motions.  All arrays have the shape of the values that were varied, states one axis more.

    Attributes:
        scene: what the tops have in common.
        values: what differs, by dotted keys.
        survived: whether a top is still up after `duration` [s].
        time: of the end, or of the escape [s].
        states: at the end, shape (…, 18).
        position_error: estimated [m], NaN if errors were not estimated.
        axis_error: likewise [rad].

    Where an error is larger than the tolerance, the motion was chaotic, and whether it survived is chance.
    """

    scene: Scene
    values: dict[str, NDArray[Any]]
    duration: float
    survived: NDArray[np.bool_]
    time: Array
    states: Array
    position_error: Array
    axis_error: Array

    @property
    def position(self) -> Array:
        """Places at the end, shape (…, 3) [m]."""
        return self.states[..., R]

    @property
    def axis(self) -> Array:
        """Axes at the end, shape (…, 3)."""
        return self.states[..., N]

    @property
    def spin_hz(self) -> Array:
        """Spins ω₃/2π at the end [Hz]."""
        along = np.sum(self.states[..., L] * self.states[..., N], axis=-1)
        washers = self.values.get("washers.inertia_kg_m2", np.array(self.scene.washers.inertia_kg_m2))
        inertia = self.values.get("top.inertia_axial_kg_m2", np.array(self.scene.top.inertia_axial_kg_m2))
        return np.asarray((along - self.states[..., LOOSE] * (washers > 0)) / (inertia - washers) / (2 * np.pi))


def simulate_many(
    scene: Scene,
    over: Mapping[str, ArrayLike],
    duration: float = 30.0,
    *,
    tolerance: float = 1e-7,
    step: float | None = None,
    step_share: float | None = None,
    cores: int | None = None,
    errors: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Simulate a scene for many values at once.

    Args:
        scene: what the tops have in common.
        over: dotted keys of the scene with their values, broadcast against each other.
        duration: of each motion [s].
        tolerance: wanted error of place [m] and axis [rad] at the end; the step is chosen for it, on a few of the tops.
        step: of all tops [s]; None: the tolerance decides it.
        step_share: the part of its own longest step that each top takes, from `step_share_of`; None: found on some of
            these tops.  With it, each top's result depends on its own numbers alone, to the last bit.
        cores: number of threads; None: one for each core of the machine.
        errors: estimate every top's error by a second, coarser run, which takes half as long again.
        progress: called with the share of the work that is done.

    Returns:
        The ends of the motions; arrays have the shape of the broadcast values.

    Raises:
        SceneError: a scene does not allow these keys or values.
        SimulationError: a number makes no sense.

    >>> import numpy as np
    >>> from levilab.simulator import preset, simulate_many
    >>> spins = np.array([18.0, 25.0, 30.0])
    >>> simulate_many(preset("undriven"), {"start.spin_hz": spins}, 5.0).survived
    array([False,  True,  True])
    """
    check(duration=duration, tolerance=tolerance, rate=None, step=step)
    if duration < 0:
        raise SimulationError(f"duration = {duration} s: many at once go forwards only")
    if scene.observed == "spin":
        raise SceneError("observed = spin: the spin alone has a closed form; many at once need observed = motion")
    keys, values = list(over), _broadcast(over)
    shape = values[0].shape
    tops = [
        _Top.of(scene.changed({key: _plain(v.flat[i]) for key, v in zip(keys, values, strict=False)}))
        for i in range(values[0].size)
    ]
    longest = np.array([one.longest for one in tops])
    if step:
        steps = np.full(len(tops), step)
    else:
        steps = longest * (step_share or _step_share([tops[i] for i in sorted(_pilots(shape))], duration, tolerance))
    ends = _Ends.empty(len(tops))
    threads = cores or os.cpu_count() or 1
    work = [part for group in _groups(tops) for part in _parts(group, threads)]
    with ThreadPoolExecutor(threads) as pool:
        for done, _ in enumerate(
            pool.map(lambda part: _advance(tops, part, duration, steps, ends, errors=errors), work), 1
        ):
            if progress is not None:
                progress(done / len(work))
    return Ensemble(
        scene,
        {key: np.array(v) for key, v in zip(keys, values, strict=False)},
        duration,
        ends.survived.reshape(shape),
        ends.states[:, TIME].reshape(shape),
        ends.states.reshape(*shape, STATE_SIZE),
        ends.position_error.reshape(shape),
        ends.axis_error.reshape(shape),
    )


def step_share_of(
    scene: Scene, over: Mapping[str, ArrayLike], duration: float = 30.0, *, tolerance: float = 1e-7
) -> float:
    """Choose the step of a whole map on a few of its tops, so that it can be computed in any parts.

    Args:
        scene: what the tops have in common.
        over: as for `simulate_many`, of the whole map; `grid` gives that of axes.  What broadcasts takes no memory.
        duration: of each motion [s].
        tolerance: wanted error of place [m] and axis [rad] at the end.

    Returns:
        The part of its own longest step that a top takes: an argument of `simulate_many`.

    Raises:
        SceneError, SimulationError: as `simulate_many`.

    >>> import numpy as np
    >>> from levilab.simulator.scene import preset
    >>> axes = {"start.spin_hz": np.linspace(20, 40, 5000), "top.mass_kg": np.linspace(0.0249, 0.0254, 2000)}
    >>> 0 < step_share_of(preset("undriven"), grid(axes), 1.0, tolerance=1e-6) <= 1
    True
    """
    check(duration=duration, tolerance=tolerance, rate=None, step=None)
    keys, values = list(over), _broadcast(over)
    some = [
        _Top.of(scene.changed({key: _plain(v.flat[i]) for key, v in zip(keys, values, strict=False)}))
        for i in sorted(_pilots(values[0].shape))
    ]
    return _step_share(some, duration, tolerance)


def grid(axes: Mapping[str, ArrayLike]) -> dict[str, NDArray[Any]]:
    """Return the values of axes, shape (n,) each, as arrays that broadcast to the map of all their combinations.

    >>> {key: values.shape for key, values in grid({"start.spin_hz": [20, 30, 40], "top.mass_kg": [0.025]}).items()}
    {'start.spin_hz': (3, 1), 'top.mass_kg': (1, 1)}
    """
    return {
        key: np.asarray(values).reshape(*(-1 if i == at else 1 for i in range(len(axes))))
        for at, (key, values) in enumerate(axes.items())
    }


def _broadcast(over: Mapping[str, ArrayLike]) -> list[NDArray[Any]]:
    """Broadcast the values of all keys to one shape; without a key there is one value.  Raises SimulationError."""
    if not over:
        return [np.zeros(1)]
    arrays = {key: np.asarray(values) for key, values in over.items()}
    try:
        return list(np.broadcast_arrays(*arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{key} {array.shape}" for key, array in arrays.items())
        raise SimulationError(
            f"these values do not fit together: {shapes}; shapes that broadcast are expected"
        ) from None


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


@dataclass(frozen=True)
class _Top:
    """One top.

    Attributes:
        problem: what is to be integrated.
        longest: the longest step that it allows [s].
        kinked: whether its drive is other than a sine that lasts.
    """

    problem: Problem
    longest: float
    kinked: bool

    @classmethod
    def of(cls, scene: Scene) -> _Top:
        start = start_of(scene)
        model = model_of(scene, start[R])
        problem = Problem(scene, model, start, scheme_for(None, model))
        kinked = model.drive is not None and (scene.drive.waveform != "sine" or scene.drive.off_s is not None)
        return cls(problem, longest_step(scene, model, start, problem.scheme), kinked)


@dataclass(frozen=True)
class _Ends:
    states: Array
    survived: NDArray[np.bool_]
    position_error: Array
    axis_error: Array

    @classmethod
    def empty(cls, n: int) -> _Ends:
        return cls(np.empty((n, STATE_SIZE)), np.zeros(n, dtype=np.bool_), np.full(n, np.nan), np.full(n, np.nan))


def _pilots(shape: tuple[int, ...]) -> set[int]:
    """Return flat indices into a map of this shape: its corners and some of the rest."""
    size = math.prod(shape)
    if size == 0:
        return set()
    corners = np.array(list(itertools.islice(itertools.product(*((0, n - 1) for n in shape)), 16)), dtype=np.intp)
    flat = np.ravel_multi_index(tuple(corners.T), shape) if shape else np.zeros(1, dtype=np.intp)
    return {int(i) for i in flat} | {round(i) for i in np.linspace(0, size - 1, PILOTS)}


def _step_share(pilots: list[_Top], duration: float, tolerance: float) -> float:
    """Return the part of its longest step that keeps a top's error within the tolerance, found on the pilots."""
    time = min(duration, PILOT_DURATION)
    shares = []
    for one in pilots:
        motion = simulate(one.problem.scene, time, tolerance=tolerance * time / duration, rate=None)
        if motion.accuracy.reached:
            shares.append(motion.accuracy.step / one.longest)
    return min([*shares, LARGEST_SHARE])


def _groups(tops: list[_Top]) -> Iterable[list[int]]:
    """Group the tops, as indices, by the kind of their model: each kind has a kernel of its own."""
    groups: dict[Any, list[int]] = {}
    for i, one in enumerate(tops):
        kind = (_kind(one.problem.model), one.problem.scheme.name, one.kinked, one.problem.escape)
        groups.setdefault(kind, []).append(i)
    return groups.values()


def _kind(model: Any) -> Any:
    if isinstance(model, np.ndarray):
        return model.tobytes()
    if isinstance(model, tuple):
        return (type(model).__name__, *(_kind(inner) for inner in model))
    return type(model).__name__


def _parts(group: list[int], threads: int) -> list[list[int]]:
    """Cut a group into pieces of work: enough to keep all threads busy, large enough to fill the lanes."""
    size = max(8 * LANES, math.ceil(len(group) / (8 * threads)))
    return [group[i : i + size] for i in range(0, len(group), size)]


def _advance(
    tops: list[_Top], part: list[int], duration: float, all_steps: Array, ends: _Ends, *, errors: bool
) -> None:
    some, steps = [tops[i] for i in part], all_steps[part]
    counts = np.maximum(np.ceil(duration / steps * (1 - 1e-12)), 1).astype(np.int64)
    problem = some[0].problem
    if some[0].kinked:
        states, survived = _integrate_singly(some, np.full(len(some), duration), steps, escape=True)
    else:
        starts = np.array([one.problem.start for one in some])
        states, taken = _integrate_in_lanes(some, starts, duration / counts, counts, problem.escape)
        survived = (taken == counts) & within_limits(states, problem.escape)
    if errors:
        ends.position_error[part], ends.axis_error[part] = _estimates(some, states, steps)
    late = np.flatnonzero(~survived)
    if late.size:
        if not some[0].kinked:
            fallen = [some[i] for i in late]
            states[late] = at_the_crossing(
                states[late], (duration / counts)[late], problem.escape, lambda s, h: _in_one_step(fallen, s, h)
            )
        _add_uncertain_moment([some[i] for i in late], states[late], np.array(part)[late], ends)
    ends.states[part], ends.survived[part] = states, survived


def _estimates(some: list[_Top], states: Array, steps: Array) -> tuple[Array, Array]:
    """Estimate the errors of places [m] and axes [rad] at the ends, shape (n,) each."""
    problem, lasted = some[0].problem, states[:, TIME]
    # if a fall or a kink of the drive leaves no room for longer steps, half of the step shows the error as well
    room = (lasted > MIN_STEPS_FOR_DOUBLING * steps) & ~np.array([one.kinked for one in some])
    lengths = [np.where(room, times * steps, np.minimum(steps, lasted) / 2) for times in (2, 4)]
    twice = _integrate_coarsely(some, lasted, lengths[0])
    four = _integrate_coarsely(some, lasted, lengths[1]) if np.any(room) else twice
    found = [estimate(states[:, part], twice[:, part], four[:, part], problem.scheme.order) for part in (R, N)]
    if has_kink(problem.model.drag):
        lost = _may_have_stopped(some, states)
        for error, part in zip(found, (R, N), strict=True):
            error[lost] = estimate(states[lost][:, part], twice[lost][:, part], four[lost][:, part], None)
    if isinstance(problem.model.magnet, Disc):
        fewer, fewest = (_integrate_coarsely(_with_nodes(some, -less), lasted, lengths[0]) for less in (1, 2))
        of_nodes = [estimate(twice[:, part], fewer[:, part], fewest[:, part], NODES_ORDER) for part in (R, N)]
        found = [a + b for a, b in zip(found, of_nodes, strict=True)]
    return found[0], found[1]


def _may_have_stopped(some: list[_Top], states: Array) -> NDArray[np.bool_]:
    """Whether the spin of each top, or that of its washers, may have passed zero on the way to its end.

    Only start and end are known: it may have, if the spin is slow at one of them, or has changed by half.
    """
    ways = [
        spins_of(one.problem.scene, np.array([one.problem.start, state]))
        for one, state in zip(some, states, strict=True)
    ]
    spins = np.stack(ways, axis=1)
    return np.asarray(np.any(comes_near_zero(spins) | (np.abs(spins).min(axis=0) < SLOW_RAD_S), axis=-1))


def _with_nodes(some: list[_Top], more: int) -> list[_Top]:
    """Return the same tops with so many more rings, layers and angles in their magnets."""
    return [replace(one, problem=one.problem.with_nodes(more)) for one in some]


def _add_uncertain_moment(some: list[_Top], states: Array, where: NDArray[np.intp], ends: _Ends) -> None:
    """Add to the errors of fallen tops what the error of the fall's time makes: the place's error over the speed."""
    height = crossed_height(states, some[0].problem.escape)
    time = ends.position_error[where] / exit_speeds(states, height)
    inverse = np.array([one.problem.model.body.inverse_transverse for one in some])
    ends.position_error[where] += time * np.linalg.norm(states[:, V], axis=1)
    ends.axis_error[where] += time * inverse * np.linalg.norm(np.cross(states[:, L], states[:, N]), axis=1)


def _in_one_step(some: list[_Top], states: Array, times: Array) -> Array:
    """Return the states that much later, or earlier [s], each in one step."""
    return _integrate_in_lanes(some, states, times, np.ones(len(some), dtype=np.int64), NO_LIMITS)[0]


def _integrate_coarsely(some: list[_Top], times: Array, steps: Array) -> Array:
    """Return the states at these times [s], with steps of these lengths [s] and without an escape."""
    if some[0].kinked:
        return _integrate_singly(some, times, steps, escape=False)[0]
    counts = np.maximum(np.ceil(times / steps), 1).astype(np.int64)
    starts = np.array([one.problem.start for one in some])
    return _integrate_in_lanes(some, starts, times / counts, counts, NO_LIMITS)[0]


def _integrate_in_lanes(
    some: list[_Top], starts: Array, steps: Array, counts: Counts, escape: tuple[float, float]
) -> tuple[Array, Counts]:
    """Integrate with the kernel that has lanes.  Returns the states at the ends and the steps taken."""
    scheme = SCHEMES[some[0].problem.scheme.name]
    numbers = np.array([numbers_of(one.problem.model) for one in some])
    states, taken = np.empty_like(starts), np.zeros(len(some), dtype=np.int64)
    model, a, b = some[0].problem.model, np.array(scheme.drifts), np.array(scheme.kicks)
    advance_many(model, starts, numbers, steps, counts, a, b, escape, states, taken)
    states[:, TIME] = starts[:, TIME] + steps * taken
    return states, taken


def _integrate_singly(some: list[_Top], times: Array, steps: Array, *, escape: bool) -> tuple[Array, NDArray[np.bool_]]:
    """Integrate top after top: with kinks in the drive, steps differ from top to top.

    Returns:
        The states at the ends, shape (n, 18), and whether each end was reached.
    """
    states, lasted = np.empty((len(some), STATE_SIZE)), np.ones(len(some), dtype=np.bool_)
    for i, one in enumerate(some):
        stops = stops_between(0.0, times[i], steps[i], one.problem.scene.drive)
        if escape:
            passed, fell, _ = integrate(one.problem, stops)
            states[i], lasted[i] = passed[-1] if fell is None else fell.state, fell is None
        else:
            states[i] = integrate_to_end(one.problem, stops)
    return states, lasted
