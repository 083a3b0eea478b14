"""The base of all virtual instruments: bytes in, bytes out after the time that the real one would take.

Some answers take long to compute, so an instrument works on a message in steps; see `steps`.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, cast

from instruments.clock import Clock
from instruments.virtual.core.parameters import boolean, nr3, number, parameter
from instruments.virtual.core.parser import Parser, ScpiError, Value
from instruments.virtual.core.rows import Ask, Do, Own, Row, Table
from instruments.virtual.core.status import OPERATION_COMPLETE, Status
from instruments.virtual.core.steps import Steps, Work, run_to_end


class Answer(NamedTuple):
    """An answer of an instrument.

    Attributes:
        data: its bytes.
        ready: when they are ready [s].
        epoch: of the measurement that they come from; the device counts it up when it drops a measurement.
        begun: when the device began with the message [s].
        complete: whether the end of the answer is among the bytes.
    """

    data: bytes
    ready: float
    epoch: int
    begun: float
    complete: bool = True


#: The commands that every instrument of SCPI has.
COMMON: tuple[Row, ...] = (
    Ask("*IDN", lambda d: d.identity),
    Do("*RST", lambda d: d.reset()),
    Do("*CLS", lambda d: d.clear_status()),
    Do("*OPC", lambda d: d.note_completion()),
    Ask("*OPC", lambda d: d.completion()),
    Do("*WAI", lambda d: d.wait()),
    Do("*TRG", lambda d: d.trigger()),
    Ask("*TST", lambda _d: "+0"),
    Ask("*ESR", lambda d: f"{d.status.take_events():+d}"),
    Own("*ESE", lambda d, p: d.set_mask("event_enable", p), lambda d: f"{d.status.event_enable:+d}"),
    Own("*SRE", lambda d, p: d.set_mask("request_enable", p), lambda d: f"{d.status.request_enable:+d}"),
    Ask("*STB", lambda d: f"{d.status_byte():+d}"),
    Ask("SYSTem:ERRor[:NEXT]", lambda d: d.parser.next_error()),
    Ask("SYSTem:VERSion", lambda _d: "1999.0"),
    Do("SYSTem:BEEPer[:IMMediate]"),
    Do("SYSTem:LOCal"),
    Do("SYSTem:REMote"),
    Do("SYSTem:RWLock"),
)


@functools.cache
def _table(family: type[VirtualInstrument], numbered: tuple[int, ...], lacks: tuple[str, ...]) -> Table:
    """Return the rows of a model of this family, with these channels and without these nodes, made once."""
    of_channels = (row.of_channel(n) for n in numbered for row in family.CHANNEL_ROWS)
    rows = (*family.COMMON, *of_channels, *family.ROWS)
    return Table([row for row in rows if not has_node(row.header, lacks)], family.DEFAULTS)


def has_node(header: str, nodes: tuple[str, ...]) -> bool:
    """Return whether one of these nodes, in its printed form, is in a printed header."""
    return any(node in header for node in nodes)


class VirtualInstrument:
    """A wire-level model: messages in, answers out, an error queue, and the time everything takes.

    A subclass gives its identity and its rows and, where it reacts to settings, `on_change()`.

    Args:
        clock: of the bench.
        identity: the answer to ``*IDN?`` of another model of the family.
        pace: time for one message [s].
        numbered: the numbers of the channels, where they are not those of the class.
        lacks: nodes of headers, as printed, that this model of the family does not have; its rows with one of them are
            left out.
    """

    identity = "levilab,virtual,0,0"
    #: What ``SYST:ERR?`` answers when the queue is empty, how many entries it keeps, and what ends an answer.
    no_error, queue_size, line_end = '+0,"No error"', 20, "\n"
    #: Whether it knows blocks (IEEE 488.2, 7.7.6), and path memory (SCPI-1999, volume 1, 6.2.4).
    takes_blocks = path_memory = True
    #: Whether a number may have a second parameter, as the source of a level, which changes nothing; and whether a
    #: question about a number ignores a parameter that is none of MIN, MAX and DEF.
    lenient: ClassVar[bool] = False
    #: The common commands, its own, those of each channel, and the settings that no row has, with their defaults.
    COMMON: ClassVar[tuple[Row, ...]] = COMMON
    ROWS: ClassVar[tuple[Row, ...]] = ()
    CHANNEL_ROWS: ClassVar[tuple[Row, ...]] = ()
    DEFAULTS: ClassVar[Mapping[str, Value]] = {}
    #: The numbers of the channels that CHANNEL_ROWS are for.
    numbered: Sequence[int] = ()

    def __init__(
        self,
        clock: Clock,
        *,
        identity: str | None = None,
        pace: float = 2e-3,
        numbered: Sequence[int] | None = None,
        lacks: tuple[str, ...] = (),
    ) -> None:
        self.clock, self.pace, self.lacks = clock, pace, lacks
        self.identity = identity or self.identity
        if numbered is not None:
            self.numbered = numbered
        #: The rows; devices of the same model share the table.
        self.commands = _table(cast("Any", type(self)), tuple(self.numbered), lacks)
        self.settings: dict[str, Value] = dict(self.commands.defaults)
        self.status = Status()
        self.epoch = 0
        #: When it begins with the message that came last, and when it is done with that [s].
        self.begun = self._ready = 0.0
        #: On the message that came last, if it is worked on in slices: it may not be done yet.
        self.work: Work | None = None
        self.parser = Parser(self)

    def execute(self, message: str) -> Answer | None:
        """Run one message, a line without its end.  Returns the answers of its queries, None where it has none."""
        return run_to_end(self.steps(message))

    def steps(self, message: str) -> Steps[Answer | None]:
        """Run one message as execute() does, in steps."""
        self.begun = max(self._ready, self.clock.now())
        self._ready = self.begun + self.pace
        return self._answer((yield from self.parser.steps(message)))

    def is_abort(self, message: str) -> bool:
        """Return whether this message aborts the work on the one before it."""
        return False

    def catch_up(self) -> Steps[None]:
        """Work out what has happened in the instrument since the last message; by default nothing happens."""
        yield from ()

    def begin_next(self) -> None:
        """Begin a further command or query of a message; by default it takes no time of its own."""

    def _answer(self, text: str | None) -> Answer | None:
        if text is None:
            return None
        return Answer((text + self.line_end).encode("latin-1"), self._ready, self.epoch, self.begun)

    def abandon(self) -> None:
        """Cancel the work under way, and drop the answers that were not read."""
        if self.work:
            self.work.cancel()
        self.epoch += 1
        self._ready = self.clock.now()

    def end_since(self, begun: float) -> None:
        """End what messages since this time have asked for, as their program has left; other programs' answers stay.

        Args:
            begun: when the device began with the first of them [s].
        """
        self._ready = max(begun, self.clock.now())

    def busy_until(self, instant: float) -> None:
        """Let the answer to the message under way be ready at this time [s], not before."""
        self._ready = max(self._ready, instant)

    def trigger(self) -> None:
        """Take ``*TRG``, or the interface's own trigger message."""

    # --- what the rows need ---

    def value(self, name: str) -> float:
        """Return a setting that is a number."""
        return float(self.settings[name])

    def read_boolean(self, text: str) -> bool:
        """Return the value of a switch, from its text on the wire.  Raises ScpiError."""
        return boolean(text)

    def spell(self, value: float) -> str:
        """Return a number as this instrument prints it."""
        return nr3(value)

    def reply(self, header: str, text: str, unit: str = "") -> str:
        """Return an answer to the query of a row: the text alone."""
        return text

    def on_number_change(self, name: str, before: float) -> None:
        """React to a setting that has changed.  before: its former value, 0 where that was no number."""
        self.on_change(name)

    def on_change(self, name: str) -> None:
        """React to a setting that has changed."""

    @contextlib.contextmanager
    def all_or_none(self) -> Iterator[None]:
        """Leave the settings as they were where a command that sets several of them is refused in the end."""
        before = dict(self.settings)
        try:
            yield
        except ScpiError:
            self.settings |= before
            raise

    def reset(self) -> None:
        """Go to the state after ``*RST``."""
        self.settings |= self.commands.defaults
        for name in self.commands.defaults:
            self.on_change(name)

    # --- status ---

    def status_byte(self, *, message_available: bool = False) -> int:
        """Return the status byte (IEEE 488.2, 11.2)."""
        return self.status.byte(errors_waiting=bool(self.parser.errors), message_available=message_available)

    def clear_status(self) -> None:
        """``*CLS``: drop all errors and events."""
        self.parser.errors.clear()
        self.status.events = 0

    def note_completion(self) -> None:
        """``*OPC``: set bit 0 of the events when all operations are complete; here they are."""
        self.status.events |= OPERATION_COMPLETE

    def completion(self) -> Steps[str] | str:
        """``*OPC?``: answer when all operations are complete."""
        return "1"

    def wait(self) -> Steps[None] | None:
        """``*WAI``: let the next command wait until all operations are complete."""

    def set_mask(self, name: str, parameters: list[str]) -> None:
        """Set a mask of the status registers.  Raises ScpiError."""
        setattr(self.status, name, int(number(parameter(parameters), low=0, high=255, default=0)))
