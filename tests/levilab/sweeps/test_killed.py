"""A cluster is really lost in the middle of a sweep: what is in the store stays, and going on gives the same bits."""

import re
from functools import partial

from levilab.sweeps.run import run
from levilab.sweeps.store import Store
from levilab.workers import results_of
from support.commands import command
from support.dask_cluster import DaskCluster
from support.maps import bits

#: A map of 16 chunks.
SWEEP = (
    "sweep", "undriven", "--sweep", "start.spin_hz=18:24:64", "--sweep", "top.mass_kg=0.0250:0.0254:64",
    "--duration", "0.3", "--observe", "survived,lifetime_s,position_error_m", "--out", "map.zarr",
)  # fmt: skip


def test_a_lost_scheduler_keeps_chunks_and_changes_no_bit(tmp_path, monkeypatch):
    """Killed workers, of a cluster and of this machine, are those of tests/levilab/workers."""
    write, written = Store.write, []
    with DaskCluster(workers=1) as dask, monkeypatch.context() as patched:

        def write_and_kill(self, *arguments):
            write(self, *arguments)
            written.append(arguments)
            if len(written) == 3:
                dask.scheduler.kill()

        patched.setattr(Store, "write", write_and_kill)
        # four chunks are under way at most, so that the scheduler dies before all are submitted, however quick they are
        patched.setattr("levilab.sweeps.run.results_of", partial(results_of, window=4))
        ended = command(*SWEEP, "--scheduler", dask.address, cwd=tmp_path)

    line = ended.err.splitlines()[-1]
    lost = rf"levilab: the Dask scheduler at {dask.address} is lost, .*; (\d+) of 16 chunks are kept in map\.zarr; "
    match = re.fullmatch(lost + "go on with: levilab sweep map.zarr --resume", line)
    assert match, ended.err
    assert (ended.status, int(match[1])) == (1, len(written))
    assert 3 <= len(written) < 16
    store = Store.open(tmp_path / "map.zarr", writable=True)
    run(store)
    whole = Store.create(None, store.plan)
    run(whole)
    assert bits(Store.open(tmp_path / "map.zarr")) == bits(whole)
