"""Steady, alternating and peak readings of the virtual gaussmeters."""

import math

import pytest

from instruments.virtual.magnetometer.lakeshore_425 import Virtual425
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.gaussmeters import EACH, meter, value
from support.wire import ask


def alternating(amplitude, frequency, offset=0.0):
    return lambda time: offset + amplitude * math.sin(2 * math.pi * frequency * time)


@EACH
def test_an_alternating_field_is_read_as_its_rms_without_the_steady_part(kind):
    device = meter(kind, alternating(2e-3, 50.0, offset=0.01))
    mode = {Virtual425: "2,1,1", Virtual475: "2,2,1,1,1"}[kind]
    ask(device, f"UNIT 2;RDGMODE {mode};RDGMODE?")
    device.clock.sleep(1.0)
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(2e-3 / math.sqrt(2), rel=3e-3)


@EACH
def test_a_steady_reading_is_a_mean_over_the_filter(kind):
    device = meter(kind, alternating(2e-3, 50.0, offset=0.01))
    device.clock.sleep(2.0)
    assert value(ask(device, "UNIT 2;RDGFIELD?")) == pytest.approx(0.01, rel=2e-2)


def test_the_475_reads_peaks_and_frequency():
    device = meter(Virtual475, alternating(2e-3, 47.0, offset=1e-3))
    ask(device, "UNIT 2;RDGMODE 3,2,1,1,1;RDGMODE?")
    device.clock.sleep(1.0)
    negative, positive = map(float, ask(device, "RDGPEAK?").split(","))
    assert (negative, positive) == (pytest.approx(-1e-3, abs=1e-5), pytest.approx(3e-3, abs=1e-5))
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(3e-3, abs=1e-5)
    assert value(ask(device, "RDGFRQ?")) == pytest.approx(47.0, rel=1e-2)
    ask(device, "RDGMODE 3,2,1,1,2;RDGMODE?")
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(-1e-3, abs=1e-5)


def test_a_mode_set_in_part_keeps_the_rest():
    # so does a driver of fsc2 with the 455
    assert ask(meter(Virtual475), "RDGMODE 2, 3;RDGMODE?") == "2,3,1,1,1"


def test_the_475_keeps_its_control_and_the_compensations_of_its_probe():
    device = meter(Virtual475)
    assert ask(device, "PRBFCOMP?;PRBTCOMP?") == "1;1"  # both on, as the maker delivers it
    assert [float(part) for part in ask(device, "CPARAM 0.25,0.5,100,3;CPARAM?").split(",")] == [0.25, 0.5, 100, 3]
    assert float(ask(device, "PRBSENS?")) == 1.0
    assert float(ask(meter(Virtual475, probe=None), "PRBSENS?")) == 0.0
