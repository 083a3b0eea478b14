"""Amplitude, offset, levels, units and load of the virtual generators.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import math

import pytest

from support.generators import entries, number
from support.wire import ask, errors, send


def test_an_amplitude_that_leaves_no_room_takes_it_from_the_offset(either):
    send(either, b"VOLT:OFFS 4\nVOLT 8\n")
    assert (number(either, "VOLT?"), number(either, "VOLT:OFFS?")) == (8.0, 1.0)
    assert entries(either) == ['-221,"Settings conflict;offset changed due to amplitude"']


def test_an_offset_that_leaves_no_room_is_clipped(either):
    send(either, b"VOLT 8\nVOLT:OFFS -4\n")
    assert (number(either, "VOLT?"), number(either, "VOLT:OFFS?")) == (8.0, -1.0)
    assert errors(either) == [-222]


def test_high_and_low_are_amplitude_and_offset_in_other_words(either):
    send(either, b"VOLT:HIGH 2\nVOLT:LOW -3\n")
    assert (number(either, "VOLT?"), number(either, "VOLT:OFFS?")) == (5.0, -0.5)
    send(either, b"VOLT 1\n")
    assert (number(either, "VOLT:HIGH?"), number(either, "VOLT:LOW?")) == (0.0, -1.0)
    assert errors(either) == []


def test_a_high_level_below_the_low_one_pushes_it_down(generator):
    send(generator, b"VOLT:HIGH 2;LOW 1;:VOLT:HIGH -1\n")
    assert (number(generator, "VOLT:HIGH?"), number(generator, "VOLT:LOW?")) == (-1.0, -1.001)
    send(generator, b"VOLT:LOW 3\n")
    assert (number(generator, "VOLT:HIGH?"), number(generator, "VOLT:LOW?")) == (3.001, 3.0)
    assert errors(generator) == [-221, -221]


def test_a_dc_voltage_may_use_the_whole_range_and_another_waveform_takes_it_back(either):
    send(either, b"FUNC DC\nVOLT:OFFS 5\n")
    assert errors(either) == []
    send(either, b"VOLT 2;:FUNC SIN\n")
    assert number(either, "VOLT:OFFS?") == 4.0
    assert entries(either) == ['-221,"Settings conflict;offset changed on exit from dc function"']


@pytest.mark.parametrize(
    ("waveform", "vrms"), [("SIN", 2 / math.sqrt(8)), ("SQU", 1.0), ("RAMP", 1 / math.sqrt(3)), ("PULS", 1.0)]
)
def test_an_amplitude_is_shown_in_the_unit_that_is_asked_for(either, waveform, vrms):
    send(either, f"FUNC {waveform};VOLT 2;VOLT:UNIT VRMS\n".encode())
    assert number(either, "VOLT?") == pytest.approx(vrms)
    send(either, b"VOLT:UNIT DBM\n")
    assert number(either, "VOLT?") == pytest.approx(10 * math.log10(vrms**2 / 50 / 1e-3))
    send(either, b"VOLT:UNIT VPP\n")
    assert number(either, "VOLT?") == 2.0


@pytest.mark.parametrize(
    ("sent", "vpp"), [("2 VPP", 2.0), ("500 mVpp", 0.5), ("1 VRMS", math.sqrt(8)), ("10 DBM", 2.0), ("250 mV", 0.25)]
)
def test_an_amplitude_may_be_sent_with_its_unit(either, sent, vpp):
    send(either, f"VOLT {sent}\n".encode())
    assert number(either, "VOLT?") == pytest.approx(vpp)
    assert ask(either, "VOLT:UNIT?") == "VPP"
    assert errors(either) == []


def test_an_unknown_load_has_no_power(either):
    send(either, b"VOLT:UNIT DBM\nOUTP:LOAD INF\n")
    assert ask(either, "VOLT:UNIT?") == "VPP"
    send(either, b"VOLT:UNIT DBM\n")
    assert ask(either, "VOLT:UNIT?") == "VPP"
    assert ask(either, "VOLT 1 DBM") is None
    assert errors(either) == [-221, -221, -221]


def test_the_load_changes_what_is_displayed_and_the_limits(either):
    send(either, b"VOLT 10;:OUTP:LOAD INF\n")
    assert (number(either, "VOLT?"), number(either, "VOLT? MAX")) == (20.0, 20.0)
    send(either, b"OUTP:LOAD 100\n")
    assert number(either, "VOLT?") == pytest.approx(20 * 100 / 150)
    send(either, b"OUTP:LOAD 9.9e37\n")
    assert ask(either, "OUTP:LOAD?") in {"+9.900000000000000E+37", "+9.9000000000000E+37"}
    assert [number(either, f"OUTP:LOAD? {word}") for word in ("MIN", "MAX", "DEF")] == [1.0, 1e4, 50.0]
    assert errors(either) == []


def test_voltage_limits_hold_when_they_are_switched_on(generator):
    send(generator, b"VOLT:LIM:HIGH 1;LOW -1;STAT ON\nVOLT 4\n")
    assert number(generator, "VOLT?") == 2.0
    assert errors(generator) == [-222]


def test_voltage_limits_without_room_leave_the_smallest_amplitude(either):
    send(either, b"VOLT:UNIT DBM;:VOLT:LIM:LOW 4;HIGH -4;STAT ON\n")
    assert number(either, "VOLT:UNIT VPP;:VOLT?") == number(either, "VOLT? MIN") > 0
    assert number(either, "VOLT:UNIT DBM;:VOLT?") < 0


def test_a_limit_is_taken_as_it_is_printed(either):
    send(either, b"FUNC SQU\n")
    shortest = ask(either, "FUNC:SQU:PER? MIN")  # a third of 10 ns, at 30 MHz
    send(either, f"FUNC:SQU:PER {shortest}\n".encode())
    assert (ask(either, "FUNC:SQU:PER?"), errors(either)) == (shortest, [])
