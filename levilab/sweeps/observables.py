"""What is observed at the points of a sweep, by name: a row a column, and the function that fills the columns.

The definitions are those of `levilab simulate`: survival, the spin at the fall and the error from the simulator, lines
and lock from `levilab.motion`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from levilab.errors import UsageError
from levilab.motion.lines import AxisLines, lines_of, rate_for
from levilab.motion.lock import LAST_SHARE, RATE_HZ, SHORTEST_S, can_lock, is_locked
from levilab.motion.summary import changing_energy, height_range
from levilab.simulator.energy import energy
from levilab.simulator.ensemble import simulate_many
from levilab.simulator.keys import nearest
from levilab.simulator.model import model_of
from levilab.simulator.single import simulate
from levilab.simulator.start import start_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from levilab.simulator.scene import Scene
    from levilab.sweeps.plan import Plan

#: What must be simulated: the ends alone, those and once more with longer steps, or samples on the way.
Need = Literal["ends", "errors", "samples"]


@dataclass(frozen=True)
class Observable:
    """One column of results.

    Attributes:
        name: with its unit at the end.
        unit: "1" for a number without one.
        meaning: one sentence; where a value is missing, it says when.
        dtype: of its array; a missing float is NaN.
        needs: what must be simulated for it.
    """

    name: str
    unit: str
    meaning: str
    dtype: str
    needs: Need


#: A line's columns begin with this → its name in `levilab.motion.lines`.
LINES = {
    "precession": "precession",
    "nutation": "nutation",
    "swing": "swing sideways",
    "back_swing": "swing sideways, backwards",
    "drive": "drive",
    "wobble": "wobble, once a turn",
}


def _columns_of_line(start: str, name: str) -> tuple[Observable, Observable]:
    of = f"of the axis's line that is called {name}; NaN where there is none"
    return (
        Observable(f"{start}_line_hz", "Hz", f"Frequency {of}.", "float64", "samples"),
        Observable(f"{start}_line_rad", "rad", f"Amplitude {of}.", "float64", "samples"),
    )


OBSERVABLES: dict[str, Observable] = {
    one.name: one
    for one in (
        Observable("survived", "1", "Whether the top is still up at the end.", "bool", "ends"),
        Observable(
            "lifetime_s", "s", "Time from the start to the fall; NaN of a top that is still up.", "float64", "ends"
        ),
        Observable(
            "fall_spin_hz", "Hz", "Spin at the moment of the fall; NaN of a top that is still up.", "float64", "ends"
        ),
        Observable(
            "energy_error",
            "1",
            "Change of the energy from start to end, relative; NaN where drag, drive or washers change it.",
            "float64",
            "ends",
        ),
        Observable(
            "position_error_m", "m", "Estimated error of the place at the end, or at the fall.", "float64", "errors"
        ),
        Observable("height_spread_m", "m", "Highest less lowest place; NaN of a top that falls.", "float64", "samples"),
        Observable(
            "locked",
            "1",
            "Whether the top is up and its body slips by no turn behind the drive in the last half of the time.",
            "bool",
            "samples",
        ),
        *(column for start, name in LINES.items() for column in _columns_of_line(start, name)),
    )
}

#: Short names of several columns.
GROUPS: dict[str, tuple[str, ...]] = {
    "lines": tuple(name for name in OBSERVABLES if name.endswith(("_line_hz", "_line_rad"))),
}

#: Names that people type: each is a column, or several.
NAMES = (*(name for name in OBSERVABLES if name not in GROUPS["lines"]), *GROUPS)


def columns_of(names: Iterable[str]) -> tuple[Observable, ...]:
    """Return the columns that these observables fill, each once.  Raises UsageError for a name that is unknown."""
    found: dict[str, Observable] = {}
    for name in names:
        columns = GROUPS.get(name, (name,))
        if columns[0] not in OBSERVABLES:
            near = nearest(name, [*NAMES, *OBSERVABLES])
            meant = f"did you mean {near}? Known" if near else "known"
            raise UsageError("observe", f"there is no such observable; {meant} are {', '.join(NAMES)}", value=name)
        found |= {column: OBSERVABLES[column] for column in columns}
    return tuple(found.values())


def check_observables(plan: Plan) -> None:
    """Refuse to observe what no point of the plan can show.  Raises UsageError."""
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
            "locked needs a drive that lasts and a moment across the axis "
            "(drive.waveform, drive.amplitude_t and top.moment_tilt, as in the scene driven)",
            value="locked",
        )


def observe(plan: Plan, values: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Simulate some points and observe them.

    With the plan's `step_share`, the result of each point depends on its own numbers alone.

    Args:
        plan: its axes are not looked at.
        values: key → values of these points.

    Returns:
        Column → values, in the shape to which the values of the keys broadcast.
    """
    columns = columns_of(plan.observables)
    needs = {column.needs for column in columns}
    found = _from_samples(plan, values, columns) if "samples" in needs else _from_ends(plan, values, columns)
    return {column.name: np.asarray(found[column.name], dtype=column.dtype) for column in columns}


