"""`levilab benchmark simulator`: measures, prints a table, writes JSON and the figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.markup import escape

from levilab.benchmark.found import give, tell
from levilab.benchmark.simulator.work_precision import Comparison, as_document, compare
from levilab.present.terminal import new_table, terminal

if TYPE_CHECKING:
    from pathlib import Path


def run_and_tell(*, quick: bool, out: Path | None, as_json: bool) -> None:
    """The whole command.  Raises CannotWrite."""
    found = compare(quick=quick, tell=tell)

    def save_figure(path: Path) -> None:
        from levilab.benchmark.simulator.figure import work_precision_figure
        from levilab.present.style import save_png

        save_png(work_precision_figure(found), path)

    give("simulator", as_document(found), lambda: print_comparison(found), save_figure, out=out, as_json=as_json)


def print_comparison(found: Comparison) -> None:
    """Points, ratios, and the kernels' share of the processor's peak."""
    console = terminal()
    numbers = ("error \\[cm]", "simulated s per s")
    points = new_table("One top, 5 s of the scene undriven, one core", "method", "setting", *numbers, numbers=numbers)
    for p in found.points:
        points.add_row(p.method, p.setting, f"{100 * p.error:.1e}", f"{float(f'{p.speed:.3g}'):,.0f}".replace(",", " "))
    console.print(points)
    columns = ("ours", "theirs", "ratio", "aim")
    shown = new_table(
        "Speeds at the same error, each at its best setting", "", "", "error \\[cm]", *columns, numbers=columns
    )
    for r in found.ratios:
        values = (_number(r.speed), _number(r.peer_speed), _number(r.ratio, 3), f"≥ {r.aim:g}")
        shown.add_row(r.ours, f"against {r.peer}", f"{100 * r.error:.0e}", *values)
    console.print(shown)
    peak = found.rates["peak"].gflops
    for name, rate in found.rates.items():
        if name != "peak":
            share = f"{100 * rate.share:.0f} % of the {peak:.0f} Gflop/s that multiply-adds alone reach"
            console.print(f"{name}: {rate.ns:.2f} ns a stage, {rate.gflops:.1f} Gflop/s, {share}")
    for package in found.missing:
        console.print(f"[yellow]note:[/yellow] {escape(package)} is not installed: pip install 'levilab\\[peers]'")


def _number(value: float, digits: int = 4) -> str:
    return "–" if math.isnan(value) else f"{float(f'{value:.{digits}g}'):,g}".replace(",", " ")
