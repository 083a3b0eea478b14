"""Many independent tasks, done where there is room: in this process, in threads, in processes, on a cluster.

    with contextlib.closing(results_of(function, tasks, processes(4))) as results:
        for done in results:
            ...

`results_of` gives results back as they come and survives workers that die.  Whatever runs the tasks is behind
`concurrent.futures.Executor`, so that `mpi4py.futures` or the executor of a batch system fits (`Workers`).
"""

from levilab.workers.dask import cluster
from levilab.workers.results import Done, results_of
from levilab.workers.ways import Workers, processes, this_process, threads

__all__ = ["Done", "Workers", "cluster", "processes", "results_of", "this_process", "threads"]
