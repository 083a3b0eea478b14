"""Tasks on a Dask cluster whose processes are really killed."""

import contextlib
import logging
import signal
import threading
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from levilab.errors import LevilabError, WorkersLost
from levilab.workers import cluster, results_of
from support import tasks
from support.dask_cluster import DaskCluster
from support.worker_sockets import DEADLINE_S, listening, worker_at_work


def test_a_killed_worker_of_a_cluster_costs_no_bit(tmp_path, capfd):
    given = [(n, str(tmp_path)) for n in range(20)]
    with DaskCluster(workers=2) as dask:
        workers = cluster(dask.address)
        found, speaks = {}, []
        for done in results_of(tasks.die_at_three_once, given, workers):
            found[done.task[0]] = done.result
            speaks.append(logging.getLogger("distributed.client").isEnabledFor(logging.ERROR))
        assert (tmp_path / "died").exists()
        errors = [str(done.error) for done in results_of(tasks.refuse_seven, range(10), workers)]
    assert found == {n: tasks.noise(n) for n in range(20)}
    assert errors.count("seven is refused") == 1
    assert capfd.readouterr().err == ""
    assert not any(speaks)
    assert logging.getLogger("distributed.client").isEnabledFor(logging.ERROR)  # again


def test_a_lost_scheduler_ends_the_work_at_once(capfd):
    with DaskCluster(workers=1, threads=2) as dask, listening() as server, ThreadPoolExecutor(1) as beside:
        some_came = threading.Event()

        def kill_the_scheduler():
            with contextlib.ExitStack() as one:
                try:
                    one.enter_context(worker_at_work(server))
                    assert some_came.wait(DEADLINE_S)
                finally:  # if no worker comes, too: results are waited for
                    dask.scheduler.kill()
                    dask.scheduler.wait()

        killed = beside.submit(kill_the_scheduler)
        given = [None, None, server.getsockname(), None]
        results = results_of(tasks.wait_for_ever, given, cluster(dask.address))
        with contextlib.closing(results):
            assert [next(results).result for _ in range(3)] == [None, None, None]
            some_came.set()
            with pytest.raises(WorkersLost, match=f"the Dask scheduler at {dask.address} is lost"):
                next(results)
        killed.result(2 * DEADLINE_S)
    assert capfd.readouterr().err == ""


def test_ctrl_c_leaves_a_cluster_at_once():
    with DaskCluster(workers=1) as dask, listening() as server, ThreadPoolExecutor(1) as beside:

        def interrupt():
            with contextlib.ExitStack() as one:
                try:
                    one.enter_context(worker_at_work(server))
                finally:  # if it does not come, too: results are waited for
                    signal.raise_signal(signal.SIGINT)
                assert left.result(DEADLINE_S)

        left = Future()
        ended = beside.submit(interrupt)
        results = results_of(tasks.wait_for_ever, [server.getsockname()] * 10, cluster(dask.address))
        with pytest.raises(KeyboardInterrupt), contextlib.closing(results):
            next(results)
        left.set_result(True)  # while the worker is still at work
        ended.result(2 * DEADLINE_S)


def test_a_cluster_without_workers_says_how_to_start_one():
    with DaskCluster(workers=0) as dask, pytest.raises(WorkersLost, match=f"dask worker {dask.address}"):
        list(results_of(tasks.square, [1], cluster(dask.address, patience_s=0)))


@pytest.mark.parametrize("address", ["nowhere.json", "tcp://127.0.0.1:1", "gopher://127.0.0.1:1", "cluster"])
def test_a_wrong_address_of_a_scheduler_is_an_error_in_one_line(address, monkeypatch):
    monkeypatch.setattr("levilab.workers.dask.ANSWER_S", 0.2)
    with pytest.raises(LevilabError) as raised:
        list(results_of(tasks.square, [1], cluster(address)))
    assert address in str(raised.value)
    assert "\n" not in str(raised.value)
