"""A map that is refined along its boundary, in a store: points go out round by round, and each has a mark.

The mark of a point says whether it was computed or filled in.  Marks are written after values, chunk by chunk, so that
what ends the process costs the last points at most; to go on, the refinement is run again from its beginning and finds
its answers in the store.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from levilab.errors import DataError, UsageError
from levilab.files import writing
from levilab.sweeps.observables import OBSERVABLES, columns_of, observe
from levilab.sweeps.refinement import AUDIT, CONFIDENCE, STRIDE, Points, Refined, refine
from levilab.workers import results_of

if TYPE_CHECKING:
    import contextlib
    from collections.abc import Callable, Iterator

    from levilab.sweeps.plan import Plan
    from levilab.sweeps.store import Store
    from levilab.workers import Workers

#: The array of marks, and the attributes: what was asked for, and what came of it.
STATUS, ASKED, FOUND = "status", "adaptive", "refined"
COMPUTED, FILLED = 1, 2
#: Points of a task: enough to fill the lanes; a round is cut into about so many tasks; and no task has more.
FEWEST, MANY, MOST = 64, 64, 4096
#: After so many new points the store is written, or at the end of a round [points].
KEPT = 20_000


@dataclass(frozen=True)
class PointsTask:
    """Some points of a map.

    Attributes:
        plan: without the values of its axes.
        points: flat indices into the map.
        values: key → values at these points, shape (n,).
    """

    plan: Plan
    points: Points
    values: dict[str, NDArray[Any]]


def compute_points(task: PointsTask) -> dict[str, NDArray[Any]]:
    """Observe the points of a task: a function of the task alone, for any process on any machine."""
    return observe(task.plan, task.values)


def begin_adaptive(store: Store, observable: str = "survived", *, stride: int = STRIDE, audit: int = AUDIT) -> None:
    """Make a new store adaptive.

    Args:
        store: nothing is computed in it.
        observable: whose boundary is refined; it must be a yes or no, and the plan must have it.
        stride: of the coarse grid, a power of 2 [points].
        audit: points of each audit.

    Raises:
        UsageError: the plan or the observable does not allow it.
    """
    plan = store.plan
    if plan.is_table:
        raise UsageError("adaptive", "the rows of a table have no neighbours: give axes, FROM:TO:N")
    columns = {column.name: column for column in columns_of(plan.observables)}
    if observable not in columns or columns[observable].dtype != "bool":
        flags = " or ".join(name for name, one in OBSERVABLES.items() if one.dtype == "bool")
        expected = f"a boundary is one of a yes or no: `observe` must have {flags}, and this must be it"
        raise UsageError("adaptive", expected, value=observable)
    if stride < 2 or stride & (stride - 1):
        raise UsageError("stride", "a power of 2 is expected, such as 8", value=stride)
    if audit < 1:
        raise UsageError("audit", "a number of points above 0 is expected", value=audit)
    with writing(f"{store.path}: cannot be written", "free space, or choose another place with `out`"):
        store.group.create_array(
            STATUS,
            shape=plan.shape,
            chunks=plan.chunk,
            dtype="uint8",
            fill_value=0,
            dimension_names=plan.dimensions,
            attributes={"unit": "1", "meaning": f"{COMPUTED}: computed; {FILLED}: filled in from points around; 0: neither"},
        )
        store.group.attrs[ASKED] = {"observable": observable, "stride": stride, "audit": audit}


def is_adaptive(store: Store) -> bool:
    """Whether a store is refined along a boundary."""
    return ASKED in store.group.attrs


def run_adaptive(store: Store, executor: Workers, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Compute what an adaptive store lacks; what is there already is not computed again.

    Returns:
        What was computed and what may have been missed, as `report_of` does.

    Raises:
        CannotWrite: the store cannot be written.
        WorkersLost, SimulationError: points could not be computed.
    """
    asked = store.group.attrs[ASKED]
    run = _Run.of(store, executor, progress)
    refinement = refine(store.plan.shape, stride=asked["stride"], audit=asked["audit"], seed=store.plan.seed)
    answers = None
    while True:
        try:
            question = next(refinement) if answers is None else refinement.send(answers)
        except StopIteration as end:
            return run.finish(end.value)
        answers = run.values_of(question.points, question.until)


@dataclass
class _Run:
    """Values and marks in memory, and where they go."""

    store: Store
    executor: Workers
    progress: Callable[[float], None] | None
    observable: str
    columns: dict[str, NDArray[Any]]
    status: NDArray[np.uint8]
    share: float = 0.0

    @classmethod
    def of(cls, store: Store, executor: Workers, progress: Callable[[float], None] | None) -> _Run:
        columns = {column.name: np.asarray(store.group[column.name][...]) for column in columns_of(store.plan.observables)}
        status = np.asarray(store.group[STATUS][...])
        return cls(store, executor, progress, store.group.attrs[ASKED]["observable"], columns, status)

    def values_of(self, points: Points, until: float) -> NDArray[np.bool_]:
        """Return the values of points, and compute those that are not known."""
        missing = points[self.status.flat[points] != COMPUTED]
        begun, done, unwritten = self.share, 0, []
        with contextlib.closing(results_of(compute_points, self._tasks(missing), self.executor)) as results:
            for one in results:
                if one.error is not None:
                    raise one.error
                for name, values in one.result.items():
                    self.columns[name].flat[one.task.points] = values
                unwritten.append(one.task.points)
                done += one.task.points.size
                if sum(map(len, unwritten)) >= KEPT:
                    self._write(np.concatenate(unwritten))
                    unwritten = []
                self._report(begun + (until - begun) * done / missing.size)
        if unwritten:
            self._write(np.concatenate(unwritten))
        self._report(until)
        return np.asarray(self.columns[self.observable].flat[points], dtype=np.bool_)
