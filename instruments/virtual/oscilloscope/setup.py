"""The settings of a virtual oscilloscope: rows of its table, and the setup as a whole, kept and restored."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from instruments.virtual.core.device import Value, VirtualInstrument, answers
from instruments.virtual.core.parameters import at_most_one, limit, number, one
from instruments.virtual.core.parser import Command, ScpiError

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.core.device import Clock

#: What would end a string or a message.
_NOT_IN_LABELS = dict.fromkeys(map(ord, "\"';\n"))


class ScopeSetup(VirtualInstrument):
    """What can be set at an oscilloscope; each row that is part of the setup is remembered with its header."""

    def __init__(self, clock: Clock) -> None:
        self._headers: dict[str, str] = {}
        self._restoring = False
        super().__init__(clock)

    def spell(self, value: float) -> str:
        """A number as this maker prints it."""
        raise NotImplementedError

    def quantity(
        self,
        pattern: str,
        name: str,
        default: float,
        *,
        unit: str = "",
        limits: Callable[[], tuple[float, float]],
        rounded: Callable[[float], float] = lambda value: value,
        spell: Callable[[float], str] | None = None,
    ) -> Command:
        """A row for a number whose limits depend on other settings.  rounded: to what the instrument can do."""
        self._defaults[name] = default
        self._remember(pattern, name)

        def set_(parameters: list[str]) -> None:
            if len(parameters) > 2:  # a second one, as the source of a level, changes nothing here
                raise ScpiError(-108)
            low, high = limits()
            value = number(one(parameters[:1]), low=low, high=high, default=default, unit=unit)
            before, self.settings[name] = self.settings[name], rounded(value)
            self.adjusted(name, float(before))

        def ask(parameters: list[str]) -> str:
            asked = at_most_one(parameters[:1])
            low, high = limits()
            bound = asked.upper() in {"MIN", "MAX", "DEF", "MINIMUM", "MAXIMUM", "DEFAULT"}
            value = limit(asked, low=low, high=high, default=default) if bound else float(self.settings[name])
            return (spell or self.spell)(value)

        return Command(pattern, set_, ask)

    def whole(self, pattern: str, name: str, default: float, *, low: float, high: float, sign: str = "") -> Command:
        """A row for a whole number.  sign: "+" where the maker prints it."""
        return self.quantity(
            pattern,
            name,
            default,
            limits=lambda: (low, high),
            rounded=lambda value: float(round(value)),
            spell=lambda value: f"{value:{sign}.0f}",
        )

    def percent(self, pattern: str, name: str) -> Command:
        """A row for a percentage, 50 % at first."""
        return self.whole(pattern, name, 50.0, low=0, high=100)

    def full_range(
        self, pattern: str, name: str, *, divisions: int, limits: Callable[[], tuple[float, float, float]], unit: str
    ) -> Command:
        """A row for a scale times all its divisions.  limits: lowest, highest, default."""

        def set_(parameters: list[str]) -> None:
            low, high, default = limits()
            self.settings[name] = number(one(parameters), low=low, high=high, default=default, unit=unit) / divisions
            self.changed(name)

        return Command(pattern, set_, answers(lambda: self.spell(divisions * self.value(name))))

    def word(self, pattern: str, name: str, words: tuple[str, ...], default: str) -> Command:
        """A row for one word of several, as everywhere; it is part of the setup."""
        self._remember(pattern, name)
        return super().word(pattern, name, words, default)

    def switch(self, pattern: str, name: str, *, default: bool = False) -> Command:
        """A row for ON or OFF, as everywhere; it is part of the setup."""
        self._remember(pattern, name)
        return super().switch(pattern, name, default=default)

    def text(self, pattern: str, name: str, default: str, *, longest: int) -> Command:
        """A row for a string in quotes, cut to its greatest length, in capitals."""
        self._defaults[name] = default
        self._remember(pattern, name)

        def set_(parameters: list[str]) -> None:
            given = one(parameters)
            if len(given) < 2 or given[0] not in "\"'" or given[-1] != given[0]:
                raise ScpiError(-104)
            self.settings[name] = given[1:-1].translate(_NOT_IN_LABELS)[:longest].upper()

        return Command(pattern, set_, answers(lambda: f'"{self.settings[name]}"'))

    def _remember(self, pattern: str, name: str) -> None:
        short = re.sub(r"\[[^\]]*\]", "", pattern)
        self._headers[name] = ":" + re.sub("[a-z]", "", short)

    def value(self, name: str) -> float:
        """A setting that is a number."""
        return float(self.settings[name])

    def adjusted(self, name: str, before: float) -> None:
        """A number has changed from what it was before."""
        raise NotImplementedError

    # --- the setup as a whole ---

    def setup(self) -> bytes:
        """All settings, as messages that restore them."""
        return "\n".join(f"{header} {self._spelled(name)}" for name, header in self._headers.items()).encode("latin-1")

    def _spelled(self, name: str) -> str:
        value: Value = self.settings[name]
        if isinstance(value, bool):
            return str(int(value))
        if isinstance(value, float):
            return f"{value:.15G}"
        return f'"{value}"' if name.endswith("_label") else value

    def restore(self, setup: str) -> None:
        """Settings from messages; a setup that is none leaves what it had already set.  Raises ScpiError."""
        if self._restoring:
            raise ScpiError(-224)
        known = set(self._headers.values())
        self._restoring = True
        try:
            for line in setup.split("\n"):
                header = line.partition(" ")[0]
                if header not in known:
                    raise ScpiError(-224)
                self.parser.run(line.partition(";")[0])
        finally:
            self._restoring = False

    def presets(self) -> tuple[Command, ...]:
        """Setups as blocks and in ten places."""
        kept: dict[int, str] = {}

        def place(parameters: list[str]) -> int:
            return int(number(one(parameters), low=0, high=9, default=0))

        def keep(parameters: list[str]) -> None:
            kept[place(parameters)] = self.setup().decode("latin-1")

        def recall(parameters: list[str]) -> None:
            where = place(parameters)
            if where in kept:
                self.restore(kept[where])

        return (Command("*SAV", set=keep), Command("*RCL", set=recall))


def block_content(text: str) -> str:
    """The content of a definite-length block that was sent as a parameter.  Raises ScpiError."""
    if len(text) < 2 or text[0] != "#" or not "1" <= text[1] <= "9":
        raise ScpiError(-104)
    begin = 2 + int(text[1])
    digits = text[2:begin]
    if not digits.isascii() or not digits.isdigit() or len(text) - begin != int(digits):
        raise ScpiError(-104)
    return text[begin:]


def one_two_five(value: float, *, up: bool = False) -> float:
    """The number of the series 1, 2, 5, 10 … nearest to a positive one, or the next that is not less.

    >>> one_two_five(3e-3), one_two_five(4e-3), one_two_five(2.1, up=True), one_two_five(0.2, up=True)
    (0.002, 0.005, 5.0, 0.2)
    """
    decade = math.floor(math.log10(value))
    series = [float(f"{m}e{decade}") for m in (1, 2, 5, 10, 20)]
    if up:
        return next(s for s in series if s >= value * (1 - 1e-9))
    return min(series, key=lambda s: abs(s - value))
