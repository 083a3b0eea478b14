"""The transport over PyVISA, with the virtual bench in the same process at the far end."""

import itertools

import pytest
from pyvisa import VisaIOError
from pyvisa.constants import ResourceAttribute, StatusCode

from instruments.clock import VirtualClock
from instruments.errors import BadAnswer, NoAnswer, NotConnected, Occupied
from instruments.links.visa import VisaTransport
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import LevilabVisaLibrary, library_for
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.rows import Ask

ADDRESS = "TCPIP0::slow.levilab::inst0::INSTR"
SOCKET = "TCPIP0::slow.levilab::5025::SOCKET"
IDENTITY = "levilab,slow,0,0"

_unique = itertools.count()


class Slow(VirtualInstrument):
    """Answers ``SLOW?`` after five seconds, and ``BINary?`` with what is no text."""

    identity = IDENTITY

    ROWS = (Ask("SLOW", lambda d: d._slow()), Ask("BINary", lambda _d: "\xff\xfe"))

    def _slow(self):
        self.busy_until(self.clock.now() + 5.0)
        return "slow"


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def bench(clock):
    return VirtualBench({ADDRESS: Slow(clock), SOCKET: Slow(clock)})


def library_with(bench, **methods):
    """A library for this bench with some of its functions replaced."""
    library = type("Broken", (LevilabVisaLibrary,), methods)(f"broken-{next(_unique)}")
    library.bench = bench
    return library


def test_a_question_is_answered_without_its_line_end(bench):
    assert VisaTransport(ADDRESS, library=library_for(bench)).query("*IDN?") == IDENTITY


def test_silence_raises_with_its_question_and_costs_virtual_time_only(bench, clock):
    transport = VisaTransport(ADDRESS, library=library_for(bench), timeout=3600.0)
    with pytest.raises(NoAnswer) as silence:
        transport.query("FOO?")
    assert (silence.value.question, silence.value.timeout) == ("FOO?", 3600.0)
    # an hour, to a nanosecond, in a test that takes none
    assert clock.now() == pytest.approx(3600.0, abs=1e-9)


def test_an_answer_that_takes_its_time_needs_patience(bench, clock):
    transport = VisaTransport(ADDRESS, library=library_for(bench), timeout=2.0)
    assert transport.query("SLOW?", patience=4.0) == "slow"
    assert clock.now() == pytest.approx(5.0, abs=1e-9)  # not the six seconds that it might have taken
    with pytest.raises(NoAnswer) as silence:
        transport.query("SLOW?", patience=2.5)
    assert silence.value.timeout == 4.5


def test_patience_is_for_one_answer_only(bench):
    transport = VisaTransport(ADDRESS, library=library_for(bench), timeout=2.0)
    transport.query("SLOW?", patience=4.0)
    with pytest.raises(NoAnswer):
        transport.query("SLOW?")


def test_a_late_answer_never_reaches_the_next_question(bench, clock):
    transport = VisaTransport(ADDRESS, library=library_for(bench), timeout=2.0)
    with pytest.raises(NoAnswer):
        transport.query("SLOW?")
    clock.sleep(10.0)
    assert transport.query("*IDN?") == IDENTITY


def test_an_interrupted_wait_leaves_no_answer_for_the_next_question(bench, clock, monkeypatch):
    transport = VisaTransport(ADDRESS, library=library_for(bench), timeout=2.0)

    def interrupted(duration):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(clock, "sleep", interrupted)
        with pytest.raises(KeyboardInterrupt):
            transport.query("SLOW?")
    clock.sleep(10.0)
    assert transport.query("*IDN?") == IDENTITY


def test_an_answer_that_is_no_text_raises_and_is_forgotten(bench):
    transport = VisaTransport(ADDRESS, library=library_for(bench))
    with pytest.raises(BadAnswer, match="expected plain text") as bad:
        transport.query("BIN?")
    assert bad.value.question == "BIN?"
    assert transport.query("*IDN?") == IDENTITY


