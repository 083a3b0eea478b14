"""A session: one program's connection to one instrument of the bench."""

from __future__ import annotations

import math
import threading
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from instruments.clock import WallClock
from instruments.ieee488 import INFINITY
from instruments.virtual.core.message import Framer, Overrun
from instruments.virtual.core.parser import LONGEST_ANSWER, ScpiError
from instruments.virtual.core.steps import Work, run_to_end

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from instruments.virtual.core.device import Answer, VirtualInstrument
    from instruments.virtual.core.steps import Steps

_NOTHING, _WALL = memoryview(b""), WallClock()
#: Answers that wait to be read, at most.
MOST_ANSWERS = 1000
#: How long an instrument works in one slice [s], as the clock on the wall tells.
SLICE = 0.01
#: Bytes that are searched for the ends of messages in one slice.
_PIECE = 1 << 12


class LinkLost(Exception):
    """The connection is gone; only opening another one helps."""


@dataclass
class Hold:
    """Who keeps the others from an instrument: one, or all that know the key.

    >>> hold = Hold()
    >>> hold.take("me", None), hold.take("you", None)
    (True, False)
    >>> hold.let_go("me")
    >>> hold.take("you", "key"), hold.take("me", "key")
    (True, True)
    """

    holders: list[object] = field(default_factory=list)
    key: str | None = None

    def take(self, who: object, key: str | None) -> bool:
        """Whether it is theirs now.  key: to share it with, None to share it with nobody."""
        others = [holder for holder in self.holders if holder is not who]
        if others and (key is None or key != self.key):
            return False
        self.holders, self.key = [*others, who], key
        return True

    def let_go(self, who: object) -> None:
        """Give it up; it is no error not to have it."""
        self.holders = [holder for holder in self.holders if holder is not who]

    def keeps_out(self, who: object) -> bool:
        """Whether somebody else has it."""
        return bool(self.holders) and all(holder is not who for holder in self.holders)


class AnswerFault(Protocol):
    """What goes wrong with an answer on its way, as `faults.Fault`."""

    def strikes(self, message: str) -> bool:
        """Whether it strikes the answer to this message."""

    def act(self, session: Session, answer: Answer) -> Answer | None:
        """What becomes of the answer."""


