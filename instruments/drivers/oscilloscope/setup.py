"""What an oscilloscope was asked for, and its inputs' settings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NoReturn, cast

from instruments.drivers.scpi import ScpiInstrument, Setting

if TYPE_CHECKING:
    from instruments.links.transport import Transport

    Value = bool | float | str

#: Scopes round what they are given: by so much of a division and of the record, beside what all instruments do.
_OF_A_DIVISION, _OF_THE_RECORD = 0.1, 0.01

SLOPES = {"rising": "POS", "falling": "NEG"}


@dataclass(frozen=True)
class Setup:
    """What prepare() was asked for; see :class:`instruments.drivers.oscilloscope.Oscilloscope`."""

    channels: tuple[int, ...]
    duration_s: float
    points: int
    volts_per_division: float
    offset_v: float
    coupling: str
    trigger_level_v: float
    trigger_slope: str
    trigger_source: int
    sweep: str

    @property
    def shown(self) -> tuple[int, ...]:
        """The channels that are on: the recorded ones, and the trigger's."""
        return tuple(sorted({*self.channels, self.trigger_source}))

    def rounding(self, unit: str) -> float:
        """How far from what it was given a scope may set a number of this unit."""
        return {"V": _OF_A_DIVISION * self.volts_per_division, "s": _OF_THE_RECORD * self.duration_s}.get(unit, 0.0)


class Channel(ScpiInstrument):
    """The settings of one input: headers that begin with its name."""

    #: How its headers begin.
    HEAD: ClassVar[str] = "CHAN{}:"

    display: Setting[bool]
    inverted: Setting[bool]

    def __init__(self, scope: ScpiInstrument, number: int) -> None:
        super().__init__(scope.transport)
        self.scope, self.number = scope, number
        self.head = self.HEAD.format(number)
        # only its question is used here: commands go through the scope, which reads its error queue
        self.transport = cast("Transport", _Headed(scope.transport, self.head))

    def command(self, message: str) -> None:
        """Send a command of this input."""
        self.scope.command(self.head + message)

    def reject(self, question: str, answer: str, expected: str) -> NoReturn:
        """As every instrument; the question is named whole."""
        self.scope.reject(self.head + question, answer, expected)


class _Headed:
    """A transport for questions that begin with the same header."""

    def __init__(self, transport: Transport, head: str) -> None:
        self.address, self._transport, self._head = transport.address, transport, head

    def query(self, message: str, *, patience: float = 0.0) -> str:
        return self._transport.query(self._head + message, patience=patience)
