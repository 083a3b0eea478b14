"""Instruments over bare TCP: a line feed ends a message, answers follow each other (port 5025 of real ones)."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Protocol

from instruments.virtual.servers.station import CHUNK, Link, Listener, first_of

if TYPE_CHECKING:
    from instruments.virtual.servers.station import Station


class Wire(Protocol):
    """A two-way stream of bytes."""

    async def read(self) -> bytes:
        """What has come, at least a byte; nothing: it was the end."""

    async def write(self, data: bytes) -> None:
        """Send; waits while the other side takes nothing."""


class TcpWire:
    """A TCP connection."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    async def read(self) -> bytes:
        """See :class:`Wire`."""
        return await self._reader.read(1 << 16)

    async def write(self, data: bytes) -> None:
        """See :class:`Wire`."""
        self._writer.write(data)
        await self._writer.drain()


def socket_listener(station: Station) -> Listener:
    """Offers an instrument over bare TCP."""

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await converse(station, TcpWire(reader, writer))

    return Listener(station, talk)


async def converse(station: Station, wire: Wire) -> None:
    """Let a client talk to an instrument until it goes away.

    A message waits until the answers to those before it have been sent: so no flood of questions piles up answers.
    An instrument that a client of HiSLIP or VXI-11 has locked waits with everything that comes here.
    """
    link = Link(station, stream=True)
    received: asyncio.Queue[bytes] = asyncio.Queue(1)

    async def receive() -> None:
        while data := await wire.read():
            await received.put(data)
        await link.linger(received.join)  # a client that sends no more may still want to read: printf '*IDN?\n' | nc

    async def work() -> None:
        while True:
            await link.write(await received.get())
            while await link.answered(given_up=link.quiet):
                await wire.write(link.take(CHUNK)[0])
            received.task_done()

    try:
        await first_of(receive(), work())
    finally:
        link.close()
