"""A quantity of an instrument, declared in one line: its header, its kind, its allowed values and answers."""

from __future__ import annotations

import contextlib
import math
import re
from dataclasses import dataclass
from typing import Any, Generic, NoReturn, Protocol, TypeVar, cast, overload

from instruments.errors import OutOfRange
from instruments.ieee488 import NOT_A_NUMBER, Form
from instruments.links.transport import Transport

T = TypeVar("T", bound=bool | float | str)
#: How instruments print a switch (SCPI-1999, vol. 1, 7.3).
_SWITCH = {"0": False, "1": True}
#: Instruments round a setting by this fraction of it at most.  Where their resolution is known, and the number of
#: digits in their answers is not, these digits are four at least.
_ROUNDING, _PRINTED = 0.01, 1e-4


class Owner(Protocol):
    """The instrument of a setting; see :class:`instruments.drivers.scpi.ScpiInstrument`."""

    transport: Transport
    last_set: dict[str, bool | float | str]

    @property
    def NUMBER(self) -> Form:  # noqa: N802 - a constant of the class
        """The form of its numbers."""

    def header_in_use(self, header: str) -> str:
        """Return the header as it is sent."""

    def field_of(self, answer: str, header: str, key: str) -> str:
        """Return the part of an answer that is one setting.  Raises ValueError."""

    def command(self, message: str) -> None:
        """Send a command.  Raises CommandRefused."""

    def confirm(self, setting: Setting[Any], value: bool | float | str) -> None:  # noqa: FBT001
        """Check a setting that was sent.  Raises OutOfRange, CommandRefused."""

    def reject(self, question: str, answer: str, expected: str) -> NoReturn:
        """Raise BadAnswer."""