@dataclass(eq=False)
class Session:
    """One program's link to one instrument.

    stream: bytes without ends, as over a serial line or a bare socket: a line feed ends a message, and answers follow
    each other.  Else the interface marks the end of a message (GPIB, USBTMC, VXI-11, HiSLIP), and a question that is
    sent before the last answer was read interrupts that one (IEEE 488.2, 6.3.2.3).  Every method raises LinkLost when
    the link is gone.

    lock, hold, faults, away: what all links of a bench share, see `bus.Bus`.
    """

    device: VirtualInstrument
    stream: bool = False
    lock: threading.RLock = field(default_factory=threading.RLock)
    hold: Hold = field(default_factory=Hold)
    faults: Sequence[AnswerFault] = ()
    away: dict[int, float] = field(default_factory=dict)
    chunk: int = 1 << 30  # bytes that are given at once, at most
    lost_after: int | None = None  # bytes until the link is lost
    _framer: Framer = field(init=False)
    _answers: deque[Answer] = field(default_factory=deque)
    _rest: memoryview = _NOTHING
    _complete: bool = True
    _asked: bool = False  # something was sent since the last answer was read

    def __post_init__(self) -> None:
        self._framer = Framer(blocks=self.device.takes_blocks)

    def write(self, data: bytes, *, end: bool = True) -> None:
        """Bytes for the instrument; it works on every message that they complete.  end: marked by the interface."""
        with self.lock:
            for message in self.messages(data, end=end):
                if message:
                    run_to_end(self._run(message, self.device.work))

    def messages(self, data: bytes, *, end: bool) -> Iterator[str]:
        """The messages that these bytes complete, for begin().

        Some are empty, where the work may be interrupted: a million line feeds take a second to be cut apart.
        """
        self._check_link()
        for start in range(0, max(1, len(data)), _PIECE):
            if start:
                yield ""
            stop = start + _PIECE
            marked = end and not self.stream and stop >= len(data)
            for message in self._framer.feed(data[start:stop], marked=marked):
                if isinstance(message, Overrun):
                    with self.lock:
                        self.device.parser.report(ScpiError(-363))
                elif message:
                    yield message

    def begin(self, message: str) -> Work[None]:
        """Let the instrument take a message, to work on it with go_on(); the one that it works on still comes first."""
        with self.lock:
            self._check_link()
            work = self.device.work = Work(self._run(message, self.device.work))
            return work

    def catch_up(self) -> Work[None]:
        """What has gone on in the instrument since the last message, to be worked out with go_on()."""
        return Work(self.device.catch_up())

    def go_on(self, work: Work[None]) -> bool:
        """Work for a slice; whether there is more to do.  The bus is locked meanwhile, and free between slices."""
        with self.lock:
            end = _WALL.now() + SLICE
            while work.step() and _WALL.now() < end:
                pass
        if work.error:
            raise work.error
        return not work.done

    def cancel(self, work: Work[None]) -> None:
        """No more of this work."""
        with self.lock:
            work.cancel()

    def _run(self, message: str, before: Work[None] | None) -> Steps[None]:
        if before and not before.done:
            if self.is_abort(message):
                before.cancel()
            while before.step():
                yield
        self._drop_what_is_abandoned()
        if not self.stream and (self._answers or self._rest):
            self.device.parser.report(ScpiError(-410))
            self._answers.clear()
            self._rest = _NOTHING
        self._asked = True
        answer = yield from self.device.steps(message)
        for fault in self.faults:
            if answer is not None and fault.strikes(message):
                answer = fault.act(self, answer)
        self._drop_what_is_abandoned()
        if answer is not None:
            self._answers.append(answer)
            self._keep_within_bounds()

    def is_abort(self, message: str) -> bool:
        """Whether this message ends what the instrument works on."""
        return self.device.is_abort(message)

    def bytes_are_abort(self, data: bytes, *, end: bool = True) -> bool:
        """Whether these bytes are such a message, whole and by itself."""
        whole = not self._framer.begun and ((end and not self.stream) or data.endswith(b"\n"))
        return whole and self.is_abort(data.decode("latin-1"))

    def _keep_within_bounds(self) -> None:
        """Who asks on and on and never reads gets nothing of it (IEEE 488.2, 6.3.1.7)."""
        if len(self._answers) < 2:
            return
        if len(self._answers) > MOST_ANSWERS or sum(len(answer.data) for answer in self._answers) > LONGEST_ANSWER:
            self._answers.clear()
            self._rest = _NOTHING
            self.device.parser.report(ScpiError(-430))

    def _check_link(self) -> None:
        if self.lost_after is not None and self.lost_after <= 0:
            raise LinkLost

    def _drop_what_is_abandoned(self) -> None:
        while self._answers and self._answers[0].epoch != self.device.epoch:
            self._answers.popleft()

    def ready(self) -> float | None:
        """When the next bytes are there [s], or None if none are under way."""
        with self.lock:
            self._check_link()
            self._drop_what_is_abandoned()
            if self._rest:
                return self.device.clock.now()
            return self._answers[0].ready if self._answers else None

    def read(self, count: int, timeout: float, *, until: bytes = b"") -> tuple[bytes, bool] | None:
        """At most count bytes of the answer and whether that was its end; None after the timeout [s].

        until: the byte after which to stop, if any.
        """
        clock = self.device.clock
        ready = self.ready()
        if ready is None or ready > clock.now() + timeout or ready >= INFINITY:
            self._note_silence(ready)
            if math.isfinite(timeout):  # for ever is no time to jump to
                clock.sleep(timeout)
            return None
        clock.sleep(ready - clock.now())
        return self.take(count, until=until)

    def take(self, count: int, *, until: bytes = b"") -> tuple[bytes, bool]:
        """At most count bytes of what is ready, and whether the answer ends with them."""
        with self.lock:
            self._check_link()
            if not self._rest and self._answers:
                answer = self._answers.popleft()
                self._rest, self._complete = memoryview(answer.data), answer.complete
            self._asked = False
            most = min(count, self.chunk, self.lost_after if self.lost_after is not None else count)
            chunk = bytes(self._rest[:most])
            if until and until in chunk:
                chunk = chunk[: chunk.index(until) + 1]
            self._rest = self._rest[len(chunk) :]
            if self.lost_after is not None:
                self.lost_after -= len(chunk)
            return chunk, not self._rest and self._complete

    def discard(self) -> None:
        """Drop what is ready and was not read."""
        with self.lock:
            self._rest = _NOTHING
            self._drop_what_is_abandoned()
            while self._answers and self._answers[0].ready <= self.device.clock.now():
                self._answers.popleft()

    def trigger(self) -> None:
        """The interface's trigger message."""
        with self.lock:
            try:
                self.device.trigger()
            except ScpiError as error:  # as in answer to *TRG: told in the error queue
                self.device.parser.report(error)

    def close(self) -> None:
        """The program is gone."""
        self.hold.let_go(self)

    def _note_silence(self, ready: float | None) -> None:
        """A reader who waits for what nobody asked: IEEE 488.2, 6.3.2.2."""
        with self.lock:
            if ready is None and not self.stream and not self._asked:
                self.device.parser.report(ScpiError(-420))

    def clear(self) -> None:
        """Device clear: what is under way in either direction is dropped, settings stay."""
        with self.lock:
            self._framer.clear()
            self._answers.clear()
            self._rest = _NOTHING
            self.device.abandon()

    def status_byte(self) -> int:
        """What a serial poll gives."""
        with self.lock:
            ready = self.ready()
            there = ready is not None and ready <= self.device.clock.now()
            return self.device.status_byte(message_available=there)
