"""Films of tops ↔ result.json."""

from typing import Any, Literal

from analysis.budget import Budget
from levilab.pipelines.budget import direct_row
from levilab.pipelines.document import Analysis, values_of
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import VideoOptions
from levilab.pipelines.row import find_all, symbols_of
from levilab.pipelines.video.analysis import (
    QUANTITIES,
    VIDEO_ROW,
    FilmReadings,
    Video,
    VideoAnalysis,
    analyze_source,
    no_run,
    read_film,
)
from levilab.pipelines.video.report import video_columns, video_files, video_part, video_tables

#: Quantity, and the only part of its u: name, source, kind, note, remedy.
_ROWS: tuple[tuple[str, str, str, Literal["A", "B"], str, str], ...] = (
    ("frequency", "phase", "phases of the mark", "A", "scatter about a smooth spin", "a longer film"),
    ("scale", "edge", "edge of the circle that gives the scale", "B", "0.3 pixels: focus, light", "a nearer camera"),
)


def budget_of_run(_: Source[FilmReadings], run: Video, __: VideoOptions) -> tuple[Budget, ...]:
    """Return the budgets of one film; those of the camera's clock and lens are unknown."""
    found = find_all(QUANTITIES, run)
    return tuple(
        Budget(name, one.value or 0.0, one.u, one.unit, (direct_row(row, what, one.u, one.unit, note, remedy, kind),))
        for name, row, what, kind, note, remedy in _ROWS
        if (one := found.get(name)) and one.u
    )


def _run_entries(run: Video) -> dict[str, Any]:
    return {"values": values_of(find_all(QUANTITIES, run)), "choices_hz": [abs(f) for f in run.choices]}


VIDEO = Analysis(
    name="video",
    experiments=frozenset(),
    read_file=read_film,
    read_run=no_run,
    particular=True,
    wanted="film",
    kind=VideoAnalysis,
    options=VideoOptions,
    fit=analyze_source,
    skips=True,
    budget_of_run=budget_of_run,
    finding=Video,
    run_entries=_run_entries,
    tables=video_tables,
    part=video_part,
    columns=video_columns,
    row=VIDEO_ROW,
    symbols=symbols_of(QUANTITIES),
    files=video_files,
)
