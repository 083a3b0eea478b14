"""Oscilloscope records of a run: raw codes in traces/, how to read each in a line of traces.jsonl.

A long record is minutes on its way.  Meanwhile `traces/arriving.json` says how to read it, and its codes are appended
to `traces/arriving.codes` as they come; both go once the record has its own file and its line.  A process that is
killed leaves them behind, and with them what had come.
"""

import contextlib
import hashlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from instruments.drivers.oscilloscope import Trace
from levilab.computer import computer
from levilab.errors import DataError
from levilab.files import parse_json, replace_atomically
from levilab.settings import Settings, in_one_line

Codes = NDArray[np.uint8] | NDArray[np.uint16]


#: The folder of the codes, and the file with a line for each record.
FOLDER, INDEX = "traces", "traces.jsonl"
#: What is there while a record is on its way: how to read it, and the codes so far, one byte after the other.
ARRIVING, ARRIVING_CODES = f"{FOLDER}/arriving.json", f"{FOLDER}/arriving.codes"


class Head(Settings):
    """When and of what a record is, and how to read its codes in the names of `Trace`.

    Attributes:
        announced: points that it was to have, where it has fewer.
    """

    number: int
    time_s: float
    channel: str
    scope_channel: int
    dt_s: float
    t0_s: float
    volts_per_code: float
    offset_v: float
    lowest: int
    highest: int
    none: int | None
    announced: int | None = None


class Record(Head):
    """A line of the index: the head of a record, and its codes."""

    path: str = Field(pattern=rf"^{FOLDER}/\d+\.npy$")
    sha256: str


class Arriving(Head):
    """The head of a record on its way."""

    dtype: Literal["uint8", "uint16"]


@dataclass(frozen=True, eq=False)
class StoredTrace:
    """A record of a run.

    Attributes:
        number: from 1 on.
        time_s: when it was complete, on the clock of the readings.
        channel: the quantity that it shows.
        trace: the record itself.
        announced: points that it was to have, None where it has them all.
    """

    number: int
    time_s: float
    channel: str
    trace: Trace
    announced: int | None = None

    @property
    def start_s(self) -> float:
        """Time of its first point, on the clock of the readings: one that was cut short lacks its end."""
        return self.time_s - (self.announced or self.trace.codes.size) * self.trace.dt_s

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of its points [s], on the clock of the readings."""
        return np.asarray(self.start_s + self.trace.dt_s * np.arange(self.trace.codes.size), dtype=np.float64)

    @property
    def volts(self) -> NDArray[np.float64]:
        """Its points [V]."""
        return np.asarray(self.trace.volts, dtype=np.float64)

    @property
    def how_short(self) -> str:
        """The part of an incomplete record that there is, as text; empty where it is whole."""
        if self.announced is None:
            return ""
        return f"was cut short: {self.trace.codes.size} of its {self.announced} points are kept"


#: What a head and a `Trace` call alike.
_SHARED = ("dt_s", "t0_s", "volts_per_code", "offset_v", "lowest", "highest", "none")


def head_of(trace: Trace, number: int, time_s: float, channel: str, announced: int | None = None) -> Head:
    """Return the head of a record; see `StoredTrace`."""
    about = {name: getattr(trace, name) for name in _SHARED} | {"scope_channel": trace.channel, "announced": announced}
    return Head(number=number, time_s=time_s, channel=channel, **about)


def begin_arriving(folder: Path, head: Head, codes: Codes) -> None:
    """Say how to read a record whose codes are about to come.  Raises OSError."""
    _make_folder(folder)
    computer().remove(folder / ARRIVING_CODES)
    about = Arriving.model_validate(head.model_dump() | {"dtype": str(codes.dtype)})
    replace_atomically(folder / ARRIVING, about.model_dump_json() + "\n")


def append_arriving(folder: Path, codes: Codes) -> None:
    """Append the next codes of the record that is on its way; they are on the disk afterwards.  Raises OSError."""
    path = folder / ARRIVING_CODES
    is_new = not path.exists()
    with computer().open(path, "ab") as file:
        file.write(codes.tobytes())
        file.flush()
        computer().sync(file)
    if is_new:
        computer().sync_folder(path.parent)


def is_arriving(folder: Path) -> bool:
    """Return whether a run folder says how to read a record that is on its way."""
    return (folder / ARRIVING).is_file()


def forget_arriving(folder: Path) -> None:
    """Remove the part of a record on its way, which is kept elsewhere, or of no use.  Raises OSError."""
    for name in (ARRIVING, ARRIVING_CODES):
        computer().remove(folder / name)


def partial_record(folder: Path) -> StoredTrace | None:
    """Return the part of the record that was on its way when a process was killed; None where there is none.

    Raises:
        DataError: what is there of it cannot be read.
    """
    about, codes = folder / ARRIVING, folder / ARRIVING_CODES
    try:
        if not about.is_file():
            return None
        head = Arriving.model_validate(parse_json(about.read_text(encoding="utf-8")))
        if any(_line(folder / INDEX, line).number == head.number for line in _lines(folder)):
            return None
        whole = folder / _path(head.number)
        if whole.is_file():  # killed between codes and line
            return _make_trace(head.model_copy(update={"announced": None}), np.load(whole, allow_pickle=False))
        content = codes.read_bytes() if codes.is_file() else b""
    except FileNotFoundError:  # the process that writes it has kept it meanwhile
        return None
    except OSError as error:
        raise DataError(f"{about}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise DataError(f"{about}: does not say how to read {codes.name}, remove both ({error})") from error
    dtype = np.dtype(head.dtype)
    count = len(content) // dtype.itemsize
    return _make_trace(head, np.frombuffer(content, dtype=dtype, count=count)) if count else None


def save_codes(folder: Path, head: Head, codes: Codes) -> str:
    """Write the codes of a record; returns its line for the index.  Raises OSError."""
    _make_folder(folder)
    buffer = io.BytesIO()
    np.save(buffer, codes, allow_pickle=False)
    content = buffer.getvalue()
    name = _path(head.number)
    replace_atomically(folder / name, content)
    file = {"path": name, "sha256": hashlib.sha256(content).hexdigest()}
    record = Record.model_validate(head.model_dump(exclude_defaults=True) | file)
    return record.model_dump_json(exclude_defaults=True)


def _path(number: int) -> str:
    """Return the path of the codes of a record, in the run folder."""
    return f"{FOLDER}/{number:06d}.npy"


def _make_folder(folder: Path) -> None:
    if not (folder / FOLDER).is_dir():
        with contextlib.suppress(FileExistsError):
            computer().make_folder(folder / FOLDER)
        computer().sync_folder(folder)


def has_codes(folder: Path, line: str) -> bool:
    """Return whether the codes that a line of the index describes are in a run folder."""
    return (folder / _line(folder / INDEX, line).path).is_file()


def last_number(folder: Path) -> int:
    """Return the number of the last record whose codes are in a run folder, 0 where there are none.

    A process that was killed between codes and line has left codes that no line describes: their number is not given
    again, so that they stay as they are.
    """
    numbers = [int(path.stem) for path in (folder / FOLDER).glob("*.npy") if path.stem.isdecimal()]
    return max(numbers, default=0)


def described_times(folder: Path) -> list[float]:
    """Return the times at which the records in a run folder's index were kept [s].  Raises DataError."""
    return [_line(folder / INDEX, line).time_s for line in _lines(folder)]


