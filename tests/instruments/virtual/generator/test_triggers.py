"""Bursts, sweeps and triggers of the virtual generators.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import pytest

from instruments.virtual.generator.channel import Burst
from support.generators import entries, number
from support.wire import ask, cable, errors, send


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


def test_an_endless_burst_is_never_complete_until_it_is_aborted(generator):
    send(generator, b"BURS:NCYC INF;:TRIG:SOUR BUS;:BURS:STAT ON;:OUTP ON\n*TRG\n")
    assert ask(generator, "*OPC?", timeout=100.0) is None
    cable(generator).clear()
    assert ask(generator, "BURS:NCYC?") == "+9.900000000000000E+37"
    send(generator, b"ABOR\n")
    assert ask(generator, "*OPC?") == "1"


def test_a_trigger_that_nothing_waits_for_queues_an_error(either):
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
