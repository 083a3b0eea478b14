"""Many tops at once: different starts and parameters, in SIMD lanes and over the cores."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.arrays import Array
from levilab.errors import LeftRange, SimulationError
from levilab.simulator.accuracy import NODES_ORDER, comes_near_zero, estimate, has_kink, rounding_error
from levilab.simulator.energy import both_spins, core_spin
from levilab.simulator.escape import at_the_crossing, crossed_height, exit_speeds
from levilab.simulator.kernels.columns import LANES
from levilab.simulator.kernels.lanes import advance_many
from levilab.simulator.kernels.loads import Bursts
from levilab.simulator.kernels.motion import STATE_SIZE, TIME, L, N, R, V
from levilab.simulator.kernels.pieces import DURATION, FIRST, HEIGHT, OFF, RADIUS, RATE, STEEP, STEP
from levilab.simulator.keys import SceneError
from levilab.simulator.scene import Scene
from levilab.simulator.single import MIN_STEPS_FOR_DOUBLING, check, simulate, simulate_at_step
from levilab.simulator.stops import MOST_KINKS, MOST_STEPS
from levilab.simulator.varied import Batch, batches, broadcast, scene_at

#: The step of all tops is chosen on a few, simulated one by one: the corners of a map and these between them.
PILOTS = 6
#: If all of those are lost where those that stay up are to decide, this number of others is tried, in groups.
MORE_PILOTS, PILOTS_IN_A_GROUP = 60, 12
#: How long these are simulated [s]; errors grow with the time, so they get this share of the tolerance.
PILOT_DURATION = 3.0
#: A top's run is compared with one at twice its step, and one at four times; or at less, where four are too long.
LEAST_LONGER, MOST_LONGER = 2.5, 4.0
#: The largest part of its longest step that a top takes.
LARGEST_SHARE = 1 / LEAST_LONGER
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
        sample_times: of the samples, shape (samples,) [s]; none without a rate.
        samples: columns of the states then, shape (…, samples, columns); NaN after an escape.

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
    sample_times: Array
    samples: Array

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
        washers = self.values.get("washers.inertia_kg_m2", self.scene.washers.inertia_kg_m2)
        inertia = self.values.get("top.inertia_axial_kg_m2", self.scene.top.inertia_axial_kg_m2)
        return core_spin(self.states, inertia, washers) / (2 * np.pi)


def simulate_many(
    scene: Scene,
    over: Mapping[str, ArrayLike],
    duration: float = 30.0,
    *,
    tolerance: float = 1e-7,
    step: float | None = None,
    step_share: float | None = None,
    rate: float | None = None,
    columns: slice | ArrayLike = slice(None),
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
        rate: samples per second, the first at the start; None: the ends alone.  Steps are shortened to divide the time
            between samples, so that samples lie on steps, and at the same times for all tops.
        columns: of the state (`kernels.motion`) that samples keep, such as R or [0, 1, 2]; they are what takes memory.
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
    check(duration=duration, tolerance=tolerance, rate=rate, step=step, step_share=step_share, cores=cores)
    _check_forwards(scene, duration)
    values = broadcast(over)
    shape = next(iter(values.values())).shape if values else (1,)
    groups = batches(scene, over)
    if not (step or step_share) and groups:
        step_share = _step_share(scene, over, duration, tolerance)
    which: Any = columns
    kept = np.arange(STATE_SIZE)[which] if rate else np.empty(0, dtype=np.intp)
    times = np.arange(math.floor(duration * rate * (1 + 1e-12)) + 1) / rate if rate else np.empty(0)
    ends = _Ends.empty(math.prod(shape))
    sampling = _Sampling(rate or 0.0, kept.astype(np.int64), np.full((math.prod(shape), times.size, kept.size), np.nan))
    threads = cores or os.cpu_count() or 1
    work = [part for group in groups for part in _parts(group, threads)]

    def advance(part: Batch) -> None:
        steps = np.full(part.longest.shape, step) if step else part.longest * (step_share or 1.0)
        if isinstance(part.model.drive, Bursts):
            alone = lambda where: scene_at(scene, values, where)  # noqa: E731
            _advance_one_by_one(alone, part, duration, steps, sampling=sampling, ends=ends, errors=errors)
            return
        _advance(part, duration, steps, sampling, ends, errors=errors)

    with ThreadPoolExecutor(threads) as pool:
        for done, _ in enumerate(pool.map(advance, work), 1):
            if progress is not None:
                progress(done / len(work))
    return Ensemble(
        scene,
        {key: np.array(column) for key, column in values.items()},
        duration,
        ends.survived.reshape(shape),
        ends.states[:, TIME].reshape(shape),
        ends.states.reshape(*shape, STATE_SIZE),
        ends.position_error.reshape(shape),
        ends.axis_error.reshape(shape),
        times,
        sampling.samples.reshape(*shape, times.size, kept.size),
    )


def _check_forwards(scene: Scene, duration: float) -> None:
    if duration < 0:
        raise SimulationError(f"duration = {duration} s: many at once go forwards only")
    if scene.observed == "spin":
        raise SceneError("observed = spin: the spin alone has a closed form; many at once need observed = motion")


def step_share_of(
    scene: Scene,
    over: Mapping[str, ArrayLike],
    duration: float = 30.0,
    *,
    tolerance: float = 1e-7,
    survivors_only: bool = False,
) -> float:
    """Choose the step of a whole map on a few of its tops, so that it can be computed in any parts.

    Args:
        scene: what the tops have in common.
        over: as for `simulate_many`, of the whole map; `grid` gives that of axes.  What broadcasts takes no memory.
        duration: of each motion [s].
        tolerance: wanted error of place [m] and axis [rad] at the end.
        survivors_only: whether the tolerance is that of tops that stay up alone.  A top that is thrown out tumbles, and
            its axis has a larger error at the same step; the time of its fall is hardly touched (decision 0018).

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
    check(duration=duration, tolerance=tolerance)
    _check_forwards(scene, duration)
    return _step_share(scene, over, duration, tolerance, survivors_only=survivors_only)


