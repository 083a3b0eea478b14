"""Volts and codes of the virtual oscilloscopes."""

import numpy as np
import pytest

from support.scopes import block, constant, keysight, ramp, rigol, rigol_stopped, rigol_volts
from support.wire import ask


@pytest.mark.parametrize("offset", [-0.6, 0.0, 0.123])
@pytest.mark.parametrize("scale", [0.05, 0.2, 1.0])
def test_volts_are_right_to_half_a_code(scale, offset):
    device = rigol_stopped(ramp, f"CHAN1:SCAL {scale};OFFS {offset}", f":TRIG:EDGE:LEV {-offset}", ":TIM:SCAL 0.01")
    times, volts = rigol_volts(device)
    true = ramp(device.record().trigger + times[0], times[1] - times[0], times.size)
    low, high = (0 - 127) * scale / 25 - offset, (255 - 127) * scale / 25 - offset
    inside = (true > low + scale / 25) & (true < high - scale / 25)
    # the offset is set to whole codes; 1e-6: the six digits of the preamble
    assert np.abs(volts - true)[inside].max() <= 0.5 * scale / 25 + 1e-5
    assert volts.min() >= low - scale / 25
    assert volts.max() <= high + scale / 25


@pytest.mark.parametrize(("volts", "code"), [(-100.0, 0), (100.0, 255), (0.0, 127), (0.2, 152), (0.004001, 128)])
def test_codes_are_25_to_a_division_and_clipped(volts, code):
    device = rigol(constant(volts), "CHAN1:PROB 1;SCAL 0.2;OFFS 0")
    assert set(block(device, ":WAV:DATA?")[1]) == {code}


@pytest.mark.parametrize(("volts", "code"), [(-100.0, 1), (100.0, 255), (0.0, 128), (0.2, 128 + 25)])
def test_codes_of_the_keysight_are_199_to_the_screen_and_never_0(volts, code):
    device = keysight(constant(volts), "CHAN1:PROB 1;RANG 1.6;OFFS 0")
    assert set(block(device, ":WAV:DATA?")[1]) == {code}


@pytest.mark.parametrize("make", [rigol, keysight])
def test_a_probe_makes_the_same_volts_at_the_input_ten_times_as_many(make):
    device = make(constant(0.2), "CHAN1:PROB 1", "CHAN1:SCAL 0.2", "CHAN1:PROB 10")
    assert float(ask(device, "CHAN1:SCAL?")) == pytest.approx(2.0)
    assert float(ask(device, ":MEAS:VMAX? CHAN1")) == pytest.approx(2.0, abs=0.05)


def test_the_state_after_power_on_takes_a_probe_for_granted():
    assert float(ask(rigol(), "CHAN1:PROB?")) == 10.0
    assert float(ask(keysight(), "CHAN1:PROB?")) == 10.0
