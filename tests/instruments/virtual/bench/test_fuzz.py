"""Whatever comes over the wire, in either direction: nothing hangs, crashes or grows, and it works on afterwards."""

import contextlib
import itertools
import math
import tracemalloc

import pytest
import serial
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, rule, run_state_machine_as_test

from fuzz_targets import TARGETS
from instruments.errors import BadAnswer, InstrumentError
from instruments.links.serial_port import SerialTransport
from instruments.links.visa import VisaTransport
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.faults import FAULTS, LATE, Fault
from instruments.virtual.bench.serial_line import benches
from instruments.virtual.bench.session import MOST_ANSWERS
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.core.device import Answer
from support import hostile
from support.models import FAMILIES, KIND_OF, ROWS, SERIAL, calls, measure

#: `make explore` draws 1000: here 20 examples reach nearly as many lines of instruments/ (6523) as 30 do (6538), in two
#: thirds of the time.  A machine that is busy is no reason to fail.
EXPLORING = settings.get_current_profile_name() == "explore"
FEW = settings(max_examples=1000 if EXPLORING else 20, deadline=None, suppress_health_check=list(HealthCheck))
#: For a model whose twin is another one's with other numbers.
VERY_FEW = settings(FEW, max_examples=1000 if EXPLORING else 4)


def some(name):
    """How many examples a model is worth."""
    return FEW if name in FAMILIES else VERY_FEW


# --- messages ---


def parameters(device):
    word, nasty = st.sampled_from(hostile.words(device)), st.sampled_from(hostile.NASTY)
    number = st.one_of(st.integers(-3, 20), st.floats(allow_nan=False)).map(str)
    block = st.binary(max_size=40).map(lambda data: f"#{len(str(len(data)))}{len(data)}{data.decode('latin-1')}")
    text = st.text(st.characters(max_codepoint=255), max_size=20)
    single = st.one_of(word, nasty, nasty, number, block, text)
    return st.one_of(st.just(""), word, single, st.lists(single, max_size=9).map(",".join))


def units(device):
    header = st.sampled_from(hostile.headers(device))
    question = st.sampled_from([header for header in hostile.headers(device) if header.endswith("?")])
    whole = st.tuples(st.sampled_from(["", ":"]), header, st.sampled_from([" ", "", "\t"]), parameters(device))
    return st.one_of(whole.map("".join), question)


#: What a message is cut apart at.
MARKS = (*"?;:,()\"'\\# \t\n\xb5", ";:", "(@", "\r\n")


def messages(device):
    """Compounds of the instrument's own commands with any parameters, pieces of these in any order, and noise."""
    compound = st.lists(units(device), min_size=1, max_size=4).map(";".join)
    piece = st.sampled_from((*hostile.headers(device), *hostile.words(device), *MARKS * 20))
    text, jumble = (
        drawn.map(lambda message: message.encode("latin-1"))
        for drawn in (compound, st.lists(piece, max_size=30).map("".join))
    )
    return st.one_of(text, text, text, jumble, st.binary(max_size=60))


MESSAGES = {name: messages(hostile.instrument(name)) for name in hostile.NAMES}


@pytest.mark.parametrize("stream", [False, True], ids=["messages", "stream"])
@pytest.mark.parametrize("name", hostile.NAMES)
def test_no_message_makes_an_instrument_crash_hang_or_grow(name, stream):
    @some(name)
    @given(st.lists(st.tuples(MESSAGES[name], st.sampled_from([None, 0.0, 0.01, 1.0, 30.0])), max_size=12))
    def any_messages(sent):
        bench = hostile.Bench(name, stream=stream)
        for message, timeout in sent:
            bench.send(message + b"\n")
            if timeout is not None:
                bench.read(timeout)
        bench.recover()

    any_messages()


@pytest.mark.parametrize("name", ["53230A", "33500B", "425"])
def test_bytes_cut_anywhere_make_the_same_messages(name):
    """One with blocks among them; core/test_message.py cuts what all of them read messages with."""

    @FEW
    @given(st.lists(MESSAGES[name], min_size=1, max_size=4).map(b"\n".join), st.lists(st.integers(1, 30), min_size=1))
    def any_cuts(data, sizes):
        data += b"\n"
        whole, pieces = hostile.Bench(name, stream=True), hostile.Bench(name, stream=True)
        whole.send(data)
        place = 0
        for size in itertools.cycle(sizes):
            pieces.send(data[place : place + size])
            place += size
            if place >= len(data):
                break
        assert pieces.device.settings == whole.device.settings
        assert pieces.device.parser.errors == whole.device.parser.errors
        assert pieces.read() == whole.read()

    any_cuts()


