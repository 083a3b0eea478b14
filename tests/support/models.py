"""What is asked of the instruments of a kind, whatever the model, and in what it must end."""

import math

import numpy as np
import pytest

from instruments.catalogue import CATALOGUE
from instruments.drivers.oscilloscope import Trace
from support import hostile

#: Every model of the catalogue, and its kind.
ROWS = {model.name: model for models in CATALOGUE.values() for model in models}
KIND_OF = {model.name: kind for kind, models in CATALOGUE.items() for model in models}
#: One model of each table of rows, in the order of the catalogue: the one whose twin is a class, or the first.
_OF_TABLE: dict = {}
for _name in sorted(ROWS, key=lambda name: not isinstance(ROWS[name].twin, type)):
    _OF_TABLE.setdefault(hostile.instrument(_name).commands, _name)
FAMILIES = tuple(name for name in ROWS if name in _OF_TABLE.values())
#: Whose link is a serial line.
SERIAL = tuple(name for name, model in ROWS.items() if model.driver.SERIAL)


def is_settings(value):
    return isinstance(value, dict) and all(isinstance(setting, bool | float | str) for setting in value.values())


def is_number(value):
    return isinstance(value, float) and math.isfinite(value)


def is_reading(value):
    return value is None or is_number(value)


def is_nothing(value):
    return value is None


def is_text(value):
    return isinstance(value, str)


def are_readings(shape):
    return lambda value: value.shape == shape and not np.isinf(value).any()


def is_trace(value):
    numbers = (value.dt_s, value.t0_s, value.volts_per_code, value.offset_v)
    return isinstance(value, Trace) and value.codes.size >= 1 and all(map(math.isfinite, numbers))


def _prepared(driver):
    driver.prepare(channels=[1], duration_s=0.1, points=1000, volts_per_division=0.5, trigger_level_v=0.6)


ANY = {
    "identity": (lambda driver: driver.identity(), is_text),
    "settings": (lambda driver: driver.settings(), is_settings),
    "forget_errors": (lambda driver: driver.forget_errors(), is_nothing),
    "clear": (lambda driver: driver.transport.clear(), is_nothing),
}
COUNTER = ANY | {
    "prepare": (lambda driver: driver.prepare(gate_s=0.5, trigger_level_v=0.6), is_nothing),
    "frequency": (lambda driver: driver.frequency(), is_reading),
    "readings": (lambda driver: driver.readings(3), are_readings((3,))),
}
GENERATOR = ANY | {
    "prepare": (lambda driver: driver.prepare(waveform="TRI", frequency_hz=25.0, amplitude_vpp=2.0), is_nothing),
    "on": (lambda driver: setattr(driver, "output", True), is_nothing),
    "is it on": (lambda driver: driver.output, lambda value: isinstance(value, bool)),
    "off": (lambda driver: driver.off(), is_nothing),
}
SCOPE = ANY | {
    "prepare": (_prepared, is_nothing),
    "acquire": (lambda driver: driver.acquire(timeout_s=0.5), is_nothing),
    "trace": (lambda driver: driver.trace(1), is_trace),
    "blocks": (lambda driver: sum(piece.size for piece in driver.blocks(1)), lambda size: size >= 1),
    "off": (lambda driver: driver.off(), is_nothing),
}
MAGNETOMETER = ANY | {
    "prepare": (lambda driver: driver.prepare(range_t=0.035), is_nothing),
    "prepare, any range": (lambda driver: driver.prepare(range_t=None), is_nothing),
    "flux_density": (lambda driver: driver.flux_density(), is_reading),
    "probe": (lambda driver: driver.probe(), is_text),
    "zero": (lambda driver: driver.zero(), is_nothing),
}
#: What can be called of a driver: name → the call, and whether its value can be one.
CALLS = {"counter": COUNTER, "generator": GENERATOR, "oscilloscope": SCOPE, "magnetometer": MAGNETOMETER}


def calls(name):
    """What can be called of the driver of a model: those of its kind, and those that it alone has."""
    driver = ROWS[name].driver
    own = {
        "gate": (lambda driver: driver.gate, lambda value: isinstance(value, float)),
        "timed_readings": (lambda driver: driver.timed_readings(3), are_readings((3, 2))),
    }
    return CALLS[KIND_OF[name]] | {call: row for call, row in own.items() if hasattr(driver, call)}


# --- a measurement in the room of support/hostile.py: light at 30 Hz from 0 V to 1.2 V, 0.019 T ---


def _count(driver):
    driver.prepare(gate_s=0.5, trigger_level_v=0.6)
    assert driver.frequency() == pytest.approx(30.0, rel=1e-3)
    assert driver.readings(2) == pytest.approx([30.0, 30.0], rel=1e-3)


def _generate(driver):
    driver.prepare(waveform="SIN", frequency_hz=30.0, amplitude_vpp=3.0)
    driver.output = True
    assert (driver.frequency, driver.amplitude, driver.output) == (30.0, 3.0, True)
    driver.off()
    assert driver.output is False


def _record(driver):
    _prepared(driver)
    driver.acquire(timeout_s=1.0)
    volts = driver.trace(1).volts
    assert -0.1 < volts.min() < 0.1
    assert 1.1 < volts.max() < 1.3


def _feel(driver):
    driver.transport.write("ZCLEAR")  # it may have been zeroed in the field
    driver.prepare(range_t=0.035)
    assert driver.flux_density() == pytest.approx(0.019, abs=2e-4)


MEASUREMENTS = {"counter": _count, "generator": _generate, "oscilloscope": _record, "magnetometer": _feel}


def measure(name, driver):
    """A measurement as a program makes it, with a far end that is in order."""
    driver.forget_errors()
    MEASUREMENTS[KIND_OF[name]](driver)
