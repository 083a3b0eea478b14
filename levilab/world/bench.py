"""The virtual instruments, joined to one world: the drive moves the top, the top makes the light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from instruments.catalogue import CATALOGUE
from instruments.clock import VirtualClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.protocol_levilab import plug_in
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.core.device import VirtualInstrument
from levilab.bench.config import ConfigError, InstrumentSettings, Limits
from levilab.bench.wiring import Wiring
from levilab.world.person import VirtualPerson
from levilab.world.spin_world import SpinScene, SpinWorld

if TYPE_CHECKING:
    from collections.abc import Mapping

    from instruments.clock import Clock
    from instruments.virtual.counter.edges import Thresholds
    from levilab.simulator.scene import Scene
    from levilab.world.spin_world import Array, World

#: Where the virtual instruments are plugged in, and what they are unless other models are asked for.
VIRTUAL = {
    kind: InstrumentSettings(
        model=models[0].name,
        address=f"ASRL{kind}.levilab::INSTR" if models[0].driver.SERIAL else f"TCPIP0::{kind}.levilab::inst0::INSTR",
    )
    for kind, models in CATALOGUE.items()
}

#: Field of the virtual bench's coil at the top, per volt of the generator [T/V]: 10 Vpp make 0.4 mT.
COIL_T_PER_V = 0.4e-3 / 5.0


#: What makes a virtual instrument in a world.
Maker = Callable[["World"], VirtualInstrument]


@dataclass(frozen=True)
class Light:
    """The light of a world as the signal of a counter, which has the times of its edges without a trace."""

    world: World

    def __call__(self, start: float, step: float, n: int) -> Array:
        """See `World.light`."""
        return self.world.light(start, step, n)

    def crossings(self, start: float, stop: float, triggers: Thresholds) -> Array | None:
        """See `World.crossings`."""
        return self.world.crossings(start, stop, triggers)


def at_the_light(model: Callable[..., VirtualInstrument]) -> Maker:
    """A counter: its input 1 is connected to the phototransistor that sees the tape, 2 to the laser's."""
    return lambda world: model(world.clock, signal=Light(world), second=world.laser)


def at_the_coil(model: Callable[..., VirtualInstrument]) -> Maker:
    """A generator: its output is connected to the coil."""
    return lambda world: model(world.clock, listener=lambda time, output: world.drive(time, output.times(COIL_T_PER_V)))


def scope_signals(world: World) -> dict[int, Callable[[float, float, int], Array]]:
    """What an oscilloscope is connected to.

    Channel 1 sees the tape's phototransistor, 2 the generator's output, 3 the laser's phototransistor; one with two
    channels has no input left for the laser.
    """
    drive = lambda start, step, n: world.coil_field(start, step, n) / COIL_T_PER_V  # noqa: E731
    return {1: world.light, 2: drive, 3: world.laser}


def at_light_and_coil(model: Callable[..., VirtualInstrument]) -> Maker:
    """An oscilloscope."""
    return lambda world: model(world.clock, signals=scope_signals(world))


def in_the_field(model: Callable[..., VirtualInstrument]) -> Maker:
    """A gaussmeter: its probe is at the place of the top."""
    return lambda world: model(world.clock, flux_density=world.flux_density)


#: How the virtual instruments of each kind are connected to the world.
_CONNECTED: dict[str, Callable[[Callable[..., VirtualInstrument]], Maker]] = {
    "counter": at_the_light,
    "generator": at_the_coil,
    "oscilloscope": at_light_and_coil,
    "magnetometer": in_the_field,
}
#: Kind → model → what makes it.
VIRTUAL_MODELS: dict[str, dict[str, Maker]] = {
    kind: {model.name: _CONNECTED[kind](model.twin) for model in models} for kind, models in CATALOGUE.items()
}


def virtual_bus(world: World | None = None, models: Mapping[str, str] | None = None) -> VirtualBench:
    """A virtual bench.

    Args:
        world: by default a top of its own, on a virtual clock.
        models: kind → model, for those that are to be others than in VIRTUAL.

    Raises:
        ConfigError: there is no such kind or model.
    """
    world = world or practice_world()
    chosen = {kind: settings.model for kind, settings in VIRTUAL.items()} | dict(models or {})
    instruments = {kind: _maker(kind, model)(world) for kind, model in chosen.items()}
    return VirtualBench({VIRTUAL[kind].address: instrument for kind, instrument in instruments.items()})


def virtual_wiring(world: World, limits: Limits | None = None) -> Wiring:
    """The wiring of a virtual bench.

    Args:
        world: that it measures.
        limits: by default those of a bench file without any.
    """
    return Wiring(VIRTUAL, limits or Limits(), library_for(virtual_bus(world)), world.clock, VirtualPerson(world))


def plug_in_serial(bus: VirtualBench | None = None) -> VirtualBench:
    """Let pyserial find a virtual bench; which one.

    From then on ``serial.serial_for_url("levilab://magnetometer")`` is its magnetometer, and for pyvisa-py
    ``ASRLlevilab://magnetometer::INSTR``.

    Args:
        bus: by default a fresh bench with a top of its own.
    """
    bus = bus or virtual_bus()
    plug_in(lambda: bus)
    return bus


#: A top that falls on a bench to practise at is put back after so long [s].
PUT_BACK_AFTER_S = 15.0


def practice_world(clock: Clock | None = None) -> World:
    """A top to practise with, put back whenever it falls.

    Args:
        clock: by default one that jumps.
    """
    return SpinWorld(SpinScene(put_back_after_s=PUT_BACK_AFTER_S), clock or VirtualClock())


def scene_world(
    scene: Scene,
    clock: Callable[[], Clock],
    tell: Callable[[str], None],
    *,
    put_back_after_s: float | None = None,
    seed: int = 0,
) -> World:
    """The top of a scene in full motion.

    Args:
        scene: what is to move.
        clock: makes one, when all is ready.
        tell: called where code must be compiled first.
        put_back_after_s: so long after a fall the top is put back [s]; None: it is not.
        seed: of the light's noise, and of the place of the tape.

    Raises:
        SceneError: the scene has no motion.
        SimulationError: it cannot be simulated.
    """
    from levilab.simulator.compilation import announce_compilation  # the compiler takes a moment to load
    from levilab.world.motion_world import MotionWorld, prepare

    with announce_compilation(tell):
        prepare(scene)
    return MotionWorld(scene, clock(), put_back_after_s=put_back_after_s, seed=seed)


def _maker(kind: str, model: str) -> Callable[[World], VirtualInstrument]:
    if kind not in VIRTUAL_MODELS:
        raise ConfigError(f"there is no virtual {kind!r}: known are {', '.join(VIRTUAL_MODELS)}")
    models = {name.upper(): maker for name, maker in VIRTUAL_MODELS[kind].items()}
    if model.upper() not in models:
        raise ConfigError(f"there is no virtual {kind} {model!r}: known are {', '.join(VIRTUAL_MODELS[kind])}")
    return models[model.upper()]
