"""Whether a top is locked to its drive: the angle of its body behind the drive must not slip by a turn.

The mean of the spin does not decide it: it is the drive's frequency for a locked top, and nearly that for a top that
slips now and then; and a locked top's spin swings about the drive's, by some tenths of a hertz.  The angle by which
the body turns behind the drive is that of a pendulum: while it swings, it stays within less than one turn; when it
slips, it does not.  The azimuth of the axis does not decide it either: it is not defined at θ = 0.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.simulator.energy import core_spin
from levilab.simulator.kernels.motion import ARM, TIME, N
from levilab.simulator.numbers import copysign
from levilab.simulator.scene import Scene

#: The part of the motion, at its end, in which the top must not slip; before, the drive may still catch it.
LAST_SHARE = 0.5
#: Least duration of that part [s]: slips of 1/SHORTEST_S and faster are distinguished from a lock.
SHORTEST_S = 5.0
#: Share of a motion's length by which the times of its samples are off, at most.
_ROUNDING = 1e-9
#: Samples per second of the angle; between two of them the spin gives the number of turns.
RATE_HZ = 50.0


def can_lock(scene: Scene, until: float = math.inf) -> bool:
    """Return whether there is a drive up to a time [s], and a moment across the axis that it can turn the top by.

    A drive that the top triggers goes with the top, and not the top with it.
    """
    drive = scene.drive
    lasts = drive.off_s is None or drive.off_s >= until
    on = drive.is_periodic and drive.amplitude_t > 0 and lasts
    return scene.observed == "motion" and on and not scene.top.aligned


def body_angle(states: Array) -> Array:
    """Return by how much the body is turned about the vertical, shape (n,) [rad] within ±π.

    It is φ + ψ, the turn about z that remains when the axis is put upright on the shortest way; smooth at θ = 0, where
    neither φ nor ψ is.

    Args:
        states: shape (…, n, 18).
    """
    (x, y, z), (ax, ay, az) = np.moveaxis(states[..., N], -1, 0), np.moveaxis(states[..., ARM], -1, 0)
    return np.asarray(np.arctan2(ay - (y * az - z * ay), ax + (z * ax - x * az)))


def turns_behind(scene: Scene, states: Array) -> Array:
    """Return the angle of the body behind the drive, followed from sample to sample, shape (…, n) [turns].

    Positive where the body is ahead.  From sample to sample the angle changes by what the spin says, give or take half
    a turn.  A drive that swings to and fro turns in either sense; the top goes with the one of its own spin.
    """
    time, sense = states[..., TIME], copysign(1.0, _align(scene.start.spin_hz))
    drive = scene.drive.model_copy(
        update={name: _align(getattr(scene.drive, name)) for name in ("frequency_hz", "ramp_hz_per_s")}
    )
    turning = sense * (drive.frequency_hz + drive.ramp_hz_per_s * time)
    spin = core_spin(states, _align(scene.top.inertia_axial_kg_m2), _align(scene.washers.inertia_kg_m2))
    rate = spin / (2 * math.pi) - turning
    followed = np.zeros(time.shape)
    np.cumsum((rate[..., 1:] + rate[..., :-1]) / 2 * np.diff(time), axis=-1, out=followed[..., 1:])
    seen = body_angle(states) / (2 * math.pi) - sense * drive.turns(time)
    # the angle that is seen is known up to whole turns, the angle that is followed up to small errors, which add up
    off = np.unwrap(seen - followed, period=1.0)
    return np.asarray(sense * (followed + off))


def _align(number: Any) -> Any:
    """Return a number, or one of each top in a shape that goes with their samples."""
    return number[..., None] if isinstance(number, np.ndarray) else number


def keeps_phase(scene: Scene, states: Array) -> NDArray[np.bool_]:
    """Return whether the body stays within one turn behind the drive, in the last part of these samples, shape (…).

    Args:
        scene: of the motion, or with `Numbers` of as many tops as states are of.
        states: shape (…, n, 18), all sampled at the same times.
    """
    time = states[(0,) * (states.ndim - 2)][:, TIME]
    if not can_lock(scene, time[-1]):
        return np.zeros(states.shape[:-2], dtype=np.bool_)
    length = time[-1] - time[0]
    last = states[..., time >= time[-1] - (LAST_SHARE + _ROUNDING) * length, :]
    return np.asarray(np.ptp(turns_behind(scene, last), axis=-1) < 1)


def is_locked(scene: Scene, states: Array, *, survived: bool) -> bool | None:
    """Return whether a top is locked to its drive at the end of its motion.

    Args:
        scene: of the motion.
        states: samples of it, shape (n, 18), RATE_HZ of them per second or so.
        survived: whether it stayed up; a top that is lost is not locked.

    Returns:
        None where the motion is too short to say, or has too few samples, or no drive that could lock the top.
    """
    if not can_lock(scene):
        return None
    if not survived:
        return False
    return bool(keeps_phase(scene, states)) if shows_lock(states[:, TIME]) else None


def shows_lock(time: Array) -> bool:
    """Return whether samples at these times [s], shape (n,), are long and close enough to show a lock."""
    lasted = float(time[-1] - time[0])
    return LAST_SHARE * lasted >= SHORTEST_S * (1 - 1e-9) and len(time) >= lasted * RATE_HZ / 2
