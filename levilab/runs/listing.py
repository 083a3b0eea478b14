"""The list of runs: when, what, status, length."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from rich.markup import escape

from levilab.errors import DataError
from levilab.present.numbers import short_name
from levilab.present.terminal import new_table, terminal
from levilab.runs.run import READINGS, Run, find_runs

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import pandas as pd


@dataclass(frozen=True)
class Listed:
    """One run in the list.

    Attributes:
        path: its folder.
        started_utc: as in run.json.
        experiment: its name, ``?`` where run.json cannot be read.
        status: as of the run, or ``unreadable``.
        readings: how many there are.
        length_s: from time zero, or the first reading where that is not known, to the last reading or state; None
            where they have no times.
        synthetic: whether any of it was simulated or made up.
        note: as in run.json.
        problem: why it cannot be read.
        states: of a simulation, 0 for what was measured.
        scene: of a simulation, empty for what was measured.
        records: of the oscilloscope, where each has a reading.
    """

    path: str
    started_utc: str | None
    experiment: str
    status: str
    readings: int
    length_s: float | None
    synthetic: bool
    note: str
    problem: str = ""
    states: int = 0
    scene: str = ""
    records: int = 0

    @property
    def size(self) -> str:
        """How much there is, in words where it is not readings."""
        if self.states:
            return f"{self.states} states"
        return f"{self.records} records" if self.records else str(self.readings)


def list_runs(root: Path) -> list[Listed]:
    """Every run at or below a folder, oldest first; a broken one is listed with what is wrong.  Raises DataError."""
    if root.is_file():
        raise DataError(f"{root}: is a file; name the folder that holds the runs")
    if not root.is_dir():
        raise DataError(f"{root}: there is no such folder; levilab acquire writes runs into runs/")
    return sorted((_listed(folder) for folder in find_runs(root)), key=lambda run: (run.started_utc or "", run.path))


def _listed(folder: Path) -> Listed:
    try:
        run = Run.load(folder)
        frame = run.readings().frame if (folder / READINGS).exists() else None
    except DataError as error:
        return Listed(str(folder), None, "?", "unreadable", 0, None, synthetic=False, note="", problem=str(error))
    times = frame["time_s"] if frame is not None and len(frame) and "time_s" in frame else None
    simulation = _table(run.record.model_extra, "simulation")
    return Listed(
        path=str(folder),
        started_utc=run.record.started_utc,
        experiment=run.record.experiment,
        status=run.status,
        readings=0 if frame is None else len(frame),
        length_s=(_number(simulation, "end_s") or None) if times is None else _length(run, times),
        synthetic=run.record.synthetic,
        note=run.record.note,
        states=int(_number(simulation, "states")),
        scene=str(_table(run.record.configuration, "scene").get("name", "")),
        records=len(frame) if frame is not None and "record" in frame else 0,
    )


def _length(run: Run, times: pd.Series[float]) -> float:
    """From time zero to the last reading [s]; limits and sweeps have their first one long after it."""
    return float(times.iloc[-1] - (0.0 if run.record.time_zero_utc else times.iloc[0]))


def _table(of: dict[str, Any] | None, key: str) -> dict[str, Any]:
    """A table in run.json, empty if there is none."""
    found = (of or {}).get(key)
    return found if isinstance(found, dict) else {}


def _number(table: dict[str, Any], key: str) -> float:
    value = table.get(key)
    return float(value) if isinstance(value, int | float) else 0.0


#: Columns of a terminal from which on the list of runs shows notes.
ROOM_FOR_NOTES = 110


def print_runs(runs: Sequence[Listed], root: Path) -> None:
    """The list of runs, and below it what is wrong with the broken ones."""
    console = terminal()
    if not runs:
        console.print(f"no runs in {_harmless(str(root))}")
        return
    table = new_table(None, "when (UTC)", "run", "what", "status", "readings", "length", numbers=["readings", "length"])
    if with_notes := console.width >= ROOM_FOR_NOTES:
        table.add_column("note", no_wrap=True, overflow="ellipsis", max_width=console.width - 80)
    for run in runs:
        when = (run.started_utc or "—")[:16].replace("T", " ")
        scene = f" {run.scene}" if run.scene not in {"", run.experiment} else ""
        what = run.experiment + scene + (", synthetic" if run.synthetic else "")
        cells = [when, _below(run.path, root), what, run.status, run.size, _seconds(run.length_s)]
        notes = [run.note] if with_notes else []
        table.add_row(*(_harmless(text) for text in (*cells, *notes)))
    console.print(table)
    for run in runs:
        if run.problem:
            console.print(f"[yellow]note:[/yellow] {_harmless(run.problem)}")


def _seconds(length: float | None) -> str:
    return "—" if length is None else f"{length:.0f} s"


def _harmless(text: str) -> str:
    """A text of unknown origin as it is printed: no markup, nothing that steers the terminal."""
    return escape("".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text))


def _below(path: str, root: Path) -> str:
    """A run's path as seen from the folder that was searched."""
    below = PurePath(path).relative_to(root)
    return (below.parent / short_name(PurePath(path).name)).as_posix()
