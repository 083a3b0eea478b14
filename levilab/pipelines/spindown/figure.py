"""Spin-downs → their figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font

from analysis.numbers import digits
from levilab.pipelines.spindown.laws import SHOWN_LAWS, SYMBOLS
from levilab.pipelines.spindown.table import tilt_part
from levilab.present.numbers import in_words, short_name
from levilab.present.style import STYLE, row

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from levilab.pipelines.spindown.analysis import SpinDownAnalysis

    Array = NDArray[np.float64]

#: One a run, as long as there are so few.
MARKERS = "osD^vP*X"
#: The laws that have a straight line.
STRAIGHT_LINES = {name: law.straight for name, law in SHOWN_LAWS.items() if law.straight}
#: More points than a panel can show are thinned out evenly; up to so many have bars each; so many means of more.
MOST_POINTS, MOST_BARS, MEANS = 600, 200, 40
#: A bar longer than the marker's radius, as part of the panel's height, is seen; outliers with their value written.
_SEEN, _MOST_NAMED = 1 / 120, 6


def spindown_figure(analysis: SpinDownAnalysis) -> Figure:
    """Readings and laws; residuals of every law; the straight lines one draws on paper, and what departs from them."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 12.5))
        if len(analysis.runs) > len(MARKERS):
            spin, by_run = row(figure, 0.665, 0.31, 2, gap=0.09)
            _draw_spin(spin, analysis)
            _draw_by_run(by_run, analysis)
        else:
            _draw_spin(row(figure, 0.665, 0.31)[0], analysis)
        _draw_residuals(figure, row(figure, 0.425, 0.15, len(SHOWN_LAWS), gap=0.055), analysis)
        _draw_straight_lines(
            figure,
            row(figure, 0.16, 0.185, len(STRAIGHT_LINES), gap=0.095),
            row(figure, 0.04, 0.105, len(STRAIGHT_LINES), gap=0.095),
            analysis,
        )
    return figure


# --- readings and laws ---------------------------------------------------------------------------------


def _draw_spin(axes: Axes, analysis: SpinDownAnalysis) -> None:
    """The readings of all runs, every law through the first, the best one through each."""
    span = _set_range(axes, analysis)
    for name in SHOWN_LAWS:
        _draw_law(axes, analysis, name)
    for k in range(len(analysis.runs)):
        _draw_readings(axes, analysis, k, analysis.runs[k].frequency, span, label=_run_label(analysis, k))
        _draw_outliers(axes, analysis, k)
    axes.set(xlabel="time  [s]", ylabel="spin frequency ν  [Hz]")
    together = "" if len(analysis.runs) == 1 else f" of {len(analysis.runs)} runs"
    many = len(analysis.runs) > len(MARKERS)
    what = "" if many else ": readings and drag laws"
    axes.set_title(f"Spin-down{together}{what}{_synthetic(analysis)}", loc="left", fontsize=11)
    axes.legend(
        loc="upper right", ncols=2 if len(axes.get_lines()) > 9 and not many else 1, fontsize=8 if many else None
    )


def _set_range(axes: Axes, analysis: SpinDownAnalysis) -> float:
    """What the readings used need, and no more: an outlier squeezes nothing."""
    low = min(float(run.frequency.min()) for run in analysis.runs)
    high = max(float(run.frequency.max()) for run in analysis.runs)
    margin = 0.06 * (high - low) or 0.06 * high
    axes.set_ylim(low - margin, high + margin)
    return high - low + 2 * margin


