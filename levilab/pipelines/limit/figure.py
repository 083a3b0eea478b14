"""Limits → their figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from levilab.pipelines.limit.analysis import LOWER_EDGE, RESONANCE, UPPER_EDGE
from levilab.present.numbers import with_uncertainty
from levilab.present.style import MARKERS, STYLE, label_of_run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from levilab.pipelines.limit.analysis import LimitAnalysis, Limits

    Array = NDArray[np.float64]

#: Of runs: colours of Okabe and Ito that theory does not have.
_COLOURS = ("#0072B2", "#009E73", "#56B4E9", "#E69F00", "#F0E442", "#000000")
_MEAN = "#000000"
_THEORY = {LOWER_EDGE: ("#D55E00", "--"), UPPER_EDGE: ("#D55E00", "--"), RESONANCE: ("#CC79A7", ":")}
#: A line of theory so many times farther from the mean than the farthest limit would squeeze the limits: it is named at
#: the edge of the panel.
_NEAR = 2.5
#: Width of the figure; above a panel, a panel, below it for the axis, and for a line of the legend there [inch].
_WIDTH, _ABOVE, _PANEL, _BELOW, _LINE = 9.0, 0.5, 2.9, 0.6, 0.17
#: Bins of the distribution, a scatter from the mean on either side, and fewer limits than this have none.
_BINS, _REACH, _FEWEST = 14, 3.5, 5


def limit_figure(analysis: LimitAnalysis) -> Figure:
    """For each of the conditions the limits top by top with mean, scatter and theory, and how they are distributed."""
    with mpl.rc_context(STYLE):
        figure = Figure()
        rows: list[tuple[Axes, Axes, float]] = []
        for group in analysis.groups:
            left = figure.add_axes((0.085, 0, 0.7, 1), label=f"limits {len(rows)}")
            right = figure.add_axes((0.805, 0, 0.18, 1), label=f"distribution {len(rows)}", sharey=left)
            lines = _draw_limits(left, analysis, group)
            _draw_distribution(right, analysis, group)
            rows.append((left, right, _BELOW + _LINE * lines))
        height = sum(_ABOVE + _PANEL + below for _, _, below in rows)
        figure.set_size_inches(_WIDTH, height)
        top = height
        for left, right, below in rows:
            top -= _ABOVE + _PANEL
            left.set_position((0.085, top / height, 0.7, _PANEL / height))
            right.set_position((0.805, top / height, 0.18, _PANEL / height))
            top -= below
    return figure


def _draw_limits(axes: Axes, analysis: LimitAnalysis, group: Limits) -> int:
    """The limits of a group top by top; returns the number of lines of the legend."""
    found, mean = group.statistics, group.statistics.mean.value or 0.0
    every = _limits(analysis, group)
    start = 1
    for k in range(len(group.runs)):
        start = _draw_run(axes, analysis, group, k, start)
    outliers = list(found.outliers)
    if outliers:
        style: Any = {"marker": "o", "markersize": 12, "markerfacecolor": "none", "color": "red", "linestyle": "none"}
        axes.plot(np.array(outliers) + 1, every[outliers], label="outlier, in the mean", **style)
    axes.axhline(mean, color=_MEAN, linewidth=1.2, label=f"mean {with_uncertainty(found.mean)}")
    if found.scatter and found.scatter.value is not None and found.mean.u is not None:
        band = (mean - found.mean.u, mean + found.mean.u)
        axes.axhspan(*band, color=_MEAN, alpha=0.18, linewidth=0, label="± its standard error")
        for side, label in ((-1, "± scatter from top to top"), (1, None)):
            axes.axhline(mean + side * found.scatter.value, color=_MEAN, linewidth=0.6, alpha=0.7, label=label)
    reach = max(float(np.abs(every - mean).max()), 2 * (found.mean.u or 0.0), 0.05)
    low, high = mean - 1.25 * reach, mean + 1.25 * reach
    for one in group.comparisons:
        if abs(one.expected - mean) <= _NEAR * reach:
            low, high = min(low, one.expected - 0.3 * reach), max(high, one.expected + 0.3 * reach)
    axes.set_ylim(low, high)
    for one in group.comparisons:
        _draw_theory(axes, one.name, one.expected)
    _shade_beyond_window(axes, group)
    axes.set_xlim(0.4, len(every) + 0.6)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.set(xlabel="top, one after another", ylabel="spin frequency ν  [Hz]")
    synthetic = all(analysis.sources[number].synthetic for number in group.runs)
    title = ("Lower limit: the spin at which a free top falls", _upper_title(group))[group.which == "upper"]
    axes.set_title(title + "  (SYNTHETIC)" * synthetic + "\n" + group.conditions.text, loc="left", fontsize=9)
    legend = axes.legend(loc="upper left", bbox_to_anchor=(-0.02, -0.16), ncols=2, fontsize=8, borderaxespad=0)
    return (len(legend.get_texts()) + 1) // 2


def _draw_run(axes: Axes, analysis: LimitAnalysis, group: Limits, k: int, start: int) -> int:
    """The limits of a group's run, and where there are several its mean; returns the number of the next top."""
    source = analysis.sources[group.runs[k]]
    limit, u = source.readings.limit, source.readings.u
    colour = _COLOURS[k % len(_COLOURS)]
    several = len(group.runs) > 1
    axes.errorbar(
        np.arange(start, start + len(limit)),
        limit,
        u,
        color=colour,
        marker=MARKERS[k % len(MARKERS)],
        linestyle="none",
        markersize=5,
        elinewidth=0.9,
        capsize=2,
        zorder=3,
        label=label_of_run(source.name, k, len(group.runs), "a top" + " ± u" * (u is not None)),
    )
    if several:
        axes.plot([start - 0.4, start + len(limit) - 0.6], [limit.mean()] * 2, color=colour, linewidth=1.2)
    return start + len(limit)


