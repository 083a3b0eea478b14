"""Sweeps → tables, and their part of a report."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from analysis.numbers import digits
from analysis.precession.sweep import Point, SweepFit
from analysis.uncertainty import Estimate
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import PrecessionOptions
from levilab.pipelines.part import (
    VALUE_U,
    FigureText,
    ReportPart,
    first_of,
    input_parts,
    origin_of_u,
    points_of,
    size_of_u,
    title_of,
)
from levilab.pipelines.precession.analysis import PrecessionAnalysis, PrecessionRun
from levilab.pipelines.precession.readings import SweepReadings
from levilab.pipelines.precession.words import at_most, intercept_of, slope_of, verdict
from levilab.present.clock import with_clock
from levilab.present.document.blocks import Block, Note, Paragraph, Tabular
from levilab.present.numbers import (
    column,
    off,
    plain,
    short_name,
    with_decimals,
    with_sign,
    with_uncertainty,
    without_unit,
)
from levilab.present.tables import Row, Table, table
from levilab.simulator.published.printed import published
from levilab.texts.text import Sentences, Text, how_many

#: Points that a terminal shows; more stand in result.json.
MOST_IN_TERMINAL = 60
#: Heads of the table of points, whose numbers stand to the right.
POINT_HEADS = ("ν_d [Hz]", "ν_p [Hz]", "spin [Hz]", "ν_p − ν_d [Hz]", "leverage", "Δslope/u")


def precession_tables(analysis: PrecessionAnalysis) -> tuple[Table, ...]:
    """Return tables of the lines, of the power of the test, and of the points.  Each fits a terminal of 80 columns."""
    tables = [lines_table(analysis), power_table(analysis.combined)]
    tables += [points_table(run, name) for run, name in named_runs(analysis)]
    tables += [coherence_table(run, name) for run, name in named_runs(analysis)]
    return tuple(one for one in tables if one.rows)


def named_runs(analysis: PrecessionAnalysis) -> list[tuple[PrecessionRun, str]]:
    """Return each sweep with the end of its tables' titles."""
    several = len(analysis.runs) > 1
    return [
        (run, Text(" of {name:s}", name=source.name) if several else "")
        for run, source in zip(analysis.runs, analysis.sources, strict=True)
    ]


def lines_table(analysis: PrecessionAnalysis) -> Table:
    """Return the line of each run and of all together, and the median line beside it."""
    total = len(analysis.runs)
    rows = []
    if total > 1:
        for run, source in zip(analysis.runs, analysis.sources, strict=True):
            rows.append(
                Row(
                    (
                        Text("{name:s}: {line}", name=short_name(source.name), line=line_name(run.fit)),
                        *_line_cells(run.fit),
                    )
                )
            )
    together = "together" if total > 1 else "best"
    rows.append(
        Row(
            (
                Text("all points: {line}", line_name(analysis.combined)) if total > 1 else line_name(analysis.combined),
                *_line_cells(analysis.combined),
            ),
            together,
        )
    )
    robust = analysis.combined.robust
    rows.append(Row(("median line, robust", without_unit(robust.slope), without_unit(robust.intercept), "—", "—")))
    rows.append(Row(("locked top", "1", "0", "—", "—")))
    heads = ("line", "slope", "intercept [Hz]", "χ²/dof", "p locked")
    title = title_of("Precession against drive", analysis.sources, "sweep")
    return table(title, heads, rows, numbers=heads[1:])


def line_name(fit: SweepFit) -> str:
    """Return the name of the line, and through how many points it goes."""
    kind = "orthogonal" if fit.line.orthogonal else "weighted" if fit.line.chi_square is not None else "least squares"
    return Text("{kind}, {points}", kind=kind, points=how_many(fit.line.n, "point"))


def _line_cells(fit: SweepFit) -> tuple[str, ...]:
    line = fit.line
    reduced = None if line.chi_square is None else line.chi_square / line.degrees_of_freedom
    return without_unit(slope_of(fit)), without_unit(intercept_of(fit)), plain(reduced), plain(fit.p_locked, 2)


def power_table(fit: SweepFit) -> Table:
    """Return what tells a slope of 1.05 from 1; without an uncertainty of the slope no rows."""
    power = fit.power
    if power is None:
        return table("", (), ())
    needed = "> 10⁶" if power.points_needed is None else str(power.points_needed)
    rows = [
        ("probability of telling it", at_most(power.now), "0.9"),
        (
            "u of the slope",
            plain(fit.line.u_slope),
            plain((fit.line.u_slope or 0.0) * (power.slope - 1) / power.smallest_difference),
        ),
        ("points, u and range as they are", str(power.points), needed),
        ("range of ν_d [Hz], points and u as they are", plain(power.range_hz), plain(power.range_needed_hz)),
        ("u of a point [Hz], all else as it is", plain(power.u_hz, 2), plain(power.u_needed_hz, 2)),
    ]
    title = Text(
        "To tell a slope of {slope:g} from 1 (95 % confidence, power 0.9), any one of the last three", slope=power.slope
    )
    return table(title, ("", "now", "needed"), rows, numbers=("now", "needed"))


