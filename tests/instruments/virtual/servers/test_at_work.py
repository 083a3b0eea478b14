"""Questions that an instrument works on without end: meanwhile the server serves the others, and it can be stopped."""

import asyncio
import contextlib

import numpy as np
import pytest
import pyvisa

from instruments.clock import VirtualClock, WallClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.core.rows import Ask
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91
from instruments.virtual.servers.clients import Link, ServedInstrument
from instruments.virtual.servers.server import BenchServer
from support.served import AT_MOST, until

#: Network addresses; a busy counter, and another one.
COUNTER, OTHER = "TCPIP0::counter::inst0::INSTR", "TCPIP0::other::inst0::INSTR"
WAYS = ("socket", "hislip", "vxi11")


def pulses(start, step, n):
    return 0.1 + 1.1 * ((25 * (start + step * np.arange(n))) % 1 < 0.03)


class BusyCounter(Virtual53230A):
    """Works on ``ENDLess?`` until it is cut off, and counts the steps and its resets."""

    steps_done = resets = 0

    def __init__(self, clock):
        super().__init__(clock, signal=pulses)

    COMMON = (Ask("ENDLess", lambda d: d._work_without_end()), *Virtual53230A.COMMON)

    def _work_without_end(self):
        while True:
            self.steps_done += 1
            yield

    def reset(self):
        self.resets += 1
        super().reset()


class Served:
    """A server with a counter and another one, and clients to them."""

    def __init__(self, counter, clock):
        self.counter = counter
        self.server = BenchServer(VirtualBench({COUNTER: counter, OTHER: Virtual53230A(clock, signal=pulses)}))
        self.opened = contextlib.ExitStack()

    def open(self, way, address=COUNTER):
        name = next(offer.resources[way] for offer in self.server.endpoints if offer.address == address)
        resource = pyvisa.ResourceManager("@py").open_resource(name, timeout=1000 * AT_MOST)
        self.opened.callback(resource.close)
        resource.read_termination = resource.write_termination = "\n"
        return resource

    def at_work(self):
        return self.counter.work is not None and not self.counter.work.done

    def ask_for_ever(self, way):
        """A client whose question is worked on without end."""
        client = self.open(way)
        client.write("ENDL?")
        until(lambda: self.counter.steps_done)
        return client


@contextlib.contextmanager
def serving(counter, clock):
    served = Served(counter, clock)
    with served.server, served.opened:
        yield served


@pytest.fixture
def served(monkeypatch):
    monkeypatch.setattr("instruments.virtual.bench.session.SLICE", 1e-3)  # a turn more often costs the test less
    monkeypatch.setattr("instruments.virtual.servers.clients.LINGER", 0.05)  # the work here never ends
    clock = WallClock()
    with serving(BusyCounter(clock), clock) as served:
        yield served  # the end of the server does not wait for the counter: it would wait for ever


@pytest.mark.parametrize("way", WAYS)
def test_the_other_instruments_answer_meanwhile(served, way):
    other = served.open("hislip", OTHER)
    served.ask_for_ever(way)
    assert "53230A" in other.query("*IDN?")
    assert served.at_work()


@pytest.mark.parametrize("way", ["hislip", "vxi11"])
def test_device_clear_gives_the_work_up(served, way):
    client = served.ask_for_ever(way)
    client.clear()
    assert "53230A" in client.query("*IDN?")
    assert not served.at_work()
    assert client.query("SYST:ERR?").strip() == '+0,"No error"'


@pytest.mark.parametrize("abort", ["ABOR", "ABOR\n*CLS"], ids=["alone", "with another message"])
@pytest.mark.parametrize("way", WAYS)
def test_abort_by_another_client_gives_the_work_up(served, way, abort):
    other = served.open(way)
    served.ask_for_ever("hislip")
    other.write(abort)
    assert "53230A" in other.query("*IDN?")
    assert not served.at_work()


@pytest.mark.parametrize("way", ["hislip", "vxi11"])
def test_abort_by_the_same_client_gives_the_work_up(served, way):
    client = served.ask_for_ever(way)
    client.write("ABOR")
    assert "53230A" in client.query("*IDN?")


