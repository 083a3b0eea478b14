"""Limits → their figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from levilab.pipelines.limit.analysis import LOWER_EDGE, RESONANCE, UPPER_EDGE
from levilab.present.numbers import short_name, with_uncertainty
from levilab.present.style import STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from levilab.pipelines.limit.analysis import LimitAnalysis, Limits

    Array = NDArray[np.float64]

#: One a run; colours of Okabe and Ito.
_MARKERS = "osD^vP*X"
_COLOURS = ("#0072B2", "#009E73", "#56B4E9", "#CC79A7", "#E69F00", "#000000")
_MEAN = "#000000"
_THEORY = {LOWER_EDGE: ("#D55E00", "--"), UPPER_EDGE: ("#D55E00", "--"), RESONANCE: ("#CC79A7", ":")}
#: A line of theory so many times farther from the mean than the farthest limit would squeeze the limits.
_NEAR = 5.0
#: Height of a panel and of what lies about it [inch].
_PANEL, _ABOUT = 3.4, 1.3


def limit_figure(analysis: LimitAnalysis) -> Figure:
    """The limits top by top with mean, scatter and theory; beside them how they are distributed."""
    with mpl.rc_context(STYLE):
        n = len(analysis.groups)
        height = n * (_PANEL + _ABOUT)
        figure = Figure(figsize=(9, height))
        for k, group in enumerate(analysis.groups):
            bottom = (height - (k + 1) * (_PANEL + _ABOUT) + 0.6) / height
            left = figure.add_axes((0.085, bottom, 0.685, _PANEL / height))
            right = figure.add_axes((0.79, bottom, 0.195, _PANEL / height), sharey=left)
            _draw_limits(left, analysis, group)
            _draw_distribution(right, analysis, group)
    return figure


def _draw_limits(axes: Axes, analysis: LimitAnalysis, group: Limits) -> None:
    found = group.statistics
    mean, start = found.mean.value or 0.0, 1
    several = len(group.runs) > 1
    for k, number in enumerate(group.runs):
        source = analysis.sources[number]
        limit, u = source.readings.limit, source.readings.u
        axes.errorbar(
            np.arange(start, start + len(limit)),
            limit,
            u,
            color=_COLOURS[k % len(_COLOURS)],
            marker=_MARKERS[k % len(_MARKERS)],
            linestyle="none",
            markersize=5,
            elinewidth=0.9,
            zorder=3,
            label=short_name(source.name).replace("$", r"\$").replace("_", " ") if several else "one top each",
        )
        start += len(limit)
    every = _limits(analysis, group)
    outliers = list(found.outliers)
    if outliers:
        style = {"marker": "o", "markersize": 12, "markerfacecolor": "none", "color": "red", "linestyle": "none"}
        axes.plot(np.array(outliers) + 1, every[outliers], label="outlier, in the mean", **style)  # type: ignore[arg-type]
    reach = max(float(np.abs(every - mean).max()), 0.2)
    axes.axhline(mean, color=_MEAN, linewidth=1.2, label=f"mean {with_uncertainty(found.mean)}")
    if found.scatter and found.mean.u is not None and found.scatter.value is not None:
        axes.axhspan(mean - found.mean.u, mean + found.mean.u, color=_MEAN, alpha=0.18, linewidth=0)
        for side in (-1, 1):
            axes.axhline(mean + side * found.scatter.value, color=_MEAN, linewidth=0.6, alpha=0.6)
    for one in group.comparisons:
        colour, dashes = _THEORY[one.name]
        label = f"{one.name}, {one.expected:.2f} Hz"
        if abs(one.expected - mean) <= _NEAR * reach:
            axes.axhline(one.expected, color=colour, linestyle=dashes, label=label)
        else:
            axes.plot([], [], color=colour, linestyle=dashes, label=f"{label} (off the figure)")
    low, high = axes.get_ylim()
    low, high = min(low, mean - reach), max(high, mean + reach)
    axes.set_ylim(low - 0.05 * (high - low), high + 0.42 * (high - low))  # room for the legend
    axes.set_xlim(0.4, len(every) + 0.6)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="top", ylabel="spin frequency  [Hz]")
    kind = "Lower limit: the spin at which a free top falls" if group.which == "lower" else _upper_title(group)
    synthetic = all(analysis.sources[number].synthetic for number in group.runs)
    axes.set_title(kind + "  (SYNTHETIC)" * synthetic, loc="left", fontsize=10)
    axes.legend(loc="upper left", ncols=2, fontsize=8)


def _upper_title(group: Limits) -> str:
    lock, top = group.ends.get("lock lost", 0), group.ends.get("top lost", 0)
    how = f" (lost by the drive {lock} ×, fell {top} ×)" if lock or top else ""
    return f"Upper limit of a driven top{how}"


def _limits(analysis: LimitAnalysis, group: Limits) -> Array:
    return np.concatenate([analysis.sources[number].readings.limit for number in group.runs])


def _draw_distribution(axes: Axes, analysis: LimitAnalysis, group: Limits) -> None:
    """A histogram on its side, with the normal law of the same mean and scatter."""
    limits, found = _limits(analysis, group), group.statistics
    axes.tick_params(labelleft=False)
    axes.set_xlabel("tops")
    if not (found.scatter and found.scatter.value):
        return
    s, mean = found.scatter.value, found.mean.value or 0.0
    bins = mean + s * np.arange(-3.5, 4.0, 0.5)
    axes.hist(limits, bins=bins.tolist(), orientation="horizontal", color=_COLOURS[0], alpha=0.55, edgecolor="white")
    y = np.linspace(mean - 3.5 * s, mean + 3.5 * s, 200)
    normal = np.exp(-0.5 * ((y - mean) / s) ** 2) / np.sqrt(2 * np.pi)
    axes.plot(len(limits) * 0.5 * normal, y, color=_MEAN, linewidth=1)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_title("band: ±standard error\nthin lines: ±scatter", loc="left", fontsize=8)
