"""Calls at their achieved errors → a panel for each motion and duration, and one for the ensemble."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure

from levilab.present.style import STYLE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from levilab.benchmark.simulator.as_called.comparison import Case
    from levilab.benchmark.simulator.speeds import Ratio

#: Methods that are drawn: colour, marker, line, name in the legend.
LINES: dict[str, tuple[str, str, Any, str]] = {
    "simulate": ("#0072B2", "o", "-", "levilab, simulate"),
    "simulate_many": ("#0072B2", "s", "-", "levilab, simulate_many"),
    "heyoka": ("#D55E00", "o", "-", "heyoka"),
    "heyoka batch, 4 lanes": ("#D55E00", "s", "--", "heyoka, batches of 4"),
    "heyoka batch, 8 lanes": ("#D55E00", "s", "-", "heyoka, batches of 8"),
    "scipy DOP853": ("#009E73", "o", "-", "scipy, DOP853"),
}
#: Errors [cm] and speeds that are drawn.
ERRORS, SPEEDS = (1e-3, 3e-12), (10.0, 1e6)
NOTES = (
    "Each point is one setting of a tolerance;\n"
    "further right is better, higher is faster.\n"
    "levilab estimates its error in the same\n"
    "call, the others control their steps.\n\n"
    "Dashed: errors of 10⁻⁶ and 10⁻⁹ cm, with\n"
    "levilab's speed over heyoka's at that\n"
    "error, and the ratio that is aimed at."
)


def as_called_figure(cases: Sequence[Case]) -> Figure:
    """Durations below each other, motions beside each other, the ensemble with the legend at the right."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(13, 6.8))
        single = [case for case in cases if case.task.tops == 1]
        names = list(dict.fromkeys(case.task.name for case in single))
        durations = list(dict.fromkeys(case.task.duration for case in single))
        for case in cases:
            alone = case.task.tops == 1
            column = names.index(case.task.name) if alone else len(names)
            row = durations.index(case.task.duration) if alone else 0
            axes = figure.add_axes((0.055 + 0.19 * column, 0.53 - 0.445 * row, 0.165, 0.36))
            _draw(axes, case)
            if column == 0:
                axes.set_ylabel("simulated seconds per second\nof one core")
            else:
                axes.tick_params(labelleft=False)
            if not alone or row == len(durations) - 1:
                axes.set_xlabel("error of the place at the end  [cm]")
        _explain(figure, cases)
        figure.text(0.055, 0.955, "As called: simulate and its peers at the errors that they achieve", fontsize=11)
    return figure


def _draw(axes: Axes, case: Case) -> None:
    """One panel."""
    lines: dict[str, list[tuple[float, float]]] = {}
    for point in case.points:
        if point.error > 0 and math.isfinite(point.error):
            variant = point.setting.partition(",")[2]
            name = f"{point.method},{variant}" if variant else point.method
            lines.setdefault(name, []).append((100 * point.error, point.speed))
    for name, points in lines.items():
        colour, marker, line, _ = LINES[name]
        errors, speeds = zip(*points, strict=True)
        axes.loglog(errors, speeds, color=colour, marker=marker, linestyle=line, markersize=3.5, linewidth=1.2)
    for ratio in case.ratios:
        axes.axvline(100 * ratio.error, color="#666666", linestyle="--", linewidth=0.8)
        axes.annotate(
            _label(ratio), (100 * ratio.error, SPEEDS[1]), xytext=(4, -3), textcoords="offset points",
            va="top", fontsize=8.5, color="#333333",
        )  # fmt: skip
    axes.set(xlim=ERRORS, ylim=SPEEDS, title=f"{case.task.name}, {case.task.duration:g} s")


def _label(ratio: Ratio) -> str:
    value = "–" if math.isnan(ratio.ratio) else f"{ratio.ratio:.2g}×"
    return f"{value}\naim {ratio.aim:g}"


def _explain(figure: Figure, cases: Sequence[Case]) -> None:
    """The legend and what the panels show."""
    drawn = {point.method for case in cases for point in case.points}
    handles = [
        mpl.lines.Line2D([], [], color=colour, marker=marker, linestyle=line, markersize=4, label=name)
        for method, (colour, marker, line, name) in LINES.items()
        if method.partition(",")[0] in drawn
    ]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.805, 0.45))
    figure.text(0.808, 0.25, NOTES, va="top", fontsize=8, linespacing=1.35)
