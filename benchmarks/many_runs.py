"""Thousands of runs: made in seconds, and how long levilab takes to list and to analyze them.

``python benchmarks/many_runs.py make FOLDER 10000`` makes spin-down runs, as an automated bench would in months: the
folder of one run of the virtual bench, with another start, constant and noise in each, one in a hundred of them broken.
"""

from __future__ import annotations

import argparse
import json
import math
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

SAMPLES = Path(__file__).parent.parent / "sample_data"
TEMPLATE = SAMPLES / "spin-down-1"
FIRST = datetime(2026, 3, 1, 8, 0, tzinfo=UTC)
BETWEEN = timedelta(minutes=15)
#: One in so many runs is broken, in turn: its record cut off, no readings, too few of them, a time that goes back.
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
        broken: one in so many runs is broken; 0: none is.

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


def main() -> None:
    """Do what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    actions = parser.add_subparsers(dest="action", required=True)
    make = actions.add_parser("make", help="make runs")
    make.add_argument("folder", type=Path)
    make.add_argument("count", type=int)
    given = parser.parse_args()
    make_runs(given.folder, given.count)


if __name__ == "__main__":
    main()
