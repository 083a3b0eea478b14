"""Kinds of workers: this process, processes, or any executor of a caller."""

import os
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import partial
from typing import Any

from levilab.errors import UsageError
from levilab.workers.pool import MAX_PROCESSES, Pool


def _cancel(executor: Executor) -> None:
    executor.shutdown(wait=False, cancel_futures=True)


def _nothing_to_check(executor: Executor) -> None:
    pass


def _no_death(_: BaseException) -> bool:
    return False


@dataclass(frozen=True)
class Workers:
    """How an executor is opened and ended.  `Workers(MPIPoolExecutor, count=100)` is an example for a caller's own one.

    Attributes:
        open: opens an executor; called again where one is broken.
        count: how many tasks it does at the same time.
        name: for messages, in the plural.
        elsewhere: tasks are done in other processes, so that function, tasks and results are pickled.
        in_flight: the most tasks that are submitted before a result is waited for; None: the caller decides.
        end_at_once: leaves the executor without waiting for what is under way.
        check: called now and then while no result comes; raises WorkersLost where none will come.
        count_now: asks an open executor for its count, where that may change; None: it stays.
        is_death: whether an error of a future means that the process of the task died while other processes continue.
    """

    open: Callable[[], Executor]
    count: int = 1
    name: str = "workers"
    elsewhere: bool = True
    in_flight: int | None = None
    end_at_once: Callable[[Any], None] = _cancel
    check: Callable[[Any], None] = _nothing_to_check
    count_now: Callable[[Any], int] | None = None
    is_death: Callable[[BaseException], bool] = _no_death

    def count_in(self, executor: Executor) -> int:
        """Return the number of tasks that an open executor does at the same time."""
        return self.count if self.count_now is None else self.count_now(executor)


def this_process() -> Workers:
    """Compute one task after the other in this thread; nothing is started or pickled."""
    return Workers(_InThisThread, name="this process", elsewhere=False, in_flight=1)


def processes(count: int | None = None) -> Workers:
    """Return workers in processes of their own on this machine, started with "spawn" on every system.

    Args:
        count: None: one for each core that this process may use.

    Raises:
        UsageError: the count makes no sense.
    """
    number = min(_count_of(count), MAX_PROCESSES)
    return Workers(partial(Pool, number), number, "worker processes", end_at_once=Pool.end_at_once, check=Pool.check)


def cores() -> int:
    """Return the number of cores that this process may use: a batch system may leave it fewer than there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _count_of(count: int | None) -> int:
    if count is not None and count < 1:
        raise UsageError("workers", "a number from 1 on is expected", value=count)
    return cores() if count is None else count


class _InThisThread(Executor):
    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(function(*arguments, **named))
        return future
