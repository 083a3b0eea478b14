"""What an oscilloscope was asked for, and its inputs' settings."""

from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn

from instruments.drivers.scpi import ScpiInstrument
from instruments.drivers.setting import Setting

#: Scopes round settings by these fractions of a division and of the record, beside what all instruments do.
_OF_A_DIVISION, _OF_THE_RECORD = 0.1, 0.01

SLOPES = {"rising": "POS", "falling": "NEG"}


def time_scales(low: float, high: float, mantissas: tuple[float, ...] = (1, 2, 5)) -> tuple[float, ...]:
    """Return the times per division of a scope, 1, 2 and 5 · 10ⁿ s, from the lowest to the highest."""
    every = (float(f"{m}e{k}") for k in range(-9, 3) for m in mantissas)
    return tuple(scale for scale in every if low <= scale <= high)


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
        """Return the largest difference between a setting of this unit and the number that was sent."""
        return {"V": _OF_A_DIVISION * self.volts_per_division, "s": _OF_THE_RECORD * self.duration_s}.get(unit, 0.0)


class Channel(ScpiInstrument):
    """The settings of one input: headers that begin with its name.  number: of the input; scope: whose it is."""

    #: How its headers begin.
    HEAD: ClassVar[str] = "CHAN{}:"

    display: Setting[bool]
    inverted: Setting[bool]

    scope: ScpiInstrument
    number: int
    head: str

    def __init__(self, scope: ScpiInstrument, number: int) -> None:
        super().__init__(scope.transport, clock=scope.clock)
        self.scope, self.number, self.head = scope, number, self.HEAD.format(number)

    def header_in_use(self, header: str) -> str:
        """Return the header with the name of the input."""
        return self.head + header

    def command(self, message: str) -> None:
        """Send a command of this input; the scope reads its error queue."""
        self.scope.command(message)

    def reject(self, question: str, answer: str, expected: str) -> NoReturn:
        """Reject an answer as the scope does."""
        self.scope.reject(question, answer, expected)

    def rounding(self, row: Setting[Any]) -> float:
        """Return the rounding of the scope."""
        return self.scope.rounding(row)

    def __repr__(self) -> str:
        return f"<input {self.number} of {self.scope!r}>"
