"""How a server ends: waiting clients, its thread, its sockets; and that it may begin again."""

import asyncio
import contextlib
import gc
import socket
import threading

import pytest

from instruments.clock import WallClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.servers.clients import ServedInstrument
from instruments.virtual.servers.hislip import Type
from instruments.virtual.servers.server import ListenAt
from instruments.virtual.servers.streams import socket_listener
from support.served import AT_MOST, NETWORK, Served, Thing, channels, rpc, send


@contextlib.contextmanager
def all_collected():
    """At the end all that was left here is collected, so that a socket left open warns.

    What was there before is not looked at: a whole collection takes a second in a process that has run many tests.
    """
    gc.freeze()
    try:
        yield
        gc.collect()
    finally:
        gc.unfreeze()


def test_the_end_of_the_server_ends_waiting_clients_and_its_thread():
    with all_collected():
        served = Served()
        with served.opened:
            with served.server:
                bare, (sync, aside), reader = served.bare("socket"), channels(served), served.bare("vxi11")
                bare.sendall(b"SLOW?\n")
                send(sync, Type.DATA_END, 0, 2, b"SLOW?")
                assert rpc(reader, procedure=0) == [1, 0, 0, 0, 0]
            assert "virtual bench" not in {thread.name for thread in threading.enumerate()}
            for connection in (bare, sync, aside, reader):
                with contextlib.suppress(ConnectionError):
                    assert connection.recv(10) == b""
            del served.server


@pytest.mark.parametrize("turns", range(6))  # of the event loop, until a connection is handed over
def test_the_end_of_the_server_ends_a_client_that_is_just_connecting(turns):
    thing = Thing(WallClock())

    async def end_while_connecting():
        listener = socket_listener(ServedInstrument(VirtualBench({NETWORK: thing}), thing))
        await listener.open("127.0.0.1", 0)
        with socket.create_connection(("127.0.0.1", listener.port), timeout=AT_MOST):
            for _ in range(turns):
                await asyncio.sleep(0)
            async with asyncio.timeout(AT_MOST):
                await listener.close()

    with all_collected():
        asyncio.run(end_while_connecting())


def test_a_server_that_has_ended_may_begin_again():
    served = Served()
    for _ in range(3):
        with served.server, served.opened:
            assert served.open("socket").query("*IDN?").strip() == Thing.identity


def test_a_server_that_could_not_begin_may_begin_later():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        served = Served(listen_at=ListenAt(port_base=taken.getsockname()[1]))
        with pytest.raises(OSError, match="in use"), served.server:
            pass
    served.server.listen_at = ListenAt()
    with served.server, served.opened:
        assert served.open("socket").query("*IDN?").strip() == Thing.identity
