"""Limits → their figure."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from analysis.arrays import Array
from levilab.pipelines.limit.analysis import ISLANDS, LOWER_EDGE, RESONANCE, UPPER_EDGE, LimitAnalysis, Limits
from levilab.present.drawing import SMALL, new_figure, panel
from levilab.present.looks import BLACK, GREEN, GREY, LOOKS, MARKERS, ORANGE, PURPLE, SKY, VERMILION, YELLOW
from levilab.present.numbers import with_uncertainty
from levilab.present.style import TALLEST, label_of_run
from levilab.runs.events import RunEvent
from levilab.texts.text import Sentences, Text

#: Of runs: colours that theory does not have.
_COLOURS = (BLACK, GREEN, SKY, ORANGE, YELLOW, GREY)
_MEAN = LOOKS["fit"].colour
_THEORY = {
    LOWER_EDGE: (VERMILION, "--"),
    UPPER_EDGE: (VERMILION, "--"),
    RESONANCE: (PURPLE, ":"),
    ISLANDS: (PURPLE, "-."),
}
#: A line of theory farther from the mean than this multiple of the farthest limit's distance would squeeze the limits:
#: it is named at the edge of the panel.
_NEAR = 2.5
#: Above a panel, a panel, below it for the axis, and for a line of the legend there; what stands above all [inch].
_ABOVE, _PANEL, _BELOW, _LINE, _HEAD = 0.5, 2.2, 0.5, 0.155, 0.42
#: Of many conditions the panels are lower, so that the figure is as wide as a page, but no lower than this [inch].
_LOWEST = 1.1
#: Left edges and widths of the limits and of their distribution [inch].
_LEFT, _WIDTH, _BESIDE, _NARROW = 0.7, 4.7, 5.55, 1.35
#: Bins of the distribution, a scatter from the mean on either side, and fewer limits than this have none.
_BINS, _REACH, _FEWEST = 14, 3.5, 5


def limit_figure(analysis: LimitAnalysis) -> Figure:
    """Draw for each of the conditions the limits top by top with mean, scatter and theory, and their distribution."""
    legends = [_legend_lines(group) for group in analysis.groups]
    around = _HEAD + sum(_ABOVE + _BELOW + _LINE * lines for lines in legends)
    high = min(max((TALLEST - around) / len(legends), _LOWEST), _PANEL)
    height = around + high * len(legends)
    with new_figure(height, _finding(analysis), [one.synthetic for one in analysis.sources]) as figure:
        top = _HEAD
        for k, (group, lines) in enumerate(zip(analysis.groups, legends, strict=True)):
            left = panel(figure, _LEFT, top + _ABOVE, _WIDTH, high, label=f"limits {k}")
            right = panel(figure, _BESIDE, top + _ABOVE, _NARROW, high, label=f"distribution {k}", sharey=left)
            _draw_limits(left, high, analysis, group)
            _draw_distribution(right, analysis, group)
            top += _ABOVE + high + _BELOW + _LINE * lines
    return figure


def _finding(analysis: LimitAnalysis) -> str:
    """Return the means of the groups, while there are few."""
    found = [
        Text(
            "{limit} {hz:n}",
            limit="no limit, drag equals pull," if group.conditions.levels_off else group.which,
            hz=with_uncertainty(group.statistics.mean),
        )
        for group in analysis.groups
    ]
    more = Text(" and {n} more conditions", n=len(found) - 3) if len(found) > 3 else ""
    head = "Limits of levitation: {limits}{more}" if len(found) > 1 else "Limit of levitation: {limits}{more}"
    return Text(head, limits=tuple(found[:3]), more=more)


def _legend_lines(group: Limits) -> int:
    """Return the number of lines that a legend of two columns may take."""
    found = group.statistics
    runs = len(group.runs) if len(group.runs) <= len(MARKERS) else 1
    entries = runs + bool(found.outliers) + 1 + 2 * bool(found.scatter) + len(group.theory) + 1
    return (entries + 1) // 2


def _draw_limits(axes: Axes, height: float, analysis: LimitAnalysis, group: Limits) -> None:
    """Draw the limits of a group top by top, in a panel of some height [inch]."""
    found, mean = group.statistics, group.statistics.mean.value or 0.0
    every = _limits(analysis, group)
    start = 1
    for k in range(len(group.runs)):
        start = _draw_run(axes, analysis, group, k, start)
    outliers = list(found.outliers)
    if outliers:
        style: Any = {
            "marker": "o",
            "markersize": 9,
            "markerfacecolor": "none",
            "color": LOOKS["left out"].colour,
            "linestyle": "none",
        }
        axes.plot(np.array(outliers) + 1, every[outliers], label="outlier, in the mean", **style)
    axes.axhline(mean, color=_MEAN, linewidth=1.2, label=Text("mean {mean:n}", mean=with_uncertainty(found.mean)))
    if found.scatter and found.scatter.value is not None and found.mean.u is not None:
        band = (mean - found.mean.u, mean + found.mean.u)
        axes.axhspan(*band, color=_MEAN, alpha=0.18, linewidth=0, label="± its standard error")
        for side, label in ((-1, "± scatter from top to top"), (1, None)):
            axes.axhline(mean + side * found.scatter.value, color=_MEAN, linewidth=0.6, alpha=0.7, label=label)
    reach = max(float(np.abs(every - mean).max()), 2 * (found.mean.u or 0.0), 0.05)
    low, high = mean - 1.25 * reach, mean + 1.25 * reach
    for one in group.theory:
        if abs(one.expected - mean) <= _NEAR * reach:
            low, high = min(low, one.expected - 0.3 * reach), max(high, one.expected + 0.3 * reach)
    axes.set_ylim(low, high)
    _draw_theory(axes, {one.name: one.expected for one in group.theory})
    _shade_beyond_window(axes, group)
    axes.set_xlim(0.4, len(every) + 0.6)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.set(xlabel="top, one after another", ylabel="spin frequency ν  [Hz]")
    title = ("Lower limit: the spin at which a free top falls", _upper_title(group))[group.which == "upper"]
    made_up = {bool(source.synthetic) for source in analysis.sources}
    own = all(analysis.sources[number].synthetic for number in group.runs)
    mark = "(SYNTHETIC)" if len(made_up) > 1 and own and not group.says_synthetic else ""
    conditions = Text("{conditions:n}", conditions=group.conditions_text)
    axes.set_title(Sentences(Sentences(title, mark), conditions, between="\n"), loc="left", fontsize=8)
    axes.legend(
        loc="upper left",
        bbox_to_anchor=(-0.09, -0.44 / height),
        ncols=2,
        fontsize=SMALL,
        borderaxespad=0,
        columnspacing=1.2,
    )


def _draw_run(axes: Axes, analysis: LimitAnalysis, group: Limits, k: int, start: int) -> int:
    """Draw the limits of a group's run, and where there are several its mean; returns the number of the next top."""
    source = analysis.sources[group.runs[k]]
    limit, u = source.readings.limit, source.readings.u
    colour = _COLOURS[k % len(_COLOURS)]
    several = len(group.runs) > 1
    tops = np.arange(start, start + len(limit))
    if u is not None:
        axes.errorbar(tops, limit, u, color=colour, fmt="none", elinewidth=0.8, capsize=1.5, zorder=2.9)
    axes.plot(
        tops, limit, color=colour, marker=MARKERS[k % len(MARKERS)], linestyle="none", markersize=4, zorder=3,
        gid=f"readings-{group.which}-{group.runs[k]}",
        label=label_of_run(source.name, k, len(group.runs), "a top" if u is None else "a top ± u"),
    )  # fmt: skip
    if several:
        axes.plot([start - 0.4, start + len(limit) - 0.6], [limit.mean()] * 2, color=colour, linewidth=1.2)
    return start + len(limit)


