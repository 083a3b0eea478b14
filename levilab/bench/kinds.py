"""Which driver speaks to which model, and over which link."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from levilab.bench.config import ConfigError

if TYPE_CHECKING:
    from instruments.drivers.scpi import ScpiInstrument
    from instruments.links.transport import Transport
    from instruments.links.visa import TrafficLog
    from levilab.bench.config import InstrumentSettings

_COUNTERS, _GENERATORS = "instruments.drivers.counter", "instruments.drivers.generator"
_RIGOL, _KEYSIGHT = "instruments.drivers.oscilloscope.rigol_ds1000z", "instruments.drivers.oscilloscope.keysight_dsox"
_MAGNETOMETERS = "instruments.drivers.magnetometer"

#: Kind → model as one writes it in bench.toml → module and class of its driver.
DRIVERS: dict[str, dict[str, tuple[str, str]]] = {
    "counter": {
        "53220A": (_COUNTERS, "Keysight53230A"),
        "53230A": (_COUNTERS, "Keysight53230A"),
        "CNT-91": (_COUNTERS, "PendulumCNT91"),
        "FCA3000": (_COUNTERS, "PendulumCNT91"),
        "FCA3100": (_COUNTERS, "PendulumCNT91"),
    },
    "generator": {
        "33500B": (_GENERATORS, "Keysight33500B"),
        "33220A": (_GENERATORS, "Agilent33220A"),
    },
    "oscilloscope": {
        "DS1000Z": (_RIGOL, "RigolDS1000Z"),
        "DSOX1000": (_KEYSIGHT, "KeysightDSOX"),
        "DSOX2000": (_KEYSIGHT, "KeysightDSOX"),
    },
    "magnetometer": {
        "425": (_MAGNETOMETERS, "LakeShore425"),
        "455": (_MAGNETOMETERS, "LakeShore475"),
        "475": (_MAGNETOMETERS, "LakeShore475"),
    },
}


def driver_of(kind: str, model: str) -> type[ScpiInstrument]:
    """The driver's class.  Raises ConfigError for a model that has none."""
    models = {name.upper(): place for name, place in DRIVERS[kind].items()}
    if model.upper() not in models:
        known = ", ".join(DRIVERS[kind])
        raise ConfigError(f"{kind}.model = {model!r} is unknown, known are {known}")
    module, name = models[model.upper()]
    driver: type[ScpiInstrument] = getattr(import_module(module), name)
    return driver


def transport_to(
    kind: str, settings: InstrumentSettings, *, library: Any = "@py", log: TrafficLog | None = None
) -> Transport:
    """An open link: pyserial's where the address is a port or its URL, else PyVISA's.  Raises NotConnected."""
    from instruments.links.serial_port import SerialTransport
    from instruments.links.visa import VisaTransport

    line = dict(getattr(driver_of(kind, settings.model), "SERIAL", {})) | settings.line
    serial_name = settings.address.upper().startswith("ASRL") and library == "@py"
    if "::" not in settings.address or serial_name:
        return SerialTransport(settings.address, timeout=settings.timeout_s, log=log, **line)
    return VisaTransport(settings.address, library=library, timeout=settings.timeout_s, line=line, log=log)