@pytest.mark.parametrize("address", ["TCPIP0::absent.levilab::inst0::INSTR", "no resource name at all", ""])
def test_an_address_where_nothing_is_raises_in_one_line(bench, address):
    with pytest.raises(NotConnected) as missing:
        VisaTransport(address, library=library_for(bench))
    assert missing.value.address == address
    assert "\n" not in str(missing.value)


def test_an_unknown_library_raises_our_error():
    with pytest.raises(NotConnected, match="nolibrary"):
        VisaTransport(ADDRESS, library="@nolibrary")


def test_whatever_a_library_raises_on_opening_becomes_our_error(bench):
    # pyvisa-py raises plain Exception for a host that cannot be reached
    def unreachable(*_, **__):
        raise Exception("could not connect:\nno route")  # noqa: TRY002

    with pytest.raises(NotConnected, match="could not connect: no route"):
        VisaTransport(ADDRESS, library=library_with(bench, open=unreachable))


def test_a_link_that_breaks_raises_with_the_question(bench):
    def broken(self, session, data):
        return 0, self.handle_return_value(session, StatusCode.error_connection_lost)

    transport = VisaTransport(ADDRESS, library=library_with(bench, write=broken))
    with pytest.raises(NotConnected, match="IDN"):
        transport.query("*IDN?")


def test_a_bare_connection_is_opened_anew_until_the_instrument_is_back(bench):
    transport = VisaTransport(SOCKET, library=library_for(bench), timeout=2.0)
    with pytest.raises(NoAnswer):
        transport.query("FOO?")
    instruments, bench.instruments = bench.instruments, {}
    for _ in range(3):
        with pytest.raises(NotConnected, match="cannot be opened"):
            transport.query("*IDN?")
    bench.instruments = instruments
    assert transport.query("*IDN?") == IDENTITY


def test_the_log_gets_the_bytes_of_both_directions(bench):
    traffic = []
    transport = VisaTransport(ADDRESS, library=library_for(bench), log=lambda *line: traffic.append(line))
    transport.write("*CLS")
    transport.query("*IDN?")
    with pytest.raises(NoAnswer):
        transport.query("FOO?")
    assert traffic == [
        (ADDRESS, ">", b"*CLS\n"),
        (ADDRESS, ">", b"*IDN?\n"),
        (ADDRESS, "<", IDENTITY.encode() + b"\n"),
        (ADDRESS, ">", b"FOO?\n"),
    ]


@pytest.mark.parametrize("address", [ADDRESS, SOCKET])
@pytest.mark.parametrize("act", ["query", "write", "query_block", "clear", "reopen", "lock"])
def test_a_closed_link_says_that_it_was_closed_whatever_it_is_used_for(bench, address, act):
    transport = VisaTransport(address, library=library_for(bench))
    transport.close()
    transport.close()
    with pytest.raises(NotConnected, match="this session was closed: open another one"):
        getattr(transport, act)(*(["*IDN?"] if act in {"query", "write", "query_block"} else []))


# --- how long things may take ---


def test_patience_is_for_an_answer_and_not_for_the_messages_after_it(bench):
    """A dead link must not hold the next command as long as the last question: up to 30 days for a counter's series."""
    allowed = []

    def noted(method):
        def call(self, session, *rest):
            allowed.append((method, self.get_attribute(session, ResourceAttribute.timeout_value)[0]))
            return getattr(LevilabVisaLibrary, method)(self, session, *rest)

        return call

    transport = VisaTransport(ADDRESS, library=library_with(bench, write=noted("write"), clear=noted("clear")))
    transport.query("*IDN?", patience=3000.0)
    transport.write("*CLS")
    transport.query("*IDN?", patience=3000.0)
    transport.clear()
    transport.query("*IDN?", patience=3000.0)
    transport.query("*IDN?")
    assert allowed == [("clear" if k == 3 else "write", 2000) for k in range(6)]
    transport.timeout = 5.0
    transport.write("*CLS")
    assert allowed[-1] == ("write", 5000)


