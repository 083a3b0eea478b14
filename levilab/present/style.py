"""The style of all figures, and how a figure becomes SVG, PDF or PNG, the same bytes each time."""

from __future__ import annotations

import io
import re
from functools import partial
from html import escape
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import matplotlib.text
import matplotlib.ticker

from levilab.errors import UsageError
from levilab.files import replace_atomically
from levilab.present.looks import MARKERS
from levilab.present.numbers import short_name
from levilab.texts.text import Text, in_language

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Figure  # noqa: PLC0414 - for others, who may not name matplotlib

#: Widths of figures [inches]: one column of a journal, and two.
NARROW, WIDE = 3.4, 7.0
#: Height of a wide figure beyond which it does not fit with its caption on a page, and is made smaller [inches].
TALLEST = 8.4


def _sheet() -> dict[str, Any]:
    """Return matplotlib's defaults with levilab.mplstyle over them; a person's matplotlibrc changes nothing."""
    own = resources.files("levilab.present") / "levilab.mplstyle"
    with resources.as_file(own) as path:
        sheet = mpl.rc_params_from_file(path, use_default_template=False)
    style: dict[str, Any] = {}
    for values in (mpl.rcParamsDefault, sheet):
        style.update({key: value for key, value in values.items() if key not in _NOT_STYLE})
    return style


#: Parameters of the program, not of its figures.
_NOT_STYLE = frozenset({
    "backend", "backend_fallback", "interactive", "toolbar", "timezone", "date.epoch", "docstring.hardcopy",
    "figure.max_open_warning", "figure.raise_window", "savefig.directory", "tk.window_focus", "webagg.address",
    "webagg.open_in_browser", "webagg.port", "webagg.port_retries",
})  # fmt: skip
#: What a figure is drawn and saved with.
STYLE: Any = _sheet()


def _say(figure: Figure) -> None:
    """Let the texts and the numbers of a figure be in the language of this process."""
    for text in figure.findobj(mpl.text.Text):
        text.set_text(in_language(text.get_text()))
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        formatter = axis.get_major_formatter()
        if isinstance(formatter, mpl.ticker.ScalarFormatter):
            vars(formatter)["format_ticks"] = partial(_numbers, type(formatter).format_ticks, formatter)


def _numbers(format_ticks: Callable[..., list[str]], formatter: Any, values: Any) -> list[str]:
    """Return the numbers of an axis with the decimal sign of the language."""
    return [in_language(Text("{number:n}", number=text)) for text in format_ticks(formatter, values)]


def as_png(figure: Figure, dpi: float = 150) -> bytes:
    """Return a figure as a picture."""
    buffer = io.BytesIO()
    _say(figure)
    with mpl.rc_context(STYLE):
        figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None})
    return buffer.getvalue()


def save_png(figure: Figure, path: Path) -> None:
    """Write a figure as a picture, which replaces an older one whole or not at all.  Raises OSError."""
    replace_atomically(path, as_png(figure))


def as_pdf(figure: Figure) -> bytes:
    """Return a figure as a page of PDF of its own size, with its fonts."""
    buffer = io.BytesIO()
    _say(figure)
    with mpl.rc_context(STYLE):
        figure.savefig(buffer, format="pdf", metadata={"CreationDate": None, "Creator": None, "Producer": None})
    return buffer.getvalue()


def as_svg(figure: Figure, prefix: str = "", title: str = "") -> str:
    """Return a figure as one <svg> element, for a page that may hold others, or as a file of its own.

    An artist whose points answer to the pointer has ``set_gid("readings-NAME")``.  Matplotlib writes each marker of a
    `Line2D` as a ``<use>`` element inside of the group ``<g id="PREFIX-readings-NAME">``, in the order of the line's
    points; it leaves out points that are not finite or lie outside of the figure, so such a line has none of these.

    Args:
        figure: as a figure's function returns it.
        prefix: put before every id with a hyphen, so that no two figures of a page share one: matplotlib gives the same
            ids in every figure.  Letters, digits, hyphens; empty for a file of its own.
        title: the figure's name for screen readers.
    """
    buffer = io.StringIO()
    _say(figure)
    with mpl.rc_context(STYLE):
        figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    return _for_a_page(buffer.getvalue(), prefix, title)