def _draw_theory(axes: Axes, theory: Mapping[str, float]) -> None:
    """Draw lines where they are within the panel, else their names at the edge beyond which they lie."""
    low, high = axes.get_ylim()
    named = {1: 0, -1: 0}  # at each edge
    for name, expected in theory.items():
        (colour, dashes), text = _THEORY[name], Text("{name}, {hz:.2f} Hz", name=name, hz=expected)
        if low <= expected <= high:
            axes.axhline(expected, color=colour, linestyle=dashes, label=text)
            continue
        side = 1 if expected > high else -1
        axes.annotate(
            Text("↑ {text}" if side > 0 else "↓ {text}", text=text),
            (1, (1 + side) / 2), (-4, -side * (3 + 1.3 * SMALL * named[side])),
            xycoords="axes fraction", textcoords="offset points",
            ha="right", va="top" if side > 0 else "bottom", fontsize=SMALL, color=colour,
        )  # fmt: skip
        named[side] += 1


def _shade_beyond_window(axes: Axes, group: Limits) -> None:
    """Shade the spins at which small motions of the top grow, so that it cannot float."""
    window = (group.device.linear_lower_hz, group.device.linear_upper_hz)
    low, high = axes.get_ylim()
    label: str | None = Text(
        "small motions grow: outside the linear window, {low:.2f} to {high:.2f} Hz", low=window[0], high=window[1]
    )
    for begin, end in ((low, min(window[0], high)), (max(window[1], low), high)):
        if begin < end:
            axes.axhspan(begin, end, color="#D55E00", alpha=0.08, linewidth=0, zorder=0, label=label)
            label = None


def _upper_title(group: Limits) -> str:
    lock, top = group.ends.get(RunEvent.LOCK_LOST, 0), group.ends.get(RunEvent.TOP_LOST, 0)
    how = Text(" (lost by the drive {lost} ×, fell {fell} ×)", lost=lock, fell=top) if lock or top else ""
    if group.causes:
        how = Text(" ({causes})", tuple(Text("{cause} {n} ×", str(c), n) for c, n in sorted(group.causes.items())))
    return Text("Upper limit of a driven top{how}", how=how)


def _limits(analysis: LimitAnalysis, group: Limits) -> Array:
    return np.concatenate([analysis.sources[number].readings.limit for number in group.runs])


def _draw_distribution(axes: Axes, analysis: LimitAnalysis, group: Limits) -> None:
    """Draw a histogram on its side, with the normal law of the same mean and scatter."""
    limits, mean = _limits(analysis, group), group.statistics.mean.value or 0.0
    s = float(np.std(limits, ddof=1)) if len(limits) >= _FEWEST else 0.0
    axes.tick_params(labelleft=False)
    axes.set_xlabel("tops")
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
    if s == 0:
        axes.text(0.5, 0.5, "too few for\na distribution" if len(limits) < _FEWEST else "all alike", ha="center",
                  va="center", fontsize=SMALL, color="0.35", transform=axes.transAxes)  # fmt: skip
        axes.set_xlim(0, 1)
        return
    bins = np.linspace(mean - _REACH * s, mean + _REACH * s, _BINS + 1)
    axes.hist(limits, bins=bins.tolist(), orientation="horizontal", histtype="stepfilled", color="0.75")
    y = np.linspace(*axes.get_ylim(), 200)
    normal = np.exp(-0.5 * ((y - mean) / s) ** 2) / np.sqrt(2 * np.pi)
    axes.plot(len(limits) * (2 * _REACH / _BINS) * normal, y, color=_MEAN, linewidth=1)
    axes.set_title("distribution, normal law", loc="left", fontsize=SMALL)
