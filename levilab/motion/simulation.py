"""The one simulation of the command: an request → the motion, its summary, and a run folder."""

import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from levilab.computer import utc_now
from levilab.errors import UsageError
from levilab.files import writing
from levilab.interruption import interruption_postponed
from levilab.motion.lines import rate_for
from levilab.motion.summary import Summary, as_document, summarise
from levilab.runs.events import RunEvent
from levilab.runs.run import STATES, RunRecord
from levilab.runs.writer import RunWriter
from levilab.simulator.compilation import announce_compilation
from levilab.simulator.scene import Scene
from levilab.simulator.single import LONGEST_S, simulate
from levilab.simulator.trajectory import Trajectory
from levilab.software import software_versions
from levilab.texts.text import Text

FIGURE = "motion.png"

#: States at most: 300 MB of them.
MOST_STATES = 2_000_000
#: Duration that is simulated before the clock starts, so that the kernels are compiled or read from the disk [s].
_FIRST_S = 1e-3
#: Rows in one block of states.csv.
_ROWS = 1000

#: Columns of states.csv: name, unit, meaning, and its values for a motion.
COLUMNS: tuple[tuple[str, str, str, Callable[[Trajectory], Any]], ...] = (
    ("time_s", "s", "since the start; the last row is the end", lambda motion: motion.time),
    ("x_m", "m", "centre of mass, from the base's centre", lambda motion: motion.position[:, 0]),
    ("y_m", "m", "centre of mass, from the base's centre", lambda motion: motion.position[:, 1]),
    ("z_m", "m", "centre of mass, above the base's centre", lambda motion: motion.position[:, 2]),
    ("vx_m_s", "m/s", "velocity", lambda motion: motion.velocity[:, 0]),
    ("vy_m_s", "m/s", "velocity", lambda motion: motion.velocity[:, 1]),
    ("vz_m_s", "m/s", "velocity", lambda motion: motion.velocity[:, 2]),
    ("axis_x", "1", "the top's axis, a unit vector", lambda motion: motion.axis[:, 0]),
    ("axis_y", "1", "the top's axis, a unit vector", lambda motion: motion.axis[:, 1]),
    ("axis_z", "1", "the top's axis, a unit vector", lambda motion: motion.axis[:, 2]),
    ("spin_frequency_hz", "Hz", "turns about the axis per second, ω₃/2π", lambda motion: motion.spin_hz),
    ("energy_j", "J", "without the part of the drive's field", lambda motion: motion.energies),
)


@dataclass(frozen=True)
class SimulationRequest:
    """What is to be simulated: scene, duration [s], tolerance [m and rad], rate [states per second].

    Attributes:
        out: where a run folder is made, None for none.
    """

    scene: Scene
    duration: float = 30.0
    tolerance: float = 1e-7
    rate: float = 100.0
    out: Path | None = None


@dataclass(frozen=True)
class Simulation:
    """The results of a simulation.

    Attributes:
        summary: of the motion, with all its samples.
        folder: the run folder, if there is one.
        samples_per_state: each state of the request is one of this number of samples.
    """

    summary: Summary
    folder: Path | None
    samples_per_state: int = 1


def run_simulation(
    request: SimulationRequest,
    message: Callable[[str], None],
    progress: Callable[[float], None] | None = None,
    *,
    uses_states: bool = False,
) -> Simulation:
    """Simulate a motion, analyze and write it; an interrupted simulation leaves nothing behind.

    Args:
        request: scene, duration and accuracy.
        message: called with the name of a step that takes a moment.
        progress: called with the share that is done.
        uses_states: whether the states at this rate are used without a folder, too: too low a rate is then noted.

    Raises:
        UsageError, SimulationError: for what cannot be simulated.
        CannotWrite: the run folder cannot be written.
    """
    factor = _samples_per_state(request)
    if request.out is None:
        return Simulation(_simulate(request, factor, message, progress, uses_states=uses_states), None, factor)
    with (
        interruption_postponed() as admit_interruption,
        RunWriter.create(request.out, _record(request), STATES) as writer,
    ):
        try:
            admit_interruption()  # from here on the folder is taken away again
            summary = _simulate(request, factor, message, progress, uses_states=True)
            _write(summary, factor, writer)
        except BaseException:
            writer.discard()
            raise
    return Simulation(summary, writer.folder, factor)


