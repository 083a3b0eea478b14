"""`levilab benchmark simulator`: measures, prints a table, writes JSON and the figure."""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING

from rich.markup import escape

from levilab.benchmark.simulator.work_precision import Comparison, as_document, compare
from levilab.files import CannotWrite, replace_atomically
from levilab.present.terminal import new_table, terminal

if TYPE_CHECKING:
    from pathlib import Path


def run_and_tell(*, quick: bool, out: Path | None, as_json: bool) -> None:
    """The whole command.  Raises CannotWrite."""
    found = compare(quick=quick, tell=lambda name: print(f"measuring {name}", file=sys.stderr))  # noqa: T201
    document = json.dumps(as_document(found), indent=2, allow_nan=False)
    if as_json:
        print(document)  # noqa: T201
    else:
        print_comparison(found)
    if out is not None:
        _write(found, document, out)


def _write(found: Comparison, document: str, out: Path) -> None:
    # matplotlib, which a benchmark that is not written does not need
    from levilab.benchmark.simulator.figure import work_precision_figure
    from levilab.present.style import save_png

    try:
        out.mkdir(parents=True, exist_ok=True)
        replace_atomically(out / "simulator.json", document + "\n")
        save_png(work_precision_figure(found), out / "simulator.png")
    except OSError as error:
        raise CannotWrite(
            f"{out}: the result cannot be written ({error.strerror or error}): choose another place"
        ) from None
    print(f"wrote {out / 'simulator.json'} and {out / 'simulator.png'}", file=sys.stderr)  # noqa: T201


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
