"""Instruments over HiSLIP, the High-Speed LAN Instrument Protocol (port 4880 of real ones).

Source: IVI-6.1, revisions 1.0 and 2.0; section numbers are revision 2.0's.  Synchronized mode only, no secure
connections (both may be left out by a server), no service requests.  A client has two connections: on the synchronous
one go messages and answers, on the asynchronous one what must not wait behind them.
"""

import asyncio
import itertools
import struct
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from enum import Enum, IntEnum, auto
from typing import NamedTuple

from instruments.virtual.servers import clients

#: Prologue, message type, control code, message parameter, length of the payload (2.4).
HEADER = struct.Struct("!2sBBIQ")

#: The longest payload accepted [bytes].
LONGEST = 1 << 20


class Type(IntEnum):
    """Message types (2.5, table 4)."""

    INITIALIZE = 0
    INITIALIZE_RESPONSE = 1
    FATAL_ERROR = 2
    ERROR = 3
    ASYNC_LOCK = 4
    ASYNC_LOCK_RESPONSE = 5
    DATA = 6
    DATA_END = 7
    DEVICE_CLEAR_COMPLETE = 8
    DEVICE_CLEAR_ACKNOWLEDGE = 9
    ASYNC_REMOTE_LOCAL_CONTROL = 10
    ASYNC_REMOTE_LOCAL_RESPONSE = 11
    TRIGGER = 12
    INTERRUPTED = 13
    ASYNC_INTERRUPTED = 14
    ASYNC_MAXIMUM_MESSAGE_SIZE = 15
    ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE = 16
    ASYNC_INITIALIZE = 17
    ASYNC_INITIALIZE_RESPONSE = 18
    ASYNC_DEVICE_CLEAR = 19
    ASYNC_STATUS_QUERY = 21
    ASYNC_STATUS_RESPONSE = 22
    ASYNC_DEVICE_CLEAR_ACKNOWLEDGE = 23
    ASYNC_LOCK_INFO = 24
    ASYNC_LOCK_INFO_RESPONSE = 25


class Fatal(IntEnum):
    """Why a connection ends (6.2, table 14)."""

    UNIDENTIFIED = 0
    BAD_HEADER = 1
    NOT_BOTH_CHANNELS = 2
    BAD_INITIALIZATION = 3
    TOO_MANY_CLIENTS = 4


class Problem(IntEnum):
    """Why a message was not obeyed; the connection goes on (6.2, table 16)."""

    UNRECOGNIZED_TYPE = 1
    UNRECOGNIZED_CONTROL = 2
    TOO_LARGE = 4


class LockAnswer(IntEnum):
    """Answers to a request or release of the lock (6.5, tables 19 and 20)."""

    FAILURE = 0
    SUCCESS = 1
    SHARED_RELEASED = 2
    ERROR = 3


class Message(NamedTuple):
    """The fields of a header, and the payload."""

    type: int
    control: int = 0
    parameter: int = 0
    payload: bytes = b""

    def pack(self) -> bytes:
        """Return the bytes on the wire."""
        return HEADER.pack(b"HS", self.type, self.control, self.parameter, len(self.payload)) + self.payload


