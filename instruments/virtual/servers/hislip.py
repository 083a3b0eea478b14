"""Instruments over HiSLIP, the High-Speed LAN Instrument Protocol (port 4880 of real ones).

Source: IVI-6.1, revisions 1.0 and 2.0; section numbers are revision 2.0's.  Synchronized mode only, no secure
connections (both may be left out by a server), no service requests.  A client has two connections: on the synchronous
one go messages and answers, on the asynchronous one what must get through meanwhile.
"""

from __future__ import annotations

import asyncio
import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from instruments.virtual.servers.hislip_messages import (
    HEADER,
    LONGEST,
    Channel,
    Fatal,
    LockAnswer,
    Message,
    Problem,
    Type,
)
from instruments.virtual.servers.station import FIRST_WORDS, MOST_CLIENTS, Disconnected, Link, Listener, first_of

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from instruments.virtual.servers.station import Station

#: The newest revision spoken here, and the longest payload sent before the client has said what it takes [bytes].
VERSION, UNASKED = 0x0200, 1 << 18

#: How long a client may take for its second channel [s], as the clock on the wall tells.
SECOND_CHANNEL = FIRST_WORDS

#: The MessageID that a client begins with (3.1), and what one message differs from the next.
_FIRST_ID, _STEP, _IDS = 0xFFFFFF00, 2, 1 << 32


