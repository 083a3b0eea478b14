"""The SCPI parser of the virtual instruments: one parser, a table of commands per instrument.

Source: SCPI-1999, volume 1: short and long forms in any case (6.2), optional nodes and numeric suffixes,
compound messages with path memory (6.2.4), unit suffixes (7.1), MINimum, MAXimum and DEFault (7.2.1);
volume 2, chapter 21: the error numbers.  The answer to a message with an error is an entry in the error queue and
nothing else, so the program at the other side runs into its time-out, as on the bench.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Self

from instruments.virtual.core.message import read_units
from instruments.virtual.core.steps import run_to_end

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from instruments.virtual.core.steps import Steps

ERRORS = {
    -102: "Syntax error",
    -103: "Invalid separator",
    -104: "Data type error",
    -108: "Parameter not allowed",
    -109: "Missing parameter",
    -113: "Undefined header",
    -124: "Too many digits",
    -131: "Invalid suffix",
    -222: "Data out of range",
    -224: "Illegal parameter value",
    -230: "Data corrupt or stale",
    -211: "Trigger ignored",
    -213: "Init ignored",
    -221: "Settings conflict",
    -350: "Error queue overflow",
    -363: "Input buffer overrun",
    -410: "Query INTERRUPTED",
    -420: "Query UNTERMINATED",
    -430: "Query DEADLOCKED",
}

#: A word of a printed header, what of it the short form leaves out, and the beginning of a word on the wire.
_MNEMONIC, _LOWER, _BEGINNING = re.compile(r"[A-Za-z*_]+"), re.compile("[a-z]+"), re.compile("[^0-9]{0,2}")

#: The output buffer: the longest answer to one message (IEEE 488.2, 6.3.1.7) [bytes].
LONGEST_ANSWER = 1 << 26


class ScpiError(Exception):
    """An entry for the error queue.  number: one of the table above."""

    def __init__(self, number: int, detail: str = "") -> None:
        self.number = number
        # the program's own text goes back as a string of IEEE 488.2 (8.7.8): ASCII, quotes doubled
        shown = "".join(c if " " <= c <= "~" else "?" for c in detail).replace('"', '""')
        text = ERRORS[number] + (f";{shown}" if detail else "")
        self.entry = f'{number:+d},"{text}"'
        super().__init__(self.entry)


#: The value of a setting.
Value = float | str | bool
#: The function of a command or a query: takes the device and the parameters, returns its result or steps to it.
Action = Callable[[Any, list[str]], "Steps[str] | Steps[None] | str | None"]


@dataclass(frozen=True)
class Row:
    """One command of an instrument, as data; the kinds of rows are in `rows`.

    header: as the manual prints it, ``[SOURce[1]:]FREQuency[:CW|:FIXed]``.
    """

    header: str

    @property
    def settable(self) -> bool:
        """Whether the row has a command."""
        return True

    @property
    def askable(self) -> bool:
        """Whether the row has a query."""
        return True

    def set(self, device: Any, parameters: list[str]) -> Steps[Any] | str | None:
        """Execute the command, and return the answer where it has one.  Raises ScpiError."""
        raise NotImplementedError

    def ask(self, device: Any, parameters: list[str]) -> Steps[str] | str:
        """Answer the query.  Raises ScpiError."""
        raise NotImplementedError

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
        return replace(self, **{name: _of_channel(text, n) for name, text in texts.items() if isinstance(text, str)})


def _of_channel(text: str, n: int) -> str:
    text = text.replace("{n}", str(n))
    if n > 1:
        text = re.sub(r"\[(\w+)\[n\](:?)\]", rf"\g<1>{n}\2", text)
    return text.replace("[n]", "[1]" if n == 1 else str(n))


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
            if header.endswith("?") and row.askable:
                return row.ask
            if not header.endswith("?") and row.settable:
                return row.set
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


@dataclass
class Parser:
    """Reads messages and executes them by a table of commands.

    Attributes:
        device: that the commands act on.
        commands: its table.
        queue_size: how many entries the error queue has.
        no_error: the answer of an empty queue.
        on_next: called before each command or query of a message but the first.
        on_error: called with the number of each error.
        path_memory: see `message.read_units`.
        errors: the error queue.
    """

    device: Any
    commands: Table
    queue_size: int = 20
    no_error: str = '+0,"No error"'
    on_next: Callable[[], None] = lambda: None
    on_error: Callable[[int], None] = lambda _: None
    path_memory: bool = True
    errors: deque[str] = field(default_factory=deque)

    def run(self, message: str) -> str | None:
        """Execute one message, a line without its end.  Returns the answers joined with ``;``, or None."""
        return run_to_end(self.steps(message))

    def steps(self, message: str) -> Steps[str | None]:
        """Run one message as run() does, in steps: other work may come between two units of it."""
        answers: list[str] = []
        length, begun = 0, False
        for unit in read_units(message, path_memory=self.path_memory):
            if unit is None:
                yield
                continue
            header, parameters = unit
            if begun:
                self.on_next()
            begun = True
            try:
                answer = self.commands.find(header)(self.device, parameters)
                if answer is not None and not isinstance(answer, str):
                    answer = yield from answer
            except ScpiError as error:
                self.report(error)
                break
            if answer is None:
                continue
            answers.append(answer)
            length += len(answer)
            if length > LONGEST_ANSWER:
                self.report(ScpiError(-430))
                return None
        return ";".join(answers) if answers else None

    def report(self, error: ScpiError) -> None:
        """Queue an error; where the queue is full, its last entry becomes “Error queue overflow”."""
        self.on_error(error.number)
        if len(self.errors) < self.queue_size:
            self.errors.append(error.entry)
        else:
            self.errors[-1] = ScpiError(-350).entry

    def next_error(self) -> str:
        """Remove and return the oldest entry; where there is none, the text for no error."""
        return self.errors.popleft() if self.errors else self.no_error
