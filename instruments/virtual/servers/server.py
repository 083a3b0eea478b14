"""Offers all instruments of a bus to other programs, and ends cleanly."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self

from instruments.virtual.servers import serial_port
from instruments.virtual.servers.hislip import HislipServer
from instruments.virtual.servers.port_mapper import PORT, TCP, PortMapper
from instruments.virtual.servers.socket_server import socket_listener
from instruments.virtual.servers.station import Listener, Station
from instruments.virtual.servers.vxi11 import ABORT, CORE, PROGRAM_VERSION, Vxi11Server

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterator
    from types import TracebackType

    from instruments.virtual.bench.bus import Bus

LOOPBACK = "127.0.0.1"

#: Ports that an instrument takes when they are numbered: socket, HiSLIP, VXI-11 and its abort channel.
PORTS_PER_INSTRUMENT = 4


@dataclass(frozen=True)
class Offer:
    """Where other programs find an instrument.

    address: its resource name on the bus; resources: the names to use, by the way that they go.
    """

    address: str
    resources: dict[str, str]


@dataclass(frozen=True)
class Place:
    """Where to listen.

    host: an address of this machine; port_base: the first of the ports, None: any free ones; port_mapper: the port at
    which each instrument with VXI-11 has a port mapper, and so a loopback address of its own, from 127.0.0.2 on; None:
    there is none.
    """

    host: str = LOOPBACK
    port_base: int | None = None
    port_mapper: int | None = None

    def shown(self) -> str:
        """The host as it stands in resource names."""
        return socket.gethostname() if self.host in {"", "0.0.0.0"} else self.host  # noqa: S104 - only asked for

    def own_host(self, index: int) -> Place:
        """Where the instrument of this index listens that has a port mapper."""
        return self if self.port_mapper is None else replace(self, host=f"127.0.0.{2 + index}")

    def ports(self, index: int) -> Iterator[int]:
        """The ports of one instrument."""
        first = self.port_base
        for place in range(PORTS_PER_INSTRUMENT):
            yield 0 if first is None else first + PORTS_PER_INSTRUMENT * index + place


@contextlib.asynccontextmanager
async def offered(bus: Bus, place: Place | None = None) -> AsyncIterator[tuple[Offer, ...]]:
    """All instruments of the bus, for as long as this lasts.  Raises OSError when a port is taken.

    The clock of the bench should run by itself; one that jumps is made to jump to each answer.
    """
    place = place or Place()
    async with contextlib.AsyncExitStack() as opened:
        yield tuple(
            [
                Offer(address, await _offer(Station(bus, device), address, place, index, opened))
                for index, (address, device) in enumerate(bus.instruments.items())
            ]
        )


async def _offer(
    station: Station, address: str, place: Place, index: int, opened: contextlib.AsyncExitStack
) -> dict[str, str]:
    """Begin to listen; the resource names by the way that they go."""
    if not address.upper().startswith("ASRL"):
        place = place.own_host(index)
    ports, host = place.ports(index), place.shown()

    async def listen(listener: Listener) -> int:
        opened.push_async_callback(listener.close)  # first: opening may be given up half way
        await listener.open(place.host, next(ports))
        return listener.port

    if address.upper().startswith("ASRL"):
        resources = {"socket": f"ASRLsocket://{host}:{await listen(socket_listener(station))}::INSTR"}
        if serial_port.HAS_PSEUDO_TERMINALS:
            line = serial_port.PseudoTerminal(station)
            opened.push_async_callback(line.close)
            line.open()
            resources["pty"] = f"ASRL{line.name}::INSTR"
        return resources
    hislip, vxi11 = HislipServer(station), Vxi11Server(station)
    resources = {
        "socket": f"TCPIP0::{host}::{await listen(socket_listener(station))}::SOCKET",
        "hislip": f"TCPIP0::{host}::hislip0,{await listen(hislip.listener)}::INSTR",
        "vxi11": f"TCPIP0::{host},{await listen(vxi11.core)}::inst0::INSTR",
    }
    await listen(vxi11.abort)
    if place.port_mapper is not None:
        programs = {(CORE, PROGRAM_VERSION, TCP): vxi11.core.port, (ABORT, PROGRAM_VERSION, TCP): vxi11.abort.port}
        mapper = PortMapper(station, programs)
        opened.push_async_callback(mapper.close)
        await mapper.open(place.host, place.port_mapper)
        if mapper.port == PORT:
            resources["vxi11"] = f"TCPIP0::{host}::inst0::INSTR"
    return resources


@dataclass
class BenchServer:
    """Offers a bus from a thread of its own, between ``with`` and its end; it may be entered again afterwards.

    offers: where the instruments are, once it runs.  Raises OSError when a port is taken.

    So the first instrument's address over HiSLIP, such as TCPIP0::127.0.0.1::hislip0,40213::INSTR, is printed by::

        with BenchServer(bus) as server:
            print(server.offers[0].resources["hislip"])
    """

    bus: Bus
    place: Place = field(default_factory=Place)
    offers: tuple[Offer, ...] = ()
    _loop: asyncio.AbstractEventLoop | None = field(init=False, default=None)
    _end: asyncio.Event = field(init=False)
    _failed: Exception | None = field(init=False, default=None)

    def __enter__(self) -> Self:
        """Returns when every instrument can be reached."""
        self._end = asyncio.Event()
        begun = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(begun,), name="virtual bench")
        self._thread.start()
        begun.wait()
        if self._failed:
            self._thread.join()
            failed, self._failed = self._failed, None
            raise failed
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """All connections are closed and the thread has ended."""
        assert self._loop
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()

    def _run(self, begun: threading.Event) -> None:
        asyncio.run(self._serve(begun))

    async def _serve(self, begun: threading.Event) -> None:
        self._loop = asyncio.get_running_loop()
        try:
            async with offered(self.bus, self.place) as self.offers:
                begun.set()
                await self._end.wait()
        except Exception as error:  # noqa: BLE001 - told by the thread that waits for us
            self._failed = error
            begun.set()
