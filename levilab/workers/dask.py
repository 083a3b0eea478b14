"""A Dask cluster that runs already: its scheduler is given, its workers are where they are.

Dask does a dead worker's tasks again on others by itself.  What it would wait for in vain is an error here: a
scheduler that is lost, a cluster without workers, workers that have other software.
"""

from __future__ import annotations

import contextlib
import logging
import time
import warnings
from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from levilab.errors import LevilabError, WorkersLost
from levilab.workers.ways import Workers

if TYPE_CHECKING:
    from collections.abc import Callable

#: How long a scheduler may take to answer when it is first spoken to [s].
ANSWER_S = 10.0
#: How long it may take while it is at work, and a cluster may be without workers [s].
PATIENCE_S = 60.0
#: How often the scheduler is asked for its workers while no result comes [s].
ASK_EVERY_S = 5.0
#: How long this client may take to say goodbye [s].
GOODBYE_S = 0.5


def cluster(scheduler: str, *, patience_s: float = PATIENCE_S) -> Workers:
    """Tasks on the workers of a Dask cluster.

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
            self._client = self._connected()
            self._pool = self._client.get_executor(pure=False)
            self.count = 0
            self._seen_workers = self._asked = time.monotonic()
            self._wait_for_workers()
        except BaseException:
            self._restore_logging()
            raise

    def _connected(self) -> Any:
        try:
            from distributed.client import Client
            from distributed.comm.addressing import get_address_host_port
        except ImportError as error:
            raise LevilabError(
                "a Dask cluster is spoken to by distributed, which is not installed: pip install 'levilab[cluster]'"
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
            # another version of a library that results depend on is an error of its own, when a worker has it
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
            raise self._lost()
        future: Future[Any] = self._pool.submit(function, *arguments, **named)
        return future

    def check(self) -> None:
        """Raise WorkersLost if the scheduler is lost, or has been without workers for long."""
        if self._client.status != "running":
            raise self._lost()
        if time.monotonic() > self._asked + ASK_EVERY_S:
            self._ask()

    def _ask(self) -> None:
        """Ask the scheduler for its workers."""
        try:
            threads = self._client.sync(self._client.scheduler.ncores, callback_timeout=PATIENCE_S)
        except (OSError, TimeoutError) as error:
            raise self._lost() from error
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

    def _lost(self) -> WorkersLost:
        return WorkersLost(
            f"the Dask scheduler at {self._scheduler} is lost, with what was under way: start it and its workers anew"
        )

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: FBT001, FBT002
        """Leave, after all is done if `wait`."""
        if wait and not cancel_futures:
            self._pool.shutdown()
        self.end_at_once()

    def end_at_once(self) -> None:
        """Leave; the scheduler forgets what waits, and the workers end what they do."""
        with contextlib.suppress(OSError, TimeoutError, AssertionError, RuntimeError):
            self._client.close(timeout=GOODBYE_S)
        self._restore_logging()


def _silence() -> Callable[[], None]:
    """Silence Dask's loggers, to which a dead worker or scheduler is worth a traceback.  Returns what undoes it."""
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
