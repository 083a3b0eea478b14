"""Faults of a link, of an instrument, of its neighbours, to try on the virtual bench what goes wrong on a real one.

A fault changes answers (see :class:`Fault`); `FAULTS` is the table of them.  They act where an instrument's answer goes
onto the wire, so they are the same for the PyVISA backend, for a serial line and for the servers.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from instruments.ieee488 import NOT_A_NUMBER
from instruments.virtual.bench.session import Session
from instruments.virtual.core.device import Answer
from instruments.virtual.core.parameters import nr3
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.status import POWER_ON

Act = Callable[[Session, Answer], Answer | None]


@dataclass
class Fault:
    """One fault and when it strikes.

    Attributes:
        what: a name in FAULTS.
        question: regular expression of the messages whose answers it may strike.
        after: how many of these answers it spares first.
        times: how many it strikes then.
        seen: how many messages have matched so far.
    """

    what: str
    question: str = r".*\?.*"
    after: int = 0
    times: int = 1
    seen: int = field(default=0, init=False)

    def strikes(self, message: str) -> bool:
        """Count this message.  Returns whether the fault strikes its answer."""
        if not re.fullmatch(self.question, message, re.DOTALL | re.IGNORECASE):
            return False
        self.seen += 1
        return self.after < self.seen <= self.after + self.times

    def act(self, session: Session, answer: Answer) -> Answer | None:
        """Return the answer as the fault leaves it, None where it is lost."""
        return FAULTS[self.what](session, answer)


#: How late a late answer is, and how long an instrument that is away cannot be reached [s].
LATE, AWAY = 10.0, 5.0


def _change_bytes(change: Callable[[bytes], bytes]) -> Act:
    """Return a fault that changes nothing but the bytes."""
    return lambda _, answer: answer._replace(data=change(answer.data))


def _send_single_bytes(session: Session, answer: Answer) -> Answer:
    session.chunk = 1
    return answer


def _cut_in_half(_: Session, answer: Answer) -> Answer:
    return answer._replace(data=answer.data[: len(answer.data) // 2], complete=False)


def _disconnect(session: Session, answer: Answer) -> Answer:
    session.lost_after = len(answer.data) // 2
    return answer


def _make_unreachable(session: Session, answer: Answer) -> Answer:
    session.unreachable_until[id(session.device)] = session.device.clock.now() + AWAY
    return _disconnect(session, answer)


def _overflow_errors(session: Session, answer: Answer) -> Answer:
    for _ in range(session.device.queue_size + 5):
        session.device.parser.report(ScpiError(-113))
    return answer


def _reset(session: Session, answer: Answer) -> Answer:
    session.device.reset()
    session.device.status.events |= POWER_ON
    return answer


def _lock_by_another(session: Session, answer: Answer) -> Answer:
    session.client_lock.holders[:] = ["another program"]
    return answer


def _change_head(data: bytes, more: int) -> bytes:
    """Let the head of a block state a length that is off by this number of bytes; bytes that are no block stay."""
    head = re.match(rb"#([1-9])", data)
    if not head:
        return data
    digits = int(head[1])
    size = int(data[2 : 2 + digits])
    return b"#%d%0*d" % (digits, digits, max(0, size + more)) + data[2 + digits :]


#: How each fault changes an answer, by the name of the fault.
FAULTS: dict[str, Act] = {
    "no answer": lambda *_: None,
    "late answer": lambda _, answer: answer._replace(ready=answer.ready + LATE),
    "single bytes": _send_single_bytes,
    "two answers at once": _change_bytes(lambda data: data * 2),
    "garbage before": _change_bytes(lambda data: b"\x7f~#!" + data),
    "bytes that are no text before": _change_bytes(lambda data: b"\xff\xfe" + data),
    "garbage after": _change_bytes(lambda data: data + b"~#!\n"),
    "block longer than it says": _change_bytes(lambda data: _change_head(data, -10)),
    "block shorter than it says": _change_bytes(lambda data: _change_head(data, 10)),
    "cut in the middle": _cut_in_half,
    "disconnected": _disconnect,
    "away for 5 s": _make_unreachable,
    "error queue overflow": _overflow_errors,
    "reset": _reset,
    "taken by another": _lock_by_another,
    "9.91E37": _change_bytes(lambda _: nr3(NOT_A_NUMBER).encode() + b"\n"),
}
