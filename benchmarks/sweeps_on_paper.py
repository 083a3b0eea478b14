"""What a map of a thousand million points takes on a hundred machines, and what limits it first.

    python benchmarks/sweeps_on_paper.py       # prints its tables and writes results/sweeps_on_paper.md

No such map was computed: the numbers follow from what `sweeps.py` has measured on one small machine
(results/sweeps.json), and from the assumptions below.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from levilab.sweeps.plan import CHUNK_S, MOST

RESULTS = Path(__file__).parent / "results" / "sweeps.json"
PAGE = RESULTS.with_name("sweeps_on_paper.md")
TITLE = "# A map of 10⁹ points, calculated from results/sweeps.json by benchmarks/sweeps_on_paper.py"

# Assumed, not measured.
POINTS = 10**9
MACHINES, CORES_A_MACHINE = 100, 32
#: Times that a chunk takes [s]: as sweeps cut maps now, and longer.
CHUNKS_S = (CHUNK_S, 30.0)
#: What a scheduler keeps of a task [bytes], and a client of one under way: Dask's own objects, a few kB each.
TASK_BYTES_IN_SCHEDULER = 5_000
#: Files in a group's usual quota of a parallel file system.
FILES_QUOTA = 1_000_000
#: What a process may take on the machine where the sweep is started [bytes].
MEMORY = 16e9
#: What the network of that machine carries [bytes/s].
NETWORK = 1.25e9


@dataclass(frozen=True)
class Measured:
    """What the calculation takes from the measurements.

    Attributes:
        point_s: core seconds of a point.
        duration_s: simulated seconds of a point.
        write_s: of the parent, to write a chunk.
        client_s: of the parent, to send a task to a cluster and take its result back.
        scheduler_s: of the cluster, for a task that does nothing: the scheduler and the client are the bottleneck then.
        point_bytes: of a point's results in memory, and on the disk.
        columns: of results.
        task_bytes: of a task on its way to a worker.
        base_bytes: the parent's memory with a small map.
    """

    point_s: float
    duration_s: float
    write_s: float
    client_s: float
    scheduler_s: float
    point_bytes: tuple[float, float]
    columns: int
    task_bytes: int
    base_bytes: float

    @classmethod
    def of(cls, found: dict[str, Any]) -> Measured:
        """Take it from the kept results."""
        speed, written = found["speed"]["ends"], found["memory"][-1]
        dask = found["overhead"]["Dask, 2 workers"]
        here = speed["ways"]["this process"]
        return cls(
            point_s=here["parent_cpu_s"] / speed["points"],
            duration_s=speed["duration_s"],
            write_s=written["write_per_chunk_s"],
            client_s=dask["parent_cpu_s"],
            scheduler_s=dask["wall_s"],
            point_bytes=(written["results_bytes"] / written["points"], written["bytes"] / written["points"]),
            columns=written["columns"],
            task_bytes=written["task_bytes"],
            base_bytes=found["memory"][0]["peak_mb"] * 1e6,
        )


@dataclass(frozen=True)
class Limit:
    """A resource that a sweep may exhaust.

    Attributes:
        name: of what is used.
        used: as text.
        of: the capacity, as text.
        share: of the capacity; above 1 it is exhausted.
        points: of the largest map for which it is enough; infinite if the map's size does not matter.
        cores: likewise the most cores.
        slows: whether a share above 1 slows the sweep down instead of ending it.
    """

    name: str
    used: str
    of: str
    share: float
    points: float = math.inf
    cores: float = math.inf
    slows: bool = False


def limits_of(one: Measured, chunk_s: float) -> list[Limit]:
    """Return what a sweep of POINTS with chunks of that length uses, the worst first."""
    cores = MACHINES * CORES_A_MACHINE
    chunk_points = max(round(chunk_s / one.point_s), 1)
    chunks = math.ceil(POINTS / chunk_points)
    rate = cores / chunk_s
    parent, scheduler = 1 / (one.write_s + one.client_s), 1 / one.scheduler_s
    files = chunks * (one.columns + 1 / 4096)
    loaded = POINTS * (one.point_bytes[0] + 1)
    # if results come faster than the parent writes, all that is under way waits in its memory
    a_task = TASK_BYTES_IN_SCHEDULER + one.task_bytes + chunk_points * one.point_bytes[0]
    under_way = 2 * cores * a_task + one.base_bytes + chunks
    network = rate * (2 * one.task_bytes + chunk_points * one.point_bytes[0])
    limits = [
        Limit("the parent, which writes", f"{_short(rate)} chunks/s", f"{_short(parent)}/s", rate / parent,
              cores=parent * chunk_s, slows=True),
        Limit("the scheduler", f"{_short(rate)} tasks/s", f"{_short(scheduler)}/s", rate / scheduler,
              cores=scheduler * chunk_s, slows=True),
        Limit("files of the store", f"{files:.3g}", f"{FILES_QUOTA:.3g}", files / FILES_QUOTA,
              points=POINTS * FILES_QUOTA / files),
        Limit("memory while it runs", f"{under_way / 1e9:.2g} GB", f"{MEMORY / 1e9:.2g} GB", under_way / MEMORY,
              cores=cores * MEMORY / under_way),
        Limit("memory to open the map whole", f"{loaded / 1e9:.2g} GB", f"{MEMORY / 1e9:.2g} GB", loaded / MEMORY,
              points=POINTS * MEMORY / loaded),
        Limit("network of the parent", f"{network / 1e6:.2g} MB/s", f"{NETWORK / 1e6:.4g} MB/s", network / NETWORK,
              cores=cores * NETWORK / network, slows=True),
    ]  # fmt: skip
    return sorted(limits, key=lambda limit: -limit.share)


def _short(number: float) -> str:
    """Return a number with two digits."""
    return f"{float(f'{number:.2g}'):.0f}" if 10 <= number < 1e5 else f"{number:.2g}"


def page(found: dict[str, Any]) -> str:
    """Return the tables of results/sweeps_on_paper.md."""
    one = Measured.of(found)
    cores = MACHINES * CORES_A_MACHINE
    core_s = POINTS * one.point_s
    what = f"{POINTS:.0e} points of {one.duration_s:g} s, {one.columns} columns of results"
    lines = [
        f"{what}; {MACHINES} machines with {CORES_A_MACHINE} cores each.",
        *(
            []
            if not found["brief"]
            else ["", "**Preliminary:** measured with smaller maps, on a machine that was busy."]
        ),
        "",
        "| quantity | value | from |",
        "|---|---|---|",
        f"| core time of a point | {one.point_s * 1e3:.2g} ms | measured in one process |",
        f"| core time of the map | {core_s / 3600:.3g} hours | × points |",
        f"| wall time if only the cores limit it | {core_s / cores / 60:.3g} minutes | ÷ {cores} cores |",
        f"| the same on a machine with two cores | {core_s / 2 / 86400:.3g} days | |",
        f"| results in memory | {POINTS * one.point_bytes[0] / 1e9:.3g} GB | measured |",
        f"| results on the disk | {POINTS * one.point_bytes[1] / 1e9:.3g} GB | random numbers, which compress badly |",
        f"| the parent writes a chunk in | {one.write_s * 1e3:.2g} ms | measured |",
        f"| the parent sends a task and takes its result in | {one.client_s * 1e3:.2g} ms | measured |",
        f"| a task that does nothing, over Dask | {one.scheduler_s * 1e3:.2g} ms | measured |",
    ]
    for chunk_s in CHUNKS_S:
        lines += ["", *_table(one, chunk_s)]
    return "\n".join(lines)


def _table(one: Measured, chunk_s: float) -> list[str]:
    chunk_points = round(chunk_s / one.point_s)
    cores = MACHINES * CORES_A_MACHINE
    heading = f"**Chunks of {chunk_s:g} s{', as now' if chunk_s == CHUNK_S else ''}.**"
    limits = limits_of(one, chunk_s)
    first = limits[0]
    wall = POINTS * one.point_s / cores * max(1.0, *(limit.share for limit in limits if limit.slows))
    allowed = "" if chunk_points <= MOST else f" (now at most {MOST})"
    verdict = (
        f"First limit: {first.name}" if first.share > 1 else f"No limit is reached; the first would be: {first.name}"
    )
    text = (
        f"{heading}  {chunk_points} points each{allowed}, {math.ceil(POINTS / chunk_points)} chunks.  A killed parent "
        f"loses at most {_short(cores * chunk_s / 3600)} core hours.  Wall time: {_short(wall / 60)} minutes.  "
        f"{verdict}."
    )
    lines = [
        text,
        "",
        "| resource | used | available | share | enough for |",
        "|---|---|---|---|---|",
    ]
    for limit in limits:
        enough = [
            f"{_short(limit.points)} points" if math.isfinite(limit.points) else "",
            f"{_short(limit.cores)} cores" if math.isfinite(limit.cores) else "",
        ]
        row = (limit.name, limit.used, limit.of, f"{limit.share:.2g}", ", ".join(filter(None, enough)) or "any map")
        lines.append(f"| {' | '.join(row)} |")
    return lines


def main() -> None:
    tables = page(json.loads(RESULTS.read_text(encoding="utf-8")))
    PAGE.write_text(f"{TITLE}\n\n{tables}\n", encoding="utf-8")
    print(tables)


if __name__ == "__main__":
    main()
