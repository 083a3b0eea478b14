"""Faults of links and instruments: each raises the error that names it, and the next question gets its own answer."""

import pytest

from instruments.clock import VirtualClock
from instruments.drivers.scpi import ScpiInstrument, parse_reading
from instruments.drivers.setting import Setting
from instruments.errors import BadAnswer, CommandRefused, InstrumentError, NoAnswer, NotConnected
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.faults import FAULTS, LATE, Fault
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.rows import Ask, Number
from support import hostile
from support.models import FAMILIES, ROWS, SERIAL, measure

MESSAGES, STREAM = "TCPIP0::box.levilab::inst0::INSTR", "TCPIP0::box.levilab::5025::SOCKET"
LINE = "ASRLbox.levilab::INSTR"
DATA = bytes(range(256)) * 3


class VirtualBox(VirtualInstrument):
    """A number that can be set and asked for, a reading, and a block of every byte there is."""

    identity = "levilab,box,VIRTUAL,0"

    ROWS = (
        Number("LEVel", "level", 1.5, (-5, 5), "V"),
        Ask("READ", lambda _d: "+2.500000000000000E+01"),
        Ask("DATA", lambda _d: f"#3{len(DATA)}" + DATA.decode("latin-1")),
    )


class Box(ScpiInstrument):
    """Its driver."""

    MODELS = "box"
    bench: object
    level = Setting("LEV", float, unit="V", low=-5.0, high=5.0)

    def reading(self):
        self.raise_errors("READ?")
        answer = self.transport.query("READ?")
        with self.clearing_on_bad_answer():
            return parse_reading(self.transport.address, "READ?", answer, self.NUMBER)

    def data(self):
        return self.transport.query_block("DATA?")


@pytest.fixture(params=[MESSAGES, STREAM], ids=["messages", "stream"])
def box(request):
    clock = VirtualClock()
    bench = VirtualBench({request.param: VirtualBox(clock)})
    box = Box(open_link(request.param, library=library_for(bench)))
    box.bench, box.clock = bench, clock
    return box


#: What a question for a number ends in, by the fault: a value, or an error and what it says.
READING = {
    "no answer": (NoAnswer, "no answer to 'READ\\?' within 2 s"),
    "late answer": (NoAnswer, "no answer to 'READ\\?' within 2 s"),
    "single bytes": 25.0,
    "two answers at once": 25.0,
    "garbage before": (BadAnswer, "expected plain text"),
    "bytes that are no text before": (BadAnswer, "expected plain text"),
    "garbage after": 25.0,
    "block longer than it says": 25.0,
    "block shorter than it says": 25.0,
    "cut in the middle": (NoAnswer, "no answer"),
    "disconnected": (NotConnected, "no link at 'READ\\?'"),
    "away for 5 s": (NotConnected, "no link"),
    "error queue overflow": 25.0,
    "reset": 25.0,
    "taken by another": (NotConnected, "locked"),
    "9.91E37": None,
}


def test_every_fault_is_tried():
    assert set(READING) == set(FAULTS)


@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_raises_its_error_and_the_next_question_gets_its_answer(box, what):
    box.bench.faults.append(Fault(what, question=r"READ\?"))
    expected = READING[what]
    if isinstance(expected, tuple):
        error, message = expected
        with pytest.raises(error, match=message) as caught:
            box.reading()
        assert caught.value.address == box.transport.address
        assert "\n" not in str(caught.value)
    else:
        assert box.reading() == expected
    # whatever was late, doubled or left over: it never reaches the driver
    box.clock.sleep(2 * LATE)
    if what == "taken by another":
        release(box)
    if what in {"disconnected", "away for 5 s"}:
        box.transport.reopen()
    box.forget_errors()
    for _ in range(3):
        assert box.level == 1.5
        assert box.reading() == 25.0
        assert box.data() == DATA


def release(box):
    (client_lock,) = box.bench._client_locks.values()
    client_lock.holders.clear()


@pytest.mark.parametrize(
    ("what", "error", "message"),
    [
        ("no answer", NoAnswer, "no answer"),
        ("late answer", NoAnswer, "no answer"),
        ("garbage before", BadAnswer, "expected a definite-length block"),
        ("block longer than it says", BadAnswer, "a block of 758 bytes that goes on with"),
        ("block shorter than it says", (BadAnswer, NoAnswer), r"76\d bytes of a block of 778|no answer"),
        ("cut in the middle", (BadAnswer, NoAnswer), "of a block of 768|no answer"),
        ("disconnected", NotConnected, "no link"),
        ("9.91E37", BadAnswer, "expected a definite-length block"),
    ],
)
def test_a_broken_block_is_refused_and_what_is_left_of_it_forgotten(box, what, error, message):
    box.bench.faults.append(Fault(what, question=r"DATA\?"))
    with pytest.raises(error, match=message):
        box.data()
    box.clock.sleep(2 * LATE)
    if what == "disconnected":
        box.transport.reopen()
    for _ in range(3):
        assert box.data() == DATA
        assert box.level == 1.5