@pytest.mark.parametrize("address", [ADDRESS, SOCKET, "ASRLslow.levilab::INSTR"])
def test_between_two_messages_the_instrument_is_left_alone(clock, address):
    sent, answered = [], []

    def log(_, direction, __):
        (sent if direction == ">" else answered).append(clock.now())

    library = library_for(VirtualBench({address: Slow(clock)}))
    transport = VisaTransport(address, library=library, pause=0.05, clock=clock, log=log)
    for _ in range(3):
        transport.query("*IDN?")
    transport.write("*CLS")
    transport.write("*CLS")
    end = clock.now()
    # the log is written before the pause: the next answer shows that it was kept
    assert all(after >= before + 0.05 for before, after in itertools.pairwise(answered))
    assert end >= answered[-1] + 2 * 0.05
    with pytest.raises(NoAnswer):
        transport.query("FOO?")
    assert clock.now() >= end + 0.05 + 2.0
    transport.close()


def test_without_a_pause_no_time_is_lost(bench, clock):
    transport = VisaTransport(ADDRESS, library=library_for(bench), clock=clock)
    for _ in range(3):
        transport.query("*IDN?")
    assert clock.now() < 0.05


# --- a serial line, which has no device clear ---

LINE = "ASRLslow.levilab::INSTR"


class SlowOnce(Slow):
    """Answers ``LIST?`` with words, and the first time that it is asked who it is after five seconds."""

    slow = 0

    COMMON = (Ask("LIST", lambda d: d._list()), Ask("*IDN", lambda d: d._who()), *Slow.COMMON)

    def _late(self, answer):
        if self.slow:
            self.slow -= 1
            self.busy_until(self.clock.now() + 5.0)
        return answer

    def _list(self):
        return self._late("1,2,1,1,1")

    def _who(self):
        return self._late(IDENTITY)


@pytest.mark.parametrize("questions", [["LIST?"], ["*IDN?"], ["LIST?", "*IDN?"], ["*IDN?", "*IDN?"], ["SLOW?"]])
def test_on_a_serial_line_no_late_answer_is_taken_for_another(clock, questions):
    device = SlowOnce(clock)
    transport = VisaTransport(LINE, library=library_for(VirtualBench({LINE: device})))
    device.slow = len(questions)
    right = {"*OPC?": "1", "LIST?": "1,2,1,1,1", "*IDN?": IDENTITY, "SLOW?": "slow"}
    silent = 0
    for question in [*questions, *3 * ["*OPC?", "LIST?", "*IDN?"]]:
        try:
            assert transport.query(question) == right[question]
        except NoAnswer:
            silent += 1
    assert 1 <= silent <= 6
    assert transport.query("LIST?") == "1,2,1,1,1"


def test_the_log_has_what_could_not_be_read_either(bench):
    traffic = []
    transport = VisaTransport(ADDRESS, library=library_for(bench), log=lambda *line: traffic.append(line[1:]))
    with pytest.raises(BadAnswer):
        transport.query("BIN?")
    transport.query("*IDN?")
    assert traffic == [
        (">", b"BIN?\n"),
        ("<", b"\xff\xfe\n"),
        (">", b"(device clear)\n"),
        (">", b"*IDN?\n"),
        ("<", IDENTITY.encode() + b"\n"),
    ]


@pytest.mark.parametrize(
    ("trouble", "error"),
    [
        (VisaIOError(StatusCode.error_nonsupported_operation), None),
        (NotImplementedError(), None),
        (VisaIOError(StatusCode.error_resource_locked), Occupied),
        (VisaIOError(StatusCode.error_connection_lost), NotConnected),
        (EOFError(), NotConnected),
        (ConnectionResetError(), NotConnected),
        (KeyError(8), NotConnected),
    ],
    ids=lambda one: getattr(one, "abbreviation", None) or (one.__name__ if isinstance(one, type) else repr(one)),
)
def test_a_link_without_locks_is_no_trouble_and_one_that_breaks_is(bench, monkeypatch, trouble, error):
    transport = VisaTransport(ADDRESS, library=library_for(bench))

    def broken(**_):
        raise trouble

    monkeypatch.setattr(transport.port.resource, "lock_excl", broken)
    if error is None:
        transport.lock()
    else:
        with pytest.raises(error) as caught:
            transport.lock()
        assert type(caught.value) is error
    transport.close()