@pytest.mark.parametrize("way", WAYS)
def test_who_goes_away_leaves_the_instrument_to_the_others(served, way):
    other = served.open("hislip")
    served.ask_for_ever(way).close()
    until(lambda: not served.at_work())
    assert "53230A" in other.query("*IDN?")


@pytest.mark.parametrize("way", ["hislip", "vxi11"])
def test_the_status_byte_can_be_read_meanwhile(served, way):
    client = served.ask_for_ever(way)
    assert client.read_stb() == 0
    assert served.at_work()


@pytest.mark.parametrize("way", ["hislip", "vxi11"])
def test_reading_before_the_answer_is_worked_out_is_no_error(served, way):
    client = served.ask_for_ever(way)
    client.timeout = 20
    with pytest.raises(pyvisa.VisaIOError):
        client.read()
    client.timeout = 1000 * AT_MOST
    client.clear()
    assert client.query("SYST:ERR?").strip() == '+0,"No error"'


# --- floods ---


class Bench:
    """Links to a counter on an event loop; its clock jumps, so waiting costs the bench's time alone."""

    def __init__(self, monkeypatch):
        monkeypatch.setattr("instruments.virtual.bench.session.SLICE", -1.0)  # a slice is one step
        self.clock = VirtualClock()
        self.counter = BusyCounter(self.clock)
        self.instrument = ServedInstrument(VirtualBench({COUNTER: self.counter}), self.counter)

    def link(self, *, stream=False):
        return Link(self.instrument, stream=stream)

    async def ask(self, link, question):
        """When the answer to a question is there [s]."""
        assert await link.write(question)
        while link.seconds_until_ready() != 0.0:
            await asyncio.sleep(0)
        link.take(1 << 20)
        return self.clock.now()


@pytest.mark.parametrize("stream", [True, False], ids=["stream", "marked"])
@pytest.mark.parametrize("floods", [1, 3])
def test_a_flood_of_commands_does_not_mute_the_instrument(monkeypatch, stream, floods):
    bench = Bench(monkeypatch)

    async def ask_while_flooded():
        for _ in range(floods):
            await bench.link(stream=stream).write(b"*CLS\n" * 10_000)  # 20 s of work
        other = bench.link()
        return [bench.clock.now(), *[await bench.ask(other, b"*IDN?\n") for _ in range(5)]]

    times = np.diff(asyncio.run(ask_while_flooded()))
    # those that wait in turn, the question itself, and the one under way
    assert times.max() <= (floods + 2) * bench.counter.pace * (1 + 1e-6)


def test_questions_that_are_never_read_do_not_mute_the_instrument(monkeypatch):
    bench = Bench(monkeypatch)

    async def ask_while_flooded():
        await bench.link().write(b"*OPC?\n" * 10_000)
        return await bench.ask(bench.link(), b"*IDN?\n")

    assert asyncio.run(ask_while_flooded()) <= 4 * bench.counter.pace


def test_one_long_line_leaves_the_others_their_turn(monkeypatch):
    bench = Bench(monkeypatch)

    async def turns_meanwhile():
        assert await bench.link().write(b"*RST;" * 20_000)
        turns = 0
        while bench.counter.resets < 20_000:
            before = bench.counter.resets
            await asyncio.sleep(0)
            turns += 1
            assert bench.counter.resets - before <= 2
        return turns

    assert asyncio.run(turns_meanwhile()) >= 10_000


def test_a_flood_of_triggers_does_not_keep_the_instrument_from_its_work(monkeypatch):
    bench = Bench(monkeypatch)

    async def trigger_meanwhile():
        assert await bench.link().write(b"*RST;" * 100)
        other = bench.link()
        for _ in range(200):
            other.trigger()
            await asyncio.sleep(0)

    asyncio.run(trigger_meanwhile())
    assert bench.counter.resets == 100


def test_empty_lines_leave_the_others_their_turn(monkeypatch):
    bench = Bench(monkeypatch)

    async def turns_meanwhile():
        link = bench.link()
        assert await link.write(b"\n" * (1 << 18))
        turns = 0
        while link.is_busy():
            await asyncio.sleep(0)
            turns += 1
        return turns

    assert asyncio.run(turns_meanwhile()) >= 63  # a turn after every 4096 bytes


