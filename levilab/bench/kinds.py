"""The kinds of instruments on a bench: what each is for, its models, and over which link a driver speaks."""

import re
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from instruments.catalogue import COUNTERS, GENERATORS, MAGNETOMETERS, OSCILLOSCOPES, Model
from instruments.clock import Clock
from instruments.drivers import Instrument
from instruments.drivers.counter import Counter
from instruments.drivers.generator import Generator
from instruments.drivers.magnetometer import Magnetometer
from instruments.drivers.oscilloscope import Oscilloscope
from instruments.links.opening import open_link
from instruments.links.transport import TrafficLog, Transport
from levilab.bench.config import BenchConfig, ConfigError, InstrumentSettings

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
        raise ConfigError(
            "{kind}.model = {name} is unknown, known are {known}", kind=self.name, name=repr(name), known=known
        )

    def named(self, text: str, described: InstrumentSettings | None) -> InstrumentSettings:
        """Return the settings of an instrument that a person names.

        Args:
            text: its model, or its address: the scheme of an address gives the model, any other is of the model that is
                described.
            described: the instrument of this kind in the bench file, if there is one.

        Raises:
            ConfigError: there is no such model, or its model or its address is not known.
        """
        scheme = text.partition("://")[0].upper() if "://" in text else None
        found = [row for row in self.models if text.upper() == row.name.upper() or scheme == row.scheme.upper()]
        if found and scheme:
            return InstrumentSettings(model=found[0].name, address=text)
        if found and described and described.model.upper() == text.upper():
            return described
        if found and found[0].address.endswith("://"):
            return InstrumentSettings(model=found[0].name, address=found[0].address)
        if found:
            how = "give its address" if found[0].scheme else "describe it in the bench file, or give its address"
            raise ConfigError(
                "where the {name} is was not said: {how}, such as {address}",
                name=found[0].name,
                how=how,
                address=found[0].address,
            )
        if not _ADDRESS.search(text):
            known = ", ".join(row.name for row in self.models)
            raise ConfigError(
                "{text} is neither a model nor an address: the models are {known}", text=repr(text), known=known
            )
        if described is None:
            raise ConfigError(
                "the bench file describes no {name}, so the model at {text} is not known: add a table "
                "[{name}] with model and address",
                name=self.name,
                text=text,
            )
        return described.model_copy(update={"address": text})


#: What a VISA resource, a URL or a port has in it.
_ADDRESS = re.compile(r"::|://|^/dev/|^COM\d", re.IGNORECASE)

COUNTER: Kind[Counter] = Kind("counter", "counts the light pulses", COUNTERS)
GENERATOR: Kind[Generator] = Kind("generator", "drives the coil", GENERATORS)
OSCILLOSCOPE: Kind[Oscilloscope] = Kind("oscilloscope", "records the phototransistor", OSCILLOSCOPES)
MAGNETOMETER: Kind[Magnetometer] = Kind("magnetometer", "measures the base's field", MAGNETOMETERS)

#: Name → kind.
KINDS: dict[str, Kind[Instrument]] = {kind.name: kind for kind in (COUNTER, GENERATOR, OSCILLOSCOPE, MAGNETOMETER)}


def estimates_u(config: BenchConfig) -> bool:
    """Return whether a bench counts by estimating the frequency of samples, with a u of each count."""
    if config.count_with != COUNTER.name:
        return True
    return config.counter is not None and COUNTER.model(config.counter.model).driver.ESTIMATES


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
