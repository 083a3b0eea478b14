"""A port mapper: it answers, at port 111 of a host over TCP and UDP, at which port a program listens.

Programs that know an instrument by its host alone (``TCPIP::192.168.1.30::INSTR``, python-vxi11, ds1054z) ask it for
the port of VXI-11's core channel.  It registers no programs for others and forwards no calls.  Source: RFC 1833,
section 3, version 2.
"""

import asyncio
import contextlib
import socket
from collections.abc import Mapping

from instruments.virtual.servers.clients import Disconnected, Listener, ServedInstrument
from instruments.virtual.servers.rpc import Program, Reader, answer, pack, serve

#: Program number, version and the port at which it listens (RFC 1833, section 3); protocol numbers of TCP and UDP.
PROGRAM, VERSION, PORT = 100000, 2, 111
TCP, UDP = 6, 17

#: The longest call taken [bytes]: 40 and its credentials and verifier of 400 each (RFC 5531, 8.2), and some room.
_LONGEST = 1024

#: How long to wait after an error of the system before the next read [s].
_AFTER_AN_ERROR = 0.05


class PortMapper:
    """The port mapper of one host, over TCP and UDP at the same port.

    Args:
        instrument: whose server it belongs to.
        programs: (number, version, protocol) → port.
    """

    def __init__(self, instrument: ServedInstrument, programs: Mapping[tuple[int, int, int], int]) -> None:
        self._programs = dict(programs)
        procedures = {1: self._refuse, 2: self._refuse, 3: self._get_port, 4: self._dump}
        self._program = Program(PROGRAM, VERSION, procedures, longest=_LONGEST)
        self._listener = Listener(instrument, self._talk)
        self._datagrams: socket.socket | None = None
        self._answering: asyncio.Task[None] | None = None
        self.port = 0

    async def open(self, host: str, port: int) -> None:
        """Listen at this address of the machine; port 0: any free one.  Raises OSError."""
        await self._listener.open(host, port)
        self.port = self._listener.port
        self._datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._datagrams.settimeout(0)
        self._datagrams.bind((host, self.port))
        self._programs |= {(PROGRAM, VERSION, TCP): self.port, (PROGRAM, VERSION, UDP): self.port}
        self._answering = asyncio.ensure_future(self._answer_datagrams(self._datagrams))

    async def close(self) -> None:
        """Stop listening."""
        await self._listener.close()
        if self._answering:
            self._answering.cancel()
            await asyncio.gather(self._answering, return_exceptions=True)
        if self._datagrams:
            self._datagrams.close()

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await serve(self._program, reader, writer)

    async def _answer_datagrams(self, datagrams: socket.socket) -> None:
        """Answer the datagrams that are calls, one by one; the system drops those that its buffer cannot hold."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                # a longer datagram loses its end, and the rest is no call
                record, client = await loop.sock_recvfrom(datagrams, _LONGEST)
                with contextlib.suppress(Disconnected):
                    await loop.sock_sendto(datagrams, await answer(self._program, record), client)
                await asyncio.sleep(0)  # let the instruments have their turn
            except OSError:  # on Windows the last client closed its port; elsewhere the network is down
                await asyncio.sleep(_AFTER_AN_ERROR)

    # --- procedures (RFC 1833, 3.2) ---

    async def _refuse(self, parameters: Reader) -> bytes:
        """SET and UNSET: refuse, as no other program can register here."""
        parameters.numbers(4)
        return pack(0)

    async def _get_port(self, parameters: Reader) -> bytes:
        """GETPORT: the port of a program, 0 where this host does not have it; the fourth number, a port, is ignored."""
        program, version, protocol, _ = parameters.numbers(4)
        return pack(self._programs.get((program, version, protocol), 0))

    async def _dump(self, parameters: Reader) -> bytes:
        """DUMP: the list of all programs, 1 before each entry, 0 at the end."""
        entries = (pack(1, *program, port) for program, port in self._programs.items())
        return b"".join(entries) + pack(0)
