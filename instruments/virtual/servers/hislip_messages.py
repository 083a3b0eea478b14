"""HiSLIP's messages: their content, and the connections that carry them.

Source: IVI-6.1; section numbers are revision 2.0's.
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

from instruments.virtual.servers.clients import Disconnected

if TYPE_CHECKING:
    import asyncio

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
                raise Disconnected
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
        raise Disconnected
