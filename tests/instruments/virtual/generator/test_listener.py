"""What the listener of a virtual generator gets.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import pytest

from instruments.virtual.generator.channel import Burst, Output
from support.wire import ask, numbers, received, send


def test_the_output_is_off_at_power_on(generator, changes):
    send(generator, b"OUTP?\n")
    assert received(generator, 1.0) == b"0\n"
    assert generator.signal() == Output("SIN", 1000.0, 0.0, 0.0)
    assert changes == []


def test_the_listener_gets_each_change_and_its_time(generator, changes):
    send(generator, b"OUTP:LOAD INF\n")
    del changes[:]
    send(generator, b"FUNC SQU;FREQ 40;VOLT 10;VOLT:OFFS 0.5\n")
    generator.clock.sleep(2.5)
    send(generator, b"OUTP ON\n")
    generator.clock.sleep(1.0)
    send(generator, b"FREQ 41\n")
    send(generator, b"OUTP OFF\n")
    off = Output("SQU", 40.0, 0.0, 0.0)
    assert [output for _, output in changes[:3]] == [Output("SQU", 1e3, 0.0, 0.0), off, off]
    assert changes[-3:] == [
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
    assert numbers(ask(generator, "VOLT?;VOLT:OFFS?").replace(";", ",")) == [8.0, 2.0]


def test_a_refused_change_is_no_change(generator, changes):
    send(generator, b"OUTP MAYBE\nFREQ 31 FURLONG\nFOO\nFREQ?\n")
    assert changes == []


def test_the_output_is_off_after_reset(generator, changes):
    send(generator, b"FREQ 40\nVOLT 10\nOUTP ON\n*RST\n")
    assert changes[-1][1] == Output("SIN", 1000.0, 0.0, 0.0)
    assert generator.signal().amplitude == 0.0


def test_the_coil_hangs_on_channel_one(generator, changes):
    send(generator, b"SOUR2:FREQ 40;VOLT 3;:OUTP2 ON;:OUTP2:LOAD INF\n")
    assert changes == []
    assert generator.signal(2) == Output("SIN", 40.0, 3.0, 0.0)
    assert (ask(generator, "OUTP1?"), float(ask(generator, "SOUR1:FREQ?"))) == ("0", 1e3)


def test_the_listener_gets_all_that_shapes_the_signal(generator):
    send(generator, b"FUNC SQU;FUNC:SQU:DCYC 30;:PHAS 90;:OUTP:POL INV;:OUTP ON\n")
    output = generator.signal()
    assert (output.duty, output.phase, output.inverted) == (0.3, 90.0, True)
    send(generator, b"FUNC RAMP;FUNC:RAMP:SYMM 25\n")
    assert generator.signal().symmetry == 0.25
    send(generator, b"FUNC PULS;FUNC:PULS:WIDT 250 us\n")
    assert generator.signal().duty == pytest.approx(0.25)


def test_a_burst_waits_for_its_trigger_and_then_lasts(generator, changes):
    send(generator, b"OUTP:LOAD INF;:FREQ 100;VOLT 4;BURS:NCYC 50;:TRIG:SOUR BUS;:BURS:STAT ON;:OUTP ON\n")
    assert generator.signal().amplitude == 0.0
    generator.clock.sleep(1.0)
    del changes[:]
    assert ask(generator, "*TRG;*OPC?") == "1"
    assert generator.clock.now() == pytest.approx(1.5)  # 50 cycles of 100 Hz
    assert [(time, output.amplitude) for time, output in changes] == [(1.0, 2.0), (1.5, 0.0)]
    assert changes[0][1].burst == Burst(50, None)


def test_a_change_within_a_burst_announces_its_end_anew(generator, changes):
    send(generator, b"OUTP:LOAD INF;:FREQ 100;BURS:NCYC 50;:TRIG:SOUR BUS;:BURS:STAT ON;:OUTP ON\n*TRG\n")
    generator.clock.sleep(0.2)
    del changes[:]
    send(generator, b"VOLT 6\n")
    assert [(time, output.amplitude) for time, output in changes] == [(0.2, 3.0), (0.5, 0.0)]
    send(generator, b"ABOR\n")
    assert changes[-1] == (0.2, changes[-1][1])
    assert changes[-1][1].amplitude == 0.0
