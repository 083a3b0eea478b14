"""The results of many independent tasks, as they come."""

import contextlib
import itertools
import queue
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from levilab.errors import WorkersLost
from levilab.workers.packing import Outcome, call_here, call_packer, unpack
from levilab.workers.ways import Workers

T = TypeVar("T")
R = TypeVar("R")

#: The future of a call: an outcome of this process, or the pickled one of a worker.
_Future = Future[Outcome | bytes]

#: A task that was under way in this number of broken pools is computed alone, at the end; if it breaks that one, too,
#: it is an error.
MAX_BREAKS_IN_COMPANY = 2
#: Greatest number of broken pools in a row without a result.
MAX_FRUITLESS_POOLS = 5
#: Interval at which a waiting caller wakes up [s]: on Windows Ctrl-C does not end a wait.
WAKE_UP_S = 0.25
#: Time in which a pool that broke ends its futures [s]; one that it forgets (`Pool.check`) is of a task to start again.
_END_S = 5.0


@dataclass(frozen=True)
class Done(Generic[T, R]):
    """A task that is done.

    Attributes:
        task: as it was given.
        result: what the function returned; None if it failed.
        error: the error of the task, or WorkersLost if the task kills the process that does it; None if it succeeded.
    """

    task: T
    result: R | None = None
    error: Exception | None = None


def results_of(
    function: Callable[[T], R], tasks: Iterable[T], executor: Workers, *, window: int = 64
) -> Generator[Done[T, R]]:
    """Yield the results of tasks as they come, in any order.

    An exception of the function is returned with its task; the other tasks continue.  If a worker process dies, all are
    started again, and only the tasks that were under way are computed again.  A task that was under way whenever
    workers died, the last time alone, is returned as an error.  Ctrl-C ends the tasks under way; so does a caller
    that closes the iterator (`contextlib.closing`), which Python by itself may do late.

    Args:
        function: pure, so that it may be done again; at the head of a module if it is done elsewhere.
        tasks: taken as they are needed; there may be any number.
        executor: where they are done.
        window: how many tasks are submitted at the same time; at least two for each worker.

    Raises:
        WorkersLost: no further results will come.  The tasks given back so far are done.
        LevilabError: function or tasks cannot be sent to another process.

    >>> from levilab.workers import results_of, this_process
    >>> [done.result for done in results_of(abs, [-1, 2, -3], this_process())]
    [1, 2, 3]
    """
    queued = _Queue(iter(tasks))
    call = call_packer(function) if executor.elsewhere else lambda task: (call_here, function, task)
    fruitless = 0
    while True:
        try:
            with _open(executor) as pool:
                for done in _results_of_one_pool(queued, call, pool, executor, window):
                    fruitless = 0
                    yield done
        except BrokenExecutor as error:
            fruitless += 1
            if fruitless == MAX_FRUITLESS_POOLS:
                raise WorkersLost(
                    f"the {executor.name} died {fruitless} times in a row before one gave a result ({error}): "
                    "memory may be short; use fewer `workers` or smaller chunks"
                ) from error
        else:
            return


@contextlib.contextmanager
def _open(executor: Workers) -> Iterator[Executor]:
    pool = executor.open()
    try:
        yield pool
    except BaseException:
        executor.end_at_once(pool)
        raise
    pool.shutdown(wait=True)


@dataclass
class _Attempt(Generic[T]):
    """A task on its way.

    Attributes:
        task: as it was given.
        breaks: how often a pool broke that may have broken by it.
    """

    task: T
    breaks: int = 0

    @property
    def is_to_be_alone(self) -> bool:
        """Whether nothing else may be under way with it, so that it is known what breaks a pool."""
        return self.breaks >= MAX_BREAKS_IN_COMPANY

    @property
    def as_deadly(self) -> Done[T, Any]:
        """The task, done with an error: it kills its worker."""
        return Done(self.task, None, WorkersLost("each process that does it dies: memory may be short"))