@pytest.mark.parametrize("name", ["53230A", "33500B", "DS1000Z", "475"])
def test_an_instrument_that_is_talked_to_for_long_keeps_no_more_memory(name):
    bench = hostile.Bench(name)
    every = hostile.headers(bench.device)
    nasty = [word for word in hostile.NASTY if len(word) < 1000]

    def talk(turns):
        for k in range(turns):
            header = every[7 * k % len(every)]
            if not header.upper().startswith(("DATA", "SOUR:DATA", "*SAV")):  # what is there to keep
                bench.send(f"{header} {nasty[k % len(nasty)]}".encode("latin-1"))
            bench.send(b"NO%d:SUCH%d %d" % (k, k, k))
        bench.recover()

    talk(200)  # all that is made once is there
    tracemalloc.start()
    try:
        talk(50)
        before, _ = tracemalloc.get_traced_memory()
        talk(200)
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # a kilobyte kept of each message would be 0.4 MB
    assert after - before < 150_000


# --- what was found ---


@pytest.mark.parametrize(
    ("name", "message", "number"),
    [
        ("53230A", "CONF:FREQ (@" + "9" * 5000 + ")", -224),  # longer than Python makes a whole number of
        ("CNT-91", "MEAS:FREQ? (@" + "9" * 5000 + ")", -224),
        ("33500B", "DATA:ARB T,#\xb2\xb2", -102),  # a digit, but no number
        ("33500B", "DATA:ARB T,#3\xb2\xb3\xb9", -102),
    ],
)
def test_a_number_that_is_none_is_refused(name, message, number):
    bench = hostile.Bench(name)
    bench.send(message.encode("latin-1"))
    assert [int(entry.split(",")[0]) for entry in bench.device.parser.errors] == [number]
    bench.recover()


@pytest.mark.parametrize("name", ["53230A", "DSOX1000"])
def test_a_program_that_waits_for_ever_for_nothing_leaves_the_clock_alone(name):
    bench = hostile.Bench(name)
    assert bench.session.read(100, math.inf) is None
    never = b"TRIG:SOUR BUS;:INIT;*OPC?" if name == "53230A" else b":TRIG:SWE NORM;:TRIG:SOUR EXT;:DIG;*OPC?"
    bench.send(never)
    assert bench.session.read(100, math.inf) is None
    assert bench.room.clock.now() < 1.0
    bench.recover()


def test_a_program_that_asks_and_never_reads_gets_an_error_alone():
    bench = hostile.Bench("33500B", stream=True)
    bench.send(b"*IDN?\n" * 3 * MOST_ANSWERS)
    assert len(bench.session._answers) <= MOST_ANSWERS
    bench.session.clear()
    bench.send(b"SYST:ERR?\n")
    assert bench.read()[0] == b'-430,"Query DEADLOCKED"\n'
    bench.send(b"*CLS\n")
    bench.recover()


def test_a_trigger_that_nothing_waits_for_is_in_the_error_queue():
    bench = hostile.Bench("33500B")
    bench.session.trigger()
    bench.send(b"SYST:ERR?")
    assert bench.read()[0] == b'-211,"Trigger ignored"\n'


@pytest.mark.parametrize("name", ["framer", "blocks", "hislip", "vxi11"])
def test_no_bytes_break_a_framer_a_block_reader_or_a_server(name):
    target = TARGETS[name]()
    piece = st.tuples(st.integers(0, 255), st.binary(max_size=40)).map(
        lambda drawn: bytes([drawn[0], len(drawn[1])]) + drawn[1]
    )
    seed = st.sampled_from(target.seeds)

    @FEW
    @given(st.one_of(st.binary(max_size=100), st.lists(st.one_of(piece, seed), max_size=8).map(b"".join)))
    def any_bytes(data):
        target.run(data)

    any_bytes()


# --- drivers ---


