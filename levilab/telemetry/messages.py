"""The messages of a bench to its views, and their bytes.

A message is one of three dataclasses.  Its bytes are, in this order:

====================  ==================================================================================
4 bytes               length of the head, unsigned, little-endian
the head              JSON in UTF-8: ``kind`` (``state``, ``record``, ``poses``), the fields that are no arrays, by
                      their names, and ``rows``, the length of the arrays
the arrays            in the order of the fields, little-endian, row by row; their types stand in `_ARRAYS`
====================  ==================================================================================

`State` has no arrays.  Numbers in the head are finite; a value that is not known has no key in `State.last`.
"""

from __future__ import annotations

import json
import struct
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from levilab.files import finite, parse_json

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Poses in a second of bench time: between two of them a top that spins at 30 Hz turns by 27°.
POSES_PER_S = 400.0
#: Most points of a record that are sent: half of them are lows, half highs.
MOST_POINTS = 2000
#: Longest array that is read.
_MOST_ROWS = 100_000

#: How what comes is read: a key that is not known is of a later version.  What is sent is not checked.
_READ = ConfigDict(extra="ignore", allow_inf_nan=False)


class MalformedMessage(ValueError):
    """Bytes that are no message."""


@dataclass(frozen=True)
class Drive:
    """The generator as it was commanded; what it answers stands in the run's events and in run.json.

    Attributes:
        waveform: a short word, such as SIN.
        frequency_hz: [Hz].
        amplitude_vpp: peak to peak [V].
        offset_v: [V].
        output: whether the signal is on the terminals.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _READ

    waveform: str = ""
    frequency_hz: float = 0.0
    amplitude_vpp: float = 0.0
    offset_v: float = 0.0
    output: bool = False


@dataclass(frozen=True)
class Counting:
    """The counter as it was commanded.

    Attributes:
        gate_s: length of a count [s].
        trigger_level_v: [V].
        input: of the counter, 1 or 2.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _READ

    gate_s: float
    trigger_level_v: float
    input: int = 1


@dataclass(frozen=True)
class State:
    """What the bench does now.

    Attributes:
        time_s: since the bench was switched on, the clock of records and poses too [s].
        elapsed_s: since time zero of the run, as in readings.csv; None before it [s].
        experiment: its name; empty where no run is recorded.
        folder: the run folder, as a path of this machine; empty where no run is recorded.
        text: what the bench does, such as "drive at 31.20 Hz".
        share: of the way to the first reading, from 0 to 1; None once readings come.
        time_left_s: expected until the end, at most; None where it is not known [s].
        least_left_s: the same, at least; None: as much [s].
        readings: how many are in the run folder.
        events: how many are in the run folder.
        last: channel, as in readings.csv → what the bench measured last, in a reading or outside of one.
        drive: the generator; None without one.
        counting: the counter; None before it was set up.
        lost: kinds of instruments that do not answer now.
        virtual: whether the bench is simulated.
        speed: of a virtual bench: seconds of the bench in one of the wall; None: it does not keep to the wall clock.
        paused: whether the bench's time stands still.
        probe_m: height of the magnetometer's probe above the base; None: in its chamber, or not known [m].
        busy: on a bench for practice, whether a run is being recorded.
        took_hold, tuned_up: there, whether a top was seen to follow the drive yet, and to follow it up.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _READ

    time_s: float
    elapsed_s: float | None = None
    experiment: str = ""
    folder: str = ""
    text: str = ""
    share: float | None = None
    time_left_s: float | None = None
    least_left_s: float | None = None
    readings: int = 0
    events: int = 0
    last: dict[str, float] = field(default_factory=dict)
    drive: Drive | None = None
    counting: Counting | None = None
    lost: tuple[str, ...] = ()
    virtual: bool = False
    speed: float | None = None
    paused: bool = False
    probe_m: float | None = None
    busy: bool = False
    took_hold: bool = False
    tuned_up: bool = False


@dataclass(frozen=True, eq=False)
class Record:
    """The oscilloscope's latest record of one channel, by the lowest and the highest value in steps of equal length.

    Attributes:
        number: it grows with each record.
        channel: what it shows, such as "light" or "drive".
        time_s: when it was taken, on the clock of the bench [s].
        start_s: of its first step, from the trigger [s].
        step_s: length of a step [s].
        low: shape (n,), float32 [V].
        high: shape (n,), float32 [V].
    """

    number: int
    channel: str
    time_s: float
    start_s: float
    step_s: float
    low: NDArray[np.float32]
    high: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the top of a virtual bench was, at even steps since the last message of this kind.

    Attributes:
        start_s: time of the first pose, on the clock of the bench [s].
        step_s: from one to the next [s].
        position: of the centre of mass, shape (n, 3), float32 [m].
        quaternion: turns the body's axes to the room's; x, y, z, w; shape (n, 4), float32.
        up: whether a top floats; where none does, position and quaternion are those of rest; shape (n,), bool.
    """

    start_s: float
    step_s: float
    position: NDArray[np.float32]
    quaternion: NDArray[np.float32]
    up: NDArray[np.bool_]