def _draw_theory(axes: Axes, name: str, expected: float) -> None:
    """A line where it is within the panel, else its name at the edge beyond which it lies."""
    colour, dashes = _THEORY[name]
    low, high = axes.get_ylim()
    text = f"{name}, {expected:.2f} Hz"
    if low <= expected <= high:
        axes.axhline(expected, color=colour, linestyle=dashes, label=text)
        return
    above = expected > high
    axes.annotate(
        f"{'↑' if above else '↓'} {text}",
        (0.99, 0.98 if above else 0.02),
        xycoords="axes fraction",
        ha="right",
        va="top" if above else "bottom",
        fontsize=8,
        color=colour,
    )


def _shade_beyond_window(axes: Axes, group: Limits) -> None:
    """Where small motions of the top grow, so that no spin keeps it up."""
    window = (group.device.lower, group.device.upper)
    low, high = axes.get_ylim()
    label: str | None = f"small motions grow: outside the linear window, {window[0]:.2f} to {window[1]:.2f} Hz"
    for begin, end in ((low, min(window[0], high)), (max(window[1], low), high)):
        if begin < end:
            axes.axhspan(begin, end, color="#D55E00", alpha=0.08, linewidth=0, zorder=0, label=label)
            label = None


def _upper_title(group: Limits) -> str:
    lock, top = group.ends.get("lock lost", 0), group.ends.get("top lost", 0)
    how = f" (lost by the drive {lock} ×, fell {top} ×)" if lock or top else ""
    return f"Upper limit of a driven top{how}"


def _limits(analysis: LimitAnalysis, group: Limits) -> Array:
    return np.concatenate([analysis.sources[number].readings.limit for number in group.runs])


def _draw_distribution(axes: Axes, analysis: LimitAnalysis, group: Limits) -> None:
    """A histogram on its side, with the normal law of the same mean and scatter."""
    limits, mean = _limits(analysis, group), group.statistics.mean.value or 0.0
    s = float(np.std(limits, ddof=1)) if len(limits) >= _FEWEST else 0.0
    axes.tick_params(labelleft=False)
    axes.set_xlabel("tops")
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
    if s == 0:
        axes.text(0.5, 0.5, "too few for\na distribution" if len(limits) < _FEWEST else "all alike", ha="center",
                  va="center", fontsize=8, color="0.35", transform=axes.transAxes)  # fmt: skip
        axes.set_xlim(0, 1)
        return
    bins = np.linspace(mean - _REACH * s, mean + _REACH * s, _BINS + 1)
    axes.hist(limits, bins=bins.tolist(), orientation="horizontal", histtype="stepfilled", color="0.75")
    y = np.linspace(*axes.get_ylim(), 200)
    normal = np.exp(-0.5 * ((y - mean) / s) ** 2) / np.sqrt(2 * np.pi)
    axes.plot(len(limits) * (2 * _REACH / _BINS) * normal, y, color=_MEAN, linewidth=1)
    axes.set_title("distribution, normal law", loc="left", fontsize=8)
