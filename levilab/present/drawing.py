"""What figures share: panels placed by hand in inches, the sentence above them, bands, envelopes, labels beside lines.

Panels are placed by hand because automatic layouts differ in the last bit from one drawing to the next.
"""

from __future__ import annotations

import re
import textwrap
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from levilab.present.looks import GREY, MARKERS, SERIES, Look
from levilab.present.style import STYLE, WIDE
from levilab.present.units import KNOWN
from levilab.texts.text import Text, in_language

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from analysis.arrays import Array


#: Half widths of the bands that a residual in units of its u is judged by, and how dark they are.
SIGMAS = ((2.0, 0.07), (1.0, 0.10))
#: The smallest text, for marks and long legends [pt].
SMALL = 7.0
#: Widths of a letter of 9 pt on the average [inch], for wrapping.
_LETTER = 0.078
#: The unit of a number, with the space before it.
_UNIT = re.compile(rf"(?<=[\d)]) (?:{'|'.join(map(re.escape, sorted(KNOWN, key=len, reverse=True)))})(?!\w)")
#: Height of a line of small text [inch].
_LINE = 0.125


@contextmanager
def new_figure(height: float, text: str, synthetic: Sequence[bool] = ()) -> Iterator[Figure]:
    """Yield a figure as wide as a page, in the style of all, with its headline.

    Args:
        height: of the figure [inch].
        text: see `headline`.
        synthetic: whether each input is synthetic.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDE, height))
        headline(figure, text, synthetic_mark(synthetic))
        yield figure


def panel(figure: Figure, left: float, top: float, width: float, height: float, **more: Any) -> Axes:
    """Return a panel whose upper left corner is so far from that of the figure; all in inches."""
    wide, high = figure.get_size_inches()
    return figure.add_axes((left / wide, 1 - (top + height) / high, width / wide, height / high), **more)


def write(figure: Figure, left: float, top: float, text: str, **style: Any) -> None:
    """Write a text whose upper left corner is so far from that of the figure [inch]."""
    wide, high = figure.get_size_inches()
    figure.text(left / wide, 1 - top / high, text, va="top", **style)


def headline(figure: Figure, text: str, synthetic: str = "") -> None:
    """Write what the figure shows in one sentence at its top, and at the right the mark of data that nothing measured.

    Args:
        figure: as wide as the text may be.
        text: the finding; it takes two lines at the most.
        synthetic: the mark, empty for measured data.
    """
    text, synthetic = in_language(text), in_language(synthetic)
    width = figure.get_size_inches()[0] - 0.1
    room = width - 0.4 - (len(synthetic) + 1) * 0.075 if synthetic else width - 0.1
    lines = _in_two_lines(text, int(room / _LETTER))
    write(figure, 0.08, 0.08, "\n".join(lines), fontsize=9, fontweight="bold", linespacing=1.25)
    if synthetic:
        mark = {"boxstyle": "square,pad=0.25", "facecolor": "white", "edgecolor": "black", "linewidth": 0.8}
        write(figure, width, 0.09, synthetic, fontsize=SMALL, ha="right", bbox=mark)


def _in_two_lines(text: str, most: int) -> list[str]:
    r"""Return a text in one line of at most `most` letters, or in two lines of about the same length.

    >>> _in_two_lines("Spin-down: the mixed law is the best; Newton is excluded", 50)
    ['Spin-down: the mixed law is', 'the best; Newton is excluded']
    >>> _in_two_lines("Held at 45.0005(10) Hz, it floats", 25)  # no number without its unit
    ['Held at 45.0005(10)\xa0Hz,', 'it floats']
    """
    text = _UNIT.sub(lambda unit: unit[0].replace(" ", "\N{NO-BREAK SPACE}"), text)
    widths = range(len(text) // 2, most) if len(text) > most else ()
    halves = (textwrap.wrap(text, width) for width in widths)
    return next((two for two in halves if len(two) == 2), textwrap.wrap(text, most, max_lines=2, placeholder=" …"))


def synthetic_mark(synthetic: Sequence[bool]) -> str:
    """Return what stands in the mark, for inputs of which some are synthetic; empty where none is.

    >>> synthetic_mark([True, True]), synthetic_mark([True, False]), synthetic_mark([False])
    ('SYNTHETIC', '1 of 2 SYNTHETIC', '')
    """
    count = sum(synthetic)
    if not count:
        return ""
    return "SYNTHETIC" if count == len(synthetic) else Text("{count} of {n} SYNTHETIC", count=count, n=len(synthetic))


def sigma_bands(axes: Axes) -> None:
    """Draw zero and the bands of ±1 and ±2 that residuals in units of their u are judged by."""
    for half, alpha in SIGMAS:
        axes.axhspan(-half, half, color="black", alpha=alpha, linewidth=0)
    axes.axhline(0, color="black", linewidth=0.6)


def band(axes: Axes, x: Array, y: Array, half: Array, colour: str, **more: Any) -> None:
    """Draw a band of y ± half."""
    axes.fill_between(x, y - half, y + half, **{"color": colour, "alpha": 0.25, "linewidth": 0, **more})


@dataclass(frozen=True)
class Columns:
    """Least, mean and greatest value of each piece of a long curve: what a column of pixels can show."""

    time: Array
    low: Array
    mean: Array
    high: Array


def columns(time: Array, values: Array, pieces: int) -> Columns:
    """Cut a curve into pieces of equally many points.

    >>> found = columns(np.arange(6.0), np.array([0.0, 1, 2, 3, 4, 6]), 2)
    >>> found.low.tolist(), found.mean.tolist(), found.high.tolist()
    ([0.0, 3.0], [1.0, 4.333333333333333], [2.0, 6.0])
    """
    edges = np.unique(np.linspace(0, len(time), pieces + 1).astype(np.intp)[:-1])
    count = np.diff([*edges, len(time)])

    def means(of: Array) -> Array:
        return np.asarray(np.add.reduceat(of, edges) / count, dtype=np.float64)

    return Columns(means(time), np.minimum.reduceat(values, edges), means(values), np.maximum.reduceat(values, edges))


def curve(axes: Axes, time: Array, values: Array, look: Look, *, pieces: int = 600, label: str | None = None) -> bool:
    """Draw a line; one with more points than can be distinguished as its envelope and its mean.

    Returns:
        whether it is an envelope.
    """
    found = columns(time, values, pieces)
    if len(time) <= 4 * pieces or not _oscillates(found):
        axes.plot(time, values, linewidth=0.9, label=label, **look.as_line)  # saved without the points no eye misses
        return False
    mean = columns(time, values, pieces // 12)
    axes.fill_between(found.time, found.low, found.high, color=look.colour, alpha=0.35, linewidth=0, label=label)
    for edge in (found.low, found.high):
        axes.plot(found.time, edge, color=look.colour, linewidth=0.4)
    axes.plot(mean.time, mean.mean, color="black", linewidth=0.9)
    return True


def _oscillates(found: Columns) -> bool:
    """Return whether the curve swings within its pieces: further than from one to the next, and visibly."""
    within = found.high - found.low
    whole = float(np.max(found.high) - np.min(found.low))
    return bool(np.median(within) > 0.05 * whole and within.sum() > 1.5 * np.abs(np.diff(found.mean)).sum())


def run_look(k: int, total: int) -> Look:
    """Return how the k-th of several runs is drawn: by a marker and a colour of its own while there are few."""
    if total == 1:
        return Look(SERIES[0], marker=MARKERS[0])
    if total <= len(MARKERS):
        return Look(SERIES[k], marker=MARKERS[k])
    return Look(GREY, marker="o")


def power_of_ten(values: ArrayLike) -> tuple[float, str]:
    """Return the power of ten for an axis's label, and its text: above the axis it would push the title out.

    >>> power_of_ten([2e-5, -3e-4]), power_of_ten([12.0])
    ((0.0001, '$10^{−4}$ '), (1.0, ''))
    """
    largest = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
    power = int(np.floor(np.log10(largest))) if largest > 0 and not 0.01 <= largest < 1e4 else 0
    return 10.0**power, f"$10^{{{power}}}$ ".replace("-", "−") if power else ""


def limits_about(values: ArrayLike, margin: float) -> tuple[float, float]:
    """Return limits of an axis that hold all finite values, with a margin as a share of their range.

    >>> limits_about([1.0, 3.0], 0.5), limits_about([2.0], 0.5)
    ((0.0, 4.0), (0.0, 4.0))
    """
    finite = np.asarray(values, dtype=np.float64)
    finite = finite[np.isfinite(finite)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    add = margin * (high - low) or abs(high) or 1.0
    return low - add, high + add


#: A power in brackets, or a fraction without them.
_RAISED = re.compile(r"\^(?:\(([^()]+)\)|(−?(?:½|\d+/\d+)))")


def in_mathtext(text: str) -> str:
    """Return plain notation as matplotlib has it: what follows ^ is raised, the index of a Greek letter is lowered.

    >>> in_mathtext("ω̇ = −C₃/₂ω^(3/2)"), in_mathtext("(rad/s)^−½/s"), in_mathtext("Ω_g/2π")
    ('ω̇ = −C$_{3/2}$ω$^{3/2}$', '(rad/s)$^{−1/2}$/s', 'Ω$_g$/2π')
    """
    raised = _RAISED.sub(lambda found: f"$^{{{(found[1] or found[2]).replace('½', '1/2')}}}$", text)
    return re.sub(r"(?<=[Α-ω])_(\w)", r"$_\1$", raised.replace("₃/₂", "$_{3/2}$"))
