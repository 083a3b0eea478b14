"""The SCPI parser of the virtual instruments: one parser, a table of commands per instrument.

Source: SCPI-1999, volume 1: short and long forms in any case (6.2), optional nodes and numeric suffixes,
compound messages with path memory (6.2.4), unit suffixes (7.1), MINimum, MAXimum and DEFault (7.2.1);
volume 2, chapter 21: the error numbers.  The answer to a message with an error is an entry in the error queue and
nothing else, so the program at the other side runs into its time-out, as on the bench.
"""

from collections import deque
from collections.abc import Callable
from typing import Any

from instruments.virtual.core.message import read_units
from instruments.virtual.core.steps import Steps, run_to_end

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


class Parser:
    """Reads messages and executes them by the table of commands of a device.

    Attributes:
        errors: the error queue.
    """

    def __init__(self, device: Any) -> None:
        self._device = device
        self.errors: deque[str] = deque()

    def run(self, message: str) -> str | None:
        """Execute one message, a line without its end.  Returns the answers joined with ``;``, or None."""
        return run_to_end(self.steps(message))

    def steps(self, message: str) -> Steps[str | None]:
        """Run one message as run() does, in steps: other work may come between two units of it."""
        answers: list[str] = []
        length, begun = 0, False
        for unit in read_units(message, path_memory=self._device.path_memory):
            if unit is None:
                yield
                continue
            header, parameters = unit
            if begun:
                self._device.begin_next()
            begun = True
            try:
                answer = self._device.commands.find(header)(self._device, parameters)
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
        self._device.status.note_error(error.number)
        if len(self.errors) < self._device.queue_size:
            self.errors.append(error.entry)
        else:
            self.errors[-1] = ScpiError(-350).entry

    def next_error(self) -> str:
        """Remove and return the oldest entry; where there is none, the text for no error."""
        return self.errors.popleft() if self.errors else self._device.no_error
