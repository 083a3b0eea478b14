"""The run folder as it lies on the disk: what its record says, loading it, finding it.

It is written by `levilab.runs.writer`.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from levilab.computer import computer
from levilab.errors import DataError, as_typed
from levilab.files import as_json, parse_json
from levilab.formats.table import Table, read_run_readings
from levilab.present.html import facts_as_html, head_as_html
from levilab.runs.events import RunEvent
from levilab.runs.find import RECORD
from levilab.runs.traces import StoredTrace, load_traces
from levilab.settings import in_one_line
from levilab.texts.text import Text, text_from

if TYPE_CHECKING:
    import pandas as pd

    from levilab.present.style import Figure

SCHEMA: Literal["levilab-run/1"] = "levilab-run/1"
READINGS, STATES, EVENTS, LOCK, WIRE, PACKAGE = (
    "readings.csv",
    "states.csv",
    "events.jsonl",
    "run.lock",
    "wire.log",
    "datapackage.json",
)

#: Letters of the name of a group, so that it has room in tables and figures.
LONGEST_GROUP = 24
#: Rows of readings that a notebook shows.
SHOWN_ROWS = 5
_NUMBERS = re.compile(r"[\d.]+(\(\d+\))?")

Status = Literal["running", "finished", "interrupted", "failed"]


class RunRecord(BaseModel):
    """What ``run.json`` says.  Keys beyond these are kept as they are."""

    model_config = ConfigDict(frozen=True, extra="allow", validate_by_name=True, validate_by_alias=True)

    schema_: Literal["levilab-run/1"] = Field(default=SCHEMA, alias="schema")
    experiment: str
    status: Status
    started_utc: str | None
    ended_utc: str | None = None
    time_zero_utc: str | None = None
    command_line: list[str] = []
    channels: list[dict[str, str]] = []
    configuration: dict[str, Any] = {}
    instruments: dict[str, dict[str, Any]] = {}
    software: dict[str, str] = {}
    seed: int | None = Field(default=None, ge=0)
    #: Who measured: a name of a group of a class, or of a person.
    group: str = ""
    note: str = ""
    #: Of the magnets [°C], and the washers on the top [kg], as a person said; None: nothing was said.
    temperature_c: float | None = None
    washers_kg: tuple[float, ...] | None = None
    synthetic: bool = False
    synthetic_how: str | None = None
    #: The same as `Text.as_table` has it, if it is one.
    synthetic_says: dict[str, Any] | None = None
    #: Of a virtual bench, if its top only spins.
    world: Literal["spin"] | None = None

    def table(self, name: str) -> dict[str, Any]:
        """Return a table of the configuration; an empty one where there is none."""
        found = self.configuration.get(name)
        return found if isinstance(found, dict) else {}

    def number(self, table: str, name: str) -> float | None:
        """Return a number in a table of the configuration; None where there is none."""
        found = self.table(table).get(name)
        return float(found) if isinstance(found, int | float) and not isinstance(found, bool) else None

    def as_json(self) -> str:
        """Return the file's text."""
        unsaid = {"synthetic_says"} if self.synthetic_says is None else None
        return as_json(self.model_dump(mode="json", by_alias=True, exclude=unsaid)) + "\n"


def lock_of(folder: Path) -> Any:
    """Return the lock of the process that writes.  The operating system drops it when that ends, however it ends."""
    return computer().lock(folder / LOCK)


