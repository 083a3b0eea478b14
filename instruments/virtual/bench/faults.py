"""What goes wrong on a bench, to be tried without one: faults of a link, of an instrument, of its neighbours.

A fault strikes answers (see :class:`Fault`); `FAULTS` is the table of them.  They act where an instrument's answer goes
onto the wire, so they are the same for the PyVISA backend, for a serial line and for the servers.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from instruments.ieee488 import NOT_A_NUMBER
from instruments.virtual.core.parameters import nr3
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.status import POWER_ON

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.bench.session import Session
    from instruments.virtual.core.device import Answer

    Act = Callable[[Session, Answer], Answer | None]


@dataclass
class Fault:
    """One fault and when it strikes.

    what: a name in FAULTS; question: regular expression of the messages whose answers it strikes; after: so many of
    them go well first; times: so many are struck then.
    """

    what: str
    question: str = r".*\?.*"
    after: int = 0
    times: int = 1
    seen: int = field(default=0, init=False)

    def strikes(self, message: str) -> bool:
        """Whether it strikes the answer to this message, which is counted."""
        if not re.fullmatch(self.question, message, re.DOTALL | re.IGNORECASE):
            return False
        self.seen += 1
        return self.after < self.seen <= self.after + self.times

    def act(self, session: Session, answer: Answer) -> Answer | None:
        """What becomes of the answer."""
        return FAULTS[self.what](session, answer)


#: How late a late answer is, and how long a lost instrument cannot be reached [s].
LATE, AWAY = 10.0, 5.0


def _data(change: Callable[[bytes], bytes]) -> Act:
    """A fault that changes nothing but the bytes."""
    return lambda _, answer: answer._replace(data=change(answer.data))


def _in_single_bytes(session: Session, answer: Answer) -> Answer:
    session.chunk = 1
    return answer


def _cut(_: Session, answer: Answer) -> Answer:
    return answer._replace(data=answer.data[: len(answer.data) // 2], complete=False)


def _disconnected(session: Session, answer: Answer) -> Answer:
    session.lost_after = len(answer.data) // 2
    return answer


def _away(session: Session, answer: Answer) -> Answer:
    session.away[id(session.device)] = session.device.clock.now() + AWAY
    return _disconnected(session, answer)


def _overflow(session: Session, answer: Answer) -> Answer:
    for _ in range(session.device.queue_size + 5):
        session.device.parser.report(ScpiError(-113))
    return answer


def _reset(session: Session, answer: Answer) -> Answer:
    session.device.reset()
    session.device.status.events |= POWER_ON
    return answer


def _taken(session: Session, answer: Answer) -> Answer:
    session.hold.holders[:] = ["another program"]
    return answer


def _longer(data: bytes) -> bytes:
    """The head of a block says ten more bytes than there are."""
    return _relabelled(data, 10)


def _shorter(data: bytes) -> bytes:
    return _relabelled(data, -10)


def _relabelled(data: bytes, more: int) -> bytes:
    head = re.match(rb"#([1-9])", data)
    if not head:
        return data
    digits = int(head[1])
    size = int(data[2 : 2 + digits])
    return b"#%d%0*d" % (digits, digits, max(0, size + more)) + data[2 + digits :]


#: What becomes of an answer, by the name of the fault.
FAULTS: dict[str, Act] = {
    "no answer": lambda *_: None,
    "late answer": lambda _, answer: answer._replace(ready=answer.ready + LATE),
    "single bytes": _in_single_bytes,
    "two answers at once": _data(lambda data: data * 2),
    "garbage before": _data(lambda data: b"\x7f~#!" + data),
    "bytes that are no text before": _data(lambda data: b"\xff\xfe" + data),
    "garbage after": _data(lambda data: data + b"~#!\n"),
    "block longer than it says": _data(_shorter),
    "block shorter than it says": _data(_longer),
    "cut in the middle": _cut,
    "disconnected": _disconnected,
    "away for 5 s": _away,
    "error queue overflow": _overflow,
    "reset": _reset,
    "taken by another": _taken,
    "9.91E37": _data(lambda _: nr3(NOT_A_NUMBER).encode() + b"\n"),
}
