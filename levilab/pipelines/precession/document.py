"""Sweeps → uncertainty budgets and result.json."""

from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from analysis.arrays import Array
from analysis.budget import Budget, Component, printed_step, rest, u_of_step
from analysis.numbers import digits
from analysis.precession.line import Line
from analysis.precession.sweep import SweepFit
from levilab.pipelines.budget import gate_of, time_base
from levilab.pipelines.document import Analysis, number, values_of
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import PrecessionOptions
from levilab.pipelines.precession.analysis import EXPERIMENT, PrecessionAnalysis, PrecessionRun, combine, fit_source
from levilab.pipelines.precession.readings import SweepReadings, read_sweep_file, read_sweep_run
from levilab.pipelines.precession.report import (
    precession_columns,
    precession_curve,
    precession_curve_u,
    precession_part,
    precession_tables,
)
from levilab.pipelines.precession.words import PRECESSION_ROW, QUANTITIES, intercept_of, slope_of, verdict
from levilab.pipelines.row import find_all, symbols_of
from levilab.texts.text import Text

#: Relative uncertainties of the drive's frequency that differ by less than this are those of one clock.
_ONE_CLOCK = 1e-3
#: Four times as many points of the same range halve u.
_TO_HALVE = 4


def budget_of_run(source: Source[SweepReadings], run: PrecessionRun, options: PrecessionOptions) -> tuple[Budget, ...]:
    """Return the budgets of slope and intercept of one sweep."""
    return _budgets(source, run.fit, options)


def budget_of_all(analysis: PrecessionAnalysis) -> tuple[Budget, ...]:
    """Return the budgets of the line through the points of all sweeps."""
    return _budgets(analysis.sources[0], analysis.combined, analysis.options)


def _budgets(source: Source[SweepReadings], fit: SweepFit, options: PrecessionOptions) -> tuple[Budget, ...]:
    line = fit.line
    if not line.u_slope or not line.u_intercept or not line.u_height:
        return ()
    used = np.array([point.used for point in fit.points])
    x = fit.column("drive")[used]
    u, u_drive = (fit.column(name)[used] for name in ("u", "u_drive"))
    along_y = np.ones_like(x) if not np.isfinite(u).all() else u
    along_x = np.zeros_like(x)
    if line.orthogonal:
        along_x = along_y if not np.isfinite(u_drive).all() or not np.isfinite(u).all() else u_drive
    weight = 1 / (along_y**2 + (line.slope * along_x) ** 2)
    off = x - line.centre
    by_slope = weight * off * (line.u_slope / line.scale) ** 2  # change of the slope with each point
    by_intercept = weight * (line.u_height / line.scale) ** 2 - line.centre * by_slope
    made = (
        ("slope", line.slope, line.u_slope, "1", by_slope),
        ("intercept", line.intercept, line.u_intercept, "Hz", by_intercept),
    )
    return tuple(
        Budget(
            name, value, u_value, unit,
            (
                *_of_points(source, fit, options, u_value, (by, along_y, line.slope * along_x)),
                *_of_clocks(source, fit, options, name),
            ),
        )
        for name, value, u_value, unit, by in made
    )  # fmt: skip


def _of_points(
    source: Source[SweepReadings],
    fit: SweepFit,
    options: PrecessionOptions,
    whole: float,
    influence: tuple[Array, Array, Array],
) -> Iterator[Component]:
    """Yield what the points scatter.

    Args:
        source: the sweep.
        fit: its line.
        options: of the analysis.
        whole: u of the result.
        influence: change of the result with each point, and u of each along both axes, shape (n,) each [Hz].
    """
    by, along_y, along_x = influence
    line = fit.line
    stated = all(point.u is not None for point in fit.points if point.used)
    own_scale = min(line.scale, 1.0) if stated else line.scale
    # an orthogonal fit moves its points along x, too: the squares are shared out as the variances of the points are
    share = float(np.sum((by * along_x) ** 2) / np.sum(by**2 * (along_x**2 + along_y**2)))
    scatter = whole * own_scale / line.scale
    of_counts, of_drive = scatter * (1 - share) ** 0.5, scatter * share**0.5
    each = own_scale * float(np.sqrt(np.mean(along_y**2)))
    counts = source.readings.precession
    step = printed_step(counts.tolist()) or 0.0
    rounding, is_part = u_of_step(step), u_of_step(step) < each
    sensitivity = of_counts / each
    if rounding > 0:
        note: str = Text(
            "steps of {step:g} Hz, {within}",
            step=step,
            within="a part of what a point scatters" if is_part else "more than the u of a point",
        )
        yield Component("resolution", "last digit of the counts", "B", rounding, "Hz", sensitivity,
                        included=is_part, note=note, remedy="more digits")  # fmt: skip
    what, kind, note = _what_points(options, stated=stated)
    own = rest(each, rounding) if is_part else each
    yield Component("scatter", what, kind, own, "Hz", sensitivity, note=note, remedy=_better(source, fit))
    if of_drive > 0:
        yield Component("drive", "frequency of the drive, point by point", "B", of_drive, _unit(fit, whole), 1.0,
                        note="its u counts along the other axis", remedy="a generator of a better clock")  # fmt: skip
    excess = rest(whole, scatter)
    if stated and line.scale > 1:
        note = Text("the points scatter {times:n} times as much as their u says", times=digits(line.scale))
        yield Component("excess", "scatter beyond the u of the points", "A", excess, _unit(fit, whole), 1.0,
                        note=note, remedy="finding what moves the points, such as miscounts")  # fmt: skip


