"""The commands of a virtual instrument as data, one row each: a table that says what, not how.

A row is made once, with its module, and belongs to no device: its methods take the device that they act on.  ``{n}``
in a header or a name is the number of a channel (and ``[n]`` in a header one that may be left out for the first); a
function that depends on the channel takes its number as well.

>>> Number("CHANnel{n}:SCALe", "chan{n}_scale", 1.0, (1e-3, 10.0), "V").of_channel(2).header
'CHANnel2:SCALe'
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol, Self

from instruments.virtual.core.parameters import (
    choice,
    limit,
    no_parameters,
    number,
    one_of,
    optional_parameter,
    parameter,
    read_quoted,
)
from instruments.virtual.core.parser import Row, ScpiError, Value

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.core.steps import Steps

_BOUNDS = {"MIN", "MAX", "DEF", "MINIMUM", "MAXIMUM", "DEFAULT"}
#: The characters that would end a string or a message.
_NOT_IN_TEXTS = dict.fromkeys(map(ord, "\"';\n"))


class Device(Protocol):
    """What a row needs of a device."""

    settings: dict[str, Value]
    lenient: bool

    def on_number_change(self, name: str, before: float) -> None:
        """React to a setting that has changed.  before: its former value, 0 where that was no number."""

    def read_boolean(self, text: str) -> bool:
        """Return the value of a switch, from its text on the wire."""

    def spell(self, value: float) -> str:
        """Return a number as the device prints it."""

    def reply(self, header: str, text: str, unit: str = "") -> str:
        """Return an answer: the text alone, or with its header and unit."""


def _put(device: Device, name: str, value: Value) -> None:
    before = device.settings[name]
    device.settings[name] = value
    device.on_number_change(name, before if isinstance(before, float) else 0.0)


@dataclass(frozen=True)
class Number(Row):
    """A number to set and to query, with MIN, MAX and DEF.

    Attributes:
        name: of the setting.
        default: its value after ``*RST``.
        limits: lowest and highest number, or a function of the device (and the channel) that returns them.
        unit: that a program may send with the number.
        rounded: rounds it to what the instrument can do.
        spell: prints it, where this number has a form of its own.
        factor: the number on the wire over the setting.
        clips: whether a number beyond a limit becomes the limit instead of an error.
        values: the only ones allowed, where the limits do not suffice.
        alias: whether another row has the same setting, and gives its default.
    """

    name: str
    default: float
    limits: tuple[float, float] | Callable[..., tuple[float, float]]
    unit: str = ""
    rounded: Callable[[float], float] = field(default=float, repr=False)
    spell: Callable[[float], str] | None = field(default=None, repr=False)
    factor: float = 1.0
    clips: bool = False
    values: tuple[float, ...] = ()
    alias: bool = False

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        return {} if self.alias else {self.name: self.default}

    def of_channel(self, n: int) -> Self:
        """See the base."""
        row, find = super().of_channel(n), self.limits
        return replace(row, limits=lambda device: find(device, n)) if callable(find) else row

    def range(self, device: Device) -> tuple[float, float]:
        """Return the lowest and the highest number allowed now."""
        return self.limits(device) if callable(self.limits) else self.limits

    def set(self, device: Device, parameters: list[str]) -> None:
        """See the base."""
        if device.lenient:
            if len(parameters) > 2:
                raise ScpiError(-108)
            parameters = parameters[:1]
        _put(device, self.name, self.rounded(self.read(device, parameter(parameters)) / self.factor))

    def read(self, device: Device, text: str) -> float:
        """Read the number that a program has sent, within its limits.  Raises ScpiError."""
        low, high = self.range(device)
        default = self.factor * self.default
        if self.clips and text.upper() not in _BOUNDS:
            sent = number(text, low=-9e99, high=9e99, default=default, unit=self.unit)
            return min(max(sent, low), high)
        return one_of(number(text, low=low, high=high, default=default, unit=self.unit), self.values)

    def ask(self, device: Device, parameters: list[str]) -> str:
        """See the base."""
        asked = optional_parameter(parameters[:1] if device.lenient else parameters)
        if asked.upper() in _BOUNDS or (asked and not device.lenient):
            low, high = self.range(device)
            value = limit(asked, low=low, high=high, default=self.factor * self.default)
        else:
            value = self.factor * float(device.settings[self.name])
        return device.reply(self.header, self.format_value(device, value), self.unit)

    def format_value(self, device: Device, value: float) -> str:
        """Return the number as the answer has it, without header and unit."""
        return (self.spell or device.spell)(value)


def whole(header: str, name: str, default: float, limits: tuple[float, float], *, sign: str = "") -> Number:
    """Return a row for a whole number.  sign: "+" where the maker prints it."""
    return Number(header, name, default, limits, rounded=lambda v: float(round(v)), spell=lambda v: f"{v:{sign}.0f}")


@dataclass(frozen=True)
class Word(Row):
    """One word of several, in its long form with the short form in capitals; the answer is the short form.

    Attributes:
        name: of the setting.
        words: separated by blanks, or a function of the device that returns them.
        default: in its short form, where it is neither the word behind an asterisk nor the first.
    """

    name: str
    words: str | Callable[[Any], str]
    default: str = ""

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        if self.default:
            return {self.name: self.default}
        assert isinstance(self.words, str), "words that follow from the device need a default"
        first = next((word for word in self.words.split() if word.startswith("*")), self.words.split()[0])
        return {self.name: choice(first.removeprefix("*"), _split(self.words))}

    def set(self, device: Device, parameters: list[str]) -> None:
        """See the base."""
        words = self.words(device) if callable(self.words) else self.words
        _put(device, self.name, choice(parameter(parameters), _split(words)))

    def ask(self, device: Device, parameters: list[str]) -> str:
        """See the base."""
        no_parameters(parameters)
        return device.reply(self.header, str(device.settings[self.name]))


@cache
def _split(words: str) -> tuple[str, ...]:
    """Return the words without the asterisk of the default."""
    return tuple(word.removeprefix("*") for word in words.split())


@dataclass(frozen=True)
class Switch(Row):
    """ON or OFF.

    Attributes:
        name: of the setting.
        default: its value after ``*RST``, or a function of the channel that returns it.
        words: the answers for off and for on.
    """

    name: str
    default: bool | Callable[[int], bool] = False
    words: tuple[str, str] = ("0", "1")

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        assert isinstance(self.default, bool), "of a channel"
        return {self.name: self.default}

    def of_channel(self, n: int) -> Self:
        """See the base."""
        row, find = super().of_channel(n), self.default
        return replace(row, default=find(n)) if callable(find) else row

    def set(self, device: Device, parameters: list[str]) -> None:
        """See the base."""
        _put(device, self.name, device.read_boolean(parameter(parameters)))

    def ask(self, device: Device, parameters: list[str]) -> str:
        """See the base."""
        no_parameters(parameters)
        return device.reply(self.header, self.words[bool(device.settings[self.name])])


@dataclass(frozen=True)
class Text(Row):
    """A string in quotes, cut to its greatest length, in capitals."""

    name: str
    default: str = ""
    longest: int = 10

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        return {self.name: self.default}

    def set(self, device: Device, parameters: list[str]) -> None:
        """See the base."""
        _put(device, self.name, read_quoted(parameters).translate(_NOT_IN_TEXTS)[: self.longest].upper())

    def ask(self, device: Device, parameters: list[str]) -> str:
        """See the base."""
        no_parameters(parameters)
        return f'"{device.settings[self.name]}"'


@dataclass(frozen=True)
class Do(Row):
    """A command without parameters.  act: does it, given the device; by default it does nothing."""

    act: Callable[..., Steps[None] | None] = field(default=lambda _device: None, repr=False)

    @property
    def askable(self) -> bool:
        """See the base."""
        return False

    def of_channel(self, n: int) -> Self:
        """See the base: act takes the channel's number behind the device."""
        act = self.act
        return replace(super().of_channel(n), act=lambda device: act(device, n))

    def set(self, device: Any, parameters: list[str]) -> Steps[None] | None:
        """See the base."""
        no_parameters(parameters)
        return self.act(device)


