"""Sweeps → their figure."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.numbers import digits
from analysis.precession.sweep import SweepFit
from levilab.pipelines.precession.analysis import PrecessionAnalysis
from levilab.pipelines.precession.words import intercept_of, miscount_as_text, slope_of
from levilab.present.drawing import SMALL, band, new_figure, panel, run_look
from levilab.present.looks import GREY, LOOKS
from levilab.present.numbers import plain, without_unit
from levilab.present.style import label_of_run
from levilab.texts.text import Text

#: More points have no bars.
MOST_BARS = 200


#: Left edge and width of the panels, and where what explains them begins [inch].
_LEFT, _WIDTH, _BESIDE = 0.66, 3.95, 1.03


def precession_figure(analysis: PrecessionAnalysis) -> Figure:
    """Draw points with line and bands, departures from a locked top, the influence of each point, phase lock."""
    phases = any(run.coherences for run in analysis.runs)
    with new_figure(6.8, _finding(analysis.combined), [one.synthetic for one in analysis.sources]) as figure:
        _draw_line(panel(figure, _LEFT, 0.45, _WIDTH, 2.25), analysis)
        _draw_departures(panel(figure, _LEFT, 3.3, _WIDTH, 1.3), analysis)
        count = 3 if phases else 2
        width = (6.24 - 0.62 * (count - 1)) / count
        panels = [panel(figure, _LEFT + k * (width + 0.62), 5.3, width, 1.0) for k in range(count)]
        _draw_leverage(panels[0], analysis)
        _draw_changes(panels[1], analysis)
        if phases:
            _draw_phases(panels[2], analysis)
    return figure


# --- the line ------------------------------------------------------------------------------------------


def _draw_line(axes: Axes, analysis: PrecessionAnalysis) -> None:
    fit = analysis.combined
    x = _span(fit)
    axes.plot(x, x, linewidth=1, label="locked top: slope 1,\nintercept 0", zorder=2.4, **LOOKS["locked"].as_line)
    label = Text(
        "line: slope {slope:n},\nintercept {intercept:n} Hz",
        slope=without_unit(slope_of(fit)),
        intercept=without_unit(intercept_of(fit)),
    )
    axes.plot(x, fit.line.at(x), linewidth=1.4, label=label, zorder=2.6, **LOOKS["fit"].as_line)
    axes.plot(x, median_line(fit, x), linewidth=1.6, label="median line, robust", zorder=2.7, **LOOKS["robust"].as_line)
    _draw_bands(axes, x, fit.line.at(x), fit, labels=True)
    inside = np.concatenate([run.fit.column("precession")[_used(run.fit)] for run in analysis.runs])
    low, high = min(float(inside.min()), float(x[0])), max(float(inside.max()), float(x[-1]))
    margin = 0.05 * (high - low)
    axes.set_ylim(low - margin, high + margin)
    for k, (run, source) in enumerate(zip(analysis.runs, analysis.sources, strict=True)):
        name = label_of_run(source.name, k, len(analysis.runs), "points")
        _draw_points(axes, analysis, k, run.fit.column("precession"), label=name, gid=f"readings-{k}")
        _draw_left_out(axes, run.fit)
    axes.set(xlabel="frequency of the drive ν$_d$  [Hz]", ylabel="precession ν$_p$  [Hz]")
    axes.legend(loc="upper left", bbox_to_anchor=(_BESIDE, 1.0), borderaxespad=0, labelspacing=0.7)


def median_line(fit: SweepFit, x: Array) -> Array:
    """Return the median line at x [Hz]."""
    return np.asarray(float(fit.robust.intercept.value or 0.0) + float(fit.robust.slope.value or 0.0) * x)


def _finding(fit: SweepFit) -> str:
    if fit.p_locked is None:
        return "Precession against drive"
    follows = "follows" if fit.locked else "does not follow"
    return Text("The precession {follows} the drive one to one (p = {p:n})", follows=follows, p=plain(fit.p_locked, 2))


def _span(fit: SweepFit) -> Array:
    drive = fit.column("drive")
    margin = 0.04 * float(np.ptp(drive))
    return np.linspace(float(drive.min()) - margin, float(drive.max()) + margin, 200)


def _used(fit: SweepFit) -> NDArray[np.bool_]:
    return np.array([point.used for point in fit.points])


def _usual_u(fit: SweepFit) -> float:
    """Return u of a point before it is scaled [Hz]; where none is given, 1: the scale is the scatter itself."""
    u = fit.column("u")[_used(fit)]
    return float(np.median(u)) if np.isfinite(u).all() else 1.0


def _draw_bands(axes: Axes, x: Array, y: Array, fit: SweepFit, *, labels: bool = False) -> None:
    """Draw the bands of 95 % about a line at y [Hz]."""
    if fit.line.u_slope is None:
        return
    usual = fit.line.scale * _usual_u(fit)
    for half, alpha, what in (
        (
            fit.line.prediction_band(x, _usual_u(fit)),
            0.10,
            Text("95 % of further points\nof u = {hz:n} Hz", hz=digits(usual)),
        ),
        (fit.line.confidence_band(x), 0.28, "95 % confidence of the\nline"),
    ):
        band(axes, x, y, half, LOOKS["fit"].colour, alpha=alpha, label=what if labels else None)


def _draw_points(
    axes: Axes,
    analysis: PrecessionAnalysis,
    k: int,
    y: Array,
    *,
    bars: Array | None = None,
    label: str | None = None,
    gid: str | None = None,
) -> None:
    fit, look = analysis.runs[k].fit, run_look(k, len(analysis.runs))
    used = _used(fit)
    few = used.sum() <= MOST_BARS
    if bars is not None and few and np.isfinite(bars).all():
        axes.errorbar(fit.column("drive")[used], y[used], bars[used], elinewidth=0.8, color=look.colour, fmt="none")
    style = look.as_points | {"markersize": 4 if few else 2, "zorder": 3, "label": label, "gid": gid}
    axes.plot(fit.column("drive")[used], y[used], **style)


def _draw_left_out(axes: Axes, fit: SweepFit) -> None:
    """Draw a cross where a point lies; an arrow at the edge, with its value, where it lies beyond."""
    low, high = axes.get_ylim()
    for point in fit.points:
        if point.miscount is None or point.used:
            continue
        beyond = not low <= point.precession <= high
        y = min(max(point.precession, low + 0.03 * (high - low)), high - 0.03 * (high - low))
        marker = "x" if not beyond else "v" if point.precession < low else "^"
        axes.plot(
            point.drive, y, marker=marker, color=LOOKS["left out"].colour, markersize=6, linestyle="none", zorder=5
        )
        text = miscount_as_text(point.miscount)
        text = Text("{hz:.4g} Hz: {miscount}", hz=point.precession, miscount=text) if beyond else text
        last = point.drive > float(fit.column("drive").mean())
        axes.annotate(
            text, (point.drive, y), (-8 if last else 8, -3), textcoords="offset points", fontsize=SMALL,
            color=LOOKS["left out"].of_text, ha="right" if last else "left", zorder=5,
        )  # fmt: skip


# --- departures from a locked top ----------------------------------------------------------------------


def _draw_departures(axes: Axes, analysis: PrecessionAnalysis) -> None:
    """Draw ν_p − ν_d with the u of each point, which differ: noise about zero for a locked top."""
    fit = analysis.combined
    axes.axhline(0, linewidth=1, **LOOKS["locked"].as_line)
    x = _span(fit)
    y = fit.line.at(x) - x
    axes.plot(x, y, linewidth=1.4, **LOOKS["fit"].as_line)
    axes.plot(x, median_line(fit, x) - x, linewidth=1.6, zorder=2.7, **LOOKS["robust"].as_line)
    _draw_bands(axes, x, y, fit)
    scatter = fit.line.scale if fit.line.u_slope else 0.0
    tallest = 0.0
    for k, run in enumerate(analysis.runs):
        u = run.fit.column("u") * fit.line.scale
        bars = np.where(np.isfinite(u), u, scatter)
        off = run.fit.column("precession") - run.fit.column("drive")
        _draw_points(axes, analysis, k, off, bars=bars, gid=f"residuals-{k}")
        tallest = max(tallest, 1.1 * float((np.abs(off) + 2 * bars)[_used(run.fit)].max()))
    if tallest > 0:
        axes.set_ylim(-tallest, tallest)
    axes.set(xlabel="frequency of the drive ν$_d$  [Hz]", ylabel="precession − drive  [Hz]")
    bar = "u of each point" if fit.line.chi_square is not None else "the scatter"
    axes.set_title("Departures from a locked top")
    about = Text("bars: ± {bar};\nlines and bands as above.\nA locked top scatters\nabout the dashed line.", bar=bar)
    axes.text(_BESIDE, 1.0, about, transform=axes.transAxes, va="top", fontsize=8)


# --- influence -----------------------------------------------------------------------------------------


def _draw_leverage(axes: Axes, analysis: PrecessionAnalysis) -> None:
    """Draw how far the line follows each point."""
    for k, run in enumerate(analysis.runs):
        drive, leverage, used = run.fit.column("drive"), run.fit.column("leverage"), _used(run.fit)
        axes.vlines(drive[used], 0, leverage[used], color="black", linewidth=1)
        _draw_points(axes, analysis, k, leverage)
    n = min(run.fit.line.n for run in analysis.runs)
    axes.axhline(2 / n, color=GREY, linestyle="dotted", linewidth=1)
    axes.set(xlabel="ν$_d$  [Hz]", ylabel="leverage", ylim=(0, None))
    axes.set_title(Text("Leverage; dotted: the mean, {mean:n}", mean=digits(2 / n)), loc="left", fontsize=8)


def _draw_changes(axes: Axes, analysis: PrecessionAnalysis) -> None:
    """Draw the change of the slope without each point."""
    axes.axhline(0, color="black", linewidth=0.8)
    tallest = 1.0
    for k, run in enumerate(analysis.runs):
        u = run.fit.line.u_slope or 1.0
        drive, change, used = run.fit.column("drive"), run.fit.column("slope_change") / u, _used(run.fit)
        axes.vlines(drive[used], 0, change[used], color="black", linewidth=1)
        _draw_points(axes, analysis, k, change)
        tallest = max(tallest, 1.2 * float(np.nanmax(np.abs(change))))
    axes.set(xlabel="ν$_d$  [Hz]", ylabel="change / u", ylim=(-tallest, tallest))
    axes.set_title("Slope without the point", loc="left", fontsize=8)


def _draw_phases(axes: Axes, analysis: PrecessionAnalysis) -> None:
    """Draw the mean vector of the pulses at each point that has a record."""
    for k, run in enumerate(analysis.runs):
        drive = [run.fit.points[one.point].drive for one in run.coherences]
        length = [one.coherence.length for one in run.coherences]
        colours = [LOOKS["fit" if one.coherence.locked else "left out"].colour for one in run.coherences]
        axes.vlines(drive, 0, length, color=colours, linewidth=1)
        axes.scatter(drive, length, c=colours, s=14, marker=run_look(k, len(analysis.runs)).marker, zorder=3)
    axes.set(xlabel="ν$_d$  [Hz]", ylabel="mean vector", ylim=(0, 1.05))
    axes.set_title("Phase lock to the drive; 1: firm", loc="left", fontsize=8)
