"""What all servers share: links to an instrument that are waited for on an event loop, and listening sockets.

One thread with one event loop serves all clients.  An instrument works while the bus is locked, in slices between which
the other clients have their turn; its answers are waited for without that lock, on the bench's clock, and whatever
happens to the instrument meanwhile is looked at.

An instrument takes the next message when it is done with the last one, and the clients take turns, a message each: a
flood of commands holds up the client that sends it, not the others.  What they have sent waits in the instrument's
station, which gives the turns.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from instruments.ieee488 import INFINITY
from instruments.virtual.bench.session import LinkLost
from instruments.virtual.core.parser import ScpiError

if TYPE_CHECKING:
    from collections.abc import Coroutine, Iterator

    from instruments.virtual.bench.bus import Bus
    from instruments.virtual.bench.session import Session
    from instruments.virtual.core.device import VirtualInstrument
    from instruments.virtual.core.steps import Work

log = logging.getLogger(__name__)

#: Clients of one instrument by one protocol, and bytes of an answer that are sent at a stretch.
MOST_CLIENTS, CHUNK = 32, 1 << 20

#: How long a client may take for a protocol's first words [s], as the clock on the wall tells.
FIRST_WORDS = 5.0

#: A wait that is shorter than this is none [s]: an event loop wakes at whole milliseconds.
_NO_WAIT = 1e-4

#: How long the next message of a client that has nothing more to say may take [s], as the clock on the wall tells.
LINGER = 1.0

#: How often somebody who is kept out looks whether the lock was given up by a program in our own process [s].
_LOOK_AGAIN = 0.2


class Disconnected(Exception):
    """The client is gone, or talks what is not the protocol: nothing is left to do for it."""


@dataclass(eq=False)
class Job:
    """What a client has sent at a time: messages for the instrument, one after the other.

    message: the next one, or the one that the instrument works on; empty where there is none before others have had
    their turn, None after the last one.  work: on that message.
    """

    link: Link
    messages: Iterator[str]
    message: str | None = None
    work: Work[None] | None = None

    def next_message(self) -> bool:
        """Turn to the next message; whether there is one."""
        self.message, self.work = next(self.messages, None), None
        return self.message is not None

    def may_have_turn(self) -> bool:
        """Whether the instrument may take the message now."""
        link = self.link
        if link.station.working:
            return link.session.is_abort(self.message or "") and not link.kept_out()
        if self.work or not link.session.stream:  # the servers of the other protocols have waited for the lock
            return True
        return not link.kept_out() and not link.answers_wait()  # they follow each other: the last one goes first

    def work_for_a_slice(self) -> bool:
        """Let the instrument work on the message; whether it is done with it."""
        if not self.message:
            return True
        if self.work is None:
            self.work = self.link.session.begin(self.message)
        return not self.link.session.go_on(self.work)


@dataclass(eq=False)
class Station:
    """One instrument of a bus, as its servers see it: what its clients have sent waits here for its turn."""

    bus: Bus
    device: VirtualInstrument
    _jobs: deque[Job] = field(default_factory=deque)  # in the order of their turns
    _under_way: Job | None = None  # whose message the instrument works on
    _free: float = 0.0  # when the instrument takes the next message [s]
    _next_turn: asyncio.TimerHandle | None = None
    _stirred: asyncio.Future[None] | None = None  # what stirred() waits for

    @property
    def working(self) -> bool:
        """Whether the instrument works on a message."""
        return self._under_way is not None

    # --- turns ---

    def add(self, job: Job) -> None:
        """Let the instrument work on this, in turn: now, if nothing else is to be done."""
        self._jobs.append(job)
        self._give_turn()

    def jobs(self) -> Iterator[Job]:
        """What is worked on, and what waits."""
        if self._under_way:
            yield self._under_way
        yield from self._jobs

    def drop(self, link: Link) -> None:
        """Nothing more of what this client has sent."""
        if self._under_way and self._under_way.link is link:
            if self._under_way.work:
                link.session.cancel(self._under_way.work)
            self._under_way = None
        self._jobs = deque(job for job in self._jobs if job.link is not link)

    def _give_turn(self) -> None:
        """Work for a slice on the message under way, or on that of the client whose turn it is, and come again."""
        wait = 0.0 if self._under_way else self.wall_duration_until(self._free)
        if wait == 0.0:
            job = self._choose()
            if job:
                self._work_for_a_slice(job)
            else:
                wait = _LOOK_AGAIN
        self._come_again(wait)

    def _come_again(self, wait: float) -> None:
        """Give the next turn after a while [s], if anything waits for one."""
        if self._next_turn:
            self._next_turn.cancel()
            self._next_turn = None
        if self._under_way or self._jobs:
            self._next_turn = asyncio.get_running_loop().call_later(wait, self._give_turn)

    def _choose(self) -> Job | None:
        """What is worked on now: what is under way, unless it is cut off, or the first that may have its turn."""
        job = next((job for job in self._jobs if job.may_have_turn()), None)
        if job:
            self._jobs.remove(job)
            if self._under_way:  # it has been cut off; the messages that came with it have their turn
                self._jobs.appendleft(self._under_way)
            self._under_way = job
        return self._under_way

    def _work_for_a_slice(self, job: Job) -> None:
        try:
            if not job.work_for_a_slice():
                return
            if job.message:
                job.link.messages_done += 1
                self._free = self.device.clock.now() + self.device.pace
            if job.next_message():
                self._jobs.append(job)
        except Exception as error:  # noqa: BLE001 - the instrument or the link has failed; raised where its client waits
            job.link.error = error
        self._under_way = None
        self._wake()

    # --- waiting ---

    def wall_duration_until(self, instant: float) -> float:
        """How long until this time of the bench [s] by the clock on the wall; a clock that jumps is there at once."""
        clock = self.device.clock
        missing = instant - clock.now()
        if missing <= 0:
            return 0.0
        if (wait := clock.wall_duration(missing)) > _NO_WAIT:
            return wait
        if clock.jumps:
            clock.sleep(missing)
        return 0.0

    def stir(self) -> None:
        """Something happened to the instrument: all that waits for it looks again."""
        self._wake()
        # a turn that is due stays: a client that stirs without end would put it off
        if self._next_turn and self._next_turn.when() > asyncio.get_running_loop().time():
            self._come_again(0.0)

    def _wake(self) -> None:
        if self._stirred:
            self._stirred.set_result(None)
            self._stirred = None

    async def stirred(self, within: float | None) -> None:
        """Wait until something happens, at most so long by the clock on the wall [s]."""
        if self._stirred is None:
            self._stirred = asyncio.get_running_loop().create_future()
        await asyncio.wait([self._stirred], timeout=within)


class Link:
    """One client's link to an instrument; whatever is done with it raises LinkLost when a fault has cut it.

    session: see :class:`instruments.virtual.bench.session.Session`; to be used from the event loop only;
    messages_done: how many messages the instrument has worked on; error: that ended the work on one of them.
    """

    def __init__(self, station: Station, *, stream: bool = False) -> None:
        self.station, self.closed, self.messages_done = station, False, 0
        self.session = self._new(stream=stream)
        self.error: Exception | None = None

    def _new(self, *, stream: bool) -> Session:
        return self.station.bus.session(self.station.device, stream=stream)

    # --- to the instrument ---

    async def write(
        self,
        data: bytes,
        *,
        end: bool = True,
        within: float | None = None,
        given_up: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Bytes for the instrument, once it has worked on those before; see Session.write.

        The instrument goes on with them when this has returned.  Returns False if they were not taken within this
        time [s].
        """
        self.station.bus.heard()
        if not self.is_abort(data, end=end) and not await self.finished(within, given_up=given_up):
            return False
        self._raise_error()
        job = Job(self, self.session.messages(data, end=end))
        if job.next_message():
            self.station.add(job)
        return True

    def _raise_error(self) -> None:
        if self.error:
            raise self.error

    def is_abort(self, data: bytes, *, end: bool = True) -> bool:
        """Whether these bytes end what the instrument works on; see Session.is_abort."""
        return self.station.working and not self.kept_out() and self.session.bytes_are_abort(data, end=end)

    def busy(self) -> bool:
        """Whether the instrument has not yet worked on everything."""
        return any(job.link is self for job in self.station.jobs())

    async def finished(self, within: float | None = None, *, given_up: Callable[[], bool] = lambda: False) -> bool:
        """Wait until the instrument has worked on everything; whether that is so within this time [s]."""
        return await self._comes(lambda: not self.busy(), within, given_up)

    async def linger(self, ended: Callable[[], Awaitable[object]]) -> None:
        """Wait for the end of what a client has sent that says no more, as long as the instrument goes on with it.

        On a stream an answer is waited for, too: the client may have closed its own direction alone.
        """
        done = -1
        while done < self.messages_done or self._answers_later():
            done = self.messages_done
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(LINGER):
                    await ended()
                    return

    def _answers_later(self) -> bool:
        return self.session.stream and 0 < (self.due() or 0.0) < INFINITY

    async def caught_up(self) -> None:
        """Let the instrument do what has gone on while nobody asked."""
        work = self.session.catch_up()
        while self.session.go_on(work):
            await asyncio.sleep(0)  # the others' turn

    def trigger(self) -> None:
        """The interface's trigger message."""
        self.session.trigger()
        self.station.stir()

    def clear(self) -> None:
        """Device clear; a client that is kept out clears what is its own, and the instrument works on."""
        self.station.drop(self)
        if self.kept_out():
            self.session = self._new(stream=self.session.stream)
        else:
            self.session.clear()
        self.station.stir()

    def interrupted(self) -> None:
        """The client asked anew before it had read the last answer: told in the error queue."""
        with self.session.lock:
            self.station.device.parser.report(ScpiError(-410))

    def close(self) -> None:
        """The client is gone, and its lock with it."""
        self.closed = True
        self.station.drop(self)
        self.session.close()
        self.station.stir()

    # --- from the instrument ---

    def due(self) -> float | None:
        """How long until bytes are there [s] by the clock on the wall; None: none are under way."""
        self._raise_error()
        instant = self.session.ready()
        if instant is None:
            return None
        return instant if instant >= INFINITY else self.station.wall_duration_until(instant)

    def answers_wait(self) -> bool:
        """Whether answers are under way, or wait to be taken."""
        with contextlib.suppress(LinkLost):
            return self.session.ready() is not None
        return False

    async def answered(self, within: float | None = None, *, given_up: Callable[[], bool] = lambda: False) -> bool:
        """Wait until bytes are there; whether they are, within this time by the clock on the wall [s].

        given_up: looked at whenever something happened to the instrument.
        """
        due: float | None = None

        def there() -> bool:
            nonlocal due
            due = self.due()
            return due == 0.0

        return await self._comes(there, within, given_up, lambda: due)

    def take(self, count: int, *, until: bytes = b"") -> tuple[bytes, bool]:
        """At most count bytes of what is there, and whether the answer ends with them; see Session.take."""
        taken = self.session.take(count, until=until)
        self.station.stir()
        return taken

    def quiet(self) -> bool:
        """Whether the instrument has nothing to do for this client, and no answer is under way."""
        return not self.busy() and self.due() is None

    def status_byte(self, *, unread: bool = False) -> int:
        """What a serial poll gives.  unread: an answer is on its way to the client, and not read yet."""
        with self.session.lock:
            return self.station.device.status_byte(message_available=True) if unread else self.session.status_byte()

    # --- locks ---

    def kept_out(self) -> bool:
        """Whether another client has locked the instrument."""
        return self.session.hold.keeps_out(self.session)

    def holds(self) -> bool:
        """Whether this client has locked the instrument, alone or with others."""
        return any(holder is self.session for holder in self.session.hold.holders)

    async def turn(self, within: float | None = None, *, given_up: Callable[[], bool] = lambda: False) -> bool:
        """Wait until nobody else has the instrument locked; whether that is so within this time [s]."""
        return await self._comes(lambda: not self.kept_out(), within, given_up)

    async def lock(self, key: str | None, within: float) -> bool:
        """Lock the instrument, alone or with all that know the key; whether that was possible in this time [s]."""
        return await self._comes(lambda: self.session.hold.take(self.session, key), within, lambda: False)

    def unlock(self) -> None:
        """Give the lock up."""
        self.session.hold.let_go(self.session)
        self.station.stir()

    async def _comes(
        self,
        there: Callable[[], bool],
        within: float | None,
        given_up: Callable[[], bool],
        next_look: Callable[[], float | None] = lambda: _LOOK_AGAIN,
    ) -> bool:
        """Wait until something is there; whether it is, within this time by the clock on the wall [s].

        It is looked at whenever something happened to the instrument, and after `next_look` [s]; None: only then.
        """
        loop = asyncio.get_running_loop()  # whose timers are waited for, so it is its time that counts
        end = None if within is None else loop.time() + within
        while not self.closed:
            if there():
                return True
            left = None if end is None else end - loop.time()
            if given_up() or (left is not None and left <= 0):
                return False
            await self.station.stirred(min((wait for wait in (next_look(), left) if wait is not None), default=None))
        return False


