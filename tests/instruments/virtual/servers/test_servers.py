"""The virtual bench over real sockets on loopback, with other people's clients: pyvisa-py, and bare sockets."""

import asyncio
import contextlib
import gc
import os
import socket
import struct
import threading
import time

import pytest
import pyvisa
from pyvisa.constants import StatusCode
from pyvisa_py.protocols import hislip as pyvisa_hislip
from pyvisa_py.protocols import vxi11 as pyvisa_vxi11
from pyvisa_py.tcpip import Vxi11CoreClient

from instruments.clock import VirtualClock, WallClock
from instruments.virtual.bench.bus import Bus
from instruments.virtual.bench.faults import Fault
from instruments.virtual.core.device import VirtualInstrument, answers
from instruments.virtual.core.parser import Command
from instruments.virtual.servers import station
from instruments.virtual.servers.hislip_messages import HEADER, LONGEST, Type
from instruments.virtual.servers.serial_port import HAS_PSEUDO_TERMINALS
from instruments.virtual.servers.server import BenchServer, Place
from instruments.virtual.servers.socket_server import socket_listener
from instruments.virtual.servers.station import Station

#: What is waited for at most [s], reached by a failure only; and a time-out that is meant to be reached [ms].
AT_MOST, SHORT = 5.0, 20

#: Every byte there is, line feeds included.
BLOCK = bytes(range(256)) * 24_000

NETWORK, SERIAL = "TCPIP0::thing::inst0::INSTR", "ASRL1::INSTR"

#: Interfaces that mark the end of a message, and all there are.
MARKED = ("hislip", "vxi11")
ALL = ("socket", *MARKED, "serial", *(("pty",) if HAS_PSEUDO_TERMINALS else ()))

NO_ERROR = '+0,"No error"'


