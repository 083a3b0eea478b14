"""The transport over pyserial: a virtual bench in the same process, a socket, a pseudo-terminal, ports that fail."""

import contextlib
import errno
import os
import sys
import threading
from unittest.mock import Mock

import pytest
import pyvisa
import serial
import serial.tools.list_ports  # before a test changes what platform this is
from hypothesis import given
from hypothesis import strategies as st

from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.errors import BadAnswer, InstrumentError, NoAnswer, NotConnected, Occupied, OutOfRange
from instruments.links.opening import open_link
from instruments.links.serial_port import port_name
from instruments.virtual.bench import protocol_levilab
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.core.line import LineSettings, receive
from instruments.virtual.magnetometer.lakeshore_425 import Virtual425
from support.slow import IDENTITY, Slow
from support.waiting import HANG_GUARD_S as AT_MOST

METER = "levilab://magnetometer"
SLOW = "levilab://slow"
#: The 425's line; the pause between two exchanges is the wall's, and would make the tests wait.
LINE = dict(LakeShore425.SERIAL) | {"pause": 0.0}


@pytest.fixture
def bench(clock, monkeypatch):
    bench = VirtualBench(
        {
            "ASRLlevilab://magnetometer::INSTR": Virtual425(clock, flux_density=lambda _: 0.0123, zero_error=0.0),
            "ASRLslow::INSTR": Slow(clock),
            "GPIB0::1::INSTR": Slow(clock),
        }
    )
    monkeypatch.setattr(
        serial, "protocol_handler_packages", [*serial.protocol_handler_packages, "instruments.virtual.bench"]
    )
    monkeypatch.setattr(protocol_levilab, "plugged", [bench])
    return bench


# --- faults ---


def test_a_port_that_another_program_has_taken_is_occupied(bench):
    with contextlib.closing(open_link(SLOW)) as transport:
        next(iter(bench._client_locks.values())).holders[:] = ["another program"]
        with pytest.raises(Occupied):
            transport.query("*IDN?")


# --- wrong settings ---


@pytest.mark.parametrize(
    ("wrong", "error"),
    [
        ({"parity": "none", "data_bits": 8}, BadAnswer),
        ({"parity": "even"}, BadAnswer),
        ({"baud_rate": 9600}, NoAnswer),
        ({"baud_rate": 115200}, NoAnswer),
    ],
)
def test_wrong_settings_raise_each_time_with_a_hint(bench, wrong, error):
    with contextlib.closing(open_link(METER, line=LINE | wrong)) as transport:
        for _ in range(2):
            with pytest.raises(error, match="parity"):
                transport.query("*IDN?")


def test_a_parity_that_does_not_exist_is_refused():
    with pytest.raises(OutOfRange) as refused:
        open_link(METER, line={"parity": "Odd"})
    assert (refused.value.name, refused.value.value) == ("parity", "Odd")


@pytest.mark.parametrize("wrong", [{"data_bits": 9}, {"stop_bits": 3}, {"baud_rate": -1}])
def test_settings_that_no_port_has_raise(bench, wrong):
    with pytest.raises(NotConnected, match="cannot be opened"):
        open_link(METER, line=LINE | wrong)


LINES = st.builds(
    LineSettings,
    st.sampled_from([300, 1200, 9600, 19200, 57600, 115200]),
    st.sampled_from([5, 6, 7, 8]),
    st.sampled_from("NEOMS"),
    st.sampled_from([1.0, 1.5, 2.0]),
)


@given(st.binary(max_size=64), LINES)
def test_between_ends_set_alike_bytes_arrive_as_they_were_sent(data, line):
    mask = (1 << line.data_bits) - 1
    assert receive(data, line, line) == bytes(byte & mask for byte in data)


@given(st.binary(max_size=64), LINES)
def test_more_stop_bits_than_needed_change_nothing(data, line):
    # the samples of a receiver at twice the rate would fall elsewhere: this goes through the bits
    twice = LineSettings(line.baud_rate, line.data_bits, line.parity, 2.0)
    other = "O" if line.parity == "E" else "E"
    assert receive(data, twice, line) == receive(data, line, line)
    if line.parity != "N":
        unchecked = LineSettings(line.baud_rate, line.data_bits, other, 1.0)
        assert receive(data, line, unchecked, checked=False) == receive(data, line, line)


@given(st.binary(max_size=64), LINES, LINES)
def test_garbage_is_the_same_each_time_and_no_longer_than_time_allows(data, sender, receiver):
    heard = receive(data, sender, receiver)
    assert heard == receive(data, sender, receiver)
    shortest = (1 + receiver.data_bits + (receiver.parity != "N") + 0.5) / receiver.baud_rate
    assert len(heard) <= sender.duration(len(data)) / shortest + 1
    assert all(byte < 1 << receiver.data_bits for byte in heard)