def _draw_law(axes: Axes, analysis: SpinDownAnalysis, name: str) -> None:
    """One law; with several runs through the first one alone, unless it is the best."""
    verdict, best = analysis.combined.verdict, name == analysis.combined.best
    excluded = name in dict(verdict.excluded)
    as_good = name in verdict.needless or (name in verdict.indistinguishable and not best)
    note = "excluded" if excluded else "fits as well" if as_good else "best" if best and verdict.decided else ""
    label = f"{name}   {SHOWN_LAWS[name].equation}" + (f"   ({note})" if note else "")
    several = len(analysis.runs)
    thick = 2.4 if several == 1 and not _many(analysis) else 1.2 if several <= len(MARKERS) else 0.4
    for k, run in enumerate(analysis.runs if best else analysis.runs[:1]):
        t = np.linspace(run.time[0], run.time[-1], 200)
        axes.plot(
            t,
            run.fit(name).spin_frequency(t),
            color=SHOWN_LAWS[name].colour,
            linestyle="dashed" if excluded else "solid",
            linewidth=thick if best else 1.0,
            zorder=2.5 if best else 2.2,
            label=label if k == 0 else None,
        )


def _draw_by_run(axes: Axes, analysis: SpinDownAnalysis) -> None:
    """The best law's constant in each run with its u, their mean and their scatter: does it drift, is one apart?"""
    best = analysis.combined.fit(analysis.combined.best)
    name, mean = next(iter(best.constants.items()))
    found = [run.fit(best.name).parameters[name] for run in analysis.runs]
    value, u = (
        np.array([np.nan if x is None else x for x in of]) for of in zip(*((f.value, f.u) for f in found), strict=True)
    )
    power = _power_of_ten(value)
    value, u = value / 10.0**power, u / 10.0**power
    number = np.arange(1, len(found) + 1)
    colour = SHOWN_LAWS[best.name].colour
    if mean.value is not None:
        if mean.scatter is not None:
            ends = ((mean.value + side * mean.scatter) / 10.0**power for side in (-1, 1))
            axes.axhspan(*ends, color="black", alpha=0.12, linewidth=0)
        axes.axhline(mean.value / 10.0**power, color=colour, linewidth=1.2)
    few = len(found) <= MOST_BARS
    axes.errorbar(number, value, u if few else None, color=colour, linestyle="none", marker="o",
                  markersize=3 if few else 1.5, elinewidth=0.8)  # fmt: skip
    unit = in_words(mean.unit).replace("^−½", "$^{−1/2}$").replace("^(1−n)", "$^{1−n}$")
    times = f"$10^{{{power}}}$ ".replace("-", "−") if power else ""
    axes.set(xlabel="run, in the order of the table", ylabel=f"{SYMBOLS[name]}  [{times}{unit}]")
    axes.set_title(f"{SYMBOLS[name]} of the {best.name} law run by run; grey: ±s", loc="left", fontsize=11)


def _power_of_ten(values: Array) -> int:
    """The power of ten for an axis's label: written above the axis, it would push the title out of the figure."""
    largest = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
    return math.floor(math.log10(largest)) if largest > 0 and not 0.01 <= largest < 1e4 else 0


def _run_label(analysis: SpinDownAnalysis, k: int) -> str | None:
    """A name for each of a few runs, a number for many."""
    if len(analysis.runs) <= len(MARKERS):
        return _drawable(short_name(analysis.sources[k].name))
    return f"{len(analysis.runs)} runs" if k == 0 else None


def _drawable(name: str) -> str:
    """A name as a legend shows it: no formula, no hidden label, and no character that the font lacks."""
    font = get_font(findfont("DejaVu Sans"))
    text = "".join(c if c.isprintable() and font.get_char_index(ord(c)) else "□" for c in name)
    text = text if len(text) <= 40 else text[:39] + "…"
    return (" " if text.startswith("_") else "") + text.replace("\\", "\\\\").replace("$", r"\$")