def points_table(
    run: PrecessionRun,
    name: str = "",
    most: int = MOST_IN_TERMINAL,
    clock: tuple[Sequence[str], Sequence[tuple[str, ...]]] = ((), ()),
) -> Table:
    """Return the points, the first of many.

    Args:
        run: the sweep.
        name: of the run, for the title.
        most: greatest number of points.
        clock: heads and, of each point, cells that go before the others.
    """
    fit = run.fit
    shown = fit.points[:most]
    departures = column(
        Estimate(one.precession - one.drive, None if one.u is None else math.hypot(one.u, one.u_drive or 0.0), "Hz")
        for one in shown
    )
    rows = [
        Row((*when, *_point_cells(fit, point, departure)), "" if point.used else "outlier")
        for point, departure, when in zip(shown, departures, clock[1] or [()] * len(shown), strict=False)
    ]
    more = Text(" (the first {shown} of {n})", shown=most, n=len(fit.points)) if len(fit.points) > most else ""
    return table(
        Text("Points{of}{first}", of=name, first=more),
        (*clock[0], *POINT_HEADS),
        rows,
        numbers=(*clock[0], *POINT_HEADS),
    )


def _point_cells(fit: SweepFit, point: Point, departure: str) -> tuple[str, ...]:
    change = None if point.slope_change is None or not fit.line.u_slope else point.slope_change / fit.line.u_slope
    return (
        without_unit(Estimate(point.drive, point.u_drive, "Hz")) if point.u_drive else f"{point.drive:.7g}",
        without_unit(Estimate(point.precession, point.u, "Hz")),
        "—" if point.spin is None else without_unit(Estimate(point.spin, point.u_spin, "Hz")),
        departure,
        plain(point.leverage, 2) if point.used else "left out",
        "—" if change is None else with_sign(change, 2),
    )


def coherence_table(run: PrecessionRun, name: str = "") -> Table:
    """Return how firmly the laser's pulses follow the drive, record by record."""
    drifts = column(
        Estimate(1e3 * one.coherence.drift_hz, 1e3 * one.coherence.u_drift_hz, "mHz") for one in run.coherences
    )
    rows = [
        (
            f"{run.fit.points[one.point].drive:.6g}",
            str(one.coherence.pulses),
            f"{one.coherence.length:.4f}",
            with_decimals(math.degrees(one.coherence.phase_rad), 0),
            drift,
            f"{one.coherence.excursion_turns:.2f}",
            "yes" if one.coherence.locked else "no",
        )
        for one, drift in zip(run.coherences, drifts, strict=True)
    ]
    heads = ("ν_d [Hz]", "pulses", "mean vector", "phase [°]", "drift [mHz]", "turns", "locked")
    return table(Text("Phase of the laser's pulses on the drive{of}", of=name), heads, rows, numbers=heads[:6])


# --- readings as columns of tables for programs ---

#: Name of the column → attribute of a point; its u on the line holds the swing, which that of a reading does not.
_COLUMNS = {
    "drive_frequency_hz": "drive",
    "drive_frequency_u_hz": "u_drive",
    "precession_frequency_hz": "precession",
    "point_u_hz": "u",
    "spin_frequency_hz": "spin",
    "spin_frequency_u_hz": "u_spin",
    "residual_hz": "residual",
}


