"""Speed against error → the work–precision figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.figure import Figure

from levilab.present.drawing import SMALL, headline, panel
from levilab.present.looks import BLACK, BLUE, GREEN, GREY, PURPLE, SKY, VERMILION
from levilab.present.style import STYLE, WIDE

if TYPE_CHECKING:
    from levilab.benchmark.simulator.work_precision import Comparison

#: Methods that are drawn: colour, marker, line, name in the legend.
LINES = {
    "levitron-6, lanes": (BLUE, "s", "-", "levilab, many at once"),
    "levitron-6": (BLUE, "o", "-", "levilab, order 6"),
    "blanes-moan-6": (SKY, "s", "--", "levilab, Blanes and Moan's 6"),
    "kahan-li-8": (SKY, "o", "-", "levilab, order 8"),
    "blanes-moan-4": (SKY, "^", "--", "levilab, order 4"),
    "strang": (SKY, "v", ":", "levilab, order 2"),
    "heyoka batch": (VERMILION, "s", "-", "heyoka, batch"),
    "heyoka": (VERMILION, "o", "-", "heyoka"),
    "scipy DOP853": (GREEN, "o", "-", "scipy DOP853"),
    "scipy LSODA": (PURPLE, "o", "-", "LSODA"),
    "scipy RK45": (GREEN, "^", "--", "RK45"),
    "scipy Radau": (GREY, "^", "--", "Radau"),
    "scipy BDF": (BLACK, "o", "-", "BDF in Euler angles"),
}
TITLE = "Speed against error of one top, scene undriven: levilab's kernels at fixed steps, without an error estimate"
#: Errors that are drawn [cm].
RANGE = (1e-1, 3e-12)


@mpl.rc_context(STYLE)
def work_precision_figure(found: Comparison) -> Figure:
    """Draw speed against the error at the end, which falls to the right; the names beside, fastest first."""
    figure = Figure(figsize=(WIDE, 4.1))
    headline(figure, TITLE)
    axes = panel(figure, 0.75, 0.55, 4.2, 3.0)
    fastest = {}
    for method, (colour, marker, line, name) in LINES.items():
        points = sorted(
            (100 * p.error, p.speed)
            for p in found.points
            if p.method == method and RANGE[1] < 100 * p.error < RANGE[0]
            and (method != "heyoka batch" or p.setting.endswith(_lanes(found)))
        )  # fmt: skip
        if points:
            errors, speeds = zip(*points, strict=True)
            fastest[name] = max(speeds)
            axes.loglog(errors, speeds, color=colour, marker=marker, linestyle=line, label=name)
    axes.set_xlim(*RANGE)
    axes.set(xlabel="error of the place after 5 s  [cm]; smaller to the right",
             ylabel="simulated seconds per second of one core")  # fmt: skip
    axes.grid(visible=True, which="major")
    handles, names = axes.get_legend_handles_labels()
    order = sorted(range(len(names)), key=lambda k: -fastest[names[k]])
    axes.legend(
        [handles[k] for k in order], [names[k] for k in order], loc="upper left", bbox_to_anchor=(1.02, 1.0),
        fontsize=SMALL, borderaxespad=0, labelspacing=0.6,
    )  # fmt: skip
    axes.text(1.04, 0.0, "higher is faster", transform=axes.transAxes, fontsize=SMALL)
    return figure


def _lanes(found: Comparison) -> str:
    batch = [p for p in found.points if p.method == "heyoka batch"]
    return max(batch, key=lambda p: p.speed).setting.partition(", ")[2] if batch else ""
