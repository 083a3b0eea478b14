"""The style of all figures, and how they are saved."""

from __future__ import annotations

import io
from functools import partial
from typing import TYPE_CHECKING, Any

import matplotlib as mpl

from levilab.files import replace_atomically
from levilab.present.numbers import short_name

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Figure  # noqa: PLC0414 - for others, who may not name matplotlib


STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "levilab",
    "axes.formatter.use_mathtext": True,
}
#: One a run, as long as there are so few.
MARKERS = "osD^vP*X"


def as_png(figure: Figure) -> bytes:
    """A figure as a picture."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150)
    return buffer.getvalue()


def save_png(figure: Figure, path: Path) -> None:
    """Write a figure as a picture, which replaces an older one whole or not at all.  Raises OSError."""
    replace_atomically(path, as_png(figure))


def as_svg(figure: Figure) -> str:
    """A figure as SVG text, the same bytes for the same results."""
    buffer = io.StringIO()
    with mpl.rc_context(STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


def for_notebooks(figure: Figure) -> Figure:
    """Let a notebook show the figure as a picture, whether pyplot is imported there or not; returns the figure."""
    vars(figure)["_repr_png_"] = partial(as_png, figure)
    return figure


def label_of_run(name: str, k: int, total: int, alone: str) -> str | None:
    """What the legend says of the k-th of several runs: its name, where each has a marker of its own.

    Args:
        name: of the run.
        k: from 0.
        total: runs of the figure.
        alone: what it says of a run without others.

    >>> label_of_run("20261120T101500Z-limit-7f3a", 0, 8, "a top"), label_of_run("one", 0, 100, "a top")
    ('limit-7f3a', '100 runs: a top')
    """
    if total == 1:
        return alone
    if total <= len(MARKERS):
        return short_name(name).replace("$", r"\$").replace("_", " ")  # matplotlib reads both
    return None if k else f"{total} runs: {alone}"


def row(figure: Figure, bottom: float, height: float, n: int = 1, gap: float = 0.0) -> list[Axes]:
    """Panels side by side.  Placed by hand: automatic layouts differ in the last bit from one drawing to the next."""
    left, right = 0.085, 0.985
    width = (right - left - (n - 1) * gap) / n
    return [figure.add_axes((left + k * (width + gap), bottom, width, height)) for k in range(n)]
