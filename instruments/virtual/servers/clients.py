"""What all servers share: the clients' links to an instrument, their turns, and listening sockets.

One thread with one event loop serves all clients.  An instrument works in slices, and the bench is locked during a
slice; between two slices the event loop serves the other clients.  A client waits for its answer without that lock, on
the bench's clock, and looks again whenever something happens to the instrument.

An instrument takes the next message when it is done with the last one, and the clients take turns, a message each: a
flood of commands holds up the client that sends it, not the others.  The messages wait in a `ServedInstrument`, which
gives the turns.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from dataclasses import dataclass, field
from typing import Any

from instruments.ieee488 import INFINITY
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.session import LinkLost, Session
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.steps import Work

log = logging.getLogger(__name__)

#: Clients of one instrument by one protocol, and bytes of an answer that are sent at a stretch.
MOST_CLIENTS, CHUNK = 32, 1 << 20

#: How long a client may take for a protocol's first words [s], by the wall clock.
FIRST_WORDS = 5.0

#: A wait shorter than this is skipped [s]: an event loop wakes at whole milliseconds.
_NO_WAIT = 1e-4

#: How long the instrument may take for each message left by a client that sends no more [s], by the wall clock.
LINGER = 1.0

#: How often a client that is locked out looks at the lock [s]: a program in our own process releases it silently.
_LOOK_AGAIN = 0.2


class Disconnected(Exception):
    """The client has left, or has broken the protocol: its connection ends."""


@dataclass(eq=False)
class Job:
    """The messages that a client sent in one piece, for the instrument to work on one after the other.

    Attributes:
        link: of the client that sent them.
        messages: those that are left.
        message: the next one, or the one that the instrument works on; empty where the session pauses for the other
            clients' turn, None after the last one.
        work: the instrument's work on that message, None before it begins.
    """

    link: Link
    messages: Iterator[str]
    message: str | None = None
    work: Work | None = None

    def next_message(self) -> bool:
        """Go on to the next message.  Returns whether there is one."""
        self.message, self.work = next(self.messages, None), None
        return self.message is not None

    def may_have_turn(self) -> bool:
        """Return whether the instrument may take the message now."""
        link = self.link
        if link.instrument.working:
            return link.session.device.is_abort(self.message or "") and not link.is_locked_out()
        if self.work or not link.session.stream:  # the servers of the other protocols have waited for the lock
            return True
        # on a stream answers follow each other, so the last one must have gone first
        return not link.is_locked_out() and not link.answers_wait()

    def work_for_a_slice(self) -> bool:
        """Let the instrument work on the message for one slice.  Returns whether it is done with it."""
        if not self.message:
            return True
        if self.work is None:
            self.work = self.link.session.begin(self.message)
        return not self.link.session.go_on(self.work)


@dataclass(eq=False)
class ServedInstrument:
    """One instrument of a bench as its servers see it, with the queue of its clients' messages."""

    bench: VirtualBench
    device: VirtualInstrument
    links: list[Link] = field(default_factory=list)
    _jobs: deque[Job] = field(default_factory=deque)  # in the order of their turns
    _current: Job | None = None  # whose message the instrument works on
    _free_at: float = 0.0  # when the instrument takes the next message [s]
    _next_turn: asyncio.TimerHandle | None = None
    _change: asyncio.Future[None] | None = None  # what wait_for_change() waits for

    @property
    def working(self) -> bool:
        """Whether the instrument works on a message."""
        return self._current is not None

    # --- turns ---

    def add(self, job: Job) -> None:
        """Queue a job; the instrument begins with it at once if it has nothing else to do."""
        self._jobs.append(job)
        self._give_turn()

    def jobs(self) -> Iterator[Job]:
        """Yield the job that the instrument works on, then those that wait."""
        if self._current:
            yield self._current
        yield from self._jobs

    def drop(self, link: Link) -> None:
        """Drop everything that this client has sent, the work under way included."""
        if self._current and self._current.link is link:
            if self._current.work:
                link.session.cancel(self._current.work)
            self._current = None
        self._jobs = deque(job for job in self._jobs if job.link is not link)

    def _give_turn(self) -> None:
        """Work for a slice on the message under way, or on that of the client whose turn it is; plan the next turn."""
        wait = 0.0 if self._current else self.wall_duration_until(self._free_at)
        if wait == 0.0:
            job = self._choose()
            if job:
                self._work_for_a_slice(job)
            else:
                wait = _LOOK_AGAIN
        self._come_again(wait)

    def _come_again(self, wait: float) -> None:
        """Plan the next turn after this time [s], if a job is left."""
        if self._next_turn:
            self._next_turn.cancel()
            self._next_turn = None
        if self._current or self._jobs:
            self._next_turn = asyncio.get_running_loop().call_later(wait, self._give_turn)

    def _choose(self) -> Job | None:
        """Return the job to work on: the first that may have its turn, or the one under way if none may."""
        job = next((job for job in self._jobs if job.may_have_turn()), None)
        if job:
            self._jobs.remove(job)
            if self._current:  # the new job aborts this one; the messages that came with it still have their turn
                self._jobs.appendleft(self._current)
            self._current = job
        return self._current

    def _work_for_a_slice(self, job: Job) -> None:
        try:
            if not job.work_for_a_slice():
                return
            if job.message:
                job.link.messages_done += 1
                self._free_at = self.device.clock.now() + self.device.pace
            if job.next_message():
                self._jobs.append(job)
        except Exception as error:  # noqa: BLE001 - the instrument or the link has failed; raised where its client waits
            job.link.error = error
        self._current = None
        self._wake()

    # --- waiting ---

    def wall_duration_until(self, instant: float) -> float:
        """Return the time until this time of the bench [s], by the wall clock; a clock that jumps takes no time."""
        clock = self.device.clock
        missing = instant - clock.now()
        if missing <= 0:
            return 0.0
        if (wait := clock.wall_duration(missing)) > _NO_WAIT:
            return wait
        if clock.jumps:
            clock.sleep(missing)
        return 0.0

    def notify(self) -> None:
        """Wake all clients that wait for the instrument: something has happened to it."""
        self._wake()
        # a turn that is due stays, or a client that notifies without end would put it off for ever
        if self._next_turn and self._next_turn.when() > asyncio.get_running_loop().time():
            self._come_again(0.0)

    def _wake(self) -> None:
        if self._change:
            self._change.set_result(None)
            self._change = None

    async def wait_for_change(self, timeout: float | None) -> None:
        """Wait until something happens to the instrument, at most for this time [s] by the wall clock."""
        if self._change is None:
            self._change = asyncio.get_running_loop().create_future()
        await asyncio.wait([self._change], timeout=timeout)


