"""The run of a sweep: chunks go out, results come back in any order, and each is written as it comes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from levilab.sweeps.observables import observe

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from levilab.sweeps.plan import Chunk, Plan
    from levilab.sweeps.store import Store


@dataclass(frozen=True)
class Task:
    """One chunk with all that a worker needs for it.

    Attributes:
        plan: without the values of its axes.
        chunk: which part of the map it is.
        values: key → values at its points.
    """

    plan: Plan
    chunk: Chunk
    values: dict[str, NDArray[Any]]


def compute(task: Task) -> dict[str, NDArray[Any]]:
    """Observe the points of a task: a function of the task alone, for any process on any machine."""
    return observe(task.plan, task.values)


def tasks_of(store: Store) -> Iterator[Task]:
    """Yield the tasks that are left, made as they are asked for."""
    light = store.plan.without_values()
    return (Task(light, chunk, store.plan.values_of(chunk)) for chunk in store.missing())


def run(store: Store, progress: Callable[[float], None] | None = None) -> None:
    """Compute what is missing in a store."""
    for task in tasks_of(store):
        store.write(task.chunk, compute(task))
        if progress is not None:
            progress(store.done / store.plan.chunk_count)
