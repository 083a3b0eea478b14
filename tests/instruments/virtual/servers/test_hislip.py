"""HiSLIP (IVI-6.1), word for word over bare sockets, and with pyvisa-py's own client."""

import asyncio
import socket
import struct

import pytest

from instruments.clock import WallClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.servers.clients import Link, ServedInstrument
from instruments.virtual.servers.hislip import HEADER, LONGEST, Channel, Client, Message, Type
from support.served import NETWORK, NO_ERROR, Thing, channels, header, send, serving, until


def test_one_session_too_many_gets_a_fatal_error(served, monkeypatch):
    monkeypatch.setattr("instruments.virtual.servers.clients.MOST_CLIENTS", 1)
    channels(served)
    one_more = served.bare("hislip")
    send(one_more, Type.INITIALIZE, 0, 0x01000000, b"hislip0")
    assert header(one_more)[:2] == (Type.FATAL_ERROR, 4)


def test_a_shared_lock_lets_in_who_knows_the_key(served):
    mine, yours, third = served.hislip(), served.hislip(), served.hislip()
    assert mine.async_lock_request(0.0, "key") == "success"
    assert mine.async_lock_request(0.0, "key") == "error"
    assert yours.async_lock_request(0.0, "key") == "success"
    assert third.async_lock_request(0.0, "another") == "failure"
    assert third.async_lock_request(0.0) == "failure"
    assert yours.async_lock_info() == 0
    assert yours.async_lock_release() == "success shared"


def test_device_clear_of_a_client_kept_out_does_not_wait(served):
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


@pytest.mark.parametrize("version", [0x0100, 0x0101, 0x0200, 0x0300])
def test_an_answer_bears_the_number_of_its_question(served, version):
    sync, _ = channels(served, version)
    send(sync, Type.DATA, 0, 0xFFFFFF00, b"*O")
    send(sync, Type.DATA_END, 0, 0xFFFFFF02, b"PC?\n")
    assert header(sync) == (Type.DATA_END, 0, 0xFFFFFF02, b"1\n")


def test_a_question_before_the_answer_is_ready_interrupts_it(served):
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


def test_an_answer_that_was_not_read_is_in_the_error_queue(served):
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


def test_a_message_between_the_halves_of_a_device_clear_is_dropped(served):
    sync, aside = channels(served)
    send(aside, Type.ASYNC_DEVICE_CLEAR)
    assert header(aside)[0] == Type.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE
    send(sync, Type.DATA_END, 0, 2, b"LEV 5")
    send(sync, Type.DEVICE_CLEAR_COMPLETE, 1)
    assert header(sync) == (Type.DEVICE_CLEAR_ACKNOWLEDGE, 0, 0, b"")  # synchronized mode, though overlap was wished
    send(sync, Type.DATA_END, 0, 4, b"LEV?")
    assert float(header(sync)[3]) == 0


def test_messages_are_as_long_as_the_client_takes_them(served):
    sync, aside = channels(served)
    send(aside, Type.ASYNC_MAXIMUM_MESSAGE_SIZE, payload=struct.pack("!Q", 26))
    kind, _, _, size = header(aside)
    assert (kind, size) == (Type.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE, struct.pack("!Q", LONGEST))
    send(sync, Type.DATA_END, 0, 2, b"*IDN?")
    assert [header(sync)[::3] for _ in range(2)] == [(Type.DATA, b"levilab,th"), (Type.DATA_END, b"ing,7,1.0\n")]


def test_a_message_that_is_too_long_is_refused_and_skipped(served):
    sync, _ = channels(served)
    send(sync, Type.DATA_END, 0, 2, b"x" * (LONGEST + 1))
    assert header(sync)[:2] == (Type.ERROR, 4)
    send(sync, Type.DATA_END, 0, 4, b"*OPC?")
    assert header(sync)[3] == b"1\n"


def test_an_unknown_message_is_refused_on_either_channel(served):
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
def test_a_wrong_beginning_gets_a_fatal_error_and_ends(served, first, code):
    bare = served.bare("hislip")
    send(bare, *first)
    assert header(bare)[:2] == (Type.FATAL_ERROR, code)
    with pytest.raises(EOFError):
        header(bare)


def test_a_header_that_does_not_begin_with_hs_gets_a_fatal_error(served):
    bare = served.bare("hislip")
    bare.sendall(HEADER.pack(b"SH", Type.INITIALIZE, 0, 0x01000000, 0))
    assert header(bare)[:2] == (Type.FATAL_ERROR, 1)


def test_a_client_that_leaves_within_a_header_is_no_failure(caplog):
    with serving() as served, served.bare("hislip") as leaving:
        send(leaving, Type.INITIALIZE, 0, 0x01000000, b"hislip0")
        header(leaving)
        leaving.sendall(b"HS\0")
        leaving.shutdown(socket.SHUT_WR)
        assert leaving.recv(1) == b""  # the server has closed it, too
    assert not caplog.records