def _from_ends(
    plan: Plan, values: Mapping[str, NDArray[Any]], columns: tuple[Observable, ...]
) -> dict[str, NDArray[Any]]:
    names = {column.name for column in columns}
    ends = simulate_many(
        plan.scene,
        values,
        plan.duration_s,
        tolerance=plan.tolerance,
        step_share=plan.step_share,
        cores=1,
        errors="position_error_m" in names,
    )
    found = {
        "survived": ends.survived,
        "lifetime_s": np.where(ends.survived, np.nan, ends.time),
        "fall_spin_hz": np.where(ends.survived, np.nan, ends.spin_hz),
        "position_error_m": ends.position_error,
    }
    if "energy_error" in names:
        scenes = _scenes(plan.scene, ends.values)
        states = ends.states.reshape(-1, ends.states.shape[-1])
        errors = [_energy_error(scene, state) for scene, state in zip(scenes, states, strict=True)]
        found["energy_error"] = np.reshape(errors, ends.survived.shape)
    return found


def _scenes(scene: Scene, values: Mapping[str, NDArray[Any]]) -> list[Scene]:
    """Return the scene of each point, in the order of the flat index."""
    arrays = np.broadcast_arrays(*values.values())
    return [
        scene.changed({key: array.flat[i].item() for key, array in zip(values, arrays, strict=True)})
        for i in range(arrays[0].size)
    ]


def _energy_error(scene: Scene, end: NDArray[np.float64]) -> float:
    if changing_energy(scene):
        return math.nan
    start = start_of(scene)
    model = model_of(scene, start[:3])
    first, last = energy(scene, model, np.array([start, end]))
    return abs(float(last - first)) / (abs(float(first)) or 1.0)


def _from_samples(
    plan: Plan, values: Mapping[str, NDArray[Any]], columns: tuple[Observable, ...]
) -> dict[str, NDArray[Any]]:
    names = tuple(column.name for column in columns)
    shape = np.broadcast_shapes(*(np.shape(one) for one in values.values()))
    rows = [_observe_motion(plan, scene, names) for scene in _scenes(plan.scene, values)]
    return {name: np.reshape([row[name] for row in rows], shape) for name in names}


def _observe_motion(plan: Plan, scene: Scene, names: tuple[str, ...]) -> dict[str, Any]:
    with_lines = any(name in GROUPS["lines"] for name in names)
    rate = max(rate_for(scene) if with_lines else 0.0, 2 * RATE_HZ if "height_spread_m" in names else RATE_HZ)
    motion = simulate(scene, plan.duration_s, tolerance=plan.tolerance, rate=rate)
    low, high = height_range(motion)
    return {
        "survived": motion.survived,
        "lifetime_s": math.nan if motion.survived else motion.time[-1],
        "fall_spin_hz": math.nan if motion.survived else motion.spin_hz[-1],
        "energy_error": _energy_error(scene, motion.states[-1]) if "energy_error" in names else math.nan,
        "position_error_m": motion.accuracy.position,
        "height_spread_m": high - low if motion.survived else math.nan,
        "locked": "locked" in names and bool(is_locked(scene, motion.states, survived=motion.survived)),
        **_line_columns(lines_of(motion) if with_lines else AxisLines()),
    }


def _line_columns(found: AxisLines) -> dict[str, float]:
    """Return the columns of the lines, NaN for a line that was not found."""
    named = {line.name: line for line in found.lines}
    columns = {}
    for start, name in LINES.items():
        line = named.get(name)
        columns[f"{start}_line_hz"] = line.frequency if line else math.nan
        columns[f"{start}_line_rad"] = line.amplitude if line else math.nan
    return columns