@dataclass(eq=False)
class Client:
    """One client: its link, its two channels, and where they stand with each other."""

    link: Link
    sync: Channel
    other: Channel | None = None  # the asynchronous one, once it is there
    joined: asyncio.Event = field(default_factory=asyncio.Event)
    heard_out: asyncio.Event = field(default_factory=asyncio.Event)  # nothing more comes on the synchronous one
    gone: asyncio.Event = field(default_factory=asyncio.Event)
    longest: int = UNASKED
    clearing: bool = False
    received: int = _FIRST_ID - _STEP  # MessageID of the last message that came
    answering: int = 0  # and of the one that the answers under way belong to
    rmt_expected: bool = False  # an answer was sent to its end, and the client has not said that it has read it
    locking: asyncio.Task[None] | None = None
    shared: bool = False  # the lock it has

    # --- the synchronous channel ---

    async def listen(self) -> None:
        """Messages for the instrument.  Ends by an error, when the client is gone and they have been worked on."""
        try:
            await self._take_all()
        except EOFError:
            await self.link.linger(self.link.finished)
            raise
        finally:
            self.heard_out.set()

    async def _take_all(self) -> None:
        while True:
            message = await _next(self.sync)
            if message.type == Type.DEVICE_CLEAR_COMPLETE:
                self._cleared()
            elif message.type in {Type.DATA, Type.DATA_END, Type.TRIGGER}:
                await self._take(message)
            elif message.type in {Type.FATAL_ERROR, Type.ERROR}:
                if message.type == Type.FATAL_ERROR:
                    raise Disconnected
            else:
                self.refuse(self.sync, message)

    async def _take(self, message: Message) -> None:
        if self.other is None:
            await self.sync.fatal(Fatal.NOT_BOTH_CHANNELS, "the asynchronous channel is missing")
        if not await self._let_in(message):
            return
        self.received = message.parameter
        if self.rmt_expected and not message.control & 1:  # 3.1.1, rule 2: the client is not told
            self.link.interrupted()
        self.rmt_expected = False
        if message.type == Type.TRIGGER:
            self.link.trigger()
            return
        end = message.type == Type.DATA_END
        if end:
            if self.link.due() is not None:  # rule 1; the session drops the answer
                await self._interrupt(message.parameter)
                if self.clearing:  # the client has begun a device clear meanwhile
                    return
            self.answering = message.parameter
        await self.link.write(message.payload, end=end)

    async def _let_in(self, message: Message) -> bool:
        """Wait until the instrument may take a message; whether it may: a device clear ends the wait."""
        await self.link.turn(given_up=lambda: self.clearing)
        if not self.link.is_abort(message.payload, end=message.type == Type.DATA_END):
            await self.link.finished(given_up=lambda: self.clearing)
        return not self.clearing

    async def _interrupt(self, number: int) -> None:
        """Both are told, the asynchronous channel first (6.11, table 30)."""
        assert self.other
        self.other.send(Message(Type.ASYNC_INTERRUPTED, parameter=number))
        self.sync.send(Message(Type.INTERRUPTED, parameter=number))
        await self.other.drain()

    def _cleared(self) -> None:
        """Both sides have dropped what was under way (6.12); synchronized mode, whatever the client would like."""
        self.clearing, self.rmt_expected, self.received = False, False, _FIRST_ID - _STEP
        self.sync.send(Message(Type.DEVICE_CLEAR_ACKNOWLEDGE))

    async def answer(self) -> None:
        """Send answers when they are ready.  Ends by an error, when the client is gone."""
        while await self.link.answered():
            data, end = self.link.take(self.longest)
            self.sync.send(Message(Type.DATA_END if end else Type.DATA, parameter=self.answering, payload=data))
            self.rmt_expected = end
            await self.sync.drain()

    # --- the asynchronous channel ---

    async def listen_aside(self) -> None:
        """What must get through meanwhile.  Ends by an error, when the client is gone."""
        assert self.other
        try:
            while True:
                message = await _next(self.other)
                if message.type == Type.ASYNC_STATUS_QUERY:
                    await self.link.caught_up()
                _ASIDE.get(message.type, Client.refuse)(self, self.other, message)
        finally:
            if self.locking:
                self.locking.cancel()

    def negotiate(self, channel: Channel, message: Message) -> None:
        """AsyncMaximumMessageSize: what the client takes, and what is taken here (6.10)."""
        wanted = int.from_bytes(message.payload)
        # a real VISA counts the header to the size, or not: with it, either is content
        self.longest = min(max(wanted - HEADER.size, 1), LONGEST)
        channel.send(Message(Type.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE, payload=LONGEST.to_bytes(8)))

    def clear(self, channel: Channel, message: Message) -> None:
        """AsyncDeviceClear: from now to its end on the other channel what comes there is dropped (6.12)."""
        self.clearing = True
        self.link.clear()
        channel.send(Message(Type.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE))

    def tell_status(self, channel: Channel, message: Message) -> None:
        """AsyncStatusQuery: the status byte; what makes its bit MAV is in 6.14.1.

        A query with a MessageID other than the last one's asks too early; pyvisa-py 0.8 sends the next one's.
        """
        if message.control & 1:
            self.rmt_expected = False
        known = message.parameter in {self.received, (self.received + _STEP) % _IDS}
        channel.send(Message(Type.ASYNC_STATUS_RESPONSE, self.link.status_byte(unread=self.rmt_expected and known)))

    def lock(self, channel: Channel, message: Message) -> None:
        """AsyncLock: a request, or a release (6.5)."""
        if message.control > 1:
            channel.send(Message(Type.ERROR, Problem.UNRECOGNIZED_CONTROL))
        elif message.control == 0:
            channel.send(Message(Type.ASYNC_LOCK_RESPONSE, self._release()))
        elif self.link.holds() or (self.locking and not self.locking.done()):
            channel.send(Message(Type.ASYNC_LOCK_RESPONSE, LockAnswer.ERROR))
        else:
            key = message.payload.decode("latin-1")[:256] or None
            self.locking = asyncio.ensure_future(self._request(channel, key, message.parameter / 1000))

    async def _request(self, channel: Channel, key: str | None, within: float) -> None:
        granted = await self.link.lock(key, within)
        self.shared = granted and key is not None
        channel.send(Message(Type.ASYNC_LOCK_RESPONSE, LockAnswer.SUCCESS if granted else LockAnswer.FAILURE))

    def _release(self) -> LockAnswer:
        if not self.link.holds():
            return LockAnswer.ERROR
        self.link.unlock()
        return LockAnswer.SHARED_RELEASED if self.shared else LockAnswer.SUCCESS

    def tell_locks(self, channel: Channel, message: Message) -> None:
        """AsyncLockInfo: whether somebody has it alone, and how many have it (6.6)."""
        hold = self.link.session.hold
        alone = bool(hold.holders) and hold.key is None
        channel.send(Message(Type.ASYNC_LOCK_INFO_RESPONSE, int(alone), len(hold.holders)))

    def refuse(self, channel: Channel, message: Message) -> None:
        """A type that is not known, or not on this channel (6.2)."""
        channel.send(Message(Type.ERROR, Problem.UNRECOGNIZED_TYPE, payload=b"message type %d" % message.type))

    def ignore(self, channel: Channel, message: Message) -> None:
        """Error: what the client did not like would not be said in another way."""

    def hang_up(self, channel: Channel, message: Message) -> None:
        """FatalError: the client is gone.  Raises Disconnected."""
        raise Disconnected

    def go_remote(self, channel: Channel, message: Message) -> None:
        """AsyncRemoteLocalControl: there is no front panel to lock (6.9)."""
        channel.send(Message(Type.ASYNC_REMOTE_LOCAL_RESPONSE))


