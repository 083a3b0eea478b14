"""Messages, units and numbers of the virtual gaussmeters."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.virtual.magnetometer.lakeshore import field_text
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.gaussmeters import EACH, meter, value
from support.wire import ask, received, send


@pytest.mark.parametrize(
    ("device", "identity"),
    [
        (meter(), "LSCI,MODEL425,VIRTUAL,1.0"),
        (meter(Virtual475), "LSCI,MODEL475,VIRTUAL,01012020"),
        (meter(Virtual475, identity="LSCI,MODEL455,VIRTUAL,01012020"), "LSCI,MODEL455,VIRTUAL,01012020"),
    ],
)
def test_who_they_are(device, identity):
    send(device, b"*IDN?\n")
    assert received(device) == identity.encode() + b"\r\n"


@EACH
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_a_message_may_end_with_or_without_a_carriage_return(kind, end):
    device = meter(kind)
    send(device, b"UNIT?" + end)
    assert received(device) == b"1\r\n"


@EACH
@pytest.mark.parametrize("message", ["FOO?", "RDGFIELD", "SYST:ERR?", "UNIT", "UNIT 5;UNIT?", "UNIT x;UNIT?", "?"])
def test_what_is_not_understood_is_ignored(kind, message):
    device = meter(kind)
    assert ask(device, message, timeout=5.0) is None
    assert ask(device, "UNIT?") == "1"


@EACH
@pytest.mark.parametrize("message", ["UNIT 0", "UNIT 5", "UNIT 1.5", "RANGE 0", "RANGE 9", "AUTO 2", "RDGMODE 9,1,1"])
def test_a_number_that_is_none_of_them_changes_nothing(kind, message):
    device = meter(kind)
    before = dict(device.settings)
    send(device, message.encode() + b"\n")
    assert device.settings == before


@EACH
@pytest.mark.parametrize(("unit", "per_tesla"), [(1, 1e4), (2, 1.0), (3, 1e4), (4, 1 / (4e-7 * math.pi))])
def test_the_field_in_each_unit(kind, unit, per_tesla):
    device = meter(kind)
    send(device, f"UNIT {unit}\n".encode())
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(0.0123 * per_tesla, rel=1e-3)
    assert ask(device, "UNIT?") == str(unit)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (12.3456, "+123.456E-01"),  # the manual's
        (-0.0001, "-100.000E-06"),
        (99.99996, "+100.000E+00"),
        (999.99999, "+100.000E+01"),
        (350e3, "+350.000E+03"),
        (0.0, "+000.000E+00"),
    ],
)
def test_numbers_are_printed_as_in_the_manual(number, text):
    assert field_text(number) == text


@given(st.floats(min_value=1e-12, max_value=1e12) | st.floats(min_value=-1e12, max_value=-1e-12))
def test_a_printed_number_has_six_digits_and_is_the_number(number):
    text = field_text(number)
    assert len(text) == len("+123.456E-01")
    assert float(text) == pytest.approx(number, rel=5.1e-6)


def test_the_answer_begins_after_ten_milliseconds():
    device = meter()
    send(device, b"UNIT?\n")
    assert received(device, timeout=9e-3) is None
    assert received(device, timeout=2e-3) == b"1\r\n"


@pytest.mark.parametrize("message", [b"\0RDGFIELD? \r\n", b"  UNIT? \r\n", b"\x0bUNIT?\x0c\n", b"UNIT?;\x85\n"])
def test_what_is_no_character_is_a_blank(message):
    device = meter()
    send(device, message)
    assert received(device)


def test_several_questions_in_one_message_are_answered_in_one():
    assert ask(meter(), "UNIT 2;UNIT?;RANGE 3;RANGE?") == "2;3"


def test_a_question_mark_alone_asks_again():
    device = meter()
    assert [ask(device, message) for message in ("UNIT?", "?", "AUTO?", "?")] == ["1", "1", "1", "1"]
    send(device, b"UNIT 2\n")
    assert [ask(device, "UNIT?"), ask(device, "?")] == ["2", "2"]
