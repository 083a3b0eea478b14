"""Compute a map that is refined along its boundary, round by round, in a store with a mark for each point.

The mark of a point says whether it was computed or filled in.  Marks are written after values, chunk by chunk.  If the
process is killed, at most the last points are lost: to continue, the refinement runs again from its beginning, and the
values in the store answer its questions.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levilab.errors import SimulationError, UsageError, WorkersLost
from levilab.files import writing
from levilab.interruption import interruption_postponed
from levilab.sweeps.axes import first_error
from levilab.sweeps.plan import Plan
from levilab.sweeps.quantities import OBSERVABLES, columns_of, step_in_words
from levilab.sweeps.refinement import (
    AUDIT,
    CONFIDENCE,
    STRIDE,
    Flags,
    Points,
    Refined,
    refine,
)
from levilab.sweeps.run import Task, compute
from levilab.sweeps.store import COMPUTED, DONE, FILLED, STATUS, Store, as_text
from levilab.texts.text import Sentences, Text
from levilab.workers import Done, Workers, results_of

#: Attributes of the store: the settings of the refinement, and its report.
ASKED, FOUND = "adaptive", "refined"
#: Least points of a task, which fill the lanes; tasks of a round, about; most points of a task.
FEWEST, MANY, MOST = 64, 64, 4096
#: The store is written after this number of new points, and at the end of a round.
KEPT = 20_000


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
        expected = f"a boundary lies between yes and no, and this is neither: add {flags} to `observe`"
        raise UsageError("adaptive", expected, value=observable)
    if stride < 2 or stride & (stride - 1):
        raise UsageError("stride", "a power of 2 is expected, such as 8", value=stride)
    if audit < 1:
        raise UsageError("audit", "a number of points above 0 is expected", value=audit)
    with _writing(store):
        store.group.create_array(
            STATUS,
            shape=plan.shape,
            chunks=plan.chunk,
            dtype="uint8",
            fill_value=0,
            dimension_names=plan.dimensions,
            attributes={
                "unit": "1",
                "meaning": f"{COMPUTED}: computed; {FILLED}: filled in from points around; 0: neither",
            },
        )
        store.group.attrs[ASKED] = as_text({"observable": observable, "stride": stride, "audit": audit})


def is_adaptive(store: Store) -> bool:
    """Return whether a store is refined along a boundary."""
    return ASKED in store.group.attrs


def run_adaptive(store: Store, executor: Workers, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Compute the points that an adaptive store lacks.

    Returns:
        What was computed and what may have been missed, as `report_of` does.

    Raises:
        CannotWrite: the store cannot be written.
        WorkersLost, SimulationError: points could not be computed.
    """
    asked, plan = store.attribute(ASKED), store.plan
    run, feed = _Run.of(store, progress), _Feed()
    with contextlib.closing(results_of(compute, feed, executor)) as results:

        def answer(points: Points, until: float) -> Flags:
            run.compute(run.missing(points), until, feed, results)
            return np.asarray(run.columns[asked["observable"]].flat[points], dtype=np.bool_)

        try:
            found = refine(answer, plan.shape, stride=asked["stride"], audit=asked["audit"], seed=plan.seed)
            return run.finish(found)
        finally:
            run.write()


class _Feed:
    """Tasks of one round after another, so that all rounds share one pool.

    It is empty at the end of a round.  `results_of` requests a task again after the caller has taken the last result of
    the round; then the tasks of the next round have been added.
    """

    def __init__(self) -> None:
        self.tasks: deque[Task[Points]] = deque()

    def __iter__(self) -> _Feed:
        return self

    def __next__(self) -> Task[Points]:
        if not self.tasks:
            raise StopIteration
        return self.tasks.popleft()


