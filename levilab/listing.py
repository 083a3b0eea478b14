"""The list of runs: when, what, status, length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from levilab.errors import DataError
from levilab.run import Run, find_runs

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True)
class Listed:
    """One run in the list.  length_s: from the first to the last reading; problem: why it cannot be read."""

    path: str
    started_utc: str | None
    experiment: str
    status: str
    readings: int
    length_s: float
    synthetic: bool
    note: str
    problem: str = ""


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
    return Listed(
        path=str(folder),
        started_utc=run.record.started_utc,
        experiment=run.record.experiment,
        status=run.status,
        readings=0 if frame is None else len(frame),
        length_s=0.0 if times is None else float(times.iloc[-1] - times.iloc[0]),
        synthetic=run.record.synthetic,
        note=run.record.note,
    )
