"""How fast sweeps are, on one core, on two, and over a local Dask cluster, and what they need besides.

    python benchmarks/sweeps.py            # about 4 minutes on two free cores; writes results/sweeps.json
    python benchmarks/sweeps.py --brief    # with maps of a ninth of the points

- Speed: the map spin × mass of the thesis's top over 30 s, its points × simulated seconds (fallen tops count until
  they fall) per wall second and core; likewise with samples on the way.  From the first result to the last, so that the
  start of the workers, given beside it, does not count.
- Overhead: tasks that do nothing, what one costs on the wall and in the parent's processor time.
- Memory: the parent's peak while it writes maps of 1e4, 1e6 and 1e7 points whose chunks are made up, not simulated, by
  two workers; and what writing a chunk takes.

`sweeps_on_paper.py` computes from these numbers what a thousand million points take.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import psutil

import sweeps_fake
from levilab.benchmark.found import processor
from levilab.simulator import preset
from levilab.sweeps.axes import parse_axis
from levilab.sweeps.observables import cut
from levilab.sweeps.plan import Plan
from levilab.sweeps.run import compile_for, compute, tasks_of, with_step
from levilab.sweeps.store import Store
from levilab.workers import Workers, cluster, processes, results_of, this_process

if TYPE_CHECKING:
    from collections.abc import Iterator

RESULTS = Path(__file__).parent / "results" / "sweeps.json"
#: Points of the map along each axis, and seconds of motion, by what is observed.
MAPS = {
    "ends": (("survived", "lifetime_s"), 96, 30.0),
    "ends and errors": (("survived", "lifetime_s", "position_error_m"), 64, 30.0),
    "samples": (("lifetime_s", "height_spread_m"), 40, 30.0),
}
CHUNKS = 32
#: Tasks that do nothing.
EMPTY_TASKS = 2000
#: Points of the maps that are written.
WRITTEN = (10_000, 1_000_000, 10_000_000)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brief", action="store_true", help="a tenth of the work")
    parser.add_argument("--memory-of", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.memory_of:
        print(json.dumps(write_a_map(options.memory_of)))
        return
    begun = time.perf_counter()
    with dask_cluster(2) as address:
        ways = {
            "this process": this_process(), "1 process": processes(1),
            "2 threads": Workers(partial(ThreadPoolExecutor, 2), 2, elsewhere=False),
            "2 processes": processes(2), "Dask, 2 workers": cluster(address),
        }  # fmt: skip
        found: dict[str, Any] = {"machine": {"processor": processor(), "cores": os.cpu_count()}, "brief": options.brief}
        found["speed"] = {name: speed_of(name, ways, brief=options.brief) for name in MAPS}
        found["overhead"] = {way: overhead_of(workers, brief=options.brief) for way, workers in ways.items()}
    found["memory"] = [memory_of(points) for points in WRITTEN]
    found["took_s"] = round(time.perf_counter() - begun, 1)
    print(f"took {found['took_s']} s")
    RESULTS.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")


@contextlib.contextmanager
def dask_cluster(workers: int) -> Iterator[str]:
    """A cluster on this machine, as `dask scheduler` and `dask worker` make one.  Yields the scheduler's address."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as local:
        yield local.scheduler_address


