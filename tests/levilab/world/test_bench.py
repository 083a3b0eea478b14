"""The virtual bench for programs that are not ours."""

import numpy as np
import pytest
import pyvisa
import serial

from instruments.catalogue import COUNTERS
from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.counter.pendulum_cnt91 import PendulumCNT91
from instruments.links.opening import open_link
from instruments.virtual.bench.protocol_levilab import plug_in
from instruments.virtual.bench.visa_library import library_for
from levilab.bench.config import ConfigError
from levilab.world.bench import VIRTUAL, practice_world, virtual_bus

LINE = {"baudrate": 57600, "bytesize": 7, "parity": "O", "timeout": 1.0}


@pytest.fixture
def pyserial(monkeypatch):
    """pyserial, put back afterwards."""
    monkeypatch.setattr(serial, "protocol_handler_packages", ["serial.urlhandler"])
    return serial


def who_is_at(url):
    with serial.serial_for_url(url, **LINE) as port:
        port.write(b"*IDN?\n")
        return port.readline()


def test_pyserial_finds_the_magnetometer_of_a_fresh_bench(pyserial):
    with pytest.raises(ValueError, match="not known"):
        serial.serial_for_url("levilab://magnetometer")
    bus = virtual_bus()
    plug_in(bus)
    assert set(bus.instruments) == {settings.address for settings in VIRTUAL.values()}
    assert who_is_at("levilab://magnetometer") == b"LSCI,MODEL425,VIRTUAL,1.0\r\n"


def test_the_bench_given_is_the_one_that_pyserial_finds_however_often_it_is_plugged_in(pyserial):
    plug_in(virtual_bus())
    bus = virtual_bus()
    plug_in(bus)
    assert pyserial.protocol_handler_packages.count("instruments.virtual.bench") == 1
    before = bus.instruments[VIRTUAL["magnetometer"].address].clock.now()
    who_is_at("levilab://magnetometer")
    assert bus.instruments[VIRTUAL["magnetometer"].address].clock.now() > before


def test_the_error_of_an_unknown_model_lists_the_known_ones():
    with pytest.raises(ConfigError, match="no virtual counter 'DVM'") as unknown:
        virtual_bus(models={"counter": "DVM"})
    assert all(model.name in str(unknown.value) for model in COUNTERS)
    with pytest.raises(ConfigError, match="no virtual 'piano': known are counter"):
        virtual_bus(models={"piano": "1"})


@pytest.mark.parametrize("counter", ["53230A", "CNT-91"])
def test_the_laser_is_at_the_counters_second_input_and_channel_three(counter):
    world = practice_world()
    pulses = lambda start, step, n: 0.65 + 0.5 * np.sin(2 * np.pi * 33.0 * (start + step * np.arange(n)))  # noqa: E731
    world.laser = pulses
    library = library_for(virtual_bus(world, models={"counter": counter}))
    bench = pyvisa.ResourceManager(library)
    driver = PendulumCNT91 if counter == "CNT-91" else Keysight53230A
    device = driver(open_link(VIRTUAL["counter"].address, library=library))
    device.prepare(gate_s=0.5, trigger_level_v=0.6, channel=2)
    assert device.frequency() == pytest.approx(33.0, abs=1e-3)
    scope = bench.open_resource(VIRTUAL["oscilloscope"].address)
    scope.write(":CHAN3:DISP ON;:CHAN3:SCAL 0.5;:TIM:SCAL 0.02;:TRIG:EDG:SOUR CHAN3;:TRIG:EDG:LEV 0.6")
    assert float(scope.query(":MEAS:ITEM? FREQ,CHAN3")) == pytest.approx(33.0, rel=0.02)
    bench.close()