def write_motion(summary: Summary, request: SimulationRequest, folder: Path) -> Path:
    """Write a motion that was simulated without a folder; returns its run folder, in this one.  Raises CannotWrite."""
    with RunWriter.create(folder, _record(request), STATES) as writer:
        _write(summary, _samples_per_state(request), writer)
    return writer.folder


def _samples_per_state(request: SimulationRequest) -> int:
    """Return the number of samples for each kept state, as the spectrum needs more than a file.  Checks the numbers."""
    for name, value in (("duration", request.duration), ("tolerance", request.tolerance), ("rate", request.rate)):
        if not 0 < value <= LONGEST_S:
            expected = Text("a number above 0 and up to {most:.0e} is expected", most=LONGEST_S)
            raise UsageError(name, expected, value=value)
    states = request.duration * request.rate
    if states > MOST_STATES:
        what = Text(
            "with `rate` = {rate:g} these are {states:.2g} states, at most {most} are kept: take `rate` = {less:s}",
            rate=request.rate, states=states, most=MOST_STATES, less=f"{MOST_STATES / request.duration:.2g}",
        )  # fmt: skip
        raise UsageError("duration", what, value=request.duration)
    wanted: int = math.ceil(rate_for(request.scene) / request.rate)
    return max(min(wanted, int(MOST_STATES / states)), 1)


def _simulate(
    request: SimulationRequest,
    factor: int,
    message: Callable[[str], None],
    progress: Callable[[float], None] | None,
    *,
    uses_states: bool,
) -> Summary:
    with announce_compilation(message), interruption_postponed():
        simulate(request.scene, min(_FIRST_S, request.duration), rate=None)
    begin = time.perf_counter()
    motion = simulate(
        request.scene, request.duration, tolerance=request.tolerance, rate=factor * request.rate, progress=progress
    )
    computing = time.perf_counter() - begin
    return summarise(motion, request.duration, request.rate, computing, uses_states=uses_states)


# --- the run folder ---


def _record(request: SimulationRequest) -> RunRecord:
    return RunRecord(
        experiment="simulate",
        status="running",
        started_utc=utc_now(),
        command_line=sys.argv,
        channels=[{"name": name, "unit": unit, "source": source} for name, unit, source, _ in COLUMNS],
        configuration={
            "scene": request.scene.as_table(),
            "duration_s": request.duration,
            "tolerance": request.tolerance,
            "rate_hz": request.rate,
        },
        software=software_versions(),
        note=request.scene.description,
        synthetic=True,
        synthetic_how=f"simulated: scene {request.scene.name or 'without a name'}",
    )


def _write(summary: Summary, factor: int, writer: RunWriter) -> None:
    # matplotlib, which a motion that is not written does not need
    from levilab.motion.figure import motion_figure
    from levilab.present.style import save_png

    rows = kept_rows(summary.motion, factor)
    writer.states(state_rows(summary.motion, rows))
    if summary.motion.fell is not None:
        writer.event(summary.motion.fell.time, RunEvent.FELL, f"the top {summary.fell}")
    with writing(f"could not write {FIGURE} in {writer.folder}", "free space, or choose another place with `out`"):
        save_png(motion_figure(summary), writer.folder / FIGURE)
    writer.finish("finished", simulation=as_document(summary) | {"states": len(rows)})


def kept_rows(motion: Trajectory, factor: int) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return each n-th sample, and the last one, which is the end."""
    return np.unique(np.append(np.arange(0, len(motion.time) - 1, factor), len(motion.time) - 1))


def state_rows(motion: Trajectory, rows: np.ndarray[Any, np.dtype[np.intp]]) -> Iterator[str]:
    """Yield lines of states.csv, some at a time, in full precision."""
    table = np.column_stack([values(motion) for _, _, _, values in COLUMNS])
    for first in range(0, len(rows), _ROWS):
        block = table[rows[first : first + _ROWS]].tolist()
        yield "\n".join(",".join(map(repr, row)) for row in block)
