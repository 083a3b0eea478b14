"""`levilab benchmark simulator`: measures, prints tables, writes JSON and the figure."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from rich.markup import escape

from levilab.benchmark.found import give, tell
from levilab.benchmark.simulator.work_precision import Comparison, as_document, compare
from levilab.present.terminal import new_table, terminal
from levilab.software import how_to_install

if TYPE_CHECKING:
    from pathlib import Path

    from levilab.present.style import Figure


def run_and_tell(*, quick: bool, out: Path | None, as_json: bool) -> None:
    """Carry out the whole command.  Raises CannotWrite."""
    found = compare(quick=quick, tell=tell)

    def draw() -> Figure:
        from levilab.benchmark.simulator.figure import work_precision_figure

        return work_precision_figure(found)

    give("simulator", as_document(found), partial(print_comparison, found), draw, out=out, as_json=as_json)


def print_comparison(found: Comparison) -> None:
    """Print the points, the ratios to the peers, and the peers that are missing."""
    console = terminal()
    numbers = ("error \\[cm]", "simulated s per s")
    title = "One top, 5 s of the scene undriven, one core: kernels at fixed steps, without an error estimate"
    points = new_table(title, "method", "setting", *numbers, numbers=numbers)
    for p in found.points:
        points.add_row(p.method, p.setting, f"{100 * p.error:.1e}", number(p.speed, 3))
    console.print(points)
    columns = ("ours", "theirs", "ratio", "aim")
    shown = new_table(
        "Kernels at fixed steps against the peers, at the same error, each at its best setting",
        "", "", "error \\[cm]", *columns, numbers=columns,
    )  # fmt: skip
    for r in found.ratios:
        values = (number(r.speed), number(r.peer_speed), number(r.ratio, 3), f"≥ {r.aim:g}")
        shown.add_row(r.ours, f"against {r.peer}", f"{100 * r.error:.0e}", *values)
    console.print(shown)
    for package in found.missing:
        how = escape(how_to_install("peers"))
        console.print(f"[yellow]note:[/yellow] {escape(package)} is not installed: {how}", soft_wrap=True)


def number(value: float, digits: int = 4) -> str:
    """Return a number as the tables show it; a dash for NaN."""
    return "–" if math.isnan(value) else f"{float(f'{value:.{digits}g}'):,g}".replace(",", " ")
