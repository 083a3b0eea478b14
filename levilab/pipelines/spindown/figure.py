"""Spin-downs → their figure."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.numbers import digits
from analysis.spindown.drag import LAWS
from levilab.pipelines.spindown.analysis import SpinDownAnalysis
from levilab.pipelines.spindown.report import is_best, laws_of, tilt_part
from levilab.pipelines.spindown.words import STRAIGHT_LINES, SYMBOLS, finding, law_name, short_law
from levilab.present.drawing import (
    SMALL,
    band,
    in_mathtext,
    limits_about,
    new_figure,
    panel,
    power_of_ten,
    run_look,
    sigma_bands,
    write,
)
from levilab.present.looks import GREY, LOOKS, MARKERS
from levilab.present.numbers import short_name
from levilab.present.style import without_formula
from levilab.present.units import unit as unit_row
from levilab.texts.text import Text

#: Points beyond which some are left out evenly, beyond which they have no bars, and means that stand for more of them.
MOST_POINTS, MOST_BARS, MEANS = 600, 200, 40
#: A bar longer than the marker's radius, as part of the panel's height, is seen; outliers with their value written.
_SEEN, _MOST_NAMED = 1 / 120, 6
#: Of the residuals: units that the common scale shows at least; the factor by which residuals reach beyond it where
#: they have a scale of their own; length of a scale over the reach of the residuals, for the markers.
_LEAST_SCALE, _BEYOND, _ROOM = 3.2, 1.1, 1.12
#: Places [inch]: left edge and width of the panels; height of the figure, and of the short one; top of the lines.
_LEFT, _FULL, _HEIGHT, _SHORT_HEIGHT, _LINES_TOP = 0.66, 6.26, 9.15, 4.1, 7.2


@dataclass(frozen=True)
class _Unit:
    """In what residuals are counted: each reading's u, or where none is known the best law's scatter.

    Attributes:
        of: for each run what its residuals are divided by [Hz].
        usual: of a reading [Hz].
        symbol: for axes, which say residual / symbol.
        words: what it is.
    """

    of: list[Array]
    usual: float
    symbol: str
    words: str


def spindown_figure(analysis: SpinDownAnalysis) -> Figure:
    """Draw readings and best law, the other laws less the best one, residuals of each, and the straight lines."""
    if analysis.is_doubtful:
        return short_figure(analysis)
    straight = [law for law in laws_of(analysis) if law in STRAIGHT_LINES]
    height = _HEIGHT if straight else _LINES_TOP - 0.4
    with new_figure(height, _finding(analysis), [one.synthetic for one in analysis.sources]) as figure:
        unit = _unit(analysis)
        _draw_spin(panel(figure, _LEFT, 0.62, 4.3, 1.75), analysis)
        if len(analysis.runs) > len(MARKERS):
            _draw_by_run(panel(figure, _LEFT + 4.98, 0.62, 1.3, 1.75), analysis)
        else:
            _draw_weights(panel(figure, _LEFT + 4.6, 0.62, 1.4, 1.75), analysis)
        _draw_differences(panel(figure, _LEFT, 2.98, 4.3, 1.5), analysis, unit)
        _draw_residuals(figure, 5.34, analysis, unit)
        if straight:
            _draw_straight_lines(figure, straight, analysis)
    return figure


def short_figure(analysis: SpinDownAnalysis) -> Figure:
    """Draw readings and best law, and below readings and laws less the best one; of a doubtful unit readings alone."""
    height = _SHORT_HEIGHT - 1.65 * analysis.is_doubtful
    with new_figure(height, _finding(analysis), [one.synthetic for one in analysis.sources]) as figure:
        _draw_spin(panel(figure, _LEFT, 0.62, 4.3, 1.35), analysis)
        if not analysis.is_doubtful:
            _draw_differences(panel(figure, _LEFT, 2.55, 4.3, 1.1), analysis, _unit(analysis))
    return figure


def _finding(analysis: SpinDownAnalysis) -> str:
    """Return the verdict in one sentence."""
    if analysis.is_doubtful:
        return Text("Spin-down as it was read: the unit comes first, see the note")
    n, said = len(analysis.taken), finding(analysis.combined)
    return Text("Spin-down of {n} runs: {said}", n=n, said=said) if n > 1 else Text("Spin-down: {said}", said=said)


def _unit(analysis: SpinDownAnalysis) -> _Unit:
    known = [run.u for run in analysis.runs if run.u is not None]
    if len(known) == len(analysis.runs):
        usual = float(np.median(np.concatenate(known)))
        return _Unit(known, usual, "u", Text("u of a reading ({hz:n} Hz)", hz=digits(usual)))
    residuals = [run.fit(analysis.combined.best).residuals for run in analysis.taken]
    floor = 1e-12 * float(analysis.runs[0].frequency[0])  # readings that a law describes exactly
    scatter = max(float(np.sqrt(np.mean(np.concatenate(residuals) ** 2))), floor)
    words = Text("the scatter about the {law} law ({hz:n} Hz)", law_name(analysis.combined.best), digits(scatter))
    return _Unit([np.full(len(run.time), scatter) for run in analysis.runs], scatter, "scatter", words)


# --- readings and laws ---------------------------------------------------------------------------------


def _draw_spin(axes: Axes, analysis: SpinDownAnalysis) -> None:
    """Draw the readings of all runs, and the best law through each."""
    span = _set_range(axes, analysis)
    best, several, first = analysis.combined.best, len(analysis.runs), analysis.taken[0]
    for k, run in enumerate(analysis.runs):
        t = np.linspace(run.time[0], run.time[-1], 200)
        width = 1.4 if several == 1 else 0.9 if several <= len(MARKERS) else 0.4
        said = "best law: {law}, {equation}" if is_best(analysis, best) else "{law}, {equation}"
        label = Text(said, law=short_law(best), equation=in_mathtext(LAWS[best].equation)) if run is first else None
        if not analysis.is_doubtful and analysis.is_taken[k]:
            nu = run.fit(best).spin_frequency(t)
            axes.plot(t, nu, linewidth=width, zorder=2.5, label=label, **LOOKS[best].as_line)
        name = _run_label(analysis, k)
        _draw_readings(axes, analysis, k, run.frequency, span=span, label=name, gid=f"readings-{k}")
        _draw_outliers(axes, analysis, k)
    axes.set(xlabel="time  [s]", ylabel="spin frequency ν  [Hz]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles, labels, loc="upper right", ncols=2 if len(labels) > 6 else 1, handlelength=1.8, columnspacing=1.0,
        fontsize=8 if len(labels) <= 4 else SMALL,
    )  # fmt: skip


def _set_range(axes: Axes, analysis: SpinDownAnalysis) -> float:
    """Set the axis to the readings used, with room for the legend above: an outlier squeezes nothing."""
    low = min(float(run.frequency.min()) for run in analysis.runs)
    high = max(float(run.frequency.max()) for run in analysis.runs)
    margin = 0.06 * (high - low) or 0.06 * high
    axes.set_ylim(low - margin, high + margin)
    return high - low + 2 * margin


def _run_label(analysis: SpinDownAnalysis, k: int) -> str | None:
    """Return a name for each of a few runs, a number for many."""
    if len(analysis.runs) == 1:
        return "readings ± u" if analysis.runs[0].u is not None else "readings"
    if len(analysis.runs) <= len(MARKERS):
        return _legend_text(short_name(analysis.sources[k].name))
    return Text("readings of {n} runs", n=len(analysis.runs)) if k == 0 else None


def _legend_text(name: str) -> str:
    """Return a name for a legend: no formula, no hidden label, and no character that the font lacks."""
    font = get_font(findfont("DejaVu Sans"))
    text = "".join(c if c.isprintable() and font.get_char_index(ord(c)) else "□" for c in name)
    return (" " if text.startswith("_") else "") + without_formula(text, 24)


def _draw_outliers(axes: Axes, analysis: SpinDownAnalysis, k: int) -> None:
    """Draw a cross at the outlier, or an arrow at the edge with its value where it lies beyond."""
    readings, outliers = analysis.sources[k].readings, np.array(analysis.runs[k].outliers, dtype=np.intp)
    t, nu = readings.time[outliers], readings.frequency[outliers]
    low, high = axes.get_ylim()
    look = LOOKS["left out"]
    style: Any = {"color": look.colour, "linestyle": "none", "zorder": 5}
    edges = (("x", (low <= nu) & (nu <= high), None), ("^", nu > high, 0.97), ("v", nu < low, 0.03))
    first = "left out" not in axes.get_legend_handles_labels()[1]
    for marker, chosen, share in edges:
        if not chosen.any():
            continue
        shown = np.flatnonzero(chosen)[_thin(int(chosen.sum()), MOST_POINTS)]
        y = nu[shown] if share is None else np.full(len(shown), low + share * (high - low))
        axes.plot(t[shown], y, marker=marker, markersize=6, label="left out" if first else None, **style)
        first = False
        for i in range(min(len(shown), _MOST_NAMED) if share else 0):
            text = Text("{hz:.4g} Hz", hz=nu[shown[i]])
            axes.annotate(
                text, (t[shown[i]], y[i]), (7, -1.5), textcoords="offset points", color=look.of_text, fontsize=SMALL
            )


# --- the weights, and run by run -----------------------------------------------------------------------


def _draw_weights(axes: Axes, analysis: SpinDownAnalysis) -> None:
    """Draw the weight of each law by the criterion: a bar each, with its number and the verdict."""
    laws = laws_of(analysis)
    for place, name in enumerate(laws):
        weight = analysis.combined.fit(name).statistics.weight
        look = LOOKS[name]
        axes.barh(-place, weight or 0.0, height=0.3, color=look.colour, linewidth=0)
        number = "" if weight is None else f"  {weight:.2f}" if weight >= 0.005 else "  <\u20090.01"
        note = _note(analysis, name, short=True)
        how = "{law}{number:n}, {note}" if note else "{law}{number:n}"
        said = Text(how, law=short_law(name), number=number, note=note)
        axes.text(0.03, 0.22 - place, said, fontsize=SMALL, va="bottom", color="black")
    known = analysis.combined.fit(analysis.combined.best).statistics.weight is not None
    about = "weight of the law" if known else "too few readings to weigh"
    axes.set(xlim=(0, 1), ylim=(-len(laws) + 0.6, 0.75), yticks=[], xlabel=about)
    axes.xaxis.set_major_locator(mpl.ticker.FixedLocator([0, 0.5, 1]))
    axes.tick_params(axis="y", which="both", left=False)
    axes.set_title("AICc weights" if analysis.combined.fits[0].statistics.aicc is not None else "weights", pad=3)


def _note(analysis: SpinDownAnalysis, name: str, *, short: bool = False) -> str:
    """Return the verdict on a law in a word or two, or if `short` in the fewest letters."""
    verdict, best = analysis.combined.verdict, name == analysis.combined.best
    if name in verdict.excluded:
        return "excluded"
    if best:
        return "best" if verdict.decided else "fits" if verdict.describes else "nearest"
    if not verdict.describes:
        return ""
    if name in verdict.needless:
        return "needless" if short else "needless constants"
    return "as good" if name in verdict.indistinguishable else ""


def _draw_by_run(axes: Axes, analysis: SpinDownAnalysis) -> None:
    """Draw the best law's constant in each run with its u, their mean and their scatter."""
    best = analysis.combined.fit(analysis.combined.best)
    name, mean = next(iter(best.constants.items()))
    found = [run.fit(best.name).parameters[name] for run in analysis.runs]
    value, u = (
        np.array([np.nan if x is None else x for x in of]) for of in zip(*((f.value, f.u) for f in found), strict=True)
    )
    scale, times = power_of_ten(value)
    value, u = value / scale, u / scale
    number = np.arange(1, len(found) + 1)
    look = LOOKS[best.name]
    if mean.value is not None:
        if mean.scatter is not None:
            ends = ((mean.value + side * mean.scatter) / scale for side in (-1, 1))
            axes.axhspan(*ends, color="black", alpha=0.12, linewidth=0)
        axes.axhline(mean.value / scale, color=look.colour, linewidth=1.2)
    few = len(found) <= MOST_BARS
    axes.errorbar(number, value, u if few else None, color="black", linestyle="none", elinewidth=0.6)
    axes.plot(number, value, color="black", linestyle="none", marker="o", markersize=2.5 if few else 1.2)
    symbol, unit = in_mathtext(SYMBOLS[name]), in_mathtext(unit_row(mean.unit).text)
    groups = [_legend_text(source.group) for source in analysis.sources if source.group]
    axes.set(xlabel=f"{groups[0]} … {groups[-1]}" if groups else "run", ylabel=f"{symbol}  [{times}{unit}]")
    axes.set_title(Text("{symbol}, {law}: mean, ±s", symbol=symbol, law=short_law(best.name)), pad=3, fontsize=8)