class Link:
    """One client's link to an instrument.  Every method raises LinkLost when a fault has cut the link.

    Attributes:
        session: see :class:`instruments.virtual.bench.session.Session`; only the event loop may use it.
        lingers: whether it waits for an answer alone, and ends when another client comes.
        messages_done: how many messages the instrument has worked on.
        error: the exception that ended the work on one of them, None so far.
    """

    def __init__(self, instrument: ServedInstrument, *, stream: bool = False) -> None:
        self.instrument, self.closed, self.lingers, self.messages_done = instrument, False, False, 0
        for link in [link for link in instrument.links if link.lingers]:
            link.close()
        instrument.links.append(self)
        self.session = self._new(stream=stream)
        self.error: Exception | None = None

    def _new(self, *, stream: bool) -> Session:
        return self.instrument.bench.session(self.instrument.device, stream=stream)

    # --- to the instrument ---

    async def write(
        self,
        data: bytes,
        *,
        end: bool = True,
        timeout: float | None = None,
        give_up: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Send bytes to the instrument, once it has worked on those before; see Session.write.

        The instrument works on them after this has returned.

        Args:
            data: the bytes.
            end: whether the interface marks the end of a message behind them.
            timeout: how long to wait for the work on earlier bytes [s]; None: without limit.
            give_up: ends the wait when it returns True.

        Returns:
            Whether the instrument has accepted them in time.
        """
        self.instrument.bench.on_message()
        if not self.is_abort(data, end=end) and not await self.wait_until_done(timeout, give_up=give_up):
            return False
        self._raise_error()
        job = Job(self, self.session.messages(data, end=end))
        if job.next_message():
            self.instrument.add(job)
        return True

    def _raise_error(self) -> None:
        if self.error:
            raise self.error

    def is_abort(self, data: bytes, *, end: bool = True) -> bool:
        """Return whether these bytes end what the instrument works on; see Session.is_abort."""
        return self.instrument.working and not self.is_locked_out() and self.session.bytes_are_abort(data, end=end)

    def is_busy(self) -> bool:
        """Return whether messages of this client wait, or the instrument works on one."""
        return any(job.link is self for job in self.instrument.jobs())

    async def wait_until_done(
        self, timeout: float | None = None, *, give_up: Callable[[], bool] = lambda: False
    ) -> bool:
        """Wait until the instrument has worked on all messages of this client.  Returns whether it has, in time [s]."""
        return await self._wait_until(lambda: not self.is_busy(), timeout, give_up)

    async def linger(self, ended: Callable[[], Awaitable[object]]) -> None:
        """Wait until the instrument has worked on what a client sent before it fell silent.

        The wait ends when a message takes longer than LINGER.  On a stream it includes the answers: the client may have
        closed its own direction alone.  It waits for longer than LINGER for an answer while no other client is there.

        Args:
            ended: returns when everything is done.
        """
        done = -1
        while done < self.messages_done or self.lingers:
            done = self.messages_done
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(LINGER):
                    await ended()
                    return
            later = not self.closed and self.session.stream and 0 < (self.seconds_until_ready() or 0.0) < INFINITY
            self.lingers = later and self.instrument.links == [self]

    async def catch_up(self) -> None:
        """Work out what has happened in the instrument since the last message."""
        work = self.session.catch_up()
        while self.session.go_on(work):
            await asyncio.sleep(0)  # the others' turn

    def trigger(self) -> None:
        """Send the interface's trigger message."""
        self.session.trigger()
        self.instrument.notify()

    def clear(self) -> None:
        """Clear the device; a client that is locked out clears its own messages only, and the instrument works on."""
        self.instrument.drop(self)
        if self.is_locked_out():
            self.session = self._new(stream=self.session.stream)
        else:
            self.session.clear()
        self.instrument.notify()

    def report_interrupted(self) -> None:
        """Queue error −410: the client has sent a message before it had read the last answer."""
        with self.session.lock:
            self.instrument.device.parser.report(ScpiError(-410))

    def close(self) -> None:
        """End the link: drop the client's messages, release its lock, and end what its question has begun."""
        if self.closed:
            return
        self.closed = True
        self.instrument.links.remove(self)
        self.instrument.drop(self)
        self.session.close()
        self.instrument.notify()

    # --- from the instrument ---

    def seconds_until_ready(self) -> float | None:
        """Return the time until the next bytes of an answer are ready [s], by the wall clock; None: no answer."""
        self._raise_error()
        instant = self.session.ready()
        if instant is None:
            return None
        return instant if instant >= INFINITY else self.instrument.wall_duration_until(instant)

    def answers_wait(self) -> bool:
        """Return whether an answer is under way or ready."""
        with contextlib.suppress(LinkLost):
            return self.session.ready() is not None
        return False

    async def wait_for_answer(
        self, timeout: float | None = None, *, give_up: Callable[[], bool] = lambda: False
    ) -> bool:
        """Wait until bytes of an answer are ready.

        Args:
            timeout: how long at most [s], by the wall clock; None: without limit.
            give_up: ends the wait when it returns True; called whenever something has happened to the instrument.

        Returns:
            Whether they are ready.
        """
        seconds: float | None = None

        def is_ready() -> bool:
            nonlocal seconds
            seconds = self.seconds_until_ready()
            return seconds == 0.0

        return await self._wait_until(is_ready, timeout, give_up, lambda: seconds)

    def take(self, count: int, *, until: bytes = b"") -> tuple[bytes, bool]:
        """Take at most `count` bytes of what is ready, and whether the answer ends with them; see Session.take."""
        taken = self.session.take(count, until=until)
        self.instrument.notify()
        return taken

    def is_idle(self) -> bool:
        """Return whether the instrument has nothing to do for this client, and no answer is under way."""
        return not self.is_busy() and self.seconds_until_ready() is None

    def status_byte(self, *, unread: bool = False) -> int:
        """Return the status byte of a serial poll.  unread: whether the client has not read an answer sent to it."""
        with self.session.lock:
            return self.instrument.device.status_byte(message_available=True) if unread else self.session.status_byte()

    # --- locks ---

    def is_locked_out(self) -> bool:
        """Return whether another client has locked the instrument."""
        return self.session.client_lock.excludes(self.session)

    def has_lock(self) -> bool:
        """Return whether this client has locked the instrument, alone or with others."""
        return any(holder is self.session for holder in self.session.client_lock.holders)

    async def wait_unlocked(self, timeout: float | None = None, *, give_up: Callable[[], bool] = lambda: False) -> bool:
        """Wait until no other client has the instrument locked.  Returns whether it is so within this time [s]."""
        return await self._wait_until(lambda: not self.is_locked_out(), timeout, give_up)

    async def lock(self, key: str | None, timeout: float) -> bool:
        """Lock the instrument, alone (None) or with all that know the key.  Returns whether it succeeds in time [s]."""
        return await self._wait_until(
            lambda: self.session.client_lock.acquire(self.session, key), timeout, lambda: False
        )

    def unlock(self) -> None:
        """Release the lock."""
        self.session.client_lock.release(self.session)
        self.instrument.notify()

    async def _wait_until(
        self,
        condition: Callable[[], bool],
        timeout: float | None,
        give_up: Callable[[], bool],
        next_look: Callable[[], float | None] = lambda: _LOOK_AGAIN,
    ) -> bool:
        """Wait until a condition holds.

        Args:
            condition: checked whenever something has happened to the instrument, and after `next_look`.
            timeout: how long at most [s], by the wall clock; None: without limit.
            give_up: ends the wait when it returns True.
            next_look: how long until the condition may hold by itself [s]; None: it waits for an event.

        Returns:
            Whether the condition holds.
        """
        loop = asyncio.get_running_loop()  # the timers are the loop's, so its time counts
        end = None if timeout is None else loop.time() + timeout
        while not self.closed:
            if condition():
                return True
            left = None if end is None else end - loop.time()
            if give_up() or (left is not None and left <= 0):
                return False
            await self.instrument.wait_for_change(
                min((wait for wait in (next_look(), left) if wait is not None), default=None)
            )
        return False


async def first_of(*jobs: Coroutine[None, None, object]) -> None:
    """Run these side by side until one of them ends; cancel the others, and raise the error that ended it, if any."""
    tasks = [asyncio.ensure_future(job) for job in jobs]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


#: What a server does with one connection.
Conversation = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


class _Ear(asyncio.StreamReader):
    """The bytes of a client.  silent: whether none has come yet."""

    silent = True

    def feed_data(self, data: Any) -> None:
        """See the base."""
        self.silent = False
        super().feed_data(data)


async def _open_streams(connection: socket.socket) -> tuple[_Ear, asyncio.StreamWriter]:
    """Return the streams of a connection that was accepted, as asyncio.open_connection does.  Raises OSError."""
    loop, reader = asyncio.get_running_loop(), _Ear()
    protocol = asyncio.StreamReaderProtocol(reader)
    transport, _ = await loop.connect_accepted_socket(lambda: protocol, connection)
    return reader, asyncio.StreamWriter(transport, protocol, reader, loop)


class Listener:
    """A listening TCP socket that begins a conversation with every client that connects, up to a number of them.

    Where all places are taken, a client that has not said anything yet makes way.

    Attributes:
        port: where it listens; 0 until it is open.
    """

    def __init__(self, instrument: ServedInstrument, talk: Conversation, *, most: int = MOST_CLIENTS) -> None:
        self._instrument, self._talk, self._most = instrument, talk, most
        self._listening: socket.socket | None = None
        self._accepting: asyncio.Task[None] | None = None
        self._talks: dict[asyncio.Task[None], tuple[_Ear, asyncio.StreamWriter]] = {}
        self.port = 0

    async def open(self, host: str, port: int) -> None:
        """Listen at this address of the machine; port 0: any free one.  Raises OSError."""
        self._listening = socket.create_server((host, port), family=socket.AF_INET, backlog=self._most)
        self._listening.settimeout(0)
        self.port = self._listening.getsockname()[1]
        self._accepting = asyncio.ensure_future(self._accept(self._listening))

    async def _accept(self, listening: socket.socket) -> None:
        # asyncio's own server, closed while a client connects, waits for ever (Python 3.12) or fails (3.13)
        loop = asyncio.get_running_loop()
        while True:
            try:
                connection, _ = await loop.sock_accept(listening)
                self._begin(*await _open_streams(connection))
            except OSError:  # the client has left already, or this process has too many files open
                await asyncio.sleep(_LOOK_AGAIN)

    def _begin(self, reader: _Ear, writer: asyncio.StreamWriter) -> None:
        if len(self._talks) >= self._most:
            silent = next((task for task, (other, _) in self._talks.items() if other.silent), None)
            if silent:
                silent.cancel()
                self._talks.pop(silent)
        try:
            welcome = len(self._talks) < self._most and self._instrument.bench.reachable(self._instrument.device)
        except Exception:
            log.exception("a connection could not be accepted; the next ones can")
            welcome = False
        if not welcome:
            writer.transport.abort()
            return
        task = asyncio.ensure_future(self._conversation(reader, writer))
        self._talks[task] = reader, writer
        task.add_done_callback(lambda task: self._talks.pop(task, None))

    async def _conversation(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            # a client whose machine was switched off does not say so
            writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            await self._talk(reader, writer)
        except (OSError, EOFError, Disconnected, LinkLost):
            pass  # the client is gone
        except Exception:
            # one client's failure must not end the conversations with the others
            log.exception("a virtual instrument failed; the connection is closed")
        finally:
            writer.close()

    async def close(self) -> None:
        """Stop listening, and end all conversations."""
        if self._accepting is None or self._listening is None:
            return
        self._accepting.cancel()
        await asyncio.wait([self._accepting])
        self._listening.close()
        talks = dict(self._talks)
        for task, (_, writer) in talks.items():
            task.cancel()
            writer.transport.abort()
        await asyncio.gather(*talks, *(writer.wait_closed() for _, writer in talks.values()), return_exceptions=True)