def test_what_a_program_set_to_8n1_hears_of_a_425():
    # as seen by many who forgot the parity: every other letter has its highest bit set
    heard = receive(b"LSCI,MODEL425", LineSettings(57600, 7, "O"), LineSettings(57600, 8, "N"))
    assert heard == b"L\xd3CI,\xcdO\xc4EL42\xb5"


class Port:
    """A port that hears these bytes, one piece after each message, whatever was sent."""

    def __init__(self, pieces):
        self.pieces, self.heard, self.timeout = list(pieces), b"", 1.0

    def write(self, data):
        self.heard += self.pieces.pop(0) if self.pieces else b""

    @property
    def in_waiting(self):
        return len(self.heard)

    def read(self, count):
        got, self.heard = self.heard[:count], self.heard[count:]
        return got

    def reset_input_buffer(self):
        self.heard = b""

    def reset_output_buffer(self): ...
    def close(self): ...


PIECES = st.lists(
    st.binary(max_size=30)
    | st.sampled_from(
        [b"1\r\n", b"LSCI,MODEL425,1,1.0\r\n", b"#15abcde\n", b"#9999999999", b"#0", b"\n\n\n", b"#210ab\r\n"]
    ),
    max_size=12,
)


@given(PIECES)
def test_whatever_is_heard_is_text_or_a_block_or_an_error(pieces):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(serial, "serial_for_url", lambda *_, **__: Port(pieces))
        transport = open_link("COM1", timeout=1.0)
        for _ in range(3):
            with contextlib.suppress(InstrumentError):
                answer = transport.query("UNIT?")
                assert answer.isprintable() or "\t" in answer
            with contextlib.suppress(InstrumentError):
                assert len(transport.query_block("DATA?")) < 100
        assert len(transport.port.received) < 100


# --- ports ---


@pytest.mark.parametrize(
    ("address", "name"),
    [
        ("COM3", "COM3"),
        ("/dev/ttyUSB0", "/dev/ttyUSB0"),
        ("ASRLCOM3::INSTR", "COM3"),
        ("ASRL/dev/ttyUSB0::INSTR", "/dev/ttyUSB0"),
        ("asrl/dev/ttyUSB0", "/dev/ttyUSB0"),
        ("ASRLsocket://127.0.0.1:4001::INSTR", "socket://127.0.0.1:4001"),
        ("socket://127.0.0.1:4001", "socket://127.0.0.1:4001"),
    ],
)
def test_a_port_in_each_spelling(address, name):
    assert port_name(address) == name


@pytest.mark.parametrize(("platform", "name"), [("win32", "COM3"), ("linux", "/dev/ttyS2"), ("darwin", "/dev/ttyS2")])
def test_visas_third_port(monkeypatch, platform, name):
    monkeypatch.setattr(sys, "platform", platform)
    assert port_name("ASRL3::INSTR") == name


def failing(monkeypatch, error):
    monkeypatch.setattr(serial, "serial_for_url", Mock(side_effect=error))


@pytest.mark.parametrize(
    ("platform", "error", "expected", "words"),
    [
        ("linux", serial.SerialException(errno.EBUSY, "busy"), Occupied, "another program"),
        ("linux", serial.SerialException(errno.EAGAIN, "exclusively"), Occupied, "another program"),
        ("linux", serial.SerialException(errno.EACCES, "denied"), NotConnected, "may not use this port"),
        ("linux", serial.SerialException(errno.ENOENT, "none"), NotConnected, "the serial ports of this computer are"),
        ("win32", serial.SerialException("PermissionError(13, 'Access is denied.')"), Occupied, "another program"),
        ("win32", serial.SerialException("FileNotFoundError(2, ...)"), NotConnected, "serial ports of this computer"),
        ("linux", ValueError("no such\nbaud rate"), NotConnected, "no such baud rate"),
        (
            "linux",
            serial.SerialException(errno.EACCES, "denied"),
            NotConnected,
            "ask the administrator of this computer",
        ),
    ],
)
def test_the_error_of_a_port_that_does_not_open_has_advice(monkeypatch, platform, error, expected, words):
    failing(monkeypatch, error)
    monkeypatch.setattr(sys, "platform", platform)
    with pytest.raises(expected, match=words) as missing:
        open_link("/dev/ttyUSB7")
    assert missing.value.address == "/dev/ttyUSB7"
    assert "\n" not in str(missing.value)


