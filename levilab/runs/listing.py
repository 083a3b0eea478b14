"""The list of runs: when, what, status, length."""

import math
import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from operator import methodcaller
from pathlib import Path
from typing import Any, NamedTuple

import pydantic_core
from rich.cells import cell_len
from rich.markup import escape

from levilab.errors import DataError
from levilab.formats.table import NO_READING
from levilab.present.numbers import short_name
from levilab.present.terminal import print_rows, terminal
from levilab.runs.find import RECORD, find_runs, must_be_searchable
from levilab.runs.run import READINGS, Run, RunRecord
from levilab.texts.text import Text, how_many, in_language, text_of


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
        synthetic: whether any of it is synthetic.
        group, note: as in run.json.
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
    group: str = ""

    @property
    def size(self) -> str:
        """The number of readings, or a description of other content."""
        if self.states:
            return f"{self.states} states"
        return how_many(self.records, "record") if self.records else str(self.readings)


def list_runs(root: Path) -> list[Listed]:
    """List every run at or below a folder, oldest first, the broken ones with their fault.  Raises DataError."""
    must_be_searchable(root)
    return sorted((_list_run(folder) for folder in find_runs(root)), key=lambda run: (run.started_utc or "", run.path))


def _list_run(folder: Path) -> Listed:
    try:
        run = _load(folder) or Run.load(folder)
        rows = _glance(run) or _read(run)
    except DataError as error:
        return Listed(str(folder), None, "?", "unreadable", 0, None, synthetic=False, note="", problem=text_of(error))
    simulation = _table(run.record.model_extra, "simulation")
    return Listed(
        path=str(folder),
        started_utc=run.record.started_utc,
        experiment=run.record.experiment,
        status=run.status,
        readings=rows.readings,
        length_s=(_number(simulation, "end_s") or None) if rows.length_s is None else rows.length_s,
        synthetic=run.record.synthetic,
        note=run.record.note,
        group=run.record.group,
        states=int(_number(simulation, "states")),
        scene=str(_table(run.record.configuration, "scene").get("name", "")),
        records=rows.readings if rows.of_records else 0,
    )


#: The longest file that is glanced at [bytes].
_GLANCED_BYTES = 1 << 20


def _load(folder: Path) -> Run | None:
    """Return a run as Run.load does in twice the time; None for one that is running or damaged."""
    content = _content(f"{folder}{os.sep}{RECORD}")
    try:
        record = RunRecord.model_validate(pydantic_core.from_json(content, allow_inf_nan=False)) if content else None
    except ValueError:
        return None
    return None if record is None or record.status == "running" else Run(folder, record, record.status)


def _content(path: str) -> bytes | None:
    """Return the content of a file; None where it is no file, as a pipe, or a long one."""
    try:
        about = os.stat(path)  # noqa: PTH116 - of ten thousand folders
        if not stat.S_ISREG(about.st_mode) or about.st_size >= _GLANCED_BYTES:
            return None
        with open(path, "rb", buffering=0) as stream:  # noqa: PTH123 - likewise
            return stream.read(about.st_size)
    except OSError:
        return None


class _Rows(NamedTuple):
    """What the list says of a run's readings.  length_s: None without any; of_records: each has an oscilloscope's."""

    readings: int
    length_s: float | None
    of_records: bool


def _read(run: Run) -> _Rows:
    """Read the readings as an analysis does.  Raises DataError."""
    if not (run.folder / READINGS).exists():
        return _Rows(0, None, of_records=False)
    table = run.readings()
    times = table.columns.get("time_s")
    length = None if times is None or not times.size else _length(run, float(times[0]), float(times[-1]))
    return _Rows(len(table), length, "record" in table.columns)


_COMMAS = methodcaller("count", b",")
#: The bytes of numbers as this program writes them.
_PLAIN = b"0123456789+-.,eE\n"


def _glance(run: Run) -> _Rows | None:
    """Return the same as `_read` in a twentieth of the time; None where a line is not as this program writes it."""
    content = _content(f"{run.folder}{os.sep}{READINGS}")
    if content is None:
        return None
    head, _, body = content.partition(b"\n")
    titles = head.decode("ascii", errors="replace").split(",")
    lines = body.split(b"\n")[:-1]  # a torn last line is left out
    commas = len(titles) - 1
    if (
        titles[0] != "time_s"
        or len(set(titles)) < len(titles)
        or not lines
        or body.translate(None, _PLAIN)
        or set(map(_COMMAS, lines)) != {commas}
    ):
        return None
    try:
        numbers = [*map(float, b",".join(lines).split(b","))]
    except ValueError:  # an empty field, which is a missed reading, or a damaged line
        return None
    if not (min(numbers) > -NO_READING and max(numbers) < NO_READING):
        return None
    return _Rows(
        len(lines),
        _length(run, numbers[0], numbers[-len(titles)]),
        "record" in titles and any(channel.get("name") == "record" for channel in run.record.channels),
    )


