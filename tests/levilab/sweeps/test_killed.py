"""Processes of a sweep are really killed under way: what is in the store stays, and going on gives the same bits."""

from __future__ import annotations

import multiprocessing
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from levilab.errors import WorkersLost
from levilab.simulator.scene import preset
from levilab.sweeps.axes import parse_axis
from levilab.sweeps.plan import Plan
from levilab.sweeps.run import run, with_step
from levilab.sweeps.store import Store
from levilab.workers import cluster, processes
from support.dask_cluster import DaskCluster

if TYPE_CHECKING:
    from pathlib import Path

CHUNKS = 64


@pytest.fixture(scope="module")
def plan() -> Plan:
    axes = parse_axis("start.spin_hz=18:24:16"), parse_axis("top.mass_kg=0.0250:0.0254:8")
    plan = Plan.of(preset("undriven"), axes, ("survived", "lifetime_s", "position_error_m"), 0.3)
    return with_step(replace(plan, chunk=(2, 1)), print)


def bits(store: Store) -> dict[str, bytes]:
    return {name: values.tobytes() for name, values in store.load().values.items()}


def test_killed_workers_and_a_killed_scheduler_change_no_bit(plan: Plan, tmp_path: Path) -> None:
    whole = Store.create(None, plan)
    run(whole)
    store = Store.create(tmp_path / "map.zarr", plan)
    assert plan.chunk_count == CHUNKS

    with DaskCluster(workers=2) as dask:
        scheduler, worker, _ = dask.processes

        def kill_some(share: float) -> None:
            if share == 1 / CHUNKS:
                worker.kill()
            elif share == 3 / CHUNKS:
                scheduler.kill()

        with pytest.raises(WorkersLost, match=f"the Dask scheduler at {dask.address} is lost"):
            run(store, cluster(dask.address), kill_some)

    store = Store.open(tmp_path / "map.zarr", writable=True)
    before = store.done
    assert 3 <= before < CHUNKS
    killed: list[int | None] = []

    def kill_one(share: float) -> None:
        if not killed:
            workers = multiprocessing.active_children()
            killed.append(workers[0].pid)
            workers[0].kill()

    run(store, processes(2), kill_one)
    assert killed
    assert bits(Store.open(tmp_path / "map.zarr")) == bits(whole)
