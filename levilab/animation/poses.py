"""A simulated motion → the poses of a span of it, close enough to each other that every turn is seen.

A trajectory has some states a second and, where the moment is aligned, no turn about the axis: the physics does not
depend on it.  So the span is simulated again from the trajectory's state where it begins, with the attitude and as many
states as pictures need.  An aligned moment gets a transverse part of 1e-17, less than the rounding of its axial one:
the motion stays the same and the simulator integrates the turn by its exact flows, so nothing is lost in twisting
frames along the axis' path.  How far both motions agree is the simulator's own error, 1e-7 in place [m] and axis [rad]
(`tests/levilab/motion/test_animation.py`).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from analysis.arrays import Array
from levilab.simulator.kernels.motion import ARM, TIME, N
from levilab.simulator.model import has_attitude, with_attitude
from levilab.simulator.scene import Drive, Scene
from levilab.simulator.single import simulate
from levilab.simulator.trajectory import Trajectory
from levilab.world.pose import quaternions

#: Error of the end of the span, of place [m] and axis [rad].
TOLERANCE = 1e-7


@dataclass(frozen=True)
class Poses:
    """Where the top is at equal intervals of time.

    Attributes:
        scene: what was simulated.
        times: shape (n,) [s].
        positions: of the centre of mass, shape (n, 3) [m].
        quaternions: x, y, z, w of the turn that takes the top's frame (z its axis, x the transverse part of its moment)
            to the base's, shape (n, 4); neighbours have the same sign.
        spins: turns about the axis per second, shape (n,) [Hz].
        slips: how far loose washers have turned on the top since the first pose, shape (n,) [rad].
        drive: the drive's field as a part of its amplitude, shape (n,).
        fell: whether the last pose is that of the fall.
    """

    scene: Scene
    times: Array
    positions: Array
    quaternions: Array
    spins: Array
    slips: Array
    drive: Array
    fell: bool

    @property
    def axes(self) -> Array:
        """The top's axis, shape (n, 3)."""
        return matrices(self.quaternions)[:, :, 2]

    @property
    def tilts(self) -> Array:
        """Angle between the top's axis and the base's, shape (n,) [rad]."""
        axes = self.axes
        return np.asarray(np.arctan2(np.hypot(axes[:, 0], axes[:, 1]), axes[:, 2]))


def poses_of(
    motion: Trajectory, start: float, stop: float, count: int, progress: Callable[[float], None] | None = None
) -> Poses:
    """Simulate a span of a motion again.

    Args:
        motion: the whole of it.
        start: where the span begins [s], from the motion's start on.
        stop: where it ends [s], at most the motion's end.
        count: intervals between poses.
        progress: called with the share that is done.

    Returns:
        One pose more than intervals; fewer if the top falls a moment earlier in the second simulation.

    Raises:
        SimulationError: for what cannot be simulated.
    """
    scene, state = with_attitude(motion.scene), _state_at(motion, start)
    found = simulate(
        scene, stop - start, tolerance=TOLERANCE, rate=count / (stop - start), start=state, progress=progress
    )
    times = start + (stop - start) * np.arange(count + 1) / count
    whole = min(len(found.time), count + 1)
    if whole > 1 and abs(found.time[whole - 1] - times[whole - 1]) > 1e-6 * (stop - start):
        whole -= 1  # the fall, between two poses
    bursts, found = found.bursts, Trajectory(scene, found.states[:whole], found.model, found.accuracy)
    return Poses(
        motion.scene,
        times[:whole],
        found.position,
        quaternions_of(found.states[:, ARM], found.axis),
        found.spin_hz,
        2 * np.pi * found.slips,
        burst_share(bursts, times[:whole]) if len(bursts) else drive_share(scene.drive, times[:whole]),
        fell=motion.fell is not None and stop >= motion.time[-1],
    )


def _state_at(motion: Trajectory, time: float) -> Array:
    """Return the state at a time between two samples, with an arm at right angles to the axis, shape (18,)."""
    scene = with_attitude(motion.scene)
    k = max(int(np.searchsorted(motion.time, time, side="right")) - 1, 0)
    state = motion.states[k].copy()
    if not has_attitude(motion.scene):  # no arm was carried along: any one will do
        state[ARM] = _across(state[ARM], state[N])
    late = time - float(state[TIME])
    if late > 1e-9:
        state = simulate(scene, late, tolerance=TOLERANCE, rate=None, start=state).states[-1].copy()
    state[TIME] = time
    return np.asarray(state)


def _across(arm: Array, axis: Array) -> Array:
    """Return the unit vector at right angles to the axis that is nearest to the arm."""
    for other in (arm, np.array([0.0, 1.0, 0.0])):
        across = other - (other @ axis) * axis
        if (length := float(np.linalg.norm(across))) > 0.1:
            break
    return np.asarray(across / length)


def quaternions_of(arms: Array, axes: Array) -> Array:
    """Return the quaternions (x, y, z, w) of bodies whose x and z axes are these, neighbours of the same sign.

    Args:
        arms: the body's x axis, shape (n, 3).
        axes: its z axis, at right angles to it, shape (n, 3).

    >>> quaternions_of(np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, 0.0, 1.0]])).round(4).tolist()
    [[0.0, 0.0, 0.7071, 0.7071]]
    """
    found = quaternions(axes, arms)
    turns_over = np.sum(found[1:] * found[:-1], axis=1) < 0
    signs = np.concatenate([[1.0], np.where(np.cumsum(turns_over) % 2, -1.0, 1.0)])
    return np.asarray(found * signs[:, None])


#: The drive's waveforms at a phase [rad].
_WAVES: dict[str, Callable[[Array], Array]] = {
    "off": np.zeros_like,
    "triggered": np.zeros_like,  # without a burst
    "sine": np.sin,
    "triangle": lambda phase: 2 / np.pi * np.arcsin(np.sin(phase)),
    "square": lambda phase: np.where(np.sin(phase) >= 0, 1.0, -1.0),
    "unipolar": lambda phase: np.where(np.sin(phase) >= 0, 1.0, 0.0),
}


def drive_share(drive: Drive, times: Array) -> Array:
    """Return the drive's field at times [s] as a part of its amplitude, shape (n,)."""
    share = _WAVES[drive.waveform](2 * np.pi * drive.turns(times) + drive.phase_rad)
    return np.where(times < (math.inf if drive.off_s is None else drive.off_s), share, 0.0)


def burst_share(bursts: Array, times: Array) -> Array:
    """Return the field of bursts, as `Trajectory` has them, at times [s] as a part of its amplitude, shape (n,)."""
    begin, end, frequency, turns = bursts[np.searchsorted(bursts[1:, 0], times, side="right")].T
    there = (times >= begin) & (times <= end)
    return np.where(there, np.sin(2 * np.pi * (frequency * times + turns)), 0.0)


def height_for_camera(poses: Poses) -> float:
    """Return a height that keeps the top in the picture [m], near to its highest: it falls rather than rises."""
    return float(np.quantile(poses.positions[:, 2], 0.9))


def turn_rate(motion: Trajectory) -> float:
    """Return the fastest that a part of the top turns during a motion [Hz]."""
    return float(max(np.abs(motion.spin_hz).max(), np.abs(motion.washer_spin_hz).max()))


def matrices(turns: Array) -> Array:
    """Return quaternions, shape (n, 4), as matrices, shape (n, 3, 3)."""
    return np.asarray(Rotation.from_quat(turns).as_matrix())
