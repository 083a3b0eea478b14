"""A Dask cluster on this machine: a scheduler and workers, each a process that a test may kill."""

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

ON_LOOPBACK = ("--host", "127.0.0.1", "--no-dashboard")


class DaskCluster:
    """Processes that run until the context ends."""

    def __init__(self, workers, *, threads=1):
        self._count, self._threads = workers, threads
        self.processes = []
        self._readers = ThreadPoolExecutor(workers + 10)
        self.address = ""

    def __enter__(self):
        self.scheduler, self.address = self._start("scheduler", "--port", "0", says=r"Scheduler at:\s*(tcp://\S+)")
        for _ in range(self._count):
            self.add_worker()
        return self

    def add_worker(self):
        """Start a worker and wait until the scheduler knows it."""
        words = ("worker", self.address, "--nthreads", str(self._threads), "--no-nanny")
        self._start(*words, says=r"Registered to:\s*(tcp://\S+)")

    def _start(self, *words, says):
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

    def __exit__(self, kind, error, traceback):
        for process in self.processes:
            process.kill()
        self._readers.shutdown()
        for process in self.processes:
            process.communicate()