Message = State | Record | Poses

_KINDS: dict[str, type[State | Record | Poses]] = {"state": State, "record": Record, "poses": Poses}
_NAMES = {kind: name for name, kind in _KINDS.items()}
#: Kind → array → its type on the wire, and how many of it stand in a row.
_ARRAYS: dict[str, dict[str, tuple[str, int]]] = {
    "state": {},
    "record": {"low": ("<f4", 1), "high": ("<f4", 1)},
    "poses": {"position": ("<f4", 3), "quaternion": ("<f4", 4), "up": ("|b1", 1)},
}


@dataclass(frozen=True)
class _RecordHead:
    __pydantic_config__: ClassVar[ConfigDict] = _READ

    number: int
    channel: str
    time_s: float
    start_s: float
    step_s: float


@dataclass(frozen=True)
class _PosesHead:
    __pydantic_config__: ClassVar[ConfigDict] = _READ

    start_s: float
    step_s: float


_HEADS: dict[str, TypeAdapter[Any]] = {
    "state": TypeAdapter(State),
    "record": TypeAdapter(_RecordHead),
    "poses": TypeAdapter(_PosesHead),
}
_LENGTH = struct.Struct("<I")


def encode(message: Message) -> bytes:
    """Return the bytes of a message."""
    name = _NAMES[type(message)]
    arrays = _ARRAYS[name]
    if isinstance(message, State):
        head = finite(asdict(message))
        head["last"] = {key: value for key, value in head["last"].items() if value is not None}
        rows = 0
    else:
        head = finite({one.name: getattr(message, one.name) for one in fields(message) if one.name not in arrays})
        rows = len(getattr(message, next(iter(arrays))))
    text = json.dumps({"kind": name, "rows": rows} | head, allow_nan=False, separators=(",", ":")).encode()
    parts = [np.ascontiguousarray(getattr(message, key), dtype=kind).tobytes() for key, (kind, _) in arrays.items()]
    return b"".join([_LENGTH.pack(len(text)), text, *parts])


def decode(data: bytes) -> Message:
    """Return the message that the bytes are of.  Raises MalformedMessage."""
    try:
        (length,) = _LENGTH.unpack_from(data)
        head = parse_json(data[_LENGTH.size : _LENGTH.size + length].decode())
        name, rows = head["kind"], head["rows"]
        values = _HEADS[name].validate_python(head)
    except (struct.error, ValueError, KeyError, TypeError, ValidationError) as error:
        raise MalformedMessage(f"no message: {error}") from error
    if type(rows) is not int or not 0 <= rows <= _MOST_ROWS:
        raise MalformedMessage(f"rows = {rows!r}: a whole number up to {_MOST_ROWS} is expected")
    if isinstance(values, State):
        return values
    return _KINDS[name](**vars(values), **_arrays(name, rows, data[_LENGTH.size + length :]))


def _arrays(name: str, rows: int, data: bytes) -> dict[str, Any]:
    sizes = {key: rows * width * np.dtype(kind).itemsize for key, (kind, width) in _ARRAYS[name].items()}
    if sum(sizes.values()) != len(data):
        raise MalformedMessage(f"{len(data)} bytes of arrays, {sum(sizes.values())} are expected")
    found: dict[str, Any] = {}
    begin = 0
    for key, (kind, width) in _ARRAYS[name].items():
        part = data[begin : begin + sizes[key]]
        array = np.frombuffer(part, np.uint8) != 0 if kind == "|b1" else np.frombuffer(part, kind)
        found[key] = array.reshape(rows, width) if width > 1 else array
        begin += sizes[key]
    return found
