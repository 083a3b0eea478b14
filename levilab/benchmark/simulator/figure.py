"""Speed against error → the work–precision figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.figure import Figure

from levilab.present.style import STYLE

if TYPE_CHECKING:
    from levilab.benchmark.simulator.work_precision import Comparison

#: Methods that are drawn: colour, marker, line, name beside the line.
LINES = {
    "levitron-6, lanes": ("#0072B2", "s", "-", "levilab, many at once"),
    "levitron-6": ("#0072B2", "o", "-", "levilab, order 6"),
    "blanes-moan-6": ("#56B4E9", "s", "--", "levilab, Blanes and Moan's 6"),
    "kahan-li-8": ("#56B4E9", "o", "-", "levilab, order 8"),
    "blanes-moan-4": ("#56B4E9", "^", "--", "levilab, order 4"),
    "strang": ("#56B4E9", "v", ":", "levilab, order 2"),
    "heyoka batch": ("#D55E00", "s", "-", "heyoka, batch"),
    "heyoka": ("#D55E00", "o", "-", "heyoka"),
    "scipy DOP853": ("#009E73", "o", "-", "scipy DOP853"),
    "scipy LSODA": ("#CC79A7", "o", "-", "LSODA"),
    "scipy RK45": ("#009E73", "^", "--", "RK45"),
    "scipy Radau": ("#999999", "^", "--", "Radau"),
    "scipy BDF": ("#333333", "o", "-", "BDF in Euler angles"),
}
#: Lines that end at a larger error [cm] have their name there, not at the right.
BESIDE = 3e-9
TITLE = "One top of the scene undriven; levilab's kernels at fixed steps, without an error estimate: higher is faster"
#: Errors that are drawn [cm].
RANGE = (1e-1, 3e-12)


def work_precision_figure(found: Comparison) -> Figure:
    """Error at the end falling to the right, speed upwards; each method's name at its tightest point."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 6.5))
        axes = figure.add_axes((0.08, 0.09, 0.70, 0.83))
        labels = []
        for method, (colour, marker, line, name) in LINES.items():
            points = sorted(
                (100 * p.error, p.speed)
                for p in found.points
                if p.method == method and RANGE[1] < 100 * p.error < RANGE[0]
                and (method != "heyoka batch" or p.setting.endswith(_lanes(found)))
            )  # fmt: skip
            if not points:
                continue
            errors, speeds = zip(*points, strict=True)
            axes.loglog(errors, speeds, color=colour, marker=marker, linestyle=line, markersize=4, linewidth=1.3)
            if errors[0] > BESIDE:
                axes.annotate(
                    name, (errors[0], speeds[0]), xytext=(6, -4), textcoords="offset points", color=colour, fontsize=9
                )
            else:
                labels.append((speeds[0], errors[0], name, colour))
        axes.set_xlim(*RANGE)
        axes.set(xlabel="error of the place after 5 s  [cm]", ylabel="simulated seconds per second of one core")
        axes.grid(visible=True, which="major", alpha=0.3)
        _write(axes, labels)
        figure.text(0.08, 0.955, TITLE, fontsize=11)
    return figure


def _lanes(found: Comparison) -> str:
    """The batch size of heyoka that is fastest."""
    batch = [p for p in found.points if p.method == "heyoka batch"]
    return max(batch, key=lambda p: p.speed).setting.partition(", ")[2] if batch else ""


def _write(axes: mpl.axes.Axes, labels: list[tuple[float, float, str, str]]) -> None:
    """Names at the right, in the order of the lines' ends, not nearer to each other than a line of writing."""
    low, high = axes.get_ylim()

    def place(speed: float) -> float:
        return math.log(speed / low) / math.log(high / low)

    apart, last = 0.038, -1.0
    for speed, error, name, colour in sorted(labels):
        at = max(place(speed), last + apart)
        last = at
        axes.annotate(
            name, (error, speed), xytext=(1.015, at), textcoords="axes fraction", color=colour, fontsize=9, va="center",
            arrowprops={"arrowstyle": "-", "color": colour, "alpha": 0.25, "linewidth": 0.7},
        )  # fmt: skip
