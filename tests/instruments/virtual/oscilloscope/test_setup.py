"""Setups of the virtual oscilloscopes, kept and restored."""

import pytest

from support.scopes import KEYSIGHT_READY, block, configure, keysight, pulses, rigol
from support.wire import ask, errors, send


@pytest.mark.parametrize("make", [rigol, keysight])
def test_a_setup_comes_back(make):
    device = make(pulses, "CHAN1:PROB 1;SCAL 0.2", ":TIM:SCAL 0.02", ":TRIG:EDGE:LEV 0.3")
    _, setup = block(device, ":SYST:SET?")
    configure(device, "*RST")
    assert float(ask(device, "CHAN1:SCAL?")) != 0.2
    configure(device, f":SYST:SET #8{len(setup):08d}" + setup.decode())
    assert [float(ask(device, q)) for q in ("CHAN1:SCAL?", ":TIM:SCAL?", ":TRIG:EDGE:LEV?")] == [0.2, 0.02, 0.3]
    assert block(device, ":SYST:SET?")[1] == setup


@pytest.mark.parametrize(
    "setup", ["#10", "#15hello", "#512", "hello", "#224:SYST:SET #212:SYST:SET #", "#216:CHAN1:SCAL 1e999"]
)
@pytest.mark.parametrize("make", [rigol, keysight])
def test_a_setup_that_is_none_is_an_error(make, setup):
    device = make(pulses)
    send(device, f":SYST:SET {setup}\n".encode())
    assert ask(device, "*IDN?").count(",") == 3
    assert errors(device) != []


def test_measurements_that_were_installed_can_be_cleared():
    device = keysight(pulses, *KEYSIGHT_READY, ":MEAS:VMAX", ":MEAS:VMIN")
    assert len(ask(device, ":MEAS:RES?").split(",")) == 2
    configure(device, ":MEAS:CLE")
    assert ask(device, ":MEAS:RES?") == "NONE"


def test_a_setup_with_a_fine_delayed_sweep_comes_back():
    fine = (":TIM:SCAL 0.001", ":ACQ:MDEP 12000000", ":TIM:DEL:SCAL 2e-8")
    setup = block(rigol(pulses, *fine), ":SYST:SET?")
    other = rigol(pulses, ":TIM:SCAL 0.001", ":ACQ:MDEP 12000")
    send(other, b":SYST:SET " + setup[0] + setup[1] + b"\n")
    assert errors(other) == []
    assert float(ask(other, ":TIM:DEL:SCAL?")) == 2e-8
