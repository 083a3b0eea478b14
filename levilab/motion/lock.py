"""Whether a top is locked to its drive: the angle of its body behind the drive must not slip by a turn.

The mean of the spin does not decide it: it is the drive's frequency for a locked top, and nearly that for a top that
slips now and then; and a locked top's spin swings about the drive's, by some tenths of a hertz.  The angle by which
the body turns behind the drive is that of a pendulum: while it swings, it stays within less than one turn; when it
slips, it does not.  The azimuth of the axis does not decide it either: it is not defined at θ = 0.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from levilab.simulator.energy import spin_of
from levilab.simulator.kernels.motion import ARM, TIME, N

if TYPE_CHECKING:
    from levilab.simulator.scene import Scene

Array = NDArray[np.float64]

#: The part of the motion, at its end, in which the top must not slip; before, the drive may still catch it.
LAST_SHARE = 0.5
#: Least duration of that part [s]: slips of 1/SHORTEST_S and faster are distinguished from a lock.
SHORTEST_S = 5.0
#: Samples per second of the angle; between two of them the spin gives the number of turns.
RATE_HZ = 50.0


def can_lock(scene: Scene, until: float = math.inf) -> bool:
    """Whether there is a drive up to a time [s], and a moment across the axis that it can turn the top by."""
    drive = scene.drive
    lasts = drive.off_s is None or drive.off_s >= until
    on = drive.waveform != "off" and drive.amplitude_t > 0 and lasts
    return scene.observed == "motion" and on and not scene.top.aligned


def body_angle(states: Array) -> Array:
    """Return by how much the body is turned about the vertical, shape (n,) [rad] within ±π.

    It is φ + ψ, the turn about z that remains when the axis is put upright on the shortest way; smooth at θ = 0, where
    neither φ nor ψ is.

    Args:
        states: shape (n, 18).
    """
    arm, third = states[:, ARM], np.cross(states[:, N], states[:, ARM])
    return np.asarray(np.arctan2(arm[:, 1] - third[:, 0], arm[:, 0] + third[:, 1]))


def turns_behind(scene: Scene, states: Array) -> Array:
    """Return the angle of the body behind the drive, followed from sample to sample, shape (n,) [turns].

    Positive where the body is ahead.  From sample to sample the angle changes by what the spin says, give or take half
    a turn.  A drive that swings to and fro turns in either sense; the top goes with the one of its own spin.
    """
    time, sense = states[:, TIME], math.copysign(1.0, scene.start.spin_hz)
    rate = spin_of(scene, states) / (2 * math.pi) - sense * scene.drive.frequency_hz
    followed = np.append(0.0, np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(time)))
    seen = body_angle(states) / (2 * math.pi) - sense * scene.drive.frequency_hz * time
    # the angle that is seen is known up to whole turns, the angle that is followed up to small errors, which add up
    off = np.unwrap(seen - followed, period=1.0)
    return np.asarray(sense * (followed + off))


def keeps_phase(scene: Scene, states: Array) -> bool:
    """Whether the body stays within one turn behind the drive, in the last part of these samples."""
    end = states[-1, TIME]
    last = states[states[:, TIME] >= end - LAST_SHARE * (end - states[0, TIME])]
    return bool(can_lock(scene, end) and np.ptp(turns_behind(scene, last)) < 1)


def is_locked(scene: Scene, states: Array, *, survived: bool) -> bool | None:
    """Whether a top is locked to its drive at the end of its motion.

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
    lasted = float(states[-1, TIME] - states[0, TIME])
    if LAST_SHARE * lasted < SHORTEST_S * (1 - 1e-9) or len(states) < lasted * RATE_HZ / 2:
        return None
    return keeps_phase(scene, states)
