"""Tasks are done where there is room, and come back; workers are really killed."""

import contextlib
import functools
import gc
import itertools
import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor

import pytest

from levilab.errors import LevilabError, UsageError, WorkersLost
from levilab.workers import Workers, packing, processes, results, results_of, this_process
from levilab.workers.pool import Pool
from support import tasks
from support.worker_sockets import DEADLINE_S, assert_dead, listening, worker_at_work

THREADS = Workers(lambda: ThreadPoolExecutor(2), 2, elsewhere=False)
WAYS = {"this process": this_process(), "threads": THREADS, "processes": processes(2)}


@pytest.mark.parametrize("name", WAYS)
def test_every_way_gives_back_the_same_bits(name):
    found = {done.task: done.result for done in results_of(tasks.noise, range(20), WAYS[name])}
    assert found == {n: tasks.noise(n) for n in range(20)}


@pytest.mark.parametrize("name", WAYS)
def test_what_a_function_raises_comes_back_with_its_task(name):
    ended = list(results_of(tasks.refuse_seven, range(10), WAYS[name]))
    assert sorted(done.task for done in ended) == list(range(10))
    assert [(done.task, str(done.error)) for done in ended if done.error] == [(7, "seven is refused")]
    assert all(done.result == done.task for done in ended if not done.error)


def test_tasks_are_taken_only_as_they_are_needed():
    taken = []

    def endless():
        for n in itertools.count():
            taken.append(n)
            yield n

    with contextlib.closing(results_of(tasks.square, endless(), THREADS, window=8)) as results:
        assert len(list(itertools.islice(results, 100))) == 100
    assert len(taken) <= 100 + 8


def test_any_executor_of_a_caller_fits():
    own = Workers(lambda: ThreadPoolExecutor(1), count=1)
    assert [done.result for done in results_of(tasks.square, [1, 2, 3], own)] == [1, 4, 9]


def test_an_executor_that_gives_up_its_tasks_ends_the_work():
    class GivesUp(ThreadPoolExecutor):
        def submit(self, *arguments, **named):
            future = super().submit(threading.Event().wait, 0)
            future = type(future)()
            future.cancel()
            return future

    with pytest.raises(WorkersLost, match="the batch jobs gave up their tasks"):
        list(results_of(tasks.square, [1], Workers(GivesUp, name="batch jobs")))


def test_a_worker_ignores_ctrl_c_and_has_one_thread():
    [done] = results_of(tasks.surroundings, [0], processes(1))
    assert done.result == {"interrupted": False, "threads": "1", "main": None}