def _unit(fit: SweepFit, whole: float) -> str:
    return "1" if whole == fit.line.u_slope else "Hz"


def _what_points(options: PrecessionOptions, *, stated: bool) -> tuple[str, Literal["A", "B"], str]:
    """Return what the scatter is called, its type, and where its size comes from."""
    if not stated:
        return "scatter of the points", "A", "standard deviation about the line"
    if options.reading_u:
        return "points, by their stated u", "B", "as given to the analysis"
    return "points, by their own u", "A", "of a run: what its gates leave beside the swing of the locked top"


def _better(source: Source[SweepReadings], fit: SweepFit) -> str:
    counts, gate = source.number(EXPERIMENT, "counts"), gate_of(source, EXPERIMENT)
    n = fit.line.n
    text = Text(
        "a wider range of drive frequencies (u falls with it), or {n} points instead of {now} to halve it",
        n=_TO_HALVE * n,
        now=n,
    )
    if counts and gate:
        gates = "{range}; or longer or more gates a point ({gates:g} of {gate:g} s now)"
        return Text(gates, range=text, gates=counts, gate=gate)
    return text


def _of_clocks(
    source: Source[SweepReadings], fit: SweepFit, options: PrecessionOptions, name: str
) -> Iterator[Component]:
    """Yield the clocks of counter and generator: their ratio is a factor of the slope, and common to all points."""
    line = fit.line
    value = line.slope if name == "slope" else line.intercept
    used = [point for point in fit.points if point.used]
    ratios = np.array([point.u_drive / point.drive for point in used if point.u_drive])
    known = float(np.median(ratios)) if len(ratios) == len(used) else None
    one_clock = known is not None and float(np.ptp(ratios)) <= _ONE_CLOCK * known
    if options.clock_u is None and one_clock and not line.orthogonal and name == "slope":
        note = "the generator's clock by the counter's, from the column of the drive's u; one factor for all points"
        yield Component("clocks", "clocks of counter and generator", "B", known, "1", value,
                        included=False, note=note, remedy="one reference for both")  # fmt: skip
    elif not line.orthogonal or name == "intercept":
        yield time_base(source, "counter", value, options.clock_u)


def _about(fit: SweepFit) -> dict[str, Any]:
    return {
        "values": values_of(find_all(QUANTITIES, fit)),
        "models": [_line(fit), _robust(fit)],
        "verdict": verdict(fit),
    }


def _line(fit: SweepFit) -> dict[str, Any]:
    line = fit.line
    return {
        "name": "orthogonal" if line.orthogonal else "weighted",
        "parameters": values_of({"slope": slope_of(fit), "intercept": intercept_of(fit)}),
        "covariance": _covariance(line.u_slope, line.u_intercept, line.correlation),
        "centred": {
            "centre": number(line.centre, "Hz"),
            "height": number(line.height, "Hz", line.u_height),
            "covariance": _covariance(line.u_slope, line.u_height, 0.0),
        },
        "statistics": _statistics(fit, fit.column("residual"), line),
    }


def _robust(fit: SweepFit) -> dict[str, Any]:
    slope, intercept = fit.robust.slope, fit.robust.intercept
    left = fit.column("precession") - float(intercept.value or 0.0) - float(slope.value or 0.0) * fit.column("drive")
    return {
        "name": "robust",
        "parameters": values_of({"slope": slope, "intercept": intercept}),
        "covariance": None,
        "centred": None,
        "statistics": _statistics(fit, left, None),
    }


def _statistics(fit: SweepFit, residual: np.ndarray, line: Line | None) -> dict[str, Any]:
    """Return the statistics of a line.  line: None for the median line, which goes through all points."""
    if line:
        residual = residual[[point.used for point in fit.points]]
    chi_square = line.chi_square if line else None
    return {
        "n": residual.size,
        "degrees_of_freedom": residual.size - 2,
        "freedom_of_u": line.freedom if line else None,
        "rms_residual": float(np.sqrt(np.mean(residual**2))),
        "reduced_chi_square": None if line is None or chi_square is None else chi_square / line.degrees_of_freedom,
        "p_fit": line.p_fit if line else None,
    }


def _covariance(u: float | None, v: float | None, correlation: float | None) -> list[list[float]] | None:
    if u is None or v is None or correlation is None:
        return None
    return [[u * u, correlation * u * v], [correlation * u * v, v * v]]


PRECESSION = Analysis(
    name="precession",
    experiments=frozenset({"precession"}),
    read_file=read_sweep_file,
    read_run=read_sweep_run,
    particular=True,
    kind=PrecessionAnalysis,
    options=PrecessionOptions,
    fit=fit_source,
    combine=lambda _, runs, options: combine(runs, options),
    mixed="a line through both says nothing about a real top",
    budget_of_run=budget_of_run,
    budget_of_all=budget_of_all,
    finding=PrecessionRun,
    combination=SweepFit,
    entries=lambda analysis: _about(analysis.combined),
    run_entries=lambda run: _about(run.fit),
    tables=precession_tables,
    part=precession_part,
    columns=precession_columns,
    row=PRECESSION_ROW,
    symbols=symbols_of(QUANTITIES),
    curve=precession_curve,
    curve_u=precession_curve_u,
    compared=("slope", "intercept"),
)
