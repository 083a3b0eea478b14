"""Whatever a program sends: no instrument hangs, crashes or grows, and it works afterwards.

What an instrument may answer is in links/test_faults.py.
"""

import math
import tracemalloc

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fuzz_targets import TARGETS
from instruments.virtual.bench.session import MOST_ANSWERS
from support import hostile
from support.models import FAMILIES

#: `make explore` draws 1000.  A machine that is busy is no reason to fail.
EXPLORING = settings.get_current_profile_name() == "explore"
FEW = settings(max_examples=1000 if EXPLORING else 8, deadline=None, suppress_health_check=list(HealthCheck))
#: For a model whose twin is another one's with other numbers.
VERY_FEW = settings(FEW, max_examples=1000 if EXPLORING else 2)


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


@pytest.mark.parametrize("name", ["53230A", "33500B", "DS1000Z", "475"])
def test_an_instrument_that_is_talked_to_for_long_keeps_no_more_memory(name):
    bench = hostile.Bench(name)
    every = hostile.headers(bench.device)
    nasty = [word for word in hostile.NASTY if len(word) < 1000]

    def talk(turns):
        for k in range(turns):
            header = every[7 * k % len(every)]
            if not header.upper().startswith(("DATA", "SOUR:DATA")):  # what is there to keep
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
