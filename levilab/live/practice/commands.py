"""What a person can do at the bench for practice: a table of commands, and what the bench answers.

A command is checked twice: its form here, and what the bench allows by the bench itself, whose limits are those of a
bench file.  A refusal says what was seen, what is expected and what to do.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, StrictBool, TypeAdapter, ValidationError

from levilab.errors import LevilabError
from levilab.present.progress import Display
from levilab.runs.run import LONGEST_GROUP
from levilab.settings import Settings, in_one_line

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

#: The speeds of the bench: seconds of it in one of the wall.
SLOWEST, FASTEST = 0.1, 10.0
#: The slowest and the fastest change of the drive's frequency [Hz/s].
SLOWEST_RAMP, FASTEST_RAMP = 0.001, 10.0


class CommandRefused(LevilabError):
    """A command that the bench does not carry out."""


class SwitchDrive(Settings):
    """Switch the generator's output on or off.  It goes on at the frequency and amplitude that are set."""

    do: Literal["switch the drive"] = "switch the drive"
    on: StrictBool


class TuneDrive(Settings):
    """Change the drive; what is None stays.

    Attributes:
        frequency_hz: where the frequency goes [Hz]; at once while the output is off, else by the ramp.
        amplitude_vpp: peak to peak [V].
        waveform: SIN, SQU or TRI; the output goes off for a moment.
        ramp_hz_per_s: how fast the frequency goes there while the output is on [Hz/s of bench time].
    """

    do: Literal["tune the drive"] = "tune the drive"
    frequency_hz: Annotated[float, Field(strict=True, gt=0)] | None = None
    amplitude_vpp: Annotated[float, Field(strict=True, gt=0)] | None = None
    waveform: Literal["SIN", "SQU", "TRI"] | None = None
    ramp_hz_per_s: Annotated[float, Field(strict=True, ge=SLOWEST_RAMP, le=FASTEST_RAMP)] | None = None


class MatchDrive(Settings):
    """Set the drive to the spin that the counter counted last, where it can take hold of the top."""

    do: Literal["match the drive"] = "match the drive"


class PutBack(Settings):
    """Spin the top by hand and let it float; one that still floats, perhaps too slowly, is spun again."""

    do: Literal["put the top back"] = "put the top back"


class ChangeBench(Settings):
    """Change the top or its surroundings, with immediate effect.  values: names in WHAT_IF; none: all as usual."""

    do: Literal["change the bench"] = "change the bench"
    values: dict[str, Annotated[float, Field(strict=True, allow_inf_nan=False)]] = Field(default={}, max_length=20)


class TakeSeed(Settings):
    """Put a top of one's own over a base of one's own.

    Attributes:
        seed: which draws them; None: that of the group.
        group: by the number in its name, as a worksheet lists it; one without a number changes nothing.
    """

    do: Literal["take a seed"] = "take a seed"
    seed: Annotated[int, Field(strict=True, ge=0, lt=1 << 31)] | None = None
    group: str = Field(default="", max_length=LONGEST_GROUP)


class BeginTask(Settings):
    """Begin a task.  task: its name in TASKS; empty: leave the one under way."""

    do: Literal["begin a task"] = "begin a task"
    task: str = ""


class AnswerTask(Settings):
    """Answer the task under way."""

    do: Literal["answer"] = "answer"
    value: Annotated[float, Field(strict=True, allow_inf_nan=False)]


class SetSpeed(Settings):
    """Change how fast the bench's time passes.  speed: seconds of the bench in one of the wall."""

    do: Literal["set the speed"] = "set the speed"
    speed: Annotated[float, Field(strict=True, ge=SLOWEST, le=FASTEST)]


class Pause(Settings):
    """Stop the bench's time, or let it go on."""

    do: Literal["pause"] = "pause"
    on: StrictBool


class RecordRun(Settings):
    """Carry out an experiment on this bench, and write a run folder.

    Attributes:
        experiment: its name in PRACTICE, or of `levilab acquire`.
        settings: as for the command line, such as "spin.interval_s=5"; none: those of PRACTICE.
        group, note: kept with the run.
    """

    do: Literal["record a run"] = "record a run"
    experiment: str
    settings: tuple[Annotated[str, Field(max_length=200)], ...] = Field(default=(), max_length=50)
    group: str = Field(default="", max_length=LONGEST_GROUP)
    note: str = Field(default="", max_length=1000)


class StopRun(Settings):
    """End the run that is being recorded after the reading under way, as Ctrl-C does: outputs go off, it is kept."""

    do: Literal["stop the run"] = "stop the run"


Command = (
    SwitchDrive | TuneDrive | MatchDrive | PutBack | ChangeBench | TakeSeed | BeginTask | AnswerTask
    | SetSpeed | Pause | RecordRun | StopRun
)  # fmt: skip
_COMMANDS: TypeAdapter[Command] = TypeAdapter(Annotated[Command, Field(discriminator="do")])


def command_of(table: Any) -> Command:
    """Return the command in a table of plain values, such as {"do": "pause", "on": True}.

    Raises:
        CommandRefused: the table is not a command.
    """
    try:
        return _COMMANDS.validate_python(table)
    except ValidationError as error:
        raise CommandRefused("not carried out: {why}", why=in_one_line(error)) from error


EventKind = Literal["ready", "done", "refused", "message", "recording", "recorded", "ended"]


@dataclass(frozen=True)
class PracticeEvent:
    """What the bench reports, in order, and loses none of.

    Attributes:
        kind: "ready" once the instruments answer; "done" or "refused" for each command; "message", a line for the
            person at the bench; "recording" and "recorded", a run; "ended", the process is over.
        text: for people, but data like everything in a run; empty for "done".
        number: of the command that it answers, or that began the run; None where there is none.
        folder: of the run.
        status: of the run that ended: finished, interrupted or failed.
        scene: of the simulated top, with "ready", "recording" and "recorded".
        port, token: where the bench publishes, on the way to `PracticeBench.address` alone.
    """

    kind: EventKind
    text: str = ""
    number: int | None = None
    folder: str = ""
    status: str = ""
    scene: dict[str, Any] = field(default_factory=dict)
    port: int = 0
    token: str = ""


@dataclass
class Voice(Display):
    """What the bench says: events in their order, and the line that stays in the page's picture of the top.

    Attributes:
        pipe: to the process that holds the bench; where that is gone, to nowhere.
        text: what stays.
    """

    pipe: Connection
    text: str = ""

    def report(self, kind: EventKind, text: str, number: int | None = None, **about: Any) -> None:
        """Send an event."""
        with contextlib.suppress(OSError):
            self.pipe.send(PracticeEvent(kind, text, number, **about))

    def message(self, text: str) -> None:
        """Report a line for the person at the bench, as a run does that is recorded."""
        self.report("message", text)

    def say(self, text: str, lasting: str | None = None) -> None:
        """Report a line, and leave it in the page.

        Args:
            text: with the numbers of this moment.
            lasting: what stays, where those numbers would grow old; None: the text itself.
        """
        self.text = text if lasting is None else lasting
        self.message(text)
