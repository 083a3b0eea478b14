"""Remote procedure calls over TCP: ONC RPC version 2 with record marking (RFC 5531), no authentication.

XDR is the form in which they write numbers and strings of bytes (RFC 4506).
"""

import asyncio
import struct
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum

from instruments.virtual.servers.clients import Disconnected, first_of

#: How many calls of a connection may wait while one is carried out.
MOST_CALLS = 4


class Garbage(Exception):
    """The bytes are not the values that were expected."""


class Reader:
    """Reads whole numbers and strings of bytes, each padded to a multiple of four bytes."""

    def __init__(self, data: bytes) -> None:
        self._data, self._place = data, 0

    def number(self) -> int:
        """Return an unsigned whole number of 32 bits (a signed one is not negative here).  Raises Garbage."""
        return int.from_bytes(self._bytes(4))

    def numbers(self, count: int) -> tuple[int, ...]:
        """Return the next `count` numbers.  Raises Garbage."""
        return tuple(self.number() for _ in range(count))

    def opaque(self) -> bytes:
        """Return a string of bytes.  Raises Garbage."""
        length = self.number()
        data = self._bytes(length)
        self._place += -length % 4
        return data

    def _bytes(self, count: int) -> bytes:
        data = self._data[self._place : self._place + count]
        if len(data) < count:
            raise Garbage
        self._place += count
        return data


def pack(*values: int | bytes) -> bytes:
    r"""Pack whole numbers and strings of bytes, the inverse of `Reader`.

    >>> pack(1, b"abc")
    b'\x00\x00\x00\x01\x00\x00\x00\x03abc\x00'
    """
    return b"".join(
        struct.pack("!I", value)
        if isinstance(value, int)
        else struct.pack("!I", len(value)) + value + b"\0" * (-len(value) % 4)
        for value in values
    )


class AcceptStatus(IntEnum):
    """What became of a call that was understood (RFC 5531, accept_stat)."""

    SUCCESS = 0
    PROGRAM_UNAVAILABLE = 1
    PROGRAM_MISMATCH = 2
    PROCEDURE_UNAVAILABLE = 3
    GARBAGE_ARGUMENTS = 4


#: The results of a procedure, given its parameters.
Procedure = Callable[[Reader], Awaitable[bytes]]


@dataclass(frozen=True)
class Program:
    """A program that can be called.

    Attributes:
        number: of the program.
        version: of the program.
        procedures: by their number.
        longest: bytes of a record, at most.
    """

    number: int
    version: int
    procedures: Mapping[int, Procedure]
    longest: int


async def read_record(reader: asyncio.StreamReader, longest: int) -> bytes:
    """Return the next record from its fragments (RFC 5531, 11).  Raises Disconnected: it is longer than any call."""
    record = bytearray()  # a record may come in a million fragments
    while True:
        head = int.from_bytes(await reader.readexactly(4))
        length = head & 0x7FFFFFFF
        if len(record) + length > longest:
            raise Disconnected
        record += await reader.readexactly(length)
        if head >> 31:
            return bytes(record)
        await asyncio.sleep(0)  # let the other clients have their turn


async def serve(program: Program, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Carry out the calls of a connection one after the other, until the client leaves."""
    calls: asyncio.Queue[bytes] = asyncio.Queue(MOST_CALLS)

    async def receive() -> None:
        while True:  # also while a call is carried out: the client may leave
            record = await read_record(reader, program.longest)
            if calls.full():
                raise Disconnected
            calls.put_nowait(record)

    async def work() -> None:
        while True:
            record = await answer(program, await calls.get())
            writer.write(struct.pack("!I", 1 << 31 | len(record)) + record)
            await writer.drain()

    await first_of(receive(), work())


async def answer(program: Program, record: bytes) -> bytes:
    """Carry out the call in a record.  Returns the record that answers it.  Raises Disconnected when it is no call."""
    parameters = Reader(record)
    try:
        number, kind, rpc_version, called, version, procedure = parameters.numbers(6)
        for _ in ("credentials", "verifier"):
            parameters.number()
            parameters.opaque()
    except Garbage:
        raise Disconnected from None
    if kind != 0 or rpc_version != 2:
        raise Disconnected
    try:
        results = await _carry_out(program, called, version, procedure, parameters)
    except Garbage:
        results = pack(AcceptStatus.GARBAGE_ARGUMENTS)
    return pack(number, 1, 0, 0, b"") + results  # a reply, accepted, without a verifier


async def _carry_out(program: Program, called: int, version: int, procedure: int, parameters: Reader) -> bytes:
    """Return the status of a call, and its results.  Raises Garbage."""
    if called != program.number:
        return pack(AcceptStatus.PROGRAM_UNAVAILABLE)
    if version != program.version:  # the first and the last version that there is
        return pack(AcceptStatus.PROGRAM_MISMATCH, program.version, program.version)
    if procedure == 0:  # by convention a ping
        return pack(AcceptStatus.SUCCESS)
    if procedure not in program.procedures:
        return pack(AcceptStatus.PROCEDURE_UNAVAILABLE)
    return pack(AcceptStatus.SUCCESS) + await program.procedures[procedure](parameters)
