"""The status registers of the virtual 475, and none of the 425."""

from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.gaussmeters import meter
from support.wire import ask, send


def test_the_425_has_no_status_registers():
    device = meter()
    assert [ask(device, question, 1.0) for question in ("*ESR?", "*STB?", "*OPC?", "*TST?")] == [None] * 4


def test_the_475_sets_event_bits_for_what_it_does_not_understand():
    device = meter(Virtual475)
    assert ask(device, "*ESR?") == "128"
    send(device, b"FOO?\n")
    send(device, b"UNIT 9\n")
    assert ask(device, "*ESR?;*ESR?") == "048;000"


def test_the_475_latches_operation_events_for_a_service_request():
    device = meter(Virtual475)
    send(device, b"OPSTE 2;*SRE 128;RANGE 1\n")
    assert int(ask(device, "OPST?")) & 2
    assert ask(device, "*STB?") == "192"
    assert int(ask(device, "OPSTR?")) & 2
    send(device, b"*CLS;AUTO 1\n")
    assert ask(device, "*STB?") == "000"


def test_a_reset_of_the_475_leaves_the_masks_of_the_status():
    device = meter(Virtual475)
    send(device, b"*ESE 48;*SRE 16;FOO;*RST\n")
    assert ask(device, "*ESE?;*SRE?;*STB?") == "48;16;032"
