"""A counter that has hours of light to look at: meanwhile the server serves the others, and it can be stopped."""

import contextlib
import time

import numpy as np
import pytest
import pyvisa

from instruments.clock import VirtualClock, WallClock
from instruments.virtual.bench.bus import Bus
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91
from instruments.virtual.servers.server import BenchServer

#: What is waited for at most [s], reached by a failure only; and how soon another client has its answer [s].
AT_MOST, SOON = 20.0, 0.3
#: Network addresses; a dark counter, and another one.
COUNTER, OTHER = "TCPIP0::counter::inst0::INSTR", "TCPIP0::other::inst0::INSTR"
WAYS = ("socket", "hislip", "vxi11")
#: For the 53230A: a fixed level, and never a reading that is given up.
FOR_EVER = "*RST;:INP1:COUP DC;:INP1:LEV:AUTO OFF;:INP1:LEV1 0.6;:SYST:TIM MAX"


def slow_darkness(start, step, n):
    """Nothing is to be seen, and each look takes its time."""
    time.sleep(0.005)
    return np.zeros(n)


def pulses(start, step, n):
    return 0.1 + 1.1 * ((25 * (start + step * np.arange(n))) % 1 < 0.03)


class Served:
    """A server with a counter and another one, and clients to them."""

    def __init__(self, counter, clock):
        self.counter = counter
        self.server = BenchServer(Bus({COUNTER: counter, OTHER: Virtual53230A(clock, signal=pulses)}))
        self.opened = contextlib.ExitStack()

    def open(self, way, address=COUNTER):
        name = next(offer.resources[way] for offer in self.server.offers if offer.address == address)
        resource = pyvisa.ResourceManager("@py").open_resource(name, timeout=1000 * AT_MOST)
        self.opened.callback(resource.close)
        resource.read_termination = resource.write_termination = "\n"
        return resource

    def at_work(self):
        return self.counter._work is not None and not self.counter._work.done

    def ask_for_ever(self, way):
        """A client whose question is worked on for seconds."""
        client = self.open(way)
        client.write(FOR_EVER)
        client.write("READ?")
        until(self.at_work)
        return client


def until(condition):
    end = time.monotonic() + AT_MOST
    while not condition():
        assert time.monotonic() < end, "never happened"
        time.sleep(0.001)


@contextlib.contextmanager
def serving(counter, clock):
    served = Served(counter, clock)
    with served.server, served.opened:
        yield served


@pytest.fixture
def served():
    clock = WallClock()
    before = time.monotonic()
    with serving(Virtual53230A(clock, signal=slow_darkness), clock) as served:
        yield served
        before = time.monotonic()
    assert time.monotonic() - before < 1.0, "the end of the server waited for the counter"


@contextlib.contextmanager
def soon():
    before = time.monotonic()
    yield
    assert time.monotonic() - before < SOON


@pytest.mark.parametrize("way", WAYS)
def test_the_other_instruments_answer_while_a_question_is_worked_on(served, way):
    other = served.open("hislip", OTHER)
    served.ask_for_ever(way)
    with soon():
        assert "53230A" in other.query("*IDN?")
    assert served.at_work()


@pytest.mark.parametrize("way", ["hislip", "vxi11"])
def test_device_clear_gives_the_work_up_and_the_next_question_is_answered(served, way):
    client = served.ask_for_ever(way)
    with soon():
        client.clear()
        assert "53230A" in client.query("*IDN?")
    assert not served.at_work()
    assert client.query("SYST:ERR?").strip() == '+0,"No error"'


@pytest.mark.parametrize("way", WAYS)
def test_abort_by_another_client_gives_the_work_up(served, way):
    other = served.open(way)
    served.ask_for_ever("hislip")
    with soon():
        other.write("ABOR")
        assert "53230A" in other.query("*IDN?")
    assert not served.at_work()


@pytest.mark.parametrize("way", ["hislip", "vxi11"])
def test_abort_by_the_same_client_gives_the_work_up(served, way):
    client = served.ask_for_ever(way)
    with soon():
        client.write("ABOR")
        assert "53230A" in client.query("*IDN?")


@pytest.mark.parametrize("way", WAYS)
def test_who_goes_away_leaves_the_instrument_to_the_others(served, way):
    other = served.open("hislip")
    served.ask_for_ever(way).close()
    until(lambda: not served.at_work())
    assert "53230A" in other.query("*IDN?")


@pytest.mark.parametrize("way", ["hislip", "vxi11"])
def test_the_status_byte_is_told_while_a_question_is_worked_on(served, way):
    client = served.ask_for_ever(way)
    with soon():
        assert client.read_stb() == 0
    assert served.at_work()


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
    monkeypatch.setattr("instruments.virtual.bench.session.SLICE", 0.0)  # a slice is one step
    alone = Bus({COUNTER: model(VirtualClock(), signal=pulses)}).open(COUNTER)
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


def test_a_message_that_comes_in_process_waits_for_the_one_that_is_worked_on():
    counter = Virtual53230A(VirtualClock(), signal=pulses)
    bus = Bus({COUNTER: counter})
    slices = bus.open(COUNTER).slices(b"SAMP:COUN 2000;:READ?")
    next(slices)
    other = bus.open(COUNTER)
    other.write(b"SAMP:COUN?")
    assert counter._work.done
    assert other.read(100, 1e9)[0] == b"+2000\n"
    assert list(slices) == []


def test_a_counter_nobody_asked_for_long_catches_up_in_slices():
    clock = VirtualClock()
    counter = Virtual53230A(clock, signal=pulses)
    session = Bus({COUNTER: counter}).open(COUNTER)
    session.write(b"INP1:LEV:AUTO OFF;:INP1:LEV1 0.6;:INP1:COUP DC;:SAMP:COUN 1000000;:INIT")
    clock.sleep(1000.0)
    assert sum(1 for _ in session.catch_up()) > 1
    assert counter._memory.held > 5000