class Liar:
    """An instrument that answers the next questions with these replies, and then as it should.

    replies: bytes, their delay [s], and whether their end is marked; None in the place of an honest answer.
    """

    def __init__(self, device, replies=()):
        self._device, self.replies = device, list(replies)

    def __getattr__(self, name):
        return getattr(self._device, name)

    def steps(self, message):
        answer = yield from self._device.steps(message)
        if "?" not in message or not self.replies or (reply := self.replies.pop(0)) is None:
            return answer
        data, delay, complete = reply
        now = self._device.clock.now()
        return Answer(data, now + delay, self._device.epoch, now, complete) if data else None


def _block(size, data):
    return b"#%d%d" % (len(str(size)), size) + data


#: Answers that have broken programs before, without their line ends.
LINES = (
    *b"0 1 -1 nan inf -inf 1e999 9.91E37 1_0 STOP TD WAIT OL 040 049 128 255 1,2 1,2,3 1,1,1 , ,,, ,,,,,,,,,".split(),
    *b"0,0,1e999,1,1,0,0,1,0,0 0,0,nan,1,1,0,0,1,0,0 0,0,1e18,1,1,0,0,1,0,0 0,0,3.5,1,1,0,0,1,0,0".split(),
    *b"0,0,1000,1,nan,0,0,nan,0,0 0,0,10,1,1e-3,0,0,inf,0,0 a,DS1054Z,b,c DS1054Z MODEL425 MODEL475".split(),
    *(b'+0,"No error"', b'-113,"Undefined header"', b"DSO-X 1102G", b"NO PROBE", b"", b"\r", b"\n" * 30, b"1\n" * 100),
    *(b"+" + b"9" * 5000, b"9" * 5000 + b",x", b"9" * 400, b"\xb2", b"\0" * 50, b"#0", b"#10", b"#9999999999"),
    *(b"#15abc", b"#13abc", b"#13abcdef", b"#800000003abc", b"#3\xb2\xb2\xb2", b"1;2", b"#11\n"),
)
LIES = st.one_of(
    st.sampled_from(LINES).map(lambda line: line + b"\n"),
    st.sampled_from(LINES),
    st.binary(max_size=40),
    st.one_of(st.integers(), st.floats()).map(lambda number: b"%s\n" % str(number).encode()),
    st.lists(st.floats().map(str), min_size=1, max_size=11).map(lambda numbers: ",".join(numbers).encode() + b"\n"),
    st.tuples(st.integers(0, 2000), st.binary(max_size=30)).map(lambda drawn: _block(*drawn) + b"\n"),
)
MOST_LATE = 60.0
REPLIES = st.lists(
    st.one_of(
        st.none(),
        st.none(),
        st.tuples(LIES, st.sampled_from([0.0, 0.0, 0.0, 1.0, 5.0, MOST_LATE]), st.booleans()),
        st.just((b"", 0.0, False)),
    ),
    min_size=1,
    max_size=30,
)


ADDRESSES = {
    "messages": "TCPIP0::box.levilab::inst0::INSTR",
    "stream": "TCPIP0::box.levilab::5025::SOCKET",
    "serial": "ASRLbox.levilab::INSTR",
}
_bench_numbers = itertools.count()


@pytest.fixture(autouse=True)
def our_handler(monkeypatch):
    """pyserial knows the URLs of the virtual bench."""
    monkeypatch.setattr(serial, "protocol_handler_packages", ["instruments.virtual.bench"])


class Pair:
    """A driver, and a liar in a room of its own behind a link of this kind."""

    def __init__(self, name, way, replies=()):
        self.room = hostile.Room()
        self.liar = Liar(hostile.instrument(name, self.room))
        address = ADDRESSES["serial" if way == "pyserial" else way]
        self.bus = VirtualBench({address: self.liar})
        kind = ROWS[name].driver
        line = dict(getattr(kind, "SERIAL", {})) | {"pause": 0.0}
        if way == "pyserial":
            self.bench = f"fuzz{next(_bench_numbers)}"
            benches[self.bench] = lambda: self.bus
            self.transport = SerialTransport(f"levilab://box?bench={self.bench}", **line)
        else:
            del line["pause"]
            self.transport = VisaTransport(address, library=library_for(self.bus), line=line)
        self.driver = kind(self.transport, clock=self.room.clock)
        self.liar.replies = list(replies)

    def close(self):
        self.driver.close()
        benches.pop(getattr(self, "bench", ""), None)


