"""The run folder: written while measuring so that nothing is lost, loaded, found.

``run.json`` is replaced atomically, ``readings.csv`` and ``events.jsonl`` are flushed to the disk row by row:
a process that is killed between two rows loses nothing that it has shown.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import secrets
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import IO, TYPE_CHECKING, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from levilab.errors import DataError, LevilabError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from levilab.formats import Table

SCHEMA: Literal["levilab-run/1"] = "levilab-run/1"
READINGS, EVENTS, RECORD, LOCK, WIRE, PACKAGE = (
    "readings.csv",
    "events.jsonl",
    "run.json",
    "run.lock",
    "wire.log",
    "datapackage.json",
)

Status = Literal["running", "finished", "interrupted", "failed"]


class CannotWrite(LevilabError):
    """The run folder cannot be written (any more)."""


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
    instruments: dict[str, Any] = {}
    software: dict[str, str] = {}
    seed: int | None = None
    note: str = ""
    synthetic: bool = False
    synthetic_how: str | None = None

    def as_json(self) -> str:
        """The file's text."""
        data = self.model_dump(mode="json", by_alias=True)
        return json.dumps(data, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False) + "\n"


def utc_now() -> str:
    """The time as it stands in run.json.

    >>> utc_now()[-1]
    'Z'
    """
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


# --- writing -------------------------------------------------------------------------------------------


def replace_atomically(path: Path, text: str) -> None:
    """Write a file so that a reader sees the old one or the new one, whole, whatever happens meanwhile.

    Raises OSError.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        _replace(part, path)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def _replace(part: Path, path: Path) -> None:
    """os.replace; Windows refuses for as long as another program reads the old file."""
    for attempt in range(10):
        try:
            part.replace(path)
        except PermissionError:
            if os.name != "nt" or attempt == 9:
                raise
            time.sleep(0.02)
        else:
            return


class RunWriter:
    """A run folder that is being written.  One row is one `write` of a whole line, on the disk before it is shown.

    Use it as a context manager: it holds the folder's lock, by which others see that the run is alive.
    """

    def __init__(self, folder: Path, record: RunRecord) -> None:
        self.folder, self.record = folder, record
        self._files: dict[str, IO[str]] = {}
        self._lock = _lock(folder)

    @classmethod
    def create(cls, out: Path, record: RunRecord) -> Self:
        """A new folder ``<UTC>-<experiment>-<four hex digits>`` below `out`.  Raises CannotWrite."""
        stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
        with _told("create the run folder", out):
            while True:
                folder = out / f"{stamp}-{record.experiment}-{secrets.token_hex(2)}"
                with contextlib.suppress(FileExistsError):
                    folder.mkdir(parents=True)
                    break
            writer = cls(folder, record)
            writer._lock.acquire(blocking=False)
            writer._append(READINGS, ",".join(channel["name"] for channel in record.channels))
            replace_atomically(folder / RECORD, record.as_json())
        return writer

    @classmethod
    def reopen(cls, run: Run) -> Self:
        """Go on writing an ended run; a torn last row is cut off first.  Raises CannotWrite."""
        writer = cls(run.folder, run.record)
        with _told("reopen the run", run.folder):
            writer._lock.acquire(blocking=False)
            for name in (READINGS, EVENTS):
                _cut_torn_line(run.folder / name)
            writer.update(status="running", ended_utc=None)
        return writer

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for file in self._files.values():
            with contextlib.suppress(OSError):
                file.close()
        self._lock.release()

    def update(self, **changes: Any) -> None:
        """Change entries of run.json."""
        record = self.record.model_copy(update=changes)
        with _told("write run.json", self.folder):
            replace_atomically(self.folder / RECORD, record.as_json())
        self.record = record

    def reading(self, row: Mapping[str, float | None]) -> None:
        """Append a row to readings.csv.  None becomes an empty cell.  Raises CannotWrite with the row in it."""
        line = ",".join(_cell(row.get(channel["name"])) for channel in self.record.channels)
        with _told(f"write the reading {line}", self.folder):
            self._append(READINGS, line)

    def event(self, time_s: float | None, kind: str, text: str, **data: Any) -> None:
        """Append a line to events.jsonl."""
        event = {"utc": utc_now(), "time_s": time_s, "kind": kind, "text": text} | data
        with _told(f"write the event {text!r}", self.folder):
            self._append(EVENTS, json.dumps(event, ensure_ascii=False, allow_nan=False))

    def wire(self, address: str, direction: str, data: bytes) -> None:
        """Append bytes that went over the wire to wire.log.

        Never raises: the log is no measurement, and the exchange under way may be the one that switches the
        output off.  If the log cannot be written it ends there, and run.json says why.
        """
        if "wire_log_ended" in (self.record.model_extra or {}):
            return
        try:
            self._append(WIRE, f"{utc_now()} {address} {direction} {data!r}", sync=False)
        except OSError as error:
            ended = {"wire_log_ended": error.strerror or str(error)}
            self.record = RunRecord.model_validate(self.record.model_dump() | ended)

    def finish(self, status: Status, **changes: Any) -> None:
        """The run has ended: run.json says how, datapackage.json describes the files."""
        self.update(status=status, ended_utc=utc_now(), **changes)
        with _told("write datapackage.json", self.folder):
            replace_atomically(self.folder / PACKAGE, _datapackage(self.folder, self.record))

    def _append(self, name: str, line: str, *, sync: bool = True) -> None:
        if name not in self._files:
            self._files[name] = (self.folder / name).open("a", encoding="utf-8", newline="\n")
        file = self._files[name]
        file.write(line + "\n")
        file.flush()
        if sync:
            os.fsync(file.fileno())


def _cell(value: float | None) -> str:
    return "" if value is None or not math.isfinite(value) else repr(float(value))


def _cut_torn_line(path: Path) -> None:
    if not path.exists():
        return
    with path.open("rb+") as file:
        data = file.read()
        file.truncate(data.rfind(b"\n") + 1)


@contextlib.contextmanager
def _told(what: str, where: Path) -> Iterator[None]:
    """An OSError as one sentence that says what is safe and what to do."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise CannotWrite(
            f"could not {what} in {where} ({reason}); all earlier readings are kept: "
            "free space or choose another place with --out"
        ) from error


