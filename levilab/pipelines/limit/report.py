"""Limits → their part of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from analysis.numbers import digits
from levilab.pipelines.limit.table import runs_table, theory_table
from levilab.pipelines.part import InputPart, ReportPart
from levilab.present.tables import Row, table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from levilab.pipelines.limit.analysis import LimitAnalysis, Limits
    from levilab.pipelines.limit.readings import LimitReadings
    from levilab.pipelines.sources import Source

#: Limits printed in the page; they stand in blocks side by side.
_MOST_SHOWN, _BLOCK = 200, 10


def limit_part(analysis: LimitAnalysis) -> ReportPart:
    """Verdict, statistics, theory, and the limits."""
    n = sum(run.statistics.n for run in analysis.runs)
    return ReportPart(
        subject="limits of the spin",
        heading="Limits of the spin of a levitated top",
        lead=f"{n} tops",
        figure_text="Limits top by top with mean, scatter and theory, and how they are distributed",
        template="pipelines/limit/report.html.j2",
        context={
            "verdict": analysis.text,
            "runs": runs_table(analysis),
            "theory": theory_table(analysis),
        },
        inputs=tuple(
            InputPart(_in_words(source, run), origin.text, run.text, _readings(source, run))
            for source, run, origin in zip(analysis.sources, analysis.runs, analysis.origins, strict=True)
        ),
    )


def _in_words(source: Source[LimitReadings], run: Limits) -> tuple[str, ...]:
    limit, u = source.readings.limit, source.readings.u
    span = f"{run.statistics.n} {run.which} limits, {limit.min():.2f} Hz to {limit.max():.2f} Hz"
    known = "not known" if u is None else f"{digits(u.min())} Hz to {digits(u.max())} Hz"
    return span, f"u of a limit: {known}"


def _readings(source: Source[LimitReadings], run: Limits) -> Mapping[str, object]:
    """The limits in blocks; rows of number, limit [Hz] and u [Hz]."""
    limit, u = source.readings.limit, source.readings.u
    shown = min(limit.size, _MOST_SHOWN)
    heads = ("top", "limit [Hz]", "u [Hz]")
    rows = [
        Row(
            (str(i + 1), f"{limit[i]:.4f}", "—" if u is None else f"{digits(u[i])}"),
            "outlier" if i in run.statistics.outliers else "",
        )
        for i in range(shown)
    ]
    blocks = [table("", heads, rows[k : k + _BLOCK], numbers=heads) for k in range(0, shown, _BLOCK)]
    return {"blocks": blocks, "shown": shown, "count": limit.size}