#: Of matplotlib's SVG: texts as comments, a rule for all elements of the page, and the places where an id stands.
_COMMENT = re.compile(r"\s*<!--.*?-->", re.DOTALL)
_RULE = re.compile(r"\s*<defs>\s*<style type=\"text/css\">\*\{[^}]*\}</style>\s*</defs>")
_IDS = re.compile(r"(\sid=\"|href=\"#|url\(#)")
#: Places in points, with more digits than a hundredth of a point, which no eye sees.
_PLACES = re.compile(r"\s(?:d|x|y)=\"[^\"]*\"")
_DIGITS = re.compile(r"(\.\d\d)\d+")
_PREFIX = re.compile(r"[A-Za-z][A-Za-z0-9_-]*|")


def _for_a_page(svg: str, prefix: str, title: str) -> str:
    if not _PREFIX.fullmatch(prefix):
        raise ValueError(f"{prefix!r} is no prefix of ids: it begins with a letter and has letters, digits and hyphens")
    svg = svg[svg.index("<svg") :]
    svg = _PLACES.sub(lambda found: _DIGITS.sub(r"\1", found[0]), svg)
    svg = _RULE.sub("", _COMMENT.sub("", svg), count=1)
    if prefix:
        svg = _IDS.sub(rf"\g<1>{prefix}-", svg)
    about = f' aria-label="{escape(title)}"' if title else ""
    own = f'<svg role="img"{about} stroke-linejoin="round" stroke-linecap="butt"'
    head, body = svg.split(">", 1)
    return f"{head.replace('<svg', own, 1)}>{body}"


def for_notebooks(figure: Figure, figsize: tuple[float, float] | None = None) -> Figure:
    """Let a notebook show the figure as a picture, in the size wanted [inch]; returns the figure."""
    if figsize is not None:
        try:
            figure.set_size_inches(figsize)
        except (TypeError, ValueError):
            raise UsageError("figsize", "width and height in inches are expected: (9, 4)", value=figsize) from None
    vars(figure)["_repr_png_"] = partial(as_png, figure)
    return figure


def without_formula(text: str, most: int = 1000) -> str:
    """Return what a person typed as a text of a figure that stands there letter by letter, cut to `most` of them."""
    text = text if len(text) <= most else f"{text[: most - 1]}…"
    return text.replace("\\", "\\\\").replace("$", r"\$")


def label_of_run(name: str, k: int, total: int, alone: str) -> str | None:
    """Return what the legend says of the k-th of several runs: its name, where each has a marker of its own.

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
        return without_formula(short_name(name)).replace("_", " ")  # matplotlib hides a label that begins with it
    return None if k else f"{total} runs: {alone}"


def row(figure: Figure, bottom: float, height: float, n: int = 1, gap: float = 0.0) -> list[Axes]:
    """Panels side by side.  Placed by hand: automatic layouts differ in the last bit from one drawing to the next."""
    left, right = 0.085, 0.985
    width = (right - left - (n - 1) * gap) / n
    return [figure.add_axes((left + k * (width + gap), bottom, width, height)) for k in range(n)]


def font_folder() -> Path:
    """Return the folder of matplotlib's fonts, with which documents are the same on every machine."""
    return Path(mpl.get_data_path()) / "fonts" / "ttf"


def figure_of_png(png: bytes) -> Figure:
    """Return a picture as a figure of the same size, for documents, which want figures."""
    from matplotlib.figure import Figure as NewFigure
    from matplotlib.image import imread

    pixels = imread(io.BytesIO(png), format="png")
    figure = NewFigure(figsize=(WIDE, WIDE * pixels.shape[0] / pixels.shape[1]))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.imshow(pixels, aspect="auto")
    return figure
