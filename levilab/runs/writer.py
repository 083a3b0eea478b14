"""Writing a run folder while measuring, so that nothing is lost.

``run.json`` is replaced atomically, ``readings.csv`` and ``events.jsonl`` are flushed to the disk row by row:
a process that is killed between two rows loses nothing that it has shown. A folder that is removed under way is
written again, beside, from what this process holds in memory.
"""

import contextlib
import errno
import json
import math
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any, Self

from instruments.drivers.oscilloscope import Trace
from levilab.computer import computer, utc_now
from levilab.errors import DataError, unquote
from levilab.files import CannotWrite, make_folder, must_be_folder, replace_atomically
from levilab.runs import traces
from levilab.runs.events import RunEvent
from levilab.runs.find import RECORD
from levilab.runs.package import field, package, resource
from levilab.runs.run import EVENTS, LOCK, PACKAGE, READINGS, STATES, WIRE, Run, RunRecord, Status, lock_of, read_record
from levilab.texts.text import Text, how_many

#: Files that grow line by line, kept in memory to be written again.
_KEPT = (READINGS, STATES, EVENTS, traces.INDEX)
#: Errors that free space would mend.
_FULL = frozenset(getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EFBIG") if hasattr(errno, name))


class RunWriter:
    """A run folder that is being written.  One row is one `write` of a whole line, on the disk before it is shown.

    Use it as a context manager: it holds the folder's lock, by which others see that the run is alive.

    If ``readings.csv`` or the folder is removed, replaced or cut under way, the next reading, event or change of the
    record notices it: all readings and events, those of a resumed run included, and the record are written into a
    new folder beside, `folder` names that one from then on, and `tell` says so.

    Attributes:
        folder: where the run is written.
        record: what run.json says.
        events: how many were written by this process.
        tell: called with a sentence for the person at the bench.
    """

    def __init__(self, folder: Path, record: RunRecord, tell: Callable[[str], None] = lambda _: None) -> None:
        self.folder, self.record, self.tell = folder, record, tell
        self._files: dict[str, _GrowingFile] = {}
        self._kept: dict[str, list[bytes]] = {}  # all lines appended, to be written again
        self._created = False
        self._record_size = 0  # of run.json as it was written last
        self.events = 0
        self._records = 0  # of the oscilloscope
        self._arriving: tuple[Path, int] | None = None  # the record on its way: its folder, and points that are there
        self._lock = lock_of(folder)

    @classmethod
    def create(
        cls, out: Path, record: RunRecord, table: str = READINGS, *, tell: Callable[[str], None] = lambda _: None
    ) -> Self:
        """Return a new folder ``<UTC>-<experiment>-<four hex digits>``.

        Args:
            out: the folder below which it is made.
            record: what run.json is to say.
            table: the file of its rows.
            tell: called with a sentence for the person at the bench.

        Raises:
            CannotWrite: it cannot be made.
        """
        must_be_folder(out)
        with _explain_errors("create the run folder", out, safe=""):
            make_folder(out)
            writer = cls(_new_folder(out, record.experiment), record, tell)
            writer._created = True
            try:
                writer._lock.acquire(blocking=False)
                writer._append(table, writer._header())
                writer._write_record()
                computer().sync_folder(out)
            except BaseException:
                writer.discard()
                raise
        return writer

    @classmethod
    def reopen(cls, run: Run, *, note: str = "", tell: Callable[[str], None] = lambda _: None) -> Self:
        """Go on writing an ended run; torn last lines are cut off first, a note is added.  Raises CannotWrite."""
        writer = cls(run.folder, run.record, tell)
        with _explain_errors("reopen the run", run.folder):
            try:
                writer._lock.acquire(timeout=2)
            except TimeoutError:
                raise CannotWrite(f"{run.folder}: another process is writing this run") from None
            try:
                writer._take_up(run, note)
            except BaseException:
                writer._close()
                raise
        return writer

    def _take_up(self, run: Run, note: str) -> None:
        """Read the record as it is by now, and cut torn lines off the files."""
        self.record = read_record(self.folder)
        if self.record.status == "finished" != run.record.status:
            raise CannotWrite(f"{self.folder}: is finished, another process has gone on with it meanwhile")
        if not all("name" in channel for channel in self.record.channels):
            raise CannotWrite(f"{self.folder / RECORD}: channels: each needs a name to be gone on with")
        for name in _KEPT:
            _refuse_special(self.folder / name)
            _cut_torn_line(self.folder / name)
        self._check_header()
        self._records = traces.last_number(self.folder)
        cut_short = self.keep_what_arrived()
        for name in _KEPT:
            if name not in self._files and (self.folder / name).exists():
                self._open(name)
        notes = "; ".join(filter(None, (self.record.note, note)))
        self.update(status="running", ended_utc=None, note=notes)
        if cut_short:
            self.event(None, RunEvent.CUT_SHORT, cut_short)

    def _header(self) -> str:
        return ",".join(channel["name"] for channel in self.record.channels)

    def _check_header(self) -> None:
        """Raise CannotWrite for a file with another header; an empty one gets the header."""
        path = self.folder / READINGS
        first = path.read_text(encoding="utf-8").partition("\n")[0] if path.exists() else ""
        if not first:
            self._append(READINGS, self._header())
        elif first != self._header():
            raise CannotWrite(f"{path}: its header is {first!r}, run.json says {self._header()!r}: not gone on with")

    def discard(self) -> bool:
        """Take a run away that never began.  Returns whether it is gone.

        A folder that holds readings stays, and so does one that another process made.
        """
        gone = self._created and not self._holds_readings()
        self._close()
        if gone:
            computer().remove_folder(self.folder)
        return gone

    def _holds_readings(self) -> bool:
        """Return whether there are readings, in memory or on the disk; an unreadable file may have some."""
        if self._readings_kept:
            return True
        try:
            return bool((self.folder / READINGS).read_bytes().partition(b"\n")[2].strip())
        except FileNotFoundError:
            return False
        except OSError:
            return True

    @property
    def _readings_kept(self) -> int:
        """The number of readings in memory; the first line is the header."""
        return max(sum(block.count(b"\n") for block in self._kept.get(READINGS, ())) - 1, 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def _close(self) -> None:
        """Close the files and release the lock.

        What is still in a buffer could not be written before, and that was said: closing need not say it again.
        """
        for file in self._files.values():
            with contextlib.suppress(OSError):
                file.close()
        self._files.clear()
        with contextlib.suppress(OSError):
            self._lock.release()

    def update(self, **changes: Any) -> None:
        """Change entries of run.json.  Raises CannotWrite."""
        with _explain_errors("write run.json", self.folder):
            self.record = self.record.model_copy(update=changes)
            self._write_in_place(self._write_record)

    def reading(self, row: Mapping[str, float | None]) -> None:
        """Append a row to readings.csv.  None becomes an empty cell.  Raises CannotWrite with the row in it.

        When it returns, this row and all earlier ones are on the disk, in `folder`.
        """
        line = ",".join(_cell(row.get(channel["name"])) for channel in self.record.channels)
        with self._appending(f"write the reading {line}"):
            self._append(READINGS, line)

    def states(self, lines: Iterable[str]) -> None:
        """Append many rows to states.csv, on the disk together.  Raises CannotWrite."""
        with _explain_errors(f"write {STATES}", self.folder, safe=""):
            for line in lines:
                self._append(STATES, line, sync=False)
            self._files[STATES].sync()

    def film(self, lines: Sequence[str]) -> None:
        """Append rows of a film's track to states.csv, on the disk and kept as readings are.  Raises CannotWrite."""
        with self._appending(f"write {STATES}"):
            self._append(STATES, "\n".join(lines))

    def trace(self, time_s: float, trace: Trace, channel: str) -> int:
        """Keep an oscilloscope's record; returns its number.  Raises CannotWrite."""
        return self._keep_record(traces.head_of(trace, self._records + 1, time_s, channel), trace)

    def _keep_record(self, head: traces.Head, trace: Trace) -> int:
        """Write the head of a record, its codes and their line; all of them survive a killed process."""
        self._records = max(self._records, head.number)
        with _explain_errors(f"write the record {head.number}", self.folder):
            self._rescue_if_lost()
            written = None
            while written != self.folder:  # once more where the folder was removed meanwhile
                written = self.folder
                if not traces.is_arriving(written):
                    traces.begin_arriving(written, head, trace.codes)
                self._append(traces.INDEX, traces.save_codes(written, head, trace.codes))
                self._rescue_if_lost()
            traces.forget_arriving(self.folder)
        self._arriving = None
        return head.number

    def arriving(self, time_s: float, trace: Trace, channel: str, points: int) -> None:
        """Write the part of a record that has come so far; the whole one is kept by `trace`.

        Args:
            time_s: when the record was taken, on the clock of the readings.
            trace: its first samples, at each call some more of one record.
            channel: the quantity that it shows.
            points: it is to have.

        Raises:
            CannotWrite: the disk is full, or gone.
        """
        if trace.codes.size >= points:
            return
        number = self._records + 1
        with _explain_errors(f"write the record {number}", self.folder):
            self._rescue_if_lost()
            here, there = self._arriving or (None, 0)
            if here != self.folder:
                there = 0
                traces.begin_arriving(self.folder, traces.head_of(trace, number, time_s, channel, points), trace.codes)
            traces.append_arriving(self.folder, trace.codes[there:])
        self._arriving = self.folder, trace.codes.size

    def keep_what_arrived(self) -> str | None:
        """Keep the part of a record that was broken off, and return its description.  Raises CannotWrite."""
        try:
            found = traces.partial_record(self.folder)
        except DataError:  # the analysis says so
            return None
        self._arriving = None
        if found is None:
            with _explain_errors("clear up", self.folder):
                traces.forget_arriving(self.folder)
            return None
        head = traces.head_of(found.trace, found.number, found.time_s, found.channel, found.announced)
        self._keep_record(head, found.trace)
        return f"{traces.INDEX}: record {found.number} ({found.channel}) {found.how_short or 'was kept whole'}"

    def forget_what_arrived(self) -> None:
        """Remove the part of a record that is of no use.  Raises CannotWrite."""
        self._arriving = None
        with _explain_errors("clear up", self.folder):
            traces.forget_arriving(self.folder)

    def event(self, time_s: float | None, kind: RunEvent, text: str, **data: Any) -> None:
        """Append a line to events.jsonl."""
        event = {"utc": utc_now(), "time_s": time_s, "kind": kind, "text": unquote(text)} | data
        if isinstance(text, Text):  # for views in other languages
            event |= {"says": text.as_table()}
        with self._appending(f"write the event {text!r}"):
            self._append(EVENTS, json.dumps(event, ensure_ascii=False, allow_nan=False))
            self.events += 1

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
        """End the run: run.json gets its status, datapackage.json describes the files.

        The status stands by then, and the run is whole without its description.  Raises CannotWrite for the status.
        """
        self.update(status=status, ended_utc=utc_now(), **changes)
        with _explain_errors(f"write {PACKAGE}", self.folder):
            self._write_in_place(self._describe)

    def _describe(self) -> None:
        """Write the description.  Raises FileNotFoundError where the folder went at this moment."""
        try:
            replace_atomically(self.folder / PACKAGE, _datapackage(self.folder, self.record))
        except FileNotFoundError:
            raise
        except OSError as error:
            missing = "{file} is missing ({reason}): the run is whole without it; levilab export writes it into a .zip"
            self.tell(Text(missing, file=PACKAGE, reason=error.strerror or str(error)))

    def _append(self, name: str, line: str, *, sync: bool = True) -> None:
        """Append a line; with sync it is on the disk and kept in memory, too."""
        if name not in self._files:
            try:
                self._open(name)
            except FileNotFoundError:  # of the folder
                self._rescue()
            if name not in self._files:
                self._open(name)
        data = f"{line}\n".encode(errors="replace")
        self._files[name].append(data)
        if sync:
            self._files[name].sync()
            self._kept.setdefault(name, []).append(data)

    def _open(self, name: str) -> None:
        """Open a file to append to; what a resumed run holds in it is kept, too."""
        path = self.folder / name
        if name in _KEPT and name not in self._kept and path.is_file():
            self._kept[name] = [path.read_bytes()]
        self._files[name] = _GrowingFile(path)

    # --- a folder that is removed under way ---

    @contextlib.contextmanager
    def _appending(self, what: str) -> Iterator[None]:
        """Write the run again where its folder went meanwhile, also if the disk takes no more.  Raises CannotWrite."""
        with _explain_errors(what, self.folder):
            try:
                yield
            finally:
                self._rescue_if_lost()

    def _write_in_place(self, write: Callable[[], None]) -> None:
        """Write something into the folder; once more where the folder went at this moment.  Raises OSError."""
        self._rescue_if_lost()
        try:
            write()
        except FileNotFoundError:
            self._rescue_if_lost()
            write()

    def _rescue_if_lost(self) -> None:
        """Write the run again if its files are no longer in their place.  Raises OSError."""
        kept = [file for name, file in self._files.items() if name in self._kept and name != STATES]
        if any(file.is_lost() for file in kept):
            self._rescue()
        elif kept and not self._record_is_whole():
            self._write_record()

    def _write_record(self) -> None:
        text = self.record.as_json()
        replace_atomically(self.folder / RECORD, text)
        self._record_size = len(text.encode(errors="replace"))

    def _record_is_whole(self) -> bool:
        """Return whether run.json is there and can be read; a person may have changed it."""
        try:
            if (self.folder / RECORD).stat().st_size == self._record_size:
                return True
            read_record(self.folder)
        except (OSError, DataError):
            return False
        return True

    def _rescue(self) -> None:
        """Write the run again, beside.  Raises CannotWrite: what was removed is lost, and the message says so."""
        with _explain_errors(f"write {self._readings_kept} readings again that were removed", self.folder, safe=""):
            self._write_again()

    def _write_again(self) -> None:
        old = self.folder
        self._close()
        self.folder = _folder_beside(old)
        self._lock = lock_of(self.folder)
        self._lock.acquire(blocking=False)
        _copy_others(old, self.folder, {*self._kept, RECORD, LOCK, PACKAGE})
        kept = {name: b"".join(blocks) for name, blocks in self._kept.items()}
        lost = self._forget_lost_records()
        for name, blocks in self._kept.items():
            self._files[name] = _GrowingFile(self.folder / name)
            self._files[name].append(b"".join(blocks))
            self._files[name].sync()
        self.record = self.record.model_copy(update={"rescued_from": str(old)})
        self._write_record()
        computer().sync_folder(self.folder.parent)
        self._leave_readable(old, kept)
        text = (
            f"{old} was removed, replaced or cut while it was being written: all {self._readings_kept} readings "
            f"are in {self.folder} now{', and the run goes on there' if self.record.status == 'running' else ''}"
            + (f"; {how_many(lost, 'record')} of the oscilloscope are gone" if lost else "")
        )
        event = {"utc": utc_now(), "time_s": None, "kind": "rescued", "text": text}
        self._append(EVENTS, json.dumps(event, ensure_ascii=False))
        self.tell(text)

    def _leave_readable(self, old: Path, kept: Mapping[str, bytes]) -> None:
        """Leave whole lines in what remains of the old folder, and a run.json that says where the run goes on.

        What another program has put there stays as it is.
        """
        with contextlib.suppress(OSError):
            if not (old / RECORD).is_file() or not _is_of(old, self.record):
                return
            for name, ours in kept.items():
                _cut_foreign_tail(old / name, ours)
            gone_on = {"status": "interrupted", "ended_utc": utc_now(), "continued_in": self.folder.name}
            replace_atomically(old / RECORD, self.record.model_copy(update=gone_on).as_json())

    def _forget_lost_records(self) -> int:
        """Remove records whose codes are gone from the index; return their number.

        Codes are not kept in memory: a record may have as many as an oscilloscope holds.
        """
        lines = b"".join(self._kept.get(traces.INDEX, ())).splitlines(keepends=True)
        there = [line for line in lines if traces.has_codes(self.folder, line.decode())]
        if lines:
            self._kept[traces.INDEX] = there
        return len(lines) - len(there)


class _GrowingFile:
    """A file that grows line by line, and notices when it is removed, replaced or cut.  Raises OSError."""

    def __init__(self, path: Path) -> None:
        _refuse_special(path)
        self._path, self._is_new = path, not path.exists()
        self._file = computer().open(path, "ab")
        self._opened = os.fstat(self._file.fileno())
        self._size = self._opened.st_size
        # some file systems give their files new numbers at each look
        self._comparable = os.path.samestat(self._opened, path.lstat())

    def append(self, data: bytes) -> None:
        self._file.write(data)
        self._file.flush()
        self._size += len(data)

    def sync(self) -> None:
        computer().sync(self._file)
        if self._is_new:  # else a loss of power takes the name, and the file with it
            computer().sync_folder(self._path.parent)
            self._is_new = False

    def close(self) -> None:
        self._file.close()

    def is_lost(self) -> bool:
        """Return whether the path no longer names this file, or not all of it."""
        if os.name == "nt":  # Windows removes no file that is open, and tells its size late
            return False
        try:
            there = self._path.lstat()
        except (FileNotFoundError, NotADirectoryError):
            return True
        if self._comparable and not os.path.samestat(self._opened, there):
            return True
        return there.st_size < self._size


def _refuse_special(path: Path) -> None:
    """Raise OSError for a symbolic link, which would be written through, and for a pipe, which would wait."""
    if path.is_symlink():
        raise OSError(errno.EINVAL, f"{path.name} is a symbolic link, which is not written through")
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, f"{path.name} is no regular file")


def _folder_beside(old: Path) -> Path:
    """Return a new folder whose name says that it continues another one."""
    make_folder(old.parent)
    name = re.sub(r"-rescued(-\d+)?$", "", old.name)
    for number in count(1):
        folder = old.with_name(f"{name}-rescued" + (f"-{number}" if number > 1 else ""))
        with contextlib.suppress(FileExistsError):
            computer().make_folder(folder)
            return folder
    raise AssertionError


def _is_of(folder: Path, record: RunRecord) -> bool:
    """Return whether a folder's run.json is of this run, or so damaged that it says nothing."""
    try:
        return read_record(folder).started_utc == record.started_utc
    except DataError:
        return True


def _cut_foreign_tail(path: Path, ours: bytes) -> None:
    """Cut a file that was cut within a line, and then written to, back to its last whole line."""
    if not path.is_file() or path.is_symlink():
        return
    data = path.read_bytes()
    differ = (k for k, pair in enumerate(zip(data, ours, strict=False)) if pair[0] != pair[1])
    same = next(differ, min(len(data), len(ours)))
    if ours.endswith(data[same:]):  # else another program wrote it
        with computer().open(path, "rb+") as file:
            file.truncate(data.rfind(b"\n", 0, same) + 1)


def _copy_others(old: Path, new: Path, ours: set[str]) -> None:
    """Copy the other files and folders of the old folder, if there is one."""
    with contextlib.suppress(OSError):
        for path in old.iterdir():
            if path.name in ours or path.is_symlink() or path.name.endswith(".part"):
                continue
            with contextlib.suppress(OSError, shutil.Error):
                if path.is_dir():
                    shutil.copytree(path, new / path.name, symlinks=True)
                elif path.is_file():
                    shutil.copy2(path, new / path.name)


def _new_folder(out: Path, experiment: str) -> Path:
    """Create a new folder ``<UTC>-<experiment>-<four hex digits>``."""
    stamp = computer().utc().strftime("%Y%m%dT%H%M%SZ")
    while True:
        folder = out / f"{stamp}-{experiment}-{computer().token()}"
        with contextlib.suppress(FileExistsError):
            computer().make_folder(folder)
            return folder


def _cell(value: float | None) -> str:
    return "" if value is None or not math.isfinite(value) else repr(float(value))


def _cut_torn_line(path: Path) -> None:
    if not path.exists():
        return
    with computer().open(path, "rb+") as file:
        data = file.read()
        file.truncate(data.rfind(b"\n") + 1)


@contextlib.contextmanager
def _explain_errors(what: str, where: Path, safe: str = "all earlier readings are kept: ") -> Iterator[None]:
    """Raise CannotWrite for an OSError, in one sentence that says what is safe and what to do."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        advice = "free space" if error.errno in _FULL else "look at the folder and its disk"
        raise CannotWrite(
            f"could not {what} in {where} ({reason}); {safe}{advice}, or choose another place with `out`"
        ) from error


def _datapackage(folder: Path, record: RunRecord) -> str:
    """Return the description of the folder: columns with units, and the hash of each file."""
    columns = [field(one["name"], one.get("unit", ""), one.get("source", "")) for one in record.channels]
    # the columns are those of the readings, or else of the states
    described = READINGS if (folder / READINGS).exists() else STATES
    records = sorted(path.relative_to(folder).as_posix() for path in (folder / traces.FOLDER).glob("*.npy"))
    names = (READINGS, STATES, RECORD, EVENTS, WIRE, traces.INDEX, *records)
    resources = [
        resource(name, (folder / name).read_bytes(), columns if name == described else ())
        for name in names
        if (folder / name).exists()
    ]
    title = f"levilab {record.experiment} run"
    return package(folder.name, title, resources, created=record.started_utc, creator=record.group)
