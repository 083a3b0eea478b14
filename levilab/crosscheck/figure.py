"""The pulls of a cross-check: a panel a quantity, beside the curve that they should follow."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from levilab.present.style import STYLE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from levilab.crosscheck.study import Checked, Spread

_COLUMNS = 4
_WIDTH_IN, _PANEL_IN = 10.0, 2.3
#: What lies further out is drawn in the outermost bar.
_FARTHEST = 4.0
_BLUE, _ORANGE = "#0072B2", "#D55E00"


def crosscheck_figure(checked: Sequence[Checked]) -> Figure:
    """Histograms of pulls; orange where they are not as wanted."""
    panels = [(one.subject.name, spread) for one in checked for spread in one.spreads]
    rows = max(1, math.ceil(len(panels) / _COLUMNS))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH_IN, 0.6 + _PANEL_IN * rows), layout="constrained")
        figure.suptitle(_finding(checked), fontsize=10)
        axes = figure.subplots(rows, _COLUMNS, squeeze=False, sharex=True)
        for axis in axes.flat[len(panels) :]:
            axis.set_visible(False)
        for axis, (name, spread) in zip(axes.flat, panels, strict=False):
            _panel(axis, name, spread)
        for k, axis in enumerate(axes.flat[: len(panels)]):
            axis.tick_params(labelbottom=True)
            if k % _COLUMNS == 0:
                axis.set_ylabel("trials")
            axis.set_xlabel("pull, (estimate − truth)/u")
    return figure


def _finding(checked: Sequence[Checked]) -> str:
    wrong = [f"{one.subject.name}: {spread.quantity}" for one in checked for spread in one.spreads if not spread.holds]
    count = sum(len(one.spreads) for one in checked)
    if not wrong:
        return f"All {count} quantities lie about the truth as their uncertainties say"
    return f"{len(wrong)} of {count} quantities do not lie about the truth as they should: " + ", ".join(wrong)


def _panel(axis: Axes, name: str, spread: Spread) -> None:
    edges = np.linspace(-_FARTHEST, _FARTHEST, 17)
    color = _BLUE if spread.holds else _ORANGE
    axis.hist(np.clip(spread.pulls, -_FARTHEST + 1e-9, _FARTHEST - 1e-9), edges.tolist(), color=color, alpha=0.6)
    x = np.linspace(-_FARTHEST, _FARTHEST, 161)
    width = edges[1] - edges[0]
    axis.plot(x, spread.n * width * np.exp(-(x**2) / 2) / math.sqrt(2 * math.pi), color="black", lw=1)
    axis.axvline(0, color="black", lw=0.6)
    numbers = f"mean {spread.mean:+.2f}, s.d. {spread.deviation:.2f}, {100 * spread.coverage:.0f} % in ±u"
    axis.set_title(f"{name}: {spread.quantity}\n{numbers}", loc="left", fontsize=7.5)
