"""The commands of a virtual instrument as data, one row each: a table that says what, not how.

A row is made once, with its module, and belongs to no device: its methods take the device that they act on.  ``{n}``
in a header or a name is the number of a channel (and ``[n]`` in a header one that may be left out for the first); a
function that depends on the channel takes its number as well.

>>> Number("CHANnel{n}:SCALe", "chan{n}_scale", 1.0, (1e-3, 10.0), "V").of_channel(2).header
'CHANnel2:SCALe'
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any, Self

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
from instruments.virtual.core.parser import Action, ScpiError, Value
from instruments.virtual.core.steps import Steps

_BOUNDS = {"MIN", "MAX", "DEF", "MINIMUM", "MAXIMUM", "DEFAULT"}
#: A word of a printed header, what of it the short form leaves out, and the beginning of a word on the wire.
_MNEMONIC, _LOWER, _BEGINNING = re.compile(r"[A-Za-z*_]+"), re.compile("[a-z]+"), re.compile("[^0-9]{0,2}")
#: The characters that would end a string or a message.
_NOT_IN_TEXTS = dict.fromkeys(map(ord, "\"';\n"))


@dataclass(frozen=True)
class Row:
    """One command of an instrument, with its query: by default those of a setting, which has one parameter.

    Attributes:
        header: as the manual prints it, ``[SOURce[1]:]FREQuency[:CW|:FIXed]``.
        of: the number of the channel, for a row of a channel; functions take it behind the device.
        name: of the setting, where the row is one; its ``default`` is the value after ``*RST``.
    """

    header: str
    name: str = field(default_factory=str, kw_only=True)  # no default that a class below would inherit
    of: tuple[int, ...] = field(default=(), kw_only=True)

    def has(self, *, query: bool) -> bool:
        """Return whether there is a query, or else a command."""
        return True

    def set(self, device: Any, parameters: list[str]) -> Steps[Any] | str | None:
        """Execute the command, and return the answer where it has one.  Raises ScpiError."""
        self.put(device, self.read(device, parameter(parameters)))
        return None

    def ask(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """Answer the query.  Raises ScpiError."""
        no_parameters(parameters)
        text: str = device.reply(self.header, self.format_value(device, device.settings[self.name]))
        return text

    def put(self, device: Any, value: Value) -> None:
        """Change the setting."""
        before = device.settings[self.name]
        device.settings[self.name] = value
        device.on_number_change(self.name, before if isinstance(before, float) else 0.0)

    def read(self, device: Any, text: str) -> Value:
        """Return the value that a program has sent.  Raises ScpiError."""
        raise NotImplementedError

    def format_value(self, device: Any, value: Any) -> str:
        """Return the value as the answer has it, without header and unit."""
        return str(value)

    def defaults(self) -> dict[str, Value]:
        """Return the settings behind this row, with their values after ``*RST``."""
        return {}

    def of_channel(self, n: int) -> Self:
        """Return the row of one channel: ``{n}`` in its texts is the channel's number.

        ``[n]`` is the number, too, which may be left out for channel 1, with all that stands in the brackets around it.

        >>> Row("[SOURce[n]:]SUM").of_channel(1).header, Row("[SOURce[n]:]SUM").of_channel(2).header
        ('[SOURce[1]:]SUM', 'SOURce2:SUM')
        """
        texts = {field.name: getattr(self, field.name) for field in fields(self)}
        of_channel = {name: _of_channel(text, n) for name, text in texts.items() if isinstance(text, str)}
        return replace(self, of=(n,), **of_channel)


def _of_channel(text: str, n: int) -> str:
    text = text.replace("{n}", str(n))
    if n > 1:
        text = re.sub(r"\[(\w+)\[n\](:?)\]", rf"\g<1>{n}\2", text)
    return text.replace("[n]", "[1]" if n == 1 else str(n))


@dataclass(frozen=True)
class Number(Row):
    """A number to set and to query, with MIN, MAX and DEF.

    Attributes:
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

    def range(self, device: Any) -> tuple[float, float]:
        """Return the lowest and the highest number allowed now."""
        return self.limits(device, *self.of) if callable(self.limits) else self.limits

    def set(self, device: Any, parameters: list[str]) -> None:
        """See the base."""
        if device.lenient:
            if len(parameters) > 2:
                raise ScpiError(-108)
            parameters = parameters[:1]
        self.put(device, self.rounded(self.read(device, parameter(parameters)) / self.factor))

    def read(self, device: Any, text: str) -> float:
        """Read the number that a program has sent, within its limits.  Raises ScpiError."""
        low, high = self.range(device)
        default = self.factor * self.default
        if self.clips and text.upper() not in _BOUNDS:
            sent = number(text, low=-9e99, high=9e99, default=default, unit=self.unit)
            return min(max(sent, low), high)
        return one_of(number(text, low=low, high=high, default=default, unit=self.unit), self.values)

    def ask(self, device: Any, parameters: list[str]) -> str:
        """See the base."""
        asked = optional_parameter(parameters[:1] if device.lenient else parameters)
        if asked.upper() in _BOUNDS or (asked and not device.lenient):
            low, high = self.range(device)
            value = limit(asked, low=low, high=high, default=self.factor * self.default)
        else:
            value = self.value(device)
        text: str = device.reply(self.header, self.format_value(device, value), self.unit)
        return text

    def value(self, device: Any) -> float:
        """Return the number that the query asks for."""
        return self.factor * float(device.settings[self.name])

    def format_value(self, device: Any, value: float) -> str:
        """See the base."""
        return (self.spell or device.spell)(value)


