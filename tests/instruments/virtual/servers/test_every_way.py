"""The virtual bench over real sockets on loopback, with other people's clients: what holds on every way."""

import contextlib
import os
import socket
import struct
import threading
import time

import pytest

from instruments.clock import VirtualClock, WallClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.faults import Fault
from instruments.virtual.servers import clients
from instruments.virtual.servers.hislip import Type
from instruments.virtual.servers.server import ListenAt
from support.served import (
    ALL,
    AT_MOST,
    BLOCK,
    MARKED,
    NO_ERROR,
    SLOW,
    Thing,
    channels,
    rpc,
    send,
    serving,
    times_out,
    until,
    welcome,
)


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
def test_what_is_not_understood_gets_no_answer(served, way):
    client = served.open(way)
    client.write("FOO?")
    assert times_out(client)
    assert client.query("SYST:ERR?").strip() == '-113,"Undefined header;FOO"'


@pytest.mark.parametrize("way", MARKED)
def test_device_clear_ends_a_slow_answer(served, way):
    client = served.open(way)
    client.write("SLOW?")
    assert times_out(client)
    client.clear()
    assert client.query("*OPC?").strip() == "1"
    assert client.query("SYST:ERR?").strip() == NO_ERROR


@pytest.mark.parametrize("way", MARKED)
def test_the_status_byte_shows_an_error_and_an_answer(served, way):
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
    served.open("socket").query("LEV 3;*OPC?")
    assert float(served.open("hislip").query("LEV?")) == 3
    assert float(served.open("vxi11").query("LEV?")) == 3


def test_an_error_in_an_instrument_costs_one_connection(served, caplog):
    with served.bare("socket") as bare:
        bare.sendall(b"FAIL?\n")
        assert bare.recv(10) == b""
    assert "ZeroDivisionError" in caplog.text
    assert served.open("socket").query("*OPC?").strip() == "1"


def test_a_connection_that_fails_does_not_keep_others_away(served, monkeypatch, caplog):
    first = iter([RuntimeError("for once")])

    def reachable(device):
        for error in first:
            raise error
        return True

    monkeypatch.setattr(served.server.bench, "reachable", reachable)
    served.bare("socket")
    other = served.open("socket")
    assert other.query("*IDN?").strip() == Thing.identity
    assert "could not be accepted" in caplog.text


@pytest.mark.parametrize("way", ["socket", "hislip", "vxi11"])
def test_one_client_too_many_is_sent_away_until_another_leaves(served, way):
    crowd = [served.bare(way) for _ in range(clients.MOST_CLIENTS * (2 if way == "hislip" else 1))]
    for client in crowd:
        client.sendall(b"H")  # who says nothing makes way
    until(lambda: not welcome(served, way))
    crowd[0].close()
    until(lambda: welcome(served, way))


@pytest.mark.parametrize("way", ["socket", "hislip", "vxi11"])
def test_who_says_nothing_makes_way_where_all_places_are_taken(served, way):
    silent = [served.bare(way) for _ in range(clients.MOST_CLIENTS * (2 if way == "hislip" else 1))]
    until(lambda: welcome(served, way))
    assert silent[0].recv(1) == b""


def test_a_clock_that_jumps_jumps_to_every_answer():
    with serving(clock=VirtualClock()) as served:
        assert served.open("socket").query("SLOW?").strip() == "slow"
        assert served.thing.clock.now() == pytest.approx(SLOW)


def test_a_faster_bench_answers_sooner():
    with serving(clock=WallClock(speed=1e5)) as served:
        before = time.monotonic()
        for way in ("socket", *MARKED):  # an hour each
            assert served.open(way).query("SLOW?").strip() == "slow"
        assert time.monotonic() - before > 3 * (SLOW / 1e5 - 0.001)


def in_a_row():
    """The first of ten ports that are free, below those that systems give away."""
    for first in range(15_000 + 10 * (os.getpid() % 1000), 32_000, 10):
        with contextlib.suppress(OSError), contextlib.ExitStack() as held:
            for port in range(first, first + 10):
                held.enter_context(socket.create_server(("127.0.0.1", port)))
            return first
    pytest.fail("no ports are free")


def test_a_port_that_is_taken_leaves_nothing_open():
    first = in_a_row()
    with socket.create_server(("127.0.0.1", first + 2)):
        with pytest.raises(OSError, match=str(first + 2)), serving(listen_at=ListenAt(port_base=first)):
            pass
        with socket.create_server(("127.0.0.1", first)):
            pass


def test_ports_are_counted_from_the_first_one():
    first = in_a_row()
    with serving(listen_at=ListenAt(port_base=first)) as served:
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
def test_a_link_that_is_cut_in_an_answer_is_closed(served, way):
    served.server.bench.faults.append(Fault("disconnected", question=r"\*IDN\?"))
    assert b"1.0\n" not in cut(served, way)
    assert served.open(way).query("*IDN?").strip() == Thing.identity


def test_an_instrument_that_is_away_takes_no_connection(served):
    served.server.bench.unreachable_until[id(served.thing)] = served.thing.clock.now() + 3600
    assert not any(welcome(served, way) for way in ("socket", "hislip", "vxi11"))
    served.server.bench.unreachable_until[id(served.thing)] = served.thing.clock.now()
    assert all(welcome(served, way) for way in ("socket", "hislip", "vxi11"))


# --- locks ---


def test_a_lock_is_waited_for_and_ends_with_its_connection(served):
    mine, yours = served.vxi11(), served.hislip()
    mine.create_link(1, True, 0, "inst0")
    assert yours.async_lock_request(0.0) == "failure"
    assert yours.async_lock_info() == 1
    threading.Timer(0.02, mine.close).start()
    assert yours.async_lock_request(AT_MOST) == "success"
    assert yours.async_lock_release() == "success"
    assert yours.async_lock_release() == "error"


@pytest.mark.parametrize("way", ["hislip", "socket", "serial"])
def test_who_is_kept_out_waits_and_is_served_then(served, way):
    holder = VirtualBench.session(served.server.bench, served.serial if way == "serial" else served.thing, stream=False)
    holder.client_lock.acquire(holder, None)
    client = served.open(way)
    client.write("*OPC?")
    assert times_out(client)
    holder.close()
    assert client.read().strip() == "1"
