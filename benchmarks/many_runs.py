"""Make thousands of runs in seconds, and measure how long levilab takes to list and to analyze them.

``python benchmarks/many_runs.py make FOLDER 10000`` makes spin-down runs, as an automated bench would in months: the
folder of one run of the virtual bench, with another start, constant and noise in each, one in a hundred of them broken.
``python benchmarks/many_runs.py measure`` writes benchmarks/results/many_runs.json (Linux); with ``100 1000`` behind it
it measures less.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

try:
    import resource
except ImportError:  # Windows: only `make` works there
    resource = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from collections.abc import Sequence

SAMPLES = Path(__file__).parent.parent / "sample_data"
TEMPLATE = SAMPLES / "spin-down-1"
FIRST = datetime(2026, 3, 1, 8, 0, tzinfo=UTC)
BETWEEN = timedelta(minutes=15)
#: One in this number of runs is broken, in turn: its record is cut off, readings are missing, too few, or go back.
BROKEN = 100
KINDS = ("record", "readings", "short", "order")
#: Files of a run that all copies have alike.
COPIED = ("events.jsonl", "datapackage.json", "run.lock")
NOISE_HZ, STEP_S = 0.03, 10.0


def make_runs(root: Path, count: int, *, template: Path = TEMPLATE, seed: int = 0, broken: int = BROKEN) -> list[Path]:
    """Make spin-down runs of a laminar disc's drag.

    Args:
        root: the folder that they are made in.
        count: how many.
        template: the run that they are copies of.
        seed: of constants and noise.
        broken: one in this number of runs is broken; 0: none is.

    Returns:
        Their folders.
    """
    rng = np.random.default_rng(seed)
    record = json.loads((template / "run.json").read_text(encoding="utf-8"))
    same = [(name, (template / name).read_bytes()) for name in COPIED if (template / name).exists()]
    title = "time_s,spin_frequency_hz,spin_frequency_u_hz"
    made = []
    for k in range(count):
        kind = KINDS[(k // broken) % len(KINDS)] if broken and k % broken == broken - 1 else ""
        began = FIRST + k * BETWEEN
        folder = root / f"{began:%Y%m%dT%H%M%SZ}-spin-{k % 65536:04x}"
        folder.mkdir(parents=True)
        made.append(folder)
        utc = [f"{moment:%Y-%m-%dT%H:%M:%S.%fZ}" for moment in (began, began + timedelta(seconds=200))]
        about = {"note": f"run {k} of {count}", "seed": k, "started_utc": utc[0], "time_zero_utc": utc[0]}
        text = json.dumps(record | about | {"ended_utc": utc[1]}, indent=2, sort_keys=True)
        (folder / "run.json").write_text(text[:200] if kind == "record" else text, encoding="utf-8")
        for name, content in same:
            (folder / name).write_bytes(content)
        rows = _rows(rng)
        if kind == "short":
            rows = rows[:2]
        if kind == "order":
            rows[5], rows[6] = rows[6], rows[5]
        if kind != "readings":
            (folder / "readings.csv").write_text("\n".join([title, *rows, ""]), encoding="utf-8")
    return made


def _rows(rng: np.random.Generator) -> list[str]:
    """Readings of ω̇ = −Cω^(3/2), whose closed form is ω^(−1/2) = ω₀^(−1/2) + Ct/2, with noise."""
    start, constant = rng.uniform(38, 42), rng.uniform(2.2e-4, 2.6e-4)
    time = STEP_S * np.arange(rng.integers(18, 22))
    spin = ((2 * math.pi * start) ** -0.5 + constant * time / 2) ** -2 / (2 * math.pi)
    seen = spin + rng.normal(0, NOISE_HZ, len(time))
    return [f"{t:.1f},{nu:.3f},{NOISE_HZ}" for t, nu in zip(time, seen, strict=True)]


# --- measuring -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cost:
    """What a command took.  wall_s, cpu_s: with all processes [s]; rss_mb: peak memory of each process [MB]."""

    wall_s: float
    cpu_s: float
    rss_mb: dict[str, float]


def cost(words: Sequence[str | Path]) -> Cost:
    """Run a `levilab` command; read the memory of its processes ten times a second (Linux)."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "levilab", *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    peaks: dict[str, float] = {}
    while process.poll() is None:
        for number in (process.pid, *_children(process.pid)):
            kind = "parent" if number == process.pid else "worker"
            peaks[kind] = max(peaks.get(kind, 0.0), _peak_mb(number))
        time.sleep(0.1)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Cost(round(time.perf_counter() - began, 2), round(cpu, 2), {kind: round(mb) for kind, mb in peaks.items()})


def _children(number: int) -> list[int]:
    try:
        return [int(child) for child in Path(f"/proc/{number}/task/{number}/children").read_text().split()]
    except OSError:
        return []


def _peak_mb(number: int) -> float:
    """VmHWM, the most that was resident."""
    try:
        lines = Path(f"/proc/{number}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")), 0.0)


def measure(counts: Sequence[int]) -> dict[str, object]:
    """List and tabulate runs, by one process and by two."""
    found: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = subprocess.run(
            [sys.executable, "-m", "levilab", "acquire", "spin", "--mock", "--seed", "1", "--out", folder / "one"],
            check=True, capture_output=True,
        )  # fmt: skip
        assert made.returncode == 0
        template = next((folder / "one").iterdir())
        for count in counts:
            runs = folder / f"runs-{count}"
            make_runs(runs, count, template=template)
            commands = {
                "runs": ["runs", runs],
                "table, 2 cores": ["analyze", "spindown", runs, "--table", folder / "two.csv", "--cores", "2"],
                "table, 1 core": ["analyze", "spindown", runs, "--table", folder / "one.csv", "--cores", "1"],
            }
            for what, words in commands.items():
                found.append({"runs": count, "what": what} | asdict(cost(words)))
                print(json.dumps(found[-1]), flush=True)
            assert (folder / "one.csv").read_bytes() == (folder / "two.csv").read_bytes()
            parquet = ["analyze", "spindown", runs, "--table", folder / "two.parquet", "--cores", "2"]
            if count == min(counts):
                found.append({"runs": count, "what": "Parquet, 2 cores"} | asdict(cost(parquet)))
    return {"python": platform.python_version(), "cores": os.cpu_count(), "load": os.getloadavg()[0], "found": found}


def main() -> None:
    """Make or measure runs, as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    actions = parser.add_subparsers(dest="action", required=True)
    make = actions.add_parser("make", help="make runs")
    make.add_argument("folder", type=Path)
    make.add_argument("count", type=int)
    of = actions.add_parser("measure", help="time and memory of levilab runs and of levilab analyze --table")
    of.add_argument("counts", type=int, nargs="*", default=[100, 1000, 10_000])
    given = parser.parse_args()
    if given.action == "make":
        make_runs(given.folder, given.count)
    else:
        text = json.dumps(measure(given.counts), indent=2)
        (Path(__file__).parent / "results" / "many_runs.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