def grid(axes: Mapping[str, ArrayLike]) -> dict[str, NDArray[Any]]:
    """Return the values of axes, shape (n,) each, as arrays that broadcast to the map of all their combinations.

    >>> {key: values.shape for key, values in grid({"start.spin_hz": [20, 30, 40], "top.mass_kg": [0.025]}).items()}
    {'start.spin_hz': (3, 1), 'top.mass_kg': (1, 1)}
    """
    return {
        key: np.asarray(values).reshape(*(-1 if i == at else 1 for i in range(len(axes))))
        for at, (key, values) in enumerate(axes.items())
    }


@dataclass(frozen=True)
class _Ends:
    states: Array
    survived: NDArray[np.bool_]
    position_error: Array
    axis_error: Array

    @classmethod
    def empty(cls, n: int) -> _Ends:
        return cls(np.empty((n, STATE_SIZE)), np.zeros(n, dtype=np.bool_), np.full(n, np.nan), np.full(n, np.nan))


class _Sampling(NamedTuple):
    """Samples a second, the columns of the state that they keep, and where: shape (n, samples, columns)."""

    rate: float
    columns: NDArray[np.int64]
    samples: Array


class _Passed(NamedTuple):
    """How runs ended.

    Attributes:
        states: at the ends, or after the step in which a top escaped, shape (n, 18).
        survived: shape (n,).
        steps: the length of each one's last step [s], level and slope of the drive in it, shape (n, 3).
    """

    states: Array
    survived: NDArray[np.bool_]
    steps: Array


# --- the step ---


def _pilots(shape: tuple[int, ...]) -> set[int]:
    """Return flat indices into a map of this shape: its corners and some of the rest."""
    size = math.prod(shape)
    if size == 0:
        return set()
    corners = np.array(list(itertools.islice(itertools.product(*((0, n - 1) for n in shape)), 16)), dtype=np.intp)
    flat = np.ravel_multi_index(tuple(corners.T), shape) if shape else np.zeros(1, dtype=np.intp)
    return {int(i) for i in flat} | {round(i) for i in np.linspace(0, size - 1, PILOTS)}


def _step_share(
    scene: Scene, over: Mapping[str, ArrayLike], duration: float, tolerance: float, *, survivors_only: bool = False
) -> float:
    """Return the part of its longest step that keeps a top's error within the tolerance, found on a few of them."""
    values = broadcast(over)
    shape = next(iter(values.values())).shape if values else (1,)
    shares = _shares_of(scene, values, sorted(_pilots(shape)), duration, tolerance)
    found = shares.stayed + shares.lost
    if survivors_only:
        more = iter(_more_pilots(math.prod(shape)))
        while not shares.stayed and (pilots := next(more, None)):
            shares = _shares_of(scene, values, pilots, duration, tolerance)
        found = shares.stayed or found
    # no step suits a chaotic top; but if none keeps to the tolerance, it is smaller than the rounding allows
    return min([*(found or shares.failed), LARGEST_SHARE])


class _Shares(NamedTuple):
    """Parts of their longest steps that tops take: that stay up, that are lost, that do not reach the tolerance."""

    stayed: list[float]
    lost: list[float]
    failed: list[float]


