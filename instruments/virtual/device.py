"""What every virtual instrument is: bytes in, bytes out after the time that the real one would take."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Protocol

from instruments.virtual.scpi import (
    Command,
    Parser,
    ScpiError,
    at_most_one,
    boolean,
    choice,
    limit,
    none,
    nr3,
    number,
    one,
)

if TYPE_CHECKING:
    from collections.abc import Callable

Value = float | str | bool

#: A message longer than this without a line end is dropped, so that no input makes the instrument grow.
_INPUT_BUFFER = 1 << 20


class Clock(Protocol):
    """The one clock of the bench [s]."""

    def now(self) -> float:
        """Seconds since the bench was switched on."""

    def sleep(self, duration: float) -> None:
        """Let time pass."""


class VirtualInstrument:
    """A wire-level model: lines in, lines out, an error queue, and the time everything takes.

    A subclass gives its identity and extends `table()` and, where it reacts to settings, `changed()`.

    clock: of the bench; pace: time for one message [s].
    """

    identity = "levilab,virtual,0,0"

    def __init__(self, clock: Clock, *, pace: float = 2e-3) -> None:
        self.clock, self.pace = clock, pace
        self.settings: dict[str, Value] = {}
        self._defaults: dict[str, Value] = {}
        self._input = b""
        self._output: deque[tuple[float, bytes]] = deque()
        self._ready = 0.0
        self.parser = Parser()
        self.parser.commands = (*self._common(), *self.table())
        self.settings |= self._defaults

    # --- the wire ---

    def receive(self, data: bytes) -> None:
        """Bytes from the controller; every complete line is executed."""
        *lines, rest = (self._input + data).split(b"\n")
        if len(rest) > _INPUT_BUFFER:
            rest = b""
            self.parser.report(ScpiError(-363))
        self._input = rest
        for line in lines:
            self._execute(line.decode("latin-1").strip())

    def _execute(self, message: str) -> None:
        self._ready = max(self._ready, self.clock.now()) + self.pace
        answer = self.parser.run(message)
        if answer is not None:
            self._output.append((self._ready, answer.encode("latin-1") + b"\n"))

    def read(self, timeout: float) -> bytes | None:
        """The next answer, waited for at most this long [s]; None if there was none in time."""
        deadline = self.clock.now() + timeout
        if not self._output or self._output[0][0] > deadline:
            self.clock.sleep(timeout)
            return None
        ready, answer = self._output.popleft()
        self.clock.sleep(max(0.0, ready - self.clock.now()))
        return answer

    def clear(self) -> None:
        """Device clear: what is under way in either direction is dropped, settings stay."""
        self._input = b""
        self.abandon()

    def abandon(self) -> None:
        """What is under way is given up, and what has not been read yet is lost."""
        self._output.clear()
        self._ready = self.clock.now()

    def busy_until(self, instant: float) -> None:
        """The answer to the message under way is ready at this time [s] and not before."""
        self._ready = max(self._ready, instant)

    # --- the tables ---

    def table(self) -> tuple[Command, ...]:
        """The commands beyond the common ones."""
        return ()

    def changed(self, name: str) -> None:
        """Called after a setting has changed."""

    def reset(self) -> None:
        """The state after ``*RST``."""
        self.settings |= self._defaults
        for name in self._defaults:
            self.changed(name)

    def _common(self) -> tuple[Command, ...]:
        return (
            Command("*IDN", get=answers(lambda: self.identity)),
            Command("*RST", set=does(self.reset)),
            Command("*CLS", set=does(self.parser.errors.clear)),
            Command("*OPC", set=none, get=answers(lambda: "1")),
            Command("*WAI", set=none),
            Command("SYSTem:ERRor[:NEXT]", get=answers(self.parser.next_error)),
        )

    def numeric(self, pattern: str, name: str, *, low: float, high: float, default: float, unit: str = "") -> Command:
        """A row for a number that can be set and asked for, ``MIN``, ``MAX`` and ``DEF`` included."""
        self._defaults[name] = default

        def read(text: str) -> float:
            return number(text, low=low, high=high, default=default, unit=unit)

        def ask(parameters: list[str]) -> str:
            asked = at_most_one(parameters)
            return nr3(limit(asked, low=low, high=high, default=default) if asked else float(self.settings[name]))

        return Command(pattern, self._setter(name, read), ask)

    def word(self, pattern: str, name: str, words: tuple[str, ...], default: str) -> Command:
        """A row for one word of several; the answer is the short form."""
        self._defaults[name] = default
        set_ = self._setter(name, lambda text: choice(text, words))
        return Command(pattern, set_, answers(lambda: str(self.settings[name])))

    def switch(self, pattern: str, name: str, *, default: bool = False) -> Command:
        """A row for ON or OFF; the answer is 1 or 0."""
        self._defaults[name] = default
        return Command(pattern, self._setter(name, boolean), answers(lambda: str(int(self.settings[name]))))

    def _setter(self, name: str, read: Callable[[str], Value]) -> Callable[[list[str]], None]:
        def set_(parameters: list[str]) -> None:
            self.settings[name] = read(one(parameters))
            self.changed(name)

        return set_


def does(act: Callable[[], None]) -> Callable[[list[str]], None]:
    """What a command without parameters does, for a row of a table."""

    def set_(parameters: list[str]) -> None:
        none(parameters)
        act()

    return set_


def answers(tell: Callable[[], str]) -> Callable[[list[str]], str]:
    """What a query without parameters is answered with, for a row of a table."""

    def get(parameters: list[str]) -> str:
        none(parameters)
        return tell()

    return get