@dataclass
class _Queue(Generic[T]):
    """The tasks that are still to be submitted.

    Attributes:
        fresh: those never submitted.
        again: those that were under way when a pool broke.
        alone: those that are to be done alone, after all others.
    """

    fresh: Iterator[T]
    again: deque[_Attempt[T]] = field(default_factory=deque)
    alone: deque[_Attempt[T]] = field(default_factory=deque)

    def next(self, *, nothing_under_way: bool) -> _Attempt[T] | None:
        """Return the next task, or None if there is none, or none yet."""
        if self.again:
            return self.again.popleft()
        for task in itertools.islice(self.fresh, 1):
            return _Attempt(task)
        return self.alone.popleft() if self.alone and nothing_under_way else None

    def put_back(self, attempts: Iterable[_Attempt[T]], suspects: int) -> None:
        """Take back the tasks under way, in the order of submission; one of the first few broke the pool."""
        for place, attempt in enumerate(attempts):
            attempt.breaks += place < suspects
            (self.alone if attempt.is_to_be_alone else self.again).append(attempt)

    def put_aside(self, attempt: _Attempt[T]) -> None:
        """Take back a task whose worker died again and again."""
        attempt.breaks = MAX_BREAKS_IN_COMPANY
        self.alone.append(attempt)


def _results_of_one_pool(
    queued: _Queue[T], call: Callable[[T], tuple[Any, ...]], pool: Executor, executor: Workers, window: int
) -> Iterator[Done[T, Any]]:
    """Yield results until all tasks are done.  Raises BrokenExecutor after all tasks under way are queued again."""
    under_way: dict[_Future, _Attempt[T]] = {}
    ended: queue.SimpleQueue[_Future] = queue.SimpleQueue()
    while True:
        most = executor.in_flight or max(window, 2 * executor.count_in(pool))
        try:
            while len(under_way) < most and (attempt := queued.next(nothing_under_way=not under_way)):
                future = _submit(pool, call, attempt, queued)
                under_way[future] = attempt
                future.add_done_callback(ended.put)
            if not under_way:
                return
            future = _next_of(ended, pool, executor)
            outcome = _outcome_of(future, pool, executor)
        except BrokenExecutor:
            yield from _after_a_break(queued, under_way, pool, executor)
            raise
        attempt = under_way.pop(future)
        if outcome is not None:
            yield Done(attempt.task, outcome.result, outcome.error)
        elif attempt.is_to_be_alone:
            yield attempt.as_deadly
        else:
            queued.put_aside(attempt)


def _submit(pool: Executor, call: Callable[[T], tuple[Any, ...]], attempt: _Attempt[T], queued: _Queue[T]) -> _Future:
    try:
        return pool.submit(*call(attempt.task))
    except BrokenExecutor:
        queued.again.appendleft(attempt)
        raise


def _next_of(ended: queue.SimpleQueue[_Future], pool: Executor, executor: Workers) -> _Future:
    while True:
        try:
            return ended.get(timeout=WAKE_UP_S)
        except queue.Empty:
            executor.check(pool)


def _outcome_of(future: _Future, pool: Executor, executor: Workers) -> Outcome | None:
    """Return the outcome of a future that has ended; None: its worker died, and others are there.

    Raises:
        BrokenExecutor: all workers of the pool died.
        WorkersLost: no further results will come.
    """
    if future.cancelled():
        executor.check(pool)
        raise WorkersLost(f"the {executor.name} gave up their tasks: start them again")
    error = future.exception()
    if error is None:
        outcome = unpack(future.result())
        if outcome.unusable:
            raise WorkersLost(f"one of the {executor.name} {outcome.unusable}: install the same on all machines")
        return outcome
    if executor.is_death(error):
        return None
    if isinstance(error, BrokenExecutor) or not isinstance(error, Exception):
        raise error
    why = f"{type(error).__name__}: {str(error).strip().partition(chr(10))[0]}"
    raise WorkersLost(f"the {executor.name} cannot do the work ({why}): install the same on all machines")


def _after_a_break(
    queued: _Queue[T], under_way: dict[_Future, _Attempt[T]], pool: Executor, executor: Workers
) -> Iterator[Done[T, Any]]:
    """Yield the results from before the pool broke, and queue the other tasks again."""
    lost = []
    wait(under_way, timeout=_END_S)
    for future, attempt in under_way.items():
        try:
            outcome = _outcome_of(future, pool, executor) if future.done() else None
        except BrokenExecutor:
            outcome = None
        if outcome is None:
            lost.append(attempt)
        else:
            yield Done(attempt.task, outcome.result, outcome.error)
    if len(lost) == 1 and lost[0].is_to_be_alone:
        yield lost.pop().as_deadly
    queued.put_back(lost, executor.count_in(pool))
