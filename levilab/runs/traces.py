"""Oscilloscope records of a run: raw codes in traces/, how to read each in a line of traces.jsonl."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field, ValidationError

from instruments.drivers.oscilloscope import Trace
from levilab.errors import DataError
from levilab.files import parse_json, replace_atomically, sync_folder
from levilab.settings import Settings, in_one_line

if TYPE_CHECKING:
    from pathlib import Path

#: The folder of the codes, and the file with a line for each record.
FOLDER, INDEX = "traces", "traces.jsonl"


class Record(Settings):
    """A line of the index: when and of what the record is, its codes, and how to read them in the names of `Trace`."""

    number: int
    time_s: float
    channel: str
    path: str = Field(pattern=rf"^{FOLDER}/\d+\.npy$")
    sha256: str
    scope_channel: int
    dt_s: float
    t0_s: float
    volts_per_code: float
    offset_v: float
    lowest: int
    highest: int
    none: int | None


@dataclass(frozen=True, eq=False)
class StoredTrace:
    """A record of a run.

    Attributes:
        number: from 1 on.
        time_s: when it was complete, on the clock of the readings.
        channel: what it shows.
        trace: the record itself.
    """

    number: int
    time_s: float
    channel: str
    trace: Trace


def save_codes(folder: Path, number: int, time_s: float, trace: Trace, channel: str) -> str:
    """Write the codes of a record; returns its line for the index.  Raises OSError."""
    if not (folder / FOLDER).is_dir():
        (folder / FOLDER).mkdir(exist_ok=True)
        sync_folder(folder)
    buffer = io.BytesIO()
    np.save(buffer, trace.codes, allow_pickle=False)
    content = buffer.getvalue()
    name = f"{FOLDER}/{number:06d}.npy"
    replace_atomically(folder / name, content)
    record = Record(
        number=number,
        time_s=time_s,
        channel=channel,
        path=name,
        sha256=hashlib.sha256(content).hexdigest(),
        scope_channel=trace.channel,
        dt_s=trace.dt_s,
        t0_s=trace.t0_s,
        volts_per_code=trace.volts_per_code,
        offset_v=trace.offset_v,
        lowest=trace.lowest,
        highest=trace.highest,
        none=trace.none,
    )
    return record.model_dump_json()


def has_codes(folder: Path, line: str) -> bool:
    """Whether the codes that a line of the index describes are in a run folder."""
    return (folder / _line(folder / INDEX, line).path).is_file()


def last_number(folder: Path) -> int:
    """The number of the last record whose codes are in a run folder, 0 where there are none.

    A process that was killed between codes and line has left codes that no line describes: their number is not given
    again, so that they stay as they are.
    """
    numbers = [int(path.stem) for path in (folder / FOLDER).glob("*.npy") if path.stem.isdecimal()]
    return max(numbers, default=0)


def described_times(folder: Path) -> list[float]:
    """When the records that the index of a run folder describes were kept [s].  Raises DataError."""
    return [_line(folder / INDEX, line).time_s for line in _lines(folder)]


def undescribed_codes(folder: Path) -> list[str]:
    """Codes in a run folder that no line of the index describes, as their paths in it.  Raises DataError."""
    described = {_line(folder / INDEX, line).path for line in _lines(folder)}
    there = sorted(path.relative_to(folder).as_posix() for path in (folder / FOLDER).glob("*.npy"))
    return [path for path in there if path not in described]


def load_traces(folder: Path) -> list[StoredTrace]:
    """The records of a run folder, in the order in which they were kept.

    The codes of a record are on the disk before its line: a process that was killed between the two, or in the middle
    of the line, has left codes without a line, and these are left out.  Raises DataError for codes that are missing or
    are not those that were written.
    """
    return [_load(folder, _line(folder / INDEX, line)) for line in _lines(folder)]


def _lines(folder: Path) -> list[str]:
    """The whole lines of the index."""
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
    trace = Trace(
        np.load(io.BytesIO(content), allow_pickle=False),
        record.dt_s,
        record.t0_s,
        record.volts_per_code,
        record.offset_v,
        record.scope_channel,
        record.lowest,
        record.highest,
        record.none,
    )
    return StoredTrace(record.number, record.time_s, record.channel, trace)
