"""The virtual bench for programs that are not ours."""

import pytest
import serial

from instruments.virtual.bench import serial_line
from levilab.bench.config import ConfigError
from levilab.world.bench import MODELS, VIRTUAL, plug_in_serial, virtual_bus

LINE = {"baudrate": 57600, "bytesize": 7, "parity": "O", "timeout": 1.0}


@pytest.fixture
def pyserial(monkeypatch):
    """pyserial, put back afterwards."""
    monkeypatch.setattr(serial, "protocol_handler_packages", ["serial.urlhandler"])
    monkeypatch.setattr(serial_line, "benches", serial_line.benches)
    monkeypatch.delitem(serial_line.benches, "", raising=False)
    yield serial
    serial_line.benches.pop("", None)


def who_is_at(url):
    with serial.serial_for_url(url, **LINE) as port:
        port.write(b"*IDN?\n")
        return port.readline()


def test_pyserial_finds_the_magnetometer_of_a_fresh_bench(pyserial):
    with pytest.raises(ValueError, match="not known"):
        serial.serial_for_url("levilab://magnetometer")
    bus = plug_in_serial()
    assert set(bus.instruments) == {settings.address for settings in VIRTUAL.values()}
    assert who_is_at("levilab://magnetometer") == b"LSCI,MODEL425,VIRTUAL,1.0\r\n"


def test_the_bench_given_is_the_one_that_pyserial_finds_however_often_it_is_plugged_in(pyserial):
    plug_in_serial()
    bus = virtual_bus()
    assert plug_in_serial(bus) is bus
    assert pyserial.protocol_handler_packages.count("instruments.virtual.bench") == 1
    before = bus.instruments[VIRTUAL["magnetometer"].address].clock.now()
    who_is_at("levilab://magnetometer")
    assert bus.instruments[VIRTUAL["magnetometer"].address].clock.now() > before


@pytest.mark.parametrize(("kind", "model"), [(kind, model) for kind, models in MODELS.items() for model in models])
def test_every_model_can_be_chosen_in_any_case(kind, model):
    bus = virtual_bus(models={kind: model.lower()})
    assert model.rstrip("ABZ0-")[:3] in bus.instruments[VIRTUAL[kind].address].identity


def test_what_there_is_not_is_told_with_what_there_is():
    with pytest.raises(ConfigError, match="no virtual counter 'DVM': known are 53230A, CNT-91"):
        virtual_bus(models={"counter": "DVM"})
    with pytest.raises(ConfigError, match="no virtual 'piano': known are counter"):
        virtual_bus(models={"piano": "1"})
