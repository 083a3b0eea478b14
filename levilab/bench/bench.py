"""Opens the instruments of a bench.  Outputs are off on every way out."""

import contextlib
from collections.abc import Callable, Collection, Iterator
from typing import Any, TypeVar

import numpy as np

from analysis.errors import TooFewReadings
from analysis.rotation import FieldSpin, spin_of_field
from analysis.rotation.errors import NoLine
from instruments.drivers import Instrument, Value
from instruments.drivers.counter import Counter
from instruments.drivers.counter.phyphox import Array, FieldLine, Phyphox
from instruments.drivers.generator import Generator
from instruments.drivers.magnetometer import Magnetometer
from instruments.drivers.oscilloscope import Oscilloscope
from instruments.drivers.oscilloscope.sound import SoundCard
from instruments.errors import InstrumentError, SettingsLost
from instruments.links.transport import TrafficLog
from levilab.bench.config import ConfigError
from levilab.bench.kinds import COUNTER, GENERATOR, MAGNETOMETER, OSCILLOSCOPE, Kind, transport_to
from levilab.bench.sampled import SampledCounter
from levilab.bench.wiring import Wiring

I = TypeVar("I", bound=Instrument)  # noqa: E741 - an instrument


class OutputMayBeOn(InstrumentError):
    """The drive could not be switched off."""

    def __init__(self, address: str, cause: Exception) -> None:
        super().__init__(address, f"THE DRIVE MAY STILL BE ON, switch it off by hand ({cause})")


class Bench:
    """A bench that is open.

    Attributes:
        clock: of the bench.
        instruments: the open ones by kind.
        camera: see `Wiring`; None on a real bench, whose films are files.
        trigger: the edge that starts the generator's bursts, None: no wire leads to its trigger input.
        counter, generator, oscilloscope, magnetometer: the same, for the kinds that were opened.
    """

    counter: Counter
    generator: Generator
    oscilloscope: Oscilloscope
    magnetometer: Magnetometer

    def __init__(self, wiring: Wiring) -> None:
        self.clock, self.camera = wiring.clock, wiring.camera
        generator = wiring.instruments.get(GENERATOR.name)
        self.trigger = generator.trigger if generator else None
        self.instruments: dict[str, Instrument] = {}
        self._prepared: dict[str, dict[str, Value]] = {}

    # --- instruments that lose their link, or their settings ---

    def record_settings(self, kind: str) -> None:
        """Remember how an instrument was set up, for `changed_settings`.

        Raises SettingsLost where some settings are not as the driver set them: the instrument was reset meanwhile.
        """
        now = self.instruments[kind].settings()
        if lost := self.instruments[kind].changed_settings(now):
            raise SettingsLost(self.address(kind), lost)
        self._prepared[kind] = now

    def changed_settings(self, kind: str) -> dict[str, tuple[object, object]]:
        """Return the settings that differ from those set up: name → (as set up, now)."""
        return self.instruments[kind].changed_settings(since=self._prepared.get(kind, {}))

    def address(self, kind: str) -> str:
        """Return the address of an instrument."""
        return self.instruments[kind].transport.address

    def reopen(self, kind: str) -> None:
        """Open the link again and check that the same instrument is there.  Raises InstrumentError."""
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
        except Exception:  # noqa: BLE001 - whatever it was, the second try decides, over a new link
            try:
                self.generator.transport.reopen()
                self.generator.off()
            except Exception as error:
                raise OutputMayBeOn(self.address("generator"), error) from error