# --- what the laws differ from each other --------------------------------------------------------------


def _draw_differences(axes: Axes, analysis: SpinDownAnalysis, unit: _Unit) -> None:
    """Draw readings and every law less the best one, which is the line at zero, with the band of its u."""
    best, several = analysis.combined.best, len(analysis.runs)
    excluded = analysis.combined.verdict.excluded
    found: list[float] = []
    for k, run in enumerate(analysis.runs):
        if analysis.is_taken[k]:
            found += [*(run.fit(best).residuals + 1.5 * unit.usual), *(run.fit(best).residuals - 1.5 * unit.usual)]
        _draw_readings(axes, analysis, k, run.fit(best).residuals, span=6 * unit.usual, gid=f"residuals-best-{k}")
        _draw_means(axes, analysis, run.fit(best).residuals)
    run = max(analysis.taken, key=lambda one: float(one.time[-1] - one.time[0]))
    t = np.linspace(run.time[0], run.time[-1], 200)
    curves = {name: run.fit(name).spin_frequency(t) - run.fit(best).spin_frequency(t) for name in laws_of(analysis)}
    for name, difference in curves.items():
        if name not in excluded and np.isfinite(difference).all():
            found += [1.3 * float(difference.min()), 1.3 * float(difference.max())]
    u = run.fit(best).u_spin_frequency(t)
    if u is not None:
        band(axes, t, np.zeros(len(t)), 2 * u, LOOKS[best].colour, alpha=0.25, zorder=1.9)
    most = max(map(abs, limits_about(found, 0.02)))
    axes.locator_params(axis="y", nbins=6)
    axes.tick_params(axis="y", labelsize=SMALL)  # of a sharp record they have four decimals
    axes.set(xlabel="time  [s]", ylim=(-most, most))
    axes.set_ylabel(Text("ν − ν$_{\\rm {law}}$  [Hz]", law=short_law(best)), labelpad=1)
    ends = []
    for name, difference in curves.items():
        axes.plot(t, difference, linewidth=1.3, zorder=2.6, **LOOKS[name].as_line)
        where = "" if np.abs(difference).max() <= most else Text(", to {hz:n} Hz", hz=_with_sign(difference))
        shaded = ", 2 u shaded" if name == best and u is not None else ""
        said = _note(analysis, name) or ("not excluded" if analysis.combined.verdict.describes else "no fit")
        text = Text("{law}: {said}{shaded}{where}", law=short_law(name), said=said, shaded=shaded, where=where)
        ends.append((float(difference[-1]), name, text))
    _name_laws(axes, [end for end in ends if math.isfinite(end[0])])
    of = "; curves of the longest run" if several > 1 else ""
    axes.set_title(Text("Readings and laws less the {law} law{of}", law=law_name(best), of=of), pad=3)


