"""The messages of a bench to its views, and their bytes.

A message is one of three dataclasses.  Its bytes are those of a document (`levilab.telemetry.codec`) with its fields
and its ``kind``: ``state``, ``record`` or ``poses``.  A value that is not known has no key in `State.last`.
"""

from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, PlainValidator, TypeAdapter

from levilab.telemetry.codec import MalformedMessage, pack, unpack

#: Poses in a second of bench time: between two of them a top that spins at 30 Hz turns by 27°.
POSES_PER_S = 400.0
#: Most points of a record that are sent: half of them are lows, half highs.
MOST_POINTS = 2000

#: How what comes is read: a key that is not known is of a later version.  What is sent is not checked.
_READ = ConfigDict(extra="ignore", allow_inf_nan=False)


def _must_be(kind: type[np.generic], *width: int) -> PlainValidator:
    """Return a check that a value is an array of a kind with rows of a width."""

    def check(value: Any) -> Any:
        if not isinstance(value, np.ndarray) or value.dtype != kind or value.ndim < 1 or value.shape[1:] != width:
            raise ValueError(f"an array of {kind.__name__} is expected, with rows of {width}")
        return value

    return PlainValidator(check)


def _must_be_text(value: Any) -> str:
    """Return a text as it is: pydantic would make a plain one of a `Text`."""
    if not isinstance(value, str):
        raise TypeError("a text is expected")
    return value


def _same_length(*arrays: NDArray[Any]) -> None:
    if len({len(one) for one in arrays}) > 1:
        raise ValueError("arrays of one length are expected")


@dataclass(frozen=True)
class Drive:
    """The generator as it was commanded; its answers stand in the run's events and in run.json.

    Attributes:
        waveform: a short word, such as SIN.
        frequency_hz: [Hz].
        amplitude_vpp: peak to peak [V].
        offset_v: [V].
        output: whether the signal is on the terminals.
        triggered: whether each turn of the top starts a cycle: the frequency is then that of a cycle alone.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _READ

    waveform: str = ""
    frequency_hz: float = 0.0
    amplitude_vpp: float = 0.0
    offset_v: float = 0.0
    output: bool = False
    triggered: bool = False


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
class Count:
    """What the counter counted last of the spin.

    Attributes:
        frequency_hz: mean over the gate [Hz].
        end_s: end of the gate, on the clock of the bench [s].
        gate_s: its length [s].
    """

    __pydantic_config__: ClassVar[ConfigDict] = _READ

    frequency_hz: float
    end_s: float
    gate_s: float


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
        count: its last count of the spin; None where it sees no light pulses.
        lost: kinds of instruments that do not answer now.
        virtual: whether the bench is simulated.
        speed: of a virtual bench: seconds of the bench in one of the wall; None: it does not keep to the wall clock.
        paused: whether the bench's time stands still.
        probe_m: height of the magnetometer's probe above the base; None: in its chamber, or not known [m].
        busy: on a bench for practice, whether a run is being recorded.
        took_hold, tuned_up: there, whether a top was seen to follow the drive yet, and to follow it up.
        goal_hz: there, the frequency at which the drive is, or to which it goes [Hz].
        what_if: there, name → value of what a person can change of the top and its surroundings.
        task, task_share: there, the task under way, and the part of the way to its goal.
        seed: there, which draws the top, the base and the noise of the light.
        tasks_done: there, the tasks whose goals were reached.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _READ

    time_s: float
    elapsed_s: float | None = None
    experiment: str = ""
    folder: str = ""
    text: Annotated[str, PlainValidator(_must_be_text)] = ""
    share: float | None = None
    time_left_s: float | None = None
    least_left_s: float | None = None
    readings: int = 0
    events: int = 0
    last: dict[str, float] = field(default_factory=dict)
    drive: Drive | None = None
    counting: Counting | None = None
    count: Count | None = None
    lost: tuple[str, ...] = ()
    virtual: bool = False
    speed: float | None = None
    paused: bool = False
    probe_m: float | None = None
    busy: bool = False
    took_hold: bool = False
    tuned_up: bool = False
    goal_hz: float | None = None
    what_if: dict[str, float] = field(default_factory=dict)
    task: str = ""
    task_share: float = 0.0
    seed: int = 0
    tasks_done: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Record:
    """The oscilloscope's latest record of one channel, by the lowest and the highest value in steps of equal length.

    Attributes:
        number: it grows with each record.
        channel: the quantity that it shows, such as "light" or "drive".
        time_s: when it was taken, on the clock of the bench [s].
        start_s: of its first step, from the trigger [s].
        step_s: length of a step [s].
        low: shape (n,), float32 [V].
        high: shape (n,), float32 [V].
        drawn: whether a virtual bench drew it from its signals, and no oscilloscope was read.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _READ

    number: int
    channel: str
    time_s: float
    start_s: float
    step_s: float
    low: Annotated[NDArray[np.float32], _must_be(np.float32)]
    high: Annotated[NDArray[np.float32], _must_be(np.float32)]
    drawn: bool = False

    def __post_init__(self) -> None:
        _same_length(self.low, self.high)


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the top of a virtual bench was, at even steps since the last message of this kind.

    Attributes:
        start_s: time of the first pose, on the clock of the bench [s].
        step_s: from one to the next [s].
        position: of the centre of mass, shape (n, 3), float32 [m].
        quaternion: turns the body's axes to the room's; x, y, z, w; shape (n, 4), float32.
        up: whether a top floats, shape (n,), bool; where none does, position and quaternion are those of the top as it
            fell and lies, or, without one, 0 and upright.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _READ

    start_s: float
    step_s: float
    position: Annotated[NDArray[np.float32], _must_be(np.float32, 3)]
    quaternion: Annotated[NDArray[np.float32], _must_be(np.float32, 4)]
    up: Annotated[NDArray[np.bool_], _must_be(np.bool_)]

    def __post_init__(self) -> None:
        _same_length(self.position, self.quaternion, self.up)


Message = State | Record | Poses

_READERS: dict[str, TypeAdapter[Message]] = {
    kind: TypeAdapter(one) for kind, one in {"state": State, "record": Record, "poses": Poses}.items()
}
_KINDS = {State: "state", Record: "record", Poses: "poses"}


def encode(message: Message) -> bytes:
    """Return the bytes of a message."""
    if isinstance(message, State):
        fields = asdict(replace(message, last={name: one for name, one in message.last.items() if np.isfinite(one)}))
    else:
        fields = vars(message)
    return pack({"kind": _KINDS[type(message)]} | fields)


def decode(data: bytes) -> Message:
    """Return the message that the bytes are of.  Raises MalformedMessage."""
    head = unpack(data)
    try:
        return _READERS[head["kind"]].validate_python(head)
    except (KeyError, TypeError, ValueError) as error:
        raise MalformedMessage(f"no message: {error}") from error
