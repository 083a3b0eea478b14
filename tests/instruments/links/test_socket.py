"""The transport over TCP on loopback, with pyvisa-py: silence, a lost connection, each driver over each protocol."""

import contextlib
import socket
import socketserver
import threading

import pytest

from instruments.errors import NoAnswer, NotConnected
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.faults import Fault
from instruments.virtual.servers.server import BenchServer
from support import hostile
from support.models import FAMILIES, ROWS, measure
from support.served import Thing
from support.served import serving as serving_things
from support.waiting import HANG_GUARD_S as AT_MOST

#: A time-out that is meant to be reached [s].
SHORT = 0.05


class Connection(socketserver.StreamRequestHandler):
    """Answers ``*IDN?``, and ``LATE?`` when the test says so; ``BYE`` ends the connection."""

    def handle(self):
        with contextlib.suppress(OSError):  # the other side may have gone
            for line in self.rfile:
                if line == b"BYE\n":
                    return
                self.answer(line)

    def answer(self, line):
        if line == b"*IDN?\n":
            self.wfile.write(b"levilab,loopback,0,0\n")
        elif line == b"LATE?\n":
            self.server.release.wait(AT_MOST)
            self.wfile.write(b"late\n")


class Server(socketserver.ThreadingTCPServer):
    """One instrument; its threads are joined when it is closed."""

    allow_reuse_address = True

    def __init__(self, port=0):
        self.release = threading.Event()
        super().__init__(("127.0.0.1", port), Connection)

    @property
    def address(self):
        return f"TCPIP0::127.0.0.1::{self.server_address[1]}::SOCKET"


@contextlib.contextmanager
def serving(port=0):
    with Server(port) as server:
        # looks for the end so often [s]: what stopping it costs
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield server
        finally:
            server.release.set()
            server.shutdown()
            thread.join(AT_MOST)


def test_a_bare_socket_sends_at_once():
    """VISA's default; without it a message behind another without an answer waits 0.04 s for its acknowledgement."""
    with serving() as server, contextlib.closing(open_link(server.address, timeout=AT_MOST)) as transport:
        link = transport.port.resource.visalib.sessions[transport.port.resource.session].interface
        assert link.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_patience_lets_a_slow_answer_come():
    with serving() as server, contextlib.closing(open_link(server.address, timeout=SHORT)) as transport:
        threading.Timer(2 * SHORT, server.release.set).start()
        assert transport.query("LATE?", patience=AT_MOST) == "late"


def test_a_server_that_is_gone_raises_and_is_found_again_when_back():
    with serving() as server:
        port = server.server_address[1]
        transport = open_link(server.address, timeout=SHORT)
        with pytest.raises(NoAnswer):  # the other side hung up: no answer will come
            transport.query("BYE")
    with contextlib.closing(transport):
        for _ in range(2):
            with pytest.raises(NotConnected) as gone:
                transport.query("*IDN?")
            assert "\n" not in str(gone.value)
        with serving(port):
            transport.timeout = AT_MOST
            assert transport.query("*IDN?") == "levilab,loopback,0,0"
            transport.close()


def test_a_port_where_no_program_listens_raises():
    with serving() as server:
        address = server.address
    with pytest.raises(NotConnected), contextlib.closing(open_link(address)) as transport:
        transport.query("*IDN?")


PROTOCOLS = ("socket", "hislip", "vxi11")


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("name", FAMILIES)
def test_a_driver_measures_over_each_protocol(name, protocol):
    room = hostile.Room()
    with BenchServer(VirtualBench({"TCPIP0::box::inst0::INSTR": hostile.instrument(name, room)})) as server:
        link = open_link(server.endpoints[0].resources[protocol], timeout=AT_MOST)
        clock = {"clock": room.clock} if hasattr(ROWS[name].driver, "CHANNEL") else {}
        with contextlib.closing(ROWS[name].driver(link, **clock)) as driver:
            measure(name, driver)


@pytest.mark.parametrize("what", ["no answer", "late answer"])
@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_after_a_silence_the_next_question_gets_its_answer(protocol, what):
    with serving_things() as served:
        served.server.bench.faults.append(Fault(what, question="LEV.*"))
        with contextlib.closing(open_link(served.names()[protocol], timeout=SHORT)) as transport:
            with pytest.raises(NoAnswer):
                transport.query("LEV?")
            transport.timeout = AT_MOST
            assert transport.query("*IDN?") == Thing.identity
