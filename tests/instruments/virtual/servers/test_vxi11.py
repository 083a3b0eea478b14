"""VXI-11, with pyvisa-py's own client, and its remote procedure calls over bare sockets."""

import asyncio
import contextlib
import struct
import threading

import pytest
import pyvisa
from pyvisa.constants import StatusCode
from pyvisa_py.protocols import vxi11 as pyvisa_vxi11
from pyvisa_py.tcpip import Vxi11CoreClient

from instruments.virtual.servers import clients
from instruments.virtual.servers.rpc import read_record
from support.served import AT_MOST, rpc, until


def test_a_lock_keeps_another_client_out_until_it_is_given_up(served):
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


def created(client):
    error, link, port, longest = client.create_link(1, False, 0, "inst0")
    assert error == 0
    return link, port, longest


def test_an_unknown_device_or_link_is_refused(served):
    client = served.vxi11()
    assert client.create_link(1, False, 0, "inst7")[0] == 3
    link, *_ = created(client)
    assert client.device_write(link + 1, 0, 0, 8, b"*CLS")[0] == 4
    assert client.device_read(link + 1, 10, 0, 0, 0, 0)[0] == 4
    assert client.destroy_link(link + 1) == 4
    assert client.device_unlock(link + 1) == 4
    assert client.destroy_link(link) == 0
    assert client.device_clear(link, 0, 0, 0) == 4


def test_a_read_ends_by_count_character_or_end_and_says_so(served):
    client = served.vxi11()
    link, *_ = created(client)
    assert client.device_write(link, 0, 0, 0, b"*ID")[0] == 0
    assert client.device_write(link, 0, 0, 8, b"N?") == (0, 2)
    assert client.device_read(link, 3, int(1000 * AT_MOST), 0, 0, 0) == (0, 1, b"lev")
    assert client.device_read(link, 100, int(1000 * AT_MOST), 0, 128, ord(",")) == (0, 2, b"ilab,")
    assert client.device_read(link, 100, int(1000 * AT_MOST), 0, 0, 0) == (0, 4, b"thing,7,1.0\n")


def test_a_read_without_a_question_times_out_and_queues_an_error(served):
    client = served.vxi11()
    link, *_ = created(client)
    assert client.device_read(link, 10, 1, 0, 0, 0) == (15, 0, b"")
    client.device_write(link, 0, 0, 8, b"SYST:ERR?")
    assert client.device_read(link, 100, int(1000 * AT_MOST), 0, 0, 0)[2] == b'-420,"Query UNTERMINATED"\n'


def test_abort_ends_a_read(served):
    client = served.vxi11()
    link, port, _ = created(client)
    client.device_write(link, 0, 0, 8, b"SLOW?")
    aside = Vxi11CoreClient("127.0.0.1", port)
    served.opened.callback(aside.close)
    aside.prog = pyvisa_vxi11.DEVICE_ASYNC_PROG
    found = []
    reading = threading.Thread(target=lambda: found.append(client.device_read(link, 10, int(1000 * AT_MOST), 0, 0, 0)))
    reading.start()
    packer, unpacker = aside.packer, aside.unpacker
    while reading.is_alive():
        assert aside.make_call(1, link, packer.pack_device_link, unpacker.unpack_device_error) == 0
        reading.join(0.005)
    assert found == [(23, 0, b"")]
    assert aside.make_call(1, link + 1, packer.pack_device_link, unpacker.unpack_device_error) == 4


def test_the_other_procedures(served):
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
def test_a_call_that_cannot_be_carried_out_says_why(served, call, words):
    assert rpc(served.bare("vxi11"), **call) == words


def test_a_record_without_end_is_cut_off(served):
    bare = served.bare("vxi11")
    bare.settimeout(AT_MOST)
    with contextlib.suppress(OSError):
        for _ in range(100):
            bare.sendall(struct.pack("!I", 1 << 16) + b"\0" * (1 << 16))
        assert bare.recv(10) == b""


def test_links_are_destroyed_with_their_connection(served):
    client = served.vxi11()
    for _ in range(clients.MOST_CLIENTS):
        created(client)
    assert client.create_link(1, False, 0, "inst0")[0] == 9
    client.close()
    until(lambda: served.vxi11().create_link(1, False, 0, "inst0")[0] == 0)


def test_a_record_in_many_fragments_leaves_the_others_their_turn():
    turns = 0

    async def count():
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    async def read():
        reader = asyncio.StreamReader()
        reader.feed_data(struct.pack("!Ic", 1, b"x") * 10_000 + struct.pack("!I", 1 << 31))
        counting = asyncio.ensure_future(count())
        record = await read_record(reader, 1 << 20)
        counting.cancel()
        return record

    assert asyncio.run(read()) == b"x" * 10_000
    assert turns >= 10_000
