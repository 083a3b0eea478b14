"""What a virtual generator only keeps, and its state after a reset.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import math

import pytest

from instruments.clock import VirtualClock
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.generators import number
from support.wire import ask, errors, send

#: The state after *RST as a public driver of the family lists it (without the edges, which are the 33600's there).
AFTER_RESET = """\
SOUR1:AM:DEPT +1.000000000000000E+02|SOUR1:AM:DSSC 0|SOUR1:AM:INT:FREQ +1.000000000000000E+02|SOUR1:AM:INT:FUNC SIN
SOUR1:BPSK:INT:RATE +1.000000000000000E+01|SOUR1:BPSK:PHAS +1.800000000000000E+02|SOUR1:BPSK:STAT 0
SOUR1:BURS:GATE:POL NORM|SOUR1:BURS:INT:PER +1.000000000000000E-02|SOUR1:BURS:MODE TRIG
SOUR1:BURS:NCYC +1.000000000000000E+00|SOUR1:BURS:STAT 0|DISP 1|FORM:BORD NORM|INIT1:CONT 1
OUTP1:LOAD +5.000000000000000E+01|OUTP1:MODE NORM|OUTP1:POL NORM|OUTP1:SYNC:MODE NORM|OUTP1:SYNC:POL NORM|OUTP:SYNC 1
OUTP:SYNC:SOUR CH1|OUTP:TRIG 0|OUTP:TRIG:SLOP POS|OUTP:TRIG:SOUR CH1|OUTP 0|ROSC:SOUR INT|ROSC:SOUR:AUTO ON
SOUR1:FM:DEV +1.000000000000000E+02|SOUR1:FM:INT:FREQ +1.000000000000000E+01|SOUR1:FREQ +1.000000000000000E+03
SOUR1:FREQ:CENT +5.500000000000000E+02|SOUR1:FREQ:MODE CW|SOUR1:FREQ:SPAN +9.000000000000000E+02
SOUR1:FREQ:STAR +1.000000000000000E+02|SOUR1:FREQ:STOP +1.000000000000000E+03|SOUR1:FSK:FREQ +1.000000000000000E+02
SOUR1:FSK:INT:RATE +1.000000000000000E+01|SOUR1:FUNC SIN|SOUR1:FUNC:ARB "INT:\\BUILTIN\\EXP_RISE.ARB"
SOUR1:FUNC:ARB:ADV SRAT|SOUR1:FUNC:ARB:FILT STEP|SOUR1:FUNC:ARB:FREQ +1.600000000000000E+02
SOUR1:FUNC:ARB:PER +6.250000000000000E-03|SOUR1:FUNC:ARB:PTP +1.000000000000000E-01
SOUR1:FUNC:ARB:SRAT +4.000000000000000E+04|SOUR1:FUNC:NOIS:BAND +1.000000000000000E+05
SOUR1:FUNC:PRBS:BRAT +1.000000000000000E+03|SOUR1:FUNC:PRBS:DATA PN7|SOUR1:FUNC:PULS:HOLD WIDT
SOUR1:FUNC:PULS:PER +1.000000000000000E-03|SOUR1:FUNC:PULS:WIDT +1.000000000000000E-04
SOUR1:FUNC:RAMP:SYMM +1.000000000000000E+02|SOUR1:FUNC:SQU:DCYC +5.000000000000000E+01
SOUR1:FUNC:SQU:PER +1.000000000000000E-03|SOUR1:LIST:DWEL +1.000000000000000E+00
SOUR1:LIST:FREQ +1.00000000E+002,+1.00000000E+003,+5.50000000E+002|SOUR1:MARK:CYC +2.000000000000000E+00
SOUR1:MARK:FREQ +5.000000000000000E+02|SOUR1:PM:DEV +1.800000000000000E+02|SOUR1:PWM:DEV +1.000000000000000E-05
SOUR1:PWM:DEV:DCYC +1.000000000000000E+00|SOUR1:SUM:AMPL +1.000000000000000E-01|SOUR1:SWE:HTIM +0.000000000000000E+00
SOUR1:SWE:RTIM +0.000000000000000E+00|SOUR1:SWE:SPAC LIN|SOUR1:SWE:STAT 0|SOUR1:SWE:TIME +1.000000000000000E+00
SOUR1:VOLT:HIGH +5.000000000000000E-02|SOUR1:VOLT:LOW -5.000000000000000E-02
SOUR1:VOLT:LIM:HIGH +5.000000000000000E+00|SOUR1:VOLT:LIM:LOW -5.000000000000000E+00|SOUR1:VOLT:LIM:STAT 0
SOUR1:VOLT:RANG:AUTO 1|SOUR1:VOLT:UNIT VPP|TRIG1:COUN +1.000000000000000E+00|TRIG1:DEL +0.000000000000000E+00
TRIG1:LEV +3.300000000000000E+00|TRIG1:SLOP POS|TRIG1:SOUR IMM|TRIG1:TIM +1.000000000000000E+00|UNIT:ANGL DEG"""


def test_the_state_after_reset_is_that_of_the_family(generator):
    for entry in AFTER_RESET.replace("\n", "|").split("|"):
        header, _, value = entry.partition(" ")
        assert ask(generator, header + "?") == value
        send(generator, entry.encode() + b"\n")
    assert errors(generator) == []
    assert dict(generator.settings) == Virtual33500B(VirtualClock()).settings | {"1:list": "100.0,1000.0,550.0"}


def test_a_text_is_displayed_until_it_is_cleared(either):
    assert ask(either, "DISP:TEXT 'coil on; do not touch';:DISP:TEXT?") == '"coil on; do not touch"'
    assert ask(either, "DISP:TEXT:CLE;:DISP:TEXT?") == '""'
    assert ask(either, "DISP:TEXT 'it''s on';:DISP:TEXT?") == '"it\'s on"'
    send(either, b'DISP:TEXT "a" "b"\n')
    assert errors(either) == [-103]


@pytest.mark.parametrize("text", ["hello", "x", "'half", "\"other'"])
def test_a_text_without_its_quotes_is_refused(either, text):
    assert ask(either, f"DISP:TEXT {text}") is None
    assert errors(either)[0] in {-102, -104}
    assert ask(either, "DISP:TEXT?") == '""'


def test_the_channels_can_be_brought_into_phase(generator):
    send(generator, b"PHAS:SYNC\nSOUR2:PHAS:SYNC\nPHAS:REF\n")
    assert errors(generator) == []


def test_reset_leaves_no_entry_and_what_stood_before(either):
    send(either, b"FUNC PULS;FREQ 1 MHZ;VOLT 10;:OUTP:LOAD INF;:BURS:STAT ON\n*CLS\n*RST\n")
    assert errors(either) == []
    state = dict(either.settings)
    assert state == type(either)(VirtualClock()).settings


@pytest.mark.parametrize("header", ["PHAS", "BURS:PHAS"])
def test_an_angle_is_in_the_unit_that_is_sent_or_that_of_UNIT_ANGL(either, header):
    send(either, f"{header} 1 RAD\n".encode())
    assert number(either, f"{header}?") == pytest.approx(math.degrees(1), rel=1e-12)
    send(either, f"{header} -90 DEG;:UNIT:ANGL RAD\n".encode())
    assert number(either, f"{header}?") == pytest.approx(-math.pi / 2, rel=1e-12)
    assert number(either, f"{header}? MAX") == pytest.approx(2 * math.pi, rel=1e-12)
    send(either, f"{header} 0.5\n".encode())
    assert number(either, f"UNIT:ANGL DEG;:{header}?") == pytest.approx(math.degrees(0.5), rel=1e-12)
    assert errors(either) == []


def test_a_sample_rate_has_a_unit_with_a_slash(generator):
    assert number(generator, "FUNC:ARB:SRAT 2 KSA/S;SRAT?") == 2000.0
    assert ask(generator, "FREQ 1000 SA/S") is None
    assert errors(generator) == [-131]