class Thing(VirtualInstrument):
    """Answers ``BLOC?`` with a block, ``SLOW?`` after ten seconds; counts its triggers."""

    identity = "levilab,thing,7,1.0"
    triggers = blocks = 0

    def __init__(self, clock):
        super().__init__(clock, pace=0.0)
        self.taken = b""

    def table(self):
        return (
            Command("BLOCk", self._take, answers(self._give)),
            Command("SLOW", get=answers(self._slow)),
            Command("FAIL", get=answers(lambda: str(1 // 0))),
            self.numeric("LEVel", "level", low=0, high=10, default=0),
        )

    def _slow(self):
        self.busy_until(self._ready + 10.0)
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

    def __init__(self, clock=None, place=None):
        clock = clock or WallClock()
        self.thing, self.serial = Thing(clock), Thing(clock)
        self.server = BenchServer(Bus({NETWORK: self.thing, SERIAL: self.serial}), place or Place())
        self.manager = pyvisa.ResourceManager("@py")
        self.opened = contextlib.ExitStack()

    def names(self):
        network, serial = (offer.resources for offer in self.server.offers)
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


@pytest.fixture
def served():
    with serving() as served:
        yield served


def until(condition):
    """Wait until this holds; a failure if it never does."""
    end = time.monotonic() + AT_MOST
    while not condition():
        assert time.monotonic() < end, "never happened"
        time.sleep(0.001)


def times_out(resource):
    resource.timeout = SHORT
    with pytest.raises(pyvisa.VisaIOError) as silence:
        resource.read()
    resource.timeout = 1000 * AT_MOST
    return silence.value.error_code == StatusCode.error_timeout


# --- what every way does ---


@pytest.mark.parametrize("way", ALL)
def test_question_and_answer(served, way):
    client = served.open(way)
    assert client.query("*IDN?").strip() == "levilab,thing,7,1.0"
    client.write("LEV 2.5")
    assert float(client.query("LEV?")) == 2.5
    assert client.query("SYST:ERR?").strip() == NO_ERROR


@pytest.mark.parametrize("way", ["socket", *MARKED, "serial"])
def test_a_block_of_six_megabytes_of_any_bytes(served, way):
    client = served.open(way)
    client.write("BLOC?")
    client.read_termination = None
    length = len(f"#7{len(BLOCK)}") + len(BLOCK) + 1
    # pyvisa-py reads from a serial line byte by byte: there a part will do
    count = 300 if way == "serial" else length
    answer = client.read_bytes(count, chunk_size=1 << 20)
    assert answer == (b"#7%d" % len(BLOCK) + BLOCK + b"\n")[:count]


@pytest.mark.parametrize("way", ["socket", *MARKED])
def test_a_block_of_six_megabytes_is_taken(served, way):
    client = served.open(way)
    client.write_raw(b"BLOC #7%d" % len(BLOCK) + BLOCK + b"\n")
    assert client.query("SYST:ERR?").strip() == NO_ERROR
    assert served.thing.taken.endswith(BLOCK)


@pytest.mark.parametrize("way", ALL)
def test_what_is_not_understood_gets_no_answer_and_the_next_question_its_own(served, way):
    client = served.open(way)
    client.write("FOO?")
    assert times_out(client)
    assert client.query("SYST:ERR?").strip() == '-113,"Undefined header;FOO"'


@pytest.mark.parametrize("way", MARKED)
def test_device_clear_ends_a_slow_answer(served, way):
    client = served.open(way)
    client.write("SLOW?")
    assert times_out(client)
    before = time.monotonic()
    client.clear()
    assert client.query("*OPC?").strip() == "1"
    assert time.monotonic() - before < 1.0
    assert client.query("SYST:ERR?").strip() == NO_ERROR


@pytest.mark.parametrize("way", MARKED)
def test_the_status_byte_tells_of_an_error_and_of_an_answer(served, way):
    client = served.open(way)
    assert client.read_stb() == 0
    client.write("FOO")
    until(lambda: client.read_stb() == 4)
    client.write("SYST:ERR?")
    until(lambda: client.read_stb() == 16)  # the error queue is empty, its entry waits to be read
    client.read()
    assert client.read_stb() == 0


@pytest.mark.parametrize("way", ["socket", "hislip", "vxi11", "serial"])
def test_two_clients_at_once_get_each_their_own_answers(served, way):
    clients = [served.open(way) for _ in range(2)]

    def ask(client, word, wrong):
        for _ in range(20):
            if client.query(word).strip() != {"*OPC?": "1", "*IDN?": Thing.identity}[word]:
                wrong.append(word)

    wrong = []
    threads = [
        threading.Thread(target=ask, args=(client, word, wrong))
        for client, word in zip(clients, ("*OPC?", "*IDN?"), strict=True)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_one_world_is_behind_all_ways(served):
    served.open("socket").write("LEV 3")
    until(lambda: served.thing.settings["level"] == 3)
    assert float(served.open("hislip").query("LEV?")) == 3
    assert float(served.open("vxi11").query("LEV?")) == 3


@pytest.mark.parametrize("way", ["socket", "hislip", "vxi11"])
def test_a_client_that_goes_away_in_the_middle_harms_nobody(served, way):
    other = served.open(way)
    client = served.open(way)
    client.write("BLOC?")
    client.read_bytes(10)
    client.close()
    assert other.query("*OPC?").strip() == "1"
    assert served.open(way).query("*OPC?").strip() == "1"


def test_the_end_of_the_server_ends_waiting_clients_and_its_thread():
    served = Served()
    with served.opened:
        with served.server:
            bare, (sync, aside), reader = served.bare("socket"), channels(served), served.bare("vxi11")
            bare.sendall(b"SLOW?\n")
            send(sync, Type.DATA_END, 0, 2, b"SLOW?")
            assert rpc(reader, procedure=0) == [1, 0, 0, 0, 0]
            before = time.monotonic()
        assert time.monotonic() - before < 1.0
        assert "virtual bench" not in {thread.name for thread in threading.enumerate()}
        for connection in (bare, sync, aside, reader):
            with contextlib.suppress(ConnectionError):
                assert connection.recv(10) == b""
        del served.server
        gc.collect()  # a socket left open would warn


@pytest.mark.parametrize("turns", range(6))  # of the event loop, until a connection is handed over
def test_the_end_of_the_server_ends_a_client_that_is_just_connecting(turns):
    thing = Thing(WallClock())

    async def end_while_connecting():
        listener = socket_listener(Station(Bus({NETWORK: thing}), thing))
        await listener.open("127.0.0.1", 0)
        with socket.create_connection(("127.0.0.1", listener.port), timeout=AT_MOST):
            for _ in range(turns):
                await asyncio.sleep(0)
            async with asyncio.timeout(AT_MOST):
                await listener.close()

    asyncio.run(end_while_connecting())
    gc.collect()  # a socket left open would warn


@pytest.mark.parametrize("way", ["socket", "hislip", "vxi11"])
@pytest.mark.parametrize(
    "noise",
    [b"\0" * 4096, b"\xff" * 4096, bytes(range(256)) * 64, b"HS" + b"\xff" * 14, b"\x80\0\0\x28" + b"\x7f" * 40],
    ids=["zeros", "ones", "all", "header", "record"],
)
def test_garbage_is_survived(served, way, noise):
    bare = served.bare(way)
    with contextlib.suppress(OSError):
        bare.sendall(noise)
        bare.shutdown(socket.SHUT_WR)
        while bare.recv(1 << 16):
            pass
    assert served.open(way).query("*OPC?").strip() == "1"


def test_an_error_in_an_instrument_costs_one_connection_and_is_told(served, caplog):
    with served.bare("socket") as bare:
        bare.sendall(b"FAIL?\n")
        assert bare.recv(10) == b""
    assert "ZeroDivisionError" in caplog.text
    assert served.open("socket").query("*OPC?").strip() == "1"


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


def test_a_connection_that_cannot_be_taken_does_not_keep_others_away(served, monkeypatch, caplog):
    first = iter([RuntimeError("for once")])

    def reachable(device):
        for error in first:
            raise error
        return True

    monkeypatch.setattr(served.server.bus, "reachable", reachable)
    served.bare("socket")
    other = served.open("socket")
    assert other.query("*IDN?").strip() == Thing.identity
    assert "could not be taken" in caplog.text


@pytest.mark.parametrize("way", ["socket", "hislip", "vxi11"])
def test_more_clients_than_there_may_be_are_sent_away_until_one_leaves(served, way):
    crowd = [served.bare(way) for _ in range(station.MOST_CLIENTS * (2 if way == "hislip" else 1))]
    assert not welcome(served, way)
    crowd[0].close()
    until(lambda: welcome(served, way))


def test_hislip_more_sessions_than_there_may_be_are_told_so(served, monkeypatch):
    monkeypatch.setattr("instruments.virtual.servers.hislip.MOST_CLIENTS", 1)
    channels(served)
    one_more = served.bare("hislip")
    send(one_more, Type.INITIALIZE, 0, 0x01000000, b"hislip0")
    assert header(one_more)[:2] == (Type.FATAL_ERROR, 4)


def test_a_clock_that_jumps_jumps_to_every_answer():
    with serving(clock=VirtualClock()) as served:
        assert served.open("socket").query("SLOW?").strip() == "slow"
        assert served.thing.clock.now() == pytest.approx(10.0)


def test_a_faster_bench_answers_sooner():
    with serving(clock=WallClock(speed=1000.0)) as served:
        before = time.monotonic()
        for way in ("socket", *MARKED):
            assert served.open(way).query("SLOW?").strip() == "slow"
        assert 0.03 - 0.002 < time.monotonic() - before < 1.0


def in_a_row():
    """The first of ten ports that are free, below those that systems give away."""
    for first in range(15_000 + 10 * (os.getpid() % 1000), 32_000, 10):
        with contextlib.suppress(OSError), contextlib.ExitStack() as held:
            for port in range(first, first + 10):
                held.enter_context(socket.create_server(("127.0.0.1", port)))
            return first
    pytest.fail("no ports are free")


def test_a_port_that_is_taken_is_told_and_nothing_is_left_behind():
    first = in_a_row()
    with socket.create_server(("127.0.0.1", first + 2)):
        with pytest.raises(OSError, match=str(first + 2)), serving(place=Place(port_base=first)):
            pass
        with socket.create_server(("127.0.0.1", first)):
            pass


def test_ports_are_counted_from_the_first_one():
    first = in_a_row()
    with serving(place=Place(port_base=first)) as served:
        names = served.names()
    assert names["socket"] == f"TCPIP0::127.0.0.1::{first}::SOCKET"
    assert names["hislip"] == f"TCPIP0::127.0.0.1::hislip0,{first + 1}::INSTR"
    assert names["vxi11"] == f"TCPIP0::127.0.0.1,{first + 2}::inst0::INSTR"
    assert names["serial"] == f"ASRLsocket://127.0.0.1:{first + 4}::INSTR"


# --- faults ---


def cut(served, way):
    """What a client gets of an answer in which the link is cut, to its end."""
    if way == "hislip":
        bare, _ = channels(served)
        send(bare, Type.DATA_END, 0, 2, b"*IDN?")
    else:
        bare = served.bare(way)
    if way == "vxi11":
        *_, link, _, _ = rpc(bare, parameters=struct.pack("!4I8s", 1, 0, 0, 5, b"inst0"))
        rpc(bare, procedure=11, parameters=struct.pack("!5I8s", link, 0, 0, 8, 5, b"*IDN?"))
        assert rpc(bare, procedure=12, parameters=struct.pack("!6I", link, 100, 1000, 0, 0, 0))[5:7] == [0, 0]
        with pytest.raises(EOFError):
            rpc(bare, procedure=12, parameters=struct.pack("!6I", link, 100, 1000, 0, 0, 0))
        return b""
    if way == "socket":
        bare.sendall(b"*IDN?\n")
    return b"".join(iter(lambda: bare.recv(100), b""))


@pytest.mark.parametrize("way", ["socket", "hislip", "vxi11"])
def test_a_link_that_is_cut_in_an_answer_is_closed_and_another_one_works(served, way):
    served.server.bus.faults.append(Fault("disconnected", question=r"\*IDN\?"))
    assert b"1.0\n" not in cut(served, way)
    assert served.open(way).query("*IDN?").strip() == Thing.identity


def test_an_instrument_that_is_away_takes_no_connection_until_it_is_back(served):
    served.server.bus.away[id(served.thing)] = served.thing.clock.now() + 3600
    assert not any(welcome(served, way) for way in ("socket", "hislip", "vxi11"))
    served.server.bus.away[id(served.thing)] = served.thing.clock.now()
    assert all(welcome(served, way) for way in ("socket", "hislip", "vxi11"))


@pytest.mark.skipif(not HAS_PSEUDO_TERMINALS, reason="no pseudo-terminals here")
def test_a_pseudo_terminal_outlives_a_failing_instrument(served, caplog):
    client = served.open("pty")
    client.write("FAIL?")
    until(lambda: "ZeroDivisionError" in caplog.text)
    assert client.query("*OPC?").strip() == "1"


@pytest.mark.skipif(not HAS_PSEUDO_TERMINALS, reason="no pseudo-terminals here")
def test_a_pseudo_terminal_loses_what_nobody_fetches(served):
    served.open("pty").write("BLOC?;*OPC?")
    until(lambda: served.serial.blocks == 1)
    client = served.open("pty", timeout=100)

    def answers_again():
        with contextlib.suppress(UnicodeDecodeError, pyvisa.VisaIOError):  # the rest of the block
            return client.query("*IDN?").strip() == Thing.identity

    until(answers_again)


# --- locks ---


def test_vxi11_a_lock_keeps_another_client_out_until_it_is_given_up(served):
    mine, yours = served.open("vxi11"), served.open("vxi11")
    mine.lock_excl()
    with pytest.raises(pyvisa.VisaIOError) as locked:
        yours.lock_excl()
    assert locked.value.error_code == StatusCode.error_resource_locked
    with pytest.raises(pyvisa.VisaIOError):
        yours.write("LEV 1")
    assert mine.query("*OPC?").strip() == "1"
    mine.unlock()
    assert yours.query("*OPC?").strip() == "1"


def test_a_lock_is_waited_for_and_ends_with_its_connection(served):
    mine, yours = served.vxi11(), served.hislip()
    mine.create_link(1, True, 0, "inst0")
    assert yours.async_lock_request(0.0) == "failure"
    assert yours.async_lock_info() == 1
    threading.Timer(0.02, mine.close).start()
    assert yours.async_lock_request(AT_MOST) == "success"
    assert yours.async_lock_release() == "success"
    assert yours.async_lock_release() == "error"


def test_hislip_a_shared_lock_lets_in_who_knows_the_key(served):
    mine, yours, third = served.hislip(), served.hislip(), served.hislip()
    assert mine.async_lock_request(0.0, "key") == "success"
    assert mine.async_lock_request(0.0, "key") == "error"
    assert yours.async_lock_request(0.0, "key") == "success"
    assert third.async_lock_request(0.0, "another") == "failure"
    assert third.async_lock_request(0.0) == "failure"
    assert yours.async_lock_info() == 0
    assert yours.async_lock_release() == "success shared"


@pytest.mark.parametrize("way", ["hislip", "socket", "serial"])
def test_who_is_kept_out_waits_and_is_served_then(served, way):
    holder = Bus.session(served.server.bus, served.serial if way == "serial" else served.thing, stream=False)
    holder.hold.take(holder, None)
    client = served.open(way)
    client.write("*OPC?")
    assert times_out(client)
    holder.close()
    assert client.read().strip() == "1"


def test_hislip_device_clear_of_one_who_is_kept_out_is_not_kept_waiting(served):
    mine, yours = served.hislip(), served.hislip()
    mine.async_lock_request(0.0)
    mine.send(b"SLOW?")
    yours.send(b"*OPC?")
    yours.device_clear()
    until(lambda: served.thing.clock.now() < served.thing._ready)  # the holder's answer is still under way
    mine.device_clear()
    mine.async_lock_release()
    yours.send(b"*IDN?")
    assert yours.receive() == b"levilab,thing,7,1.0\n"


# --- raw TCP ---


def test_socket_many_questions_at_once_are_answered_in_order(served):
    bare = served.bare("socket")
    bare.sendall(b"*OPC?\n" * 1000 + b"*IDN?\n")
    received = b""
    while not received.endswith(b"1.0\n"):
        received += bare.recv(1 << 16)
    assert received == b"1\n" * 1000 + b"levilab,thing,7,1.0\n"


def test_socket_bytes_may_come_one_by_one(served):
    bare = served.bare("socket")
    bare.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for byte in b"*OPC?\r\n":
        bare.sendall(bytes([byte]))
    assert bare.recv(10) == b"1\n"


def test_socket_who_has_said_all_still_gets_the_answer(served):
    bare = served.bare("socket")
    bare.sendall(b"*IDN?\n")
    bare.shutdown(socket.SHUT_WR)
    assert bare.recv(100) == b"levilab,thing,7,1.0\n"
    assert bare.recv(100) == b""


def test_socket_a_flood_of_questions_that_nobody_reads_the_answers_of_is_held_back(served):
    bare = served.bare("socket")
    bare.settimeout(0.2)
    flood = b"BLOC?\n" * 10_000_000
    with pytest.raises(TimeoutError):  # the server takes no more
        bare.sendall(flood)
    assert served.open("hislip").query("*OPC?").strip() == "1"


# --- HiSLIP ---


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


@pytest.mark.parametrize("version", [0x0100, 0x0101, 0x0200, 0x0300])
def test_hislip_an_answer_bears_the_number_of_its_question(served, version):
    sync, _ = channels(served, version)
    send(sync, Type.DATA, 0, 0xFFFFFF00, b"*O")
    send(sync, Type.DATA_END, 0, 0xFFFFFF02, b"PC?\n")
    assert header(sync) == (Type.DATA_END, 0, 0xFFFFFF02, b"1\n")


def test_hislip_a_question_before_the_answer_is_ready_interrupts_it(served):
    sync, aside = channels(served)
    send(sync, Type.DATA_END, 0, 2, b"SLOW?")
    until(lambda: served.thing._ready > served.thing.clock.now())
    send(sync, Type.DATA_END, 0, 4, b"*OPC?")
    assert header(aside) == (Type.ASYNC_INTERRUPTED, 0, 4, b"")
    assert header(sync) == (Type.INTERRUPTED, 0, 4, b"")
    send(aside, Type.ASYNC_DEVICE_CLEAR)
    assert header(aside)[0] == Type.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE
    send(sync, Type.DEVICE_CLEAR_COMPLETE)
    assert header(sync)[0] == Type.DEVICE_CLEAR_ACKNOWLEDGE
    send(sync, Type.DATA_END, 0, 0xFFFFFF00, b"SYST:ERR?")
    assert header(sync)[3].startswith(b"-410,")


def test_hislip_an_answer_that_was_not_read_is_in_the_error_queue_and_nowhere_else(served):
    sync, aside = channels(served)
    send(sync, Type.DATA_END, 0, 2, b"*OPC?")
    assert header(sync)[3] == b"1\n"
    send(sync, Type.DATA_END, 0, 4, b"SYST:ERR?")  # without the flag that says: delivered
    assert header(sync)[2:] == (4, b'-410,"Query INTERRUPTED"\n')
    send(sync, Type.DATA_END, 1, 6, b"SYST:ERR?")
    assert header(sync)[2:] == (6, NO_ERROR.encode() + b"\n")
    send(aside, Type.ASYNC_STATUS_QUERY, 0, 6)
    assert header(aside) == (Type.ASYNC_STATUS_RESPONSE, 16, 0, b"")
    send(aside, Type.ASYNC_STATUS_QUERY, 1, 6)
    assert header(aside) == (Type.ASYNC_STATUS_RESPONSE, 0, 0, b"")


def test_hislip_what_is_sent_between_the_two_halves_of_a_device_clear_is_dropped(served):
    sync, aside = channels(served)
    send(aside, Type.ASYNC_DEVICE_CLEAR)
    assert header(aside)[0] == Type.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE
    send(sync, Type.DATA_END, 0, 2, b"LEV 5")
    send(sync, Type.DEVICE_CLEAR_COMPLETE, 1)
    assert header(sync) == (Type.DEVICE_CLEAR_ACKNOWLEDGE, 0, 0, b"")  # synchronized mode, though overlap was wished
    send(sync, Type.DATA_END, 0, 4, b"LEV?")
    assert float(header(sync)[3]) == 0


def test_hislip_messages_are_as_long_as_the_client_takes_them(served):
    sync, aside = channels(served)
    send(aside, Type.ASYNC_MAXIMUM_MESSAGE_SIZE, payload=struct.pack("!Q", 26))
    kind, _, _, size = header(aside)
    assert (kind, size) == (Type.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE, struct.pack("!Q", LONGEST))
    send(sync, Type.DATA_END, 0, 2, b"*IDN?")
    assert [header(sync)[::3] for _ in range(2)] == [(Type.DATA, b"levilab,th"), (Type.DATA_END, b"ing,7,1.0\n")]


def test_hislip_a_message_that_is_too_long_is_refused_and_skipped(served):
    sync, _ = channels(served)
    send(sync, Type.DATA_END, 0, 2, b"x" * (LONGEST + 1))
    assert header(sync)[:2] == (Type.ERROR, 4)
    send(sync, Type.DATA_END, 0, 4, b"*OPC?")
    assert header(sync)[3] == b"1\n"


def test_hislip_an_unknown_message_is_refused_on_either_channel(served):
    sync, aside = channels(served)
    for channel in (sync, aside):
        send(channel, 200, payload=b"?")
        assert header(channel)[:2] == (Type.ERROR, 1)
    send(aside, Type.ASYNC_REMOTE_LOCAL_CONTROL, 3)
    assert header(aside)[0] == Type.ASYNC_REMOTE_LOCAL_RESPONSE


@pytest.mark.parametrize(
    ("first", "code"),
    [
        ((Type.DATA_END, 0, 0, b"*IDN?"), 3),
        ((Type.INITIALIZE, 0, 0x01000000, b"hislip7"), 3),
        ((Type.ASYNC_INITIALIZE, 0, 4711), 3),
    ],
)
def test_hislip_a_wrong_beginning_is_told_and_ends(served, first, code):
    bare = served.bare("hislip")
    send(bare, *first)
    assert header(bare)[:2] == (Type.FATAL_ERROR, code)
    with pytest.raises(EOFError):
        header(bare)


def test_hislip_one_channel_alone_carries_nothing(served):
    sync = served.bare("hislip")
    send(sync, Type.INITIALIZE, 0, 0x01000000, b"hislip0")
    header(sync)
    send(sync, Type.DATA_END, 0, 2, b"*IDN?")
    assert header(sync)[:2] == (Type.FATAL_ERROR, 2)


@pytest.mark.parametrize("words", [b"", b"HS\0"])
def test_hislip_a_connection_that_does_not_begin_is_closed(served, monkeypatch, words):
    monkeypatch.setattr("instruments.virtual.servers.hislip.FIRST_WORDS", 0.01)
    bare = served.bare("hislip")
    bare.sendall(words)
    assert bare.recv(10) == b""


def test_hislip_a_second_channel_that_does_not_come_ends_the_first(served, monkeypatch):
    monkeypatch.setattr("instruments.virtual.servers.hislip.FIRST_WORDS", 0.01)
    sync = served.bare("hislip")
    send(sync, Type.INITIALIZE, 0, 0x01000000, b"hislip0")
    header(sync)
    assert sync.recv(10) == b""


@pytest.mark.parametrize("which", [0, 1])
def test_hislip_either_channel_takes_the_other_with_it(served, which):
    both = channels(served)
    both[which].close()
    assert both[1 - which].recv(10) == b""


def test_hislip_a_trigger_is_one(served):
    client = served.hislip()
    client.trigger()
    until(lambda: served.thing.triggers == 1)


# --- VXI-11 ---


def created(client):
    error, link, port, longest = client.create_link(1, False, 0, "inst0")
    assert error == 0
    return link, port, longest


def test_vxi11_an_unknown_device_or_link_is_refused(served):
    client = served.vxi11()
    assert client.create_link(1, False, 0, "inst7")[0] == 3
    link, *_ = created(client)
    assert client.device_write(link + 1, 0, 0, 8, b"*CLS")[0] == 4
    assert client.device_read(link + 1, 10, 0, 0, 0, 0)[0] == 4
    assert client.destroy_link(link + 1) == 4
    assert client.device_unlock(link + 1) == 4
    assert client.destroy_link(link) == 0
    assert client.device_clear(link, 0, 0, 0) == 4


def test_vxi11_a_read_ends_by_count_character_or_end_and_says_so(served):
    client = served.vxi11()
    link, *_ = created(client)
    assert client.device_write(link, 0, 0, 0, b"*ID")[0] == 0
    assert client.device_write(link, 0, 0, 8, b"N?") == (0, 2)
    assert client.device_read(link, 3, 1000, 0, 0, 0) == (0, 1, b"lev")
    assert client.device_read(link, 100, 1000, 0, 128, ord(",")) == (0, 2, b"ilab,")
    assert client.device_read(link, 100, 1000, 0, 0, 0) == (0, 4, b"thing,7,1.0\n")


def test_vxi11_reading_what_was_not_asked_for_times_out_and_is_told(served):
    client = served.vxi11()
    link, *_ = created(client)
    assert client.device_read(link, 10, 1, 0, 0, 0) == (15, 0, b"")
    client.device_write(link, 0, 0, 8, b"SYST:ERR?")
    assert client.device_read(link, 100, 1000, 0, 0, 0)[2] == b'-420,"Query UNTERMINATED"\n'


def test_vxi11_abort_ends_a_read(served):
    client = served.vxi11()
    link, port, _ = created(client)
    client.device_write(link, 0, 0, 8, b"SLOW?")
    aside = Vxi11CoreClient("127.0.0.1", port)
    served.opened.callback(aside.close)
    aside.prog = pyvisa_vxi11.DEVICE_ASYNC_PROG
    found = []
    reading = threading.Thread(target=lambda: found.append(client.device_read(link, 10, 4000, 0, 0, 0)))
    reading.start()
    packer, unpacker = aside.packer, aside.unpacker
    while reading.is_alive():
        assert aside.make_call(1, link, packer.pack_device_link, unpacker.unpack_device_error) == 0
        reading.join(0.005)
    assert found == [(23, 0, b"")]
    assert aside.make_call(1, link + 1, packer.pack_device_link, unpacker.unpack_device_error) == 4


def test_vxi11_the_other_procedures(served):
    client = served.vxi11()
    link, *_ = created(client)
    assert client.device_trigger(link, 0, 0, 0) == 0
    assert served.thing.triggers == 1
    assert client.device_remote(link, 0, 0, 0) == client.device_local(link, 0, 0, 0) == 0
    assert client.device_read_stb(link, 0, 0, 0) == (0, 0)
    assert client.device_lock(link, 0, 0) == 0
    assert client.device_unlock(link) == 0
    assert client.device_unlock(link) == 12
    assert client.device_enable_srq(link, False, b"") == 0
    assert client.device_docmd(link, 0, 0, 0, 1, True, 1, b"") == (8, b"")
    assert client.destroy_intr_chan() == 6


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


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ({"procedure": 0}, [1, 0, 0, 0, 0]),
        ({"program": 100000}, [1, 0, 0, 0, 1]),
        ({"version": 2}, [1, 0, 0, 0, 2, 1, 1]),
        ({"procedure": 99}, [1, 0, 0, 0, 3]),
        ({"procedure": 10, "parameters": b"\0\0\0\1"}, [1, 0, 0, 0, 4]),
        ({"procedure": 23, "parameters": b"\0\0\0\1"}, [1, 0, 0, 0, 0, 4]),
    ],
    ids=["null", "program", "version", "procedure", "garbage", "no link"],
)
def test_vxi11_a_call_that_cannot_be_carried_out_says_why(served, call, words):
    assert rpc(served.bare("vxi11"), **call) == words


def test_vxi11_a_record_without_end_is_cut_off(served):
    bare = served.bare("vxi11")
    bare.settimeout(AT_MOST)
    with contextlib.suppress(OSError):
        for _ in range(100):
            bare.sendall(struct.pack("!I", 1 << 16) + b"\0" * (1 << 16))
        assert bare.recv(10) == b""


def test_vxi11_links_are_destroyed_with_their_connection(served):
    client = served.vxi11()
    for _ in range(station.MOST_CLIENTS):
        created(client)
    assert client.create_link(1, False, 0, "inst0")[0] == 9
    client.close()
    until(lambda: served.vxi11().create_link(1, False, 0, "inst0")[0] == 0)
