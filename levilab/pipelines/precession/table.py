"""Sweeps → tables, for the terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from analysis.uncertainty import Estimate
from levilab.pipelines.part import title_of
from levilab.pipelines.precession.words import at_most, intercept_of, slope_of
from levilab.present.numbers import column, plain, short_name, with_decimals, with_sign, without_unit
from levilab.present.tables import Row, Table, table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from analysis.precession.sweep import Point, SweepFit
    from levilab.pipelines.precession.analysis import PrecessionAnalysis, PrecessionRun

#: Points that a terminal shows; more stand in result.json.
MOST_POINTS = 60
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
        (run, f" of {source.name}" if several else "")
        for run, source in zip(analysis.runs, analysis.sources, strict=True)
    ]


def lines_table(analysis: PrecessionAnalysis) -> Table:
    """Return the line of each run and of all together, and the median line beside it."""
    total = len(analysis.runs)
    rows = []
    if total > 1:
        for run, source in zip(analysis.runs, analysis.sources, strict=True):
            rows.append(Row((f"{short_name(source.name)}: {line_name(run.fit)}", *_line_cells(run.fit))))
    together = "together" if total > 1 else "best"
    rows.append(
        Row(
            (("all points: " if total > 1 else "") + line_name(analysis.combined), *_line_cells(analysis.combined)),
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
    return f"{kind}, {fit.line.n} points"


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
    title = f"To tell a slope of {power.slope:g} from 1 (95 % confidence, power 0.9), any one of the last three"
    return table(title, ("", "now", "needed"), rows, numbers=("now", "needed"))


def points_table(
    run: PrecessionRun,
    name: str = "",
    most: int = MOST_POINTS,
    clock: tuple[Sequence[str], Sequence[tuple[str, ...]]] = ((), ()),
) -> Table:
    """Return the points, the first of many.

    Args:
        run: the sweep.
        name: of the run, for the title.
        most: so many points at most.
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
    more = f" (the first {most} of {len(fit.points)})" if len(fit.points) > most else ""
    return table(f"Points{name}{more}", (*clock[0], *POINT_HEADS), rows, numbers=(*clock[0], *POINT_HEADS))


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
    return table(f"Phase of the laser's pulses on the drive{name}", heads, rows, numbers=heads[:6])


# --- readings as columns of tables for programs ---

#: Name of the column → attribute of a point.
_COLUMNS = {
    "drive_frequency_hz": "drive",
    "drive_frequency_u_hz": "u_drive",
    "precession_frequency_hz": "precession",
    "precession_frequency_u_hz": "u",
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
