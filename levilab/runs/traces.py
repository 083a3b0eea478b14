"""Oscilloscope records of a run: raw codes in traces/, how to read each in a line of traces.jsonl."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from instruments.drivers.oscilloscope import Trace
from levilab.errors import DataError
from levilab.files import replace_atomically

if TYPE_CHECKING:
    from pathlib import Path

#: The folder of the codes, and the file with a line for each record.
FOLDER, INDEX = "traces", "traces.jsonl"

#: What a line of the index says of the codes, in the names of `Trace`.
_SCALING = ("dt_s", "t0_s", "volts_per_code", "offset_v", "lowest", "highest", "none")


@dataclass(frozen=True, eq=False)
class StoredTrace:
    """A record of a run.

    Attributes:
        number: from 1 on.
        time_s: when it was kept, on the clock of the readings.
        channel: what it shows.
        trace: the record itself.
    """

    number: int
    time_s: float
    channel: str
    trace: Trace


def save_codes(folder: Path, number: int, time_s: float, trace: Trace, channel: str) -> str:
    """Write the codes of a record; returns its line for the index.  Raises OSError."""
    (folder / FOLDER).mkdir(exist_ok=True)
    buffer = io.BytesIO()
    np.save(buffer, trace.codes, allow_pickle=False)
    content = buffer.getvalue()
    name = f"{FOLDER}/{number:06d}.npy"
    replace_atomically(folder / name, content)
    about: dict[str, Any] = {
        "number": number,
        "time_s": time_s,
        "channel": channel,
        "path": name,
        "scope_channel": trace.channel,
        "sha256": hashlib.sha256(content).hexdigest(),
    }
    return json.dumps(about | {key: getattr(trace, key) for key in _SCALING}, ensure_ascii=False, allow_nan=False)


def load_traces(folder: Path) -> list[StoredTrace]:
    """The records of a run folder, in the order in which they were kept; a torn last line is left out.

    Raises DataError for codes that are missing or are not those that were written.
    """
    index = folder / INDEX
    text = index.read_text(encoding="utf-8") if index.exists() else ""
    return [_load(folder, json.loads(line)) for line in text[: text.rfind("\n") + 1].splitlines()]


def _load(folder: Path, about: dict[str, Any]) -> StoredTrace:
    path = folder / about["path"]
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}): {INDEX} names it") from error
    if hashlib.sha256(content).hexdigest() != about["sha256"]:
        raise DataError(f"{path}: is not what was recorded: its sha256 differs from the one in {INDEX}")
    codes = np.load(io.BytesIO(content), allow_pickle=False)
    scaling = {key: about[key] for key in _SCALING}
    trace = Trace(codes=codes, channel=about["scope_channel"], **scaling)
    return StoredTrace(about["number"], about["time_s"], about["channel"], trace)
