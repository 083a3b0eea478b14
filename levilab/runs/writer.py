"""Writing a run folder while measuring, so that nothing is lost.

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
import shutil
from datetime import UTC, datetime
from typing import IO, TYPE_CHECKING, Any, Self

from levilab.files import CannotWrite, replace_atomically, sync_folder
from levilab.runs import traces
from levilab.runs.run import EVENTS, PACKAGE, READINGS, RECORD, STATES, WIRE, RunRecord, lock_of, utc_now

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from instruments.drivers.oscilloscope import Trace
    from levilab.runs.run import Run, Status


class RunWriter:
    """A run folder that is being written.  One row is one `write` of a whole line, on the disk before it is shown.

    Use it as a context manager: it holds the folder's lock, by which others see that the run is alive.
    """

    def __init__(self, folder: Path, record: RunRecord) -> None:
        self.folder, self.record = folder, record
        self._files: dict[str, IO[str]] = {}
        self._lock = lock_of(folder)

    @classmethod
    def create(cls, out: Path, record: RunRecord, table: str = READINGS) -> Self:
        """A new folder ``<UTC>-<experiment>-<four hex digits>`` below `out`; table: its rows.  Raises CannotWrite."""
        with _told("create the run folder", out, safe=""):
            out.mkdir(parents=True, exist_ok=True)
            writer = cls(_new_folder(out, record.experiment), record)
            writer._lock.acquire(blocking=False)
            writer._append(table, writer._header())
            replace_atomically(writer.folder / RECORD, record.as_json())
            sync_folder(out)
        return writer

    @classmethod
    def reopen(cls, run: Run, *, note: str = "") -> Self:
        """Go on writing an ended run; torn last lines are cut off first, a note is added.  Raises CannotWrite."""
        writer = cls(run.folder, run.record)
        with _told("reopen the run", run.folder):
            try:
                writer._lock.acquire(timeout=2)
            except TimeoutError:
                raise CannotWrite(f"{run.folder}: another process is writing this run") from None
            for name in (READINGS, EVENTS):
                _cut_torn_line(run.folder / name)
            writer._check_header()
            notes = "; ".join(filter(None, (run.record.note, note)))
            writer.update(status="running", ended_utc=None, note=notes)
        return writer

    def _header(self) -> str:
        return ",".join(channel["name"] for channel in self.record.channels)

    def _check_header(self) -> None:
        """New rows must stand below the header that they are of; an empty file gets one."""
        path = self.folder / READINGS
        first = path.read_text(encoding="utf-8").partition("\n")[0] if path.exists() else ""
        if not first:
            self._append(READINGS, self._header())
        elif first != self._header():
            raise CannotWrite(f"{path}: its header is {first!r}, run.json says {self._header()!r}: not gone on with")

    def discard(self) -> None:
        """Take a run away that never began.  Only for one without a reading."""
        self._close()
        self._lock.release()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._close()
        self._lock.release()

    def _close(self) -> None:
        """What is still in a buffer could not be written before and has been told: closing need not tell it again."""
        for file in self._files.values():
            with contextlib.suppress(OSError):
                file.close()
        self._files.clear()

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

    def states(self, lines: Iterable[str]) -> None:
        """Append many rows to states.csv, on the disk together.  Raises CannotWrite."""
        with _told(f"write {STATES}", self.folder, safe=""):
            for line in lines:
                self._append(STATES, line, sync=False)
            os.fsync(self._files[STATES].fileno())

    def trace(self, time_s: float, trace: Trace, channel: str) -> int:
        """Keep an oscilloscope's record; returns its number.  Raises CannotWrite."""
        number = len(list((self.folder / traces.FOLDER).glob("*.npy"))) + 1
        with _told(f"write the record {number}", self.folder):
            line = traces.save_codes(self.folder, number, time_s, trace, channel)
            self._append(traces.INDEX, line)
        return number

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


def _new_folder(out: Path, experiment: str) -> Path:
    """``<UTC>-<experiment>-<four hex digits>``, one that is not there yet."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    while True:
        folder = out / f"{stamp}-{experiment}-{secrets.token_hex(2)}"
        with contextlib.suppress(FileExistsError):
            folder.mkdir()
            return folder


def _cell(value: float | None) -> str:
    return "" if value is None or not math.isfinite(value) else repr(float(value))


def _cut_torn_line(path: Path) -> None:
    if not path.exists():
        return
    with path.open("rb+") as file:
        data = file.read()
        file.truncate(data.rfind(b"\n") + 1)


@contextlib.contextmanager
def _told(what: str, where: Path, safe: str = "all earlier readings are kept: ") -> Iterator[None]:
    """An OSError as one sentence that says what is safe and what to do."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise CannotWrite(
            f"could not {what} in {where} ({reason}); {safe}free space, or choose another place with `out`"
        ) from error


def _datapackage(folder: Path, record: RunRecord) -> str:
    """The Frictionless description of the folder: fields with units, and the hash of each file."""
    fields = [
        {"name": channel["name"], "type": "number", "unit": channel["unit"], "description": channel["source"]}
        for channel in record.channels
    ]
    resources: list[dict[str, Any]] = []
    records = sorted(path.relative_to(folder).as_posix() for path in (folder / traces.FOLDER).glob("*.npy"))
    for name in (READINGS, STATES, EVENTS, WIRE, traces.INDEX, *records):
        path = folder / name
        if path.exists():
            data = path.read_bytes()
            about = {"path": name, "name": name.replace(".", "-").replace("/", "-"), "bytes": len(data)}
            about["hash"] = "sha256:" + hashlib.sha256(data).hexdigest()
            resources.append(about | ({"schema": {"fields": fields}} if name in {READINGS, STATES} else {}))
    package = {
        "name": folder.name.lower(),
        "title": f"levilab {record.experiment} run",
        "created": record.started_utc,
        "resources": resources,
    }
    return json.dumps(package, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
