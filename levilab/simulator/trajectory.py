"""What a simulation gives: the motion as arrays, how it ended, and how good it is."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from analysis.arrays import Array
from levilab.simulator.energy import energy, spin_of
from levilab.simulator.kernels.motion import LOOSE, TIME, L, Model, N, R, V
from levilab.simulator.scene import Scene


@dataclass(frozen=True)
class Event:
    """Something that happened: its name, when [s], and the state then, shape (18,)."""

    name: str
    time: float
    state: Array


@dataclass(frozen=True)
class Accuracy:
    """How good the end of a trajectory is.

    A chaotic motion has errors as large as the motion itself whatever the step: then `reached` is False and the
    estimate says so.

    Attributes:
        position: estimated error of the last state, made to bound the true one [m].
        axis: likewise [rad].
        tolerance: what was asked for.
        scheme: by which it was integrated.
        step: of the integrator [s].
        steps: how many.
        nodes: the larger of both errors as far as the nodes of a magnet of finite size make it, which are enough where
            the top starts, and not at the base.
        tries: how many times all of the motion was integrated, each time at another step, until this was the result;
            runs that serve the estimate alone are not counted.
    """

    position: float
    axis: float
    tolerance: float
    scheme: str
    step: float
    steps: int
    nodes: float = 0.0
    tries: int = 1

    @property
    def reached(self) -> bool:
        """Whether the estimated errors are within the tolerance."""
        return bool(max(self.position, self.axis) <= self.tolerance)


@dataclass(frozen=True)
class Trajectory:
    """The motion of one top, in the base's frame: origin at the base's centre, z up its axis.

    Attributes:
        scene: what was simulated.
        states: shape (n, 18), see `kernels.motion.State`.
        model: what the kernels computed.
        fell: the escape that ended it, None if it stayed to the end.
        events: found on the way, in their order.
        bursts: of a drive that the top triggers, in pieces, shape (n, 4): begin and end [s], frequency f [Hz] and phase
            p [turns] of the field amplitude_t·sin(2π(f t + p)).
        memory: of such a drive at the end, with the burst under way, for a motion that goes on from there.
    """

    scene: Scene
    states: Array
    model: Model
    accuracy: Accuracy
    fell: Event | None = None
    events: tuple[Event, ...] = ()
    bursts: Array = field(default_factory=lambda: np.empty((0, 4)))
    memory: Array | None = None

    def __repr__(self) -> str:
        name, end = self.scene.name or "a scene", float(self.time[-1])
        how = "up to the end" if self.fell is None else f"lost at the limit of its {self.fell.name}"
        return f"<{type(self).__name__} of {name}: {len(self.time)} states in {end:.4g} s, {how}>"

    @cached_property
    def energies(self) -> Array:
        """Energy without the drive's part, shape (n,) [J]."""
        return energy(self.scene, self.model, self.states)

    @property
    def time(self) -> Array:
        """Shape (n,) [s]; the last one is the end, or the moment of the fall."""
        return self.states[:, TIME]

    @property
    def position(self) -> Array:
        """Place of the centre of mass, shape (n, 3) [m]."""
        return self.states[:, R]

    @property
    def velocity(self) -> Array:
        """Shape (n, 3) [m/s]."""
        return self.states[:, V]

    @property
    def axis(self) -> Array:
        """The top's axis, a unit vector, shape (n, 3)."""
        return self.states[:, N]

    @property
    def angular_momentum(self) -> Array:
        """Shape (n, 3) [kg m²/s]."""
        return self.states[:, L]

    @property
    def tilt(self) -> Array:
        """Angle between the top's axis and the base's, shape (n,) [rad]; exact for small angles, too."""
        return np.asarray(np.arctan2(np.hypot(self.axis[:, 0], self.axis[:, 1]), self.axis[:, 2]))

    @property
    def spin_hz(self) -> Array:
        """ω₃/2π, shape (n,) [Hz]; with loose washers that of the core, which carries the magnet."""
        return spin_of(self.scene, self.states) / (2 * np.pi)

    @property
    def washer_spin_hz(self) -> Array:
        """Spin of the loose washers, shape (n,) [Hz]; that of the top where none are loose."""
        inertia = self.scene.washers.inertia_kg_m2
        return self.states[:, LOOSE] / (2 * np.pi * inertia) if inertia else self.spin_hz

    @property
    def slips(self) -> Array:
        """Turns of loose washers relative to the top since the first state, shape (n,); 0 where none are loose.

        They are negative, for washers turn more slowly.  By the trapezium rule, since the slip changes within seconds.
        """
        rates = self.washer_spin_hz - self.spin_hz
        return np.concatenate([[0.0], np.cumsum(np.diff(self.time) * (rates[1:] + rates[:-1]) / 2)])

    @property
    def survived(self) -> bool:
        """Whether the top was still up at the end."""
        return self.fell is None
