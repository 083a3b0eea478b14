"""The study of docs/study.md: where the thesis's top survives, and where a drive holds it.

    python benchmarks/study                  # sweeps into study/, then results/study.json and the figures of docs/study
    python benchmarks/study --only edge foot # these sweeps alone
    python benchmarks/study --draw           # numbers and figures from the stores in study/

Each sweep is also a command of its own; `--commands` prints them all.  Stores that are complete are not computed again.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

from plans import SWEEPS, Sweep

from levilab.sweeps.run import run, with_step, workers_for
from levilab.sweeps.store import Store
from levilab.workers import this_process

HERE = Path(__file__).parent
#: Fewer simulated seconds than these are not worth the start of other processes.
SMALL_S = 60_000
RESULTS, FIGURES = HERE.parent / "results", HERE.parents[1] / "docs" / "study"


def cpu_s() -> float:
    """Time of processors of this process and of its workers that have ended [s]."""
    return sum(os.times()[:4])


def compute(sweep: Sweep, path: Path) -> dict[str, Any]:
    """Make the store of a sweep.  Returns its points and what it cost."""
    wall, cpu = time.perf_counter(), cpu_s()
    store = Store.open(path, writable=True) if path.exists() else Store.create(path, with_step(sweep.plan, print))
    small = store.plan.size * store.plan.duration_s < SMALL_S
    run(store, this_process() if small else workers_for(store.plan))
    found = {"points": store.plan.size, "wall_s": time.perf_counter() - wall, "cpu_s": cpu_s() - cpu}
    print(
        f"{sweep.name:24} {found['points']:7d} points  {found['wall_s']:6.1f} s, processors {found['cpu_s']:6.1f} s",
        flush=True,
    )
    return found


def main() -> None:
    """Compute what is missing, then numbers and figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("study"), help="where the stores go")
    parser.add_argument("--only", nargs="*", help="names of sweeps")
    parser.add_argument("--draw", action="store_true", help="compute nothing")
    parser.add_argument("--commands", action="store_true", help="print the commands, and compute nothing")
    wanted = parser.parse_args()
    sweeps = [sweep for sweep in SWEEPS if not wanted.only or sweep.name in wanted.only]
    if wanted.commands:
        print("\n".join(sweep.command for sweep in sweeps))
        return
    costs_path = wanted.out / "costs.json"
    costs = json.loads(costs_path.read_text(encoding="utf-8")) if costs_path.exists() else {}
    for sweep in sweeps:
        path = wanted.out / f"{sweep.name}.zarr"
        if not wanted.draw and not (path.exists() and Store.open(path).done == Store.open(path).plan.chunk_count):
            costs[sweep.name] = compute(sweep, path)
            costs_path.write_text(json.dumps(costs, indent=1), encoding="utf-8")
    if wanted.only:
        return
    from figures import draw
    from numbers_of import numbers

    found = numbers(wanted.out) | {"costs": costs, "commands": [sweep.command for sweep in SWEEPS]}
    (RESULTS / "study.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    draw(wanted.out, found, FIGURES)


if __name__ == "__main__":
    main()
