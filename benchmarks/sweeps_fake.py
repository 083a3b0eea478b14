"""Stand-ins for the work of a chunk, for `sweeps.py`: worker processes import them from here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.sweeps.quantities import columns_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from levilab.sweeps.plan import Chunk
    from levilab.sweeps.run import Task


def nothing(number: int) -> int:
    return number


def fake_chunk(task: Task[Chunk]) -> dict[str, NDArray[Any]]:
    """Numbers of the right shape and type, without a simulation."""
    rng = np.random.default_rng(task.part.number)
    return {
        column.name: (rng.normal(size=task.part.shape) * 10).astype(column.dtype)
        for column in columns_of(task.plan.observables)
    }