@dataclass
class _Run:
    """Values and marks in memory, and the store for them.

    Attributes:
        store: where values and marks are kept.
        columns: column → values, in the shape of the map.
        status: of each point.
        progress: called with the share of the work that is done.
        share: of the work.
        unwritten: points that are in memory alone.
    """

    store: Store
    columns: dict[str, NDArray[Any]]
    status: NDArray[np.uint8]
    progress: Callable[[float], None] | None
    share: float = 0.0
    unwritten: list[Points] = field(default_factory=list)

    @classmethod
    def of(cls, store: Store, progress: Callable[[float], None] | None) -> _Run:
        names = [column.name for column in columns_of(store.plan.observables)]
        columns = {name: np.asarray(store.group[name][...]) for name in names}
        return cls(store, columns, np.asarray(store.group[STATUS][...]), progress)

    def missing(self, points: Points) -> Points:
        """Return those of the points that are not computed."""
        return np.asarray(points[self.status.flat[points] != COMPUTED])

    def compute(
        self, points: Points, until: float, feed: _Feed, results: Generator[Done[Task[Points], dict[str, NDArray[Any]]]]
    ) -> None:
        """Compute points, all in one round."""
        feed.tasks.extend(self.tasks_of(points))
        begun, done = self.share, 0
        while done < points.size:
            one = next(results, None)
            if one is None:
                raise WorkersLost("the workers gave fewer results than they had tasks: start them again, and resume")
            self.keep(one)
            done += one.task.part.size
            self.share = max(begun + (until - begun) * done / points.size, begun)
            if self.progress is not None:
                self.progress(self.share)
        self.write()

    def tasks_of(self, points: Points) -> list[Task[Points]]:
        """Cut points into tasks."""
        plan = self.store.plan
        size = min(max(-(-points.size // MANY), FEWEST), MOST)
        return [_task(plan, points[i : i + size]) for i in range(0, points.size, size)]

    def keep(self, done: Done[Task[Points], dict[str, NDArray[Any]]]) -> None:
        """Keep the result of a task in memory, and now and then in the store."""
        if done.error is not None or done.result is None:
            invalid = first_error(self.store.plan.scene, done.task.values)
            raise SimulationError(invalid) if invalid else done.error or AssertionError
        for name, values in done.result.items():
            self.columns[name].flat[done.task.part] = values
        self.status.flat[done.task.part] = COMPUTED
        self.unwritten.append(done.task.part)
        if sum(map(len, self.unwritten)) >= KEPT:
            self.write()

    def write(self) -> None:
        """Write the chunks that hold new points: values first, then marks."""
        if not self.unwritten:
            return
        plan = self.store.plan
        places = np.unravel_index(np.concatenate(self.unwritten), plan.shape)
        blocks = tuple(place // size for place, size in zip(places, plan.chunk, strict=True))
        with _writing(self.store), interruption_postponed():
            for number in np.unique(np.ravel_multi_index(blocks, plan.grid)):
                box = plan.chunk_of(int(number)).box
                for name, values in self.columns.items():
                    self.store.array(name)[box] = values[box]
                self.store.array(STATUS)[box] = self.status[box]
        self.unwritten = []

    def finish(self, found: Refined) -> dict[str, Any]:
        """Fill in what was not computed, and write the report."""
        store, report = self.store, report_of(found)
        self.columns[store.attribute(ASKED)["observable"]][~found.computed] = found.values[~found.computed]
        self.status[~found.computed] = FILLED
        self.unwritten = [np.arange(found.values.size)]
        self.write()
        with _writing(store):
            store.group.attrs[FOUND] = as_text(report)
            store.array(DONE)[...] = 1
        store.marks[...] = 1
        return report


def _writing(store: Store) -> contextlib.AbstractContextManager[None]:
    return writing(f"{store.path}: cannot be written", "free space, then go on with `resume`")


def _task(plan: Plan, points: Points) -> Task[Points]:
    places = np.unravel_index(points, plan.shape)
    values = {axis.key: axis.values[place] for axis, place in zip(plan.axes, places, strict=True)}
    return Task(plan.without_values(), points, values)


def report_of(found: Refined) -> dict[str, Any]:
    """Return how much a refinement saved, and what it may have missed."""
    return {
        "points": found.values.size,
        "computed": found.values.size - found.filled,
        "filled": found.filled,
        "saved": found.saved,
        "strides": list(found.strides),
        "audits": [vars(one) for one in found.audits],
        "confidence": CONFIDENCE,
        "most_wrong": found.most_wrong,
        "most_wrong_share": found.most_wrong_share,
    }


def in_words(report: dict[str, Any], plan: Plan) -> list[str]:
    """Return the report as sentences."""
    *_, judge = report["audits"]
    wrong = sum(audit["wrong"] for audit in report["audits"])
    count = sum(audit["computed"] for audit in report["audits"])
    sides = (
        step_in_words(axis.key, axis.values, stride, logarithmic=axis.scale == "log")
        for stride, axis in zip(report["strides"], plan.axes, strict=True)
    )
    return [
        Text(
            "{computed} of {points} points were computed, {share:.0f} % were filled in.",
            computed=report["computed"], points=report["points"], share=100 * report["saved"],
        ),
        Text(
            "{count} points that were filled in were checked at random, {wrong} of them wrong{then}.",
            count=count, wrong=wrong, then=", and their surroundings were computed" if wrong else "",
        ),
        Text(
            "With {confidence:.0f} % confidence at most {most} ({limit:n} %) of the {filled} filled in are wrong: "
            "{wrong} of {computed} were in the last check.",
            confidence=100 * report["confidence"], most=report["most_wrong"],
            limit=f"{100 * report['most_wrong_share']:.2g}", filled=report["filled"], wrong=judge["wrong"],
            computed=judge["computed"],
        ),
        Text(
            "An island that holds a box of {size} is sure to be seen, a smaller one by chance alone.",
            size=Sentences(*sides, between=" × "),
        ),
    ]  # fmt: skip


def report_in(store: Store) -> dict[str, Any] | None:
    """Return the report of an adaptive store that is complete; None of any other."""
    found: dict[str, Any] | None = store.attribute(FOUND)
    return found
