"""The virtual instruments, joined to one world: the drive moves the top, the top makes the light."""

from __future__ import annotations

from typing import TYPE_CHECKING

from instruments.clock import VirtualClock
from levilab.bench.config import ConfigError, InstrumentSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from instruments.clock import Clock
    from instruments.virtual.bench.bus import Bus
    from instruments.virtual.core.device import VirtualInstrument
    from instruments.virtual.generator.generator import Output
    from levilab.simulator.scene import Scene
    from levilab.world.spin_world import World

#: Where the virtual instruments are plugged in, and what they are unless other models are asked for.
VIRTUAL = {
    "counter": InstrumentSettings(model="53230A", address="TCPIP0::counter.levilab::inst0::INSTR"),
    "generator": InstrumentSettings(model="33500B", address="TCPIP0::generator.levilab::inst0::INSTR"),
    "oscilloscope": InstrumentSettings(model="DS1000Z", address="TCPIP0::oscilloscope.levilab::inst0::INSTR"),
    "magnetometer": InstrumentSettings(model="425", address="ASRLmagnetometer.levilab::INSTR"),
}

#: Field of the virtual bench's coil at the top, per volt of the generator [T/V]: 10 Vpp make 0.4 mT.
COIL_T_PER_V = 0.4e-3 / 5.0


def _counter_53230a(world: World) -> VirtualInstrument:
    from instruments.virtual.counter.keysight_53230a import Virtual53230A

    return Virtual53230A(world.clock, signal=world.light)


def _counter_cnt91(world: World) -> VirtualInstrument:
    from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91

    return VirtualCNT91(world.clock, signal=world.light)


def _coil_of(world: World) -> Callable[[float, Output], None]:
    """What a generator does to the world."""
    return lambda time, output: world.drive(time, output.times(COIL_T_PER_V))


def _generator_33500b(world: World) -> VirtualInstrument:
    from instruments.virtual.generator.keysight_33500b import Virtual33500B

    return Virtual33500B(world.clock, listener=_coil_of(world))


def _generator_33220a(world: World) -> VirtualInstrument:
    from instruments.virtual.generator.agilent_33220a import Virtual33220A

    return Virtual33220A(world.clock, listener=_coil_of(world))


def _signals(world: World) -> dict[int, Callable[[float, float, int], NDArray[np.float64]]]:
    """What the oscilloscope is connected to: the phototransistor, and the generator's output."""
    return {1: world.light, 2: lambda start, step, n: world.coil_field(start, step, n) / COIL_T_PER_V}


def _scope_ds1000z(world: World) -> VirtualInstrument:
    from instruments.virtual.oscilloscope.rigol_ds1000z import VirtualDS1000Z

    return VirtualDS1000Z(world.clock, signals=_signals(world))


def _scope_dsox1000(world: World) -> VirtualInstrument:
    from instruments.virtual.oscilloscope.keysight_dsox1000 import VirtualDSOX1000

    return VirtualDSOX1000(world.clock, signals=_signals(world))


def _magnetometer_425(world: World) -> VirtualInstrument:
    from instruments.virtual.magnetometer.lakeshore_425 import Virtual425

    return Virtual425(world.clock, flux_density=world.flux_density)


def _magnetometer_475(world: World) -> VirtualInstrument:
    from instruments.virtual.magnetometer.lakeshore_475 import Virtual475

    return Virtual475(world.clock, flux_density=world.flux_density)


#: Kind → model → what makes it, in a world.
MODELS: dict[str, dict[str, Callable[[World], VirtualInstrument]]] = {
    "counter": {"53230A": _counter_53230a, "CNT-91": _counter_cnt91},
    "generator": {"33500B": _generator_33500b, "33220A": _generator_33220a},
    "oscilloscope": {"DS1000Z": _scope_ds1000z, "DSOX1000": _scope_dsox1000},
    "magnetometer": {"425": _magnetometer_425, "475": _magnetometer_475},
}


def virtual_bus(world: World | None = None, models: Mapping[str, str] | None = None) -> Bus:
    """A virtual bench.

    world: by default a top of its own, on a virtual clock; models: kind → model, for those that are to be others than
    in VIRTUAL.  Raises ConfigError for one that there is not.
    """
    from instruments.virtual.bench.bus import Bus

    world = world or own_world()
    chosen = {kind: settings.model for kind, settings in VIRTUAL.items()} | dict(models or {})
    instruments = {kind: _maker(kind, model)(world) for kind, model in chosen.items()}
    return Bus({VIRTUAL[kind].address: instrument for kind, instrument in instruments.items()})


def plug_in_serial(bus: Bus | None = None) -> Bus:
    """Let pyserial find a virtual bench; which one.

    From then on ``serial.serial_for_url("levilab://magnetometer")`` is its magnetometer, and for pyvisa-py
    ``ASRLlevilab://magnetometer::INSTR``.  bus: by default a fresh bench with a top of its own.
    """
    from instruments.virtual.bench.protocol_levilab import plug_in

    bus = bus or virtual_bus()
    plug_in(lambda: bus)
    return bus


#: A top that falls on a bench to practise at is put back after so long [s].
AGAIN_S = 15.0


def own_world(clock: Clock | None = None) -> World:
    """A top to practise with, put back whenever it falls.  clock: by default one that jumps."""
    from levilab.world.spin_world import SpinScene, SpinWorld

    return SpinWorld(SpinScene(again_s=AGAIN_S), clock or VirtualClock())


def scene_world(
    scene: Scene,
    clock: Callable[[], Clock],
    tell: Callable[[str], None],
    *,
    again_s: float | None = None,
    seed: int = 0,
) -> World:
    """The top of a scene in full motion.

    clock: makes one, when all is ready; tell: is told when code must be compiled first; again_s: so long after a fall
    the top is put back, None: it is not.  Raises SceneError for a scene without motion, SimulationError for one that
    cannot be simulated.
    """
    from levilab.simulator.compilation import announce_compilation
    from levilab.world.motion_world import MotionWorld, prepare

    with announce_compilation(tell):
        prepare(scene)
    return MotionWorld(scene, clock(), again_s=again_s, seed=seed)


def _maker(kind: str, model: str) -> Callable[[World], VirtualInstrument]:
    if kind not in MODELS:
        raise ConfigError(f"there is no virtual {kind!r}: known are {', '.join(MODELS)}")
    models = {name.upper(): maker for name, maker in MODELS[kind].items()}
    if model.upper() not in models:
        raise ConfigError(f"there is no virtual {kind} {model!r}: known are {', '.join(MODELS[kind])}")
    return models[model.upper()]
