"""Serial instruments: over TCP (``ASRLsocket://host:port::INSTR``) and, where there are any, a pseudo-terminal.

A pseudo-terminal has no baud rate and no parity, and Linux refuses 7 data bits there; over TCP they mean nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
from typing import TYPE_CHECKING

from instruments.virtual.bench.session import LinkLost
from instruments.virtual.servers.socket_server import converse
from instruments.virtual.servers.station import log

try:
    import pty
    import tty
except ImportError:  # Windows
    HAS_PSEUDO_TERMINALS = False
else:
    HAS_PSEUDO_TERMINALS = True

if TYPE_CHECKING:
    from instruments.virtual.servers.station import Station


class PseudoTerminal:
    """The far end of a serial line whose near end is a device file, for any program that opens serial ports.

    name: of the device file.  One client at a time, as with a cable.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)  # no echo, no line ends turned into others
        os.set_blocking(self._master, False)
        self.name = os.ttyname(self._slave)
        self._talk: asyncio.Task[None] | None = None

    def open(self) -> None:
        """Begin to listen; needs a running event loop."""
        self._talk = asyncio.ensure_future(self._serve())

    async def _serve(self) -> None:
        """The cable stays plugged in, whatever happens to those who talk through it."""
        while True:
            try:
                await converse(self._station, self)
            except LinkLost:
                pass
            except Exception:  # noqa: BLE001 - told, and the next client shall find the line alive
                log.exception("a virtual instrument failed; its serial line begins anew")

    async def read(self) -> bytes:
        """What has come; see :class:`instruments.virtual.servers.socket_server.Wire`."""
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
        """Send; what nobody fetches is lost when the line's buffer is full, as without flow control."""
        with contextlib.suppress(BlockingIOError):
            while data:
                data = data[os.write(self._master, data) :]

    async def close(self) -> None:
        """The device file is gone afterwards."""
        if self._talk:
            self._talk.cancel()
            await asyncio.gather(self._talk, return_exceptions=True)
        for end in (self._master, self._slave):
            os.close(end)
