"""The kinds of instruments on a bench: what each is for, which driver speaks to which model, and over which link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from instruments.drivers import Instrument
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
    from collections.abc import Mapping

    from instruments.clock import Clock
    from instruments.drivers.counter import Counter
    from instruments.drivers.generator import Generator
    from instruments.drivers.magnetometer import Magnetometer
    from instruments.drivers.oscilloscope import Oscilloscope
    from instruments.links.transport import TrafficLog, Transport
    from levilab.bench.config import InstrumentSettings

I_co = TypeVar("I_co", bound=Instrument, covariant=True)


@dataclass(frozen=True)
class Kind(Generic[I_co]):
    """A kind of instrument.

    purpose: what it does on the bench, in words; example: an address as one of it may have; drivers: model as one
    writes it in bench.toml → driver.
    """

    name: str
    purpose: str
    example: str
    drivers: Mapping[str, type[I_co]]

    def driver(self, model: str) -> type[I_co]:
        """The driver of a model, in any case of its letters.  Raises ConfigError for a model that has none."""
        for name, driver in self.drivers.items():
            if name.upper() == model.upper():
                return driver
        raise ConfigError(f"{self.name}.model = {model!r} is unknown, known are {', '.join(self.drivers)}")


COUNTER: Kind[Counter] = Kind(
    "counter",
    "counts the light pulses",
    "TCPIP0::192.168.1.20::5025::SOCKET",
    {
        "53220A": Keysight53230A,
        "53230A": Keysight53230A,
        "CNT-91": PendulumCNT91,
        "FCA3000": PendulumCNT91,
        "FCA3100": PendulumCNT91,
    },
)
GENERATOR: Kind[Generator] = Kind(
    "generator",
    "drives the coil",
    "USB0::0x0957::0x2807::MY52400001::INSTR",
    {"33500B": Keysight33500B, "33220A": Agilent33220A},
)
OSCILLOSCOPE: Kind[Oscilloscope] = Kind(
    "oscilloscope",
    "records the phototransistor",
    "TCPIP0::192.168.1.22::INSTR",
    {"DS1000Z": RigolDS1000Z, "DSOX1000": KeysightDSOX, "DSOX2000": KeysightDSOX},
)
MAGNETOMETER: Kind[Magnetometer] = Kind(
    "magnetometer",
    "measures the base's field",
    "COM3",
    {"425": LakeShore425, "455": LakeShore475, "475": LakeShore475},
)

#: Name → kind.
KINDS: dict[str, Kind[Instrument]] = {kind.name: kind for kind in (COUNTER, GENERATOR, OSCILLOSCOPE, MAGNETOMETER)}


def transport_to(
    driver: type[Instrument],
    settings: InstrumentSettings,
    *,
    library: Any = "@py",
    clock: Clock | None = None,
    log: TrafficLog | None = None,
) -> Transport:
    """An open link: pyserial's where the address is a port or its URL, else PyVISA's.

    clock: by which the pauses between messages are kept, the wall's by default.  Raises NotConnected.
    """
    line = dict(driver.SERIAL) | settings.line
    serial_name = settings.address.upper().startswith("ASRL") and library == "@py"
    if "::" not in settings.address or serial_name:
        return SerialTransport(settings.address, timeout=settings.timeout_s, log=log, **line)
    options: dict[str, Any] = {"pause": line.pop("pause", 0.0), "clock": clock, "log": log}
    return VisaTransport(settings.address, library=library, timeout=settings.timeout_s, line=line, **options)
