"""Which driver speaks to which model, and over which link."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.counter.pendulum_cnt91 import PendulumCNT91
from instruments.drivers.generator.agilent_33220a import Agilent33220A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.magnetometer.lakeshore_475 import LakeShore475
from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.links.serial_port import SerialTransport
from instruments.links.visa import VisaTransport
from levilab.bench.config import ConfigError

if TYPE_CHECKING:
    from instruments.clock import Clock
    from instruments.drivers.scpi import ScpiInstrument
    from instruments.links.transport import TrafficLog, Transport
    from levilab.bench.config import InstrumentSettings

#: Kind → model as one writes it in bench.toml → its driver.
DRIVERS: dict[str, dict[str, type[ScpiInstrument]]] = {
    "counter": {
        "53220A": Keysight53230A,
        "53230A": Keysight53230A,
        "CNT-91": PendulumCNT91,
        "FCA3000": PendulumCNT91,
        "FCA3100": PendulumCNT91,
    },
    "generator": {"33500B": Keysight33500B, "33220A": Agilent33220A},
    "oscilloscope": {"DS1000Z": RigolDS1000Z, "DSOX1000": KeysightDSOX, "DSOX2000": KeysightDSOX},
    "magnetometer": {"425": LakeShore425, "455": LakeShore475, "475": LakeShore475},
}


def driver_of(kind: str, model: str) -> type[ScpiInstrument]:
    """The driver's class.  Raises ConfigError for a model that has none."""
    models = {name.upper(): driver for name, driver in DRIVERS[kind].items()}
    if model.upper() not in models:
        known = ", ".join(DRIVERS[kind])
        raise ConfigError(f"{kind}.model = {model!r} is unknown, known are {known}")
    return models[model.upper()]


def transport_to(
    kind: str,
    settings: InstrumentSettings,
    *,
    library: Any = "@py",
    clock: Clock | None = None,
    log: TrafficLog | None = None,
) -> Transport:
    """An open link: pyserial's where the address is a port or its URL, else PyVISA's.

    clock: by which the pauses between messages are kept, the wall's by default.  Raises NotConnected.
    """
    line = dict(getattr(driver_of(kind, settings.model), "SERIAL", {})) | settings.line
    serial_name = settings.address.upper().startswith("ASRL") and library == "@py"
    if "::" not in settings.address or serial_name:
        return SerialTransport(settings.address, timeout=settings.timeout_s, log=log, **line)
    options: dict[str, Any] = {"pause": line.pop("pause", 0.0), "clock": clock, "log": log}
    return VisaTransport(settings.address, library=library, timeout=settings.timeout_s, line=line, **options)