#: The ways to an instrument on the network, and to one on a serial line.
BOTH = (("messages", "stream"), ("serial", "pyserial"))
WAYS = [*((name, way) for name in FAMILIES for way in BOTH[name in SERIAL]), ("475", "messages")]


@pytest.mark.parametrize(("name", "way"), WAYS)
def test_a_driver_whose_instrument_answers_anything_gives_a_value_or_an_instrument_error(name, way):
    known = calls(name)

    @FEW
    @given(REPLIES, st.lists(st.sampled_from(sorted(known)), min_size=1, max_size=6))
    def any_answers(replies, wanted):
        pair = Pair(name, way, replies)
        try:
            for call in wanted:
                act, is_right = known[call]
                with contextlib.suppress(InstrumentError):
                    value = act(pair.driver)
                    assert is_right(value), (call, value)
            pair.liar.replies.clear()
            pair.room.clock.sleep(MOST_LATE)  # late answers have come, and must not count as answers
            measure(name, pair.driver)
        finally:
            pair.close()

    any_answers()


@pytest.mark.parametrize(
    ("name", "call", "line"),
    [
        ("53230A", "prepare", b"9" * 5000 + b",x"),  # longer than Python makes a whole number of
        ("425", "probe", b"9" * 5000),
        ("DS1000Z", "settings", b""),
        ("DS1000Z", "blocks", b"0,0,1e999,1,1,0,0,1,0,0"),
        ("DSOX1000", "trace", b"0,0,1e18,1,1,0,0,1,0,0"),  # more than there is memory for
        ("DSOX1000", "trace", b"0,0,1000,1,nan,0,0,nan,0,0"),
    ],
)
def test_an_answer_that_was_misheard_ends_in_an_instrument_error(name, call, line):
    pair = Pair(name, "serial" if name == "425" else "messages")
    known = calls(name)
    prepare, _ = known["prepare"]
    prepare(pair.driver)
    if KIND_OF[name] == "oscilloscope":
        pair.driver.acquire(timeout_s=1.0)
    act, _ = known[call]
    for honest in range(60):  # whichever question it is
        pair.liar.replies = [None] * honest + [(line + b"\n", 0.0, True)]
        with contextlib.suppress(InstrumentError):
            act(pair.driver)
    pair.liar.replies.clear()
    measure(name, pair.driver)
    pair.close()


@pytest.mark.parametrize(
    ("line", "ask"),
    [
        (b"+9.91E+37", lambda driver: driver.frequency),  # "not a number" is no setting
        (b"nan", lambda driver: driver.amplitude),
        (b"\x7f~#!Agilent Technologies,33522B,1,1", lambda driver: driver.identity()),
    ],
)
def test_what_no_setting_and_no_name_can_be_is_refused(line, ask):
    pair = Pair("33500B", "messages", [(line + b"\n", 0.0, True)])
    with pytest.raises(BadAnswer):
        ask(pair.driver)
    measure("33500B", pair.driver)
    pair.close()


def test_an_identity_without_its_four_fields_is_refused_and_the_next_one_taken():
    pair = Pair("DS1000Z", "messages", [(b"DS1054Z\n", 0.0, True)])
    with pytest.raises(BadAnswer, match="four fields"):
        pair.driver.identity()
    assert "DS1054Z" in pair.driver.identity()
    measure("DS1000Z", pair.driver)
    pair.close()


# --- pairs, and faults at any time ---


