"""Serial instruments on a pseudo-terminal, where the system has them.

A pseudo-terminal has no baud rate and no parity, and Linux refuses 7 data bits there.  The same instruments are served
over TCP, too (``ASRLsocket://host:port::INSTR``), where such settings mean nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
from typing import TYPE_CHECKING

from instruments.virtual.bench.session import LinkLost
from instruments.virtual.servers.clients import log
from instruments.virtual.servers.socket_server import converse

try:
    import pty
    import tty
except ImportError:  # Windows
    HAS_PSEUDO_TERMINALS = False
else:
    HAS_PSEUDO_TERMINALS = True

if TYPE_CHECKING:
    from instruments.virtual.servers.clients import ServedInstrument


class PseudoTerminal:
    """The far end of a serial line whose near end is a device file, for any program that opens serial ports.

    One client at a time, as with a cable.

    Attributes:
        name: of the device file.
    """

    def __init__(self, instrument: ServedInstrument) -> None:
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
                await converse(self._instrument, self)
            except LinkLost:
                pass
            except Exception:  # noqa: BLE001 - logged; the next client shall find the line alive
                log.exception("a virtual instrument failed; its serial line begins again")

    async def read(self) -> bytes:
        """Wait for bytes, and return them; see :class:`instruments.virtual.servers.socket_server.Wire`."""
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
