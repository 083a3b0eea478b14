"""The pulls of a cross-check: a panel a quantity, beside the curve that they should follow."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from levilab.crosscheck.study import Verdict
from levilab.present.drawing import SMALL, headline, panel, write
from levilab.present.looks import BLUE, VERMILION
from levilab.present.numbers import with_sign
from levilab.present.style import STYLE, WIDE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from levilab.crosscheck.study import Spread, Study

_COLUMNS = 3
#: Left edge of the first panel, a panel's size, and from one to the next [inch].
_LEFT, _TOP, _SIZE, _ACROSS, _DOWN = 0.5, 1.1, (1.82, 1.15), 2.2, 2.05
#: What lies further out is drawn in the outermost bar.
_FARTHEST = 4.0


def crosscheck_figure(checked: Sequence[Study]) -> Figure:
    """Draw histograms of pulls; vermilion and hatched where they are not as wanted."""
    panels = [(one.name, spread) for one in checked for spread in one.spreads]
    rows = max(1, math.ceil(len(panels) / _COLUMNS))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDE, _TOP + _DOWN * (rows - 1) + _SIZE[1] + 0.55))
        headline(figure, _finding(checked), "SYNTHETIC")
        about = "Bars: trials (vermilion and hatched where they are not as wanted); curve: as the uncertainties say"
        write(figure, 0.08, 0.5, about, fontsize=SMALL)
        for k, (name, spread) in enumerate(panels):
            down, across = divmod(k, _COLUMNS)
            axis = panel(figure, _LEFT + _ACROSS * across, _TOP + _DOWN * down, *_SIZE)
            _draw(axis, name, spread)
            axis.set_xlabel("pull, (estimate − truth)/u", fontsize=8)
            if across == 0:
                axis.set_ylabel("trials")
    return figure


def _finding(checked: Sequence[Study]) -> str:
    wrong = [
        f"{one.name}: {spread.quantity}" for one in checked for spread in one.spreads if spread.verdict is Verdict.WRONG
    ]
    count = sum(len(one.spreads) for one in checked)
    if not wrong:
        return f"All {count} quantities lie about the truth as their uncertainties say"
    return f"{len(wrong)} of {count} quantities do not lie about the truth as they should: " + ", ".join(wrong)


def _draw(axis: Axes, name: str, spread: Spread) -> None:
    edges = np.linspace(-_FARTHEST, _FARTHEST, 17)
    color, hatch = (BLUE, None) if spread.verdict is not Verdict.WRONG else (VERMILION, "///")
    axis.hist(
        np.clip(spread.pulls, -_FARTHEST + 1e-9, _FARTHEST - 1e-9), edges.tolist(), color=color, alpha=0.6, hatch=hatch
    )
    x = np.linspace(-_FARTHEST, _FARTHEST, 161)
    width = edges[1] - edges[0]
    axis.plot(x, spread.n * width * np.exp(-(x**2) / 2) / math.sqrt(2 * math.pi), color="black", lw=1)
    axis.axvline(0, color="black", lw=0.6)
    numbers = f"mean {with_sign(spread.mean, 2)}, s {spread.deviation:.2f}, {100 * spread.coverage:.0f} % in ±u"
    lines = [*textwrap.wrap(f"{name}: {spread.quantity}", 34, max_lines=2), numbers]
    axis.set_title("\n".join(lines), fontsize=SMALL)
