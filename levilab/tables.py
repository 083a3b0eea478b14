"""Results → tables on a terminal."""

from __future__ import annotations

import shutil
import sys
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from levilab.numbers import SYMBOLS, plain, share, with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from analysis.selection import Statistics
    from analysis.uncertainty import Estimate
    from levilab.listing import Listed
    from levilab.pipeline import SpinDownAnalysis


def _console() -> Console:
    """As wide as the terminal; into a pipe or file as wide as the tables need."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 160
    return Console(width=max(width, 80), highlight=False)


def _table(*columns: str, numbers: Sequence[str] = ()) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        table.add_column(column, justify="right" if column in numbers else "left", overflow="fold")
    return table


def print_spindown(analysis: SpinDownAnalysis) -> None:
    """The runs, the laws, the straight lines, what the data say, and the warnings."""
    console = _console()
    synthetic = sum(source.synthetic for source in analysis.sources)
    total = len(analysis.runs)
    made_up = "" if not synthetic else ", SYNTHETIC" if synthetic == total else f", {synthetic} of them SYNTHETIC"
    console.print(f"[bold]Spin-down of {total} run{'s' * (total > 1)}{made_up}[/bold]\n")
    console.print(_runs_table(analysis))
    console.print(_laws_table(analysis))
    console.print(_lines_table(analysis))
    console.print(f"[bold]What the data say.[/bold] {escape(analysis.combined.verdict.text)}")
    for warning in all_warnings(analysis):
        console.print(f"[yellow]note:[/yellow] {escape(warning)}")


def all_warnings(analysis: SpinDownAnalysis) -> list[str]:
    """Every warning once, a run's with its name where there are several runs."""
    several = len(analysis.runs) > 1
    texts = [*analysis.warnings, *analysis.combined.warnings]
    texts += [text for fit in analysis.combined.fits for text in fit.warnings]
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        of_laws = [f"{fit.name}: {warning}" for fit in run.fits for warning in fit.warnings]
        prefix = f"{source.name}: " if several else ""
        texts += [prefix + text for text in (*source.readings.warnings, *run.warnings, *of_laws)]
    return list(dict.fromkeys(texts))


def _runs_table(analysis: SpinDownAnalysis) -> Table:
    table = _table("run", "readings", "time [s]", "spin [Hz]", "best law", "its constants", numbers=["readings"])
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        table.add_row(
            escape(source.name),
            str(len(run.time)),
            f"{run.time[0]:.1f} … {run.time[-1]:.1f}",
            f"{run.frequency[0]:.2f} → {run.frequency[-1]:.2f}",
            run.best,
            _constants(run.fit(run.best).parameters),
        )
    return table


def _laws_table(analysis: SpinDownAnalysis) -> Table:
    several = len(analysis.runs) > 1
    constants = "mean over the runs, u from their scatter" if several else "constants"
    numbers = ("rms [Hz]", "χ²/dof", "ΔAICc", "weight", "runs test p", "DW")
    table = _table("law", constants, *numbers, numbers=numbers)
    models = analysis.combined.fits
    least = min((m.statistics.aicc for m in models if m.statistics.aicc is not None), default=0.0)
    for model in models:
        best = "*" if model.name == analysis.combined.best else " "
        table.add_row(
            f"{best} {model.name}", _constants(law_constants(analysis, model.name)), *_columns(model.statistics, least)
        )
    return table


def law_constants(analysis: SpinDownAnalysis, name: str) -> Mapping[str, Estimate]:
    """A law's constants: means over the runs, or with its start those of the only one."""
    if len(analysis.runs) == 1:
        return analysis.runs[0].fit(name).parameters
    return analysis.combined.fit(name).constants


def _columns(statistics: Statistics, least: float) -> list[str]:
    difference = None if statistics.aicc is None else statistics.aicc - least
    return [
        plain(statistics.rms_residual),
        plain(statistics.reduced_chi_square),
        "—" if difference is None else f"{difference:.1f}",
        share(statistics.weight),
        plain(statistics.runs_test_p, 2),
        plain(statistics.durbin_watson),
    ]


def _lines_table(analysis: SpinDownAnalysis) -> Table:
    models = [model for model in analysis.combined.fits if model.linearised]
    titles = {"stokes": "ln ω against t", "newton": "1/ω against t", "disc": "ω^(−1/2) against t"}
    table = _table("straight lines, unweighted", *(titles[model.name] for model in models))
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        table.add_row(escape(source.name), *(_constants(run.fit(m.name).linearised or {}) for m in models))
    if len(analysis.runs) > 1:
        table.add_section()
        table.add_row("mean, u from the scatter", *(_constants(m.linearised or {}) for m in models))
    return table


def _constants(estimates: Mapping[str, Estimate]) -> str:
    return ", ".join(f"{SYMBOLS[name]} = {with_uncertainty(estimate)}" for name, estimate in estimates.items())


def print_runs(runs: Sequence[Listed], root: Path) -> None:
    """The list of runs."""
    console = _console()
    if not runs:
        console.print(f"no runs in {escape(str(root))}")
        return
    table = _table(
        "started (UTC)", "run", "what", "status", "readings", "length [s]", "note", numbers=["readings", "length [s]"]
    )
    for run in runs:
        started = (run.started_utc or "—")[:19].replace("T", " ")
        what = run.experiment + (", synthetic" if run.synthetic else "")
        note = run.problem or run.note
        table.add_row(
            started, escape(run.path), what, run.status, str(run.readings), f"{run.length_s:.0f}", escape(note)
        )
    console.print(table)
