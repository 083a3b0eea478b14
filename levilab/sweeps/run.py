"""Run a sweep: workers compute chunks in any order, and this process writes each result as it comes."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from numpy.typing import NDArray

from levilab.errors import LevilabError
from levilab.interruption import interruption_postponed
from levilab.simulator.compilation import announce_compilation
from levilab.simulator.ensemble import grid, simulate_many, step_share_of
from levilab.sweeps.axes import first_error
from levilab.sweeps.observables import observe, seconds_per_point
from levilab.sweeps.plan import Chunk, Plan
from levilab.sweeps.store import Store
from levilab.workers import Workers, cluster, processes, results_of, this_process
from levilab.workers.ways import cores as available_cores

#: A plan that one core computes in this time [s] is computed without starting other processes.
QUICK_S = 4.0
#: A sweep ends after this number of failed chunks: the others would probably fail, too.
MOST_FAILURES = 20
#: Duration that is simulated in order to compile the kernels before workers need them [s].
_FIRST_S = 1e-3


Part = TypeVar("Part")


class ChunksFailed(LevilabError):
    """Some chunks could not be computed."""


@dataclass(frozen=True)
class Task(Generic[Part]):
    """Part of a map with all that a worker needs for it.

    Attributes:
        plan: without the values of its axes.
        part: a chunk, or flat indices of points.
        values: key → values at its points.
    """

    plan: Plan
    part: Part
    values: dict[str, NDArray[Any]]


def compute(task: Task[Any]) -> dict[str, NDArray[Any]]:
    """Observe the points of a task: a function of the task alone, for any process on any machine."""
    return observe(task.plan, task.values)


def with_step(plan: Plan, message: Callable[[str], None]) -> Plan:
    """Return the plan with the step of all its motions, chosen on some of them.

    Args:
        plan: without a step.
        message: called with a line before something that takes a moment.

    Raises:
        SceneError, SimulationError: some of the points cannot be simulated.
    """
    with announce_compilation(message):
        with interruption_postponed():  # a compilation would lose it
            first = {axis.key: axis.values[:1] for axis in plan.axes}
            step_share_of(plan.scene, first, min(_FIRST_S, plan.duration_s), tolerance=plan.tolerance)
        values = {axis.key: axis.values for axis in plan.axes}
        over = values if plan.is_table else grid(values)
        share = step_share_of(plan.scene, over, plan.duration_s, tolerance=plan.tolerance, survivors_only=True)
        return replace(plan, step_share=share)


def compile_for(plan: Plan) -> None:
    """Compile the kernels of a plan's first point: workers find them on the disk, and need not all compile them."""
    values = {axis.key: axis.values[:1] for axis in plan.axes}
    with interruption_postponed():
        simulate_many(plan.scene, values, min(_FIRST_S, plan.duration_s), step=_FIRST_S, errors=False, cores=1)


def tasks_of(store: Store) -> Iterator[Task[Chunk]]:
    """Yield the tasks that are left; each is made when it is requested."""
    light = store.plan.without_values()
    return (Task(light, chunk, store.plan.values_of(chunk)) for chunk in store.missing())


def workers_for(plan: Plan, count: int | None = None, scheduler: str | None = None) -> Workers:
    """Return the workers for a plan: a cluster, this process if that is quick enough, else several processes.

    Args:
        plan: decides whether other processes are worth their start.
        count: of processes on this machine; None: one for each core.
        scheduler: address of a Dask cluster; None: on this machine.
    """
    if scheduler is not None:
        return cluster(scheduler)
    most = min(count or available_cores(), plan.chunk_count)
    quick = plan.size * seconds_per_point(plan) < QUICK_S
    return this_process() if quick or most == 1 else processes(most)


def run(store: Store, workers: Workers | None = None, progress: Callable[[float], None] | None = None) -> None:
    """Compute what is missing in a store.

    Args:
        store: takes the results, chunk by chunk.
        workers: compute them; None: this process.
        progress: called with the share of the chunks that are done.

    Raises:
        ChunksFailed: some could not be computed; the others are done.
        CannotWrite, WorkersLost: what is done so far is in the store.
    """
    failed: list[tuple[Task[Chunk], Exception]] = []
    with contextlib.closing(results_of(compute, tasks_of(store), workers or this_process())) as results:
        for done in results:
            if done.result is not None:
                with interruption_postponed():
                    store.write(done.task.part, done.result)
                if progress is not None:
                    progress(store.done / store.plan.chunk_count)
            elif isinstance(done.error, LevilabError):
                failed.append((done.task, done.error))
                if len(failed) == MOST_FAILURES:
                    break
            elif done.error is not None:  # a defect of this program
                raise done.error
    if failed:
        raise ChunksFailed(_why(failed, store.plan))


def _why(failed: list[tuple[Task[Chunk], Exception]], plan: Plan) -> str:
    task, error = failed[0]
    first, last = task.part.start, tuple(k - 1 for k in task.part.stop)
    ends = [plan.point(index) for index in (first, last)]
    where = ", ".join(f"{key} from {ends[0][key]} to {ends[1][key]}" for key in ends[0])
    count = f"{len(failed)} of {plan.chunk_count} chunks" if len(failed) > 1 else "a chunk"
    reason = first_error(plan.scene, task.values) or str(error)
    return f"{count} could not be computed, the first of {where}: {reason}; `resume` tries again"