def _length(run: Run, first: float, last: float) -> float:
    """Return the time from time zero to the last reading [s]; the first of a limit or a sweep may be long after it."""
    return last - (0.0 if run.record.time_zero_utc else first)


def _table(of: dict[str, Any] | None, key: str) -> dict[str, Any]:
    """Return a table in run.json, empty if there is none."""
    found = (of or {}).get(key)
    return found if isinstance(found, dict) else {}


def _number(table: dict[str, Any], key: str) -> float:
    value = table.get(key)
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else 0.0


#: Columns of a terminal from which on the list of runs shows notes.
ROOM_FOR_NOTES = 110
#: Columns of the list that a narrow terminal has no room for, the first one first.
DISPENSABLE = ("length", "readings")
#: Most broken runs that are explained below the list.
MOST_PROBLEMS = 5


def print_runs(runs: Sequence[Listed], root: Path) -> None:
    """Print the list of runs, and below it the faults of the broken ones."""
    console = terminal()
    if not runs:
        console.print(in_language(Text("no runs in {folder:s}", folder=escape(str(root)))))
        return
    heads = ["when (UTC)", "run", "what", "status", "readings", "length"]
    room = console.width - 80 if console.width >= ROOM_FOR_NOTES else 0
    above = f"{root}{os.sep}" if root != Path() else ""
    groups = any(run.group for run in runs)
    rows = [_cells(run, above, room, groups=groups) for run in runs]
    heads += [*["group"] * groups, *["note"] * bool(room)]
    heads, rows = _that_fit(heads, rows, console.width)
    numbers = [in_language("readings"), in_language("length")]
    print_rows(console, [*map(in_language, heads)], rows, numbers=numbers)
    problems = [run.problem for run in runs if run.problem]
    shown = problems[:MOST_PROBLEMS]
    if (more := len(problems) - MOST_PROBLEMS) > 0:
        shown.append(Text("and {more} more that cannot be read; JSON has the reason for each", more=more))
    for problem in shown:
        console.print(f"[yellow]{in_language('note:')}[/yellow] {escape(in_language(problem))}")


def _that_fit(heads: list[str], rows: list[list[str]], width: int) -> tuple[list[str], list[list[str]]]:
    """Return the list without the columns for which a terminal is too narrow."""
    for left_out in DISPENSABLE:
        if _narrowest(heads, rows) <= width or left_out not in heads:
            break
        k = heads.index(left_out)
        heads, rows = heads[:k] + heads[k + 1 :], [row[:k] + row[k + 1 :] for row in rows]
    return heads, rows


def _narrowest(heads: list[str], rows: list[list[str]]) -> int:
    """Return the width that the longest words and two columns between them take."""
    columns = zip(heads, *rows, strict=True)
    return sum(max(cell_len(word) for text in set(column) for word in text.split()) + 2 for column in columns)


def _cells(run: Listed, above: str, room: int, *, groups: bool) -> list[str]:
    """Return a row of the list.

    Args:
        run: the run.
        above: the folder that was searched.
        room: letters for a note; 0: there is none.
        groups: whether the list has a column of groups.
    """
    when = (run.started_utc or "—")[:16].replace("T", " ")
    scene = f" {run.scene}" if run.scene not in {"", run.experiment} else ""
    what = run.experiment + scene + (in_language(", synthetic") if run.synthetic else "")
    length = "—" if run.length_s is None else "< 1 s" if run.length_s < 1 else f"{run.length_s:.0f} s"
    cells = [when, _below(run.path, above), what, in_language(run.status), run.size, length]
    if groups:
        cells.append(run.group)
    if room:
        cells.append(run.note if len(run.note) <= room else f"{run.note[: room - 1]}…")
    return [cell if cell.isprintable() else " ".join(cell.splitlines()) for cell in cells]


def _below(path: str, above: str) -> str:
    """Return a run's path as seen from the folder that was searched; a run that is that folder has its name."""
    below = path.removeprefix(above) if path.startswith(above) else path
    parent, _, name = below.replace(os.sep, "/").rpartition("/")
    return f"{parent}/{short_name(name)}" if parent and path.startswith(above) else short_name(name)