@dataclass(eq=False)
class Setting(Generic[T]):
    """A quantity of an instrument to set and to query, declared in one line.

    It checks each answer: a number must have the instrument's form and lie in its range, a switch is 0 or 1, a word is
    one of the choices, in its short or long form.  For any other answer it raises BadAnswer and clears the link.

    Attributes:
        header: the SCPI header.
        kind: float, bool or str.
        unit: of the number on the wire.
        low: the lowest number that the instrument takes.
        high: the highest one.
        choices: the words that it takes, in their long form with the short form in capitals (SINusoid).
        answers: words that it may answer beside the choices.
        form: of its answer, where that is not the instrument's NUMBER, or of a text without choices.
        resolution: the step in which the instrument sets it [unit].
        digits: how many significant digits of a number it keeps and prints, where that is known.
        key: the name of the field where the header has several, ``C1:BSWV WVTP,SINE,FRQ,1000HZ,…``.
        suffix: the unit to send with a number.
        values: the only numbers that the instrument has.
        span: the lowest and the highest number that it may answer, where these are not low and high: with a probe, an
            attenuator or a load other than the driver's.
        on_demand: whether `settings` asks for it only once it was set, as for a mode that is mostly off.
        name: of the attribute; Python sets it.
    """

    header: str
    kind: type[T]
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    answers: tuple[str, ...] = ()
    form: Form | None = None
    resolution: float = 0.0
    digits: int = 0
    key: str = ""
    suffix: str = ""
    values: tuple[float, ...] = ()
    span: tuple[float, float] | None = None
    on_demand: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        if self.kind is str and not (self.choices or self.form):
            raise TypeError(f"{self.header}: a word needs choices, and a text a form, or no answer could be checked")

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        # for `help`: the header on the wire, range and unit
        self.__doc__ = f"{self.header}{f' {self.key}' if self.key else ''}, {self._describe_allowed()}."

    def _describe_allowed(self, span: tuple[float, float] | None = None) -> str:
        """Return the text that describes the allowed values."""
        unit = f" {self.unit}" if self.unit else ""
        if self.kind is bool:
            return "True or False"
        if self.values:
            return " or ".join(f"{value:g}" for value in self.values) + unit
        if self.kind is float:
            low, high = span or (self.low, self.high)
            return f"{low:g} to {high:g}{unit}"
        return "one of " + ", ".join(self.choices) if self.choices else f"a text, as {self.form and self.form.example}"

    def describe(self) -> dict[str, Any]:
        """Return what an adapter for another program needs to know of it, as JSON has it.

        Returns:
            name: of the attribute; column: the same with its unit, as in files; kind: number, switch, word or text;
            unit: empty for none; low, high: None for no limit; values: the only numbers; choices: the words, as they
            are read; resolution: None where it is not known; header: on the wire.
        """
        kind = "switch" if self.kind is bool else "number" if self.kind is float else "word" if self.choices else "text"
        return {
            "name": self.name,
            "column": self.name_with_unit,
            "kind": kind,
            "unit": self.unit,
            "low": self.low if math.isfinite(self.low) else None,
            "high": self.high if math.isfinite(self.high) else None,
            "values": list(self.values),
            "choices": [_short_form(choice, self.choices) for choice in self.choices],
            "resolution": self.resolution or None,
            "header": " ".join(filter(None, (self.header, self.key))),
        }

    @property
    def name_with_unit(self) -> str:
        """The name with its unit, as in files: gate_s."""
        return f"{self.name}_{self.unit.lower()}" if self.unit else self.name

    @overload
    def __get__(self, instrument: None, owner: type) -> Setting[T]: ...
    @overload
    def __get__(self, instrument: Owner, owner: type) -> T: ...
    def __get__(self, instrument: Owner | None, owner: type) -> Setting[T] | T:
        """Ask the instrument.  Raises BadAnswer."""
        if instrument is None:
            return self
        question = self.question(instrument)
        return self.read(instrument, question, instrument.transport.query(question))

    def question(self, instrument: Owner) -> str:
        """Return the question for it, as it is sent."""
        return f"{instrument.header_in_use(self.header)}?"

    def read(self, instrument: Owner, question: str, answer: str) -> T:
        """Return the value in the answer to its question.  Raises BadAnswer."""
        form = self.form or instrument.NUMBER
        try:
            return cast("T", self._parse(instrument.field_of(answer, self.header, self.key), form))
        except ValueError:
            instrument.reject(question, answer, self._describe_expected(form))

    def __set__(self, instrument: Owner, value: T) -> None:
        """Check, send, and read the error queue."""
        self._check(instrument.transport.address, value)
        key = f"{self.key}," if self.key else ""
        instrument.command(f"{instrument.header_in_use(self.header)} {key}{self._spell(value)}{self.suffix}")
        instrument.confirm(self, value)
        instrument.last_set[self.name_with_unit] = self._canonical(value)

    def differs(self, asked: T, answered: T, *, rounding: float = 0.0) -> bool:
        """Return whether an answer is another value than the one set, apart from rounding.

        Args:
            asked: the value set.
            answered: the value in the answer.
            rounding: of this instrument, in addition to that of the setting [unit].
        """
        if self.kind is float:
            aside = self._last_digit(abs(float(asked))) + self.resolution + rounding
            return not abs(float(answered) - float(asked)) <= aside
        return self._canonical(asked) != self._canonical(answered)

    def _last_digit(self, value: float) -> float:
        """Return one unit in the last digit of a number that the instrument keeps [unit]."""
        if self.digits and 0 < value < math.inf:
            return 10.0 ** (math.floor(math.log10(value)) + 1 - self.digits)
        return (_PRINTED if self.resolution else _ROUNDING) * value

    def _parse(self, answer: str, form: Form) -> bool | float | str:
        """Return the value of an answer.  Raises ValueError."""
        if self.kind is bool:
            if answer not in _SWITCH:
                raise ValueError(answer)
            return _SWITCH[answer]
        if self.kind is float:
            number = form.number(answer)
            if not self._may_be(number):
                raise ValueError(answer)
            return number
        if self.choices:
            return _short_form(_strip_quotes(answer), (*self.choices, *self.answers))
        if not form.matches(answer):
            raise ValueError(answer)
        return answer

    def _may_be(self, number: float) -> bool:
        """Return whether the instrument may have this number, apart from the rounding of its limits."""
        if self.values:
            return number in self.values
        low, high = self.span or (self.low, self.high)
        below, above = (self.resolution + self._last_digit(abs(limit)) for limit in (low, high))
        return low - below <= number <= high + above and abs(number) < NOT_A_NUMBER  # a load may be 9.9E37 ohm

    def _describe_expected(self, form: Form) -> str:
        """Return the text that describes the expected answer."""
        if self.kind is bool:
            return "0 or 1"
        if self.kind is float:
            return f"a number ({self._describe_allowed(self.span)}), as {form.example}"
        if self.choices:
            return "one of " + ", ".join((*self.choices, *self.answers))
        return f"a text, as {form.example}"

    def _canonical(self, value: T) -> T:
        """Return a word in its short form, everything else as it is."""
        if self.kind is not str or not self.choices:
            return value
        with contextlib.suppress(ValueError):
            return cast("T", _short_form(str(value), (*self.choices, *self.answers)))
        return value

    def _check(self, address: str, value: T) -> None:
        if self.choices:
            try:
                _short_form(str(value), self.choices)
            except ValueError:
                raise OutOfRange(address, self.name, value, self._describe_allowed()) from None
        if self.values and value not in self.values:
            raise OutOfRange(address, self.name, value, self._describe_allowed())
        if self.kind is float and not self.low <= float(value) <= self.high:
            raise OutOfRange(address, self.name, value, self._describe_allowed())
        if self.kind is str and not self.choices and self.form and not self.form.matches(str(value)):
            raise OutOfRange(address, self.name, value, self._describe_allowed())

    def _spell(self, value: T) -> str:
        if self.kind is bool:
            return "ON" if value else "OFF"
        return repr(float(value)) if self.kind is float else str(self._canonical(value)).upper()


def _short_form(word: str, choices: tuple[str, ...]) -> str:
    """Return the short form of a choice, in any case.  Raises ValueError for an unknown word.

    >>> _short_form("sinusoid", ("SINusoid", "SQUare")), _short_form("SQU", ("SINusoid", "SQUare"))
    ('SIN', 'SQU')
    """
    for choice in choices:
        short = re.sub("[a-z]", "", choice)
        if word.upper() in {short, choice.upper()}:
            return short
    raise ValueError(word)


def _strip_quotes(answer: str) -> str:
    """Return a word without the quotes that some instruments put around it."""
    quoted = re.fullmatch(r'"([^"]*)"', answer)
    return quoted[1] if quoted else answer
