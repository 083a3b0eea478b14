"""The study of docs/study.md: where the thesis's top survives, and where a drive holds it.

    python benchmarks/study                  # sweeps into study/, then numbers, figures and the page
    python benchmarks/study --only edge foot # these sweeps alone
    python benchmarks/study --draw           # numbers, figures and page from the stores in study/
    python benchmarks/study --page           # the page alone, from results/study.json

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
RESULTS, DOCS = HERE.parent / "results" / "study.json", HERE.parents[1] / "docs"
#: Processor time over time on the clock above which two cores had nothing else to do: much is done on one core.
ALONE = 1.2


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


def whole(costs: dict[str, Any]) -> dict[str, Any]:
    """Return what all sweeps and their numbers took together."""
    found = {key: sum(cost[key] for cost in costs.values()) for key in ("cpu_s", "wall_s")}
    tops = sum(cost.get("points", 0) for cost in costs.values())
    return found | {"sweeps": len(SWEEPS), "tops": tops, "alone": found["cpu_s"] > ALONE * found["wall_s"]}


def write_page() -> None:
    """Write docs/study.md from the kept numbers, and print what its words say and the numbers do not."""
    from page import claims, page

    found = json.loads(RESULTS.read_text(encoding="utf-8"))
    (DOCS / "study.md").write_text(page(found), encoding="utf-8", newline="\n")
    for claim in (claim for claim, holds in claims(found).items() if not holds):
        print(f"docs/study.md says in words what the numbers do not: {claim}")


def main() -> None:
    """Compute what is missing, then numbers, figures and page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("study"), help="where the stores go")
    parser.add_argument("--only", nargs="*", help="names of sweeps")
    parser.add_argument("--draw", action="store_true", help="compute nothing")
    parser.add_argument("--page", action="store_true", help="write the page alone")
    parser.add_argument("--commands", action="store_true", help="print the commands, and compute nothing")
    wanted = parser.parse_args()
    sweeps = [sweep for sweep in SWEEPS if not wanted.only or sweep.name in wanted.only]
    if wanted.commands:
        print("\n".join(sweep.command for sweep in sweeps))
        return
    if wanted.page:
        write_page()
        return
    wanted.out.mkdir(parents=True, exist_ok=True)
    costs_path = wanted.out / "costs.json"
    costs = json.loads(costs_path.read_text(encoding="utf-8")) if costs_path.exists() else {}
    for sweep in sweeps:
        path = wanted.out / f"{sweep.name}.zarr"
        if not wanted.draw and not (path.exists() and Store.open(path).done == Store.open(path).plan.chunk_count):
            costs[sweep.name] = compute(sweep, path)
            costs_path.write_text(json.dumps(costs, indent=1), encoding="utf-8")
    if wanted.only:
        return
    from numbers_of import numbers

    wall, cpu = time.perf_counter(), cpu_s()
    found = numbers(wanted.out)
    costs["numbers"] = {"wall_s": time.perf_counter() - wall, "cpu_s": cpu_s() - cpu}
    found |= {"run": whole(costs), "costs": costs, "commands": {sweep.name: sweep.command for sweep in SWEEPS}}
    RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8", newline="\n")
    from figures import draw

    draw(wanted.out, found, DOCS / "study")
    write_page()


if __name__ == "__main__":
    main()
