"""A transport with a script: driver tests as conversations, in the style of PyMeasure's ``expected_protocol``."""

import contextlib
from collections import deque
from typing import TypeVar

from instruments.errors import NoAnswer

D = TypeVar("D")

#: In the place of what was sent: a device clear.  In the place of what was answered: nothing, to a question.
CLEAR, SILENCE = "<device clear>", "<silence>"
NO_ERROR = ("SYST:ERR?", '+0,"No error"')

Line = tuple[str, str | None]


class Script:
    """A Transport that expects these lines, sent and answered (None: a command, not a question).

    waited: the patience of every question [s].
    """

    def __init__(self, lines):
        self.address, self.timeout = "SCRIPT::INSTR", 2.0
        self.left, self.waited, self.closed = deque(lines), list[float](), False

    def write(self, message):
        assert self._next(message) is None, f"{message!r} was sent, but its answer not waited for"

    def query(self, message, *, patience=0.0):
        answer = self._next(message)
        assert answer is not None, f"{message!r} is a command, but an answer was waited for"
        self.waited.append(patience)
        if answer == SILENCE:
            raise NoAnswer(self.address, message, self.timeout + patience)
        return answer

    def query_block(self, message, *, patience=0.0, form=None):
        answer = self._next(message)
        self.waited.append(patience)
        if answer == SILENCE:
            raise NoAnswer(self.address, message, self.timeout + patience)
        assert isinstance(answer, bytes), f"{message!r} is not answered with a block"
        return answer

    def clear(self):
        self._next(CLEAR)

    def close(self):
        self.closed = True

    def _next(self, message):
        assert self.left, f"{message!r} was sent after the end of the script"
        expected, answer = self.left.popleft()
        assert message == expected
        return answer


def accepted(*commands):
    """The lines of commands that the instrument takes without an error."""
    return [line for command in commands for line in ((command, None), NO_ERROR)]


@contextlib.contextmanager
def conversation(driver, *lines):
    """A driver whose instrument says these lines; all of them must have been said in the end."""
    script = Script(lines)
    yield driver(script)
    assert not script.left, f"never sent: {[sent for sent, _ in script.left]}"
