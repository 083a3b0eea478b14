"""A Dask cluster on this machine: a scheduler and workers, each a process that a test may kill."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from types import TracebackType

ON_LOOPBACK = ("--host", "127.0.0.1", "--no-dashboard")


class DaskCluster:
    """Processes that run until the context ends."""

    def __init__(self, workers: int, *, threads: int = 1) -> None:
        self._count, self._threads = workers, threads
        self.processes: list[subprocess.Popen[str]] = []
        self._readers = ThreadPoolExecutor(workers + 10)
        self.address = ""

    def __enter__(self) -> Self:
        self.scheduler, self.address = self._start("scheduler", "--port", "0", says=r"Scheduler at:\s*(tcp://\S+)")
        for _ in range(self._count):
            self.add_worker()
        return self

    def add_worker(self) -> None:
        """Start a worker and wait until the scheduler knows it."""
        words = ("worker", self.address, "--nthreads", str(self._threads), "--no-nanny")
        self._start(*words, says=r"Registered to:\s*(tcp://\S+)")

    def _start(self, *words: str, says: str) -> tuple[subprocess.Popen[str], str]:
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *words, *ON_LOOPBACK],
            env=environment, stderr=subprocess.PIPE, text=True, encoding="utf-8",
        )  # fmt: skip
        self.processes.append(process)
        assert process.stderr is not None
        seen = ""
        for line in process.stderr:
            seen += line
            if match := re.search(says, line):
                self._readers.submit(process.stderr.read)  # so that it can go on
                return process, match[1]
        raise AssertionError(seen)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        for process in self.processes:
            process.kill()
        self._readers.shutdown()
        for process in self.processes:
            process.communicate()
