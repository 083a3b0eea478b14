"""The pulls of a cross-check, or the ranks of its truths: a panel a quantity, beside what they should be."""

import math
import textwrap
from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from levilab.crosscheck.calibration import band_of, by_ranks, ranks_of
from levilab.crosscheck.study import FALSE_ALARM, Judge, Spread, Study, Verdict, by_pulls
from levilab.present.drawing import SMALL, new_figure, panel, write
from levilab.present.looks import BLUE, VERMILION
from levilab.present.numbers import with_sign

_COLUMNS = 3
#: Left edge of the first panel, a panel's size, and from one to the next [inch].
_LEFT, _TOP, _SIZE, _ACROSS, _DOWN = 0.5, 1.1, (1.82, 1.15), 2.2, 2.05
#: What lies further out is drawn in the outermost bar.
_FARTHEST = 4.0
#: Height of a line of the text above the panels [inch].
_LINE = 0.14


def crosscheck_figure(checked: Sequence[Study]) -> Figure:
    """Draw histograms of pulls; vermilion and hatched where they are not as wanted."""
    about = "Bars: trials (vermilion and hatched where they are not as wanted); curve: as the uncertainties say"
    labels = "pull, (estimate − truth)/u", "trials"
    return _panels(checked, by_pulls, _draw_pulls, about, labels)


def calibration_figure(checked: Sequence[Study]) -> Figure:
    """Draw the distribution of the ranks of the truths less the uniform one, within the simultaneous band."""
    about = (
        "Line: share of trials below a rank, less the rank (vermilion: not as wanted); grey: within chance.\n"
        "Low on the left and high on the right: u is too large; high on the left and low on the right: too small."
    )
    return _panels(checked, by_ranks, _draw_ranks, about, ("rank of the truth", ""))


def _panels(
    checked: Sequence[Study],
    judge: Judge,
    draw: Callable[[Axes, Spread, Verdict], None],
    about: str,
    labels: tuple[str, str],
) -> Figure:
    panels = [(one.name, spread, judge(spread)) for one in checked for spread in one.spreads]
    rows = max(1, math.ceil(len(panels) / _COLUMNS))
    top = _TOP + _LINE * about.count("\n")
    with new_figure(top + _DOWN * (rows - 1) + _SIZE[1] + 0.55, _finding(panels), [True]) as figure:
        write(figure, 0.08, 0.5, about, fontsize=SMALL)
        for k, (name, spread, verdict) in enumerate(panels):
            down, across = divmod(k, _COLUMNS)
            axis = panel(figure, _LEFT + _ACROSS * across, top + _DOWN * down, *_SIZE)
            draw(axis, spread, verdict)
            numbers = f"mean {with_sign(spread.mean, 2)}, s {spread.deviation:.2f}, {100 * spread.coverage:.0f} % in ±u"
            lines = [*textwrap.wrap(f"{name}: {spread.quantity}", 34, max_lines=2), numbers]
            axis.set_title("\n".join(lines), fontsize=SMALL)
            axis.set_xlabel(labels[0], fontsize=8)
            if across == 0:
                axis.set_ylabel(labels[1])
    return figure


def _finding(panels: Sequence[tuple[str, Spread, Verdict]]) -> str:
    wrong = [f"{name}: {spread.quantity}" for name, spread, verdict in panels if verdict is Verdict.WRONG]
    if not wrong:
        return f"All {len(panels)} quantities lie about the truth as their uncertainties say"
    return f"{len(wrong)} of {len(panels)} quantities do not lie about the truth as they should: " + ", ".join(wrong)


def _draw_pulls(axis: Axes, spread: Spread, verdict: Verdict) -> None:
    edges = np.linspace(-_FARTHEST, _FARTHEST, 17)
    color, hatch = (VERMILION, "///") if verdict is Verdict.WRONG else (BLUE, None)
    axis.hist(
        np.clip(spread.pulls, -_FARTHEST + 1e-9, _FARTHEST - 1e-9), edges.tolist(), color=color, alpha=0.6, hatch=hatch
    )
    x = np.linspace(-_FARTHEST, _FARTHEST, 161)
    width = edges[1] - edges[0]
    axis.plot(x, spread.n * width * np.exp(-(x**2) / 2) / math.sqrt(2 * math.pi), color="black", lw=1)
    axis.axvline(0, color="black", lw=0.6)


def _draw_ranks(axis: Axes, spread: Spread, verdict: Verdict) -> None:
    lower, upper = band_of(spread.n, FALSE_ALARM / spread.among)
    rank = np.linspace(0, 1, 401)
    least, share, most = (
        np.searchsorted(ordered, rank, "right") / spread.n - rank for ordered in (upper, ranks_of(spread), lower)
    )
    axis.fill_between(rank, least, most, color="0.85", lw=0)
    axis.plot(rank, share, color=VERMILION if verdict is Verdict.WRONG else BLUE, lw=1.2)
    axis.axhline(0, color="black", lw=0.6)
    axis.set_xlim(0, 1)
