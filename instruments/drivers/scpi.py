"""IEEE 488.2 and SCPI: what the drivers have in common, and how they declare a quantity in one line.

Source: IEEE 488.2-1992; SCPI-1999 volumes 1 and 2.
"""

from __future__ import annotations

import contextlib
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar, cast, overload

from instruments.clock import WallClock
from instruments.errors import BadAnswer, CommandRefused, OutOfRange, WrongInstrument
from instruments.ieee488 import INFINITY, NOT_A_NUMBER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from instruments.clock import Clock
    from instruments.links.transport import Transport

T = TypeVar("T", bound=bool | float | str)
#: Error queues hold 20 to 32 entries; more questions than that mean that the instrument never says "none".
_LONGEST_ERROR_QUEUE = 64
#: An answer's text as a value.  Instruments quote some words, and print switches as 0 or 1.
_FROM_WIRE: dict[type, Callable[[str], Any]] = {
    float: lambda answer: _setting_of(float(answer)),
    bool: lambda answer: bool(int(answer)),
    str: lambda answer: answer.strip('"'),
}


def _setting_of(number: float) -> float:
    """The number, if a setting can be it: infinity is printed as 9.9E37.  Raises ValueError."""
    if not math.isfinite(number) or abs(number) >= NOT_A_NUMBER:
        raise ValueError(number)
    return number


class ScpiInstrument:
    """An instrument that speaks SCPI over a transport.

    MODELS: what the model field of ``*IDN?`` must match, whole (regular expression).
    """

    MODELS: ClassVar[str] = ".*"
    #: How its serial line is set when it leaves the factory; empty: it has none.
    SERIAL: ClassVar[Mapping[str, Any]] = {}

    def __init__(self, transport: Transport, *, clock: Clock | None = None) -> None:
        """Drive the instrument at this link.  clock: of the bench, for what is waited for; by default the wall's."""
        self.transport = transport
        self.clock: Clock = clock or WallClock()
        #: What was set last of each declared setting, since the last reset.
        self.set_to: dict[str, bool | float | str] = {}

    def identity(self) -> str:
        """The answer to ``*IDN?``.  Raises WrongInstrument when another model answers, BadAnswer when it is no text."""
        answer = self.transport.query("*IDN?")
        if not answer.isprintable():
            with self.resynchronised():
                raise BadAnswer(self.transport.address, "*IDN?", answer, "maker, model, serial number, firmware")
        model = answer.split(",")[1].strip() if answer.count(",") >= 2 else answer
        if not re.fullmatch(self.MODELS, model, re.IGNORECASE):
            raise WrongInstrument(self.transport.address, answer, f"one of {self.kind_of_instrument()}")
        return answer

    @classmethod
    def kind_of_instrument(cls) -> str:
        """What it drives, in words: the first line of its documentation."""
        return (cls.__doc__ or cls.__name__).splitlines()[0].rstrip(".")

    def forget_errors(self) -> None:
        """Empty the error queue: what an earlier program left there is not ours."""
        self.transport.write("*CLS")

    def command(self, message: str) -> None:
        """Send a command and read the error queue.  Raises CommandRefused with the queue's texts."""
        if message.upper().startswith("*RST"):
            self.set_to.clear()
        self.transport.write(message)
        self.raise_errors(message)

    def raise_errors(self, after: str) -> None:
        """Empty the error queue; raise CommandRefused if there was anything in it.

        Entries look like ``+0,"No error"`` or, from some makers, ``0,"No error"``.
        """
        entries: list[str] = []
        for _ in range(_LONGEST_ERROR_QUEUE):
            answer = self.transport.query("SYST:ERR?")
            number, _, text = answer.partition(",")
            if not re.fullmatch(r"[+-]?\d{1,9}", number.strip()):
                self.transport.clear()
                raise BadAnswer(self.transport.address, "SYST:ERR?", answer, 'a number and a text, as +0,"No error"')
            if int(number) == 0:
                break
            entries.append(f"{number} {text}")
        if entries:
            raise CommandRefused(self.transport.address, after, tuple(entries))

    def measured(self, question: str, *, patience: float = 0.0) -> float | None:
        """A measured number, None where there was nothing to measure.

        The error queue is read first: what went wrong before is told instead of a number that cannot be trusted.
        patience: how long the measurement takes [s].  Raises CommandRefused, NoAnswer, BadAnswer.
        """
        self.raise_errors(question)
        answer = self.transport.query(question, patience=patience)
        with self.resynchronised():
            return parse_reading(self.transport.address, question, answer)

    @contextlib.contextmanager
    def resynchronised(self) -> Iterator[None]:
        """After an answer that makes no sense the link is cleared: it may have been another question's."""
        try:
            yield
        except BadAnswer:
            self.transport.clear()
            raise

    def settings(self) -> dict[str, bool | float | str]:
        """Every declared setting as it stands in the instrument, unit at the end of the name."""
        return {setting.full_name: getattr(self, setting.name) for setting in self.declared()}

    def unlike(self, now: dict[str, bool | float | str]) -> dict[str, tuple[object, object]]:
        """Settings that stand in the instrument otherwise than they were set: name → (as set, now)."""
        return {
            setting.full_name: (asked, now[setting.full_name])
            for setting in self.declared()
            if (asked := self.set_to.get(setting.full_name)) is not None
            and setting.differs(asked, now[setting.full_name])
        }

    @classmethod
    def declared(cls) -> list[Setting[Any]]:
        """Its declared settings, those of a base first."""
        rows = (row for owner in reversed(cls.__mro__) for row in vars(owner).values())
        return [row for row in rows if isinstance(row, Setting)]

    def close(self) -> None:
        """Give the instrument back."""
        self.transport.close()


