"""The models of the catalogue, and a measurement with each kind of instrument."""

import pytest

from instruments.catalogue import CATALOGUE
from support import hostile

#: Every model of the catalogue that takes messages over PyVISA or pyserial, and its kind.
ROWS = {model.name: model for models in CATALOGUE.values() for model in models if not model.scheme}
KIND_OF = {model.name: kind for kind, models in CATALOGUE.items() for model in models}
#: One model of each table of rows, in the order of the catalogue: the one whose twin is a class, or the first.
_OF_TABLE: dict = {}
for _name in sorted(ROWS, key=lambda name: not isinstance(ROWS[name].twin, type)):
    _OF_TABLE.setdefault(hostile.instrument(_name).commands, _name)
FAMILIES = tuple(name for name in ROWS if name in _OF_TABLE.values())
#: Whose link is a serial line.
SERIAL = tuple(name for name, model in ROWS.items() if model.driver.SERIAL)


def _prepare_scope(driver):
    driver.prepare(channels=[1], duration_s=0.1, points=1000, volts_per_division=0.5, trigger_level_v=0.6)


#: Kind → how its drivers are prepared.
PREPARE = {
    "counter": lambda driver: driver.prepare(gate_s=0.5, trigger_level_v=0.6),
    "generator": lambda driver: driver.prepare(waveform="TRI", frequency_hz=25.0, amplitude_vpp=2.0, offset_v=0.5),
    "oscilloscope": _prepare_scope,
    "magnetometer": lambda driver: driver.prepare(range_t=0.035),
}


# --- a measurement in the room of support/hostile.py: light at 30 Hz from 0 V to 1.2 V, 0.019 T ---


def _count(driver):
    PREPARE["counter"](driver)
    assert driver.frequency() == pytest.approx(30.0, rel=1e-3)
    assert driver.readings(2) == pytest.approx([30.0, 30.0], rel=1e-3)


def _generate(driver):
    driver.prepare(waveform="SIN", frequency_hz=30.0, amplitude_vpp=3.0)
    driver.output = True
    assert (driver.frequency, driver.amplitude, driver.output) == (30.0, 3.0, True)
    driver.off()
    assert driver.output is False


def _record(driver):
    _prepare_scope(driver)
    driver.acquire(timeout_s=1.0)
    volts = driver.trace(1).volts
    assert -0.1 < volts.min() < 0.1
    assert 1.1 < volts.max() < 1.3


def _feel(driver):
    driver.transport.write("ZCLEAR")  # it may have been zeroed in the field
    PREPARE["magnetometer"](driver)
    assert driver.flux_density() == pytest.approx(0.019, abs=2e-4)


MEASUREMENTS = {"counter": _count, "generator": _generate, "oscilloscope": _record, "magnetometer": _feel}


def measure(name, driver):
    """A measurement as a program makes it, with a far end that is in order."""
    driver.forget_errors()
    driver.identity()
    MEASUREMENTS[KIND_OF[name]](driver)
