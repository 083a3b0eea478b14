"""Held spins → their figure."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from levilab.pipelines.hold.analysis import HoldAnalysis, text_of
from levilab.present.drawing import new_figure, panel
from levilab.present.looks import LOOKS
from levilab.texts.text import Text

#: Where the drag over that of the best law is drawn: laws that are excluded leave it.
_RATIOS = (0.9, 1.1)


def hold_figure(analysis: HoldAnalysis) -> Figure:
    """Draw the drag of an upright top against the spin, with the laws through it; and both over the best law's."""
    found, best = analysis.combined, analysis.combined.best
    of_several = Text("The drag at {n} held spins, and the drag laws through it", n=len(analysis.runs))
    finding = of_several if len(analysis.runs) > 1 else text_of(analysis.runs[0]).each[0]
    with new_figure(5.3 if best else 3.3, finding, [one.synthetic for one in analysis.sources]) as figure:
        upper = panel(figure, 0.75, 0.5, 4.05, 2.3)
        _draw(upper, analysis, "readings", np.ones_like)
        upper.set(ylabel="drag  [Hz/s]")
        if found.laws:
            upper.legend(loc="upper left", bbox_to_anchor=(1.03, 1.0), borderaxespad=0)
        if best:
            lower = panel(figure, 0.75, 3.1, 4.05, 1.7)
            _draw(lower, analysis, "ratios", best.drag)
            lower.set(ylabel=Text("drag over that of {law}", law=best.name), ylim=_RATIOS)
        figure.axes[-1].set(xlabel="spin  [Hz]")
    return figure


def _draw(axes: Axes, analysis: HoldAnalysis, gid: str, over: Callable[[np.ndarray], np.ndarray]) -> None:
    spins = np.array([run.spin.value for run in analysis.runs])
    for k, (run, unit) in enumerate(zip(analysis.runs, analysis.combined.factors * over(spins), strict=True)):
        if run.drag and run.drag.value is not None and run.drag.u is not None:
            axes.errorbar(
                [spins[k]], [run.drag.value / unit], [run.drag.u / unit], capsize=2, gid=f"{gid}-{k}",
                zorder=3, label=None if k else "by the amplitude", **LOOKS["readings"].as_points,
            )  # fmt: skip
    x = np.linspace(0.9 * spins.min(), 1.1 * spins.max(), 100)
    for law in analysis.combined.laws:
        axes.plot(x, law.drag(x) / over(x), label=law.name, **LOOKS[law.name].as_line)
