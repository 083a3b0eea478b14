"""A pool of processes on this machine: Ctrl-C ends them at once, and they end when their parent dies.

On every system they start with a new interpreter ("spawn").  Three things differ from Python's own pool:
they do not run the main script again (one without ``if __name__ == "__main__"`` would break the pool), Ctrl-C is left
to the parent, and each has one thread for linear algebra, because there is a process for each core.
"""

import contextlib
import multiprocessing
import os
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from types import ModuleType

from levilab.interruption import ignore_interruption, interruption_blocked

#: Windows waits for no more handles at once; Python allows no more processes in a pool there.
MAX_PROCESSES = 61 if sys.platform == "win32" else 4096
#: Read by libraries for linear algebra when they are loaded, and by numba.
ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
        "NUMBA_NUM_THREADS",
    ),
    "1",
)  # fmt: skip


class Pool(ProcessPoolExecutor):
    """Processes of this machine."""

    def __init__(self, count: int) -> None:
        super().__init__(count, mp_context=_Context(), initializer=_begin)

    def check(self) -> None:
        """Raise BrokenProcessPool if a process died.

        Until Python 3.12 a future that is submitted at that very moment is never ended, and so never learns it.
        """
        if broken := getattr(self, "_broken", False):  # no public attribute tells it
            raise BrokenProcessPool(str(broken))

    def end_at_once(self) -> None:
        """End all worker processes at once, in the middle of their tasks."""
        self.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            if isinstance(process, _Worker):
                process.kill()


class _Worker(SpawnProcess):
    """A worker process; its environment is set while it is started, and restored in the parent afterwards."""

    def start(self) -> None:
        _start_tracker()
        with _one_thread_each(), _without_main(), interruption_blocked():
            super().start()


class Apart(SpawnProcess):
    """A process for one piece of work beside the pools: it does not run the main script again, and leaves Ctrl-C here.

    On Windows it receives Ctrl-C, too.
    """

    def start(self) -> None:
        """Start it."""
        _start_tracker()
        with _without_main(), interruption_blocked():
            super().start()


class _Context(SpawnContext):
    Process = _Worker


def _start_tracker() -> None:
    """Start Python's tracker of shared memory before Ctrl-C is blocked: its start lets Ctrl-C through."""
    if sys.platform != "win32":
        resource_tracker.ensure_running()


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    """Hide the main script, which the new process would run again to find functions in it."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _begin() -> None:
    ignore_interruption()
    threading.Thread(target=_end_with_the_parent, daemon=True).start()


def _end_with_the_parent() -> None:
    """End this process when the one that started it has died: a pool's worker would wait for tasks for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
