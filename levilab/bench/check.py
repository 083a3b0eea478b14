"""Whether the bench is there: each instrument connected to, asked who it is, and one reading taken."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from instruments.errors import InstrumentError
from levilab.bench.bench import open_bench
from levilab.bench.config import ConfigError
from levilab.bench.discover import KINDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from instruments.drivers.counter import Counter
    from instruments.drivers.generator import Generator
    from instruments.drivers.magnetometer import Magnetometer
    from instruments.drivers.oscilloscope import Oscilloscope
    from instruments.drivers.scpi import ScpiInstrument
    from levilab.bench.config import BenchConfig
    from levilab.world.spin_world import World


@dataclass(frozen=True)
class Checked:
    """One instrument.

    maker, model, serial_number, firmware: as it says itself; reading: in words, with value and unit where there is
    one; trouble: what is wrong and what to try, empty if all is well.
    """

    kind: str
    address: str
    maker: str = ""
    model: str = ""
    serial_number: str = ""
    firmware: str = ""
    reading: str = ""
    value: float | None = None
    unit: str = ""
    trouble: str = ""


#: In words, the value, its unit.
Reading = tuple[str, float | None, str]


def _count(instrument: ScpiInstrument, config: BenchConfig) -> Reading:
    counter = cast("Counter", instrument)
    counter.prepare(gate_s=min(config.spin.gate_s, 1.0), trigger_level_v=config.spin.trigger_level_v)
    spin = counter.frequency()
    if spin is None:
        return f"no pulses at {config.spin.trigger_level_v:g} V: a top that does not spin, or no light", None, "Hz"
    return f"{spin:.4f} Hz at {config.spin.trigger_level_v:g} V", spin, "Hz"


def _generated(instrument: ScpiInstrument, _: BenchConfig) -> Reading:
    generator = cast("Generator", instrument)
    frequency = generator.frequency
    return f"output off, set to {frequency:g} Hz", frequency, "Hz"


def _seen(instrument: ScpiInstrument, config: BenchConfig) -> Reading:
    scope = cast("Oscilloscope", instrument)
    scope.prepare(
        duration_s=0.1,
        points=1000,
        volts_per_division=0.5,
        trigger_level_v=config.spin.trigger_level_v,
        sweep="auto",
    )
    scope.acquire(timeout_s=5.0)
    volts = [v for v in scope.trace(1).volts.tolist() if math.isfinite(v)]
    if not volts:
        return "no sample on channel 1 in 0.1 s", None, "V"
    low, high = min(volts), max(volts)
    return f"channel 1 between {low:.2f} and {high:.2f} V in 0.1 s", high - low, "V"


def _felt(instrument: ScpiInstrument, _: BenchConfig) -> Reading:
    meter = cast("Magnetometer", instrument)
    meter.prepare(range_t=None)
    flux_density = meter.flux_density()
    if flux_density is None:
        return "more than its range", None, "T"
    return f"{1e3 * flux_density:.4g} mT", flux_density, "T"


#: What one reading of a kind is.
READINGS: dict[str, Callable[[ScpiInstrument, BenchConfig], Reading]] = {
    "counter": _count,
    "generator": _generated,
    "oscilloscope": _seen,
    "magnetometer": _felt,
}


def check(config: BenchConfig, world: World | None = None) -> Iterator[Checked]:
    """Each instrument that is described, one after the other; of a world all kinds.

    The generator's output is off afterwards.  Raises ConfigError where nothing is described.
    """
    kinds = [kind for kind in KINDS if world or getattr(config, kind)]
    if not kinds:
        raise ConfigError("the bench file describes no instrument: `levilab bench init` writes one from what answers")
    for kind in kinds:
        yield _checked(kind, config, world)


def _checked(kind: str, config: BenchConfig, world: World | None) -> Checked:
    from levilab.world.bench import VIRTUAL

    address = VIRTUAL[kind].address if world else getattr(config, kind).address
    seen: dict[str, Any] = {}
    try:
        with open_bench(config, (kind,), world=world) as bench:
            instrument = bench.instruments[kind]
            seen = _identity(instrument.identity())
            reading, value, unit = READINGS[kind](instrument, config)
    except (InstrumentError, ConfigError) as error:
        return Checked(kind, address, **seen, trouble=str(error).removeprefix(f"{address}: "))
    return Checked(kind, address, **seen, reading=reading, value=_finite(value), unit=unit)


def _identity(answer: str) -> dict[str, str]:
    """The four fields of an answer to ``*IDN?`` (IEEE 488.2, 10.14); those that are missing are empty."""
    fields = [*(field.strip() for field in answer.split(",", 3)), "", "", ""]
    return dict(zip(("maker", "model", "serial_number", "firmware"), fields, strict=False))


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
