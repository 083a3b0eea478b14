"""A class → its figure: each group's value with u, the class's mean, and the truth."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.numbers import digits
from levilab.present.drawing import SMALL, in_mathtext, new_figure, panel, power_of_ten, write
from levilab.present.looks import BLUE, GREEN, VERMILION
from levilab.present.style import label_of_run
from levilab.present.units import unit
from levilab.report.beside import Class, Compared, Group, finding
from levilab.texts.text import Text, in_language

#: Left edge of the panels, their right edge, from panel to panel, above them, below them, and a group's row [inch].
_LEFT, _RIGHT, _GAP, _HEAD, _FOOT, _ROW = 1.75, 6.85, 0.25, 0.85, 0.55, 0.135
#: Panels beside each other at most, the distances from the truth included.
_MOST_PANELS = 3
#: Of the name of a group, that have room at the left, and those at its end, in which runs of one group differ.
_LETTERS, _END = 26, 9
#: Bars of u longer than this multiple of their median go beyond the edge; and the empty part at each side.
_LONGEST, _MARGIN = 3.0, 0.06
#: Distances from the truth beyond it are arrows at the edge [u].
_FARTHEST = 4.7


def class_figure(of: Class) -> Figure:
    """Draw a panel for each quantity, a row for each group, and their distances from the truth."""
    shown = of.quantities[: _MOST_PANELS - of.knows_truth]
    count = len(of.groups)
    height = max(_ROW * count, 0.6)
    panels = len(shown) + of.knows_truth
    width = (_RIGHT - _LEFT - (panels - 1) * _GAP) / panels
    said, synthetic = in_mathtext(in_language(finding(of))), [group.source.synthetic for group in of.groups]
    with new_figure(_HEAD + height + _FOOT, said, synthetic) as figure:
        about = in_language("point and bar: value ± u of a group")
        line = in_language("; line: mean of the class") if any(one.mean for one in shown) else ""
        diamond = in_language("; diamond: truth of the virtual bench") if of.knows_truth else ""
        write(figure, 0.08, 0.52, f"{about}{line}{diamond}", fontsize=SMALL)
        for k in range(panels):
            axes = panel(figure, _LEFT + k * (width + _GAP), _HEAD, width, height)
            if k < len(shown):
                _draw_values(axes, shown[k])
            else:
                _draw_distances(axes, of.quantities)
            axes.set(ylim=(count - 0.5, -0.5))
            axes.set_yticks(range(count), [_label(group) if k == 0 else "" for group in of.groups])
            axes.tick_params(axis="y", which="both", length=0, labelsize=SMALL)
            axes.tick_params(axis="x", labelsize=SMALL)
            axes.locator_params(axis="x", nbins=4)
    return figure


def _label(group: Group) -> str:
    name = label_of_run(group.source.name, 0, 2, "") or ""
    return name if len(name) <= _LETTERS else f"{name[: _LETTERS - _END - 1]}…{name[-_END:]}"


def _draw_values(axes: Axes, of: Compared) -> None:
    factor = unit(of.unit).shown.factor
    used = [(one.value, one.u) for one, use in zip(of.estimates, of.used, strict=True) if one and use]
    values, u = np.array(used or [(one.value, one.u) for one in of.estimates if one], float).T
    power, times = power_of_ten([*(values * factor)])
    scale = factor / power
    bars = np.minimum(u, _LONGEST * np.median(u))
    known = [*(values - bars), *(values + bars), *(truth for truth in of.truths if truth is not None)]
    low, high = scale * min(known), scale * max(known)
    margin = _MARGIN * (high - low)
    axes.set_xlim(low - margin, high + margin)
    if of.mean and of.mean.value is not None and of.mean.u is not None:
        mean, u = of.mean.value * scale, of.mean.u * scale
        axes.axvspan(mean - u, mean + u, color=BLUE, alpha=0.2)
        axes.axvline(mean, color=BLUE, linewidth=1)
    for k, (one, truth) in enumerate(zip(of.estimates, of.truths, strict=True)):
        if truth is not None:
            axes.plot(truth * scale, k, marker="D", markersize=5, color=VERMILION, markerfacecolor="none")
        if one is None or one.value is None or one.u is None:
            continue
        if low <= one.value * scale <= high:
            axes.errorbar(one.value * scale, k, xerr=one.u * scale, fmt="o", markersize=3, color="black", elinewidth=1)
            continue
        edge, marker, side = (low, "<", "left") if one.value * scale < low else (high, ">", "right")
        axes.plot(edge, k, marker=marker, markersize=3.5, color="black")
        said = in_language(Text("{value:n}", value=digits(one.value * scale, 3)))
        axes.text(edge, k, f"   {said}   ", fontsize=SMALL, ha=side, va="center")
    symbol, shown = in_mathtext(of.symbol), in_mathtext(of.shown_unit)
    axes.set_xlabel(f"{symbol}  [{times}{shown}]" if times or shown else symbol, fontsize=8)


def _draw_distances(axes: Axes, quantities: Sequence[Compared]) -> None:
    axes.axvspan(-2, 2, color="black", alpha=0.07, linewidth=0)
    axes.axvline(0, color=VERMILION, linewidth=1)
    for of, colour, marker in zip(quantities, (GREEN, BLUE, "black"), "o^s", strict=False):
        for k, distance in enumerate(of.from_truth):
            if distance is not None:
                beyond = ">" if distance > _FARTHEST else "<" if distance < -_FARTHEST else marker
                axes.plot(np.clip(distance, -_FARTHEST, _FARTHEST), k, marker=beyond, markersize=3.5, color=colour)
    axes.set(xlim=(-5, 5))
    axes.set_xlabel("from the truth  [u]; band ±2", fontsize=8)