def _with_sign(difference: Array) -> str:
    """Return the value farthest from zero, in two digits."""
    farthest = float(difference[np.argmax(np.abs(difference))])
    return f"{'−' if farthest < 0 else '+'}{digits(abs(farthest))}"


def _name_laws(axes: Axes, ends: list[tuple[float, str, str]]) -> None:
    """Draw a piece of each law's line beside the panel, in the order of the lines' ends: (end, law, text)."""
    order = sorted(ends, key=lambda end: -end[0])
    handles = [Line2D([], [], linewidth=1.3, **LOOKS[law].as_line) for _, law, _ in order]
    axes.legend(
        handles, [said for _, _, said in order], loc="center left", bbox_to_anchor=(0.995, 0.5), fontsize=SMALL,
        handlelength=2.6, handletextpad=0.5, borderaxespad=0, labelspacing=0.9,
    )  # fmt: skip


# --- residuals -----------------------------------------------------------------------------------------


def _draw_residuals(figure: Figure, top: float, analysis: SpinDownAnalysis, unit: _Unit) -> None:
    """Draw the residuals of each law in units of a reading's u: noise within the bands if the law holds."""
    means = "; black: means" if _many(analysis) else ""
    text = Text("Residuals, reading − law, in units of {unit}; shaded ±1, ±2{means}", unit=unit.words, means=means)
    write(figure, 0.08, top - 0.42, text, fontsize=9)
    tilt = _tilt_in_words(analysis)
    if tilt:
        write(figure, 0.08, top - 0.26, tilt, fontsize=SMALL, color=GREY)
    laws = laws_of(analysis)
    values = {
        name: [run.fit(name).residuals / of for run, of in zip(analysis.runs, unit.of, strict=True)] for name in laws
    }
    reach = {
        name: max(float(np.abs(one).max()) for one in compress(of, analysis.is_taken)) for name, of in values.items()
    }
    excluded = analysis.combined.verdict.excluded
    good = [reach[name] for name in laws if name not in excluded] or [reach[analysis.combined.best]]
    common = max(_LEAST_SCALE, _ROOM * max(good))
    far = {name for name in laws if reach[name] > _BEYOND * common}
    common = max(common, _ROOM * max((reach[name] for name in laws if name not in far), default=0.0))
    width, gap = _share(len(laws), 0.29)
    for place, name in enumerate(laws):
        axes = panel(figure, _LEFT + place * (width + gap), top, width, 1.05)
        own = name in far
        most = _ROOM * reach[name] if own else common
        sigma_bands(axes)
        for k, one in enumerate(values[name]):
            _draw_tilt(axes, analysis, k, name, most)
            bars = np.ones(len(one)) if analysis.runs[k].u is not None else None
            _draw_readings(
                axes, analysis, k, one, span=2 * most, bars=bars, colour=LOOKS[name].colour, gid=f"residuals-{name}-{k}"
            )
            _draw_means(axes, analysis, one)
        axes.set(ylim=(-most, most), xlabel="time  [s]")
        axes.tick_params(labelsize=SMALL)
        axes.locator_params(nbins=4)
        axes.set_title(short_law(name), loc="left", color=LOOKS[name].of_text, fontsize=8, fontweight="bold", pad=3)
        if own:
            said = "own scale" if width > 1 else "own"
            axes.set_title(said, loc="right", color="black", fontsize=SMALL, fontstyle="italic", pad=3)
            axes.set_facecolor("#F4F4F4")
        if place == 0:
            axes.set_ylabel(Text("residual / {unit}", unit=unit.symbol))