# --- locks ---


async def turns(n=300):
    for _ in range(n):
        await asyncio.sleep(0)


@pytest.mark.parametrize("message", [b"ABOR\n", b"ABOR\n*CLS\n"], ids=["alone", "with another message"])
def test_who_is_kept_out_does_not_abort_the_holders_measurement(monkeypatch, message):
    bench = Bench(monkeypatch)

    async def abort():
        holder, other = bench.link(), bench.link(stream=True)
        assert await holder.lock(None, 0.0)
        assert await holder.write(b"ENDL?\n")
        assert await other.write(message)
        await turns()
        yield bench.instrument.working
        holder.unlock()
        await turns()
        yield bench.instrument.working

    assert asyncio.run(collected(abort())) == [True, False]


async def collected(values):
    return [value async for value in values]


def test_a_command_that_waits_its_turn_waits_for_a_lock_given_meanwhile(monkeypatch):
    bench = Bench(monkeypatch)

    async def lock_meanwhile():
        busy, waiting, holder = bench.link(), bench.link(stream=True), bench.link()
        assert await busy.write(b"ENDL?\n")
        assert await waiting.write(b"*RST\n")
        await turns()
        assert await holder.lock(None, 0.0)
        assert await holder.write(b"ABOR\n")
        await turns()
        assert not bench.instrument.working
        yield bench.counter.resets
        holder.unlock()
        await turns()
        yield bench.counter.resets

    assert asyncio.run(collected(lock_meanwhile())) == [0, 1]


# --- the same, in slices ---


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("model", "messages"),
    [
        (Virtual53230A, ["INP1:COUP DC;:INP1:LEV:AUTO OFF;:INP1:LEV1 0.6", "SAMP:COUN 300", "READ?"]),
        (VirtualCNT91, ["CONF:ARR:FREQ:BTB (300),(@1);:INP1:COUP DC;:INP1:LEV .6", "READ:ARR? 300"]),
    ],
    ids=["53230A", "CNT-91"],
)
def test_in_slices_the_same_is_measured_as_at_once(way, model, messages, monkeypatch):
    monkeypatch.setattr("instruments.virtual.bench.session.SLICE", -1.0)  # a slice is one step
    alone = VirtualBench({COUNTER: model(VirtualClock(), signal=pulses)}).open(COUNTER)
    for message in messages:
        alone.write(message.encode())
    expected, _ = alone.read(1 << 20, 1e9)
    clock = VirtualClock()
    with serving(model(clock, signal=pulses), clock) as served:
        client = served.open(way)
        for message in messages:
            client.write(message)
        got = client.read().strip().split(",")
    assert len(got) == 300
    assert np.array(got, float) == pytest.approx(np.array(expected.decode().split(","), float), rel=1e-12)


def test_a_message_that_comes_in_process_waits_for_the_one_before(monkeypatch):
    monkeypatch.setattr("instruments.virtual.bench.session.SLICE", -1.0)  # a slice is one step
    counter = Virtual53230A(VirtualClock(), signal=pulses)
    bus = VirtualBench({COUNTER: counter})
    asking, other = bus.open(COUNTER), bus.open(COUNTER)
    work = asking.begin("SAMP:COUN 2000;:READ?")
    assert asking.go_on(work)
    other.write(b"SAMP:COUN?")
    assert not asking.go_on(work)
    assert other.read(100, 1e9)[0] == b"+2000\n"
    assert asking.read(1 << 20, 1e9)[0].count(b",") == 1999


def test_a_counter_that_was_not_asked_for_long_catches_up_in_slices(monkeypatch):
    monkeypatch.setattr("instruments.virtual.bench.session.SLICE", -1.0)  # a slice is one step
    clock = VirtualClock()
    counter = Virtual53230A(clock, signal=pulses)
    session = VirtualBench({COUNTER: counter}).open(COUNTER)
    session.write(b"INP1:LEV:AUTO OFF;:INP1:LEV1 0.6;:INP1:COUP DC;:SAMP:COUN 1000000;:INIT")
    clock.sleep(400.0)
    work = session.catch_up()
    assert session.go_on(work)
    while session.go_on(work):
        pass
    assert counter._memory.size > 2000
