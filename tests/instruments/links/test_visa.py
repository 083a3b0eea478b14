"""The transport over PyVISA, with the virtual bench in the same process at the far end."""

import itertools
from unittest.mock import Mock

import pytest
from pyvisa import VisaIOError
from pyvisa.constants import ResourceAttribute, StatusCode

from instruments.errors import BadAnswer, NoAnswer, NotConnected, Occupied
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import LevilabVisaLibrary, library_for
from instruments.virtual.core.rows import Ask
from support.slow import IDENTITY, Slow

ADDRESS = "TCPIP0::slow.levilab::inst0::INSTR"
SOCKET = "TCPIP0::slow.levilab::5025::SOCKET"

_unique = itertools.count()


@pytest.fixture
def bench(clock):
    return VirtualBench({ADDRESS: Slow(clock), SOCKET: Slow(clock)})


def library_with(bench, **methods):
    """A library for this bench with some of its functions replaced."""
    library = type("Broken", (LevilabVisaLibrary,), methods)(f"broken-{next(_unique)}")
    library.bench = bench
    return library


@pytest.mark.parametrize("address", ["TCPIP0::absent.levilab::inst0::INSTR", "no resource name at all", ""])
def test_an_address_where_nothing_is_raises_in_one_line(bench, address):
    with pytest.raises(NotConnected) as missing:
        open_link(address, library=library_for(bench))
    assert missing.value.address == address
    assert "\n" not in str(missing.value)


def test_an_unknown_library_raises_our_error():
    with pytest.raises(NotConnected, match="nolibrary"):
        open_link(ADDRESS, library="@nolibrary")


def test_whatever_a_library_raises_on_opening_becomes_our_error(bench):
    # pyvisa-py raises plain Exception for a host that cannot be reached
    def unreachable(*_, **__):
        raise Exception("could not connect:\nno route")  # noqa: TRY002

    with pytest.raises(NotConnected, match="could not connect: no route"):
        open_link(ADDRESS, library=library_with(bench, open=unreachable))


def test_the_log_gets_the_bytes_of_both_directions(bench):
    traffic = []
    transport = open_link(ADDRESS, library=library_for(bench), log=lambda *line: traffic.append(line))
    transport.write("*CLS")
    with pytest.raises(BadAnswer):
        transport.query("BIN?")
    transport.query("*IDN?")
    assert traffic == [
        (ADDRESS, ">", b"*CLS\n"),
        (ADDRESS, ">", b"BIN?\n"),
        (ADDRESS, "<", b"\xff\xfe\n"),
        (ADDRESS, ">", b"(device clear)\n"),
        (ADDRESS, ">", b"*IDN?\n"),
        (ADDRESS, "<", IDENTITY.encode() + b"\n"),
    ]


# --- how long things may take ---


def test_patience_is_for_an_answer_and_not_for_the_messages_after_it(bench):
    """A dead link must not hold the next command as long as the last question: up to 30 days for a counter's series."""
    allowed = []

    def noted(method):
        def call(self, session, *rest):
            allowed.append((method, self.get_attribute(session, ResourceAttribute.timeout_value)[0]))
            return getattr(LevilabVisaLibrary, method)(self, session, *rest)

        return call

    transport = open_link(ADDRESS, library=library_with(bench, write=noted("write"), clear=noted("clear")))
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
    transport = open_link(address, library=library, line={"pause": 0.05}, clock=clock, log=log)
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
    transport = open_link(ADDRESS, library=library_for(bench), clock=clock)
    for _ in range(3):
        transport.query("*IDN?")
    assert clock.now() < 0.05


# --- a serial line, which has no device clear ---

LINE = "ASRLslow.levilab::INSTR"


class SlowOnce(Slow):
    """Answers ``LIST?`` with words, and the first time that it is asked who it is after five seconds."""

    slow = 0

    COMMON = (Ask("LIST", lambda d: d._late("1,2,1,1,1")), Ask("*IDN", lambda d: d._late(IDENTITY)), *Slow.COMMON)

    def _late(self, answer):
        if self.slow:
            self.slow -= 1
            self.busy_until(self.clock.now() + 5.0)
        return answer


@pytest.mark.parametrize("questions", [["LIST?"], ["*IDN?"], ["LIST?", "*IDN?"], ["*IDN?", "*IDN?"], ["SLOW?"]])
def test_on_a_serial_line_no_late_answer_is_taken_for_another(clock, questions):
    device = SlowOnce(clock)
    transport = open_link(LINE, library=library_for(VirtualBench({LINE: device})))
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
    transport = open_link(ADDRESS, library=library_for(bench))
    monkeypatch.setattr(transport.port.resource, "lock_excl", Mock(side_effect=trouble))
    if error is None:
        transport.lock()
    else:
        with pytest.raises(error) as caught:
            transport.lock()
        assert type(caught.value) is error
    transport.close()