def _lock(folder: Path) -> Any:
    """The operating system drops this lock when the process ends, however it ends."""
    from filelock import FileLock

    return FileLock(folder / LOCK)


def _datapackage(folder: Path, record: RunRecord) -> str:
    """The Frictionless description of the folder: fields with units, and the hash of each file."""
    fields = [
        {"name": channel["name"], "type": "number", "unit": channel["unit"], "description": channel["source"]}
        for channel in record.channels
    ]
    resources: list[dict[str, Any]] = []
    for name in (READINGS, EVENTS, WIRE):
        path = folder / name
        if path.exists():
            data = path.read_bytes()
            about = {"path": name, "name": name.replace(".", "-"), "bytes": len(data)}
            about["hash"] = "sha256:" + hashlib.sha256(data).hexdigest()
            resources.append(about | ({"schema": {"fields": fields}} if name == READINGS else {}))
    package = {
        "name": folder.name.lower(),
        "title": f"levilab {record.experiment} run",
        "created": record.started_utc,
        "resources": resources,
    }
    return json.dumps(package, indent=2, sort_keys=True, ensure_ascii=False) + "\n"


# --- reading -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """A run folder as it lies on the disk.

    status: as in run.json, but a run that says "running" and whose process is gone is "interrupted".
    """

    folder: Path
    record: RunRecord
    status: Status

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Read ``run.json``.  Raises DataError when it is missing, cut off, or of another schema."""
        record = _read_record(folder / RECORD)
        alive = record.status != "running" or _is_alive(folder)
        return cls(folder, record, record.status if alive else "interrupted")

    def readings(self) -> Table:
        """The readings so far; a torn last line is left out, with a warning."""
        from levilab.formats import read_run_readings

        return read_run_readings(self.folder / READINGS)

    def events(self) -> list[dict[str, Any]]:
        """The events so far; a torn last line is left out."""
        path = self.folder / EVENTS
        lines = path.read_text(encoding="utf-8").split("\n")[:-1] if path.exists() else []
        return [json.loads(line) for line in lines if line.strip()]


def _is_alive(folder: Path) -> bool:
    """Whether a process holds the folder's lock.  Looking never creates a file."""
    from filelock import Timeout

    if not (folder / LOCK).exists():
        return False
    lock = _lock(folder)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        return True
    except OSError:
        return False  # a folder that cannot be written has no writer
    lock.release()
    return False


def _read_record(path: Path) -> RunRecord:
    from levilab.config import in_one_line

    rescue = f"its readings can still be analyzed: levilab analyze spindown {path.parent / READINGS}"
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}): is {path.parent} a run folder?") from error
    except ValueError as error:
        raise DataError(f"{path}: is cut off or not JSON ({error}); {rescue}") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        seen = data.get("schema") if isinstance(data, dict) else type(data).__name__
        raise DataError(f"{path}: schema is {seen!r}, expected {SCHEMA!r} of this version; {rescue}")
    try:
        return RunRecord.model_validate(data)
    except ValidationError as error:
        raise DataError(f"{path}: {in_one_line(error)}; {rescue}") from error


def find_runs(root: Path) -> list[Path]:
    """The run folders at or below a folder, by name."""
    return sorted(path.parent for path in root.rglob(RECORD))
