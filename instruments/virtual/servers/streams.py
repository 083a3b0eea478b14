"""Instruments over a stream of bytes: bare TCP (port 5025 of real ones), a pseudo-terminal, HTTP.

On a stream a line feed ends a message, and answers follow each other.  A pseudo-terminal has no baud rate and no
parity, and Linux refuses 7 data bits there.  Serial instruments are served over TCP, too
(``ASRLsocket://host:port::INSTR``), where such settings mean nothing.
"""

import asyncio
import contextlib
import os
from collections.abc import Awaitable, Callable

from instruments.virtual.bench.session import LinkLost
from instruments.virtual.servers import clients

try:
    import pty
    import tty
except ImportError:  # Windows
    HAS_PSEUDO_TERMINALS = False
else:
    HAS_PSEUDO_TERMINALS = True


def socket_listener(instrument: clients.ServedInstrument) -> clients.Listener:
    """Return a listener that serves an instrument over bare TCP."""

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async def send(data: bytes) -> None:
            writer.write(data)
            await writer.drain()

        await converse(instrument, lambda: reader.read(1 << 16), send)

    return clients.Listener(instrument, talk)


async def converse(
    instrument: clients.ServedInstrument, read: Callable[[], Awaitable[bytes]], send: Callable[[bytes], Awaitable[None]]
) -> None:
    """Let a client talk to an instrument until it goes away.

    A message waits until the answers to those before it have been sent, so a flood of questions piles up no answers.
    While a client of HiSLIP or VXI-11 has the instrument locked, all messages that come here wait.

    Args:
        instrument: to talk to.
        read: waits for bytes, at least one; returns none where the stream has ended.
        send: sends bytes; waits while the other side takes none.
    """
    link = clients.Link(instrument, stream=True)
    received: asyncio.Queue[bytes] = asyncio.Queue(1)

    async def receive() -> None:
        while data := await read():
            await received.put(data)
        await link.linger(received.join)  # a client that sends no more may still want to read: printf '*IDN?\n' | nc

    async def work() -> None:
        while True:
            await link.write(await received.get())
            while await link.wait_for_answer(give_up=link.is_idle):
                await send(link.take(clients.CHUNK)[0])
            received.task_done()

    try:
        await clients.first_of(receive(), work())
    finally:
        link.close()


class PseudoTerminal:
    """The far end of a serial line whose near end is a device file, for any program that opens serial ports.

    One client at a time, as with a cable.

    Attributes:
        name: of the device file.
    """

    def __init__(self, instrument: clients.ServedInstrument) -> None:
        self._instrument = instrument
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)  # no echo, no conversion of line ends
        os.set_blocking(self._master, False)
        self.name = os.ttyname(self._slave)
        self._talk: asyncio.Task[None] | None = None

    def open(self) -> None:
        """Begin to listen, on the running event loop."""
        self._talk = asyncio.ensure_future(self._serve())

    async def _serve(self) -> None:
        """Serve one client after the other: the cable stays plugged in, whatever becomes of a conversation."""
        while True:
            try:
                await converse(self._instrument, self.read, self.write)
            except LinkLost:
                pass
            except Exception:  # noqa: BLE001 - logged; the next client shall find the line alive
                clients.log.exception("a virtual instrument failed; its serial line begins again")

    async def read(self) -> bytes:
        """Wait for bytes, and return them."""
        loop, come = asyncio.get_running_loop(), asyncio.Event()
        loop.add_reader(self._master, come.set)
        try:
            await come.wait()
        finally:
            loop.remove_reader(self._master)
        with contextlib.suppress(BlockingIOError):
            return os.read(self._master, 4096)
        return await self.read()

    async def write(self, data: bytes) -> None:
        """Send bytes; where the line's buffer is full, the rest is lost, as without flow control."""
        with contextlib.suppress(BlockingIOError):
            while data:
                data = data[os.write(self._master, data) :]

    async def close(self) -> None:
        """End the conversation, and remove the device file."""
        if self._talk:
            self._talk.cancel()
            await asyncio.gather(self._talk, return_exceptions=True)
        for end in (self._master, self._slave):
            os.close(end)


def http_listener(instrument: clients.ServedInstrument) -> clients.Listener:
    """Return a listener that serves an instrument over HTTP, as an app on a phone: a connection for each request."""

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with asyncio.timeout(clients.FIRST_WORDS):
                head = await reader.readuntil(b"\r\n\r\n")
        except (TimeoutError, asyncio.LimitOverrunError, asyncio.IncompleteReadError):
            raise clients.Disconnected from None
        link = clients.Link(instrument)
        try:
            await link.write(head.partition(b"\r\n")[0])
            ended = False
            while not ended and await link.wait_for_answer(give_up=link.is_idle):
                data, ended = link.take(clients.CHUNK)
                writer.write(data)
                await writer.drain()
        finally:
            link.close()

    return clients.Listener(instrument, talk)