async def _next(channel: Channel) -> Message:
    """The next message, once the client has read its replies: a flood that is never read piles up none of them."""
    await channel.drain()
    await asyncio.sleep(0)  # many messages may have come at once: the other clients' turn
    return await channel.receive()


_ASIDE: dict[int, Callable[[Client, Channel, Message], None]] = {
    Type.FATAL_ERROR: Client.hang_up,
    Type.ERROR: Client.ignore,
    Type.ASYNC_LOCK: Client.lock,
    Type.ASYNC_REMOTE_LOCAL_CONTROL: Client.go_remote,
    Type.ASYNC_MAXIMUM_MESSAGE_SIZE: Client.negotiate,
    Type.ASYNC_DEVICE_CLEAR: Client.clear,
    Type.ASYNC_STATUS_QUERY: Client.tell_status,
    Type.ASYNC_LOCK_INFO: Client.tell_locks,
}


class HislipServer:
    """Both channels of all clients of one instrument, on one port.  subaddress: the only one it knows."""

    def __init__(self, station: Station, *, subaddress: str = "hislip0") -> None:
        self._station, self._subaddress = station, subaddress
        self._clients: dict[int, Client] = {}
        self._numbers = itertools.count(1)
        self.listener = Listener(station, self._talk, most=2 * MOST_CLIENTS)

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        channel = Channel(reader, writer)
        try:
            async with asyncio.timeout(FIRST_WORDS):
                first = await channel.receive()
        except TimeoutError:
            return
        begin: dict[int, Callable[[Channel, Message], Awaitable[None]]] = {
            Type.INITIALIZE: self._serve,
            Type.ASYNC_INITIALIZE: self._serve_aside,
        }
        if first.type not in begin:
            await channel.fatal(Fatal.BAD_INITIALIZATION, "a connection begins with Initialize or AsyncInitialize")
        await begin[first.type](channel, first)

    async def _serve(self, channel: Channel, first: Message) -> None:
        """The synchronous channel, from Initialize (6.1) on."""
        asked = first.payload.decode("latin-1").lower()
        if asked not in {"", self._subaddress}:
            await channel.fatal(Fatal.BAD_INITIALIZATION, f"the only subaddress here is {self._subaddress}")
        if len(self._clients) >= MOST_CLIENTS:
            await channel.fatal(Fatal.TOO_MANY_CLIENTS, f"at most {MOST_CLIENTS} clients")
        number = next(number for number in (n % 0xFFFF for n in self._numbers) if number not in self._clients)
        client = self._clients[number] = Client(Link(self._station), channel)
        version = min(first.parameter >> 16, VERSION)
        channel.send(Message(Type.INITIALIZE_RESPONSE, parameter=version << 16 | number))
        try:
            await first_of(client.listen(), client.answer(), client.gone.wait(), _both_channels(client))
        finally:
            client.gone.set()
            client.link.close()
            del self._clients[number]

    async def _serve_aside(self, channel: Channel, first: Message) -> None:
        """The asynchronous channel, from AsyncInitialize on."""
        client = self._clients.get(first.parameter & 0xFFFF)
        if client is None or client.other is not None:
            await channel.fatal(Fatal.BAD_INITIALIZATION, "no session with this number waits for its second channel")
            return
        client.other = channel
        client.joined.set()
        channel.send(Message(Type.ASYNC_INITIALIZE_RESPONSE))
        try:
            await first_of(client.listen_aside(), client.gone.wait())
        except (EOFError, OSError):
            await client.link.linger(client.heard_out.wait)  # its last commands may wait in the other channel
            raise
        finally:
            client.gone.set()


async def _both_channels(client: Client) -> None:
    """Ends when the second channel does not come in time."""
    try:
        async with asyncio.timeout(SECOND_CHANNEL):
            await client.joined.wait()
    except TimeoutError:
        return
    await client.gone.wait()