def plan_of(name: str, *, brief: bool) -> Plan:
    observables, points, duration_s = MAPS[name]
    if brief:
        points //= 3
    axes = (
        parse_axis(f"start.spin_hz=18:90:{points}"),
        parse_axis(f"top.mass_kg=0.0247:0.0255:{points}"),
    )
    plan = Plan(preset("undriven"), axes, observables, duration_s)
    return with_step(replace(plan, chunk=(points, max(points // CHUNKS, 1))), print)


def speed_of(name: str, ways: dict[str, Workers], *, brief: bool) -> dict[str, Any]:
    plan = plan_of(name, brief=brief)
    store = Store.create(None, plan)
    compile_for(plan)
    tasks = list(tasks_of(store))
    rows = {}
    for way, workers in ways.items():
        begun, cpu, ends, seconds, survived = time.perf_counter(), time.process_time(), [], [], 0
        for done in results_of(compute, tasks, workers):
            if done.result is None:
                raise done.error or AssertionError
            ends.append(time.perf_counter())
            lasted = done.result["lifetime_s"]
            survived += int(np.count_nonzero(np.isnan(lasted)))
            seconds.append(float(np.nansum(lasted) + np.count_nonzero(np.isnan(lasted)) * plan.duration_s))
        rows[way] = {
            "cores": 1 if "process" in way.split() else 2,
            "first_result_s": round(ends[0] - begun, 3),
            "wall_s": round(ends[-1] - begun, 3),
            "parent_cpu_s": round(time.process_time() - cpu, 3),
            # the results that came with the first one, in the same moment, are not counted
            "top_seconds_per_second": round(sum(seconds[1:]) / (ends[-1] - ends[0])),
        }
        rows[way]["per_core"] = round(rows[way]["top_seconds_per_second"] / rows[way]["cores"])
        print(f"{name}, {way}: {rows[way]}", flush=True)
    return {
        "points": plan.size,
        "chunks": plan.chunk_count,
        "survived": survived,
        "top_seconds": round(sum(seconds)),
        "observables": list(plan.observables),
        "duration_s": plan.duration_s,
        "ways": rows,
    }


def overhead_of(workers: Workers, *, brief: bool) -> dict[str, float]:
    """Return what a task costs that does nothing [s], once all workers are there."""
    count = EMPTY_TASKS // (10 if brief else 1)
    with contextlib.closing(results_of(sweeps_fake.nothing, range(count), workers)) as results:
        for _ in range(count // 5):
            next(results)
        wall, cpu = time.perf_counter(), time.process_time()
        rest = sum(1 for _ in results)
        row = {
            "wall_s": (time.perf_counter() - wall) / rest,
            "parent_cpu_s": (time.process_time() - cpu) / rest,
        }
    print(f"a task that does nothing, {workers.name}: {row}", flush=True)
    return row


def memory_of(points: int) -> dict[str, Any]:
    """Return the peak of a process that writes a map [MB], in a process of its own."""
    answer = subprocess.run(
        [sys.executable, __file__, "--memory-of", str(points)], check=True, stdout=subprocess.PIPE, encoding="utf-8"
    )
    row: dict[str, Any] = json.loads(answer.stdout)
    print(f"a map of {points} points: {row}", flush=True)
    return row


def write_a_map(points: int) -> dict[str, Any]:
    side = round(points**0.5)
    axes = parse_axis(f"start.spin_hz=18:90:{side}"), parse_axis(f"top.mass_kg=0.0247:0.0255:{side}")
    plan = with_step(cut(Plan(preset("undriven"), axes, ("survived", "lifetime_s", "fall_spin_hz"), 30.0)), str)
    writing, peak, results = 0.0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        store = Store.create(Path(folder, "map.zarr"), plan)
        begun, cpu = time.perf_counter(), time.process_time()
        for done in results_of(sweeps_fake.fake_chunk, tasks_of(store), processes(2)):
            assert done.result is not None, done.error
            at = time.perf_counter()
            store.write(done.task.chunk, done.result)
            writing += time.perf_counter() - at
            results += sum(values.nbytes for values in done.result.values())
            peak, task = max(peak, psutil.Process().memory_info().rss), done.task
        wall, cpu = time.perf_counter() - begun, time.process_time() - cpu
        files = [path.stat().st_size for path in Path(folder).rglob("*") if path.is_file()]
    return {
        "points": plan.size,
        "chunks": plan.chunk_count,
        "columns": len(plan.observables),
        "task_bytes": len(pickle.dumps(task)),
        "peak_mb": round(peak / 1e6, 1),
        "wall_s": round(wall, 2),
        "parent_cpu_per_chunk_s": round(cpu / plan.chunk_count, 6),
        "write_per_chunk_s": round(writing / plan.chunk_count, 6),
        "results_bytes": results,
        "files": len(files),
        "bytes": sum(files),
    }


if __name__ == "__main__":
    main()
