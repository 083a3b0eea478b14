"""The virtual instruments, joined to one world: the drive moves the top, the top makes the light."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from instruments.catalogue import CATALOGUE
from instruments.clock import Clock, VirtualClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.core.device import VirtualInstrument
from levilab.bench.config import ConfigError, InstrumentSettings, Limits
from levilab.bench.person import FloatTop, PlaceProbe, ShieldProbe, Task
from levilab.bench.wiring import Wiring
from levilab.errors import list_known
from levilab.world.pose import FLOATS_M
from levilab.world.spin_world import SpinScene, SpinWorld, World

if TYPE_CHECKING:
    from analysis.arrays import Array
    from instruments.virtual.counter.edges import Thresholds
    from levilab.simulator.scene import Scene
    from levilab.world.motion_world import MotionWorld


def virtual_settings(kind: str, name: str) -> InstrumentSettings:
    """Return model and address of a virtual instrument.  Raises ConfigError: there is no such kind or model."""
    if kind not in CATALOGUE:
        raise ConfigError(f"there is no virtual {kind!r}: known are {', '.join(CATALOGUE)}")
    model = next((model for model in CATALOGUE[kind] if model.name.upper() == name.upper()), None)
    if model is None:
        known = list_known(name.upper(), (model.name for model in CATALOGUE[kind]))
        raise ConfigError(f"there is no virtual {kind} {name!r}: {known}")
    address = f"TCPIP0::{kind}.levilab::inst0::INSTR"
    if model.scheme:
        address = f"{model.scheme}://{kind}.levilab"
    elif model.driver.SERIAL:
        address = f"ASRL{kind}.levilab::INSTR"
    return InstrumentSettings(model=model.name, address=address, trigger="rising" if kind == "generator" else None)


#: Address and default model of the virtual instrument of each kind.
VIRTUAL = {kind: virtual_settings(kind, models[0].name) for kind, models in CATALOGUE.items()}

#: Field of the virtual bench's coil at the top, per volt of the generator [T/V]: 10 Vpp make 0.4 mT.
COIL_T_PER_V = 0.4e-3 / 5.0

#: Where a phone lies: on the table, 20 cm beside the base's middle [m above that].
PHONE_M = np.array([0.2, 0.0, 0.0])


#: Makes a virtual instrument; and one that is connected to a world.
Model = Callable[..., VirtualInstrument]
Maker = Callable[["World"], VirtualInstrument]


@dataclass(frozen=True)
class Light:
    """The light of a world as the signal of a counter, with the times of its edges computed without a trace."""

    world: World

    def __call__(self, start: float, step: float, n: int) -> Array:
        """See `World.light`."""
        return self.world.light(start, step, n)

    def crossings(self, start: float, stop: float, triggers: Thresholds) -> Array | None:
        """See `World.crossings`."""
        return self.world.crossings(start, stop, triggers)


@dataclass(frozen=True)
class PickupCoil:
    """The voltage of a coil whose axis points to the floating top, behind an amplifier: N A dB/dt.

    Attributes:
        turns, area_m2: of the coil; thin and short, so that its field is that in its middle.
        distance_m: from the top.
        amplifier: its gain.
    """

    world: World
    turns: int = 1000
    area_m2: float = 1e-4
    distance_m: float = 0.04
    amplifier: float = 300.0

    def __call__(self, start: float, step: float, n: int) -> Array:
        """Return the voltage at start + step·k, shape (n,) [V]."""
        times = start + step * (np.arange(n + 1, dtype=np.float64) - 0.5)
        field = self.world.magnetic_field(times, np.array([self.distance_m, 0.0, FLOATS_M]))[:, 0]
        return np.asarray(self.amplifier * self.turns * self.area_m2 * np.diff(field) / step)


@dataclass(frozen=True)
class Camera:
    """Films of the top from above and from the side, followed as `levilab analyze video` does.

    Attributes:
        noise_m: error of a coordinate in a frame [m].
    """

    world: World
    noise_m: float = 1e-4

    def __call__(self, start: float, step: float, n: int) -> Array:
        """Return the places of the top at start + step·k, shape (n, 3) [m]; NaN where none is up."""
        poses = self.world.poses(start, step, n)
        noise = np.random.default_rng((self.world.seed, round(start / step))).standard_normal((n, 3))
        return np.where(poses.up[:, None], poses.position + self.noise_m * noise, np.nan)


def scope_signals(world: World) -> dict[int, Callable[[float, float, int], Array]]:
    """Return the signals of an oscilloscope's channels.

    Channel 1 has the tape's phototransistor, 2 the generator's output, 3 the laser's phototransistor; an oscilloscope
    with two channels does not show the laser.
    """
    drive = lambda start, step, n: world.coil_field(start, step, n) / COIL_T_PER_V  # noqa: E731
    return {1: world.light, 2: drive, 3: world.laser}


def _connect_counter(model: Model, world: World) -> VirtualInstrument:
    return model(world.clock, signal=Light(world), second=world.laser)


def _connect_generator(model: Model, world: World) -> VirtualInstrument:
    return model(world.clock, listener=lambda time, output: world.drive(time, output.times(COIL_T_PER_V)))


def _connect_oscilloscope(model: Model, world: World) -> VirtualInstrument:
    return model(world.clock, signals=scope_signals(world))


def _connect_sound(model: Model, world: World) -> VirtualInstrument:
    return model(world.clock, signals={1: world.light, 2: PickupCoil(world)}, seed=world.seed)


def _connect_magnetometer(model: Model, world: World) -> VirtualInstrument:
    return model(world.clock, flux_density=world.flux_density)


def _connect_phone(model: Model, world: World) -> VirtualInstrument:
    field = lambda times: world.magnetic_field(times, PHONE_M)  # noqa: E731
    return model(world.clock, magnetic_field=field, seed=world.seed)


#: Kind, or scheme of a model's addresses → what connects a virtual instrument to the world: a counter's input 1 to the
#: phototransistor that sees the tape and input 2 to the laser's, a generator's output to the coil (and its trigger
#: input, whose edges the world computes, to the tape's phototransistor), a sound card's left to the tape's
#: phototransistor and right to a pickup coil beside the top, a gaussmeter's probe on the base's axis, a phone beside
#: the base.
_CONNECT: dict[str, Callable[[Model, World], VirtualInstrument]] = {
    "counter": _connect_counter,
    "generator": _connect_generator,
    "oscilloscope": _connect_oscilloscope,
    "sound": _connect_sound,
    "magnetometer": _connect_magnetometer,
    "phyphox": _connect_phone,
}
#: Kind → model → what makes it.
VIRTUAL_MODELS: dict[str, dict[str, Maker]] = {
    kind: {model.name: partial(_CONNECT[model.scheme or kind], model.twin) for model in models}
    for kind, models in CATALOGUE.items()
}


def virtual_bus(world: World | None = None, models: Mapping[str, str] | None = None) -> VirtualBench:
    """Return a virtual bench.

    Args:
        world: by default a top of its own, on a virtual clock.
        models: kind → model, where it differs from VIRTUAL.

    Raises:
        ConfigError: there is no such kind or model.
    """
    world = world or practice_world()
    chosen = virtual_instruments(models)
    return VirtualBench({one.address: VIRTUAL_MODELS[kind][one.model](world) for kind, one in chosen.items()})


def virtual_instruments(models: Mapping[str, str] | None = None) -> dict[str, InstrumentSettings]:
    """Return model and address of each virtual instrument; models, Raises: as of `virtual_bus`."""
    return VIRTUAL | {kind: virtual_settings(kind, model) for kind, model in (models or {}).items()}


def virtual_wiring(world: World, limits: Limits | None = None, models: Mapping[str, str] | None = None) -> Wiring:
    """Return the wiring of a virtual bench.

    Args:
        world: that its instruments measure.
        limits: by default those of a bench file without a table of limits.
        models: kind → model, where it differs from VIRTUAL.

    Raises:
        ConfigError: there is no such kind or model.
    """
    library = library_for(virtual_bus(world, models))
    instruments = virtual_instruments(models)
    signals = dict(zip(("tape", "drive", "laser"), scope_signals(world).values(), strict=True))
    person = VirtualPerson(world)
    return Wiring(
        instruments, limits or Limits(), library, world.clock,
        person=person, poses=world.poses, camera=Camera(world), signals=signals,
    )  # fmt: skip


class VirtualPerson:
    """Carries out, at once, the tasks that change something in the world; all others are answered with nothing."""

    def __init__(self, world: World) -> None:
        self.world = world

    def __call__(self, task: Task) -> str:
        """Carry out a task; returns the answer."""
        match task:
            case FloatTop():
                self.world.float_top(task.number)
            case PlaceProbe():
                self.world.place_probe(task.height_m)
            case ShieldProbe():
                self.world.place_probe(None)
        return ""


#: Time from a fall until the top floats again on a bench for practice [s].
PUT_BACK_AFTER_S = 15.0


def practice_world(clock: Clock | None = None) -> World:
    """Return a world to practise with: its top floats again 15 s after each fall.

    Args:
        clock: by default a virtual one, which jumps.
    """
    return SpinWorld(SpinScene(put_back_after_s=PUT_BACK_AFTER_S), clock or VirtualClock())


def scene_world(
    scene: Scene,
    clock: Callable[[], Clock],
    tell: Callable[[str], None],
    *,
    put_back_after_s: float | None = None,
    seed: int = 0,
) -> MotionWorld:
    """Return a world with the top of a scene in full motion.

    Args:
        scene: with the top that moves.
        clock: makes the clock, once all code is compiled.
        tell: called with a message when code begins to be compiled, and with one when it is.
        put_back_after_s: time from a fall until the top floats again [s]; None: it stays down.
        seed: of the light's noise, and of the place of the tape.

    Raises:
        SceneError: the scene has no motion.
        SimulationError: the scene cannot be simulated.
    """
    from levilab.simulator.compilation import announce_compilation  # the compiler takes a moment to load
    from levilab.world.motion_world import MotionWorld, prepare

    with announce_compilation(tell):
        prepare(scene)
    return MotionWorld(scene, clock(), put_back_after_s=put_back_after_s, seed=seed)
