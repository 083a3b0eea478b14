"""Sweeps → their part of a report."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.pipelines.part import (
    VALUE_U,
    FigureText,
    ReportPart,
    first_of,
    input_parts,
    origin_of_u,
    points_of,
    size_of_u,
)
from levilab.pipelines.precession.table import coherence_table, lines_table, named_runs, points_table, power_table
from levilab.pipelines.precession.words import slope_of, verdict
from levilab.present.clock import with_clock
from levilab.present.document.blocks import Note, Paragraph, Tabular
from levilab.present.numbers import off, plain, with_uncertainty
from levilab.simulator.published.printed import published

if TYPE_CHECKING:
    from collections.abc import Iterator

    from analysis.precession.sweep import SweepFit
    from levilab.pipelines.options import PrecessionOptions
    from levilab.pipelines.precession.analysis import PrecessionAnalysis, PrecessionRun
    from levilab.pipelines.precession.readings import SweepReadings
    from levilab.pipelines.sources import Source
    from levilab.present.document.blocks import Block

#: Points printed in the page; more stay in the run folder.
MOST_POINTS = 200


def precession_part(analysis: PrecessionAnalysis) -> ReportPart:
    """Return verdict, lines, power, phase lock, and the points."""
    return ReportPart(
        subject="precession",
        heading="Precession of a driven top",
        lead=f"{analysis.combined.line.n} points used",
        result=(
            Paragraph(" ".join(_meaning(analysis.combined)), "What it means."),
            Tabular("precession-lines", lines_table(analysis), _LINES, first_column_wraps=True),
            *_power(analysis),
        ),
        figure=FigureText(
            title="Precession against drive.",
            caption=(
                "The points with the line and its bands of 95 %; departures from the drive; how far the line follows "
                "each point, and what each does to the slope."
            ),
            alt="Precession against drive with the line, departures from the drive, influence of each point",
            points=points_of(analysis, _figure_points, "readings", "residuals"),
        ),
        runs_title="Phase of the laser's pulses",
        runs=_phases(analysis),
        inputs=input_parts(analysis, _in_words, _readings, lambda run: verdict(run.fit)),
    )


_LINES = (
    f"{VALUE_U} p locked: how probable it is "
    "that the points of a locked top, slope 1 and intercept 0, lie as far off as these; below 0.01 that is excluded. "
    "Slope and intercept are tested together, as they are correlated. The median line (Theil and Sen) goes through all "
    "points, those left out of the fit as well; it stands up to a few wild ones."
)
_PHASES = (
    "Mean vector: length of the mean of unit vectors in the direction of each pulse's phase; 1 where all pulses come "
    "at one phase of the drive, about 1/√n where they come anyhow. Drift: frequency of the pulses − frequency of the "
    "drive. Turns: from the lowest to the highest phase; a locked top stays within one."
)
_POINTS = (
    "Leverage: how far the line follows the point, 0 to 1. Δslope/u: by how many of its u the slope changes without "
    "the point."
)


def _power(analysis: PrecessionAnalysis) -> tuple[Block, ...]:
    """Return the effort that distinguishes the published slope from 1."""
    found = power_table(analysis.combined)
    note = "The slope of 1.05 was published without an uncertainty."
    return (Tabular("precession-power", found, note, first_column_wraps=True),) if found.rows else ()


def _phases(analysis: PrecessionAnalysis) -> tuple[Block, ...]:
    """Return how firmly the laser's pulses follow the drive, run by run."""
    tables = [
        Tabular("precession-phases", coherence_table(run, name)) for run, name in named_runs(analysis) if run.coherences
    ]
    if not tables:
        text = "No records of the oscilloscope were kept: the phase of the laser's pulses on the drive is not known."
        return (Paragraph(text),)
    return *tables, Note(_PHASES)


def _readings(source: Source[SweepReadings], run: PrecessionRun, _: PrecessionOptions) -> tuple[Block, ...]:
    count = len(run.fit.points)
    time = source.readings.time
    clock = with_clock(source.time_zero, None if time is None else time.tolist(), ())
    found = replace(points_table(run, most=MOST_POINTS, clock=clock), title="Points")
    more = first_of(min(count, MOST_POINTS), count)
    return (Tabular("precession-points", found, f"{_POINTS} {more}".rstrip()),)


def _figure_points(run: PrecessionRun) -> Iterator[tuple[str, ...]]:
    """Yield the lines of each point that the line goes through."""
    for point in run.fit.points:
        if point.used:
            yield (
                f"ν_d = {point.drive:.7g} Hz",
                f"ν_p = {with_uncertainty(Estimate(point.precession, point.u, 'Hz'))}",
                f"ν_p − ν_d = {off(point.precession - point.drive, point.u)} Hz",
                f"ν_p − line = {off(point.residual, point.u)} Hz",
            )


def _in_words(source: Source[SweepReadings], run: PrecessionRun, options: PrecessionOptions) -> tuple[str, ...]:
    drive, out = run.fit.column("drive"), sum(not point.used for point in run.fit.points)
    text = f"{len(drive)} points, {drive.min():.4g} Hz to {drive.max():.4g} Hz"
    return text + (f", {out} left out as miscounts" if out else ""), _uncertainty(source, run, options)


def _uncertainty(source: Source[SweepReadings], run: PrecessionRun, options: PrecessionOptions) -> str:
    """Return how large u of a point is, and where it comes from."""
    u = run.fit.column("u")
    if not np.isfinite(u).all():
        return "u of a point: not known, taken from the scatter about the line"
    if options.reading_u is None and source.readings.laser is not None:
        return f"u of a point: {size_of_u(u)}, from the gates of all points, the swing about the drive taken off"
    return f"u of a point: {size_of_u(u)}, {origin_of_u(source, 'precession_frequency_u_hz', options)}"


# --- what it means ---

#: A difference counts from this multiple of its u on.
_DIFFERS = 2.0


def _meaning(fit: SweepFit) -> Iterator[str]:
    """Yield the meaning of the line through all points in sentences that a student understands."""
    line = fit.line
    slope = with_uncertainty(slope_of(fit))
    if fit.p_locked is None or not line.u_slope:
        yield f"The line rises by {slope}; how far that may be off these points do not say, so nothing is tested."
        return
    if fit.locked:
        yield (
            f"Each time the drive turns, the stem cuts the beam once: slope {slope} and intercept agree with 1 and 0, "
            f"as of a top that is locked to its drive (p = {plain(fit.p_locked, 2)})."
        )
    else:
        yield (
            f"The stem does not cut the beam once in each period of the drive: slope {slope} and intercept together "
            f"exclude 1 and 0 (p = {plain(fit.p_locked, 1)}). A top that is not locked, or a counter that misses or "
            "doubles pulses, does that; the free precession does not follow the drive at all."
        )
    theirs = published("thesis")["measured.slope"]  # printed without an uncertainty
    away = abs(line.slope - theirs.value) / line.u_slope
    if away > _DIFFERS:
        yield f"The slope of {theirs.text} that the thesis gives lies {digits(away)} u away from this one."
    else:
        yield (
            f"The slope of {theirs.text} that the thesis gives lies within {digits(away)} u: these points cannot "
            "distinguish it from a locked top's."
        )
    if fit.spin_offset is not None and fit.u_spin_offset:
        offset = abs(fit.spin_offset)
        follows = offset < _DIFFERS * fit.u_spin_offset
        why = (
            "the tape turns with the top." if follows else "is the tape on a washer that slips, or does the top swing?"
        )
        size = digits(1e3 * max(offset, fit.u_spin_offset))
        yield f"The spin that was counted is the drive's frequency to {size} mHz: {why}"