async def first_of(*jobs: Coroutine[None, None, object]) -> None:
    """Do these at once until one of them ends; the others are given up, and its error is raised."""
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


class Listener:
    """A listening TCP socket, and a conversation with everyone who connects, up to a number of them.

    port: known once it is open.
    """

    def __init__(self, station: Station, talk: Conversation, *, most: int = MOST_CLIENTS) -> None:
        self._station, self._talk, self._most = station, talk, most
        self._listening: socket.socket | None = None
        self._accepting: asyncio.Task[None] | None = None
        self._talks: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self.port = 0

    async def open(self, host: str, port: int) -> None:
        """Listen at this address of the machine; port 0: one that is free.  Raises OSError."""
        self._listening = socket.create_server((host, port), family=socket.AF_INET, backlog=self._most)
        self._listening.settimeout(0)
        self.port = self._listening.getsockname()[1]
        self._accepting = asyncio.ensure_future(self._accept(self._listening))

    async def _accept(self, listening: socket.socket) -> None:
        # asyncio's own server, closed while somebody connects, waits for ever (3.12) or stumbles (3.13)
        loop = asyncio.get_running_loop()
        while True:
            try:
                connection, _ = await loop.sock_accept(listening)
                self._connected(*await asyncio.open_connection(sock=connection))
            except OSError:  # gone already, or this process has too much open
                await asyncio.sleep(_LOOK_AGAIN)

    def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            welcome = len(self._talks) < self._most and self._station.bus.reachable(self._station.device)
        except Exception:
            log.exception("a connection could not be taken; the next ones can")
            welcome = False
        if not welcome:
            writer.transport.abort()
            return
        task = asyncio.ensure_future(self._conversation(reader, writer))
        self._talks[task] = writer
        task.add_done_callback(self._talks.pop)

    async def _conversation(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            # a client whose machine was switched off does not say so
            writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            await self._talk(reader, writer)
        except (OSError, EOFError, Disconnected, LinkLost):
            pass  # the client is gone
        except Exception:
            # one client's trouble is not that of the others
            log.exception("a virtual instrument failed; the connection is closed")
        finally:
            writer.close()

    async def close(self) -> None:
        """Listen no longer, and end all conversations."""
        if self._accepting is None or self._listening is None:
            return
        self._accepting.cancel()
        await asyncio.wait([self._accepting])
        self._listening.close()
        talks = dict(self._talks)
        for task, writer in talks.items():
            task.cancel()
            writer.transport.abort()
        await asyncio.gather(*talks, *(writer.wait_closed() for writer in talks.values()), return_exceptions=True)
