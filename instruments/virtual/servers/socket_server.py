"""Instruments over bare TCP: a line feed ends a message, answers follow each other (port 5025 of real ones)."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Protocol

from instruments.virtual.servers.clients import CHUNK, Link, Listener, first_of

if TYPE_CHECKING:
    from instruments.virtual.servers.clients import ServedInstrument


class Wire(Protocol):
    """A two-way stream of bytes."""

    async def read(self) -> bytes:
        """Wait for bytes, and return them, at least one; none: the stream has ended."""

    async def write(self, data: bytes) -> None:
        """Send bytes; wait while the other side takes none."""


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


def socket_listener(instrument: ServedInstrument) -> Listener:
    """Return a listener that serves an instrument over bare TCP."""

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await converse(instrument, TcpWire(reader, writer))

    return Listener(instrument, talk)


async def converse(instrument: ServedInstrument, wire: Wire) -> None:
    """Let a client talk to an instrument until it goes away.

    A message waits until the answers to those before it have been sent, so a flood of questions piles up no answers.
    While a client of HiSLIP or VXI-11 has the instrument locked, all messages that come here wait.
    """
    link = Link(instrument, stream=True)
    received: asyncio.Queue[bytes] = asyncio.Queue(1)

    async def receive() -> None:
        while data := await wire.read():
            await received.put(data)
        await link.linger(received.join)  # a client that sends no more may still want to read: printf '*IDN?\n' | nc

    async def work() -> None:
        while True:
            await link.write(await received.get())
            while await link.wait_for_answer(give_up=link.is_idle):
                await wire.write(link.take(CHUNK)[0])
            received.task_done()

    try:
        await first_of(receive(), work())
    finally:
        link.close()
