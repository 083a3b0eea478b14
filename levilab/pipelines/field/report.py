"""Scans of a field → their part of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.pipelines.field.table import base_table, by_run_table, follows_table, scans_table
from levilab.pipelines.part import InputPart, ReportPart
from levilab.present.tables import table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from levilab.pipelines.field.analysis import FieldAnalysis, FieldRun

#: Readings printed in the page; more stay in the run folder.  They stand in blocks side by side.
MOST_READINGS, BLOCK = 200, 10


def field_part(analysis: FieldAnalysis) -> ReportPart:
    """What the scans say, the base, what follows, and the readings."""
    several = len(analysis.runs) > 1
    return ReportPart(
        subject="field of the base",
        heading="Field of the base on its axis",
        lead=f"{sum(run.scan.statistics.n for run in analysis.runs)} heights measured",
        figure_text="Flux density against height with its fit, residuals, masses and spins of tops that float",
        template="pipelines/field/report.html.j2",
        context={
            "several": several,
            "text": analysis.text,
            "follows": follows_table(analysis.values),
            "scans": scans_table(analysis),
            "by_run": by_run_table(analysis),
            "bases": [
                (source.name, base_table(run.scan)) for source, run in zip(analysis.sources, analysis.runs, strict=True)
            ],
        },
        inputs=tuple(
            InputPart(_in_words(run), origin.text, run.text, _readings(run))
            for run, origin in zip(analysis.runs, analysis.origins, strict=True)
        ),
    )


def _in_words(run: FieldRun) -> tuple[str, ...]:
    scan = run.scan
    low, high = 1e3 * scan.height[0], 1e3 * scan.height[-1]
    text = f"{scan.statistics.n} heights, {low:.1f} mm to {high:.1f} mm"
    u = f"u of a reading against the fit: {1e6 * scan.u.min():.0f} µT to {1e6 * scan.u.max():.0f} µT"
    return text, f"{u}, that of its height included"


def _readings(run: FieldRun) -> Mapping[str, object]:
    """The first readings in blocks; rows of height [mm], flux density [mT] and residual [u]."""
    scan = run.scan
    shown = min(len(scan.height), MOST_READINGS)
    scaled = scan.residuals / scan.u
    rows = [
        (f"{1e3 * z:.2f}", f"{1e3 * b:.4f}", f"{r:+.1f}")
        for z, b, r in zip(scan.height[:shown], scan.flux_density[:shown], scaled[:shown], strict=True)
    ]
    heads = ("z [mm]", "B [mT]", "residual [u]")
    blocks = [table("", heads, rows[k : k + BLOCK], numbers=heads) for k in range(0, shown, BLOCK)]
    return {"blocks": blocks, "shown": shown, "count": len(scan.height)}
