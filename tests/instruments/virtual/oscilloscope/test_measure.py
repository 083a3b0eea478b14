"""What the virtual oscilloscopes measure in a trace."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.virtual.oscilloscope.measure import MEASUREMENTS, Measured, measure
from support.scopes import KEYSIGHT_READY, constant, keysight, pulses, rigol, sine
from support.wire import ask


@pytest.mark.parametrize(
    ("item", "expected", "within"),
    [
        ("FREQuency", 1000.0, 1.0),
        ("PERiod", 1e-3, 1e-6),
        ("VPP", 2.0, 0.02),
        ("VMAX", 1.0, 0.01),
        ("VMIN", -1.0, 0.01),
        ("VAVG", 0.0, 0.01),
        ("VRMS", math.sqrt(0.5), 0.01),
        ("PDUTy", 0.5, 0.005),
        ("PWIDth", 5e-4, 5e-6),
        # from 10 % to 90 % of a sine: 2·asin(0.8)/2π of a period; top and base lie a little inside the extremes
        ("RTIMe", 2 * math.asin(0.8) / (2 * math.pi) * 1e-3, 1.5e-5),
    ],
)
def test_what_the_rigol_measures_in_a_sine(item, expected, within):
    device = rigol(sine, "CHAN1:PROB 1;SCAL 0.3;OFFS 0", ":TIM:SCAL 0.0005", ":TRIG:EDGE:LEV 0")
    assert float(ask(device, f":MEAS:ITEM? {item},CHAN1")) == pytest.approx(expected, abs=within)
    assert float(ask(device, f":MEAS:STAT:ITEM? CURR,{item},CHAN1")) == pytest.approx(expected, abs=within)


@pytest.mark.parametrize(
    ("item", "expected", "within"),
    [("FREQ", 25.0, 0.01), ("PER", 0.04, 1e-5), ("VPP", 1.1, 0.016), ("PWID", 0.03 / 25, 2e-5), ("DUTY", 3.0, 0.1)],
)
def test_what_the_keysight_measures_in_pulses_of_25_hz(item, expected, within):
    device = keysight(pulses, *KEYSIGHT_READY)
    assert float(ask(device, f":MEAS:{item}? CHAN1")) == pytest.approx(expected, abs=within)
    assert float(ask(device, f":MEAS:SOUR CHAN1;:MEAS:{item}?")) == pytest.approx(expected, abs=within)


@pytest.mark.parametrize(("make", "question"), [(rigol, ":MEAS:ITEM? FREQ,CHAN1"), (keysight, ":MEAS:FREQ? CHAN1")])
def test_what_a_trace_does_not_show_is_answered_as_99e36(make, question):
    assert float(ask(make(constant(0.0)), question)) == 9.9e37


@given(
    volts=st.lists(st.integers(-4, 4).map(float), min_size=1, max_size=50), name=st.sampled_from(sorted(MEASUREMENTS))
)
def test_every_trace_is_measured_or_not(volts, name):
    value = measure(name, Measured(np.array(volts), 1e-3, 0.0))
    assert value is None or math.isfinite(value)