@dataclass(frozen=True)
class Ask(Row):
    """A query without parameters.  answer: the text of the answer, given the device."""

    answer: Callable[..., Steps[str] | str] = field(default=lambda _device: "0", repr=False)

    @property
    def settable(self) -> bool:
        """See the base."""
        return False

    def of_channel(self, n: int) -> Self:
        """See the base: answer takes the channel's number behind the device."""
        answer = self.answer
        return replace(super().of_channel(n), answer=lambda device: answer(device, n))

    def ask(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """See the base."""
        no_parameters(parameters)
        return self.answer(device)


@dataclass(frozen=True)
class Tell(Ask):
    """A command that is answered, without parameters; its query is the same."""

    @property
    def settable(self) -> bool:
        """See the base."""
        return True

    def set(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """See the base."""
        return self.ask(device, parameters)


@dataclass(frozen=True)
class Both(Row):
    """A command, a query or both, whose functions read the parameters themselves.

    Attributes:
        act: the command, given the device and the parameters; None: there is no command.
        answer: the same for the query.
        keeps: the setting behind it, where it has one, with its default.
    """

    act: Callable[..., Steps[None] | None] | None = field(default=None, repr=False)
    answer: Callable[..., Steps[str] | str] | None = field(default=None, repr=False)
    keeps: tuple[str, Value] | None = None

    @property
    def settable(self) -> bool:
        """See the base."""
        return self.act is not None

    @property
    def askable(self) -> bool:
        """See the base."""
        return self.answer is not None

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        return dict((self.keeps,)) if self.keeps else {}

    def of_channel(self, n: int) -> Self:
        """See the base: act and answer take the channel's number behind the device."""
        act, answer, keeps = self.act, self.answer, self.keeps
        return replace(
            super().of_channel(n),
            act=act and (lambda device, parameters: act(device, n, parameters)),
            answer=answer and (lambda device, parameters: answer(device, n, parameters)),
            keeps=keeps and (keeps[0].format(n=n), keeps[1]),
        )

    def set(self, device: Any, parameters: list[str]) -> Steps[None] | None:
        """See the base."""
        assert self.act
        return self.act(device, parameters)

    def ask(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """See the base."""
        assert self.answer
        return self.answer(device, parameters)


@dataclass(frozen=True)
class Own(Both):
    """As Both, but the query has no parameters: answer takes the device alone."""

    def of_channel(self, n: int) -> Self:
        """See the base."""
        row, answer = super().of_channel(n), self.answer
        return replace(row, answer=answer and (lambda device: answer(device, n)))

    def ask(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """See the base."""
        assert self.answer
        no_parameters(parameters)
        return self.answer(device)


def short_header(pattern: str) -> str:
    """Return a printed header in its shortest form.

    >>> short_header("TIMebase[:MAIN]:SCALe"), short_header("C1:(VDIV|VOLT_DIV)")
    ('TIM:SCAL', 'C1:VDIV')
    """
    bare = re.sub(r"\(([^|)]*)[^)]*\)", r"\1", re.sub(r"\[[^\]]*\]", "", pattern))
    return re.sub("[a-z]", "", bare)
