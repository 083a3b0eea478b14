"""A session: one program's connection to one instrument of the bench."""

import math
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from instruments.clock import WallClock
from instruments.ieee488 import INFINITY
from instruments.virtual.bench.exchange import MARKED, STREAM, Event, State
from instruments.virtual.core.device import Answer, VirtualInstrument
from instruments.virtual.core.message import Framer, Overrun
from instruments.virtual.core.parser import LONGEST_ANSWER, ScpiError
from instruments.virtual.core.steps import Steps, Work, run_to_end

_WALL = WallClock()
#: Answers that may wait for the program to read them, at most.
MOST_ANSWERS = 1000
#: How long an instrument works in one slice [s], by the wall clock.
SLICE = 0.01
#: Bytes in which the session looks for the ends of messages in one slice.
_PIECE = 1 << 12


class LinkLost(Exception):
    """The connection is lost; the program must open another one."""


@dataclass
class ClientLock:
    """A lock on an instrument, held by one client alone or by all that know its key.

    >>> client_lock = ClientLock()
    >>> client_lock.acquire("me", None), client_lock.acquire("you", None)
    (True, False)
    >>> client_lock.release("me")
    >>> client_lock.acquire("you", "key"), client_lock.acquire("me", "key")
    (True, True)
    """

    holders: list[object] = field(default_factory=list)
    key: str | None = None

    def acquire(self, who: object, key: str | None) -> bool:
        """Take the lock if it is free, or shared with this key.

        Args:
            who: takes it.
            key: of a shared lock; None: an exclusive lock.

        Returns:
            Whether `who` holds the lock now.
        """
        others = [holder for holder in self.holders if holder is not who]
        if others and (key is None or key != self.key):
            return False
        self.holders, self.key = [*others, who], key
        return True

    def release(self, who: object) -> None:
        """Release the lock; does nothing where `who` does not hold it."""
        self.holders = [holder for holder in self.holders if holder is not who]

    def excludes(self, who: object) -> bool:
        """Return whether others hold the lock, and `who` does not."""
        return bool(self.holders) and all(holder is not who for holder in self.holders)


