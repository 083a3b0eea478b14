"""Held spins → their part of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.pipelines.hold.analysis import text_of
from levilab.pipelines.hold.table import laws_table, spins_table
from levilab.pipelines.part import VALUE_U, FigureText, ReportPart, input_parts, points_of
from levilab.present.document.blocks import Paragraph, Tabular
from levilab.present.numbers import with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Iterator

    from analysis.held import Hold
    from levilab.pipelines.hold.analysis import HoldAnalysis
    from levilab.pipelines.hold.readings import HoldReadings
    from levilab.pipelines.sources import Source

_MEANING = (
    "A drive that the top triggers holds its spin; the share s of the full amplitude that this takes shows the drag: "
    "the full amplitude gains g, so d = s g/(1 − s), with what the spin changed meanwhile taken into account."
)


def hold_part(analysis: HoldAnalysis) -> ReportPart:
    """Return what the held spins say."""
    laws = (Tabular("hold-laws", laws_table(analysis)),) if analysis.combined.laws else ()
    return ReportPart(
        subject="held spin",
        heading="Held spins: the drag by the amplitude that balances it",
        lead=f"{len(analysis.runs)} held spins",
        result=(
            Paragraph(_MEANING, "What it means."), Tabular("hold-spins", spins_table(analysis), VALUE_U), *laws,
        ),
        figure=FigureText(
            title="Drag at held spins.",
            caption=(
                "The drag that the amplitude balanced at each held spin, with its u, and the drag laws through it; "
                "below, both over the best law."
            ),
            alt="Drag against spin, with the drag laws",
            points=points_of(analysis, _points, "readings", *(["ratios"] if analysis.combined.best else [])),
        ),
        runs_title="",
        runs=(),
        inputs=input_parts(analysis, _in_words, lambda *_: (), text_of),
    )  # fmt: skip


def _in_words(source: Source[HoldReadings], *_: object) -> tuple[str, ...]:
    one = source.readings
    return (
        f"{len(one)} readings from {one.time[0]:.1f} s to {one.time[-1]:.1f} s",
        f"gain at the full amplitude measured {len(one.gains)} times",
    )


def _points(run: Hold) -> Iterator[tuple[str, ...]]:
    drag = (f"drag = {with_uncertainty(run.drag)}",) if run.drag else ()
    yield f"spin = {with_uncertainty(run.spin)}", *drag
