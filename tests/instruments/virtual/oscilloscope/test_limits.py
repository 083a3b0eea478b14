"""What the virtual oscilloscopes refuse, and what they round."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.virtual.oscilloscope.scope import one_two_five
from support.scopes import keysight, pulses, rigol
from support.wire import ask, errors, received, send


@pytest.mark.parametrize(
    "message",
    [
        ":TIM:SCAL 100",
        "CHAN1:PROB 1;SCAL 20",
        "CHAN5:SCAL 1",
        ":TRIG:EDGE:LEV 1e6",
        ":TRIG:EDGE:SOUR CHAN9",
        ":ACQ:MDEP 13000",
        ":WAV:FORM FLOAT",
        ":MEAS:ITEM? NOTHING,CHAN1",
        ":MEAS:ITEM? VPP,CHAN9",
        ":MEAS:ITEM?",
        ":DISP:DATA? ON,OFF,PNG,1",
    ],
)
def test_what_is_wrong_has_no_answer_but_an_entry_in_the_queue(message):
    device = rigol(pulses)
    send(device, message.encode() + b"\n")
    assert received(device, 1.0) is None
    assert len(errors(device)) == 1


def test_the_limits_of_a_full_scale_and_of_the_memory_can_be_asked_for():
    device = rigol(pulses)
    # 80 V at the input, ten times as much at the tip of the probe after a reset
    assert ask(device, ":CHAN1:PROB 10;RANG? MAX;:CHAN1:SCAL? MAX") == "8.000000e+02;1.000000e+02"
    assert ask(device, ":ACQ:MDEP? MAX;MDEP? MIN") == "24000000;12000"
    assert ask(keysight(pulses), ":TIM:RANG? MAX") == "+5.000000E+02"


@given(value=st.floats(1e-9, 1e9))
def test_the_series_of_scales_goes_up_and_has_only_1_2_and_5(value):
    up, near = one_two_five(value, up=True), one_two_five(value)
    assert value * (1 - 1e-8) <= up <= 2.5000001 * value
    assert near in {up, one_two_five(up / 2.4999, up=True), one_two_five(up / 2.0001, up=True)} or near < up
    assert f"{up:.0e}"[0] in "125"