@contextlib.contextmanager
def open_bench(
    wiring: Wiring,
    kinds: Collection[str],
    *,
    log: TrafficLog | None = None,
    check: Callable[[], None] = lambda: None,
    off: Callable[[], object] = lambda: None,
) -> Iterator[Bench]:
    """Open the bench with the instruments of these kinds; outputs are off at the beginning and at the end.

    Where the wiring counts with the oscilloscope, a counter is made of it.

    check: called before each instrument, may raise to give up; off: called once the outputs are seen to be off.  Raises
    ConfigError for an instrument that is not described or of an unknown model, InstrumentError when one does not answer
    as it should.
    """
    bench = Bench(wiring)
    sampled = COUNTER.name in kinds and wiring.count_with == OSCILLOSCOPE.name
    with contextlib.ExitStack() as links:

        def connect(kind: Kind[I], *, alone: bool = True) -> I:
            """Open an instrument, and take it into the bench once its identity is right."""
            check()
            instrument = connect_driver(kind, wiring, log=log)
            links.callback(instrument.close)
            if alone:  # no other program changes its settings while it measures
                instrument.transport.lock()
            instrument.identity()
            instrument.forget_errors()
            bench.instruments[kind.name] = instrument
            return instrument

        try:
            if GENERATOR.name in kinds:  # first: a program that was killed may have left its output on
                # never locked: if its link is lost, its output must be switched off over another one
                bench.generator = connect(GENERATOR, alone=False)
                bench.generator.limits = wiring.limits.of_the_drive()
                bench.outputs_off()
            off()
            if COUNTER.name in kinds and not sampled:
                bench.counter = connect(COUNTER)
            if MAGNETOMETER.name in kinds:
                bench.magnetometer = connect(MAGNETOMETER)
            if OSCILLOSCOPE.name in kinds or sampled:
                bench.oscilloscope = connect(OSCILLOSCOPE)
            if sampled:
                bench.counter = bench.instruments[COUNTER.name] = SampledCounter(bench.oscilloscope)
            check()
            yield bench
        finally:
            bench.outputs_off()


def connect_driver(kind: Kind[I], wiring: Wiring, *, log: TrafficLog | None = None) -> I:
    """Return a driver on an open link.  Raises ConfigError for an unknown model, InstrumentError."""
    settings = wiring.describe(kind.name)
    driver = kind.model(settings.model).driver
    transport = transport_to(driver, settings, library=wiring.library, clock=wiring.clock, log=log)
    instrument = driver(transport, clock=wiring.clock, **ANALYSES.get(driver, {}))
    if isinstance(instrument, SoundCard):
        instrument.clock_error, instrument.clock_u = settings.clock_error or 0.0, settings.clock_u
    elif settings.clock_error is not None:
        raise ConfigError(f"{kind.name}.clock_error = {settings.clock_error:g} is for a sound card alone: remove it")
    return instrument


#: A top falls within a window whose last third has less than this of the line before (noise alone: in 1 of 200); the
#: spin is that of the samples before then, since the whole window's would be up to 0.4 Hz too low.
_LEAST_LEFT = 0.5


def line_in_field(times: Array, field: Array, *, near: float | None) -> FieldLine | None:
    """Find the line of a turning moment; see `instruments.drivers.counter.phyphox.Estimator`.

    A top that was seen shortly before is seen on a line of the mains, too, where a spin would be taken for the mains:
    at 40 Hz, for one, where 100 samples a second show a line of 60 Hz.
    """
    without: dict[str, Any] = {}
    try:
        try:
            found = spin_of_field(times, field, near=near)
        except NoLine:
            if near is None:
                raise
            without = {"mains_hz": ()}
            found = spin_of_field(times, field, near=near, **without)
        early = 2 * times.size // 3
        if _strength_left(times, field, found, early) < _LEAST_LEFT:
            found = spin_of_field(times[:early], field[:early], near=found.frequency, **without)
    except (NoLine, TooFewReadings):
        return None
    folds = tuple(fold.frequency for fold in found.folds[1:]) if found.doubtful else ()
    return FieldLine(found.frequency, found.u_frequency, found.reference_time, folds)


def _strength_left(times: Array, field: Array, found: FieldSpin, early: int) -> float:
    """Return the amplitude of a line behind the early samples over that in them; 1 while the top is up."""
    late = times - found.reference_time
    wave = np.exp(-2j * np.pi * (found.frequency * late + found.chirp * late**2 / 2))[:, None]
    parts = slice(early), slice(early, None)
    before, after = (((field - field.mean(axis=0)) * wave)[part].mean(axis=0) for part in parts)
    return float((before.conj() @ after).real / (before.conj() @ before).real)


#: Driver → the analyses that it is given.
ANALYSES: dict[type[Instrument], dict[str, Any]] = {Phyphox: {"estimator": line_in_field}}