def _draw_outliers(axes: Axes, analysis: SpinDownAnalysis, k: int) -> None:
    """A cross where it lies; an arrow at the edge, with its value, where it lies beyond."""
    readings, outliers = analysis.sources[k].readings, np.array(analysis.runs[k].outliers, dtype=np.intp)
    t, nu = readings.time[outliers], readings.frequency[outliers]
    low, high = axes.get_ylim()
    style: Any = {"color": "red", "linestyle": "none", "zorder": 5}
    edges = (("x", (low <= nu) & (nu <= high), None), ("^", nu > high, 0.97), ("v", nu < low, 0.03))
    first = "outlier" not in axes.get_legend_handles_labels()[1]
    for marker, chosen, share in edges:
        if not chosen.any():
            continue
        shown = np.flatnonzero(chosen)[_thin(int(chosen.sum()), MOST_POINTS)]
        y = nu[shown] if share is None else np.full(len(shown), low + share * (high - low))
        axes.plot(t[shown], y, marker=marker, markersize=8, label="outlier" if first else None, **style)
        first = False
        for i in range(min(len(shown), _MOST_NAMED) if share else 0):
            text = f"{nu[shown[i]]:.4g} Hz"
            axes.annotate(text, (t[shown[i]], y[i]), (7, -3), textcoords="offset points", color="red", fontsize=8)


def _synthetic(analysis: SpinDownAnalysis) -> str:
    made_up = sum(source.synthetic for source in analysis.sources)
    if not made_up:
        return ""
    return "  (SYNTHETIC)" if made_up == len(analysis.sources) else f"  ({made_up} of them SYNTHETIC)"


# --- residuals -----------------------------------------------------------------------------------------


def _draw_residuals(figure: Figure, panels: list[Axes], analysis: SpinDownAnalysis) -> None:
    """What each law leaves over, each on its own scale: it should be noise about zero, without a shape."""
    u = _usual_u(analysis)
    band = "" if u is None else f"; grey: ±u of one reading, {digits(u)} Hz"
    means = "; black: means" if _many(analysis) else ""
    _head(figure, 0.605, f"Residuals, reading − law, each law on its own scale{band}{means}{_tilt_in_words(analysis)}")
    for axes, name in zip(panels, SHOWN_LAWS, strict=True):
        residuals = [run.fit(name).residuals for run in analysis.runs]
        most = max(float(np.abs(r).max()) for r in residuals)
        limit = max(1.1 * (most + (u or 0.0)), 1e-12 * float(analysis.runs[0].frequency[0]))
        if u is not None:
            axes.axhspan(-u, u, color="black", alpha=0.12, linewidth=0)
        axes.axhline(0, color="black", linewidth=0.8)
        for k, values in enumerate(residuals):
            _draw_tilt(axes, analysis, k, name, limit)
            _draw_readings(axes, analysis, k, values, 2 * limit, colour=SHOWN_LAWS[name].colour)
            _draw_means(axes, analysis, values)
        axes.set(ylim=(-limit, limit), xlabel="time  [s]")
        axes.tick_params(labelsize=7)
        axes.set_title(name, loc="left", color=SHOWN_LAWS[name].colour, fontweight="bold", pad=9)
        axes.set_title(f"to ±{digits(most)} Hz", loc="right", color="dimgrey", fontsize=8, pad=9)
    panels[0].set_ylabel("residual  [Hz]")


def _draw_tilt(axes: Axes, analysis: SpinDownAnalysis, k: int, name: str, limit: float) -> None:
    """What tilt and wobble add to the count of run k, by one law, brought to the panel's scale of ±limit."""
    run = analysis.runs[k]
    fit = run.fit(name)
    if fit.has_tilt:
        t = np.linspace(run.time[0], run.time[-1], 100)
        added = tilt_part(fit, t)
        y = 0.9 * limit * added / float(np.abs(added).max())
        axes.plot(t, y, color="dimgrey", linestyle="dotted", linewidth=1.2, zorder=2)


def _tilt_in_words(analysis: SpinDownAnalysis) -> str:
    """What the dotted curves are; empty where no run shows a tilt."""
    fits = [run.fit(analysis.combined.best) for run in analysis.runs]
    most = [float(np.abs(tilt_part(fit, run.time)).max()) for fit, run in zip(fits, analysis.runs, strict=True)]
    return f"; dotted: what the tilt adds to the count, up to {digits(max(most))} Hz, not to scale" if max(most) else ""


def _usual_u(analysis: SpinDownAnalysis) -> float | None:
    known = [run.u for run in analysis.runs if run.u is not None]
    return float(np.median(np.concatenate(known))) if known else None


# --- straight lines ------------------------------------------------------------------------------------


