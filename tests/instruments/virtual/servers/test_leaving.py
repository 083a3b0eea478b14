"""A client that has said all and leaves: what it has sent is worked on, and what it asked is answered.

Everything is in memory, on an event loop that jumps to its next timer.
"""

import asyncio
import contextlib
import struct

import pytest

from instruments.clock import WallClock
from instruments.ieee488 import INFINITY, NOT_A_NUMBER
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.core.signal import no_signal
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.servers.clients import LINGER, Link, ServedInstrument
from instruments.virtual.servers.hislip import HEADER, HislipServer, Type
from instruments.virtual.servers.streams import socket_listener
from instruments.virtual.servers.vxi11 import Vxi11Server
from support.served import NETWORK, Thing

#: How long a message holds the instrument [s], and commands that it is then busy with for 1.1 s.
PACE, COMMANDS = 0.1, [b"LEV 1"] * 10 + [b"LEV 7"]


class VirtualTime(asyncio.SelectorEventLoop):
    """An event loop that jumps to the next timer instead of waiting for it."""

    def __init__(self):
        self.now = 0.0
        super().__init__()
        select = self._selector.select

        def jump(timeout):
            self.now += timeout or 0.0
            return select(0)

        self._selector.select = jump

    def time(self):
        return self.now


@pytest.fixture
def loop(monkeypatch):
    loop = VirtualTime()
    monkeypatch.setattr("instruments.clock.time.monotonic", lambda: loop.now)
    with contextlib.closing(loop):
        yield loop


@pytest.fixture
def instrument(loop):
    thing = Thing(WallClock())
    thing.pace = PACE
    return ServedInstrument(VirtualBench({NETWORK: thing}), thing)


class Leaving:
    """The far end of a connection: sends some bytes after each answer, at last its end, and keeps what it gets."""

    def __init__(self, *sent, end=True):
        self.reader = asyncio.StreamReader()
        self.got = b""
        self._left = [*sent]
        self._end = end
        self._send()

    def _send(self):
        if self._left:
            self.reader.feed_data(self._left.pop(0))
        elif self._end:
            self._end = False
            self.reader.feed_eof()

    def write(self, data):
        self.got += data
        self._send()

    async def drain(self):
        pass


async def over_a_stream(instrument, messages):
    client = Leaving(b"".join(message + b"\n" for message in messages))
    client.reader.feed_eof()
    await socket_listener(instrument)._talk(client.reader, client)
    return client.got


async def over_hislip(instrument, messages):
    server = HislipServer(instrument)
    sent = b"".join(
        HEADER.pack(b"HS", Type.DATA_END, 0, 2 * n, len(message)) + message for n, message in enumerate(messages)
    )
    sync = Leaving(HEADER.pack(b"HS", Type.INITIALIZE, 0, 0x01000000, 7) + b"hislip0", end=False)
    serving = asyncio.ensure_future(server._talk(sync.reader, sync))
    await asyncio.sleep(0.001)
    aside = Leaving(HEADER.pack(b"HS", Type.ASYNC_INITIALIZE, 0, 1, 0), end=False)
    serving_aside = asyncio.ensure_future(server._talk(aside.reader, aside))
    await asyncio.sleep(0.001)
    sync.reader.feed_data(sent)
    for channel in (sync, aside):
        channel.reader.feed_eof()
    await asyncio.wait([serving, serving_aside])
    for ended in (serving, serving_aside):
        assert isinstance(ended.exception(), EOFError | None)


def call(procedure, parameters):
    record = struct.pack("!10I", 7, 0, 2, 0x0607AF, 1, procedure, 0, 0, 0, 0) + parameters
    return struct.pack("!I", 1 << 31 | len(record)) + record


async def over_vxi11(instrument, messages, *, destroys=True):
    writes = (
        struct.pack("!5I", 1, 10_000, 0, 8, len(message)) + message + bytes(-len(message) % 4) for message in messages
    )
    client = Leaving(
        call(10, struct.pack("!4I8s", 1, 0, 0, 5, b"inst0")),
        *(call(11, parameters) for parameters in writes),
        *([call(23, struct.pack("!I", 1))] if destroys else []),
    )
    with contextlib.suppress(EOFError):
        await Vxi11Server(instrument)._talk(client.reader, client)