def whole(header: str, name: str, default: float, limits: tuple[float, float], *, sign: str = "") -> Number:
    """Return a row for a whole number.  sign: "+" where the maker prints it."""
    return Number(header, name, default, limits, rounded=lambda v: float(round(v)), spell=lambda v: f"{v:{sign}.0f}")


@dataclass(frozen=True)
class Word(Row):
    """One word of several, in its long form with the short form in capitals; the answer is the short form.

    Attributes:
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

    def read(self, device: Any, text: str) -> str:
        """See the base."""
        return choice(text, _split(self.words(device) if callable(self.words) else self.words))


@cache
def _split(words: str) -> tuple[str, ...]:
    """Return the words without the asterisk of the default."""
    return tuple(word.removeprefix("*") for word in words.split())


@dataclass(frozen=True)
class Switch(Row):
    """ON or OFF.

    Attributes:
        default: its value after ``*RST``, or a function of the channel that returns it.
        words: the answers for off and for on.
    """

    name: str
    default: bool | Callable[[int], bool] = False
    words: tuple[str, str] = ("0", "1")

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        return {self.name: self.default(*self.of) if callable(self.default) else self.default}

    def read(self, device: Any, text: str) -> bool:
        """See the base."""
        on: bool = device.read_boolean(text)
        return on

    def format_value(self, device: Any, value: bool) -> str:  # noqa: FBT001
        """See the base."""
        return self.words[bool(value)]


@dataclass(frozen=True)
class Text(Row):
    """A string in quotes, cut to its greatest length, in capitals."""

    name: str
    default: str = ""
    longest: int = 10

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        return {self.name: self.default}

    def read(self, device: Any, text: str) -> str:
        """See the base."""
        return read_quoted([text]).translate(_NOT_IN_TEXTS)[: self.longest].upper()

    def format_value(self, device: Any, value: str) -> str:
        """See the base."""
        return f'"{value}"'


@dataclass(frozen=True)
class Do(Row):
    """A command without parameters.  act: does it, given the device; by default it does nothing."""

    act: Callable[..., Steps[None] | None] = field(default=lambda *_: None, repr=False)

    def has(self, *, query: bool) -> bool:
        """See the base."""
        return not query

    def set(self, device: Any, parameters: list[str]) -> Steps[None] | None:
        """See the base."""
        no_parameters(parameters)
        return self.act(device, *self.of)


@dataclass(frozen=True)
class Ask(Row):
    """A query without parameters.  answer: the text of the answer, given the device."""

    answer: Callable[..., Steps[str] | str] = field(default=lambda *_: "0", repr=False)

    def has(self, *, query: bool) -> bool:
        """See the base."""
        return query

    def ask(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """See the base."""
        no_parameters(parameters)
        return self.answer(device, *self.of)


@dataclass(frozen=True)
class Both(Row):
    """A command, a query or both, whose functions read the parameters themselves.

    Attributes:
        act: the command, given the device and the parameters, which may be answered, too; None: there is no command.
        answer: the same for the query.
        keeps: the setting behind it, where it has one, with its default.
    """

    act: Callable[..., Steps[Any] | str | None] | None = field(default=None, repr=False)
    answer: Callable[..., Steps[str] | str] | None = field(default=None, repr=False)
    keeps: tuple[str, Value] | None = None

    def has(self, *, query: bool) -> bool:
        """See the base."""
        return (self.answer if query else self.act) is not None

    def defaults(self) -> dict[str, Value]:
        """See the base."""
        return {self.keeps[0].format(n=self.of[0] if self.of else 0): self.keeps[1]} if self.keeps else {}

    def set(self, device: Any, parameters: list[str]) -> Steps[Any] | str | None:
        """See the base."""
        assert self.act
        return self.act(device, *self.of, parameters)

    def ask(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """See the base."""
        assert self.answer
        return self.answer(device, *self.of, parameters)


@dataclass(frozen=True)
class Own(Both):
    """As Both, but the query has no parameters: answer takes the device alone."""

    def ask(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """See the base."""
        assert self.answer
        no_parameters(parameters)
        return self.answer(device, *self.of)


class Table:
    """The rows of a model, and its settings.  Where several rows fit a header, the first one counts.

    Args:
        rows: of the model.
        others: settings that no row has.

    Attributes:
        defaults: all settings, with their values after ``*RST``.
    """

    def __init__(self, rows: Iterable[Row], others: Mapping[str, Value]) -> None:
        self.rows = tuple(rows)
        self.defaults = {**others, **{name: value for row in self.rows for name, value in row.defaults().items()}}
        self._actions: dict[str, Action] = {}

    def find(self, header: str) -> Action:
        """Return the function of a header; that of a query ends with a question mark.  Raises ScpiError."""
        name = header.upper()
        action = self._actions.get(name)
        if action is None:  # only known headers are kept: there could be any number of unknown ones
            action = self._actions[name] = self._search(header)
        return action

    def _search(self, header: str) -> Action:
        plain = header.removesuffix("?").upper()
        beginnings = {_BEGINNING.match(word)[0] for word in plain.split(":") if word}  # type: ignore[index]
        # few rows are left, so few regular expressions are compiled
        near = [row for row in self.rows if beginnings <= _beginnings(row.header)]
        rows = [row for row in near if header_pattern(row.header).fullmatch(plain)]
        if not rows:
            raise ScpiError(-113, plain[:40])
        for row in rows:
            if row.has(query=header.endswith("?")):
                return row.ask if header.endswith("?") else row.set
        raise ScpiError(-113, header)


@cache
def _beginnings(pattern: str) -> frozenset[str]:
    """Return the first two letters of each word of a printed header, in its long and its short form.

    >>> sorted(_beginnings("[SOURce[1]:]FREQuency[:CW|:FIXed]")), sorted(_beginnings("C1:BaSic_WaVe"))
    (['CW', 'FI', 'FR', 'SO'], ['BA', 'BS', 'C'])
    """
    words = _MNEMONIC.findall(pattern)
    return frozenset({word[:2].upper() for word in words} | {_LOWER.sub("", word)[:2] for word in words})


@cache
def header_pattern(pattern: str) -> re.Pattern[str]:
    """Return a printed header as a regular expression for a header without its question mark."""
    return re.compile(_expression(pattern), re.IGNORECASE)


def _expression(pattern: str) -> str:
    """Return a printed header as a regular expression: FREQuency → (?:FREQUENCY|FREQ), [x] → (?:x)?.

    >>> _expression("[SOURce[1]:]FREQuency")
    '(?:(?:SOURCE|SOUR)(?:1)?:)?(?:FREQUENCY|FREQ)'
    """

    def mnemonic(match: re.Match[str]) -> str:
        long = match[0].upper()
        short = re.sub("[a-z]", "", match[0])
        return long if long == short else f"(?:{long}|{short})"

    words = re.sub(r"[A-Z]+[a-z]*", mnemonic, pattern.replace("*", r"\*").replace("[", "\0"))
    return words.replace("\0", "(?:").replace("]", ")?")


def short_header(pattern: str) -> str:
    """Return a printed header in its shortest form.

    >>> short_header("TIMebase[:MAIN]:SCALe"), short_header("C1:(VDIV|VOLT_DIV)")
    ('TIM:SCAL', 'C1:VDIV')
    """
    bare = re.sub(r"\(([^|)]*)[^)]*\)", r"\1", re.sub(r"\[[^\]]*\]", "", pattern))
    return re.sub("[a-z]", "", bare)
