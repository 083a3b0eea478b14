"""Workers of an existing Dask cluster, whose scheduler has a known address.

Dask submits a dead worker's tasks to other workers by itself.  Where it would wait for ever, an error is raised here:
for a lost scheduler, for a cluster without workers, and for workers with other software.
"""

import contextlib
import logging
import time
import warnings
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path
from typing import Any

from levilab.errors import LevilabError, WorkersLost
from levilab.software import how_to_install
from levilab.workers.ways import Workers

#: Longest time for the first answer of a scheduler [s].
ANSWER_S = 10.0
#: Longest time for a later answer, and for a cluster to be without workers [s].
PATIENCE_S = 60.0
#: Interval between requests for the number of workers while no result comes [s].
ASK_EVERY_S = 5.0
#: Longest time for closing the connection [s].
GOODBYE_S = 0.5


def cluster(scheduler: str, *, patience_s: float = PATIENCE_S) -> Workers:
    """Return workers on a Dask cluster.

    Args:
        scheduler: its address, such as ``tcp://10.0.0.1:8786``, or the file that `dask scheduler --scheduler-file`
            writes.
        patience_s: how long it may be without workers [s].
    """
    return Workers(
        partial(Cluster, scheduler, patience_s),
        count_now=lambda pool: pool.count,
        name=f"workers of the Dask cluster at {scheduler}",
        end_at_once=Cluster.end_at_once,
        check=Cluster.check,
        is_death=lambda error: type(error).__name__ == "KilledWorker",
    )


class Cluster(Executor):
    """A client of a Dask cluster.

    Attributes:
        count: how many tasks its workers do at the same time.
    """

    def __init__(self, scheduler: str, patience_s: float) -> None:
        self._scheduler, self._patience_s = scheduler, patience_s
        self._restore_logging = _silence()
        try:
            self._client = self._connect()
            self._pool = self._client.get_executor(pure=False)
            self.count = 0
            self._seen_workers = self._asked = time.monotonic()
            self._wait_for_workers()
        except BaseException:
            self._restore_logging()
            raise

    def _connect(self) -> Any:
        try:
            from distributed.client import Client
            from distributed.comm.addressing import get_address_host_port
        except ImportError as error:
            raise LevilabError(
                "a Dask cluster needs the extra cluster (distributed, which is not installed): "
                f"{how_to_install('cluster')}"
            ) from error
        is_file = Path(self._scheduler).suffix == ".json"
        if is_file and not Path(self._scheduler).is_file():
            raise LevilabError(f"{self._scheduler}: no such file; `dask scheduler --scheduler-file` writes it")
        place = {"scheduler_file": self._scheduler} if is_file else {"address": self._scheduler}
        if not is_file:  # distributed itself would say so after 20 s, with a traceback
            try:
                get_address_host_port(self._scheduler)
            except ValueError as error:
                expected = "a name with its port is expected, such as tcp://10.0.0.1:8786"
                raise WorkersLost(
                    f"{self._scheduler} is no address of a Dask scheduler ({error}): {expected}"
                ) from error
        try:
            # different versions of libraries that results depend on are an error of `packing`, which names them
            with warnings.catch_warnings(action="ignore"):
                connect: Any = Client
                return connect(**place, timeout=ANSWER_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            text = (
                f"no Dask scheduler answers at {self._scheduler}: start one (`dask scheduler`), or correct the address"
            )
            raise WorkersLost(text) from error

    def _wait_for_workers(self) -> None:
        with contextlib.suppress(TimeoutError):
            self._client.wait_for_workers(1, timeout=max(self._patience_s, 0.01))
        self._ask()

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Submit a task.  Raises WorkersLost if the scheduler is lost."""
        if self._client.status != "running":
            raise self._lost_scheduler()
        future: Future[Any] = self._pool.submit(function, *arguments, **named)
        return future

    def check(self) -> None:
        """Raise WorkersLost if the scheduler is lost, or has been without workers for long."""
        if self._client.status != "running":
            raise self._lost_scheduler()
        if time.monotonic() > self._asked + ASK_EVERY_S:
            self._ask()

    def _ask(self) -> None:
        """Request the number of workers from the scheduler.  Raises WorkersLost."""
        try:
            threads = self._client.sync(self._client.scheduler.ncores, callback_timeout=PATIENCE_S)
        except (OSError, TimeoutError) as error:
            raise self._lost_scheduler() from error
        self._asked = time.monotonic()
        self.count = sum(threads.values())
        if self.count:
            self._seen_workers = self._asked
        elif self._asked >= self._seen_workers + self._patience_s:
            self.end_at_once()
            raise WorkersLost(
                f"the Dask cluster at {self._scheduler} has had no worker for {self._patience_s:g} s: start some "
                f"(`dask worker {self._scheduler}`)"
            )

    def _lost_scheduler(self) -> WorkersLost:
        return WorkersLost(
            f"the Dask scheduler at {self._scheduler} is lost, with the tasks under way: start it and its workers again"
        )

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: FBT001, FBT002
        """Close the connection, if `wait` after all tasks are done."""
        if wait and not cancel_futures:
            self._pool.shutdown()
        self.end_at_once()

    def end_at_once(self) -> None:
        """Close the connection; the scheduler then drops waiting tasks, and workers finish those that they compute."""
        with contextlib.suppress(OSError, TimeoutError, AssertionError, RuntimeError):
            self._client.close(timeout=GOODBYE_S)
        self._restore_logging()


def _silence() -> Callable[[], None]:
    """Silence Dask's loggers, which write a traceback for a dead worker.  Returns a function that undoes it."""
    with contextlib.suppress(ImportError):
        import distributed  # noqa: F401 - gives its loggers their levels
    names = ("distributed", "tornado", "asyncio")
    loggers = [logging.getLogger(name) for name in [*logging.root.manager.loggerDict, *names] if name.startswith(names)]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)

    def restore() -> None:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)

    return restore
