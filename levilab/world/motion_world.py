"""A world in full motion: the top of a scene under the bench's drive, simulated as far as an instrument needs it.

The phototransistor sees a fixed spot beside the rim, past which the tape goes.  So the light shows the wobble of the
top: a top that stands 1 mm aside shifts the pulse of its tape by a hundredth of a turn.  The stem, as it goes round,
cuts the laser's beam.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from analysis.arrays import Array
from instruments.clock import Clock
from instruments.virtual.counter.edges import Thresholds
from instruments.virtual.generator.channel import Output
from instruments.virtual.generator.voltage import fundamental
from levilab.simulator.field import flux_density
from levilab.simulator.model import base_field
from levilab.simulator.scene import Scene
from levilab.telemetry.messages import Poses
from levilab.world.base import Stand
from levilab.world.bursts import TriggerWire
from levilab.world.coil import Coil
from levilab.world.flight import Flight
from levilab.world.light import Laser, Tape
from levilab.world.magnetic_field import field_beside, moment_of
from levilab.world.pose import poses_of
from levilab.world.spin_world import KEPT_S

#: Where the magnetometer's probe stands at first: about where a top floats [m above the base].
PROBE_M = 0.072

#: A faster drive [Hz] counts as off: it moves no top, but would make the steps short.
_FASTEST_HZ = 1000.0

#: The generator's waveforms that the simulator has, too; any other is replaced by its first harmonic.
_SHAPES = {"SIN": "sine", "SQU": "square", "TRI": "triangle"}


def prepare(scene: Scene) -> None:
    """Compile all code for a scene, which takes some seconds the first time on a machine.

    Raises:
        SceneError: the scene has no motion.
        SimulationError: it cannot be simulated.
    """
    Flight(scene).prepare()


class MotionWorld:
    """The top of a scene, and what instruments see of it; see :class:`levilab.world.spin_world.World`.

    The generator takes the place of the scene's drive, whose direction is the coil's; its offset moves nothing.

    Args:
        scene: with the top that moves.
        clock: of the bench; the top is up from its present time on.
        tape: the tape and its lamp.
        laser: the beam and its amplifier.
        put_back_after_s: see Flight.
        seed: of the light's noise, the probe's place, and the tape's place on the rim; with 0 the tape is where the
            transverse part of the moment points, so a drive that is switched on at a pulse finds the moment there.

    Raises:
        SceneError: the scene has no motion.

    >>> from instruments.clock import VirtualClock
    >>> from levilab.simulator import preset
    >>> world = MotionWorld(preset("tilted"), VirtualClock())
    >>> bright = world.light(0.0, 1e-4, 10_000) > 0.6
    >>> int(np.sum(bright[1:] > bright[:-1]))  # turns in a second
    30
    """

    def __init__(
        self,
        scene: Scene,
        clock: Clock,
        *,
        tape: Tape | None = None,
        laser: Laser | None = None,
        put_back_after_s: float | None = None,
        seed: int = 0,
    ) -> None:
        self.clock = clock
        self._tape, self._laser, self.seed = tape or Tape(), laser or Laser(), seed
        self._scene = scene
        self._wire, self._coil = TriggerWire(), Coil(self._trigger_edges)
        self._flight = Flight(scene, put_back_after_s, start=clock.now(), stem_height_m=self._laser.height_m)
        self._tape_place = _place_of_tape(seed)
        self._last_change = 0.0  # the time of the last change of the drive [s]
        self._lens_height_m = self._flight.first_lift()  # where the lens looks
        self.place_probe(PROBE_M)

    def drive(self, time: float, output: Output) -> None:
        """Set the coil's field from a time on; see World."""
        self._drop_history()
        time = max(time, 0.0)
        self._coil.change(time, output)
        drive = self._drive_keys(time, output)
        if drive["waveform"] != "off" or self._flight.driven or time < self._last_change:
            self._flight.change(time, drive)
            self._last_change = time

    def change_scene(self, values: Mapping[str, Any]) -> None:
        """Change the top or its surroundings now.

        Args:
            values: dotted keys of the scene, and their values; not of its drive.

        Raises:
            SceneError: a value is not allowed.
        """
        self._scene = self._scene.changed(values)
        self._flight.change_scene(self.clock.now(), values)
        self.place_probe(self._probe_m)

    def take_seed(self, seed: int) -> None:
        """Let another seed make the light's noise and the place of the tape, as of the next top."""
        self.seed, self._tape_place = seed, _place_of_tape(seed)

    def float_top(self, number: int) -> None:
        """Put the top back to where the scene starts; see World."""
        self._flight.put_back(self.clock.now())

    def take_top(self) -> None:
        """Take the top out of the air; see World."""
        self._flight.take_away(self.clock.now())

    def catch_up(self) -> None:
        """Simulate up to the present time; see World.  Else one query might have to wait for hours of motion."""
        self._drop_history()
        self._flight.simulate_until(self.clock.now())

    def _drop_history(self) -> None:
        horizon = self.clock.now() - KEPT_S
        self._coil.history.forget(horizon)
        self._flight.forget(horizon)

    def _drive_keys(self, time: float, output: Output) -> dict[str, str | float]:
        """Return the keys of a scene's drive that make this output."""
        shape = "TRI" if (output.waveform, output.symmetry) == ("RAMP", 0.5) else output.waveform
        if output.triggered:
            return self._triggered_keys(output)
        whole = shape in _SHAPES and output.duty == 0.5 and output.burst is None
        amplitude = output.amplitude if whole else fundamental(output)
        if not (amplitude and 0 < output.frequency <= _FASTEST_HZ):
            return {"waveform": "off"}
        turns = self._coil.turns(time) - output.frequency * time + output.phase / 360 + 0.5 * output.inverted
        return {
            "waveform": _SHAPES[shape] if whole else "sine",
            "amplitude_t": amplitude,
            "frequency_hz": output.frequency,
            "phase_rad": 2 * math.pi * (turns % 1.0),
        }

    def _triggered_keys(self, output: Output) -> dict[str, str | float]:
        """Return the keys of bursts that the top triggers: one cycle of the first harmonic, where the edge comes."""
        bursts = output.triggered
        edges = self._wire.thresholds(rising=bursts.rising) if bursts and bursts.cycles == 1 else None
        edge = self._tape.offset(edges, output.frequency) if edges else None
        if bursts is None or edge is None:
            return {"waveform": "off"}
        return {
            "waveform": "triggered",
            "amplitude_t": fundamental(replace(output, amplitude=bursts.amplitude, burst=None)),
            "frequency_hz": output.frequency,
            "phase_rad": math.radians(output.phase + 180 * output.inverted),
            "light_rad": 2 * math.pi * ((0.5 + edge - self._tape_place) % 1.0),
            "latency_s": bursts.delay,
            "cycle_turns": 0.0,
        }

    def light(self, start: float, step: float, n: int) -> Array:
        """Return the phototransistor's voltage; see World."""
        self._drop_history()
        times = start + step * np.arange(n, dtype=np.float64)
        return self._mean_voltage(times) + self._tape.noise_at(times, self.seed)

    def _mean_voltage(self, times: Array) -> Array:
        turns, rate, lift = self._flight.tape(times)
        return self._tape.mean_voltage(
            turns + self._tape_place, rate, times, self._tape.height(lift - self._lens_height_m)
        )

    def crossings(self, start: float, stop: float, triggers: Thresholds) -> Array | None:
        """Return when a trigger fires; see World.  It is when the tape is at a certain place in its turn."""
        self._drop_history()
        margin = 2e-4  # [s]; noise, and a pulse of another height, move a crossing by less
        passed = self._flight.passages(lambda _: (0.5 - self._tape_place) % 1.0, start, stop)
        least = float(self._tape.height(self._flight.tape(passed)[2] - self._lens_height_m).min(initial=1.0))

        def place(rate: float) -> float:
            offset = self._tape.offset(triggers, rate, least)
            without_place.append(offset is None)
            return (0.5 + (offset or 0.0) - self._tape_place) % 1.0

        without_place: list[bool] = []
        near = self._flight.passages(place, start - margin, stop + margin)
        if any(without_place):
            return None
        found = self._tape.crossing_times(near, self._mean_voltage, triggers.fire, self.seed)
        return np.asarray(found[(found >= start) & (found < stop)])

    def _trigger_edges(self, start: float, stop: float, rising: bool) -> Array:  # noqa: FBT001 - as Coil calls it
        """Return the edges at the generator's trigger input."""
        edges = self.crossings(start, stop, self._wire.thresholds(rising=rising))
        return np.empty(0) if edges is None else edges

    def laser(self, start: float, step: float, n: int) -> Array:
        """Return the voltage of the laser's phototransistor; see World."""
        self._drop_history()
        return self._laser.voltage(start + step * np.arange(n, dtype=np.float64), self._flight.stem, self.seed)

    def coil_field(self, start: float, step: float, n: int) -> Array:
        """Return the coil's field; see World."""
        return self._coil.field(start + step * np.arange(n, dtype=np.float64))

    def flux_density(self, time: float) -> float:
        """Return the base's field at the probe; the coil's lies across it, and the top's is left out."""
        return self._probe_t

    def poses(self, start: float, step: float, n: int) -> Poses:
        """Return the top's place and attitude; see World."""
        times = start + step * np.arange(n, dtype=np.float64)
        return poses_of(*self._flight.attitude(times), start=start, step=step)

    def floats(self) -> bool:
        """Return whether the top is up now."""
        return self._flight.floats(self.clock.now())

    def spin_of_fall(self) -> float | None:
        """Return the spin just before the fall of the top that has fallen [Hz]; see `Flight.spin_of_fall`."""
        return self._flight.spin_of_fall(self.clock.now())

    def magnetic_field(self, times: Array, place: Array) -> Array:
        """Return the field of base and top, as the top moves; see World."""
        position, axis, arm, up = self._flight.attitude(times)
        top = self._scene.top
        arm = np.where(up[:, None], arm, 1.0)  # of any length above 0
        moment = moment_of(axis, arm, self._scene.moment, top.moment_tilt)
        ring = self._scene.base.model_copy(update={"strength_t_m": self._scene.strength})
        return field_beside(place, ring, position, moment, up)

    def place_probe(self, height_m: float | None) -> None:
        """Put the probe at a height, to 0.2 mm; see World."""
        self._probe_m = height_m
        stand = Stand(scatter_m=2e-4, seed=self.seed).at(height_m)
        place = np.array([[0.0, 0.0, stand.height_m or 0.0]])
        self._probe_t = 0.0 if height_m is None else float(flux_density(base_field(self._scene), place)[0, 2])


def _place_of_tape(seed: int) -> float:
    """Return where the tape stands on the rim, in turns from the transverse part of the moment."""
    return float(np.random.default_rng(seed).uniform()) if seed else 0.0
