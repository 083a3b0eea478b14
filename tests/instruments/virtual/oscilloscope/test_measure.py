"""What the virtual oscilloscopes measure in a trace, and what they round."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from instruments.virtual.oscilloscope.measure import MEASUREMENTS, Measured, measure
from instruments.virtual.oscilloscope.scope import one_two_five


@given(
    volts=st.lists(st.integers(-4, 4).map(float), min_size=1, max_size=50), name=st.sampled_from(sorted(MEASUREMENTS))
)
def test_every_trace_is_measured_or_not(volts, name):
    value = measure(name, Measured(np.array(volts), 1e-3, 0.0))
    assert value is None or math.isfinite(value)


@given(value=st.floats(1e-9, 1e9))
def test_the_series_of_scales_goes_up_and_has_only_1_2_and_5(value):
    up, near = one_two_five(value, up=True), one_two_five(value)
    assert value * (1 - 1e-8) <= up <= 2.5000001 * value
    assert near in {up, one_two_five(up / 2.4999, up=True), one_two_five(up / 2.0001, up=True)} or near < up
    assert f"{up:.0e}"[0] in "125"