@dataclass(eq=False)
class Setting(Generic[T]):
    """A quantity of an instrument that can be set and asked for, declared in one line.

    header: the SCPI header; kind: float, bool or str; unit: of the number on the wire;
    low, high: what the instrument takes; choices: the words it takes, in their short form.
    """

    header: str
    kind: type[T]
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    name: str = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @property
    def full_name(self) -> str:
        """The name with its unit, as it leaves the program: gate_s."""
        return f"{self.name}_{self.unit.lower()}" if self.unit else self.name

    @overload
    def __get__(self, instrument: None, owner: type) -> Setting[T]: ...
    @overload
    def __get__(self, instrument: ScpiInstrument, owner: type) -> T: ...
    def __get__(self, instrument: ScpiInstrument | None, owner: type) -> Setting[T] | T:
        """Ask the instrument."""
        if instrument is None:
            return self
        question = f"{self.header}?"
        answer = instrument.transport.query(question)
        with instrument.resynchronised():
            return self._parse(instrument.transport.address, question, answer)

    def __set__(self, instrument: ScpiInstrument, value: T) -> None:
        """Check, send, and read the error queue."""
        self._check(instrument.transport.address, value)
        instrument.command(f"{self.header} {self._spell(value)}")
        instrument.set_to[self.full_name] = value

    def differs(self, asked: T, answered: T) -> bool:
        """Whether an answer is another value than the one that was set; instruments round by a hundredth at most."""
        if self.kind is float:
            return not abs(float(answered) - float(asked)) <= 0.01 * abs(float(asked)) + 5e-3
        return bool(str(asked).upper() != str(answered).upper())

    def _parse(self, address: str, question: str, answer: str) -> T:
        convert: Callable[[str], Any] = _FROM_WIRE[self.kind]
        try:
            return cast("T", convert(answer))
        except ValueError:
            raise BadAnswer(address, question, answer, "a number") from None

    def _check(self, address: str, value: T) -> None:
        if self.choices and str(value).upper() not in self.choices:
            raise OutOfRange(address, self.name, value, "one of " + ", ".join(self.choices))
        if self.kind is float and not self.low <= float(value) <= self.high:
            raise OutOfRange(address, self.name, value, f"{self.low:g} to {self.high:g} {self.unit}")

    def _spell(self, value: T) -> str:
        if self.kind is bool:
            return "ON" if value else "OFF"
        return repr(float(value)) if self.kind is float else str(value).upper()


def parse_reading(address: str, question: str, answer: str) -> float | None:
    """A measured number, or None where the instrument says that there was nothing to measure.

    Raises BadAnswer if it is no number at all.
    """
    try:
        number = float(answer)
    except ValueError:
        raise BadAnswer(address, question, answer, "a number") from None
    return None if not math.isfinite(number) or abs(number) >= INFINITY else number
