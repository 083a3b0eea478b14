"""What is observed at the points of a sweep, by name: a row a column, and the function that fills the columns.

The definitions are those of `levilab simulate`: survival, the spin at the fall and the error from the simulator, lines
and lock from `levilab.motion`.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levilab.errors import UsageError
from levilab.motion.lines import AxisLines, lines_of_many, rate_for
from levilab.motion.lock import LAST_SHARE, RATE_HZ, SHORTEST_S, can_lock, keeps_phase, shows_lock
from levilab.motion.summary import changing_energy
from levilab.simulator.energy import core_spin, energy
from levilab.simulator.ensemble import Ensemble, simulate_many
from levilab.simulator.kernels.motion import STATE_SIZE, TIME, R
from levilab.simulator.model import model_of
from levilab.simulator.numbers import Numbers, ceil, largest
from levilab.simulator.scene import Scene
from levilab.simulator.start import start_of
from levilab.simulator.varied import broadcast, for_each, scene_at
from levilab.sweeps.plan import QUICKLY, Plan, chunk_shape
from levilab.sweeps.quantities import GROUPS, LINES, columns_of

Values = Mapping[str, NDArray[Any]]


#: Samples per second for the height, whose fastest motion is some Hz: its turning points are met to 0.5 % of the swing.
HEIGHT_RATE_HZ = 100.0
#: Samples per second for the highest spin, which swings about a drive at some tenths of 1 Hz.
SPIN_RATE_HZ = 10.0
#: Rates for lines are rounded up to multiples of this [Hz].
ROUND_HZ = 100.0
#: Greatest count of numbers in the samples of one call, and least number of points in it, which fills the lanes.
MOST_NUMBERS, FEWEST = 16_000_000, 32
#: Tops whose locks are looked at together: their samples stay in the processor's cache.
TOGETHER = 32
#: The column of a state that the height is.
HEIGHT = R.stop - 1


def check_observables(plan: Plan) -> None:
    """Raise UsageError for observables that no point of the plan can have."""
    names = {column.name for column in columns_of(plan.observables)}
    if plan.scene.observed == "spin":
        raise UsageError("observe", "the scene has observed = spin, which has a closed form; take observed = motion")
    if "locked" not in names:
        return
    needed = SHORTEST_S / LAST_SHARE
    if plan.duration_s < needed:
        expected = f"locked needs a duration of {needed:g} s or more: a slow slip does not show in less"
        raise UsageError("duration", expected, value=plan.duration_s)
    varied = {axis.key.split(".")[0] for axis in plan.axes} | {".".join(axis.key.split(".")[:2]) for axis in plan.axes}
    if not can_lock(plan.scene, plan.duration_s) and not varied & {"drive", "top.moment_tilt"}:
        raise UsageError(
            "observe",
            "locked needs a drive that lasts and a moment across the axis (drive.waveform, drive.amplitude_t and "
            "top.moment_tilt, as in the scene driven)",
            value="locked",
        )


def observe(plan: Plan, values: Values) -> dict[str, NDArray[Any]]:
    """Simulate some points and observe them.

    With the plan's `step_share`, the result of each point depends on its own numbers alone.

    Args:
        plan: its axes are not used.
        values: key → values of these points.

    Returns:
        Column → values, in the shape to which the values of the keys broadcast.
    """
    columns = columns_of(plan.observables)
    names = {column.name for column in columns}
    if not any(column.needs == "samples" for column in columns):
        found = _ends_of(plan, values, names)
    else:
        found = _ends_and_samples_of(plan, values, names)
    return {column.name: np.asarray(found[column.name], dtype=column.dtype) for column in columns}


def _ends_of(plan: Plan, values: Values, names: set[str], rate: float | None = None) -> dict[str, NDArray[Any]]:
    """Return the columns that come from ends; with a rate those that come from samples, too."""
    ends = simulate_many(
        plan.scene,
        values,
        plan.duration_s,
        tolerance=plan.tolerance,
        step_share=plan.step_share,
        rate=rate,
        columns=slice(None) if names & {"locked", "highest_spin_hz", *GROUPS["lines"]} else [HEIGHT],
        cores=1,
        errors="position_error_m" in names,
    )
    found = {
        "survived": ends.survived,
        "lifetime_s": np.where(ends.survived, np.nan, ends.time),
        "fall_spin_hz": np.where(ends.survived, np.nan, ends.spin_hz),
        "end_spin_hz": ends.spin_hz,
        "position_error_m": ends.position_error,
    }
    shape = ends.survived.shape
    if "energy_error" in names:
        found["energy_error"] = _energy_errors(ends).reshape(shape)
    if rate:
        found |= {name: np.reshape(column, shape) for name, column in _columns_of_samples(ends, names).items()}
    return found


def _ends_and_samples_of(plan: Plan, values: Values, names: set[str]) -> dict[str, NDArray[Any]]:
    """Return the columns of motions with samples, some points at a time, because samples take memory.

    The rate of a point's samples depends on its own numbers: steps are cut to fit between samples.
    """
    arrays = {key: array.ravel() for key, array in broadcast(values).items()}
    shape = np.broadcast_shapes(*(np.shape(one) for one in values.values()))
    size = math.prod(shape)
    rates = np.empty(size)
    for where, rate in for_each(plan.scene, arrays, lambda scene, _: _rate_for(scene, names)):
        rates[where] = rate
    found: dict[str, NDArray[Any]] = {}
    for rate in np.unique(rates).tolist():
        alike = np.flatnonzero(rates == rate)
        many = max(int(MOST_NUMBERS / (rate * plan.duration_s * STATE_SIZE)), FEWEST)
        for some in np.split(alike, range(many, alike.size, many)):
            part = _ends_of(plan, {key: array[some] for key, array in arrays.items()}, names, rate)
            for name, column in part.items():
                found.setdefault(name, np.empty(size, dtype=column.dtype))[some] = column
    return {name: column.reshape(shape) for name, column in found.items()}


def _rate_for(scene: Scene, names: set[str]) -> Any:
    """Return the samples per second that a point needs, rounded up so that many points have the same."""
    rate = HEIGHT_RATE_HZ if "height_spread_m" in names else RATE_HZ if "locked" in names else SPIN_RATE_HZ
    if names & set(GROUPS["lines"]):
        return largest(rate, ceil(rate_for(scene) / ROUND_HZ) * ROUND_HZ)
    return rate


def _energy_errors(ends: Ensemble) -> NDArray[np.float64]:
    """Return the changes of the energy from start to end, relative, in the order of the flat map."""
    states = ends.states.reshape(-1, STATE_SIZE)
    errors = np.full(len(states), math.nan)

    def error(scene: Scene, where: NDArray[np.intp]) -> Any:
        if changing_energy(scene):
            return math.nan
        starts = np.atleast_2d(start_of(scene))
        model = model_of(scene, tuple(starts[:, i].view(Numbers) for i in range(3)))
        first, last = (energy(scene, model, some) for some in (starts, states[where]))
        return np.abs(last - first) / np.where(first == 0, 1.0, np.abs(first))

    for where, found in for_each(ends.scene, ends.values, error):
        errors[where] = found
    return errors


def _columns_of_samples(ends: Ensemble, names: set[str]) -> dict[str, Any]:
    """Return the columns of motions that need their samples, each in the order of the flat map."""
    columns: dict[str, Any] = {}
    if "height_spread_m" in names:
        kept = min(HEIGHT, ends.samples.shape[-1] - 1)  # the only one, or one of all
        heights = ends.samples[..., kept].reshape(-1, ends.sample_times.size)
        last = ends.states[..., HEIGHT].ravel()
        spread = np.maximum(heights.max(axis=1), last) - np.minimum(heights.min(axis=1), last)
        columns["height_spread_m"] = np.where(ends.survived.ravel(), spread, np.nan)
    if "highest_spin_hz" in names:
        columns["highest_spin_hz"] = _highest_spins(ends)
    if "locked" in names:
        columns["locked"] = _are_locked(ends)
    if names & set(GROUPS["lines"]):
        motions = [_motion_of(ends, i) for i in range(ends.survived.size)]
        rows = [_line_columns(lines) for lines in lines_of_many(motions)]
        columns |= {name: [row[name] for row in rows] for name in GROUPS["lines"]}
    return columns


def _highest_spins(ends: Ensemble) -> NDArray[np.float64]:
    """Return the highest spin of each top, in the order of the flat map [Hz]."""
    samples = ends.samples.reshape(-1, *ends.samples.shape[-2:])
    highest = np.empty(len(samples))

    def spins(scene: Scene, where: NDArray[np.intp]) -> Any:
        axial, washers = (_column(one) for one in (scene.top.inertia_axial_kg_m2, scene.washers.inertia_kg_m2))
        return np.nanmax(np.abs(core_spin(samples[where], axial, washers)), axis=-1) / (2 * math.pi)

    for where, found in for_each(ends.scene, {key: column.ravel() for key, column in ends.values.items()}, spins):
        highest[where] = found
    return highest


def _column(number: Any) -> Any:
    """Return a number, or one of each top in a shape that goes with its samples."""
    return number[..., None] if isinstance(number, np.ndarray) else number


def _are_locked(ends: Ensemble) -> NDArray[np.bool_]:
    """Return whether each top is up and locked, in the order of the flat map."""
    locked = np.zeros(ends.survived.size, dtype=np.bool_)
    samples, states = ends.samples.reshape(-1, *ends.samples.shape[-2:]), ends.states.reshape(-1, STATE_SIZE)
    before = ends.sample_times < ends.duration * (1 - 1e-12)
    up = np.flatnonzero(ends.survived)
    for some in np.split(up, range(TOGETHER, up.size, TOGETHER)):
        values = {key: column.ravel()[some] for key, column in ends.values.items()}
        motions = np.concatenate([samples[some][:, before], states[some][:, None]], axis=1)

        def keep(scene: Scene, where: NDArray[np.intp], motions: NDArray[np.float64] = motions) -> Any:
            return can_lock(scene) and shows_lock(motions[where[0], :, TIME]) and keeps_phase(scene, motions[where])

        for where, found in for_each(ends.scene, values, keep):
            locked[some[where]] = found
    return locked


def _motion_of(ends: Ensemble, where: int) -> tuple[Scene, NDArray[np.float64]]:
    samples = ends.samples.reshape(-1, *ends.samples.shape[-2:])[where]
    end = ends.states.reshape(-1, STATE_SIZE)[where]
    states = np.vstack([samples[ends.sample_times < end[TIME] * (1 - 1e-12)], end])
    return scene_at(ends.scene, ends.values, where), states


def _line_columns(found: AxisLines) -> dict[str, float]:
    """Return the columns of the lines, NaN for a line that was not found."""
    named = {line.name: line for line in found.lines}
    columns = {}
    for start, name in LINES.items():
        line = named.get(name)
        columns[f"{start}_line_hz"] = line.frequency if line else math.nan
        columns[f"{start}_line_rad"] = line.amplitude if line else math.nan
    return columns


# --- rough cost of a plan, which determines the size of its chunks and no result ---

#: Seconds of motion that one core does in a second, with samples on the way.
SAMPLED = 4e4
#: Factors of the time: for an estimate of the error, in a field of higher order, in the exact one, for a disc, for a
#: drive that each top triggers for itself.
ERRORS, HIGHER_FIELD, EXACT_FIELD, DISC, TRIGGERED = 1.8, 2.5, 8.0, 400.0, 20.0
#: Time to find the lines of a top [s], and seconds of motion in which they are found in a second.
LINES_S, SEARCHED = 1.2e-3, 5e3
#: Time for each top before its motion begins [s].
OVERHEAD_S = 1e-5


def seconds_per_point(plan: Plan) -> float:
    """Return roughly how long one core takes for a point [s].

    The constants were measured on one busy core of 2026 (CPU time, the better of two, 32 to 512 tops of 3 to 30 s,
    tolerance 1e-6) with the scenes undriven and driven; measured times are within a factor of two of them.
    """
    columns = columns_of(plan.observables)
    needs = {column.needs for column in columns}
    rate = SAMPLED if "samples" in needs else QUICKLY
    rate /= ERRORS if "errors" in needs else 1.0
    rate /= {"paraxial-2": 1.0, "exact": EXACT_FIELD}.get(plan.scene.base.field, HIGHER_FIELD)
    rate /= DISC if plan.scene.top.magnet == "disc" else 1.0
    rate /= TRIGGERED if plan.scene.drive.waveform == "triggered" else 1.0
    has_lines = {column.name for column in columns} & set(GROUPS["lines"])
    lines = LINES_S + plan.duration_s / SEARCHED if has_lines else 0.0
    return OVERHEAD_S + plan.duration_s / rate + lines


def cut(plan: Plan) -> Plan:
    """Return the plan with chunks that take about `levilab.sweeps.plan.CHUNK_S` each."""
    return replace(plan, chunk=chunk_shape(plan.shape, 1 / seconds_per_point(plan)))