def precession_columns(analysis: PrecessionAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the points of each sweep; residual_hz: point less the sweep's own line, of unused points too."""
    for run in analysis.runs:
        used = np.array([point.used for point in run.fit.points])
        yield {name: run.fit.column(attribute) for name, attribute in _COLUMNS.items()} | {"used": used}


def precession_curve_u(analysis: PrecessionAnalysis, number: int, model: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return the standard uncertainty [Hz] of a line fitted to one sweep, of drive frequencies [Hz]; NaN: undefined."""
    line = analysis.runs[number].fit.line
    return line.u_at if model != "robust" else lambda drive: np.full_like(drive, np.nan)


def precession_curve(analysis: PrecessionAnalysis, number: int, model: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return the precession frequency [Hz] of a line fitted to one sweep, of drive frequencies [Hz]."""
    fit = analysis.runs[number].fit
    if model != "robust":
        return lambda drive: fit.line.intercept + fit.line.slope * drive
    slope, intercept = fit.robust.slope.value or 0.0, fit.robust.intercept.value or 0.0
    return lambda drive: intercept + slope * drive


#: Points printed in the page; more stay in the run folder.
MOST_POINTS = 200


def precession_part(analysis: PrecessionAnalysis) -> ReportPart:
    """Return verdict, lines, power, phase lock, and the points."""
    return ReportPart(
        subject="precession",
        heading="Precession of a driven top",
        lead=Text("{points} used", points=how_many(analysis.combined.line.n, "point")),
        result=(
            Paragraph(Sentences(*_meaning(analysis.combined)), "What it means."),
            Tabular("precession-lines", lines_table(analysis), _LINES, first_column_wraps=True),
            *_power(analysis),
        ),
        figure=FigureText(
            title="Precession against drive.",
            caption=(
                "The points with the line and its bands of 95 %; departures from the drive; how far the line follows "
                "each point, and what each does to the slope."
            ),
            points=points_of(analysis, _figure_points, "readings", "residuals"),
        ),
        runs_title="Phase of the laser's pulses",
        runs=_phases(analysis),
        inputs=input_parts(analysis, _in_words, _readings, lambda run: verdict(run.fit)),
    )


_LINES = Sentences(
    VALUE_U,
    "p locked: how probable it is that the points of a locked top, slope 1 and intercept 0, lie as far off as these; "
    "below 0.01 that is excluded. Slope and intercept are tested together, as they are correlated. The median line "
    "(Theil and Sen) goes through all points, those left out of the fit as well; it stands up to a few wild ones.",
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
    return (Tabular("precession-points", found, Sentences(_POINTS, more)),)


def _figure_points(run: PrecessionRun) -> Iterator[tuple[str, ...]]:
    """Yield the lines of each point that the line goes through."""
    for point in run.fit.points:
        if point.used:
            yield (
                f"ν_d = {point.drive:.7g} Hz",
                f"ν_p = {with_uncertainty(Estimate(point.precession, point.u, 'Hz'))}",
                f"ν_p − ν_d = {off(point.precession - point.drive, point.u)} Hz",
                Text("ν_p − line = {off:n} Hz", off=off(point.residual, point.u)),
            )


def _in_words(source: Source[SweepReadings], run: PrecessionRun, options: PrecessionOptions) -> tuple[str, ...]:
    drive, out = run.fit.column("drive"), sum(not point.used for point in run.fit.points)
    text = Text(
        "{points}, {first:.4g} Hz to {last:.4g} Hz",
        points=how_many(len(drive), "point"),
        first=float(drive.min()),
        last=float(drive.max()),
    )
    text = Text("{points}, {out} left out as miscounts", points=text, out=out) if out else text
    return text, _uncertainty(source, run, options)


def _uncertainty(source: Source[SweepReadings], run: PrecessionRun, options: PrecessionOptions) -> str:
    """Return how large u of a point is, and where it comes from."""
    u = run.fit.column("u")
    if not np.isfinite(u).all():
        return "u of a point: not known, taken from the scatter about the line"
    if options.reading_u is None and source.readings.laser is not None:
        return Text(
            "u of a point: {u}, from the gates of all points, the swing about the drive taken off", u=size_of_u(u)
        )
    return Text("u of a point: {u}, {source}", size_of_u(u), origin_of_u(source, "precession_frequency_u_hz", options))


# --- what it means ---

#: A difference counts from this multiple of its u on.
_DIFFERS = 2.0


def _meaning(fit: SweepFit) -> Iterator[str]:
    """Yield the meaning of the line through all points in sentences that a student understands."""
    line = fit.line
    if fit.p_locked is None or not line.u_slope:
        yield Text(
            "The line rises by {slope:n}; how far that may be off these points do not say, so nothing is tested.",
            slope=with_uncertainty(slope_of(fit)),
        )
        return
    if fit.locked:
        yield "Each time the drive turns, the stem cuts the beam once, as for a top that is locked to its drive."
    else:
        yield (
            "The stem does not cut the beam once in each period of the drive: the top is not locked, or the counter "
            "misses or doubles pulses; the free precession does not follow the drive at all."
        )
    theirs = published("thesis")["measured.slope"]  # printed without an uncertainty
    away = abs(line.slope - theirs.value) / line.u_slope
    if away > _DIFFERS:
        yield Text(
            "The slope of {slope:n} that the thesis gives lies {away:n} u away from this one.",
            slope=theirs.text,
            away=digits(away),
        )
    else:
        yield Text(
            "The slope of {slope:n} that the thesis gives lies within {away:n} u: these points cannot "
            "distinguish it from a locked top's.",
            slope=theirs.text,
            away=digits(away),
        )
    if fit.spin_offset is not None and fit.u_spin_offset:
        offset = abs(fit.spin_offset)
        follows = offset < _DIFFERS * fit.u_spin_offset
        why = (
            "the tape turns with the top." if follows else "is the tape on a washer that slips, or does the top swing?"
        )
        size = digits(1e3 * max(offset, fit.u_spin_offset))
        yield Text("The spin that was counted is the drive's frequency to {size:n} mHz: {why}", size=size, why=why)