def _more_pilots(size: int) -> list[list[int]]:
    """Return groups of flat indices in no step with the axes, which evenly spaced ones may be: all along one edge."""
    golden = (math.sqrt(5) - 1) / 2
    spread = [int(size * (golden * (k + 1) % 1.0)) for k in range(min(MORE_PILOTS, size))]
    return [sorted(set(spread[k : k + PILOTS_IN_A_GROUP])) for k in range(0, len(spread), PILOTS_IN_A_GROUP)]


def _shares_of(
    scene: Scene, values: Mapping[str, NDArray[Any]], pilots: list[int], duration: float, tolerance: float
) -> _Shares:
    some = {key: np.array([column.flat[i] for i in pilots], dtype=column.dtype) for key, column in values.items()}
    time = min(duration, PILOT_DURATION)
    found = _Shares([], [], [])
    for batch in batches(scene, some):
        for where, longest in zip(batch.where, batch.longest, strict=True):
            one = scene_at(scene, some, int(where))
            motion = simulate(one, time, tolerance=tolerance * time / duration, rate=None)
            shares = found.failed if not motion.accuracy.reached else found.stayed if motion.survived else found.lost
            shares.append(motion.accuracy.step / float(longest))
    return found


# --- the motion ---


def _parts(group: Batch, threads: int) -> list[Batch]:
    """Cut a group into pieces of work: enough to keep all threads busy, large enough to fill the lanes."""
    n = group.where.size
    size = max(8 * LANES, math.ceil(n / (8 * threads)))
    return [group.part(slice(i, i + size)) for i in range(0, n, size)]


def _advance(some: Batch, duration: float, steps: Array, sampling: _Sampling, ends: _Ends, *, errors: bool) -> None:
    """Simulate tops of one kind, and write into `ends` and samples at their places."""
    _check_counts(some, duration, steps)
    together = some.where[-1] - some.where[0] + 1 == some.where.size  # then samples are written where they belong
    samples = sampling.samples[some.where[0] : some.where[-1] + 1] if together else sampling.samples[some.where]
    passed = integrate_in_lanes(some, runs_of(some, duration, steps), sampling._replace(samples=samples))
    states = passed.states
    if errors:
        ends.position_error[some.where], ends.axis_error[some.where] = _estimates(some, states, steps)
    late = np.flatnonzero(~passed.survived)
    if late.size:
        fallen, last = some.part(late), passed.steps[late]
        states[late] = at_the_crossing(
            states[late], last[:, 0], _limits(fallen), lambda s, times: _in_one_step(fallen, s, times, last)
        )
        if errors:
            _add_uncertain_moment(fallen, states[late], ends)
    ends.states[some.where], ends.survived[some.where] = states, passed.survived
    if not together:
        sampling.samples[some.where] = samples


def _advance_one_by_one(
    scene_of: Callable[[int], Scene], some: Batch, duration: float, steps: Array, *, sampling: _Sampling, ends: _Ends,
    errors: bool,
) -> None:  # fmt: skip
    """Simulate tops that trigger their drive, as `_advance` does: each has pieces of its own, and no use for lanes."""
    for where, step in zip(some.where.tolist(), steps.tolist(), strict=True):
        try:
            run, found = simulate_at_step(scene_of(where), duration, step, sampling.rate or None, errors=errors)
        except LeftRange:  # as in lanes, where a state that is no number counts as outside
            ends.states[where] = np.nan
            continue
        ends.states[where], ends.survived[where] = run.states[-1], run.fell is None
        ends.position_error[where], ends.axis_error[where] = found
        samples = sampling.samples[where]
        kept = run.states[: len(samples) if run.fell is None else len(run.states) - 1, sampling.columns]
        samples[: len(kept)] = kept


def _check_counts(some: Batch, duration: float, steps: Array) -> None:
    """Raise SimulationError if a top would take too many steps, or its drive has too many corners."""
    if not np.all(duration / steps < MOST_STEPS):
        raise SimulationError(
            f"{duration / steps.min():.2g} steps of {steps.min():.2g} s would be needed, at most {MOST_STEPS:.0e} are "
            "taken: a shorter duration, a slower spin or heavier inertias are expected"
        )
    rate = some.runs[:, RATE].max()
    if 2 * rate * duration > MOST_KINKS:
        raise SimulationError(
            f"drive.frequency_hz = {rate:g}: it has {2 * rate * duration:.2g} corners in {duration:g} s, at most "
            f"{MOST_KINKS:.0e} are gone through: take a sine, a lower frequency or a shorter duration"
        )


def _limits(some: Batch) -> tuple[Array, Array]:
    """Return radius and height of each top's escape, shape (n,) [m]."""
    return some.runs[:, RADIUS], some.runs[:, HEIGHT]


