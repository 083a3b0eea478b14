"""PyMeasure's classes for the two generators, unmodified, on the virtual ones, by each way.

Most properties of the 33500 and of its channels are tried by PyMeasure's own suite: run_pymeasure_suite.py.
"""

import pytest

pytest.importorskip("pymeasure")

from pymeasure.instruments.agilent import Agilent33220A, Agilent33500

from instruments.clock import VirtualClock
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.keysight_33500b import Virtual33500B

#: PyMeasure's class and the instrument that it is for.
NEWER, OLDER = (Agilent33500, Virtual33500B), (Agilent33220A, Virtual33220A)
BOTH = pytest.mark.parametrize("family", [NEWER, OLDER], ids=["33500", "33220A"])


@pytest.fixture
def family():
    return NEWER


@pytest.fixture
def heard():
    """What the instrument has put out, change by change."""
    return []


@pytest.fixture
def plugged(opened, family, heard):
    """The driver and the instrument that it speaks to."""
    driver, device = family[0], family[1](VirtualClock(), listener=lambda _, output: heard.append(output.amplitude))
    there = opened(driver, device)
    yield there, device
    assert there.ask("SYST:ERR?").strip() == '+0,"No error"'


@pytest.fixture
def newer(plugged):
    return plugged


def settled(driver):
    """What was sent has been worked on: a server does so after the program has gone on."""
    assert driver.ask("*IDN?")


#: Those that its suite does not try.
OF_THE_NEWER = [
    ("arb_advance", ["TRIG", "SRAT"]),
    ("arb_filter", ["NORM", "OFF", "STEP"]),
    ("trigger_source", ["EXT", "BUS", "IMM"]),
    ("ext_trig_out", [True, False]),
]
OF_THE_OLDER = [
    ("shape", ["SQU", "RAMP", "PULS", "NOIS", "DC", "USER", "SIN"]),
    ("frequency", [25.0, 20e6]),
    ("amplitude", [10.0, 0.01]),
    ("amplitude_unit", ["VRMS", "DBM", "VPP"]),
    ("offset", [1.25, -4.9]),
    ("voltage_high", [5.0, 0.5]),
    ("voltage_low", [-5.0, -0.5]),
    ("square_dutycycle", [20.0, 80.0]),
    ("ramp_symmetry", [0.0, 30.0]),
    ("pulse_period", [2000.0, 0.02]),
    ("pulse_hold", ["DCYC", "WIDT"]),
    ("pulse_width", [5e-4, 1e-4]),
    ("pulse_dutycycle", [20.0, 60.0]),
    ("pulse_transition", [100e-9, 5e-9]),
    ("output", [True, False]),
    ("burst_state", [True, False]),
    ("burst_mode", ["GAT", "TRIG"]),
    ("burst_ncycles", [50000, 3]),
    ("trigger_source", ["EXT", "BUS", "IMM"]),
    ("trigger_state", [True, False]),
    ("beeper_state", [False, True]),
]


def exercise(driver, name, values):
    """Set and read back; what stood at first can be read too."""
    getattr(driver, name)
    for value in values:
        setattr(driver, name, value)
        assert getattr(driver, name) == (value if isinstance(value, str | bool) else pytest.approx(value, rel=1e-12))


@pytest.mark.parametrize(("name", "values"), OF_THE_NEWER, ids=lambda value: value if isinstance(value, str) else "")
def test_a_property_of_the_33500(newer, name, values):
    exercise(newer[0], name, values)


@pytest.mark.parametrize("family", [OLDER], ids=["33220A"])
@pytest.mark.parametrize(("name", "values"), OF_THE_OLDER, ids=lambda value: value if isinstance(value, str) else "")
def test_a_property_of_the_33220a(plugged, name, values):
    exercise(plugged[0], name, values)


def test_every_property_of_the_33220a_is_exercised():
    own = {name for name, value in vars(Agilent33220A).items() if isinstance(value, property)}
    assert own - {"remote_local_state"} == {name for name, _ in OF_THE_OLDER}  # which is set only


def test_a_load_that_is_infinite(newer):
    driver, device = newer
    driver.amplitude = 10
    driver.output_load = "INF"
    assert (driver.output_load, driver.amplitude) == (9.9e37, 20)
    driver.output = "on"
    settled(driver)
    assert device.signal().amplitude == 10


@pytest.mark.parametrize(("form", "scale"), [("DAC", 32767), ("float", 1.0)])
def test_a_waveform_is_sent_selected_and_put_out(newer, form, scale):
    driver, device = newer
    for target, channel in ((driver, 1), (driver.ch_2, 2)):
        target.data_arb("test", [scale, 0, -scale, 0, scale, 0, -scale, 0], data_format=form)
        target.arb_file = "test"
        target.shape = "ARB"
        assert target.arb_file == '"TEST"'
        assert list(device.signal(channel).samples) == [1, 0, -1, 0, 1, 0, -1, 0]
        target.data_volatile_clear()
        assert target.arb_file == '"INT:\\BUILTIN\\EXP_RISE.ARB"'


@BOTH
def test_a_burst_is_triggered_and_waited_for(plugged, heard):
    driver, device = plugged
    driver.frequency, driver.burst_ncycles, driver.trigger_source = 100, 50, "BUS"
    driver.burst_state = driver.output = True
    settled(driver)
    heard.clear()
    driver.trigger()
    driver.wait_for_trigger()
    assert heard[0] > 0
    assert device.clock.now() > 0.5
    assert device.signal().amplitude == 0


@BOTH
def test_it_beeps(plugged):
    plugged[0].beep()


def test_a_text_is_displayed(newer):
    driver, device = newer
    driver.display = "coil on"
    settled(driver)
    assert device.text() == '"coil on"'
    driver.clear_display()
    driver.phase_sync()
    settled(driver)
    assert device.text() == '""'


@pytest.mark.parametrize("family", [OLDER], ids=["33220A"])
def test_the_front_panel_is_locked_and_freed(plugged):
    for state in ("RWLOCK", "REM", "LOC"):
        plugged[0].remote_local_state = state
