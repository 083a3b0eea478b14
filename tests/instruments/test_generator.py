"""The generator's driver: the manual's bytes.

Source: Keysight 33500 Series Operating and Service Guide; public drivers of the family.
"""

import pytest
from conversation import NO_ERROR, SILENCE, accepted, conversation

from instruments.errors import CommandRefused, NoAnswer, OutOfRange
from instruments.generator import Keysight33500B


def test_the_signal_is_set_for_a_coil_from_a_clean_state_with_the_offset_gone_before_the_amplitude_comes():
    lines = accepted("*RST", "OUTP1:LOAD INF", "VOLT:UNIT VPP", "FUNC SIN", "FREQ 30.5", "VOLT:OFFS 0.0", "VOLT 10.0")
    with conversation(Keysight33500B, *lines) as generator:
        generator.prepare(waveform="SIN", frequency_hz=30.5, amplitude_vpp=10.0)


def test_off_is_sent_and_seen():
    with conversation(Keysight33500B, ("*CLS", None), ("OUTP1 OFF", None), ("OUTP1?", "0")) as generator:
        generator.off()


def test_an_output_that_stays_on_is_an_error():
    with (
        conversation(Keysight33500B, ("*CLS", None), ("OUTP1 OFF", None), ("OUTP1?", "1")) as generator,
        pytest.raises(CommandRefused, match="still on"),
    ):
        generator.off()


def test_a_silent_generator_is_not_taken_for_one_that_is_off():
    with (
        conversation(Keysight33500B, ("*CLS", None), ("OUTP1 OFF", None), ("OUTP1?", SILENCE)) as generator,
        pytest.raises(NoAnswer),
    ):
        generator.off()


def test_an_amplitude_beyond_the_generator_stops_the_preparation_before_it_is_sent():
    lines = accepted("*RST", "OUTP1:LOAD INF", "VOLT:UNIT VPP", "FUNC SIN", "FREQ 30.5", "VOLT:OFFS 0.0")
    with conversation(Keysight33500B, *lines) as generator, pytest.raises(OutOfRange, match=r"0\.002 to 20 Vpp"):
        generator.prepare(waveform="SIN", frequency_hz=30.5, amplitude_vpp=20.5)


def test_what_the_generator_itself_finds_wrong_is_told():
    refused = [("VOLT 10.0", None), ("SYST:ERR?", '-222,"Data out of range;value clipped to upper limit"'), NO_ERROR]
    with conversation(Keysight33500B, *refused) as generator, pytest.raises(CommandRefused, match="clipped"):
        generator.amplitude = 10.0
