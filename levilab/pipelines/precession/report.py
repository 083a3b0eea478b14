"""Sweeps → their part of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.numbers import digits
from levilab.pipelines.part import InputPart, ReportPart
from levilab.pipelines.precession.analysis import verdict
from levilab.pipelines.precession.table import coherence_table, lines_table, points_table, power_table
from levilab.present.clock import with_clock

if TYPE_CHECKING:
    from levilab.pipelines.analyzed import Origin
    from levilab.pipelines.precession.analysis import PrecessionAnalysis, PrecessionOptions, PrecessionRun
    from levilab.pipelines.precession.readings import Readings
    from levilab.pipelines.sources import Source

#: Points printed in the page; more stay in the run folder.
MOST_POINTS = 200


def precession_part(analysis: PrecessionAnalysis) -> ReportPart:
    """Verdict, lines, power, phase lock, and the points."""
    several = len(analysis.runs) > 1
    names = [f" of {source.name}" if several else "" for source in analysis.sources]
    return ReportPart(
        subject="precession",
        heading="Precession of a driven top",
        lead=f"{analysis.combined.line.n} points used",
        figure_text="Precession against drive with the line, departures from the drive, influence of each point",
        template="pipelines/precession/report.html.j2",
        context={
            "verdict": analysis.text,
            "lines": lines_table(analysis),
            "power": power_table(analysis.combined),
            "coherences": [
                coherence_table(run, name) for run, name in zip(analysis.runs, names, strict=True) if run.coherences
            ],
        },
        inputs=tuple(
            _input(source, run, origin)
            for source, run, origin in zip(analysis.sources, analysis.runs, analysis.origins, strict=True)
        ),
    )


def _input(source: Source[Readings], run: PrecessionRun, origin: Origin[PrecessionOptions]) -> InputPart:
    count = len(run.fit.points)
    time = source.readings.time
    clock = with_clock(source.time_zero, None if time is None else time.tolist(), ())
    context = {
        "points": points_table(run, most=MOST_POINTS, clock=clock),
        "shown": min(count, MOST_POINTS),
        "count": count,
    }
    return InputPart(_in_words(source, run, origin), origin.text, verdict(run.fit), context)


def _in_words(source: Source[Readings], run: PrecessionRun, origin: Origin[PrecessionOptions]) -> tuple[str, ...]:
    drive, out = run.fit.column("drive"), sum(not point.used for point in run.fit.points)
    text = f"{len(drive)} points, {drive.min():.4g} Hz to {drive.max():.4g} Hz"
    return text + (f", {out} left out as miscounts" if out else ""), _uncertainty(source, run, origin)


def _uncertainty(source: Source[Readings], run: PrecessionRun, origin: Origin[PrecessionOptions]) -> str:
    """How large u of a point is, and where it comes from."""
    u = run.fit.column("u")
    if not np.isfinite(u).all():
        return "u of a point: not known, taken from the scatter about the line"
    low, high = float(u.min()), float(u.max())
    size = f"{digits(low)} Hz" if low == high else f"{digits(low)} Hz to {digits(high)} Hz"
    if origin.options.reading_u is not None:
        return f"u of a point: {size}, as given to the analysis"
    if source.readings.laser is not None:
        return f"u of a point: {size}, from the gates of all points, the swing about the drive taken off"
    channels = source.run.record.channels if source.run else []
    where = next((c.get("source") for c in channels if c.get("name") == "precession_frequency_u_hz"), None)
    return f"u of a point: {size}, {where or 'from a column of the data'}"
