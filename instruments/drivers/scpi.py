"""IEEE 488.2 and SCPI: the base of the drivers, and the declaration of a quantity in one line.

Source: IEEE 488.2-1992; SCPI-1999 volumes 1 and 2.
"""

import contextlib
import difflib
import functools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, NoReturn, Self, cast

from instruments.clock import Clock, WallClock
from instruments.drivers.setting import Setting
from instruments.errors import BadAnswer, CommandRefused, NoAnswer, OutOfRange, WrongInstrument
from instruments.ieee488 import IDENTITY_FIELDS, INFINITY, NOT_A_NUMBER, NUMERIC, Form, identity_fields
from instruments.links.opening import open_link
from instruments.links.transport import TrafficLog, Transport

#: Error queues hold 20 to 32 entries: an instrument that still has one after this number never answers "No error".
_LONGEST_ERROR_QUEUE = 64
#: An entry of the error queue (SCPI-1999, vol. 2, 21.8): a number and a text in quotes.
_QUEUE_ENTRY = re.compile(r"([+-]?\d{1,5}), ?(\"[ -~]*\")", re.ASCII)


class ScpiInstrument:
    """An instrument that speaks SCPI over a transport.

    A driver is a context manager that closes the link at the end.  It has no lock: use it from one thread.

    Attributes:
        MODELS: regular expression that the whole model field of ``*IDN?`` must match.
        SERIAL: the factory settings of its serial line; empty where it has none.
        NUMBER: the form in which it prints numbers, where a setting or a question has none of its own.
        HAS_ERROR_QUEUE: whether it has one.  Without, each setting is asked for after it was sent.
        ANSWERS_JOINED: whether one message may have several questions, and is answered with semicolons between the
            answers (IEEE 488.2, 8.4.1).  One that answers in another way is asked one by one; see `settings`.
        transport: the link.
        clock: of the bench.
        last_set: the last value set of each declared setting, since the last reset.

    ``Keysight53230A.connect("TCPIP0::192.168.1.20::5025::SOCKET")`` shows itself as
    ``<Keysight53230A 53230A MY58120113 at TCPIP0::192.168.1.20::5025::SOCKET>``.
    """

    MODELS: ClassVar[str] = ".*"
    SERIAL: ClassVar[Mapping[str, Any]] = {}
    NUMBER: ClassVar[Form] = NUMERIC
    HAS_ERROR_QUEUE: ClassVar[bool] = True
    ANSWERS_JOINED: ClassVar[bool] = False

    transport: Transport
    clock: Clock
    last_set: dict[str, bool | float | str]
    _fields: tuple[str, ...] = ()
    #: Whether this instrument has joined answers; None while it was not asked to.
    _joins: bool | None = None

    def __init__(self, transport: Transport, *, clock: Clock | None = None) -> None:
        """Drive the instrument at this link.

        Args:
            transport: the link.
            clock: of the bench, for the driver's waits; by default the wall clock.
        """
        self.transport = transport
        self.clock = clock or WallClock()
        self.last_set = {}

    @classmethod
    def connect(
        cls,
        address: str,
        *,
        library: Any = "@py",
        timeout: float = 2.0,
        clock: Clock | None = None,
        log: TrafficLog | None = None,
        **line: Any,
    ) -> Self:
        """Connect to the instrument at this address, which must be one of the driver's models.

        Args:
            address: a port (``COM3``), or the name of a VISA resource.
            library: PyVISA's, by its name or itself: ``"@py"``, ``"@levilab"``, ``""`` for the vendor's.
            timeout: of one answer [s].
            clock: of a virtual bench; by default the wall clock.
            log: called with all bytes.
            line: baud_rate, data_bits, parity, stop_bits of a serial line, where they are not the instrument's own.

        Raises:
            NotConnected: the address cannot be opened.
            NoAnswer: no instrument answers.
            WrongInstrument: another model answers.
        """
        link = open_link(address, line={**cls.SERIAL, **line}, library=library, timeout=timeout, clock=clock, log=log)
        try:
            instrument = cls(link, clock=clock)
            instrument.identity()
        except BaseException:
            link.close()
            raise
        return instrument

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        """Return model, serial number and address; the first two after identity() only."""
        known = " ".join(field for field in self._fields[1:3] if field)
        return f"<{type(self).__name__}{' ' * bool(known)}{known} at {self.transport.address}>"

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute.  Raises AttributeError for an unknown name, as a misspelt setting would have no effect."""
        if not name.startswith("_") and name not in _attributes(cast("Any", type(self))):
            near = difflib.get_close_matches(name, sorted(row.name for row in self.declared_settings()), n=1)
            hint = f": did you mean {near[0]!r}?" if near else ""
            raise AttributeError(f"{type(self).__name__} has no setting {name!r}{hint}", name=name, obj=self)
        super().__setattr__(name, value)

    def identity(self) -> str:
        """Ask ``*IDN?``.

        Returns:
            The answer.

        Raises:
            WrongInstrument: another model answers.
            BadAnswer: the answer does not have the four fields of an identity.
        """
        answer = self.transport.query("*IDN?")
        try:
            fields = identity_fields(answer)
        except ValueError:
            self.reject("*IDN?", answer, f"four fields with commas between them: {', '.join(IDENTITY_FIELDS)}")
        if not re.fullmatch(self.MODELS, fields[1], re.IGNORECASE):
            raise WrongInstrument(self.transport.address, answer, f"one of {self.kind_of_instrument()}")
        self._fields = fields
        return answer

    @classmethod
    def kind_of_instrument(cls) -> str:
        """Return the names of the instruments that it drives: the first line of its documentation."""
        return (cls.__doc__ or cls.__name__).splitlines()[0].rstrip(".")

    def forget_errors(self) -> None:
        """Empty the error queue, which may have errors of an earlier program."""
        self.transport.write("*CLS")

    def command(self, message: str) -> None:
        """Send a command and read the error queue.  Raises CommandRefused with the queue's texts."""
        if message.upper().startswith("*RST"):
            self.last_set.clear()
        self.transport.write(message)
        self.raise_errors(message)

    def raise_errors(self, after: str) -> None:
        """Empty the error queue, if it has one; raise CommandRefused if there was anything in it.

        Entries look like ``+0,"No error"`` or, from some makers, ``0,"No error"``.
        """
        entries: list[str] = []
        for _ in range(_LONGEST_ERROR_QUEUE if self.HAS_ERROR_QUEUE else 0):
            answer = self.transport.query("SYST:ERR?")
            entry = _QUEUE_ENTRY.fullmatch(answer)
            if not entry:
                self.reject("SYST:ERR?", answer, 'a number and a text, as +0,"No error"')
            if int(entry[1]) == 0:
                break
            entries.append(f"{entry[1]} {entry[2]}")
        if entries:
            raise CommandRefused(self.transport.address, after, tuple(entries))

    def reject(self, question: str, answer: str, expected: str) -> NoReturn:
        """Raise BadAnswer, and clear the link: the answer may have been another question's."""
        with self.clearing_on_bad_answer():
            raise BadAnswer(self.transport.address, question, answer, expected)

    @contextlib.contextmanager
    def clearing_on_bad_answer(self) -> Iterator[None]:
        """Clear the link where the block raises BadAnswer: the answer may have been another question's."""
        try:
            yield
        except BadAnswer:
            self.transport.clear()
            raise

    def settings(self) -> dict[str, bool | float | str]:
        """Ask the instrument for its declared settings, with the unit at the end of each name.

        Where it joins answers, all are asked for in one message: one exchange instead of a dozen.  An instrument that
        gives another number of answers is asked one by one, then and from then on.
        """
        rows = [row for row in self.declared_settings() if not row.on_demand or row.name_with_unit in self.last_set]
        questions = [row.question(self) for row in rows]
        if self.ANSWERS_JOINED and self._joins is not False and (answers := self._ask_joined(questions)):
            self._joins = True
            return {
                row.name_with_unit: row.read(self, question, answer)
                for row, question, answer in zip(rows, questions, answers, strict=True)
            }
        found = {row.name_with_unit: getattr(self, row.name) for row in rows}
        self._joins = False
        return found

    def _ask_joined(self, questions: Sequence[str]) -> list[str]:
        """Ask these questions in one message.

        Returns:
            As many answers; none where there came fewer or more, and then the link is cleared.

        Raises:
            NoAnswer: nothing came in time, from an instrument that has joined answers before.
        """
        answers: list[str] = []
        try:
            answers = [answer.strip() for answer in self.transport.query(";:".join(questions)).split(";")]
        except NoAnswer:
            if self._joins:  # then it is a fault of the link
                raise
        if len(answers) == len(questions):
            return answers
        self.transport.clear()  # the other answers may still come
        self.forget_errors()  # questions that were cut off leave errors behind
        return []

    def changed_settings(
        self,
        now: Mapping[str, bool | float | str] | None = None,
        *,
        since: Mapping[str, bool | float | str] | None = None,
    ) -> dict[str, tuple[object, object]]:
        """Find the settings that have changed.

        Args:
            now: what `settings` has returned; by default it asks the instrument.
            since: what `settings` returned before.  An instrument answers the same setting in the same way each time,
                so any other answer is a change.  By default `now` is compared with the values that were set, which the
                instrument rounds; see :meth:`Setting.differs`.

        Returns:
            name → (then, now).
        """
        if since is not None:
            now = now or self.settings()
            return {name: (then, now[name]) for name, then in since.items() if now[name] != then}
        found: dict[str, tuple[object, object]] = {}
        rows = {row.name_with_unit: row for row in self.declared_settings()}
        for name, asked in self.last_set.items():
            row = rows[name]
            stands = getattr(self, row.name) if now is None else now[name]
            if row.differs(asked, stands, rounding=self.rounding(row)):
                found[name] = (asked, stands)
        return found

    def rounding(self, row: Setting[Any]) -> float:
        """Return the rounding of a setting beyond that of other instruments [its unit]."""
        return 0.0

    @classmethod
    def declared_settings(cls) -> list[Setting[Any]]:
        """Return the declared settings, those of a base first."""
        rows = (row for owner in reversed(cls.__mro__) for row in vars(owner).values())
        return [row for row in rows if isinstance(row, Setting)]

    @classmethod
    def describe_settings(cls) -> list[dict[str, Any]]:
        """Return name, kind, unit and limits of each declared setting; see `Setting.describe`."""
        return [row.describe() for row in cls.declared_settings()]

    def field_of(self, answer: str, header: str, key: str) -> str:
        """Return the part of an answer that is one setting; all of it, where it has neither header nor fields.

        Raises ValueError where the answer does not have the setting.
        """
        return answer

    def confirm(self, setting: Setting[Any], value: bool | float | str) -> None:  # noqa: FBT001
        """Ask for a setting that was sent, where the instrument has no error queue.

        Raises:
            OutOfRange: it has set another number.
            CommandRefused: it has not taken the setting.
        """
        if self.HAS_ERROR_QUEUE:
            return
        now = getattr(self, setting.name)
        if not setting.differs(value, now, rounding=self.rounding(setting)):
            return
        if setting.kind is float:
            allowed = f"{now}, as the instrument has set it"
            raise OutOfRange(self.transport.address, setting.name, value, allowed)
        sent = f"{self.header_in_use(setting.header)} {value}"
        raise CommandRefused(self.transport.address, sent, (f"{setting.name} is {now!r} afterwards",))

    def header_in_use(self, header: str) -> str:
        """Return the header of a declared setting as it is sent; with several inputs, that of the input in use."""
        return header

    def close(self) -> None:
        """Close the link."""
        self.transport.close()


@functools.cache
def _attributes(driver: Any) -> frozenset[str]:
    """Return the names that can be set on a driver: its settings, properties, and annotated attributes."""
    annotated = (name for owner in driver.__mro__ for name in getattr(owner, "__annotations__", {}))
    return frozenset({*dir(driver), *annotated})


def parse_reading(address: str, question: str, answer: str, form: Form = NUMERIC) -> float | None:
    """Read a measured number; None where the instrument had nothing to measure: 9.91E37, 9.9E37, -9.9E37.

    Raises BadAnswer where the answer is no number of this form.
    """
    try:
        number = form.number(answer)
    except ValueError:
        number = math.nan
    if number in {NOT_A_NUMBER, INFINITY, -INFINITY}:
        return None
    if not abs(number) < INFINITY:
        raise BadAnswer(address, question, answer, f"a number, as {form.example}")
    return number
