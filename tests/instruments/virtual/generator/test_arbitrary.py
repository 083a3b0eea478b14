"""The virtual generator 33522B: what it puts out is told, its settings give way to each other as the manual says.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from instruments.clock import VirtualClock
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.arbitrary import samples
from instruments.virtual.generator.generator import Burst, Output
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.wire import ask, cable, errors, received, send


@pytest.fixture
def told():
    return []


@pytest.fixture
def generator(told):
    return Virtual33500B(VirtualClock(), listener=lambda time, output: told.append((time, output)))


@pytest.fixture
def older():
    return Virtual33220A(VirtualClock())


@pytest.fixture(params=[Virtual33500B, Virtual33220A], ids=["33500B", "33220A"])
def either(request):
    return request.param(VirtualClock())


def number(device, question):
    """The answer as a number."""
    return float(ask(device, question))


def entries(device):
    """The error queue as text."""
    return list(iter(lambda: ask(device, "SYST:ERR?"), device.no_error))


# --- what the listener is told ---


def test_the_output_is_off_at_power_on(generator, told):
    send(generator, b"OUTP?\n")
    assert received(generator, 1.0) == b"0\n"
    assert generator.signal() == Output("SIN", 1000.0, 0.0, 0.0)
    assert told == []


def test_the_listener_is_told_at_each_change_and_when(generator, told):
    send(generator, b"OUTP:LOAD INF\n")
    del told[:]
    send(generator, b"FUNC SQU;FREQ 40;VOLT 10;VOLT:OFFS 0.5\n")
    generator.clock.sleep(2.5)
    send(generator, b"OUTP ON\n")
    generator.clock.sleep(1.0)
    send(generator, b"FREQ 41\n")
    send(generator, b"OUTP OFF\n")
    off = Output("SQU", 40.0, 0.0, 0.0)
    assert [output for _, output in told[:3]] == [Output("SQU", 1e3, 0.0, 0.0), off, off]
    assert told[-3:] == [
        (2.5, Output("SQU", 40.0, 5.0, 0.5)),  # 10 V from peak to peak are an amplitude of 5 V
        (3.5, Output("SQU", 41.0, 5.0, 0.5)),
        (3.5, Output("SQU", 41.0, 0.0, 0.0)),
    ]


def test_a_coil_takes_twice_the_voltage_that_a_matched_load_would(generator):
    send(generator, b"VOLT 4;VOLT:OFFS 1;:OUTP ON\n")
    assert generator.signal() == Output("SIN", 1e3, 4.0, 2.0)
    before = generator.signal()
    send(generator, b"OUTP:LOAD INF\n")  # a change of what is displayed, not of what is there
    assert generator.signal() == before
    assert (number(generator, "VOLT?"), number(generator, "VOLT:OFFS?")) == (8.0, 2.0)


def test_a_refused_change_is_no_change(generator, told):
    send(generator, b"OUTP MAYBE\nFREQ 31 FURLONG\nFOO\nFREQ?\n")
    assert told == []


def test_the_output_is_off_after_reset(generator, told):
    send(generator, b"FREQ 40\nVOLT 10\nOUTP ON\n*RST\n")
    assert told[-1][1] == Output("SIN", 1000.0, 0.0, 0.0)
    assert generator.signal().amplitude == 0.0


def test_nobody_need_listen():
    send(Virtual33500B(VirtualClock()), b"OUTP ON\n")


def test_the_coil_hangs_on_channel_one(generator, told):
    send(generator, b"SOUR2:FREQ 40;VOLT 3;:OUTP2 ON;:OUTP2:LOAD INF\n")
    assert told == []
    assert generator.signal(2) == Output("SIN", 40.0, 3.0, 0.0)
    assert (ask(generator, "OUTP1?"), number(generator, "SOUR1:FREQ?")) == ("0", 1e3)


def test_what_else_shapes_the_signal_is_told_too(generator):
    send(generator, b"FUNC SQU;FUNC:SQU:DCYC 30;:PHAS 90;:OUTP:POL INV;:OUTP ON\n")
    output = generator.signal()
    assert (output.duty, output.phase, output.inverted) == (0.3, 90.0, True)
    send(generator, b"FUNC RAMP;FUNC:RAMP:SYMM 25\n")
    assert generator.signal().symmetry == 0.25
    send(generator, b"FUNC PULS;FUNC:PULS:WIDT 250 us\n")
    assert generator.signal().duty == pytest.approx(0.25)


# --- limits: what is beyond them is clipped and told ---


@pytest.mark.parametrize(
    ("message", "asked", "value", "entry"),
    [
        # The real instrument takes the limit; texts as in the device tests of a public driver (Fixate, 33500B)
        ("FREQ 31 MHZ", "FREQ?", 30e6, "upper"),
        ("FREQ 0", "FREQ?", 1e-6, "lower"),
        ("FREQ 1e999", "FREQ?", 30e6, "upper"),
        ("VOLT 11", "VOLT?", 10.0, "upper"),
        ("VOLT 0.1 mV", "VOLT?", 1e-3, "lower"),
        ("VOLT:OFFS 5", "VOLT:OFFS?", 4.95, "upper"),  # 100 mVpp are there too
        ("PHAS 362", "PHAS?", 360.0, "upper"),
        ("PHAS -363", "PHAS?", -360.0, "lower"),
        ("FUNC:SQU:DCYC 100", "FUNC:SQU:DCYC?", 99.99, "upper"),
        ("OUTP:LOAD 0", "OUTP:LOAD?", 1.0, "lower"),
        ("BURS:INT:PER 9000", "BURS:INT:PER?", 8000.0, "upper"),
        ("BURS:NCYC 0", "BURS:NCYC?", 1.0, "lower"),
    ],
)
def test_a_number_beyond_its_limits_is_clipped_and_told(generator, message, asked, value, entry):
    assert ask(generator, message) is None
    assert entries(generator) == [f'-222,"Data out of range;value clipped to {entry} limit"']
    assert number(generator, asked) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("device", "waveform", "top"),
    [
        *((Virtual33500B, word, top) for word, top in (("SIN", 30e6), ("SQU", 30e6), ("TRI", 200e3), ("RAMP", 200e3))),
        (Virtual33500B, "PULS", 30e6),
        *((Virtual33220A, word, top) for word, top in (("SIN", 20e6), ("SQU", 20e6), ("RAMP", 200e3), ("PULS", 5e6))),
        (Virtual33220A, "USER", 6e6),
    ],
)
def test_each_waveform_has_its_highest_frequency(device, waveform, top):
    device = device(VirtualClock())
    send(device, f"FUNC {waveform}\n".encode())
    assert number(device, "FREQ? MAX") == top


def test_a_waveform_that_cannot_be_so_fast_is_made_slower_and_that_is_told(either):
    send(either, b"FREQ 19 MHZ\nFUNC RAMP\n")
    assert number(either, "FREQ?") == 200e3
    assert entries(either) == ['-221,"Settings conflict;frequency reduced for ramp function"']


def test_every_waveform_is_answered_in_its_short_form(generator, older):
    for word in ("SIN", "SQU", "TRI", "RAMP", "PULS", "PRBS", "NOIS", "ARB", "DC"):
        assert ask(generator, f"FUNC {word};FUNC?") == word
    for word in ("SIN", "SQU", "RAMP", "PULS", "NOIS", "DC", "USER"):
        assert ask(older, f"FUNC {word};FUNC?") == word
    assert errors(generator) == errors(older) == []
    assert ask(older, "FUNC TRI") is None
    assert errors(older) == [-224]


# --- voltages ---


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


# --- pulses, squares, ramps ---


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


def test_a_phase_is_in_the_unit_that_is_set(either):
    send(either, b"PHAS 90\nUNIT:ANGL RAD\n")
    assert number(either, "PHAS?") == pytest.approx(math.pi / 2)
    send(either, b"PHAS 1\nUNIT:ANGL DEG\n")
    assert number(either, "PHAS?") == pytest.approx(math.degrees(1))


# --- bursts, sweeps, triggers ---


def test_a_burst_waits_for_its_trigger_and_then_lasts(generator, told):
    send(generator, b"OUTP:LOAD INF;:FREQ 100;VOLT 4;BURS:NCYC 50;:TRIG:SOUR BUS;:BURS:STAT ON;:OUTP ON\n")
    assert generator.signal().amplitude == 0.0
    generator.clock.sleep(1.0)
    del told[:]
    assert ask(generator, "*TRG;*OPC?") == "1"
    assert generator.clock.now() == pytest.approx(1.5)  # 50 cycles of 100 Hz
    assert [(time, output.amplitude) for time, output in told] == [(1.0, 2.0), (1.5, 0.0)]
    assert told[0][1].burst == Burst(50, None)


def test_a_change_within_a_burst_tells_its_end_anew(generator, told):
    send(generator, b"OUTP:LOAD INF;:FREQ 100;BURS:NCYC 50;:TRIG:SOUR BUS;:BURS:STAT ON;:OUTP ON\n*TRG\n")
    generator.clock.sleep(0.2)
    del told[:]
    send(generator, b"VOLT 6\n")
    assert [(time, output.amplitude) for time, output in told] == [(0.2, 3.0), (0.5, 0.0)]
    send(generator, b"ABOR\n")
    assert told[-1] == (0.2, told[-1][1])
    assert told[-1][1].amplitude == 0.0


def test_an_endless_burst_is_never_complete_until_it_is_aborted(generator):
    send(generator, b"BURS:NCYC INF;:TRIG:SOUR BUS;:BURS:STAT ON;:OUTP ON\n*TRG\n")
    assert ask(generator, "*OPC?", timeout=100.0) is None
    cable(generator).clear()
    assert ask(generator, "BURS:NCYC?") == "+9.900000000000000E+37"
    send(generator, b"ABOR\n")
    assert ask(generator, "*OPC?") == "1"


def test_a_trigger_that_nothing_waits_for_is_ignored_and_told(either):
    send(either, b"*TRG\n")
    assert errors(either) == [-211]


def test_a_trigger_command_needs_no_source(generator):
    send(generator, b"FREQ 10;:BURS:STAT ON;:TRIG:SOUR EXT;:OUTP ON\nTRIG\n")
    assert generator.signal().amplitude > 0
    generator.clock.sleep(0.2)
    assert generator.signal().amplitude == 0.0


def test_a_closed_gate_keeps_the_signal_in(generator):
    send(generator, b"BURS:MODE GAT;:BURS:STAT ON;:OUTP ON\n")
    assert generator.signal().amplitude == 0.0
    send(generator, b"BURS:GATE:POL INV\n")
    assert generator.signal().amplitude > 0


def test_immediate_bursts_have_a_period_that_fits_them(either):
    send(either, b"FREQ 100;BURS:NCYC 10;INT:PER 1 ms\nBURS:STAT ON\n")
    assert number(either, "BURS:INT:PER?") == pytest.approx(0.1, rel=1e-4)
    assert entries(either) == ['-221,"Settings conflict;burst period increased to fit entire burst"']


def test_a_voltage_without_a_frequency_has_no_burst_and_no_sweep(either):
    send(either, b"FUNC DC;BURS:STAT ON\nSWE:STAT ON\n")
    assert ask(either, "BURS:STAT?;:SWE:STAT?") == "0;0"
    assert entries(either) == [
        f'-221,"Settings conflict;not able to {what} this function"' for what in ("burst", "sweep")
    ]


def test_only_one_mode_is_on(either):
    send(either, b"BURS:STAT ON;:SWE:STAT ON\n")
    assert ask(either, "BURS:STAT?;:SWE:STAT?") == "0;1"
    send(either, b"AM:STAT ON\n")
    assert ask(either, "SWE:STAT?;:AM:STAT?") == "0;1"
    assert errors(either) == [-221, -221]


def test_a_sweep_has_ends_or_a_centre_and_a_span(either):
    send(either, b"FREQ:CENT 50;SPAN 20\n")
    assert (number(either, "FREQ:STAR?"), number(either, "FREQ:STOP?")) == (40.0, 60.0)
    send(either, b"SWE:TIME 5;:SWE:SPAC LOG;:TRIG:SOUR BUS;:SWE:STAT ON\n*TRG\n")
    assert ask(either, "*OPC?") == "1"
    assert either.clock.now() == pytest.approx(5.0, abs=0.02)


# --- APPLy ---


def test_apply_sets_the_signal_and_switches_it_on(either):
    send(either, b"BURS:STAT ON\nAPPL:SQU 5 KHZ, 3.0 VPP, -2.5 V\n")
    digits = 15 if isinstance(either, Virtual33500B) else 13
    numbers = ",".join(
        f"{sign}{mantissa:.{digits}f}E+0{power}" for sign, mantissa, power in (("+", 5, 3), ("+", 3, 0), ("-", 2.5, 0))
    )
    assert ask(either, "APPL?") == f'"SQU {numbers}"'
    assert ask(either, "OUTP?;:BURS:STAT?") == "1;0"
    assert errors(either) == []


def test_what_apply_is_not_told_is_the_default(either):
    send(either, b"FREQ 40;VOLT 3\nAPPL:SIN\n")
    assert (number(either, "FREQ?"), number(either, "VOLT?")) == (1e3, 0.1)
    send(either, b"APPL:DC DEF,DEF,2\n")
    assert number(either, "VOLT:OFFS?") == 2.0
    assert ask(either, "APPL:SIN 1,2,3,4") is None
    assert errors(either) == [-108]


def test_apply_keeps_within_the_limits(either):
    send(either, b"APPL:RAMP 1 MHZ,8,4\n")
    assert [number(either, question) for question in ("FREQ?", "VOLT?", "VOLT:OFFS?")] == [200e3, 8.0, 1.0]
    assert errors(either) == [-222, -222]


# --- arbitrary waveforms ---


def test_after_reset_a_built_in_waveform_is_selected(generator, older):
    assert ask(generator, "FUNC:ARB?") == '"INT:\\BUILTIN\\EXP_RISE.ARB"'
    # 250 samples at 40 kSa/s, as a public driver lists the state after *RST
    assert ask(generator, "FUNC:ARB:SRAT?;FREQ?") == "+4.000000000000000E+04;+1.600000000000000E+02"
    assert ask(older, "FUNC:USER?") == "EXP_RISE"


FORMS = [
    ("DATA:ARB ramp,", b"-1,-0.5,0,0.5,1,0.5,0,-0.5"),
    ("DATA:ARB:DAC ramp,", b"-32767,-16384,0,16384,32767,16384,0,-16384"),
    ("DATA:ARB ramp,", b"#232" + struct.pack(">8f", -1, -0.5, 0, 0.5, 1, 0.5, 0, -0.5)),
    ("DATA:ARB:DAC ramp,", b"#216" + struct.pack(">8h", -32767, -16384, 0, 16384, 32767, 16384, 0, -16384)),
    (
        "FORM:BORD SWAP;:DATA:ARB:DAC ramp,",
        b"#216" + struct.pack("<8h", -32767, -16384, 0, 16384, 32767, 16384, 0, -16384),
    ),
]


@pytest.mark.parametrize(("head", "data"), FORMS)
def test_a_waveform_is_sent_as_numbers_or_as_a_block(generator, head, data):
    send(generator, head.encode() + data + b"\n")
    send(generator, b'FUNC:ARB "ramp";:FUNC ARB;:FUNC:ARB:SRAT 400;:VOLT 2;:OUTP:LOAD INF;:OUTP ON\n')
    assert errors(generator) == []
    assert ask(generator, "FUNC:ARB?;:DATA:VOL:CAT?") == '"RAMP";"INT:\\BUILTIN\\EXP_RISE.ARB","RAMP"'
    output = generator.signal()
    assert (output.waveform, output.frequency) == ("ARB", 50.0)  # eight samples at 400 Sa/s
    assert np.allclose(output.samples, [-1, -0.5, 0, 0.5, 1, 0.5, 0, -0.5], atol=1e-4)


def test_each_channel_has_its_own_waveforms(generator):
    send(generator, b"SOUR2:DATA:ARB mine,0,0,0,0,0,0,0,1\n")
    assert ask(generator, "SOUR2:DATA:VOL:CAT?").endswith('"MINE"')
    assert "MINE" not in ask(generator, "SOUR1:DATA:VOL:CAT?")
    assert ask(generator, "FUNC:ARB mine") is None
    assert errors(generator) == [785]


@pytest.mark.parametrize(
    ("message", "number"),
    [
        (b"DATA:ARB a,0,0,0", -222),  # fewer than eight
        (b"DATA:ARB a,0,0,0,0,0,0,0,1.5", -222),
        (b"DATA:ARB a,0,0,0,0,0,0,0,x", -104),
        (b"DATA:ARB a", -109),
        (b"DATA:ARB", -109),
        (b'DATA:ARB "a b",0,0,0,0,0,0,0,0', -224),
        (b"DATA:ARB:DAC a,#19" + bytes(9), 800),
        (b"DATA:ARB:DAC a,#Q17", -102),
        (b'FUNC:ARB "nowhere"', 785),
        (b'MMEM:LOAD:DATA "INT:\\NOWHERE.ARB"', -256),
    ],
)
def test_a_waveform_that_is_none_is_refused(generator, message, number):
    send(generator, message + b"\n")
    assert errors(generator) == [number]
    assert ask(generator, "DATA:VOL:CAT?") == '"INT:\\BUILTIN\\EXP_RISE.ARB"'


def test_a_block_that_breaks_off_is_no_waveform():
    with pytest.raises(ScpiError, match="-102"):
        samples(["#13ab"], full_scale=1.0, block=">i2", least=1, most=8)


def test_there_is_no_room_for_more_than_the_memory_holds():
    with pytest.raises(ScpiError, match="781"):
        samples(["0"] * 9, full_scale=1.0, block=">i2", least=1, most=8)


def test_a_waveform_is_not_overwritten_but_can_be_cleared(generator):
    send(generator, b"DATA:ARB a,0,0,0,0,0,0,0,1\nDATA:ARB a,1,1,1,1,1,1,1,1\n")
    assert entries(generator) == ['+786,"Specified arb waveform already exists"']
    assert number(generator, "DATA:ATTR:AVER? a") == 0.125
    free = number(generator, "DATA:VOL:FREE?")
    send(generator, b"FUNC:ARB a;:DATA:VOL:CLE\n")
    assert number(generator, "DATA:VOL:FREE?") == free + 8
    assert ask(generator, "FUNC:ARB?") == '"INT:\\BUILTIN\\EXP_RISE.ARB"'


def test_a_built_in_waveform_is_loaded_first(generator):
    send(generator, b'MMEM:LOAD:DATA "INT:\\BUILTIN\\SINC.ARB"\nFUNC:ARB "INT:\\BUILTIN\\SINC.ARB"\n')
    assert errors(generator) == []
    assert number(generator, "DATA:ATTR:POIN?") == 250


def test_the_frequency_of_an_arbitrary_waveform_is_that_of_its_samples(generator):
    send(generator, b"DATA:ARB a,0,0,0,0,0,0,0,1\nFUNC:ARB a;:FUNC ARB;:FREQ 50\n")
    assert number(generator, "FUNC:ARB:SRAT?") == 400
    assert number(generator, "FREQ? MAX") == 250e6 / 8
    assert number(generator, "FUNC:ARB:PER?") == 0.02
    send(generator, b"FUNC SIN\n")
    assert number(generator, "FREQ?") == 1e3


def test_the_older_one_has_one_volatile_waveform_and_copies_of_it(older):
    send(older, b"DATA VOLATILE,-1,0,1,0\nDATA:COPY mine\nFUNC:USER VOLATILE;:FUNC USER\n")
    assert ask(older, "DATA:CAT?") == '"VOLATILE","MINE","EXP_RISE","EXP_FALL","NEG_RAMP","SINC","CARDIAC"'
    assert ask(older, "DATA:NVOL:CAT?;:DATA:NVOL:FREE?;:FUNC:USER?") == '"MINE";+3;VOLATILE'
    assert list(older.signal().samples) == [-1, 0, 1, 0]
    send(older, b"DATA:DAC VOLATILE,#18" + struct.pack(">4h", -8191, 0, 8191, 0) + b"\n")
    assert errors(older) == []
    assert number(older, "DATA:ATTR:PTP? VOLATILE") == 1.0


@pytest.mark.parametrize(
    ("message", "number"),
    [
        ("DATA mine,1,0", -224),
        ("DATA VOLATILE", -109),
        ("DATA:COPY", -109),
        ("DATA:COPY mine", 785),
        ("DATA VOLATILE,1;:DATA:COPY SINC", 782),
        ("DATA VOLATILE,1;:DATA:COPY mine,SINC", 784),
        ("DATA:DEL SINC", 786),
        ("DATA:DEL mine", 785),
        ("DATA VOLATILE,1;:FUNC:USER VOLATILE;:DATA:DEL VOLATILE", 787),
        ("FUNC:USER mine", 785),
        ("DATA:ATTR:POIN? mine", 785),
    ],
)
def test_what_the_older_one_refuses(older, message, number):
    assert ask(older, message) is None
    assert errors(older) == [number]


def test_the_older_one_keeps_four_copies_and_forgets_what_is_not_selected(older):
    send(older, b"DATA VOLATILE,1,0\n")
    for name in (b"A", b"B", b"C", b"D", b"E"):
        send(older, b"DATA:COPY " + name + b"\n")
    assert errors(older) == [781]
    send(older, b"FUNC:USER A\nDATA:DEL B\nDATA:DEL:ALL\n")
    assert ask(older, "DATA:NVOL:CAT?") == '"A"'


# --- the rest ---


@pytest.mark.parametrize(
    "message",
    [
        *("OUTP:SYNC OFF", "OUTP:TRIG ON", "OUTP:TRIG:SLOP NEG", "OUTP:POL INV", "TRIG:SLOP NEG", "SWE:SPAC LOG"),
        *("BURS:MODE GAT", "BURS:GATE:POL INV", "FORM:BORD SWAP", "UNIT:ANGL RAD", "SYST:BEEP:STAT OFF", "DISP OFF"),
        *("AM:SOUR EXT", "FM:INT:FUNC SQU", "VOLT:RANG:AUTO OFF", "SYST:COMM:RLST REM"),
    ],
)
def test_a_word_or_a_switch_is_kept(either, message):
    header, _, word = message.partition(" ")
    assert ask(either, f"{message};:{header}?") == {"ON": "1", "OFF": "0"}.get(word, word)
    assert errors(either) == []


@pytest.mark.parametrize(
    "message",
    [
        *("OUTP1:SYNC:SOUR CH2", "OUTP2:SYNC:MODE CARR", "TRIG2:SOUR TIM", "SOUR2:FUNC:ARB:FILT NORM"),
        *("FUNC:ARB:ADV TRIG", "FUNC:PRBS:DATA PN9", "SOUR2:SUM:SOUR EXT", "INIT2:CONT OFF", "OUTP2:MODE GAT"),
    ],
)
def test_a_word_or_a_switch_of_the_newer_one_is_kept(generator, message):
    header, _, word = message.partition(" ")
    assert ask(generator, f"{message};:{header}?") == {"ON": "1", "OFF": "0"}.get(word, word)
    assert errors(generator) == []


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
    assert dict(generator.settings) == Virtual33500B(VirtualClock()).settings | {"list": "100.0,1000.0,550.0"}


def test_a_text_is_displayed_until_it_is_cleared(either):
    assert ask(either, "DISP:TEXT 'coil on; do not touch';:DISP:TEXT?") == '"coil on; do not touch"'
    assert ask(either, "DISP:TEXT:CLE;:DISP:TEXT?") == '""'


def test_the_channels_can_be_brought_into_phase(generator):
    send(generator, b"PHAS:SYNC\nSOUR2:PHAS:SYNC\nPHAS:REF\n")
    assert errors(generator) == []


def test_reset_leaves_no_entry_and_what_stood_before(either):
    send(either, b"FUNC PULS;FREQ 1 MHZ;VOLT 10;:OUTP:LOAD INF;:BURS:STAT ON\n*CLS\n*RST\n")
    assert errors(either) == []
    state = dict(either.settings)
    assert state == type(either)(VirtualClock()).settings


HEADERS = (
    *(
        "FREQ",
        "FUNC",
        "VOLT",
        "VOLT:OFFS",
        "VOLT:HIGH",
        "VOLT:LOW",
        "VOLT:UNIT",
        "OUTP",
        "OUTP:LOAD",
        "PHAS",
        "APPL:SIN",
    ),
    *("FUNC:PULS:WIDT", "FUNC:PULS:DCYC", "FUNC:PULS:TRAN", "FUNC:PULS:HOLD", "FUNC:PULS:PER", "FUNC:SQU:DCYC"),
    *("BURS:STAT", "BURS:NCYC", "BURS:INT:PER", "BURS:MODE", "TRIG:SOUR", "SWE:STAT", "*TRG", "*RST", "FUNC:ARB:SRAT"),
    *(
        "VOLT:LIM:STAT",
        "VOLT:LIM:HIGH",
        "VOLT:LIM:LOW",
        "DATA:ARB A,",
        "DATA VOLATILE,",
        "FUNC:ARB",
        "FUNC:USER",
        "ABOR",
    ),
    *("APPL:DC", "UNIT:ANGL", "FUNC:ARB:FREQ", "TRIG:DEL", "DATA:ARB:DAC B,#216"),
)
WORDS = (
    *(
        "SIN",
        "SQU",
        "PULS",
        "RAMP",
        "DC",
        "NOIS",
        "PRBS",
        "ARB",
        "USER",
        "MIN",
        "MAX",
        "DEF",
        "INF",
        "ON",
        "OFF",
        "DBM",
        "VRMS",
    ),
    *(
        "VPP",
        "BUS",
        "IMM",
        "GAT",
        "TRIG",
        "DCYC",
        "WIDT",
        "0",
        "1",
        "-5",
        "1e-9",
        "4.7",
        "1e6",
        "3e7",
        "9.9e37",
        "1e999",
    ),
    *("A", "VOLATILE", "0,0,0,0,0,0,0,1", "1 MHZ,20,-3", "2 DBM", "-300 DBM", "RAD", "abcdefghijklmnop"),
)


@settings(deadline=None, max_examples=60)
@given(commands=st.lists(st.tuples(st.sampled_from(HEADERS), st.sampled_from(WORDS)), max_size=30))
def test_whatever_is_set_the_settings_fit_each_other(commands):
    for kind in (Virtual33500B, Virtual33220A):
        device = kind(VirtualClock(), listener=lambda *_: None)
        for header, word in commands:
            send(device, f"{header} {word}\n".encode())
        channel = device.channels[0]
        low, high = channel.levels()
        half = 0.0 if channel["waveform"] == "DC" else channel.number("amplitude_vpp") / 2
        if low < high:  # voltage limits that leave no room are nobody's
            assert channel.number("offset") + half <= high + 1e-6 or half >= (high - low) / 2 - 1e-6
        assert all(np.isfinite(value) for value in device.settings.values() if isinstance(value, float))
        slowest, fastest = channel.frequency_limits()
        assert slowest * (1 - 1e-9) <= channel.frequency <= fastest * (1 + 1e-9)
        cable(device).clear()
        assert ask(device, "*CLS;*IDN?") == device.identity
