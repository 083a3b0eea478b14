"""Held spins → their figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from levilab.pipelines.hold.analysis import text_of
from levilab.present.drawing import headline, panel, synthetic_mark
from levilab.present.looks import LOOKS
from levilab.present.style import STYLE, WIDE

if TYPE_CHECKING:
    from levilab.pipelines.hold.analysis import HoldAnalysis


def hold_figure(analysis: HoldAnalysis) -> Figure:
    """Draw the drag of an upright top against the spin, with the laws through it."""
    found = analysis.combined
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDE, 3.3))
        finding = f"The drag at {len(analysis.runs)} held spins, and the drag laws through it"
        headline(figure, finding if len(analysis.runs) > 1 else text_of(analysis.runs[0]),
                 synthetic_mark([one.synthetic for one in analysis.sources]))  # fmt: skip
        axes = panel(figure, 0.75, 0.5, 4.05, 2.3)
        spins = np.array([run.spin.value for run in analysis.runs])
        for k, (run, factor) in enumerate(zip(analysis.runs, found.factors, strict=True)):
            if run.drag and run.drag.value is not None and run.drag.u is not None:
                axes.errorbar(
                    [spins[k]], [run.drag.value / factor], [run.drag.u / factor], capsize=2, gid=f"readings-{k}",
                    zorder=3, label=None if k else "by the amplitude", **LOOKS["readings"].as_points,
                )  # fmt: skip
        x = np.linspace(0.9 * spins.min(), 1.1 * spins.max(), 100)
        for law in found.laws:
            axes.plot(x, law.drag(x), label=law.name, **LOOKS[law.name].as_line)
        axes.set(xlabel="spin  [Hz]", ylabel="drag  [Hz/s]")
        if found.laws:
            axes.legend(loc="upper left", bbox_to_anchor=(1.03, 1.0), borderaxespad=0)
    return figure
