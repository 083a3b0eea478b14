"""A port mapper: where the programs of one host listen, asked at port 111 of it over TCP and UDP.

Programs that know an instrument by its host alone (``TCPIP::192.168.1.30::INSTR``, python-vxi11, ds1054z) ask it for
the port of VXI-11's core channel.  Nothing can be registered here, and no call is passed on.  Source: RFC 1833,
section 3, version 2.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from typing import TYPE_CHECKING

from instruments.virtual.servers.rpc import Program, answer, serve
from instruments.virtual.servers.station import Disconnected, Listener
from instruments.virtual.servers.xdr import Reader, packed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from instruments.virtual.servers.rpc import Procedure
    from instruments.virtual.servers.station import Station

#: Program number, version and the port at which it listens (RFC 1833, section 3); protocol numbers of TCP and UDP.
PROGRAM, VERSION, PORT = 100000, 2, 111
TCP, UDP = 6, 17

#: The longest call taken [bytes]: 40 and its credentials and verifier of 400 each (RFC 5531, 8.2), and some room.
_LONGEST = 1024

#: How long nothing is read after an error of the system [s].
_AFTER_AN_ERROR = 0.05


class PortMapper:
    """The port mapper of one host, over TCP and UDP at the same port.

    programs: (number, version, protocol) → port.
    """

    def __init__(self, station: Station, programs: Mapping[tuple[int, int, int], int]) -> None:
        self._programs = dict(programs)
        self._program = Program(PROGRAM, VERSION, self._procedures(), longest=_LONGEST)
        self._listener = Listener(station, self._talk)
        self._datagrams: socket.socket | None = None
        self._answering: asyncio.Task[None] | None = None
        self.port = 0

    def _procedures(self) -> Mapping[int, Procedure]:
        return {1: self._refuse, 2: self._refuse, 3: self._get_port, 4: self._dump}

    async def open(self, host: str, port: int) -> None:
        """Listen at this address of the machine; port 0: one that is free.  Raises OSError."""
        await self._listener.open(host, port)
        self.port = self._listener.port
        self._datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._datagrams.settimeout(0)
        self._datagrams.bind((host, self.port))
        self._programs |= {(PROGRAM, VERSION, TCP): self.port, (PROGRAM, VERSION, UDP): self.port}
        self._answering = asyncio.ensure_future(self._answer_datagrams(self._datagrams))

    async def close(self) -> None:
        """Listen no longer."""
        await self._listener.close()
        if self._answering:
            self._answering.cancel()
            await asyncio.gather(self._answering, return_exceptions=True)
        if self._datagrams:
            self._datagrams.close()

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await serve(self._program, reader, writer)

    async def _answer_datagrams(self, datagrams: socket.socket) -> None:
        """Answer one datagram after the other; what is no call is dropped, and the system drops what it cannot hold."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                # of a longer one the rest is lost, and what is left is no call
                record, client = await loop.sock_recvfrom(datagrams, _LONGEST)
                with contextlib.suppress(Disconnected):
                    await loop.sock_sendto(datagrams, await answer(self._program, record), client)
                await asyncio.sleep(0)  # the instruments' turn
            except OSError:  # on Windows the last client's port was closed; elsewhere a network that is down
                await asyncio.sleep(_AFTER_AN_ERROR)

    # --- procedures (RFC 1833, 3.2) ---

    async def _refuse(self, parameters: Reader) -> bytes:
        """SET and UNSET: no program is registered here by others."""
        parameters.numbers(4)
        return packed(0)

    async def _get_port(self, parameters: Reader) -> bytes:
        """The port of a program, 0 where it is none of this host; the fourth number, a port, is not looked at."""
        program, version, protocol, _ = parameters.numbers(4)
        return packed(self._programs.get((program, version, protocol), 0))

    async def _dump(self, parameters: Reader) -> bytes:
        """A list: 1 before each entry, 0 at the end."""
        entries = (packed(1, *program, port) for program, port in self._programs.items())
        return b"".join(entries) + packed(0)
