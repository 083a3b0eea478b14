"""The simulator as its users call it, beside other people's integrators, and the time of a call outside of kernels.

    pip install 'levilab[peers]'
    python benchmarks/simulator_as_called.py --out benchmarks/results   # 3 min of one core

`levilab benchmark simulator` compares the compiled code alone, at fixed steps.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from as_called.comparison import Case, measure_calls
from as_called.overhead import OVERHEADS, Overhead, overhead
from as_called.tasks import TASKS
from levilab.benchmark.found import describe_measurement, give, tell
from levilab.benchmark.simulator.command import number
from levilab.benchmark.simulator.work_precision import as_point, as_ratio
from levilab.present.terminal import Terminal, new_table, terminal

if TYPE_CHECKING:
    from collections.abc import Iterable

    from levilab.present.style import Figure


def print_called(console: Terminal, cases: Iterable[Case]) -> None:
    """Print `simulate` and `simulate_many` against heyoka, and DOP853, at the same achieved error."""
    columns = ("levilab", "heyoka", "ratio", "aim", "DOP853")
    shown = new_table(
        "As called, with error estimate or step control: simulated s per s at the same achieved error",
        "motion", "time", "error \\[cm]", *columns, numbers=("time", *columns),
    )  # fmt: skip
    for case in cases:
        for r in case.ratios:
            values = (r.speed, r.peer_speed, r.ratio, case.speed("scipy DOP853", r.error))
            ours, theirs, ratio, slow = (number(value, 3) for value in values)
            what = case.task.name, f"{case.task.duration:g} s", f"{100 * r.error:.0e}"
            shown.add_row(*what, ours, theirs, ratio, f"≥ {r.aim:g}", slow)
    console.print(shown)


def print_overheads(console: Terminal, overheads: Iterable[Overhead]) -> None:
    """Print the time of calls outside of compiled code."""
    columns = ("in Python", "aim", "whole call")
    shown = new_table("Time of a call", "", *columns, numbers=columns)
    for o in overheads:
        shown.add_row(o.call, *(f"{number(1e3 * seconds, 3)} ms" for seconds in (o.outside, o.aim, o.whole)))
    console.print(shown)


def as_document(cases: Iterable[Case], overheads: Iterable[Overhead]) -> dict[str, Any]:
    """Return everything, with units in the names."""
    return {
        "schema": "levilab-benchmark-simulator-as-called/1",
        **describe_measurement("levilab", "numba", "numpy", "scipy", "heyoka"),
        "called": [
            {
                "motion": case.task.name,
                "duration_s": case.task.duration,
                "tops": case.task.tops,
                "points": [as_point(p) for p in case.points],
                "ratios": [as_ratio(r) for r in case.ratios],
            }
            for case in cases
        ],
        "overheads": [
            {"call": o.call, "outside_kernels_s": o.outside, "whole_s": o.whole, "aim_s": o.aim} for o in overheads
        ],
    }


def main() -> None:
    """Measure, print, and write what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=("called", "ensemble"), help="one top, or a thousand")
    parser.add_argument("--quick", action="store_true", help="fewer points and repetitions")
    parser.add_argument("--out", type=Path, help="folder for simulator_as_called.json and its figure")
    options = parser.parse_args()
    parts = (options.only,) if options.only else ("called", "ensemble")
    cases = measure_calls([task for task in TASKS if task.part in parts], quick=options.quick, tell=tell)
    overheads = [overhead(call) for call in OVERHEADS if call.part in parts]

    def print_tables() -> None:
        print_called(terminal(), cases)
        print_overheads(terminal(), overheads)

    def draw() -> Figure:
        from as_called.figure import as_called_figure

        return as_called_figure(cases)

    give("simulator_as_called", as_document(cases, overheads), print_tables, draw, out=options.out, as_json=False)


if __name__ == "__main__":
    main()