def runs_of(some: Batch, durations: ArrayLike, steps: Array) -> Array:
    """Return the runs of tops for these durations, with steps no longer than these [s]."""
    runs = some.runs.copy()
    runs[:, DURATION], runs[:, STEP] = durations, steps
    return runs


def integrate_in_lanes(
    some: Batch, runs: Array, sampling: _Sampling | None = None, starts: Array | None = None
) -> _Passed:
    """Integrate tops of one kind, each its own run; from other states than their starts if these are given."""
    n = some.where.size
    passed = _Passed(np.empty((n, STATE_SIZE)), np.zeros(n, dtype=np.bool_), np.empty((n, 3)))
    rate, columns, samples = sampling or _Sampling(0.0, np.empty(0, dtype=np.int64), np.empty((n, 0, 0)))
    a, b = np.array(some.scheme.drifts), np.array(some.scheme.kicks)
    begin = some.starts if starts is None else starts
    advance_many(some.model, begin, some.numbers, runs, a, b, *passed, rate, columns, samples)
    return passed


def _integrate_coarsely(some: Batch, times: Array, steps: Array) -> Array:
    """Return the states at these times [s], with steps of these lengths [s] and without an escape."""
    runs = runs_of(some, times, steps)
    runs[:, RADIUS], runs[:, HEIGHT] = math.inf, -math.inf
    return integrate_in_lanes(some, runs).states


def _in_one_step(some: Batch, states: Array, times: Array, last: Array) -> Array:
    """Return the states that much later, or earlier [s], each in one step, under the drive of the last step."""
    runs = runs_of(some, times, np.full(times.shape, math.inf))
    runs[:, RADIUS], runs[:, HEIGHT], runs[:, RATE], runs[:, OFF] = math.inf, -math.inf, 0.0, math.inf
    runs[:, FIRST], runs[:, STEEP] = last[:, 1], last[:, 2]
    return integrate_in_lanes(some, runs, starts=states).states


# --- the errors ---


def _estimates(some: Batch, states: Array, steps: Array) -> tuple[Array, Array]:
    """Estimate the errors of places [m] and axes [rad] at the ends, shape (n,) each."""
    lasted = states[:, TIME]
    off = some.runs[:, OFF]
    pieces = 1 + np.floor(2 * some.runs[:, RATE] * np.minimum(lasted, off)) + (off < lasted)
    # if a fall or the next kink of the drive leaves no room for longer steps, half of the step shows the error as well
    room = lasted / pieces > MIN_STEPS_FOR_DOUBLING * steps
    longer = np.clip(some.longest / steps, LEAST_LONGER, MOST_LONGER)
    lengths = [np.where(room, times * steps, np.minimum(steps, lasted) / 2) for times in (2, longer)]
    twice = _integrate_coarsely(some, lasted, lengths[0])
    coarse = _integrate_coarsely(some, lasted, lengths[1]) if np.any(room) else twice
    order = some.scheme.order
    found = np.array([estimate(states[:, part], twice[:, part], coarse[:, part], order, longer) for part in (R, N)])
    found += rounding_error(some.scheme, lasted / steps, states)
    if has_kink(some.model.drag):
        lost = _may_have_stopped(some, states)
        for error, part in zip(found, (R, N), strict=True):
            error[lost] = estimate(states[lost][:, part], twice[lost][:, part], coarse[lost][:, part], None)
    if some.fewer:
        fewer, fewest = (_integrate_coarsely(replace(some, model=less), lasted, lengths[0]) for less in some.fewer)
        of_nodes = [estimate(twice[:, part], fewer[:, part], fewest[:, part], NODES_ORDER) for part in (R, N)]
        found += of_nodes
    return found[0], found[1]


def _may_have_stopped(some: Batch, states: Array) -> NDArray[np.bool_]:
    """Return whether the spin of each top, or that of its washers, may have passed zero on the way to its end.

    Only start and end are known: it may have, if the spin is slow at one of them, or has changed by half.
    """
    spins = both_spins(np.array([some.starts, states]), *some.inertias.T)
    return np.asarray(np.any(comes_near_zero(spins) | (np.abs(spins).min(axis=0) < SLOW_RAD_S), axis=-1))


def _add_uncertain_moment(some: Batch, states: Array, ends: _Ends) -> None:
    """Add to the errors of fallen tops what the error of the fall's time makes: the place's error over the speed."""
    height = crossed_height(states, _limits(some))
    time = ends.position_error[some.where] / exit_speeds(states, height)
    ends.position_error[some.where] += time * np.linalg.norm(states[:, V], axis=1)
    across = np.linalg.norm(np.cross(states[:, L], states[:, N]), axis=1)
    ends.axis_error[some.where] += time * some.transverse * across