@pytest.mark.skipif(os.name != "posix", reason="groups")
def test_the_error_of_a_forbidden_port_names_its_group(monkeypatch, tmp_path):
    import grp

    port = tmp_path / "ttyUSB0"
    port.touch()
    group = grp.getgrgid(port.stat().st_gid).gr_name
    failing(monkeypatch, serial.SerialException(errno.EACCES, "denied"))
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(NotConnected, match=f"usermod -aG {group}"):
        open_link(str(port))


def test_a_locked_port_is_occupied_until_it_is_given_back(bench):
    first, second = open_link(SLOW), open_link(SLOW)
    first.lock()
    with pytest.raises(Occupied):
        second.lock()
    second.close()
    first.reopen()
    with pytest.raises(Occupied):
        open_link(SLOW)
    first.close()
    with contextlib.closing(open_link(SLOW)) as third:
        third.lock()
        assert third.query("*IDN?") == IDENTITY


# --- the URL handler ---


def test_a_program_with_nothing_but_pyserial(bench):
    with serial.serial_for_url(METER, baudrate=57600, bytesize=7, parity="O", timeout=1) as port:
        assert port.write(b"*IDN?\n") == 6
        assert port.readline() == b"LSCI,MODEL425,VIRTUAL,1.0\r\n"
        port.write(b"UNIT?\n")
        while not port.in_waiting:  # looking takes time too
            pass
        assert port.read(port.in_waiting) == b"1\r\n"
        assert port.read(1) == b""
        port.write(b"UNIT?\n")
        port.flush()
        port.reset_output_buffer()
        assert port.read_until(b"\n") == b"1\r\n"
        assert (port.cts, port.dsr, port.ri, port.cd) == (True, True, False, True)
    assert not port.is_open


def test_a_read_that_would_wait_for_ever_raises(bench):
    with serial.serial_for_url(SLOW) as port:
        port.write(b"SLOW?\n")
        assert port.read(5) == b"slow\n"
        with pytest.raises(serial.SerialException, match="for ever"):
            port.read(1)


def test_a_url_before_a_bench_is_plugged_in_is_refused(bench, monkeypatch):
    monkeypatch.setattr(protocol_levilab, "plugged", [])
    with pytest.raises(serial.SerialException, match=r"plug_in\(bench\) comes first"):
        serial.serial_for_url("levilab://absent")


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("levilab://absent", "no 'absent' on a serial line: it has ASRLlevilab"),
        ("levilab://gpib0::1", "no 'gpib0::1'"),
    ],
)
def test_a_url_that_leads_nowhere(bench, url, words):
    with pytest.raises(serial.SerialException, match=words):
        serial.serial_for_url(url)


def test_a_port_that_is_closed_does_nothing(bench):
    port = serial.serial_for_url(SLOW, do_not_open=True)
    for use in (lambda: port.read(1), lambda: port.write(b"x"), lambda: port.in_waiting, port.flush):
        with pytest.raises(serial.SerialException, match="not open"):
            use()
    port.open()
    with pytest.raises(serial.SerialException, match="already open"):
        port.open()
    port.close()


def test_pyvisa_py_takes_the_url_too(bench):
    if sys.platform == "win32":
        pytest.skip("pyvisa-py writes COM before every port there")
    manager = pyvisa.ResourceManager("@py")
    settings = {"baud_rate": 57600, "data_bits": 7, "parity": pyvisa.constants.Parity.odd}
    with manager.open_resource(f"ASRL{METER}::INSTR", read_termination="\r\n", **settings) as line:
        line.write_termination = "\n"
        assert line.query("*IDN?") == "LSCI,MODEL425,VIRTUAL,1.0"
    manager.close()


# --- real links ---


@pytest.mark.skipif(sys.platform != "linux", reason="a pseudo-terminal")
def test_a_line_at_a_pseudo_terminal():
    import tty

    master, slave = os.openpty()
    tty.setraw(slave)
    address = os.ttyname(slave)

    def instrument():
        heard = b""
        while not heard.endswith(b"BYE\n"):
            heard += os.read(master, 100)
            if heard.endswith(b"TEXT?\n"):
                os.write(master, b"+1.0\r\n")
                heard = b""

    thread = threading.Thread(target=instrument)
    thread.start()
    try:
        with contextlib.closing(open_link(address, timeout=AT_MOST)) as transport:
            transport.lock()
            assert transport.query("TEXT?") == "+1.0"
            second = open_link(address)
            with pytest.raises(Occupied):
                second.lock()
            second.close()
    finally:
        os.write(slave, b"BYE\n")
        thread.join(AT_MOST)
        os.close(master)
        os.close(slave)
    assert not thread.is_alive()
