"""Spin frequencies → their part of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.pipelines.part import InputPart, ReportPart
from levilab.pipelines.spin.analysis import in_a_sentence
from levilab.pipelines.spin.table import frequency_table, pulse_table, series_table

if TYPE_CHECKING:
    from levilab.pipelines.sources import Source
    from levilab.pipelines.spin.analysis import SpinAnalysis, SpinRun
    from levilab.pipelines.spin.readings import Records

#: Values of a series printed in the page; more stay in result.json.
MOST_VALUES = 40


def spin_part(analysis: SpinAnalysis) -> ReportPart:
    """Frequencies, pulses, and frequency against time."""
    total = sum(run.spin.pulses for run in analysis.runs)
    return ReportPart(
        subject="spin frequency",
        heading="Spin frequency of a top",
        lead=f"{total} pulses used",
        figure_text="Traces with the turns found in them, turns laid over each other, residuals, frequency in time",
        template="pipelines/spin/report.html.j2",
        context={
            "verdict": analysis.text,
            "frequencies": frequency_table(analysis),
            "pulses": pulse_table(analysis),
        },
        inputs=tuple(
            InputPart(_in_words(source, run), origin.text, in_a_sentence(run), _series(source, run))
            for source, run, origin in zip(analysis.sources, analysis.runs, analysis.origins, strict=True)
        ),
    )


def _in_words(source: Source[Records], run: SpinRun) -> tuple[str, ...]:
    records, count = source.readings, len(source.readings)
    what = "pulse times" if records.pulses else f"samples of {records.channel}"
    return f"{records.kind}; {count} {what}", f"{run.spin.pulses} pulses, {run.spin.missing} missing"


def _series(source: Source[Records], run: SpinRun) -> dict[str, object]:
    return {"series": series_table(source, run, MOST_VALUES) if len(run.series) > 1 else None}