def _draw_tilt(axes: Axes, analysis: SpinDownAnalysis, k: int, name: str, limit: float) -> None:
    """Draw the share of tilt and wobble in the count of run k, by one law, at the panel's scale of ±limit."""
    run = analysis.runs[k]
    fit = run.fit(name)
    if fit.has_tilt:
        t = np.linspace(run.time[0], run.time[-1], 100)
        added = tilt_part(fit, t)
        y = 0.9 * limit * added / float(np.abs(added).max())
        axes.plot(t, y, color=GREY, linestyle="dotted", linewidth=1.0, zorder=2)


def _tilt_in_words(analysis: SpinDownAnalysis) -> str:
    """Return an explanation of the dotted curves; empty where no run shows a tilt."""
    fits = [run.fit(analysis.combined.best) for run in analysis.runs]
    most = [float(np.abs(tilt_part(fit, run.time)).max()) for fit, run in zip(fits, analysis.runs, strict=True)]
    said = "dotted: what the tilt adds to the count, up to {hz:n} Hz, not to scale"
    return Text(said, hz=digits(max(most))) if max(most) else ""


# --- straight lines ------------------------------------------------------------------------------------


def _draw_straight_lines(figure: Figure, laws: Sequence[str], analysis: SpinDownAnalysis) -> None:
    """Draw the straight lines: where a law holds, points lie on its line, and the strip below shows noise about 0."""
    write(
        figure, 0.08, _LINES_TOP - 0.3,
        "Straight lines as drawn on paper, and below each how far the points lie from it", fontsize=9,
    )  # fmt: skip
    (width, gap), strips = _share(len(laws), 0.61), []
    for place, law in enumerate(laws):
        straight = STRAIGHT_LINES[law]
        left = _LEFT + place * (width + gap)
        above, strip = panel(figure, left, _LINES_TOP, width, 0.95), panel(figure, left, _LINES_TOP + 1.03, width, 0.45)
        strips.append(strip)
        _draw_straight(above, strip, analysis, straight.transform, law)
        above.set_ylabel(straight.axis, fontsize=8)
        above.set_title(
            Text("straight if {law} holds", law=short_law(law)) if width > 1.5 else short_law(law),
            color=LOOKS[law].of_text,
            fontsize=8,
            fontweight="bold",
            pad=3,
        )
        for axes in (above, strip):
            axes.tick_params(labelsize=SMALL)
        above.tick_params(labelbottom=False)
        strip.set(xlabel="time  [s]", xlim=above.get_xlim())
    most = 1.1 * max(abs(limit) for strip in strips for limit in strip.get_ylim())
    for strip in strips:
        strip.set_ylim(-most, most)  # in parts of the range, so that one sees which line is the straightest
    strips[0].set_ylabel("off  [%]", fontsize=8)


