"""Results → tables on a terminal."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rich.markup import escape

from levilab.pipelines.spindown.laws import SHOWN_LAWS, SYMBOLS
from levilab.present.numbers import in_words, plain, share, short_name, with_uncertainty, without_unit
from levilab.present.terminal import new_table, terminal

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.table import Table

    from analysis.spindown.selection import Statistics
    from analysis.uncertainty import Estimate
    from levilab.pipelines.spindown.analysis import SpinDownAnalysis


def print_spindown(analysis: SpinDownAnalysis) -> None:
    """The runs, the laws, how well they fit, the straight lines, what the data say, and the warnings.

    Each table fits a terminal of 80 columns.
    """
    console = terminal()
    for table in (_runs_table, _laws_table, _fits_table, _lines_table):
        console.print(table(analysis))
    console.print(f"[bold]What the data say.[/bold] {escape(analysis.combined.verdict.text)}")
    for warning in all_warnings(analysis):
        console.print(f"[yellow]note:[/yellow] {escape(warning)}")


def all_warnings(analysis: SpinDownAnalysis) -> list[str]:
    """Every warning once, a run's with its name where there are several runs."""
    several = len(analysis.runs) > 1
    texts = [*analysis.warnings, *analysis.combined.warnings]
    excluded = {name for name, _ in analysis.combined.verdict.excluded}  # what they lack is of no interest any more
    texts += [text for fit in analysis.combined.fits if fit.name not in excluded for text in fit.warnings]
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        of_laws = [warning for fit in run.fits if fit.name not in excluded for warning in fit.warnings]
        prefix = f"{source.name}: " if several else ""
        texts += [prefix + text for text in (*source.readings.warnings, *run.warnings, *of_laws)]
    return list(dict.fromkeys(texts))


def _runs_table(analysis: SpinDownAnalysis) -> Table:
    total, synthetic = len(analysis.runs), sum(source.synthetic for source in analysis.sources)
    made_up = "" if not synthetic else ", SYNTHETIC" if synthetic == total else f", {synthetic} of them SYNTHETIC"
    title = f"Spin-down, {total} run{'s' * (total > 1)}{made_up}"
    table = new_table(title, "run", "readings", "time [s]", "spin [Hz]", "best law", numbers=["readings"])
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        table.add_row(
            escape(source.name),
            str(len(run.time)),
            f"{run.time[0]:.1f} … {run.time[-1]:.1f}",
            f"{run.frequency[0]:.2f} → {run.frequency[-1]:.2f}",
            run.best if run.verdict.decided else "undecided",
        )
    return table


def _laws_table(analysis: SpinDownAnalysis) -> Table:
    of = (
        "Drag laws"
        if len(analysis.runs) == 1
        else f"Drag laws, means over {len(analysis.runs)} runs, u from their scatter"
    )
    table = new_table(of, "law", "", "constants")
    for fit in analysis.combined.fits:
        constants = law_constants(analysis, fit.name)
        verdict = analysis.combined.verdict
        best = "best" if verdict.decided and fit.name == verdict.best else ""
        table.add_row(fit.name, best, "\n".join(_equations(constants)))
    return table


def _fits_table(analysis: SpinDownAnalysis) -> Table:
    numbers = ("rms [Hz]", "χ²/dof", "ΔAICc", "weight", "order p", "DW")
    table = new_table("How well they fit", "law", *numbers, numbers=numbers)
    fits = analysis.combined.fits
    for fit in fits:
        table.add_row(fit.name, *_columns(fit.statistics))
    return table


def law_constants(analysis: SpinDownAnalysis, name: str) -> Mapping[str, Estimate]:
    """A law's constants: means over the runs, or with its start those of the only one."""
    if len(analysis.runs) == 1:
        return analysis.runs[0].fit(name).parameters
    return analysis.combined.fit(name).constants


def _columns(statistics: Statistics) -> list[str]:
    difference = statistics.difference
    return [
        plain(statistics.rms_residual),
        plain(statistics.reduced_chi_square),
        "—" if difference is None else f"{difference:.1f}",
        share(statistics.weight),
        plain(statistics.runs_test_p, 2),
        plain(statistics.durbin_watson),
    ]


def _lines_table(analysis: SpinDownAnalysis) -> Table:
    """The thesis's straight lines, run by run, beside the fit of the favoured law."""
    best = analysis.combined.fit(analysis.combined.best)
    lines = [fit for fit in analysis.combined.fits if fit.linearised]
    headers = [f"{_axis(fit.name)}\n{_header(fit.linearised or {})}" for fit in lines]
    favoured = f"{best.name} fit\n{_header(best.constants)}"
    table = new_table("Run by run: unweighted straight lines, and the fit of the best law", "run", *headers, favoured)
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        cells = [_first(run.fit(fit.name).linearised or {}) for fit in lines]
        fitted = run.fit(best.name).parameters
        table.add_row(escape(short_name(source.name)), *cells, _first({name: fitted[name] for name in best.constants}))
    if len(analysis.runs) > 1:
        table.add_section()
        table.add_row("mean", *(_first(fit.linearised or {}) for fit in lines), _first(best.constants))
    return table


def _axis(law: str) -> str:
    """What is drawn against time to make a law a straight line."""
    straight = SHOWN_LAWS[law].straight
    return straight.quantity if straight else ""


def _equations(estimates: Mapping[str, Estimate]) -> list[str]:
    return [
        f"{SYMBOLS[name]} = {with_uncertainty(estimate)}{_interval(estimate)}" for name, estimate in estimates.items()
    ]


def _interval(estimate: Estimate) -> str:
    """The 68 % interval where one was asked for, in the digits that u gives."""
    if not estimate.interval or not estimate.u:
        return ""
    low, high = (without_unit(replace(estimate, value=end)) for end in estimate.interval)
    return f", 68 %: {low.split('(')[0]}{_power(low)} … {high.split('(')[0]}{_power(high)}"


def _power(text: str) -> str:
    return text.partition(")")[2]


def _header(estimates: Mapping[str, Estimate]) -> str:
    name, estimate = next(iter(estimates.items()))
    return f"{SYMBOLS[name]} \\[{in_words(estimate.unit)}]"


def _first(estimates: Mapping[str, Estimate]) -> str:
    return without_unit(next(iter(estimates.values())))