def _draw_straight_lines(figure: Figure, above: list[Axes], below: list[Axes], analysis: SpinDownAnalysis) -> None:
    """Where a law holds, its points lie on the line, and the strip below shows noise about zero."""
    _head(figure, 0.375, "Straight lines as one draws them on paper; below each, how far the points lie from the line")
    for panel, strip, (law, straight) in zip(above, below, STRAIGHT_LINES.items(), strict=True):
        _draw_straight(panel, strip, analysis, straight.transform, law)
        panel.set_ylabel(straight.axis)
        panel.set_title(f"straight if {law} holds", loc="left", color=SHOWN_LAWS[law].colour, fontweight="bold", pad=9)
        panel.tick_params(labelbottom=False)
        strip.set(xlabel="time  [s]", xlim=panel.get_xlim())
    most = max(abs(limit) for strip in below for limit in strip.get_ylim())
    for strip in below:
        strip.set_ylim(-most, most)  # in parts of the range, so that one sees which line is the straightest
    below[0].set_ylabel("off the line\n[% of the range]")


def _draw_straight(
    panel: Axes, strip: Axes, analysis: SpinDownAnalysis, transform: Callable[[Array], Array], law: str
) -> None:
    strip.axhline(0, color=SHOWN_LAWS[law].colour, linewidth=1)
    for k, run in enumerate(analysis.runs):
        y = transform(2 * np.pi * run.frequency)
        line = np.polynomial.Polynomial.fit(run.time, y, 1)(run.time)
        panel.plot(run.time[[0, -1]], line[[0, -1]], color=SHOWN_LAWS[law].colour, linewidth=1)
        _draw_readings(panel, analysis, k, y)
        off = 100 * (y - line) / (np.ptp(y) or 1.0)
        _draw_readings(strip, analysis, k, off)
        _draw_means(strip, analysis, off)


# --- what the panels share -----------------------------------------------------------------------------


def _head(figure: Figure, y: float, text: str) -> None:
    figure.text(0.01, y, text, fontsize=10)


def _many(analysis: SpinDownAnalysis) -> bool:
    """Whether only means show what shape the noise hides."""
    return len(analysis.runs) == 1 and len(analysis.runs[0].time) > MOST_BARS


def _draw_means(axes: Axes, analysis: SpinDownAnalysis, y: Array) -> None:
    if _many(analysis):
        time = analysis.runs[0].time
        parts = np.array_split(np.arange(len(y)), MEANS)
        axes.plot([time[p].mean() for p in parts], [y[p].mean() for p in parts], color="black", linewidth=1.2, zorder=4)


def _thin(n: int, most: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, n - 1, min(n, most)).astype(np.intp))


def _draw_readings(
    axes: Axes,
    analysis: SpinDownAnalysis,
    k: int,
    y: Array,
    span: float | None = None,
    *,
    colour: str | None = None,
    label: str | None = None,
) -> None:
    """One number for each reading of run k: points, with bars of u where they are seen in a `span`."""
    run, runs = analysis.runs[k], len(analysis.runs)
    total = sum(len(each.time) for each in analysis.runs)
    if runs > len(MARKERS):
        colour = to_hex(mpl.colormaps["viridis"](0.9 * k / (runs - 1)))
    points = _thin(len(y), max(MOST_POINTS // runs, 20))
    few = total <= MOST_BARS
    style: Any = {"color": colour or "black", "linestyle": "none", "alpha": 0.8 if few else 0.4}
    style["zorder"] = 3.0 if few else 2.1  # many points would hide the laws
    if span and run.u is not None and few and np.median(run.u) > _SEEN * span:
        axes.errorbar(run.time, y, run.u, elinewidth=0.8, **style)
    axes.plot(
        run.time[points],
        y[points],
        marker=MARKERS[k] if runs <= len(MARKERS) else "o",
        markersize=4 if few else 2.5 if len(y) <= MOST_BARS else 1.5,
        markerfacecolor=style["color"] if colour else "white",
        label=label,
        **style,
    )