class Pairing(RuleBasedStateMachine):
    """A driver and its virtual instrument, while faults strike: no reading is one that the world could not give."""

    name, way = "53230A", "messages"

    def __init__(self):
        super().__init__()
        self.pair = Pair(self.name, self.way)
        self.driver = self.pair.driver
        self.prepare()
        self.wanted = dict(self.pair.liar.settings)

    def teardown(self):
        """Whatever was wrong is over: then everything works, at once."""
        self.pair.bus.faults.clear()
        self.pair.room.clock.sleep(10 * LATE)
        self.come_back()
        measure(self.name, self.driver)
        self.pair.close()

    def prepare(self):
        prepare, _ = calls(self.name)["prepare"]
        prepare(self.driver)

    def is_as_prepared(self):
        """Whether no reset has come in between: the application looks for that itself, see `Bench.forgotten`."""
        now = self.pair.liar.settings
        return all(now[name] == value for name, value in self.wanted.items() if name not in self.CHANGING)

    #: What a reading changes, or what has no part in it.
    CHANGING = frozenset({"samples", "armings", "range", "1:output", "wav_source", "wav_stop", "wav_start"})

    def come_back(self):
        """What a program does when it has lost an instrument, or another one has taken it."""
        for client_lock in self.pair.bus._client_locks.values():
            client_lock.holders.clear()
        self.driver.transport.reopen()

    @rule(
        what=st.sampled_from(sorted(FAULTS)),
        question=st.sampled_from([r".*\?.*", r".*(READ|RDGFIELD|TRAC|DATA|FETC).*\?.*", r"SYST:ERR\?"]),
        after=st.integers(0, 12),
        times=st.integers(1, 3),
    )
    def a_fault(self, what, question, after, times):
        self.pair.bus.faults.append(Fault(what, question=question, after=after, times=times))

    @rule(seconds=st.sampled_from([0.01, 1.0, 4.0, 20.0]))
    def time_passes(self, seconds):
        self.pair.room.clock.sleep(seconds)

    @rule()
    def the_link_is_made_anew(self):
        with contextlib.suppress(InstrumentError):
            self.come_back()

    @rule()
    def errors_are_forgotten(self):
        with contextlib.suppress(InstrumentError):
            self.driver.forget_errors()

    @rule()
    def who_is_there(self):
        with contextlib.suppress(InstrumentError):
            assert self.driver.identity().startswith(self.pair.liar.identity)  # text behind it is text

    @rule()
    def it_is_prepared(self):
        with contextlib.suppress(InstrumentError):
            self.prepare()

    @rule()
    def it_is_read(self):
        with contextlib.suppress(InstrumentError):
            good_before = self.is_as_prepared()
            right = self.read()
            assert right or not (good_before and self.is_as_prepared())

    def read(self):
        """Whether what was read is what the world can give."""
        raise NotImplementedError


def is_world_frequency(value):
    return value is None or math.isnan(value) or value == pytest.approx(30.0, rel=1e-3)


class CounterPairing(Pairing):
    count = 0

    def read(self):
        if not self.count:
            return is_world_frequency(self.driver.frequency())
        found = self.driver.readings(self.count)
        return found.shape == (self.count,) and all(map(is_world_frequency, found))

    @rule(count=st.integers(0, 4))
    def so_many_are_read(self, count):
        self.count = count
        self.it_is_read()


class GeneratorPairing(Pairing):
    def read(self):
        return self.driver.frequency == 25.0 and self.driver.output is self.pair.liar.settings["1:output"]

    @rule()
    def it_is_switched_off(self):
        with contextlib.suppress(InstrumentError):
            self.driver.off()
            assert self.pair.liar.settings["1:output"] is False

    @rule()
    def it_is_switched_on(self):
        with contextlib.suppress(InstrumentError):
            self.driver.output = True


class ScopePairing(Pairing):
    def read(self):
        self.driver.acquire(timeout_s=1.0)
        trace = self.driver.trace(1)
        volts, whole = trace.volts, trace.dt_s * trace.codes.size
        return volts.min() > -0.1 and volts.max() < 1.3 and 0.1 <= whole < 0.25


class MagnetometerPairing(Pairing):
    def read(self):
        value = self.driver.flux_density()
        return value is None or value == pytest.approx(0.019, abs=2e-4)


PAIRINGS = {
    "counter": CounterPairing,
    "generator": GeneratorPairing,
    "oscilloscope": ScopePairing,
    "magnetometer": MagnetometerPairing,
}


#: One way for each driver, so that each way has its turn; links/test_wire_faults.py strikes on all ways.
PAIRED = [(name, ways[k % 2]) for k, (name, ways) in enumerate((name, BOTH[name in SERIAL]) for name in FAMILIES)]


@pytest.mark.parametrize(("name", "way"), PAIRED)
def test_no_fault_at_any_time_makes_a_reading_that_the_world_could_not_give(name, way):
    machine = type("Pairing", (PAIRINGS[KIND_OF[name]],), {"name": name, "way": way})
    run_state_machine_as_test(machine, settings=settings(FEW, stateful_step_count=12))