@dataclass(frozen=True)
class Run:
    """A run folder as it lies on the disk.

    Attributes:
        status: as in run.json, but a run that says "running" and whose process is gone is "interrupted".
    """

    folder: Path
    record: RunRecord
    status: Status

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Read ``run.json``.  Raises DataError when it is missing, cut off, or of another schema."""
        record = read_record(folder)
        alive = record.status != "running" or _is_alive(folder)
        return cls(folder, record, record.status if alive else "interrupted")

    def __repr__(self) -> str:
        started = (self.record.started_utc or "").partition(".")[0].replace("T", " ")
        when = f" of {started.removesuffix('Z')} UTC" if started else ""
        made_up = ", SYNTHETIC" if self.record.synthetic else ""
        return f"<Run: {self.record.experiment}{when}, {self.status}{made_up}, in {self.folder}>"

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows."""
        frame, problem = self._frame_or_problem()
        count = "" if frame is None else str(len(frame))
        facts = [
            ("status", self.status),
            ("started", (self.record.started_utc or "").partition(".")[0]),
            ("synthetic", self.record.synthetic_how or "yes" if self.record.synthetic else ""),
            ("group", self.record.group),
            ("note", self.record.note),
            ("folder", str(self.folder)),
            ("readings", problem or count),
        ]
        facts += [("warning", text) for text in ([] if problem else self.warnings())]
        below = "" if frame is None else head_as_html(frame, SHOWN_ROWS, texts=0)
        return facts_as_html(f"{self.record.experiment} run", facts, below)

    def _frame_or_problem(self) -> tuple[pd.DataFrame | None, str]:
        try:
            return self.to_dataframe(), ""
        except DataError as error:
            return None, str(error)

    def to_dataframe(self) -> pd.DataFrame:
        """Return the readings or simulated states: columns in SI, with the unit in the name.  Raises DataError."""
        if (self.folder / READINGS).exists() or not (self.folder / STATES).exists():
            return self.readings().frame.copy()
        declared = [channel["name"] for channel in self.record.channels if "name" in channel]
        return read_run_readings(self.folder / STATES, declared).frame

    def plot(self) -> Figure:
        """Return the readings as they are, a panel for each channel.  Raises DataError."""
        from levilab.present.style import for_notebooks  # with matplotlib
        from levilab.runs.figure import readings_figure

        made_up = ", SYNTHETIC" if self.record.synthetic else ""
        title = f"{self.record.experiment} run {self.folder.name}{made_up}"
        return for_notebooks(readings_figure(self.to_dataframe(), title))

    @property
    def continued_in(self) -> Path | None:
        """The folder to which the whole run was written again, where this one was damaged under way."""
        name = (self.record.model_extra or {}).get("continued_in")
        folder = self.folder.with_name(Path(str(name)).name) if name else None
        return folder if folder and (folder / RECORD).exists() else None

    def readings(self) -> Table:
        """Return the readings so far, every declared channel; a torn last line is left out, with a warning."""
        declared = [channel["name"] for channel in self.record.channels if "name" in channel]
        return read_run_readings(self.folder / READINGS, declared)

    def traces(self) -> list[StoredTrace]:
        """Return the oscilloscope's records so far.  Raises DataError for one that is damaged."""
        return load_traces(self.folder)

    def count(self) -> int:
        """Return the number of readings; a run of another kind, without readings.csv, has none."""
        return len(self.readings()) if (self.folder / READINGS).exists() else 0

    def elapsed(self) -> float:
        """Return the time on the wall clock since time zero [s].  Raises DataError if the clock was set back."""
        if self.record.time_zero_utc is None:
            raise DataError(
                f"{self.folder}: ended before its first reading, there is nothing to go on with: start again"
            )
        try:
            zero = datetime.fromisoformat(self.record.time_zero_utc)
        except ValueError as error:
            raise DataError(f"{self.folder / RECORD}: time_zero_utc: {error}; correct it or start again") from error
        zero = zero if zero.tzinfo else zero.replace(tzinfo=UTC)
        elapsed = (computer().utc() - zero).total_seconds()
        last = float(self.readings().column("time_s")[-1]) if self.count() else 0.0
        if elapsed <= last:
            raise DataError(
                f"{self.folder}: by the computer's clock {elapsed:.0f} s have passed since its time zero, but its last "
                f"reading is of {last:.0f} s: the clock was set back, correct it or start again"
            )
        return elapsed

    def events(self) -> list[dict[str, Any]]:
        """Return the events so far, each with time_s (or None), kind and text; damaged lines are left out.

        A file that cannot be read is one warning: the readings are whole.
        """
        path = self.folder / EVENTS
        try:
            lines = path.read_text(encoding="utf-8", errors="replace").split("\n") if path.is_file() else []
        except OSError as error:
            text = (
                f"{EVENTS} cannot be read ({error.strerror}), so warnings of the run, and when a drive ended, are not "
                "known: restore it from a copy"
            )
            return [{"time_s": None, "kind": RunEvent.WARNING, "text": text}]
        return [event for line in lines if (event := _event(line))]

    def warnings(self) -> tuple[str, ...]:
        """Return the experiment's warnings, each once."""
        return _warnings_of(self.events())


def _warnings_of(events: list[dict[str, Any]]) -> tuple[str, ...]:
    """Return each warning once; of those that differ only in their numbers the first, with a count."""
    texts = [text_from(one.get("says"), one["text"]) for one in events if one["kind"] == RunEvent.WARNING]
    alike = Counter(_NUMBERS.sub("#", text) for text in texts)
    firsts = {_NUMBERS.sub("#", text): text for text in reversed(texts)}
    return tuple(
        Text("{first} (the first of {n} such warnings)", first=firsts[kind], n=n) if n > 1 else firsts[kind]
        for kind, n in alike.items()
    )


def _event(line: str) -> dict[str, Any] | None:
    try:
        event = parse_json(line)
    except ValueError:
        return None
    if not isinstance(event, dict) or not isinstance(event.get("text"), str):
        return None
    time = event.get("time_s")
    return event | {"time_s": time if isinstance(time, int | float) else None, "kind": str(event.get("kind", ""))}


def _is_alive(folder: Path) -> bool:
    """Return whether a process holds the folder's lock.  Looking never creates a file."""
    from filelock import Timeout

    if not (folder / LOCK).exists():
        return False
    lock = lock_of(folder)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        return True
    except OSError:
        return False  # a lock that may not be probed, in an archive for example, is taken for dropped
    lock.release()
    return False


def read_record(folder: Path) -> RunRecord:
    """Return the content of ``run.json``.  Raises DataError if it is missing, cut off, or of another schema."""
    path = folder / RECORD
    readings = as_typed(path.parent / READINGS)
    rescue = Text("its readings can still be analyzed: levilab analyze {path:s}", path=readings)
    try:
        if path.exists() and not path.is_file():
            raise DataError("{path:s}: is a folder, a pipe or a device; a file is expected; {do}", path, rescue)
        data = parse_json(path.read_text(encoding="utf-8"))
    except PermissionError as error:
        raise DataError("{path:s}: may not be read by you; change its permissions or copy it", path=path) from error
    except OSError as error:
        said = "{path:s}: cannot be read ({why:s}): is {folder:s} a run folder?"
        raise DataError(said, path, error.strerror, path.parent) from error
    except ValueError as error:
        raise DataError("{path:s}: is cut off or not JSON ({why}); {do}", path, error, rescue) from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        seen = data.get("schema") if isinstance(data, dict) else type(data).__name__
        said = "{path:s}: schema is {seen:s}, expected {schema:s} of this version; {do}"
        raise DataError(said, path, repr(str(seen)[:60]), repr(SCHEMA), rescue)
    try:
        return RunRecord.model_validate(data)
    except ValidationError as error:
        raise DataError("{path:s}: {problem}; {do}", path, in_one_line(error), rescue) from error
