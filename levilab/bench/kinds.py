"""The kinds of instruments on a bench: what each is for, its models, and over which link a driver speaks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from instruments.catalogue import COUNTERS, GENERATORS, MAGNETOMETERS, OSCILLOSCOPES, Model
from instruments.drivers import Instrument
from instruments.links.opening import open_link
from levilab.bench.config import ConfigError

if TYPE_CHECKING:
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
    """A kind of instrument.  purpose: its use on the bench, as text; models: its rows of the catalogue."""

    name: str
    purpose: str
    models: tuple[Model[I_co], ...]

    def model(self, name: str) -> Model[I_co]:
        """Return the row of a model, in any case of its letters.  Raises ConfigError for a model that has no driver."""
        for model in self.models:
            if model.name.upper() == name.upper():
                return model
        known = ", ".join(model.name for model in self.models)
        raise ConfigError(f"{self.name}.model = {name!r} is unknown, known are {known}")


COUNTER: Kind[Counter] = Kind("counter", "counts the light pulses", COUNTERS)
GENERATOR: Kind[Generator] = Kind("generator", "drives the coil", GENERATORS)
OSCILLOSCOPE: Kind[Oscilloscope] = Kind("oscilloscope", "records the phototransistor", OSCILLOSCOPES)
MAGNETOMETER: Kind[Magnetometer] = Kind("magnetometer", "measures the base's field", MAGNETOMETERS)

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
    """Return an open link to an instrument of the bench; see `open_link`.  Raises NotConnected."""
    line = dict(driver.SERIAL) | settings.line
    return open_link(settings.address, line=line, library=library, timeout=settings.timeout_s, clock=clock, log=log)