FIRST = """
from levilab.workers.pool import Apart
from support.tasks import end_with_what_is_blocked
first = Apart(target=end_with_what_is_blocked)
first.start()
first.join()
raise SystemExit(first.exitcode)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no signal is blocked there")
def test_the_first_process_that_is_started_leaves_ctrl_c_to_its_parent_too():
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, "-c", FIRST], env=environment, check=True)


def test_an_error_that_cannot_be_unpickled_keeps_its_words():
    [done] = results_of(tasks.raise_two_words, [0], processes(1))
    assert isinstance(done.error, RuntimeError)
    assert str(done.error) == "TwoWords: one and two"
    assert "tasks.py" in done.error.__notes__[0]


def test_a_function_that_cannot_be_sent_is_refused():
    with pytest.raises(LevilabError, match="a function at the head of a module"):
        list(results_of(lambda task: task, [0], processes(1)))


def test_a_function_of_the_script_that_runs_is_refused(monkeypatch):
    monkeypatch.setattr(tasks.square, "__module__", "__main__")
    with pytest.raises(LevilabError, match="put it into a module"):
        list(results_of(functools.partial(tasks.square), [0], processes(1)))


def test_a_worker_with_other_versions_is_named(monkeypatch):
    here = packing.version_of
    monkeypatch.setattr(packing, "version_of", lambda name: "0.1" if name == "numba" else here(name))
    expected = f"one of the worker processes has numba {here('numba')} instead of 0.1"
    with pytest.raises(WorkersLost, match=expected):
        list(results_of(tasks.square, [0], processes(1)))


def test_a_killed_worker_costs_only_what_was_under_way(tmp_path):
    given = [(n, str(tmp_path)) for n in range(12)]
    found = {done.task[0]: done.result for done in results_of(tasks.die_at_three_once, given, processes(2))}
    assert (tmp_path / "died").exists()
    assert found == {n: tasks.noise(n) for n in range(12)}


def test_a_task_that_kills_its_worker_is_an_error_and_the_others_are_done():
    ended = {done.task: done for done in results_of(tasks.die_at_three, range(8), processes(2))}
    assert isinstance(ended[3].error, WorkersLost)
    assert "each process that does it dies" in str(ended[3].error)
    assert sorted(done.result for done in ended.values() if done.error is None) == [0, 1, 2, 4, 5, 6, 7]


def test_workers_that_always_die_end_the_work():
    with pytest.raises(WorkersLost, match="died 5 times in a row before one gave a result"):
        list(results_of(tasks.die_at_three, [3] * 20, processes(1)))


@pytest.mark.parametrize("forgotten", [1, 2])
def test_futures_that_a_broken_pool_forgets_are_submitted_again(forgotten, monkeypatch):
    monkeypatch.setattr(results, "_END_S", 0.05)
    opened = []

    class Forgetful(ThreadPoolExecutor):
        """The first of them gives no end to the last of its tasks, and says that it is broken when it is asked."""

        def __init__(self):
            super().__init__(1)
            opened.append(self)

        def submit(self, *call):
            self.given = getattr(self, "given", 0) + 1
            return Future() if self is opened[0] and self.given > 2 - forgotten else super().submit(*call)

        def check(self):
            if self is opened[0]:
                raise BrokenExecutor("a process died")

    ways = Workers(Forgetful, 1, elsewhere=False, in_flight=2, check=Forgetful.check)
    found = sorted(done.result for done in results_of(tasks.noise, range(2), ways))
    assert found == sorted(tasks.noise(n) for n in range(2))
    assert len(opened) == 2


def test_a_pool_whose_process_died_says_so_when_it_is_asked():
    with Pool(1) as pool:
        pool.check()
        with pytest.raises(BrokenExecutor):
            pool.submit(tasks.die_at_three, 3).result()
        with pytest.raises(BrokenExecutor):
            pool.check()


def test_ctrl_c_ends_workers_in_the_middle_of_a_task():
    gc.collect()  # the signal would be lost in a destructor that happens to run, as of another test's event loop
    with listening() as server, ThreadPoolExecutor(1) as beside:

        def interrupt():
            with contextlib.ExitStack() as both:
                try:
                    workers = [both.enter_context(worker_at_work(server)) for _ in range(2)]
                finally:  # if they do not come, too: results are waited for
                    signal.raise_signal(signal.SIGINT)
                for worker in workers:
                    assert_dead(worker)

        ended = beside.submit(interrupt)
        results = results_of(tasks.wait_for_ever, [server.getsockname()] * 20, processes(2))
        with pytest.raises(KeyboardInterrupt), contextlib.closing(results):
            next(results)
        ended.result(2 * DEADLINE_S)


PARENT = """
from levilab.workers import processes, results_of
from support.tasks import wait_for_ever
list(results_of(wait_for_ever, [{address}] * 2, processes(2)))
"""


def test_workers_do_not_outlive_a_killed_parent(tmp_path):
    with listening() as server, contextlib.ExitStack() as both:
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        script = tmp_path / "script.py"  # without `if __name__ == "__main__"`
        script.write_text(PARENT.format(address=server.getsockname()), encoding="utf-8")
        with subprocess.Popen([sys.executable, script], env=environment, stderr=subprocess.DEVNULL) as parent:
            try:
                workers = [both.enter_context(worker_at_work(server)) for _ in range(2)]
            finally:
                parent.kill()
        for worker in workers:
            assert_dead(worker)


def test_a_count_of_workers_below_one_is_refused():
    with pytest.raises(UsageError, match="workers = 0"):
        processes(0)
