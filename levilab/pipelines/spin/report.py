"""Spin frequencies → their part of a report."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.pipelines.part import VALUE_U, FigureText, ReportPart, input_parts
from levilab.pipelines.spin.analysis import MOST_DRAWN, in_a_sentence
from levilab.pipelines.spin.meaning import meaning
from levilab.pipelines.spin.table import frequency_table, quality_tables, series_table
from levilab.present.document.blocks import Listing, Paragraph, Points, Tabular
from levilab.present.numbers import enumeration, with_uncertainty

if TYPE_CHECKING:
    from levilab.pipelines.sources import Source
    from levilab.pipelines.spin.analysis import SpinAnalysis, SpinRun
    from levilab.pipelines.spin.readings import Records
    from levilab.present.document.blocks import Block

#: Values of a series printed in the page; more stay in result.json.
MOST_VALUES = 40
#: A series with more values has none that answers to the pointer.
MOST_POINTS = 300


def spin_part(analysis: SpinAnalysis) -> ReportPart:
    """Return frequencies, pulses, and frequency against time."""
    return ReportPart(
        subject="spin frequency",
        heading="Spin frequency of a top",
        lead=_count_pulses(analysis),
        result=(
            Paragraph(" ".join(meaning(analysis)), "What it means."),
            Tabular("spin-frequencies", frequency_table(analysis), _FREQUENCIES, first_column_wraps=True),
        ),
        figure=FigureText(
            title="Spin frequency.",
            caption=(
                "Traces with the turns found in them, turns laid over each other, what the fit leaves over, and the "
                "frequency in time."
            ),
            alt="Traces with the turns found in them, turns laid over each other, residuals, frequency in time",
            points=_points(analysis),
        ),
        runs_title="The line" if all(run.line for run in analysis.runs) else "The pulses",
        runs=tuple(
            Tabular(name, replace(one, title=""), _QUALITY[name], first_column_wraps=True)
            for name, one in quality_tables(analysis).items()
        ),
        inputs=input_parts(analysis, _in_words, _series, in_a_sentence),
    )


def _count_pulses(analysis: SpinAnalysis) -> str:
    """Return the number of pulses of single records, and of records or windows, of which each has its pulses."""
    counts = {}
    for name, is_line in (("pulse", False), ("turn", True)):
        if number := sum(run.spin.pulses for run in analysis.runs if not run.which and bool(run.line) is is_line):
            counts[name] = number
    for run in analysis.runs:
        if run.which:
            counts[run.series.of] = counts.get(run.series.of, 0) + len(run.series)
    said = [f"{count} {name}{'s' * (count > 1)}" for name, count in counts.items()]
    return f"{enumeration(said)} used"


_FREQUENCIES = (
    f"{VALUE_U} The spin is that at the time "
    "given, its slope the change of the spin in a second. bound: no method does better with this noise (Cramér–Rao). "
    "Of several records or windows this table, that of the pulses and the budgets are of the one in the middle; the "
    "text gives the slope through all."
)
_QUALITY = {
    "spin-pulses": (
        "missing: turns without a pulse; doubled: pulses beyond one a turn; scatter: standard deviation of one pulse's "
        "time; S/N: height of a pulse over the noise of a sample."
    ),
    "spin-line": (
        "A: amplitude of the field that turns with the top, in each axis; noise: standard deviation of a sample there; "
        "S/N: amplitude over noise, in the axis where it is greatest."
    ),
}


def _in_words(source: Source[Records], run: SpinRun, *_: object) -> tuple[str, ...]:
    records, count = source.readings, len(source.readings)
    of = f"{run.which}: " if run.which else ""
    if run.line:
        return f"{records.kind}; {count} samples", f"{of}{run.line.turns} turns"
    what = "pulse times" if records.pulses else f"samples of {records.channel}"
    return f"{records.kind}; {count} {what}", f"{of}{run.spin.pulses} pulses, {run.spin.missing} missing"


def _series(source: Source[Records], run: SpinRun, *_: object) -> tuple[Block, ...]:
    """Return frequency against time, where there is more than one value."""
    if len(run.series) <= 1:
        return ()
    return (Listing("spin-series", series_table(source, run, MOST_VALUES)),)


def _points(analysis: SpinAnalysis) -> tuple[Points, ...]:
    """Return what each value of the frequency against time answers, of the inputs that are drawn."""
    return tuple(
        Points(f"readings-{k}", tuple(map(_point, run.series.time, run.series.frequency, run.series.u)))
        for k, run in enumerate(analysis.runs[:MOST_DRAWN])
        if 1 < len(run.series) <= MOST_POINTS
    )


def _point(time: float, frequency: float, u: float) -> str:
    spin = Estimate(float(frequency), float(u), "Hz")
    return f"t = {digits(float(time), 6)} s\nν = {with_uncertainty(spin)}"
