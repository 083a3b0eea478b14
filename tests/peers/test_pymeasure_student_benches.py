"""PyMeasure's classes for a 34401A, a DG800 and a TDS2000, unmodified, on the virtual ones, by each of the ways."""

import pytest

pytest.importorskip("pymeasure")

from pymeasure.instruments.hp import HP34401A
from pymeasure.instruments.rigol import DG800
from pymeasure.instruments.tektronix.tds2000 import TDS2000

from instruments.clock import VirtualClock
from instruments.virtual.counter.keysight_34461a import Virtual34461A
from instruments.virtual.generator.rigol_dg1000z import DG832, VirtualDG1000Z
from instruments.virtual.oscilloscope.tektronix_tds2000 import VirtualTDS2000
from support.scopes import pulses

# --- the multimeter: what its suite for a real one tries of frequency and period ---


@pytest.fixture
def meter(opened):
    there = opened(
        HP34401A,
        Virtual34461A(
            VirtualClock(), signal=pulses, lacks=("LOWer", "ABORt"), identity="HEWLETT-PACKARD,34401A,VIRTUAL,11-5-2"
        ),
    )
    there.adapter.connection.timeout = 10_000  # a reading takes a second, and one more to settle
    yield there
    assert there.check_errors() == []


@pytest.mark.parametrize("function", ["FREQ", "PERIOD"])
def test_a_function_of_the_meter_has_its_range_and_its_gate(meter, function):
    meter.function_ = function
    assert meter.function_ == function
    assert meter.autorange is True
    for wide in (0.1, 1, 10):
        meter.range_ = wide
        assert (meter.range_, meter.autorange) == (wide, False)
    meter.autorange = True
    assert meter.autorange is True
    for gate in (0.01, 0.1, 1):
        meter.gate_time = gate
        assert meter.gate_time == gate
    for slowest in (20, 200, 3):
        meter.detector_bandwidth = slowest
        assert meter.detector_bandwidth == slowest
    wanted = {"FREQ": 25.0, "PERIOD": 0.04}[function]
    assert meter.reading == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("trigger_source", ["BUS", "EXT", "IMM"]),
        ("trigger_delay", [0.5, 0]),
        ("trigger_auto_delay_enabled", [False, True]),
        ("sample_count", [5, 1]),
        ("trigger_count", [5, 1]),
        ("display_enabled", [False, True]),
        ("beeper_enabled", [False, True]),
        ("displayed_text", ["COIL ON"]),
    ],
)
def test_a_property_of_the_meter(meter, name, values):
    for value in values:
        setattr(meter, name, value)
        assert getattr(meter, name) == value


def test_the_meter_takes_several_readings_keeps_them_and_beeps(meter):
    meter.function_ = "FREQ"
    meter.detector_bandwidth, meter.range_, meter.gate_time, meter.sample_count = 3, 1, 0.1, 3
    assert meter.reading == pytest.approx([25.0] * 3, rel=1e-4)
    assert meter.stored_reading == pytest.approx([25.0] * 3, rel=1e-4)
    assert meter.stored_readings_count == 3
    meter.beep()
    assert (meter.terminals_used, meter.self_test_result) == ("FRONT", 0)
    assert "34401A" in meter.id


# --- the generator ---


@pytest.fixture
def rigol(opened):
    device = VirtualDG1000Z(VirtualClock(), family=DG832, identity="Rigol Technologies,DG832,VIRTUAL,00.02.06")
    there = opened(DG800, device)
    yield there, device
    assert there.ask(":SYST:ERR?").strip() == '0,"No error"'


@pytest.mark.parametrize("number", [1, 2])
def test_every_property_of_a_channel_of_the_rigol(rigol, number):
    channel = (rigol[0].channel_1, rigol[0].channel_2)[number - 1]
    for name, values in {
        "output_enabled": (True, False),
        "sync_enabled": (False, True),
        "load": (50.0, 1000.0),
        "frequency": (25.0, 1e6),
    }.items():
        for value in values:
            setattr(channel, name, value)
            assert getattr(channel, name) == value
    channel.high_impedance = True
    assert channel.load == 9.9e37


def test_each_waveform_of_the_rigol_is_put_out(rigol):
    driver, device = rigol
    channel = driver.channel_1
    channel.output_enabled = True
    for name, short in (("sine", "SIN"), ("square", "SQU"), ("triangle", "RAMP"), ("pulse", "PULS")):
        setattr(channel, name, (30.5, 4.0, -1.0, 0.0))
        assert channel.shape == short
        put_out = device.signal()
        assert (put_out.waveform, put_out.frequency, put_out.amplitude, put_out.offset) == (short, 30.5, 2.0, -1.0)
    channel.duty_cycle = 20.0
    assert channel.duty_cycle == pytest.approx(20.0)
    channel.pulse_width = 1e-3
    assert channel.pulse_width == pytest.approx(1e-3)
    channel.noise = (2.0, 0.0)
    assert channel.waveform[0].strip('"') == "NOISE"
    channel.dc = 1.0
    assert channel.waveform[-1] == '1.000000E+00"'
    assert device.signal().offset == 1.0


# --- the oscilloscope: it asks for values, which stand alone once the headers are off ---


@pytest.fixture
def scope(opened):
    there = opened(TDS2000, VirtualTDS2000(VirtualClock(), signals={1: pulses, 2: pulses}))
    for message in (
        "HEAD OFF",
        "VERB OFF",
        "CH1:PRO 1",
        "CH1:SCA 0.2",
        "CH1:POS -3",
        "HOR:MAI:SCA 0.025",
        "TRIG:MAI:LEV 0.6",
    ):
        there.write(message)
    return there


@pytest.mark.parametrize(
    ("kind", "unit", "value", "within"),
    [
        ("FREQ", "Hz", 25.0, 0.1),
        ("PERI", "s", 0.04, 1e-4),
        ("MEAN", "V", 0.135, 0.02),
        ("PK2", "V", 1.1, 0.02),
        ("MINI", "V", 0.1, 0.01),
        ("MAXI", "V", 1.2, 0.01),
        ("PWI", "s", 1.2e-3, 2e-4),
    ],
)
def test_a_measurement_of_the_scope(scope, kind, unit, value, within):
    scope.measurement.source = "CH1"
    scope.measurement.type = kind
    assert (scope.measurement.source, scope.measurement.type) == ("CH1", kind)
    assert scope.measurement.unit.strip('"') == unit
    assert scope.measurement.value[0] == pytest.approx(value, abs=within)
