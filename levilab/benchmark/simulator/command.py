"""`levilab benchmark simulator`: measures, prints tables, writes JSON and the figures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.markup import escape

from levilab.benchmark.found import give, tell
from levilab.benchmark.simulator.work_precision import PARTS, Comparison, as_document, compare
from levilab.errors import UsageError
from levilab.present.terminal import Terminal, new_table, terminal
from levilab.software import how_to_install

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from levilab.benchmark.simulator.as_called.comparison import Case
    from levilab.benchmark.simulator.as_called.overhead import Overhead


def run_and_tell(*, only: str | None, quick: bool, out: Path | None, as_json: bool) -> None:
    """The whole command.  Raises CannotWrite, and UsageError for an unknown part."""
    if only is not None and only not in PARTS:
        raise UsageError("only", f"{', '.join(PARTS[:-1])} or {PARTS[-1]} is expected", value=only)
    if only and out:
        raise UsageError("out", "`out` keeps the figures of all parts: leave `only` away, or take `json`")
    found = compare((only,) if only else PARTS, quick=quick, tell=tell)

    def save_kernels(path: Path) -> None:
        from levilab.benchmark.simulator.figure import work_precision_figure
        from levilab.present.style import save_png

        save_png(work_precision_figure(found), path)

    def save_calls(path: Path) -> None:
        from levilab.benchmark.simulator.as_called.figure import as_called_figure
        from levilab.present.style import save_png

        save_png(as_called_figure(found.cases), path)

    figures = {"simulator.png": save_kernels, "simulator_as_called.png": save_calls}
    give("simulator", as_document(found), lambda: print_comparison(found), figures, out=out, as_json=as_json)


def print_comparison(found: Comparison) -> None:
    """Print all tables of the measurement."""
    console = terminal()
    if found.points:
        print_kernels(console, found)
    if found.cases:
        print_called(console, found.cases)
    if found.overheads:
        print_overheads(console, found.overheads)
    for package in found.missing:
        how = escape(how_to_install("peers"))
        console.print(f"[yellow]note:[/yellow] {escape(package)} is not installed: {how}", soft_wrap=True)


def print_kernels(console: Terminal, found: Comparison) -> None:
    """Print points, ratios, and the kernels' share of the processor's peak."""
    numbers = ("error \\[cm]", "simulated s per s")
    title = "One top, 5 s of the scene undriven, one core: kernels at fixed steps, without an error estimate"
    points = new_table(title, "method", "setting", *numbers, numbers=numbers)
    for p in found.points:
        points.add_row(p.method, p.setting, f"{100 * p.error:.1e}", _number(p.speed, 3))
    console.print(points)
    columns = ("ours", "theirs", "ratio", "aim")
    shown = new_table(
        "Kernels at fixed steps against the peers, at the same error, each at its best setting",
        "", "", "error \\[cm]", *columns, numbers=columns,
    )  # fmt: skip
    for r in found.ratios:
        values = (_number(r.speed), _number(r.peer_speed), _number(r.ratio, 3), f"≥ {r.aim:g}")
        shown.add_row(r.ours, f"against {r.peer}", f"{100 * r.error:.0e}", *values)
    console.print(shown)
    peak = found.rates["peak"].gflops
    for name, rate in found.rates.items():
        if name != "peak":
            share = f"{100 * rate.share:.0f} % of the {peak:.0f} Gflop/s that multiply-adds alone reach"
            console.print(f"{name}: {rate.ns:.2f} ns a stage, {rate.gflops:.1f} Gflop/s, {share}")


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
            ours, theirs, ratio, slow = (_number(value, 3) for value in values)
            what = case.task.name, f"{case.task.duration:g} s", f"{100 * r.error:.0e}"
            shown.add_row(*what, ours, theirs, ratio, f"≥ {r.aim:g}", slow)
    console.print(shown)


def print_overheads(console: Terminal, overheads: Iterable[Overhead]) -> None:
    """Print the time of calls outside of compiled code."""
    columns = ("in Python", "aim", "whole call")
    shown = new_table("Time of a call", "", *columns, numbers=columns)
    for o in overheads:
        shown.add_row(o.call, *(f"{_number(1e3 * seconds, 3)} ms" for seconds in (o.outside, o.aim, o.whole)))
    console.print(shown)


def _number(value: float, digits: int = 4) -> str:
    return "–" if math.isnan(value) else f"{float(f'{value:.{digits}g}'):,g}".replace(",", " ")
