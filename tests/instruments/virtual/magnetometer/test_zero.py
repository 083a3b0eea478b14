"""Zero, relative readings, extremes and alarms of the virtual gaussmeters."""

import pytest

from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.gaussmeters import EACH, meter, value
from support.wire import ask, send


@EACH
def test_zeroing_takes_its_time_and_then_the_present_field_is_zero(kind):
    device = meter(kind, 20e-6, zero_error=5e-6)
    ask(device, "UNIT 2;RDGMODE?")
    device.clock.sleep(2.0)
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(25e-6, rel=0.1)
    send(device, b"ZPROBE\n")
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(25e-6, rel=0.1)
    assert not int(ask(device, "OPST?")) & 128
    device.clock.sleep(6.0)
    assert int(ask(device, "OPST?")) & 128
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(0.0, abs=5e-7)
    send(device, b"ZCLEAR\n")
    device.clock.sleep(1.0)
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(25e-6, rel=0.1)


def test_peaks_are_counted_from_the_zero_that_was_taken():
    device = meter(Virtual475, zero_error=5e-6)  # a steady 12.3 mT: both peaks are the field, and its probe's error
    device.clock.sleep(2.0)
    before = [float(part) for part in ask(device, "UNIT 2;RDGMODE 3;RDGPEAK?").split(",")]
    assert before == pytest.approx([12.305e-3] * 2, rel=1e-5)
    assert ask(device, "ZPROBE;*OPC?") == "1"
    device.clock.sleep(2.0)
    assert [float(part) for part in ask(device, "RDGPEAK?").split(",")] == pytest.approx([0.0] * 2, abs=5e-7)


def test_the_475_holds_its_answer_until_it_is_zeroed():
    device = meter(Virtual475)
    before = device.clock.now()
    assert ask(device, "ZPROBE;*OPC?") == "1"
    assert device.clock.now() - before == pytest.approx(5.0, abs=0.1)
    assert int(ask(device, "OPST?")) & 128


@EACH
def test_relative_readings(kind):
    device = meter(kind)
    assert ask(device, "UNIT 2;RELSP 0.01;RELSP?") == "+100.000E-04"
    assert value(ask(device, "RDGREL?")) == pytest.approx(0.0023, abs=1e-5)
    assert value(ask(device, "UNIT 1;RELSP?")) == pytest.approx(100.0)


def test_the_475_takes_the_present_field_as_what_is_relative_to():
    device = meter(Virtual475)
    device.clock.sleep(2.0)
    assert ask(device, "REL 1,2;REL?") == "1,2"
    assert value(ask(device, "RELSP?")) == pytest.approx(123.0, rel=1e-3)


def test_extremes_are_kept_until_they_are_reset():
    field = [0.01]
    device = meter(Virtual475, lambda _: field[0])
    for size in (0.01, 0.03, -0.02, 0.0):
        field[0] = size
        device.clock.sleep(2.0)
        ask(device, "RDGFIELD?")
    lowest, highest = map(float, ask(device, "UNIT 2;RDGMNMX?").split(","))
    assert (lowest, highest) == (pytest.approx(-0.02, rel=1e-3), pytest.approx(0.03, rel=1e-3))
    lowest, highest = map(float, ask(device, "MXRST;RDGMNMX?").split(","))
    assert lowest == pytest.approx(0.0, abs=1e-6)
    assert highest == pytest.approx(0.0, abs=1e-6)


def test_the_425_keeps_the_greatest_only():
    device = meter()
    device.clock.sleep(2.0)
    assert float(ask(device, "RDGMX?")) == pytest.approx(123.0, rel=1e-3)
    assert ask(device, "RDGMNMX?").startswith("+000.000E+00,+12")


@pytest.mark.parametrize(
    ("alarm", "on"),
    [
        ("0,1,100,120,1,0,0", "0,0"),
        ("1,1,100,120,1,0,0", "0,1"),
        ("1,1,130,200,1,0,0", "1,0"),
        ("1,1,100,200,1,0,0", "0,0"),
        ("1,1,100,200,2,0,0", "1,1"),
    ],
)
def test_alarms_and_the_relay(alarm, on):
    device = meter()  # 123 G
    assert ask(device, f"ALARM {alarm};RELAY 2,3;ALARMST?;RELAYST?") == f"{on};{int('1' in on)}"
    assert bool(int(ask(device, "OPST?")) & 8) is ("1" in on)


@EACH
def test_without_a_probe_there_is_no_field(kind):
    device = meter(kind, probe=None)
    assert ask(device, "RDGFIELD?") == "NO PROBE"
    assert ask(device, "OPST?;TYPE?") == "001;00"


@EACH
def test_the_factory_settings_come_back_only_when_meant(kind):
    device = meter(kind)
    assert ask(device, "UNIT 3;DFLT;UNIT?") == "3"
    assert ask(device, "DFLT 99;UNIT?;AUTO?") == "1;1"
