"""What is beyond the limits of a virtual generator is clipped, with an entry in the queue.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import pytest

from instruments.clock import VirtualClock
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.generators import entries, number
from support.wire import ask, errors, send


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
def test_a_number_beyond_its_limits_is_clipped_with_an_error(generator, message, asked, value, entry):
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


def test_a_waveform_that_cannot_be_so_fast_is_slowed_with_an_error(either):
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


def test_a_pulse_lasts_a_tenth_of_its_period_after_reset(generator):
    assert number(generator, "FUNC:PULS:DCYC? DEF") == number(generator, "FUNC:PULS:DCYC?") == 10.0
    assert number(generator, "FUNC PRBS;FREQ? MIN") == 1e-3
