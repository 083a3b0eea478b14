"""Calls at their achieved errors → a panel for each motion and duration, and one for the ensemble."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure

from levilab.present.drawing import SMALL, headline, panel, write
from levilab.present.looks import BLUE, GREEN, GREY, VERMILION
from levilab.present.style import STYLE, WIDE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from as_called.comparison import Case
    from levilab.benchmark.simulator.work_precision import Ratio

#: Methods that are drawn: colour, marker, line, name in the legend.
LINES: dict[str, tuple[str, str, Any, str]] = {
    "simulate": (BLUE, "o", "-", "levilab, simulate"),
    "simulate_many": (BLUE, "s", "-", "levilab, simulate_many"),
    "heyoka": (VERMILION, "o", "-", "heyoka"),
    "heyoka batch, 4 lanes": (VERMILION, "s", "--", "heyoka, batches of 4"),
    "heyoka batch, 8 lanes": (VERMILION, "s", "-", "heyoka, batches of 8"),
    "scipy DOP853": (GREEN, "o", "-", "scipy, DOP853"),
}
#: Errors [cm] and speeds that are drawn.
ERRORS, SPEEDS = (1e-3, 3e-12), (10.0, 1e6)
#: From the top of the figure to its panels, and from a row to the next [inch].
_TOP, _DOWN = 0.95, 2.05
NOTES = (
    "A point: one tolerance.\n"
    "Right: better; up: faster.\n"
    "levilab estimates its error\n"
    "in the same call, others\n"
    "control their steps.\n\n"
    "Dashed: 10⁻⁶ and 10⁻⁹ cm,\n"
    "with levilab's speed over\n"
    "heyoka's and the aim."
)


def as_called_figure(cases: Sequence[Case]) -> Figure:
    """Durations below each other, motions beside each other, and below them the ensemble and the legend."""
    single = [case for case in cases if case.task.tops == 1]
    names = list(dict.fromkeys(case.task.name for case in single))
    durations = list(dict.fromkeys(case.task.duration for case in single))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDE, _TOP + _DOWN * (len(durations) + 1) - 0.25))
        headline(figure, "As called: simulate and its peers at the errors that they achieve")
        for case in cases:
            alone = case.task.tops == 1
            column = names.index(case.task.name) if alone else 0
            row = durations.index(case.task.duration) if alone else len(durations)
            axes = panel(figure, 0.75 + 1.58 * column, _TOP + _DOWN * row, 1.4, 1.25)
            _draw(axes, case)
            if column == 0:
                axes.set_ylabel("simulated s per s", fontsize=8)
            else:
                axes.tick_params(labelleft=False)
            if row >= len(durations) - 1:
                axes.set_xlabel("error at the end  [cm]", fontsize=8)
        _explain(figure, cases, _TOP + _DOWN * len(durations))
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
        axes.axvline(100 * ratio.error, color=GREY, linestyle="--", linewidth=0.8)
        axes.annotate(
            _label(ratio), (100 * ratio.error, SPEEDS[1]), xytext=(0, 2), textcoords="offset points",
            va="bottom", ha="center", fontsize=SMALL,
        )  # fmt: skip
    axes.set(xlim=ERRORS, ylim=SPEEDS)
    axes.set_title(f"{case.task.name}, {case.task.duration:g} s", pad=24 if case.ratios else None, fontsize=8)
    axes.tick_params(labelsize=SMALL)


def _label(ratio: Ratio) -> str:
    value = "–" if math.isnan(ratio.ratio) else f"{ratio.ratio:.2g}×"
    return f"{value}\naim {ratio.aim:g}"


def _explain(figure: Figure, cases: Sequence[Case], top: float) -> None:
    """The legend and what the panels show."""
    drawn = {point.method for case in cases for point in case.points}
    handles = [
        mpl.lines.Line2D([], [], color=colour, marker=marker, linestyle=line, markersize=4, label=name)
        for method, (colour, marker, line, name) in LINES.items()
        if method.partition(",")[0] in drawn
    ]
    place = (2.6 / WIDE, 1 - top / figure.get_figheight())
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=place, fontsize=SMALL, borderaxespad=0)
    write(figure, 4.6, top, NOTES, fontsize=SMALL, linespacing=1.35)
