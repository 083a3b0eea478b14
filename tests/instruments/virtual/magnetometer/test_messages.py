"""Messages, units and numbers of the virtual gaussmeters."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.virtual.magnetometer.lakeshore import field_text
from support.gaussmeters import EACH, meter
from support.wire import received, send


@EACH
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_a_message_may_end_with_or_without_a_carriage_return(kind, end):
    device = meter(kind)
    send(device, b"UNIT?" + end)
    assert received(device) == b"1\r\n"


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
