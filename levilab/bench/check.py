"""Whether the bench is there: each instrument connected to, asked who it is, and one reading taken."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from instruments.drivers.oscilloscope.sound import SoundCard
from instruments.errors import InstrumentError
from levilab.bench.bench import Bench, open_bench
from levilab.bench.config import ConfigError
from levilab.bench.discover import scheme_of
from levilab.bench.hearing import listen
from levilab.bench.kinds import COUNTER, KINDS
from levilab.bench.wiring import Wiring


@dataclass(frozen=True)
class Checked:
    """One instrument.

    maker, model, serial_number, firmware: as it says itself; device, software: of a phone or a sound card, which have
    a name instead of a number, and the version of the program that reads them; reading: as text, with value and unit
    where there is one; trouble: what is wrong and what to try, empty if all is well.
    """

    kind: str
    address: str
    maker: str = ""
    model: str = ""
    serial_number: str = ""
    firmware: str = ""
    device: str = ""
    software: str = ""
    reading: str = ""
    value: float | None = None
    unit: str = ""
    trouble: str = ""

    @property
    def identity(self) -> str:
        """Who it says it is, as people read it; empty where it did not say it."""
        if not self.model:
            return ""
        named = {"": self.device, "version ": self.software}
        if not self.device:
            named = {"serial number ": self.serial_number or "-", "firmware ": self.firmware or "-"}
        return ", ".join((f"{self.maker} {self.model}", *(f"{name}{text}" for name, text in named.items())))


@dataclass(frozen=True)
class Light:
    """How the light of the phototransistor is looked at: a gate [s], and a trigger level [V]."""

    gate_s: float = 1.0
    trigger_level_v: float = 0.6


#: Name of the quantity, its value, its unit.
Reading = tuple[str, float | None, str]


def _check_counter(bench: Bench, light: Light) -> Reading:
    bench.counter.prepare(gate_s=min(light.gate_s, 1.0), trigger_level_v=light.trigger_level_v)
    frequency = bench.counter.frequency()
    signal = bench.counter.SIGNAL
    level = f" at {light.trigger_level_v:g} V" if signal.has_level else ""
    if frequency is None:
        return f"no {signal.name}{level}: {signal.advice}?", None, "Hz"
    return f"{frequency:.4f} Hz{level}", frequency, "Hz"


def _check_generator(bench: Bench, _: Light) -> Reading:
    frequency = bench.generator.frequency
    return f"output off, set to {frequency:g} Hz", frequency, "Hz"


def _check_oscilloscope(bench: Bench, light: Light) -> Reading:
    scope = bench.oscilloscope
    if isinstance(scope, SoundCard):
        return *listen(scope), "dB"
    scope.prepare(
        duration_s=0.1, points=1000, volts_per_division=0.5, trigger_level_v=light.trigger_level_v, sweep="auto"
    )
    scope.acquire(timeout_s=5.0)
    volts = [v for v in scope.trace(1).volts.tolist() if math.isfinite(v)]
    if not volts:
        return "no sample on channel 1 in 0.1 s", None, "V"
    low, high = min(volts), max(volts)
    return f"channel 1 between {low:.2f} and {high:.2f} V in 0.1 s", high - low, "V"


def _check_magnetometer(bench: Bench, _: Light) -> Reading:
    bench.magnetometer.prepare(range_t=None)
    flux_density = bench.magnetometer.flux_density()
    if flux_density is None:
        return "more than its range", None, "T"
    return f"{1e3 * flux_density:.4g} mT", flux_density, "T"


#: What one reading of a kind is.
READINGS: dict[str, Callable[[Bench, Light], Reading]] = {
    "counter": _check_counter,
    "generator": _check_generator,
    "oscilloscope": _check_oscilloscope,
    "magnetometer": _check_magnetometer,
}


def check(wiring: Wiring, light: Light) -> Iterator[Checked]:
    """Check each instrument of a bench, one after the other.

    The generator's output is off afterwards.  Raises ConfigError where nothing is described.
    """
    kinds = [kind for kind in KINDS if kind in wiring.instruments]
    if not kinds:
        raise ConfigError("the bench file describes no instrument: `levilab bench init` writes one from what answers")
    for kind in kinds:
        yield _check(kind, wiring, light)


def _check(kind: str, wiring: Wiring, light: Light) -> Checked:
    address = wiring.instruments[kind].address
    seen: dict[str, Any] = {}
    try:
        # a counter that is described is checked, even where the oscilloscope counts
        with open_bench(replace(wiring, count_with=COUNTER.name), (kind,)) as bench:
            seen = _identity(bench.instruments[kind].identity(), _NAMES if scheme_of(address) else _NUMBERS)
            reading, value, unit = READINGS[kind](bench, light)
    except InstrumentError as error:
        return Checked(kind, address, **seen, trouble=error.reason)
    except ConfigError as error:
        return Checked(kind, address, **seen, trouble=str(error))
    finite = value if value is not None and math.isfinite(value) else None
    return Checked(kind, address, **seen, reading=reading, value=finite, unit=unit)


#: Fields of an identity: of an instrument (IEEE 488.2, 10.14), and behind an address with a scheme of its own.
_NUMBERS = ("maker", "model", "serial_number", "firmware")
_NAMES = ("maker", "model", "device", "software")


def _identity(answer: str, names: tuple[str, ...]) -> dict[str, str]:
    """Return the four fields of an identity by name; those that are missing are empty."""
    fields = [*(field.strip() for field in answer.split(",", 3)), "", "", ""]
    return dict(zip(names, fields, strict=False))
