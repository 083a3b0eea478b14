"""APPLy: a signal in one command.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import pytest

from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.generators import number
from support.wire import ask, errors, send


def test_apply_sets_the_signal_and_switches_it_on(either):
    send(either, b"BURS:STAT ON\nAPPL:SQU 5 KHZ, 3.0 VPP, -2.5 V\n")
    digits = 15 if isinstance(either, Virtual33500B) else 13
    numbers = ",".join(
        f"{sign}{mantissa:.{digits}f}E+0{power}" for sign, mantissa, power in (("+", 5, 3), ("+", 3, 0), ("-", 2.5, 0))
    )
    assert ask(either, "APPL?") == f'"SQU {numbers}"'
    assert ask(either, "OUTP?;:BURS:STAT?") == "1;0"
    assert errors(either) == []


def test_what_apply_leaves_out_is_the_default(either):
    send(either, b"FREQ 40;VOLT 3\nAPPL:SIN\n")
    assert (number(either, "FREQ?"), number(either, "VOLT?")) == (1e3, 0.1)
    send(either, b"APPL:DC DEF,DEF,2\n")
    assert number(either, "VOLT:OFFS?") == 2.0
    assert ask(either, "APPL:SIN 1,2,3,4") is None
    assert errors(either) == [-108]


@pytest.mark.parametrize("wrong", ["APPL:SQU 2000,x", "APPL:RAMP 5,1,1 HZ", "APPL:SQU 1,2,3,4"])
def test_apply_with_a_parameter_that_is_wrong_changes_nothing(either, wrong):
    send(either, b"FREQ 40;VOLT 3;:BURS:STAT ON\n")
    errors(either)
    before = dict(either.settings)
    send(either, f"{wrong}\n".encode())
    assert len(errors(either)) == 1
    assert either.settings == before


def test_apply_keeps_within_the_limits(either):
    send(either, b"APPL:RAMP 1 MHZ,8,4\n")
    assert [number(either, question) for question in ("FREQ?", "VOLT?", "VOLT:OFFS?")] == [200e3, 8.0, 1.0]
    assert errors(either) == [-222, -222]
