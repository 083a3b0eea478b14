"""Opens the bench, real or virtual.  The two differ in one place: what the transport talks to.

Outputs are off on every way out.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from instruments.clock import Clock, WallClock
from instruments.drivers.generator import Limits as CoilLimits
from instruments.errors import InstrumentError, SettingsLost
from levilab.bench.config import BenchConfig, ConfigError, InstrumentSettings, Limits
from levilab.bench.kinds import driver_of, transport_to
from levilab.world.bench import VIRTUAL, virtual_bus

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from instruments.drivers.counter import Counter
    from instruments.drivers.generator import Generator
    from instruments.drivers.scpi import ScpiInstrument
    from instruments.links.transport import TrafficLog
    from levilab.world.spin_world import World


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
    _prepared: dict[str, dict[str, bool | float | str]] = field(default_factory=dict)

    @property
    def counter(self) -> Counter:
        """The frequency counter."""
        return cast("Counter", self.instruments["counter"])

    @property
    def generator(self) -> Generator:
        """The function generator."""
        return cast("Generator", self.instruments["generator"])

    def drive(self, *, waveform: str, frequency_hz: float, amplitude_vpp: float, offset_v: float = 0.0) -> None:
        """Put the drive on the coil.  Raises OutOfRange beyond the limits of this bench."""
        self.check_limits(frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp, offset_v=offset_v)
        self.generator.prepare(
            waveform=waveform, frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp, offset_v=offset_v
        )
        self.generator.output = True

    def drive_at(self, frequency_hz: float) -> None:
        """Change the frequency of the drive that is on.  Raises OutOfRange beyond the limits of this bench."""
        self.check_limits(frequency_hz=frequency_hz)
        self.generator.frequency = frequency_hz

    def check_limits(self, *, frequency_hz: float, amplitude_vpp: float = 0.0, offset_v: float = 0.0) -> None:
        """Raise OutOfRange if this drive is more than the bench stands."""
        _coil_limits(self.limits).check(
            "bench", frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp, offset_v=offset_v
        )

    # --- instruments that lose their link, or their settings ---

    def remember(self, kind: str) -> None:
        """An instrument was set up: these are the settings that it is to keep.

        Raises SettingsLost where some are not as they were set: somebody has reset it meanwhile.
        """
        now = self.instruments[kind].settings()
        if lost := self.instruments[kind].unlike(now):
            raise SettingsLost(self.address(kind), lost)
        self._prepared[kind] = now

    def forgotten(self, kind: str) -> dict[str, tuple[object, object]]:
        """Settings that are no longer as they were set up, by name: (as set up, now).  Somebody has changed them."""
        now = self.instruments[kind].settings()
        return {name: (then, now[name]) for name, then in self._prepared.get(kind, {}).items() if now[name] != then}

    def address(self, kind: str) -> str:
        """Where an instrument is."""
        return self.instruments[kind].transport.address

    def reopen(self, kind: str) -> None:
        """Make the link anew and see that the same instrument is there.  Raises InstrumentError."""
        instrument = self.instruments[kind]
        instrument.transport.reopen()
        instrument.identity()
        instrument.forget_errors()

    def outputs_off(self) -> None:
        """Switch off whatever drives something, and see that it is off.

        Tried twice: an interruption or a late answer may cut the first try short.  Raises OutputMayBeOn.
        """
        if "generator" not in self.instruments:
            return
        try:
            self.generator.off()
        except Exception:  # noqa: BLE001 - whatever it was, the second try decides, over a link made anew
            try:
                self.instruments["generator"].transport.reopen()
                self.generator.off()
            except Exception as error:
                raise OutputMayBeOn(self.instruments["generator"].transport.address, error) from error


def _coil_limits(limits: Limits) -> CoilLimits:
    """The limits of the bench file as the generator's driver keeps them."""
    return CoilLimits(**limits.model_dump())


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
    # whoever measures waits on the wall's clock: a bench whose clock jumps would stand still meanwhile
    library: Any = "realtime@levilab" if config.visa_library == "@levilab" else config.visa_library
    if world:
        from instruments.virtual.bench.visa_library import library_for

        library = library_for(virtual_bus(world))
    bench = Bench(world.clock if world else WallClock(), config.limits)
    with contextlib.ExitStack() as links:
        try:
            for kind in sorted(kinds, key=lambda kind: kind != "generator"):  # first what may have been left on
                settings = VIRTUAL[kind] if world else _described(config, kind)
                instrument = opened(kind, settings, bench.clock, library=library, log=log)
                links.callback(instrument.close)
                if kind != "generator":  # a drive whose link was lost must be switched off over another one
                    instrument.transport.lock()  # while we measure nobody else turns its keys
                if kind == "generator":
                    cast("Generator", instrument).limits = _coil_limits(config.limits)
                instrument.identity()
                instrument.forget_errors()
                bench.instruments[kind] = instrument  # only what is what it should be is ever switched
                if kind == "generator":
                    bench.outputs_off()  # a program that was killed may have left them on
                check()
            yield bench
        finally:
            bench.outputs_off()


def opened(
    kind: str, settings: InstrumentSettings, clock: Clock, *, library: Any = "@py", log: TrafficLog | None = None
) -> ScpiInstrument:
    """A driver on an open link.  library: PyVISA's.  Raises ConfigError for an unknown model, InstrumentError."""
    driver: Any = driver_of(kind, settings.model)
    transport = transport_to(kind, settings, library=library, clock=clock, log=log)
    # a scope is waited for: on the bench's clock
    one: ScpiInstrument = driver(transport, clock=clock) if kind == "oscilloscope" else driver(transport)
    return one


def check_described(config: BenchConfig, kinds: tuple[str, ...]) -> None:
    """Raise ConfigError unless all instruments of these kinds are described, and of models that are known."""
    for kind in kinds:
        driver_of(kind, _described(config, kind).model)


def _described(config: BenchConfig, kind: str) -> InstrumentSettings:
    settings: InstrumentSettings | None = getattr(config, kind)
    if settings is None:
        raise ConfigError(f"the bench file describes no {kind}: add a table [{kind}] with model and address")
    return settings
