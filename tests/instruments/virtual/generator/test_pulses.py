"""Pulses, squares and ramps of the virtual generators.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import pytest

from support.generators import entries, number
from support.wire import errors, send


def test_period_and_frequency_are_one_setting(either):
    send(either, b"PULS:PER 0.02\n")
    assert number(either, "FREQ?") == 50.0
    send(either, b"FREQ 40\n")
    assert number(either, "FUNC:PULS:PER?") == 0.025


def test_width_and_duty_cycle_are_one_setting_and_one_of_them_is_held(either):
    send(either, b"FUNC PULS;FREQ 100;FUNC:PULS:WIDT 2 ms\n")
    assert number(either, "FUNC:PULS:DCYC?") == pytest.approx(20.0)
    send(either, b"FREQ 200\n")
    assert (number(either, "PULS:WIDT?"), number(either, "PULS:DCYC?")) == pytest.approx((2e-3, 40.0))
    send(either, b"FUNC:PULS:HOLD DCYC\nFREQ 100\n")
    assert (number(either, "PULS:WIDT?"), number(either, "PULS:DCYC?")) == pytest.approx((4e-3, 40.0))
    assert errors(either) == []


def test_a_pulse_gives_way_to_its_period_and_its_edges_to_the_pulse(generator):
    send(generator, b"FUNC PULS;FUNC:PULS:TRAN 1 us;:FREQ 1 MHZ\n")
    assert entries(generator) == [
        '-221,"Settings conflict;pulse width decreased due to period"',
        *['-221,"Settings conflict;edge time decreased due to pulse width"'] * 2,
    ]
    assert number(generator, "PULS:WIDT?") == pytest.approx(1e-6 - 16e-9)
    assert number(generator, "FUNC:PULS:TRAN?") == pytest.approx(10e-9)  # 0.625 of the gap


def test_leading_and_trailing_edges_are_set_together_or_each(generator):
    send(generator, b"FUNC:PULS:TRAN:BOTH 20 ns;LEAD 30 ns\n")
    assert [number(generator, f"FUNC:PULS:TRAN{which}?") for which in ("", ":LEAD", ":TRA")] == [3e-8, 3e-8, 2e-8]


def test_a_fast_square_has_less_room_for_its_duty_cycle(generator, older):
    send(generator, b"FUNC SQU;FUNC:SQU:DCYC 10;:FREQ 20 MHZ\n")
    assert number(generator, "FUNC:SQU:DCYC?") == pytest.approx(32.0)  # 16 ns of 50 ns
    send(older, b"FUNC SQU;FUNC:SQU:DCYC 80;:FREQ 15 MHZ\n")
    assert number(older, "FUNC:SQU:DCYC?") == 60.0
    assert errors(generator) == errors(older) == [-221]
