"""What a virtual instrument understands, one row a command: a table that says what, not how.

A row is data, made once a module; `bind` makes a command of it for one device.  ``{n}`` in a header or a name is the
number of a channel, and what depends on the channel is given its number, too.

>>> Number("CHANnel{n}:SCALe", "chan{n}_scale", 1.0, (1e-3, 10.0), "V").of_channel(2).header
'CHANnel2:SCALe'
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol, Self

from instruments.virtual.core.parameters import at_most_one, boolean, choice, limit, none, number, one, one_of
from instruments.virtual.core.parser import Command, ScpiError

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.core.steps import Steps

Value = float | str | bool
_BOUNDS = {"MIN", "MAX", "DEF", "MINIMUM", "MAXIMUM", "DEFAULT"}
#: What would end a string or a message.
_NOT_IN_TEXTS = dict.fromkeys(map(ord, "\"';\n"))


class Device(Protocol):
    """What a row needs of the device that it is bound to."""

    settings: dict[str, Value]

    def declare(self, name: str, header: str, default: Value) -> None:
        """There is this setting, with this value after ``*RST``."""

    def adjusted(self, name: str, before: float) -> None:
        """Called after a setting has changed; before: what it was, 0 where that was no number."""

    def spell(self, value: float) -> str:
        """A number as the device prints it."""

    def reply(self, header: str, text: str, unit: str = "") -> str:
        """What is answered: the text alone, or with its header and unit."""


@dataclass(frozen=True)
class Row:
    """A header as the manual prints it."""

    header: str

    def of_channel(self, n: int) -> Self:
        """The same of one channel."""
        return replace(self, header=self.header.format(n=n))

    def bind(self, device: Any) -> Command:
        """The command of one device."""
        raise NotImplementedError


@dataclass(frozen=True)
class Setting(Row):
    """A row with a setting behind it."""

    name: str

    def of_channel(self, n: int) -> Self:
        """The same of one channel."""
        return replace(super().of_channel(n), name=self.name.format(n=n))


def _put(device: Device, name: str, value: Value) -> None:
    before = device.settings[name]
    device.settings[name] = value
    device.adjusted(name, before if isinstance(before, float) else 0.0)


@dataclass(frozen=True)
class Number(Setting):
    """A number that can be set and asked for, MIN, MAX and DEF included.

    default: after ``*RST``; limits: lowest and highest, or how they follow from the device (and the channel);
    unit: that may be sent with it; rounded: to what the instrument can do; spell: how it is printed, if not as all
    numbers; factor: the number on the wire is so many times the setting; clips: a number beyond a limit becomes the
    limit instead of an error; values: the only ones that there are; alias: another row has the setting, too, and gives
    its default.
    """

    default: float
    limits: tuple[float, float] | Callable[..., tuple[float, float]] = (0.0, 0.0)
    unit: str = ""
    rounded: Callable[[float], float] = float
    spell: Callable[[float], str] | None = None
    factor: float = 1.0
    clips: bool = False
    values: tuple[float, ...] = ()
    alias: bool = False

    def of_channel(self, n: int) -> Self:
        """The same of one channel."""
        row, find = super().of_channel(n), self.limits
        return replace(row, limits=lambda device: find(device, n)) if callable(find) else row

    def bind(self, device: Device) -> Command:
        """See the base."""
        default = self.default
        if not self.alias:
            device.declare(self.name, self.header, default)
        spell = self.spell or device.spell

        def limits() -> tuple[float, float]:
            return self.limits(device) if callable(self.limits) else self.limits

        def set_(parameters: list[str]) -> None:
            if len(parameters) > 2:  # a second one, as the source of a level, changes nothing here
                raise ScpiError(-108)
            low, high = limits()
            text = one(parameters[:1])
            if self.clips and text.upper() not in _BOUNDS:
                sent = number(text, low=-9e99, high=9e99, default=default, unit=self.unit)
                value = min(max(sent, low), high)
            else:
                value = one_of(
                    number(text, low=low, high=high, default=self.factor * default, unit=self.unit), self.values
                )
            _put(device, self.name, self.rounded(value / self.factor))

        def ask(parameters: list[str]) -> str:
            asked = at_most_one(parameters[:1])
            if asked.upper() in _BOUNDS:
                low, high = limits()
                value = limit(asked, low=low, high=high, default=self.factor * default)
            else:
                value = self.factor * float(device.settings[self.name])
            return device.reply(self.header, spell(value), self.unit)

        return Command(self.header, set_, ask)


def whole(header: str, name: str, default: float, limits: tuple[float, float], *, sign: str = "") -> Number:
    """A row for a whole number.  sign: "+" where the maker prints it."""
    return Number(header, name, default, limits, rounded=lambda v: float(round(v)), spell=lambda v: f"{v:{sign}.0f}")


@dataclass(frozen=True)
class Word(Setting):
    """One word of several, in its long form with the short form in capitals; the answer is the short form.

    words: with blanks between them, or how they follow from the device; the first, or the one behind an asterisk, is
    the default.
    """

    words: str | Callable[[Any], str] = ""

    def bind(self, device: Device) -> Command:
        """See the base."""
        words = (self.words(device) if callable(self.words) else self.words).split()
        plain = tuple(word.removeprefix("*") for word in words)
        default = next((word for word in words if word.startswith("*")), plain[0])
        device.declare(self.name, self.header, choice(default.removeprefix("*"), plain))
        return Command(
            self.header,
            lambda parameters: _put(device, self.name, choice(one(parameters), plain)),
            _asked(lambda: device.reply(self.header, str(device.settings[self.name]))),
        )


@dataclass(frozen=True)
class Switch(Setting):
    """ON or OFF.  default: or how it follows from the channel; words: what is answered for off and for on."""

    default: bool | Callable[[int], bool] = False
    words: tuple[str, str] = ("0", "1")

    def of_channel(self, n: int) -> Self:
        """The same of one channel."""
        row, find = super().of_channel(n), self.default
        return replace(row, default=find(n)) if callable(find) else row

    def bind(self, device: Device) -> Command:
        """See the base."""
        assert isinstance(self.default, bool), "of a channel"
        device.declare(self.name, self.header, self.default)
        return Command(
            self.header,
            lambda parameters: _put(device, self.name, boolean(one(parameters))),
            _asked(lambda: device.reply(self.header, self.words[bool(device.settings[self.name])])),
        )


@dataclass(frozen=True)
class Text(Setting):
    """A string in quotes, cut to its greatest length, in capitals."""

    default: str = ""
    longest: int = 10

    def of_channel(self, n: int) -> Self:
        """The same of one channel."""
        return replace(super().of_channel(n), default=self.default.format(n=n))

    def bind(self, device: Device) -> Command:
        """See the base."""
        device.declare(self.name, self.header, self.default)

        def set_(parameters: list[str]) -> None:
            given = one(parameters)
            if len(given) < 2 or given[0] not in "\"'" or given[-1] != given[0]:
                raise ScpiError(-104)
            _put(device, self.name, given[1:-1].translate(_NOT_IN_TEXTS)[: self.longest].upper())

        return Command(self.header, set_, _asked(lambda: f'"{device.settings[self.name]}"'))


@dataclass(frozen=True)
class Do(Row):
    """A command without parameters.  act: what the device does, nothing by default."""

    act: Callable[[Any], Steps[None] | None] = lambda _device: None

    def bind(self, device: Any) -> Command:
        """See the base."""

        def set_(parameters: list[str]) -> Steps[None] | None:
            none(parameters)
            return self.act(device)

        return Command(self.header, set_)


@dataclass(frozen=True)
class Ask(Row):
    """A question without parameters."""

    tell: Callable[..., Steps[str] | str] = lambda _device: "0"

    def of_channel(self, n: int) -> Self:
        """The same of one channel."""
        tell = self.tell
        return replace(super().of_channel(n), tell=lambda device: tell(device, n))

    def bind(self, device: Any) -> Command:
        """See the base."""
        return Command(self.header, get=_asked(lambda: self.tell(device)))


@dataclass(frozen=True)
class Both(Row):
    """What takes its parameters apart by itself.  act, tell: given the device and the parameters; None: there is none.

    keeps: the setting behind it, where it has one, with its default.
    """

    act: Callable[..., Steps[None] | None] | None = None
    tell: Callable[..., Steps[str] | str] | None = None
    keeps: tuple[str, Value] | None = None

    def of_channel(self, n: int) -> Self:
        """The same of one channel: act and tell are given its number behind the device."""
        act, tell = self.act, self.tell
        return replace(
            super().of_channel(n),
            act=act and (lambda device, parameters: act(device, n, parameters)),
            tell=tell and (lambda device, parameters: tell(device, n, parameters)),
        )

    def bind(self, device: Any) -> Command:
        """See the base."""
        act, tell = self.act, self.tell
        if self.keeps:
            name, default = self.keeps
            device.declare(name, self.header, default)
        return Command(
            self.header,
            set=act and (lambda parameters: act(device, parameters)),
            get=tell and (lambda parameters: tell(device, parameters)),
        )


def _asked(tell: Callable[[], Steps[str] | str]) -> Callable[[list[str]], Steps[str] | str]:
    def get(parameters: list[str]) -> Steps[str] | str:
        none(parameters)
        return tell()

    return get


def short_header(pattern: str) -> str:
    """A printed header in its shortest form.

    >>> short_header("TIMebase[:MAIN]:SCALe"), short_header("C1:(VDIV|VOLT_DIV)")
    ('TIM:SCAL', 'C1:VDIV')
    """
    bare = re.sub(r"\(([^|)]*)[^)]*\)", r"\1", re.sub(r"\[[^\]]*\]", "", pattern))
    return re.sub("[a-z]", "", bare)
