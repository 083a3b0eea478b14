"""A virtual bench behind real sockets on loopback, and clients to it: pyvisa-py's, and bare sockets.

Nothing here depends on how busy the machine is: what is waited for happens, however late, and a hang guard ends a test
that would wait for ever.
"""

import contextlib
import socket
import struct
import time

import pytest
import pyvisa
from pyvisa.constants import StatusCode
from pyvisa_py.protocols import hislip as pyvisa_hislip
from pyvisa_py.tcpip import Vxi11CoreClient

from instruments.clock import WallClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.rows import Ask, Number, Own
from instruments.virtual.servers.hislip import HEADER, Type
from instruments.virtual.servers.server import BenchServer, ListenAt
from instruments.virtual.servers.streams import HAS_PSEUDO_TERMINALS
from support.waiting import HANG_GUARD_S

#: What a client waits for at most [s]; a time-out that is meant to be reached [ms].
AT_MOST, SHORT = HANG_GUARD_S, 20

#: How long the slow answer takes [s].
SLOW = 3600.0

#: Every byte there is, line feeds included.
BLOCK = bytes(range(256)) * 24_000

NETWORK, SERIAL = "TCPIP0::thing::inst0::INSTR", "ASRL1::INSTR"

#: Interfaces that mark the end of a message, and all there are.
MARKED = ("hislip", "vxi11")
ALL = ("socket", *MARKED, "serial", *(("pty",) if HAS_PSEUDO_TERMINALS else ()))

NO_ERROR = '+0,"No error"'


class Thing(VirtualInstrument):
    """Answers ``BLOC?`` with a block, ``SLOW?`` after an hour; counts its triggers."""

    identity = "levilab,thing,7,1.0"
    triggers = blocks = 0

    def __init__(self, clock):
        super().__init__(clock, pace=0.0)
        self.taken = b""

    ROWS = (
        Own("BLOCk", lambda d, p: d._take(p), lambda d: d._give()),
        Ask("SLOW", lambda d: d._slow()),
        Ask("FAIL", lambda _d: str(1 // 0)),
        Number("LEVel", "level", 0.0, (0, 10)),
    )

    def _slow(self):
        self.busy_until(self._ready + SLOW)
        return "slow"

    def _give(self):
        self.blocks += 1
        return f"#7{len(BLOCK)}{BLOCK.decode('latin-1')}"

    def _take(self, parameters):
        self.taken = parameters[0].encode("latin-1")

    def trigger(self):
        self.triggers += 1


class Served:
    """A server with a thing on the network and one on a serial line, and clients to it."""

    def __init__(self, clock=None, listen_at=None):
        clock = clock or WallClock()
        self.thing, self.serial = Thing(clock), Thing(clock)
        self.server = BenchServer(VirtualBench({NETWORK: self.thing, SERIAL: self.serial}), listen_at or ListenAt())
        self.manager = pyvisa.ResourceManager("@py")
        self.opened = contextlib.ExitStack()

    def names(self):
        network, serial = (offer.resources for offer in self.server.endpoints)
        return network | {"serial": serial["socket"], "pty": serial.get("pty")}

    def open(self, way, timeout=1000 * AT_MOST):
        resource = self.manager.open_resource(self.names()[way], timeout=timeout)
        self.opened.callback(resource.close)
        if way not in MARKED:
            resource.read_termination = resource.write_termination = "\n"
        return resource

    def bare(self, way):
        """A socket that knows no protocol."""
        parts = self.names()[way].replace("hislip0,", "").replace(",", "::").split("::")
        connection = socket.create_connection(("127.0.0.1", int(parts[2])), timeout=AT_MOST)
        return self.opened.enter_context(connection)

    def hislip(self):
        """pyvisa-py's own client, for what VISA does not offer."""
        port = int(self.names()["hislip"].split(",")[1].split("::")[0])
        client = pyvisa_hislip.Instrument("127.0.0.1", port=port, timeout=AT_MOST)
        self.opened.callback(client.close)
        return client

    def vxi11(self):
        port = int(self.names()["vxi11"].split(",")[1].split("::")[0])
        client = Vxi11CoreClient("127.0.0.1", port)
        self.opened.callback(client.close)
        return client


@contextlib.contextmanager
def serving(**parts):
    served = Served(**parts)
    with served.server, served.opened:
        yield served


def until(condition):
    """Look again and again until this holds; a failure never ends this, the hang guard does."""
    while not condition():
        time.sleep(0.001)


def times_out(resource):
    resource.timeout = SHORT
    with pytest.raises(pyvisa.VisaIOError) as silence:
        resource.read()
    resource.timeout = 1000 * AT_MOST
    return silence.value.error_code == StatusCode.error_timeout


def welcome(served, way):
    """Whether one more client is served."""
    with served.bare(way) as bare, contextlib.suppress(ConnectionError, EOFError):
        if way == "socket":
            bare.sendall(b"*OPC?\n")
            return bare.recv(10) == b"1\n"
        if way == "hislip":
            send(bare, Type.INITIALIZE, 0, 0x01000000, b"hislip0")
            return header(bare)[0] == Type.INITIALIZE_RESPONSE
        return rpc(bare, procedure=0) == [1, 0, 0, 0, 0]
    return False


def header(connection):
    got = b""
    while len(got) < HEADER.size:
        piece = connection.recv(HEADER.size - len(got))
        if not piece:
            raise EOFError
        got += piece
    _, kind, control, parameter, length = HEADER.unpack(got)
    payload = connection.recv(length) if length else b""
    return Type(kind), control, parameter, payload


def send(connection, kind, control=0, parameter=0, payload=b""):
    connection.sendall(HEADER.pack(b"HS", kind, control, parameter, len(payload)) + payload)


def channels(served, version=0x0100):
    """Both channels of a fresh client, initialised, as bare sockets."""
    sync, aside = served.bare("hislip"), served.bare("hislip")
    send(sync, Type.INITIALIZE, 0, version << 16 | 0x7878, b"hislip0")
    kind, mode, parameter, _ = header(sync)
    assert (kind, mode, parameter >> 16) == (Type.INITIALIZE_RESPONSE, 0, min(version, 0x0200))
    send(aside, Type.ASYNC_INITIALIZE, 0, parameter & 0xFFFF)
    assert header(aside)[0] == Type.ASYNC_INITIALIZE_RESPONSE
    return sync, aside


def rpc(connection, program=0x0607AF, version=1, procedure=10, parameters=b""):
    """The words of the reply to a call after its number."""
    call = struct.pack("!10I", 7, 0, 2, program, version, procedure, 0, 0, 0, 0) + parameters
    half = len(call) // 2  # in two fragments
    connection.sendall(struct.pack("!I", half) + call[:half])
    connection.sendall(struct.pack("!I", 1 << 31 | len(call) - half) + call[half:])
    reply = connection.recv(1000)
    if not reply:
        raise EOFError
    assert int.from_bytes(reply[:4]) == 1 << 31 | len(reply) - 4
    number, *words = struct.unpack(f"!{len(reply) // 4 - 1}I", reply[4:])
    assert number == 7
    return words
