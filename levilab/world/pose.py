"""Where a top is and how it is turned, for a view: no instrument measures that."""

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from levilab.telemetry.messages import Poses

#: Where a top that only spins floats [m above the base].
FLOATS_M = 0.072


def quaternions(axis: Array, arm: Array) -> Array:
    """Return the quaternions that turn z to an axis, and x as near to an arm as is possible.

    Args:
        axis: shape (n, 3), of any length above 0.
        arm: shape (n, 3), not along the axis.

    Returns:
        (x, y, z, w), shape (n, 4), of length 1.

    >>> quaternions(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 1.0, 0.0]])).round(4).tolist()  # a quarter turn
    [[0.0, 0.0, 0.7071, 0.7071]]
    """
    from scipy.spatial.transform import Rotation  # takes a moment to load

    z = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    y = np.cross(z, arm)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.asarray(Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=2)).as_quat())


def poses_of(position: Array, axis: Array, arm: Array, up: NDArray[np.bool_], *, start: float, step: float) -> Poses:
    """Return the poses of a top; see `Poses` and `quaternions`.

    Args:
        position: of the centre of mass, shape (n, 3) [m].
        axis: up the stem, shape (n, 3); 0 where there is no top.
        arm: to the mark on the rim, where the tape is, shape (n, 3).
        up: whether a top floats, shape (n,).
        start: time of the first [s].
        step: from one to the next [s].
    """
    turned = np.zeros((up.size, 4), dtype=np.float32)
    turned[:, 3] = 1.0
    is_there = np.any(axis, axis=1)
    if is_there.any():
        turned[is_there] = quaternions(axis[is_there], arm[is_there])
    return Poses(start, step, np.where(is_there[:, None], position, 0.0).astype(np.float32), turned, up)
