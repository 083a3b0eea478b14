"""The list of runs: when, what, status, length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from levilab.errors import DataError
from levilab.run import Run, find_runs

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True)
class Listed:
    """One run in the list.  length_s: from the first to the last reading or state; problem: why it cannot be read.

    states, scene: of a simulation, 0 and empty for what was measured.
    """

    path: str
    started_utc: str | None
    experiment: str
    status: str
    readings: int
    length_s: float
    synthetic: bool
    note: str
    problem: str = ""
    states: int = 0
    scene: str = ""

    @property
    def size(self) -> str:
        """How much there is, in words where it is not readings."""
        return f"{self.states} states" if self.states else str(self.readings)


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
        frame = run.readings().frame if run.count() else None
    except DataError as error:
        return Listed(str(folder), None, "?", "unreadable", 0, 0.0, synthetic=False, note="", problem=str(error))
    times = frame["time_s"] if frame is not None and "time_s" in frame else None
    simulation = _table(run.record.model_extra, "simulation")
    return Listed(
        path=str(folder),
        started_utc=run.record.started_utc,
        experiment=run.record.experiment,
        status=run.status,
        readings=0 if frame is None else len(frame),
        length_s=_number(simulation, "end_s") if times is None else float(times.iloc[-1] - times.iloc[0]),
        synthetic=run.record.synthetic,
        note=run.record.note,
        states=int(_number(simulation, "states")),
        scene=str(_table(run.record.configuration, "scene").get("name", "")),
    )


def _table(of: dict[str, Any] | None, key: str) -> dict[str, Any]:
    """A table in run.json, empty if there is none."""
    found = (of or {}).get(key)
    return found if isinstance(found, dict) else {}


def _number(table: dict[str, Any], key: str) -> float:
    value = table.get(key)
    return float(value) if isinstance(value, int | float) else 0.0
