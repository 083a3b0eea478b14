"""Serves all instruments of a virtual bench to other programs, and ends cleanly."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Self

from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.servers.clients import Listener, ServedInstrument
from instruments.virtual.servers.hislip import HislipServer
from instruments.virtual.servers.port_mapper import PORT, TCP, PortMapper
from instruments.virtual.servers.streams import HAS_PSEUDO_TERMINALS, PseudoTerminal, http_listener, socket_listener
from instruments.virtual.servers.vxi11 import ABORT, CORE, PROGRAM_VERSION, Vxi11Server

LOOPBACK = "127.0.0.1"

#: Scheme of an address → what serves the instrument; others can be reached in this process alone.
BY_SCHEME: dict[str, Callable[[ServedInstrument], Listener]] = {"phyphox": http_listener}

#: Ports that an instrument takes when they are numbered: socket, HiSLIP, VXI-11 and its abort channel.
PORTS_PER_INSTRUMENT = 4


@dataclass(frozen=True)
class Endpoints:
    """Where other programs find an instrument.

    Attributes:
        address: its resource name on the bench.
        resources: the resource names for other programs, by protocol: socket, hislip, vxi11, pty.
    """

    address: str
    resources: dict[str, str]


@dataclass(frozen=True)
class ListenAt:
    """Where to listen.

    Attributes:
        host: an address of this machine.
        port_base: the first of the ports; None: any free ones.
        port_mapper: the port of a port mapper, which each instrument with VXI-11 then has, and so a loopback address of
            its own, from 127.0.0.2 on; None: no port mapper.
    """

    host: str = LOOPBACK
    port_base: int | None = None
    port_mapper: int | None = None

    def name_in_resources(self) -> str:
        """Return the host as resource names have it: a name of this machine where it listens at all addresses."""
        return socket.gethostname() if self.host in {"", "0.0.0.0"} else self.host  # noqa: S104 - only asked for

    def of_instrument(self, index: int) -> ListenAt:
        """Return the address of the instrument of this index: its own where it has a port mapper."""
        return self if self.port_mapper is None else replace(self, host=f"127.0.0.{2 + index}")

    def ports(self, index: int) -> Iterator[int]:
        """Yield the ports of the instrument of this index, 0 for any free one."""
        first = self.port_base
        for listen_at in range(PORTS_PER_INSTRUMENT):
            yield 0 if first is None else first + PORTS_PER_INSTRUMENT * index + listen_at


@contextlib.asynccontextmanager
async def serve_bench(bench: VirtualBench, listen_at: ListenAt | None = None) -> AsyncIterator[tuple[Endpoints, ...]]:
    """Serve all instruments of a bench while the context lasts; gives their endpoints.

    The clock of the bench should run by itself; the servers make one that jumps go to each answer.

    Raises:
        OSError: a port is in use, or the machine does not have the address.
    """
    listen_at = listen_at or ListenAt()
    async with contextlib.AsyncExitStack() as opened:
        yield tuple(
            [
                Endpoints(address, await _listen(ServedInstrument(bench, device), address, listen_at, index, opened))
                for index, (address, device) in enumerate(bench.instruments.items())
            ]
        )


async def _listen(
    instrument: ServedInstrument, address: str, listen_at: ListenAt, index: int, opened: contextlib.AsyncExitStack
) -> dict[str, str]:
    """Begin to listen for one instrument.  Returns its resource names, by protocol."""
    scheme = address.partition("://")[0] if "://" in address else ""
    if not (scheme or address.upper().startswith("ASRL")):
        listen_at = listen_at.of_instrument(index)
    ports, host = listen_at.ports(index), listen_at.name_in_resources()

    async def listen(listener: Listener) -> int:
        opened.push_async_callback(listener.close)  # first: opening may be cancelled half way
        await listener.open(listen_at.host, next(ports))
        return listener.port

    if scheme:
        serve = BY_SCHEME.get(scheme)
        return {scheme: f"{scheme}://{host}:{await listen(serve(instrument))}"} if serve else {}
    if address.upper().startswith("ASRL"):
        resources = {"socket": f"ASRLsocket://{host}:{await listen(socket_listener(instrument))}::INSTR"}
        if HAS_PSEUDO_TERMINALS:
            line = PseudoTerminal(instrument)
            opened.push_async_callback(line.close)
            line.open()
            resources["pty"] = f"ASRL{line.name}::INSTR"
        return resources
    hislip, vxi11 = HislipServer(instrument), Vxi11Server(instrument)
    resources = {
        "socket": f"TCPIP0::{host}::{await listen(socket_listener(instrument))}::SOCKET",
        "hislip": f"TCPIP0::{host}::hislip0,{await listen(hislip.listener)}::INSTR",
        "vxi11": f"TCPIP0::{host},{await listen(vxi11.core)}::inst0::INSTR",
    }
    await listen(vxi11.abort)
    if listen_at.port_mapper is not None:
        programs = {(CORE, PROGRAM_VERSION, TCP): vxi11.core.port, (ABORT, PROGRAM_VERSION, TCP): vxi11.abort.port}
        mapper = PortMapper(instrument, programs)
        opened.push_async_callback(mapper.close)
        await mapper.open(listen_at.host, listen_at.port_mapper)
        if mapper.port == PORT:
            resources["vxi11"] = f"TCPIP0::{host}::inst0::INSTR"
    return resources


@dataclass
class BenchServer:
    """Serves a bench from a thread of its own while its ``with`` block runs; a second block may follow.

    Attributes:
        bench: to serve.
        listen_at: where.
        endpoints: where the instruments are, once it runs.

    Raises:
        OSError: on entering, where a port is in use.

    This prints the first instrument's address over HiSLIP, such as TCPIP0::127.0.0.1::hislip0,40213::INSTR::

        with BenchServer(bench) as server:
            print(server.endpoints[0].resources["hislip"])
    """

    bench: VirtualBench
    listen_at: ListenAt = field(default_factory=ListenAt)
    endpoints: tuple[Endpoints, ...] = ()
    _loop: asyncio.AbstractEventLoop | None = field(init=False, default=None)
    _end: asyncio.Event = field(init=False)

    def __enter__(self) -> Self:
        """Start the thread, and return when every instrument can be reached."""
        self._end = asyncio.Event()
        begun: Future[tuple[Endpoints, ...]] = Future()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve(begun)), name="virtual bench")
        self._thread.start()
        try:
            self.endpoints = begun.result()
        except OSError:
            self._thread.join()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close all connections, and wait for the end of the thread."""
        assert self._loop
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()

    async def _serve(self, begun: Future[tuple[Endpoints, ...]]) -> None:
        self._loop = asyncio.get_running_loop()
        try:
            async with serve_bench(self.bench, self.listen_at) as endpoints:
                begun.set_result(endpoints)
                await self._end.wait()
        except Exception as error:
            if begun.done():
                raise
            begun.set_exception(error)
