"""Compute many independent tasks: in this process, in processes, or on a cluster.

    with contextlib.closing(results_of(function, tasks, processes(4))) as results:
        for done in results:
            ...

`results_of` yields results as they come and survives workers that die.  All executors have the interface of
`concurrent.futures.Executor`, so that `mpi4py.futures` or the executor of a batch system fits (`Workers`).
"""

from levilab.workers.dask import cluster
from levilab.workers.results import Done, results_of
from levilab.workers.ways import Workers, processes, this_process

__all__ = ["Done", "Workers", "cluster", "processes", "results_of", "this_process"]
