"""The SCPI parser of the virtual instruments: one parser, a table of commands per instrument.

Source: SCPI-1999, volume 1: short and long forms in any case (6.2), optional nodes and numeric suffixes,
compound messages with path memory (6.2.4), unit suffixes (7.1), MINimum, MAXimum and DEFault (7.2.1);
volume 2, chapter 21: the error numbers.  A message that is not understood gets no reply, only an entry in
the error queue: that is what makes the other side time out, as on the bench.
"""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING

from instruments.virtual.core.message import read_units
from instruments.virtual.core.steps import at_once

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.core.steps import Steps

ERRORS = {
    -102: "Syntax error",
    -104: "Data type error",
    -108: "Parameter not allowed",
    -109: "Missing parameter",
    -113: "Undefined header",
    -124: "Too many digits",
    -131: "Invalid suffix",
    -222: "Data out of range",
    -224: "Illegal parameter value",
    -230: "Data corrupt or stale",
    -213: "Init ignored",
    -221: "Settings conflict",
    -350: "Error queue overflow",
    -363: "Input buffer overrun",
    -410: "Query INTERRUPTED",
    -420: "Query UNTERMINATED",
    -430: "Query DEADLOCKED",
}

#: More than this in answer to one message fits into no output buffer (IEEE 488.2, 6.3.1.7) [bytes].
LONGEST_ANSWER = 1 << 26


class ScpiError(Exception):
    """An entry for the error queue.  number: as in the table above."""

    def __init__(self, number: int, detail: str = "") -> None:
        self.number = number
        # what the other side sent goes back as a string of IEEE 488.2 (8.7.8): ASCII, quotes doubled
        shown = "".join(c if " " <= c <= "~" else "?" for c in detail).replace('"', '""')
        text = ERRORS[number] + (f";{shown}" if detail else "")
        self.entry = f'{number:+d},"{text}"'
        super().__init__(self.entry)


@dataclass(frozen=True)
class Command:
    """One row of an instrument's table.

    pattern: the header as the manual prints it, ``[SOURce[1]:]FREQuency[:CW|:FIXed]``;
    set, get: what a command or a query with this header does, given its parameters, at once or in steps; None where
    there is none.
    """

    pattern: str
    set: Callable[[list[str]], Steps[None] | None] | None = None
    get: Callable[[list[str]], Steps[str] | str] | None = None

    @property
    def header(self) -> re.Pattern[str]:
        """The pattern as a regular expression for a header without its question mark."""
        return _header(self.pattern)


@cache
def _header(pattern: str) -> re.Pattern[str]:
    return re.compile(_expression(pattern), re.IGNORECASE)


def _expression(pattern: str) -> str:
    """A printed header as a regular expression: FREQuency → (?:FREQUENCY|FREQ), [x] → (?:x)?.

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
    """Takes messages apart and runs them on a table of commands.

    commands: the table; queue_size: entries of the error queue before it overflows; no_error: what an empty one
    answers; noted: called with the number of each error; path_memory: see `message`.
    """

    commands: tuple[Command, ...] = ()
    queue_size: int = 20
    no_error: str = '+0,"No error"'
    noted: Callable[[int], None] = lambda _: None
    path_memory: bool = True
    errors: deque[str] = field(default_factory=deque)
    _known: dict[str, Command] = field(default_factory=dict)

    def run(self, message: str) -> str | None:
        """Execute one message (a line without its end); the answers of its queries joined with ``;``, or None."""
        return at_once(self.steps(message))

    def steps(self, message: str) -> Steps[str | None]:
        """Do what run() does, in steps: a message may be interrupted after each of its units."""
        answers: list[str] = []
        length = 0
        for unit in read_units(message, path_memory=self.path_memory):
            if unit is None:
                yield
                continue
            header, parameters = unit
            try:
                answer = self._act(header)(parameters)
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

    def _act(self, header: str) -> Callable[[list[str]], Steps[str] | Steps[None] | str | None]:
        command = self._find(header.removesuffix("?").upper())
        act = command.get if header.endswith("?") else command.set
        if act is None:
            raise ScpiError(-113, header)
        return act

    def _find(self, name: str) -> Command:
        known = self._known.get(name)
        if known is None:
            known = next((command for command in self.commands if command.header.fullmatch(name)), None)
            if known is None:  # unknown headers are not remembered: they could be any number
                raise ScpiError(-113, name[:40])
            self._known[name] = known
        return known

    def report(self, error: ScpiError) -> None:
        """Put an entry into the error queue; when it is full its last entry says so."""
        self.noted(error.number)
        if len(self.errors) < self.queue_size:
            self.errors.append(error.entry)
        else:
            self.errors[-1] = ScpiError(-350).entry

    def next_error(self) -> str:
        """The oldest entry, removed, or that there is none."""
        return self.errors.popleft() if self.errors else self.no_error