async def over_vxi11_without_a_word(instrument, messages):
    await over_vxi11(instrument, messages, destroys=False)


WAYS = [over_a_stream, over_hislip, over_vxi11, over_vxi11_without_a_word]


@pytest.mark.parametrize("others", [0, 2], ids=["alone", "beside others"])
@pytest.mark.parametrize("way", WAYS)
def test_what_a_client_sent_before_it_left_is_worked_on(loop, instrument, way, others):
    async def leave_early():
        flood = [Link(instrument) for _ in range(others)]
        for link in flood:
            await link.write(b"*CLS\n" * 20)
        await way(instrument, COMMANDS)
        for link in flood:
            link.close()

    loop.run_until_complete(leave_early())
    assert instrument.device.settings["level"] == 7


def test_a_client_of_hislip_that_gets_no_lock_in_time_is_let_go(loop, instrument):
    async def leave_locked_out():
        holder = Link(instrument)
        await holder.lock(None, 0.0)
        await over_hislip(instrument, COMMANDS)
        holder.close()

    loop.run_until_complete(leave_locked_out())
    assert instrument.device.settings["level"] == 0
    assert loop.now == pytest.approx(LINGER, abs=0.01)


def test_a_stream_client_that_has_said_all_gets_a_late_answer(loop, instrument):
    got = loop.run_until_complete(over_a_stream(instrument, [b"SLOW?", b"*IDN?"]))
    assert got.splitlines() == [b"slow", Thing.identity.encode()]


def test_a_stream_client_whose_answer_never_comes_is_let_go(loop, instrument):
    instrument.device.busy_until(INFINITY)
    assert loop.run_until_complete(over_a_stream(instrument, [b"*IDN?"])) == b""
    assert loop.now < 3 * LINGER


# --- a question that holds the instrument ends with its client ---


GATE = b"SENS:FREQ:GATE:TIME 100;:SYST:TIM 2000;:READ?"
HOLDS = {"no trigger": b"TRIG:SOUR EXT;:READ?", "a long gate": GATE, "many questions": b";".join([b"*IDN?"] * 20_000)}


@pytest.fixture
def counter(loop):
    """A counter whose input is dark."""
    device = Virtual53230A(WallClock(), signal=no_signal)
    return ServedInstrument(VirtualBench({NETWORK: device}), device)


async def identity_in_time(link):
    """Return the answer to ``*IDN?``, which must come within a second."""
    await link.write(b"*IDN?\n")
    assert await link.wait_for_answer(1.0)
    return link.take(1 << 10)[0].decode().strip()


@pytest.mark.parametrize("question", HOLDS.values(), ids=HOLDS)
def test_what_a_stream_client_has_asked_ends_when_it_leaves(loop, counter, question):
    async def ask_and_leave():
        other = Link(counter, stream=True)
        assert await over_a_stream(counter, [question]) == b""
        return await identity_in_time(other)

    assert loop.run_until_complete(ask_and_leave()) == counter.device.identity
    assert loop.now < 3 * LINGER


def test_a_client_that_still_waits_makes_way_for_the_next_one(loop, counter):
    async def ask_and_wait():
        waiting = asyncio.ensure_future(over_a_stream(counter, [GATE]))
        await asyncio.sleep(20 * LINGER)
        assert not waiting.done()  # its answer comes after 200 s
        answer = await identity_in_time(Link(counter, stream=True))
        assert await waiting == b""
        return answer

    assert loop.run_until_complete(ask_and_wait()) == counter.device.identity


def test_the_answer_to_another_client_outlives_the_one_that_leaves(loop, counter):
    async def ask_and_let_the_other_leave():
        measures = Link(counter, stream=True)
        await measures.write(b"SENS:FREQ:GATE:TIME 2;:SYST:TIM 4;:READ?\n")
        await measures.wait_until_done()
        await over_a_stream(counter, [b"*IDN?"])
        assert await measures.wait_for_answer(10.0)
        return measures.take(1 << 10)[0]

    assert float(loop.run_until_complete(ask_and_let_the_other_leave())) == NOT_A_NUMBER
    assert loop.now == pytest.approx(4.0, abs=0.1)