@dataclass(eq=False)
class Session:
    """One program's link to one instrument.

    stream: whether bytes have no ends, as over a serial line or a bare socket.  The module `exchange` says what
    messages and reads do in either case.  Every method raises LinkLost when the link is lost.

    lock, client_lock, faults, unreachable_until: all sessions of a bench share them, see `bench.VirtualBench`.
    """

    device: VirtualInstrument
    stream: bool = False
    lock: threading.RLock = field(default_factory=threading.RLock)
    client_lock: ClientLock = field(default_factory=ClientLock)
    faults: Sequence[Any] = ()  # of `faults.Fault`, which change answers on their way
    unreachable_until: dict[int, float] = field(default_factory=dict)
    chunk: int = 1 << 30  # bytes of an answer handed over in one piece, at most
    lost_after: int | None = None  # bytes that still arrive before the link is lost
    _framer: Framer = field(init=False)
    _state: State = State.IDLE
    _answers: deque[Answer] = field(default_factory=deque)
    _taken: int = 0  # bytes of the first answer that the program has read, in the state READING

    def __post_init__(self) -> None:
        self._framer = Framer(blocks=self.device.takes_blocks)
        self._table = STREAM if self.stream else MARKED

    def _change_state(self, event: Event) -> None:
        """Go to the next state, and queue the error that the table says."""
        self._state, error = self._table.get((self._state, event), (self._state, 0))
        if self._state in {State.IDLE, State.ASKED}:
            self._answers.clear()
        if error:
            self.device.parser.report(ScpiError(error))

    def write(self, data: bytes, *, end: bool = True) -> None:
        """Send bytes to the instrument, which works on every message that they complete.

        Args:
            data: the bytes.
            end: whether the interface marks the end of a message behind them; ignored on a stream.
        """
        with self.lock:
            for message in self.messages(data, end=end):
                if message:
                    run_to_end(self._run(message, self.device.work))

    def messages(self, data: bytes, *, end: bool) -> Iterator[str]:
        """Yield the messages that these bytes complete, for begin().

        Empty ones among them are pauses for other work: to split a million line feeds takes a second.
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

    def begin(self, message: str) -> Work:
        """Give the instrument a message; go_on() works on it, after the one that the instrument already works on."""
        with self.lock:
            self._check_link()
            work = self.device.work = Work(self._run(message, self.device.work))
            return work

    def catch_up(self) -> Work:
        """Begin to work out what has happened in the instrument since the last message; go_on() does the work."""
        return Work(self.device.catch_up())

    def go_on(self, work: Work) -> bool:
        """Work for a slice, with the bench locked.  Returns whether there is more to do."""
        with self.lock:
            end = _WALL.now() + SLICE
            while work.step() and _WALL.now() < end:
                pass
        if work.error:
            raise work.error
        return not work.done

    def cancel(self, work: Work) -> None:
        """End this work on a message, and what the message has asked for."""
        with self.lock:
            if not work.done:
                work.cancel()
                self.device.end_since(self.device.begun)

    def _run(self, message: str, before: Work | None) -> Steps[None]:
        if before and not before.done:
            if self.device.is_abort(message):
                before.cancel()
            while before.step():
                yield
        self._drop_abandoned_answers()
        self._change_state(Event.MESSAGE)
        answer = yield from self.device.steps(message)
        for fault in self.faults:
            if answer is not None and fault.strikes(message):
                answer = fault.act(self, answer)
        self._drop_abandoned_answers()
        if answer is not None:
            self._answers.append(answer)
            self._change_state(Event.ANSWER)
            waiting = len(self._answers)
            if waiting > MOST_ANSWERS or (waiting > 1 and sum(len(a.data) for a in self._answers) > LONGEST_ANSWER):
                self._change_state(Event.OVERFLOW)  # the program asks and never reads

    def bytes_are_abort(self, data: bytes, *, end: bool = True) -> bool:
        """Return whether these bytes are one whole message that aborts what the instrument works on."""
        whole = not self._framer.begun and ((end and not self.stream) or data.endswith(b"\n"))
        return whole and self.device.is_abort(data.decode("latin-1"))

    def _check_link(self) -> None:
        if self.lost_after is not None and self.lost_after <= 0:
            raise LinkLost

    def _drop_abandoned_answers(self) -> None:
        """Drop the answers of a measurement that was given up; an answer that the program has begun may be read."""
        if self._state is State.ANSWERED:
            self._drop_while(lambda answer: answer.epoch != self.device.epoch)

    def _drop_while(self, condition: Callable[[Answer], bool]) -> None:
        while self._answers and condition(self._answers[0]):
            self._answers.popleft()
        if not self._answers:
            self._change_state(Event.DROP)

    def ready(self) -> float | None:
        """Return the time at which the next bytes of an answer are ready [s], None where no answer is under way."""
        with self.lock:
            self._check_link()
            self._drop_abandoned_answers()
            if self._state is State.READING:
                return self.device.clock.now()
            return self._answers[0].ready if self._answers else None

    def read(self, count: int, timeout: float, *, until: bytes = b"") -> tuple[bytes, bool] | None:
        """Wait for bytes of an answer.

        Args:
            count: how many at most.
            timeout: how long to wait [s].
            until: the byte after which to stop, if any.

        Returns:
            The bytes, and whether the answer ends with them; None after the timeout.
        """
        clock = self.device.clock
        with self.lock:
            ready = self.ready()
            if ready is None:
                self._change_state(Event.READ_NOTHING)
        if ready is None or ready > clock.now() + timeout or ready >= INFINITY:
            if math.isfinite(timeout):  # a clock cannot jump to infinity
                clock.sleep(timeout)
            return None
        clock.sleep(ready - clock.now())
        return self.take(count, until=until)

    def take(self, count: int, *, until: bytes = b"") -> tuple[bytes, bool]:
        """Take at most `count` bytes of what is ready.  Returns them, and whether the answer ends with them."""
        with self.lock:
            self._check_link()
            if not self._answers:
                return b"", True
            answer, start = self._answers[0], self._taken if self._state is State.READING else 0
            most = min(count, self.chunk, self.lost_after if self.lost_after is not None else count)
            chunk = answer.data[start : start + most]
            if until and until in chunk:
                chunk = chunk[: chunk.index(until) + 1]
            self._taken = start + len(chunk)
            ended = self._taken == len(answer.data)
            if ended:
                self._next_answer()
            else:
                self._change_state(Event.READ_PART)
            if self.lost_after is not None:
                self.lost_after -= len(chunk)
            return chunk, ended and answer.complete

    def _next_answer(self) -> None:
        """Drop the answer that the program has read."""
        self._answers.popleft()
        self._change_state(Event.READ_ONE if self._answers else Event.READ_LAST)

    def discard(self) -> None:
        """Drop what is ready and was not read."""
        with self.lock:
            if self._state is State.READING:
                self._next_answer()
            self._drop_abandoned_answers()
            if self._answers:
                self._drop_while(lambda answer: answer.ready <= self.device.clock.now())

    def trigger(self) -> None:
        """Send the interface's trigger message."""
        with self.lock:
            try:
                self.device.trigger()
            except ScpiError as error:  # as after *TRG: it goes into the error queue
                self.device.parser.report(error)

    def close(self) -> None:
        """End the session: release its lock, and end the instrument's work on a question of its program."""
        with self.lock:
            self.client_lock.release(self)
            now, epoch = self.device.clock.now(), self.device.epoch
            for answer in self._answers:
                if answer.epoch == epoch and answer.begun <= now < answer.ready:
                    self.device.end_since(answer.begun)

    def clear(self) -> None:
        """Clear the device: drop what is under way in either direction, keep the settings."""
        with self.lock:
            self._framer.clear()
            self._change_state(Event.CLEAR)
            self.device.abandon()

    def status_byte(self) -> int:
        """Return the status byte, as a serial poll reads it."""
        with self.lock:
            ready = self.ready()
            there = ready is not None and ready <= self.device.clock.now()
            return self.device.status_byte(message_available=there)