def undescribed_codes(folder: Path) -> list[str]:
    """Return the paths of the codes in a run folder that its index does not describe.  Raises DataError."""
    described = {_line(folder / INDEX, line).path for line in _lines(folder)}
    if found := partial_record(folder):
        described.add(_path(found.number))
    there = sorted(path.relative_to(folder).as_posix() for path in (folder / FOLDER).glob("*.npy"))
    return [path for path in there if path not in described]


def load_traces(folder: Path) -> list[StoredTrace]:
    """Return the records of a run folder, in the order in which they were kept.

    The codes of a record are on the disk before its line: a process that was killed between the two, or in the middle
    of the line, has left codes without a line, and these are left out.  One that was killed while a long record was on
    its way has left what had come: it is the last one, and shorter than announced.  Raises DataError for codes that are
    missing or are not those that were written.
    """
    cut_short = partial_record(folder)  # first, so that a record which is kept meanwhile is among the others
    whole = [_load(folder, _line(folder / INDEX, line)) for line in _lines(folder)]
    if cut_short is None or any(one.number == cut_short.number for one in whole):
        return whole
    return [*whole, cut_short]


def _lines(folder: Path) -> list[str]:
    """Return the whole lines of the index."""
    index = folder / INDEX
    try:
        text = index.read_text(encoding="utf-8", errors="replace") if index.exists() else ""
    except OSError as error:
        raise DataError(f"{index}: cannot be read ({error.strerror})") from error
    return text.split("\n")[:-1]


def _line(index: Path, line: str) -> Record:
    try:
        return Record.model_validate(parse_json(line))
    except ValidationError as error:
        raise DataError(f"{index}: a line describes no record: {in_one_line(error)}") from error
    except ValueError as error:
        raise DataError(f"{index}: a line of it is damaged ({error})") from error


def _load(folder: Path, record: Record) -> StoredTrace:
    path = folder / record.path
    try:
        content = path.read_bytes()
    except OSError as error:
        advice = f"{INDEX} names it; bring it back, or remove its line there"
        raise DataError(f"{path}: cannot be read ({error.strerror}): {advice}") from error
    if hashlib.sha256(content).hexdigest() != record.sha256:
        raise DataError(f"{path}: is not what was recorded: its sha256 differs from the one in {INDEX}")
    return _make_trace(record, np.load(io.BytesIO(content), allow_pickle=False))


def _make_trace(head: Head, codes: Codes) -> StoredTrace:
    trace = Trace(codes, channel=head.scope_channel, **{name: getattr(head, name) for name in _SHARED})
    return StoredTrace(head.number, head.time_s, head.channel, trace, head.announced)
