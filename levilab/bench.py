"""Opens the bench, real or virtual.  The two differ in one place: what the transport talks to.

Outputs are off on every way out.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from instruments.counter import Counter, Keysight53230A
from instruments.errors import InstrumentError, OutOfRange
from instruments.generator import Generator, Keysight33500B
from instruments.transport import TrafficLog, VisaTransport
from levilab.clock import Clock, VirtualClock, WallClock
from levilab.config import BenchConfig, ConfigError, InstrumentSettings, Limits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from instruments.scpi import ScpiInstrument
    from instruments.virtual.bus import Bus
    from levilab.simulator.world import World

#: The drivers by kind and model.
DRIVERS: dict[str, dict[str, type[ScpiInstrument]]] = {
    "counter": {"53220A": Keysight53230A, "53230A": Keysight53230A},
    "generator": {"33500B": Keysight33500B},
}

#: Where the virtual instruments are plugged in.
VIRTUAL = {
    "counter": InstrumentSettings(model="53230A", address="TCPIP0::counter.levilab::inst0::INSTR"),
    "generator": InstrumentSettings(model="33500B", address="TCPIP0::generator.levilab::inst0::INSTR"),
}

#: Field of the virtual bench's coil at the top, per volt of the generator [T/V]: 10 Vpp make 0.4 mT.
COIL_T_PER_V = 0.4e-3 / 5.0


class OutputMayBeOn(InstrumentError):
    """The drive could not be switched off."""

    def __init__(self, address: str, cause: Exception) -> None:
        super().__init__(address, f"THE DRIVE MAY STILL BE ON, switch it off by hand ({cause})")


@dataclass
class Bench:
    """The instruments of a bench that is open, its clock and its limits."""

    clock: Clock
    limits: Limits
    instruments: dict[str, ScpiInstrument] = field(default_factory=dict)

    @property
    def counter(self) -> Counter:
        """The frequency counter."""
        return cast("Counter", self.instruments["counter"])

    @property
    def generator(self) -> Generator:
        """The function generator."""
        return cast("Generator", self.instruments["generator"])

    def drive(self, *, waveform: str, frequency_hz: float, amplitude_vpp: float) -> None:
        """Put the drive on the coil.  Raises OutOfRange beyond the limits of this bench."""
        self.check_limits(frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp)
        self.generator.prepare(waveform=waveform, frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp)
        self.generator.output = True

    def check_limits(self, *, frequency_hz: float, amplitude_vpp: float) -> None:
        """Raise OutOfRange if this drive is more than the bench stands."""
        for name, value, limit in (
            ("drive_amplitude_vpp", amplitude_vpp, self.limits.drive_amplitude_vpp),
            ("drive_frequency_hz", frequency_hz, self.limits.drive_frequency_hz),
        ):
            if not value <= limit:  # nan is more than any bench stands
                raise OutOfRange("bench", name, value, f"up to {limit:g} (limits.{name} in bench.toml)")

    def outputs_off(self) -> None:
        """Switch off whatever drives something, and see that it is off.

        Tried twice: an interruption or a late answer may cut the first try short.  Raises OutputMayBeOn.
        """
        if "generator" not in self.instruments:
            return
        try:
            self.generator.off()
        except Exception:  # noqa: BLE001 - whatever it was, the second try decides
            try:
                self.generator.off()
            except Exception as error:
                raise OutputMayBeOn(self.instruments["generator"].transport.address, error) from error


@contextlib.contextmanager
def open_bench(
    config: BenchConfig,
    kinds: tuple[str, ...],
    *,
    world: World | None = None,
    log: TrafficLog | None = None,
    check: Callable[[], None] = lambda: None,
) -> Iterator[Bench]:
    """The bench with the instruments of these kinds, outputs off; on the way out they are off again and all is closed.

    world: what the virtual instruments see, None for the real ones; check: called between the instruments, may raise
    to give up.  Raises ConfigError for an instrument that is not described or of an unknown model, InstrumentError
    when one does not answer as it should.
    """
    library: Any = config.visa_library
    if world:
        from pyvisa_levilab import library_for

        library = library_for(virtual_bus(world))
    bench = Bench(world.clock if world else WallClock(), config.limits)
    with contextlib.ExitStack() as links:
        try:
            for kind in kinds:
                settings = VIRTUAL[kind] if world else _described(config, kind)
                transport = VisaTransport(settings.address, library=library, timeout=settings.timeout_s, log=log)
                links.callback(transport.close)
                instrument = DRIVERS[kind][settings.model](transport)
                instrument.identity()
                instrument.forget_errors()
                bench.instruments[kind] = instrument  # only what is what it should be is ever switched
                check()
            bench.outputs_off()  # a program that was killed may have left them on
            yield bench
        finally:
            bench.outputs_off()


def check_described(config: BenchConfig, kinds: tuple[str, ...]) -> None:
    """Raise ConfigError unless all instruments of these kinds are described."""
    for kind in kinds:
        _described(config, kind)


def _described(config: BenchConfig, kind: str) -> InstrumentSettings:
    settings: InstrumentSettings | None = getattr(config, kind)
    if settings is None:
        raise ConfigError(f"bench.toml describes no {kind}: add a table [{kind}] with model and address")
    if settings.model not in DRIVERS[kind]:
        known = ", ".join(DRIVERS[kind])
        raise ConfigError(f"bench.toml: {kind}.model = {settings.model!r} is unknown, known are {known}")
    return settings


def virtual_bus(world: World | None = None) -> Bus:
    """The virtual instruments joined to one world: the drive moves the top, the top makes the light.

    world: by default a top of its own, on a virtual clock.
    """
    from instruments.virtual.bus import Bus
    from instruments.virtual.counter import Virtual53230A
    from instruments.virtual.generator import Output, Virtual33500B
    from levilab.simulator.world import SpinScene, SpinWorld

    world = world or SpinWorld(SpinScene(), VirtualClock())

    def coil(time: float, output: Output) -> None:
        world.drive(time, output.waveform, output.frequency, COIL_T_PER_V * output.amplitude)

    return Bus(
        {
            VIRTUAL["counter"].address: Virtual53230A(world.clock, signal=world.light),
            VIRTUAL["generator"].address: Virtual33500B(world.clock, listener=coil),
        }
    )