def _draw_straight(
    above: Axes, strip: Axes, analysis: SpinDownAnalysis, transform: Callable[[Array], Array], law: str
) -> None:
    strip.axhline(0, color=LOOKS[law].colour, linewidth=1)
    for k, run in enumerate(analysis.runs):
        y = transform(2 * np.pi * run.frequency)
        line = np.polynomial.Polynomial.fit(run.time, y, 1)(run.time)
        above.plot(run.time[[0, -1]], line[[0, -1]], color=LOOKS[law].colour, linewidth=1)
        _draw_readings(above, analysis, k, y)
        off = 100 * (y - line) / (np.ptp(y) or 1.0)
        _draw_readings(strip, analysis, k, off)
        _draw_means(strip, analysis, off)


def _share(panels: int, gap: float) -> tuple[float, float]:
    """Return the width of each of some panels beside each other, and the gap between them [inch]."""
    return (_FULL - (panels - 1) * gap) / panels, gap


# --- what the panels share -----------------------------------------------------------------------------


def _many(analysis: SpinDownAnalysis) -> bool:
    """Return whether only means show what shape the noise hides."""
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
    *,
    span: float | None = None,
    bars: Array | None = None,
    colour: str | None = None,
    label: str | None = None,
    gid: str | None = None,
) -> None:
    """Draw one number for each reading of run k: points, with bars of u where they are seen in a `span`.

    Args:
        axes: where.
        analysis: of all runs.
        k: the run.
        y: what is drawn for each of its readings.
        span: height of the panel, in the unit of y; None: no bars.
        bars: half length of the bars, in the unit of y; None: u of the readings [Hz].
        colour: of the points, else the run's.
        label: for the legend.
        gid: by which a page finds the points, where each reading is one.
    """
    run, runs = analysis.runs[k], len(analysis.runs)
    total = sum(len(each.time) for each in analysis.runs)
    look = run_look(k, runs)
    own = to_hex(mpl.colormaps["cividis"](0.9 * k / (runs - 1))) if runs > len(MARKERS) else look.colour
    points = _thin(len(y), max(MOST_POINTS // runs, 20))
    few = total <= MOST_BARS
    style: Any = {"color": colour or own, "linestyle": "none", "alpha": 0.8 if few else 0.4}
    style["zorder"] = 3.0 if few else 2.1  # many points would hide the laws
    bars = run.u if bars is None else bars
    if span and bars is not None and few and np.median(bars) > _SEEN * span:
        axes.errorbar(run.time, y, bars, elinewidth=0.7, **style)
    axes.plot(
        run.time[points],
        y[points],
        marker=look.marker,
        markersize=3.2 if few else 2.0 if len(y) <= MOST_BARS else 1.2,
        markeredgewidth=0.8,
        markerfacecolor=style["color"] if colour else "white",
        label=label,
        gid=gid if len(points) == len(y) else None,
        **style,
    )