@pytest.mark.parametrize("what", ["single bytes", "two answers at once", "garbage after"])
def test_a_block_is_read_whole_however_it_comes(box, what):
    box.bench.faults.append(Fault(what, question=r"DATA\?"))
    if what == "single bytes" or box.transport.address == STREAM:
        assert box.data() == DATA
    else:  # the interface marks the end of a message: more behind the block is seen, and refused
        with pytest.raises(BadAnswer, match="goes on with"):
            box.data()
    assert box.data() == DATA


def test_a_full_error_queue_raises_its_first_entries_and_is_emptied(box):
    box.bench.faults.append(Fault("error queue overflow", question=r"READ\?"))
    assert box.reading() == 25.0
    with pytest.raises(CommandRefused, match=r"Undefined header.* and 16 more") as refused:
        box.level = 2.0
    assert len(refused.value.entries) == 20
    assert "Error queue overflow" in refused.value.entries[-1]
    box.level = 2.0
    assert box.level == 2.0


def test_an_error_that_stood_in_the_queue_is_raised_with_a_reading(box):
    box.transport.write("NONSENSE")
    with pytest.raises(CommandRefused, match=r"READ.*Undefined header"):
        box.reading()
    assert box.reading() == 25.0


def test_a_lock_keeps_another_program_out_and_is_gone_with_its_link(box):
    other = Box(open_link(box.transport.address, library=library_for(box.bench)))
    other.transport.lock()
    for act in (box.transport.lock, box.reading):
        with pytest.raises(NotConnected, match=r"locked|another program"):
            act()
    other.close()
    box.transport.lock()
    assert box.reading() == 25.0


# --- every driver ---

#: The first model of each driver.
MODELS = sorted({ROWS[name].driver: name for name in reversed(FAMILIES)}.values())
NOTICED = ["late answer", "two answers at once", "garbage before", "cut in the middle", "disconnected"]


def connect(name):
    """A driver, the bench at which its instrument is, and the clock there; a stream, or a serial line."""
    driver, room = ROWS[name].driver, hostile.Room()
    address = LINE if name in SERIAL else STREAM
    bench = VirtualBench({address: hostile.instrument(name, room)})
    line = {key: value for key, value in driver.SERIAL.items() if key != "pause"}
    clock = {"clock": room.clock} if hasattr(driver, "CHANNEL") else {}
    return driver(open_link(address, library=library_for(bench), line=line), **clock), bench, room.clock


def error_of(name, driver):
    """The error in which a measurement ends; None where it is right."""
    try:
        measure(name, driver)
    except InstrumentError as error:
        return error
    return None


@pytest.mark.parametrize("what", NOTICED)
@pytest.mark.parametrize("name", MODELS)
def test_a_fault_gives_each_driver_the_right_value_or_an_error_and_no_more(name, what):
    driver, bench, clock = connect(name)
    count = Fault(what, times=0)
    bench.faults.append(count)
    measure(name, driver)
    for place in (0.0, 0.5, 0.99):
        bench.faults[:] = [Fault(what, after=int(place * count.seen))]
        if error := error_of(name, driver):
            assert error.address == driver.transport.address
            assert "\n" not in str(error)
            clock.sleep(60.0)
        if isinstance(error, NotConnected):
            driver.transport.reopen()
        bench.faults.clear()
        measure(name, driver)


@pytest.mark.parametrize(
    ("name", "question", "line"),
    [
        ("53230A", r"READ\?", b"9" * 5000 + b",x"),  # longer than Python makes a whole number of
        ("425", r".*RDGFIELD\?.*", b"9" * 5000),
        ("DS1000Z", r":WAV:PRE\?", b""),
        ("DS1000Z", r":WAV:PRE\?", b"0,0,1e999,1,1,0,0,1,0,0"),
        ("DSOX1000", r":WAV:PRE\?", b"0,0,1e18,1,1,0,0,1,0,0"),  # more than there is memory for
        ("DSOX1000", r":WAV:PRE\?", b"0,0,1000,1,nan,0,0,nan,0,0"),
        ("33500B", r".*FREQ\?", b"+9.91E+37"),  # "not a number" is no setting
        ("33500B", r".*VOLT\?", b"nan"),
        ("33500B", r"\*IDN\?", b"\x7f~#!Agilent Technologies,33522B,1,1"),
        ("DS1000Z", r"\*IDN\?", b"DS1054Z"),
    ],
)
def test_an_answer_that_has_broken_a_driver_is_an_error(monkeypatch, name, question, line):
    driver, bench, _ = connect(name)
    monkeypatch.setitem(FAULTS, "a lie", lambda _, answer: answer._replace(data=line + b"\n"))
    bench.faults.append(Fault("a lie", question=question))
    assert error_of(name, driver)
    assert bench.faults[0].seen
