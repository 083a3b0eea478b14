"""What every virtual instrument is: bytes in, bytes out after the time that the real one would take.

An answer may take long to be worked out, so an instrument works on a message in steps; see `steps`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, NamedTuple

from instruments.virtual.core.parameters import at_most_one, boolean, choice, limit, none, nr3, number, one, one_of
from instruments.virtual.core.parser import Command, Parser
from instruments.virtual.core.status import OPERATION_COMPLETE, Status
from instruments.virtual.core.steps import at_once

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from instruments.clock import Clock
    from instruments.virtual.core.rows import Row
    from instruments.virtual.core.steps import Steps, Work

Value = float | str | bool


class Answer(NamedTuple):
    """What an instrument says: the bytes, and when they are ready [s].

    epoch: of the measurement they come from; complete: whether its end is among them.
    """

    data: bytes
    ready: float
    epoch: int
    complete: bool = True


class VirtualInstrument:
    """A wire-level model: messages in, answers out, an error queue, and the time everything takes.

    A subclass gives its identity and extends `table()` and, where it reacts to settings, `changed()`.

    clock: of the bench; identity: the answer to ``*IDN?`` of another model of the family; pace: time for one
    message [s].
    """

    identity = "levilab,virtual,0,0"
    #: What ``SYST:ERR?`` answers when there is nothing to tell, how many entries it keeps, and what ends an answer.
    no_error, queue_size, line_end = '+0,"No error"', 20, "\n"
    #: Whether it knows blocks (IEEE 488.2, 7.7.6), and path memory (SCPI-1999, volume 1, 6.2.4).
    takes_blocks = path_memory = True
    #: Its commands beyond the common ones, and those of each channel.
    ROWS: ClassVar[tuple[Row, ...]] = ()
    CHANNEL_ROWS: ClassVar[tuple[Row, ...]] = ()
    #: The numbers of the channels that CHANNEL_ROWS are for.
    numbered: Sequence[int] = ()

    def __init__(self, clock: Clock, *, identity: str | None = None, pace: float = 2e-3) -> None:
        self.clock, self.pace = clock, pace
        self.identity = identity or self.identity
        self.settings: dict[str, Value] = {}
        self._defaults: dict[str, Value] = {}
        self.status = Status()
        self.epoch = 0
        self._ready = 0.0
        #: On the message that came last, if it is worked on in slices: it may not be done yet.
        self.work: Work[None] | None = None
        self.parser = Parser(
            queue_size=self.queue_size,
            no_error=self.no_error,
            noted=self.status.note_error,
            path_memory=self.path_memory,
        )
        self.parser.commands = (*self._common(), *self.table())
        self.settings |= self._defaults

    def execute(self, message: str) -> Answer | None:
        """Run one message, a line without its end; the answers of its queries, if it has any."""
        return at_once(self.steps(message))

    def steps(self, message: str) -> Steps[Answer | None]:
        """Do what execute() does, in steps."""
        self._begin_message()
        return self._answer((yield from self.parser.steps(message)))

    def cut_off_by(self, message: str) -> bool:
        """Whether this message ends the work on the one before it."""
        return False

    def catch_up(self) -> Steps[None]:
        """Work out what has happened in the instrument since the last message, where anything happens in between."""
        yield from ()

    def _begin_message(self) -> None:
        self._ready = max(self._ready, self.clock.now()) + self.pace

    def _answer(self, text: str | None) -> Answer | None:
        if text is None:
            return None
        return Answer((text + self.line_end).encode("latin-1"), self._ready, self.epoch)

    def abandon(self) -> None:
        """What is under way is given up, and what has not been read yet is lost."""
        if self.work:
            self.work.give_up()
        self.epoch += 1
        self._ready = self.clock.now()

    def busy_until(self, instant: float) -> None:
        """The answer to the message under way is ready at this time [s] and not before."""
        self._ready = max(self._ready, instant)

    def trigger(self) -> None:
        """``*TRG``, or the interface's own trigger message."""

    # --- the tables ---

    def table(self) -> tuple[Command, ...]:
        """The commands beyond the common ones."""
        of_channels = (row.of_channel(n).bind(self) for n in self.numbered for row in self.CHANNEL_ROWS)
        return (*of_channels, *(row.bind(self) for row in self.ROWS))

    def declare(self, name: str, header: str, default: Value) -> None:
        """There is this setting, with this value after ``*RST``."""
        self._defaults[name] = default

    def spell(self, value: float) -> str:
        """A number as this instrument prints it."""
        return nr3(value)

    def reply(self, header: str, text: str, unit: str = "") -> str:
        """What is answered to the question of a row: the text alone."""
        return text

    def adjusted(self, name: str, before: float) -> None:
        """A number has changed from what it was before."""
        self.changed(name)

    def changed(self, name: str) -> None:
        """Called after a setting has changed."""

    def reset(self) -> None:
        """The state after ``*RST``."""
        self.settings |= self._defaults
        for name in self._defaults:
            self.changed(name)

    def _common(self) -> tuple[Command, ...]:
        status = self.status
        return (
            Command("*IDN", get=answers(lambda: self.identity)),
            Command("*RST", set=does(self.reset)),
            Command("*CLS", set=does(self.clear_status)),
            Command("*OPC", set=does(self._note_completion), get=answers(lambda: "1")),
            Command("*WAI", set=none),
            Command("*TRG", set=does(self.trigger)),
            Command("*TST", get=answers(lambda: "+0")),
            Command("*ESR", get=answers(lambda: f"{status.take_events():+d}")),
            self._mask("*ESE", "event_enable"),
            self._mask("*SRE", "request_enable"),
            Command("*STB", get=answers(lambda: f"{self.status_byte():+d}")),
            Command("SYSTem:ERRor[:NEXT]", get=answers(self.parser.next_error)),
            Command("SYSTem:VERSion", get=answers(lambda: "1999.0")),
            *(Command(f"SYSTem:{word}", set=none) for word in ("BEEPer[:IMMediate]", "LOCal", "REMote", "RWLock")),
        )

    def status_byte(self, *, message_available: bool = False) -> int:
        """The status byte (IEEE 488.2, 11.2)."""
        return self.status.byte(errors_waiting=bool(self.parser.errors), message_available=message_available)

    def clear_status(self) -> None:
        """``*CLS``: no errors, no events."""
        self.parser.errors.clear()
        self.status.events = 0

    def _note_completion(self) -> None:
        self.status.events |= OPERATION_COMPLETE

    def _mask(self, pattern: str, name: str) -> Command:
        def set_(parameters: list[str]) -> None:
            setattr(self.status, name, int(number(one(parameters), low=0, high=255, default=0)))

        return Command(pattern, set_, answers(lambda: f"{getattr(self.status, name):+d}"))

    def numeric(
        self,
        pattern: str,
        name: str,
        *,
        low: float,
        high: float,
        default: float,
        unit: str = "",
        values: tuple[float, ...] = (),
    ) -> Command:
        """A row for a number that can be set and asked for, ``MIN``, ``MAX`` and ``DEF`` included.

        values: the only ones that there are.
        """
        self._defaults[name] = default

        def read(text: str) -> float:
            return one_of(number(text, low=low, high=high, default=default, unit=unit), values)

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


def does(act: Callable[[], Steps[None] | None]) -> Callable[[list[str]], Steps[None] | None]:
    """What a command without parameters does, for a row of a table."""

    def set_(parameters: list[str]) -> Steps[None] | None:
        none(parameters)
        return act()

    return set_


def answers(tell: Callable[[], Steps[str] | str]) -> Callable[[list[str]], Steps[str] | str]:
    """What a query without parameters is answered with, for a row of a table."""

    def get(parameters: list[str]) -> Steps[str] | str:
        none(parameters)
        return tell()

    return get