class Channel:
    """One of a client's two connections."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    async def receive(self) -> Message:
        """Receive the next message; refuse and skip one whose payload is too long.  Raises Disconnected."""
        while True:
            prologue, kind, control, parameter, length = HEADER.unpack(await self._reader.readexactly(HEADER.size))
            if prologue != b"HS":
                await self.fail(Fatal.BAD_HEADER, "a header begins with HS")
            if length <= LONGEST:
                return Message(kind, control, parameter, await self._reader.readexactly(length))
            self.send(Message(Type.ERROR, Problem.TOO_LARGE, payload=b"at most %d bytes" % LONGEST))
            await self.drain()
            await self._skip(length)

    async def _skip(self, length: int) -> None:
        while length:
            piece = await self._reader.read(min(length, 1 << 16))
            if not piece:
                raise clients.Disconnected
            length -= len(piece)

    def send(self, message: Message) -> None:
        """Send a short message, without waiting."""
        self._writer.write(message.pack())

    async def drain(self) -> None:
        """Wait until the client has taken what was sent."""
        await self._writer.drain()

    async def fail(self, code: Fatal, why: str) -> None:
        """Send FatalError with a reason, and end the connection.  Raises Disconnected."""
        self.send(Message(Type.FATAL_ERROR, code, payload=why.encode()))
        raise clients.Disconnected


#: The newest revision spoken here, and the longest payload sent until the client states its own limit [bytes].
VERSION, DEFAULT_PAYLOAD = 0x0200, 1 << 18

#: How long a client may take for its second channel [s], by the wall clock.
SECOND_CHANNEL = clients.FIRST_WORDS

#: The MessageID that a client begins with (3.1), the step from one message to the next, and where it wraps.
_FIRST_ID, _STEP, _IDS = 0xFFFFFF00, 2, 1 << 32


class State(Enum):
    """What a client and its session wait for (3.1.1, 6.12)."""

    #: Messages; no answer was sent whole that the client has not confirmed.
    IDLE = auto()
    #: The client's confirmation (RMT-delivered) that it has read the answer that was sent whole.
    SENT = auto()
    #: The end of a device clear.
    CLEARING = auto()


class Event(Enum):
    """What changes the state."""

    MESSAGE = auto()
    CONFIRMED = auto()
    SENT_PART = auto()
    SENT_END = auto()
    CLEAR = auto()
    CLEARED = auto()


#: The transitions of all states; an event that is missing changes nothing.
TRANSITIONS: dict[State, dict[Event, State]] = {
    State.IDLE: {Event.SENT_END: State.SENT, Event.CLEAR: State.CLEARING},
    State.SENT: {
        Event.MESSAGE: State.IDLE,  # rule 2: the client has not read the answer, it was interrupted
        Event.CONFIRMED: State.IDLE,
        Event.SENT_PART: State.IDLE,
        Event.CLEAR: State.CLEARING,
        Event.CLEARED: State.IDLE,
    },
    State.CLEARING: {Event.CLEARED: State.IDLE},
}


@dataclass(eq=False)
class Client:
    """One client: its link, its two channels, and the state of each."""

    link: clients.Link
    synchronous: Channel
    asynchronous: Channel | None = None  # None until the client has opened it
    both_connected: asyncio.Event = field(default_factory=asyncio.Event)
    synchronous_ended: asyncio.Event = field(default_factory=asyncio.Event)  # no more messages come there
    gone: asyncio.Event = field(default_factory=asyncio.Event)
    max_payload: int = DEFAULT_PAYLOAD
    state: State = State.IDLE
    received: int = _FIRST_ID - _STEP  # MessageID of the last message received
    answering: int = 0  # MessageID that the answers under way belong to
    lock_request: asyncio.Task[None] | None = None
    shared: bool = False  # whether its lock is a shared one

    def is_clearing(self) -> bool:
        """Return whether the client has begun a device clear."""
        return self.state is State.CLEARING

    def _change_state(self, event: Event) -> None:
        self.state = TRANSITIONS[self.state].get(event, self.state)

    def _confirm(self, message: Message) -> None:
        """Note that the client has read the last answer, where its message says so (RMT-delivered)."""
        if message.control & 1:
            self._change_state(Event.CONFIRMED)

    # --- the synchronous channel ---

    async def listen(self) -> None:
        """Take messages for the instrument.  Ends by an error, when the client has left and all are worked on."""
        try:
            await self._receive_all()
        except EOFError:
            await self.link.linger(self.link.wait_until_done)
            raise
        finally:
            self.synchronous_ended.set()

    async def _receive_all(self) -> None:
        while True:
            message = await _next(self.synchronous)
            if message.type == Type.DEVICE_CLEAR_COMPLETE:
                self._acknowledge_clear()
            elif message.type in {Type.DATA, Type.DATA_END, Type.TRIGGER}:
                await self._handle(message)
            elif message.type in {Type.FATAL_ERROR, Type.ERROR}:
                if message.type == Type.FATAL_ERROR:
                    raise clients.Disconnected
            else:
                self.refuse(self.synchronous, message)

    async def _handle(self, message: Message) -> None:
        if self.asynchronous is None:
            await self.synchronous.fail(Fatal.NOT_BOTH_CHANNELS, "the asynchronous channel is missing")
        if not await self._wait_for_turn(message):
            return
        self.received = message.parameter
        self._confirm(message)
        if self.state is State.SENT:  # 3.1.1, rule 2: no message to the client
            self.link.report_interrupted()
        self._change_state(Event.MESSAGE)
        if message.type == Type.TRIGGER:
            self.link.trigger()
            return
        end = message.type == Type.DATA_END
        if end:
            if self.link.seconds_until_ready() is not None:  # rule 1: the session drops the answer
                await self._send_interrupted(message.parameter)
                if self.is_clearing():  # the client has begun it during the send
                    return
            self.answering = message.parameter
        await self.link.write(message.payload, end=end)

    async def _wait_for_turn(self, message: Message) -> bool:
        """Wait until the instrument may take a message.  Returns False where a device clear ends the wait."""
        await self.link.wait_unlocked(give_up=self.is_clearing)
        if not self.link.is_abort(message.payload, end=message.type == Type.DATA_END):
            await self.link.wait_until_done(give_up=self.is_clearing)
        return not self.is_clearing()

    async def _send_interrupted(self, number: int) -> None:
        """Send Interrupted on both channels, the asynchronous one first (6.11, table 30)."""
        assert self.asynchronous
        self.asynchronous.send(Message(Type.ASYNC_INTERRUPTED, parameter=number))
        self.synchronous.send(Message(Type.INTERRUPTED, parameter=number))
        await self.asynchronous.drain()

    def _acknowledge_clear(self) -> None:
        """End a device clear: both sides have dropped what was under way (6.12).

        The answer says synchronized mode, whichever mode the client prefers.
        """
        self._change_state(Event.CLEARED)
        self.received = _FIRST_ID - _STEP
        self.synchronous.send(Message(Type.DEVICE_CLEAR_ACKNOWLEDGE))

    async def answer(self) -> None:
        """Send answers when they are ready.  Ends by an error, when the client has left."""
        while await self.link.wait_for_answer():
            data, end = self.link.take(self.max_payload)
            self.synchronous.send(Message(Type.DATA_END if end else Type.DATA, parameter=self.answering, payload=data))
            self._change_state(Event.SENT_END if end else Event.SENT_PART)
            await self.synchronous.drain()

    # --- the asynchronous channel ---

    async def listen_asynchronous(self) -> None:
        """Handle the messages that must not wait behind others.  Ends by an error, when the client has left."""
        assert self.asynchronous
        try:
            while True:
                message = await _next(self.asynchronous)
                if message.type == Type.ASYNC_STATUS_QUERY:
                    await self.link.catch_up()
                _ASYNC_HANDLERS.get(message.type, Client.refuse)(self, self.asynchronous, message)
        finally:
            if self.lock_request:
                self.lock_request.cancel()

    def negotiate_size(self, channel: Channel, message: Message) -> None:
        """AsyncMaximumMessageSize: note the client's limit and answer with ours (6.10)."""
        wanted = int.from_bytes(message.payload)
        # some VISA libraries count the header as part of the size, some do not; the smaller limit suits both
        self.max_payload = min(max(wanted - HEADER.size, 1), LONGEST)
        channel.send(Message(Type.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE, payload=LONGEST.to_bytes(8)))

    def clear(self, channel: Channel, message: Message) -> None:
        """AsyncDeviceClear: drop what comes on the synchronous channel until the clear ends there (6.12)."""
        self._change_state(Event.CLEAR)
        self.link.clear()
        channel.send(Message(Type.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE))

    def send_status(self, channel: Channel, message: Message) -> None:
        """AsyncStatusQuery: send the status byte; 6.14.1 says when its bit MAV is set.

        A query whose MessageID is not the last message's comes too early; pyvisa-py 0.8 sends the next message's.
        """
        self._confirm(message)
        known = message.parameter in {self.received, (self.received + _STEP) % _IDS}
        unread = self.state is State.SENT and known
        channel.send(Message(Type.ASYNC_STATUS_RESPONSE, self.link.status_byte(unread=unread)))

    def lock(self, channel: Channel, message: Message) -> None:
        """AsyncLock: request or release the lock (6.5)."""
        if message.control > 1:
            channel.send(Message(Type.ERROR, Problem.UNRECOGNIZED_CONTROL))
        elif message.control == 0:
            channel.send(Message(Type.ASYNC_LOCK_RESPONSE, self._release()))
        elif self.link.has_lock() or (self.lock_request and not self.lock_request.done()):
            channel.send(Message(Type.ASYNC_LOCK_RESPONSE, LockAnswer.ERROR))
        else:
            key = message.payload.decode("latin-1")[:256] or None
            self.lock_request = asyncio.ensure_future(self._request(channel, key, message.parameter / 1000))

    async def _request(self, channel: Channel, key: str | None, timeout: float) -> None:
        granted = await self.link.lock(key, timeout)
        self.shared = granted and key is not None
        channel.send(Message(Type.ASYNC_LOCK_RESPONSE, LockAnswer.SUCCESS if granted else LockAnswer.FAILURE))

    def _release(self) -> LockAnswer:
        if not self.link.has_lock():
            return LockAnswer.ERROR
        self.link.unlock()
        return LockAnswer.SHARED_RELEASED if self.shared else LockAnswer.SUCCESS

    def send_lock_info(self, channel: Channel, message: Message) -> None:
        """AsyncLockInfo: whether the lock is exclusive, and how many clients have it (6.6)."""
        client_lock = self.link.session.client_lock
        alone = bool(client_lock.holders) and client_lock.key is None
        channel.send(Message(Type.ASYNC_LOCK_INFO_RESPONSE, int(alone), len(client_lock.holders)))

    def refuse(self, channel: Channel, message: Message) -> None:
        """Answer a type that is unknown, or unknown on this channel, with Error (6.2)."""
        channel.send(Message(Type.ERROR, Problem.UNRECOGNIZED_TYPE, payload=b"message type %d" % message.type))

    def ignore(self, channel: Channel, message: Message) -> None:
        """Error: nothing to do, as no message of ours could be sent in another way."""

    def disconnect(self, channel: Channel, message: Message) -> None:
        """FatalError: the client has ended the session.  Raises Disconnected."""
        raise clients.Disconnected

    def go_remote(self, channel: Channel, message: Message) -> None:
        """AsyncRemoteLocalControl: confirm; there is no front panel to lock (6.9)."""
        channel.send(Message(Type.ASYNC_REMOTE_LOCAL_RESPONSE))


