"""The virtual DSOX1102G's ways to wait, and its whole settings."""

import pytest

from support.scopes import KEYSIGHT_READY, configure, keysight, pulses
from support.wire import ask, cable, errors, received, send


def test_digitize_is_complete_when_the_record_is():
    device = keysight(pulses, *KEYSIGHT_READY)
    before = device.clock.now()
    send(device, b":DIG CHAN1\n")
    assert ask(device, "*OPC?") == "1"
    record = device.record()
    assert not record.forced
    assert device.clock.now() == pytest.approx(record.done, abs=3 * device.pace)
    assert device.clock.now() - before >= 0.1


def test_digitize_without_a_trigger_blocks_until_a_device_clear():
    device = keysight(pulses, *KEYSIGHT_READY, ":TRIG:EDGE:LEV 1.3")
    send(device, b":DIG CHAN1\n*OPC?\n")
    assert received(device, 1000.0) is None
    assert ask(device, "*IDN?", 10.0) is None
    cable(device).clear()
    assert ask(device, "*IDN?").startswith("KEYSIGHT")
    assert ask(device, ":OPER:COND?") == "+0"


def test_the_operation_register_shows_running_and_waiting():
    device = keysight(pulses, *KEYSIGHT_READY, ":TRIG:EDGE:LEV 1.3", ":SING")
    assert ask(device, ":OPER:COND?") == "+8"  # it fills the part before the trigger
    device.clock.sleep(1.0)
    assert ask(device, ":OPER:COND?") == "+40"
    assert [ask(device, ":AER?"), ask(device, ":AER?")] == ["+1", "+0"]
    configure(device, ":STOP")
    assert ask(device, ":OPER:COND?") == "+0"


def test_the_trigger_event_is_answered_once():
    device = keysight(pulses, *KEYSIGHT_READY, ":SING")
    assert ask(device, ":TER?") == "+0"
    device.clock.sleep(1.0)
    assert [ask(device, ":TER?"), ask(device, ":TER?")] == ["+1", "+0"]


@pytest.mark.parametrize("mode", ["ROLL", "XY"])
def test_there_is_no_record_in_roll_and_xy(mode):
    device = keysight(pulses, f":TIM:MODE {mode}")
    send(device, b":DIG CHAN1\n")
    assert ask(device, ":WAV:DATA?", 1.0) is None
    assert errors(device) == [-221, -221]


def test_whole_settings_of_the_keysight():
    device = keysight(pulses, "*RST")
    assert ask(device, ":TIM?") == ":TIM:MODE MAIN;REF CENT;MAIN:RANG +1.00000E-03;POS +0.000000E+00"
    assert ask(device, ":CHAN1?") == (
        ":CHAN1:RANG +4.00000E+01;OFFS +0.00000E+00;COUP DC;IMP ONEM;DISP 1;BWL 0;INV 0;"
        'LAB "1";UNIT VOLT;PROB +1.00000E+01;PROB:SKEW +0.00E+00;STYP SING'
    )


@pytest.mark.parametrize(("kind", "number", "count"), [("NORM", 0, 1), ("AVER", 2, 4), ("HRES", 3, 1)])
def test_the_preamble_names_the_kind_of_acquisition(kind, number, count):
    # Keysight InfiniiVision 1000 X-Series, Programmer's Guide, :WAVeform:PREamble: 0 normal, 1 peak, 2 average, 3 hres
    device = keysight(pulses, *KEYSIGHT_READY, f":ACQ:TYPE {kind}", ":ACQ:COUN 4", ":SING")
    device.clock.sleep(5.0)
    fields = ask(device, ":WAV:PRE?").split(",")
    assert (int(fields[1]), int(fields[3])) == (number, count)
