"""Where a top is and how it is turned, for a view: no instrument measures that."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from levilab.telemetry.messages import Poses

Array = NDArray[np.float64]

#: Where a top that only spins floats [m above the base].
FLOATS_M = 0.072


def quaternions(axis: Array, arm: Array) -> Array:
    """Return the quaternions that turn z to an axis, and x as near to an arm as is possible.

    From the matrix of the three axes by Shepperd's method (J. Guidance and Control 1, 223, 1978): of the four
    components the largest is found first, so no division is by a small number.

    Args:
        axis: shape (n, 3), of any length above 0.
        arm: shape (n, 3), not along the axis.

    Returns:
        (x, y, z, w), shape (n, 4), of length 1.

    >>> quaternions(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 1.0, 0.0]])).round(4).tolist()  # a quarter turn
    [[0.0, 0.0, 0.7071, 0.7071]]
    """
    z = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    y = np.cross(z, arm)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    m = np.stack([np.cross(y, z), y, z], axis=2)  # its columns are the body's axes
    trace = np.trace(m, axis1=1, axis2=2)
    # 4 times the products of two components: q_i q_j, the diagonal 4 q_i²
    diagonal = np.diagonal(m, axis1=1, axis2=2)
    products = np.empty((len(m), 4, 4))
    for i in range(3):
        products[:, i, i] = 1 + 2 * diagonal[:, i] - trace
        j, k = (i + 1) % 3, (i + 2) % 3
        products[:, i, j] = products[:, j, i] = m[:, i, j] + m[:, j, i]
        products[:, i, 3] = products[:, 3, i] = m[:, k, j] - m[:, j, k]
    products[:, 3, 3] = 1 + trace
    largest = np.argmax(np.diagonal(products, axis1=1, axis2=2), axis=1)
    row = products[np.arange(len(m)), largest]
    return np.asarray(row / np.linalg.norm(row, axis=1, keepdims=True))


def poses_of(position: Array, axis: Array, arm: Array, up: NDArray[np.bool_], *, start: float, step: float) -> Poses:
    """Return the poses of a top; see `Poses` and `quaternions`.

    Args:
        position: of the centre of mass, shape (n, 3) [m].
        axis: up the stem, shape (n, 3).
        arm: to the mark on the rim, where the tape is, shape (n, 3).
        up: whether a top floats, shape (n,).
        start: time of the first [s].
        step: from one to the next [s].
    """
    turned = np.zeros((up.size, 4), dtype=np.float32)
    turned[:, 3] = 1.0
    if up.any():
        turned[up] = quaternions(axis[up], arm[up])
    return Poses(start, step, np.where(up[:, None], position, 0.0).astype(np.float32), turned, up)