def test_one_channel_alone_carries_nothing(served):
    sync = served.bare("hislip")
    send(sync, Type.INITIALIZE, 0, 0x01000000, b"hislip0")
    header(sync)
    send(sync, Type.DATA_END, 0, 2, b"*IDN?")
    assert header(sync)[:2] == (Type.FATAL_ERROR, 2)


@pytest.mark.parametrize("words", [b"", b"HS\0"])
def test_a_connection_that_does_not_begin_is_closed(served, monkeypatch, words):
    monkeypatch.setattr("instruments.virtual.servers.clients.FIRST_WORDS", 0.01)
    bare = served.bare("hislip")
    bare.sendall(words)
    assert bare.recv(10) == b""


def test_a_second_channel_that_does_not_come_ends_the_first(served, monkeypatch):
    monkeypatch.setattr("instruments.virtual.servers.hislip.SECOND_CHANNEL", 0.01)
    sync = served.bare("hislip")
    send(sync, Type.INITIALIZE, 0, 0x01000000, b"hislip0")
    header(sync)
    assert sync.recv(10) == b""


@pytest.mark.parametrize("which", [0, 1])
def test_either_channel_takes_the_other_with_it(served, monkeypatch, which):
    monkeypatch.setattr("instruments.virtual.servers.clients.LINGER", 0.01)
    both = channels(served)
    both[which].close()
    assert both[1 - which].recv(10) == b""


def test_a_trigger_is_one(served):
    client = served.hislip()
    client.trigger()
    until(lambda: served.thing.triggers == 1)


# --- clients that never read ---


class FullWriter:
    """The connection to a client that reads nothing: the system's buffers are full, what is written piles up."""

    def __init__(self):
        self.piled_up = 0

    def write(self, data):
        self.piled_up += len(data)

    async def drain(self):
        if self.piled_up:
            await asyncio.Event().wait()


@pytest.mark.parametrize("which", ["listen", "listen_asynchronous"])
@pytest.mark.parametrize(
    ("kind", "control", "payload"),
    [(200, 0, b""), (Type.ASYNC_LOCK, 7, b""), (Type.DATA_END, 0, b"*OPC?"), (Type.DEVICE_CLEAR_COMPLETE, 0, b"")],
    ids=["unknown", "control", "question", "clear"],
)
def test_replies_that_are_never_read_do_not_pile_up(which, kind, control, payload):
    thing = Thing(WallClock())

    async def flood():
        reader, writers = asyncio.StreamReader(), [FullWriter(), FullWriter()]
        reader.feed_data((HEADER.pack(b"HS", kind, control, 2, len(payload)) + payload) * 2000)
        client = Client(Link(ServedInstrument(VirtualBench({NETWORK: thing}), thing)), Channel(reader, writers[0]))
        client.asynchronous = Channel(reader, writers[1])
        listening = asyncio.ensure_future(getattr(client, which)())
        for _ in range(20_000):
            await asyncio.sleep(0)
        listening.cancel()
        return [writer.piled_up for writer in writers]

    assert max(asyncio.run(flood())) < 100  # one reply


class ClearedMeanwhile(FullWriter):
    """The connection to a client that begins a device clear while the server reports that its answer is interrupted."""

    client = None

    async def drain(self):
        if self.piled_up:
            self.client.clear(self.client.asynchronous, None)


def test_a_clear_drops_a_message_while_the_interruption_is_sent():
    thing = Thing(WallClock())

    async def clear_meanwhile():
        writer = ClearedMeanwhile()
        reader = asyncio.StreamReader()
        client = writer.client = Client(
            Link(ServedInstrument(VirtualBench({NETWORK: thing}), thing)), Channel(reader, FullWriter())
        )
        client.asynchronous = Channel(reader, writer)
        await client._handle(Message(Type.DATA_END, parameter=2, payload=b"SLOW?"))
        await client.link.wait_until_done()
        await client._handle(Message(Type.DATA_END, parameter=4, payload=b"LEV 5"))
        await client.link.wait_until_done()
        assert client.is_clearing()

    asyncio.run(clear_meanwhile())
    assert thing.settings["level"] == 0


@pytest.mark.parametrize("which", [0, 1])
def test_a_client_gone_before_its_replies_leaves_one_line_at_most(served, caplog, which):
    locked, other = served.hislip(), served.hislip()
    locked.async_lock_request(0.0)
    both = (locked._sync, locked._async)
    both[which].setblocking(False)
    taken = 0
    try:
        while taken < 1 << 20:
            taken += both[which].send(HEADER.pack(b"HS", 200, 0, 0, 0) * 1000)
    except BlockingIOError:
        pass  # the server takes no more
    for channel in both:
        channel.close()
    assert other.async_lock_request(600.0) == "success"  # the connection has ended
    assert len(caplog.records) <= 1