async def _next(channel: Channel) -> Message:
    """Return the next message, once the client has read its replies, so that unread replies do not pile up."""
    await channel.drain()
    await asyncio.sleep(0)  # many messages may have come at once: let the other clients have their turn
    return await channel.receive()


_ASYNC_HANDLERS: dict[int, Callable[[Client, Channel, Message], None]] = {
    Type.FATAL_ERROR: Client.disconnect,
    Type.ERROR: Client.ignore,
    Type.ASYNC_LOCK: Client.lock,
    Type.ASYNC_REMOTE_LOCAL_CONTROL: Client.go_remote,
    Type.ASYNC_MAXIMUM_MESSAGE_SIZE: Client.negotiate_size,
    Type.ASYNC_DEVICE_CLEAR: Client.clear,
    Type.ASYNC_STATUS_QUERY: Client.send_status,
    Type.ASYNC_LOCK_INFO: Client.send_lock_info,
}


class HislipServer:
    """Both channels of all clients of one instrument, on one port, whose only subaddress is hislip0."""

    def __init__(self, instrument: clients.ServedInstrument) -> None:
        self._instrument = instrument
        self._clients: dict[int, Client] = {}
        self._numbers = itertools.count(1)
        self.listener = clients.Listener(instrument, self._talk, most=2 * clients.MOST_CLIENTS)

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        channel = Channel(reader, writer)
        try:
            async with asyncio.timeout(clients.FIRST_WORDS):
                first = await channel.receive()
        except TimeoutError:
            return
        begin: dict[int, Callable[[Channel, Message], Awaitable[None]]] = {
            Type.INITIALIZE: self._serve_synchronous,
            Type.ASYNC_INITIALIZE: self._serve_asynchronous,
        }
        if first.type not in begin:
            await channel.fail(Fatal.BAD_INITIALIZATION, "a connection begins with Initialize or AsyncInitialize")
        await begin[first.type](channel, first)

    async def _serve_synchronous(self, channel: Channel, first: Message) -> None:
        """Serve a synchronous channel, from Initialize (6.1) on."""
        asked = first.payload.decode("latin-1").lower()
        if asked not in {"", "hislip0"}:
            await channel.fail(Fatal.BAD_INITIALIZATION, "the only subaddress here is hislip0")
        if len(self._clients) >= clients.MOST_CLIENTS:
            await channel.fail(Fatal.TOO_MANY_CLIENTS, f"at most {clients.MOST_CLIENTS} clients")
        number = next(number for number in (n % 0xFFFF for n in self._numbers) if number not in self._clients)
        client = self._clients[number] = Client(clients.Link(self._instrument), channel)
        version = min(first.parameter >> 16, VERSION)
        channel.send(Message(Type.INITIALIZE_RESPONSE, parameter=version << 16 | number))
        try:
            await clients.first_of(
                client.listen(), client.answer(), client.gone.wait(), _wait_for_second_channel(client)
            )
        finally:
            client.gone.set()
            client.link.close()
            del self._clients[number]

    async def _serve_asynchronous(self, channel: Channel, first: Message) -> None:
        """Serve an asynchronous channel, from AsyncInitialize on."""
        client = self._clients.get(first.parameter & 0xFFFF)
        if client is None or client.asynchronous is not None:
            await channel.fail(Fatal.BAD_INITIALIZATION, "no session with this number waits for its second channel")
            return
        client.asynchronous = channel
        client.both_connected.set()
        channel.send(Message(Type.ASYNC_INITIALIZE_RESPONSE))
        try:
            await clients.first_of(client.listen_asynchronous(), client.gone.wait())
        except (EOFError, OSError):
            # its last commands may wait in the synchronous channel
            await client.link.linger(client.synchronous_ended.wait)
            raise
        finally:
            client.gone.set()


async def _wait_for_second_channel(client: Client) -> None:
    """Return when the second channel does not come in time, else when the client has left."""
    try:
        async with asyncio.timeout(SECOND_CHANNEL):
            await client.both_connected.wait()
    except TimeoutError:
        return
    await client.gone.wait()
