"""Figures that no test looks at, and what is wrong with those that tests look at."""

import base64
import contextlib

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from levilab.present.style import as_png, as_svg

#: Pixels that a letter's box is larger than the letter, and by how much less than a line's box is looked at.
_EDGE = 1.5
#: Of the points of a line: where its pieces begin, and where they end.
_STARTS, _ENDS = slice(None, -1), slice(1, None)


#: The smallest picture that can be read.
ONE_PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg=="
)


@contextlib.contextmanager
def without_drawing():
    """Figures are made, but matplotlib does not draw them: that is most of what a result or a page costs."""
    with _drawing_by(lambda *_, **__: ONE_PIXEL, lambda *_, **__: "<svg/>"):
        yield


@contextlib.contextmanager
def with_drawing():
    """Figures are drawn, as without these tests; for those that look at what matplotlib makes of them."""
    with _drawing_by(as_png, as_svg):
        yield


@contextlib.contextmanager
def _drawing_by(png, svg):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("levilab.present.style.as_png", png)
        patch.setattr("levilab.present.style.as_svg", svg)
        yield


@contextlib.contextmanager
def without_figures():
    """Figures of analyses are empty: for texts of a page whose figure other tests make from the same runs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("levilab.pipelines.document.Analysis.figure", lambda *_, **__: Figure())
        yield


def faults(figure):
    """Texts that lie over each other, over a line or a marker, or beyond the figure; each in words."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    whole = figure.bbox
    boxes = [(text, _box(text)) for text in _texts(figure)]
    found = [f"beyond the figure: {_named(text)}" for text, box in boxes if not _inside(box, whole)]
    for k, (text, box) in enumerate(boxes):
        found += [f"{_named(text)} over {_named(other)}" for other, at in boxes[:k] if _overlap(box, at)]
    for axes in figure.axes:
        if axes.get_visible():
            for what, marks in _drawn(axes):
                if len(marks):
                    around = Bbox((marks.min(axis=0), marks.max(axis=0)))
                    beside = [(text, box) for text, box in boxes if _overlap(around, box)]
                    found += [f"{_named(text)} over {what}" for text, box in beside if _hits(marks, box)]
    return found


def _texts(figure):
    """All that can be read: with anything written, visible, and inside of a visible panel."""
    hidden = {id(text) for axes in figure.axes if not axes.get_visible() for text in axes.findobj(Text)}
    ticks = {id(text) for axes in figure.axes for text in _idle_ticks(axes)}
    return [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in hidden | ticks
    ]


def _idle_ticks(axes):
    """Labels of ticks that are not drawn: those beyond the limits."""
    for axis in (axes.xaxis, axes.yaxis):
        shown = {id(text) for tick in axis._update_ticks() for text in (tick.label1, tick.label2)}
        yield from (text for text in axis.findobj(Text) if id(text) not in shown and text is not axis.label)
        if not axes.axison:
            yield from axis.findobj(Text)


def _box(text):
    box = text.get_window_extent()
    return Bbox.from_extents(box.x0 + _EDGE, box.y0 + _EDGE, box.x1 - _EDGE, box.y1 - _EDGE)


def _named(text):
    return repr(" ".join(text.get_text().split())[:40])


def _inside(box, whole):
    return bool(box.x0 >= whole.x0 and box.y0 >= whole.y0 and box.x1 <= whole.x1 and box.y1 <= whole.y1)


def _overlap(one, other):
    return bool(one.x0 <= other.x1 and other.x0 <= one.x1 and one.y0 <= other.y1 and other.y0 <= one.y1)


def _drawn(axes):
    """Of each line and each bar of a panel, its name and points a pixel apart, in pixels."""
    inside = axes.get_window_extent()
    for line in axes.get_lines():
        if line.get_visible():
            yield f"the line {line.get_label()}", _clipped(_line(line), inside if line.get_clip_on() else None)
    for bars in axes.collections:
        if isinstance(bars, LineCollection) and bars.get_visible():
            pieces = [piece for piece in bars.get_segments() if len(piece) > 1]
            if pieces:
                to_pixels = bars.get_transform().transform
                starts, ends = (to_pixels(np.concatenate([piece[k] for piece in pieces])) for k in (_STARTS, _ENDS))
                yield "a bar", _clipped(_between(starts, ends), inside)


def _line(line):
    path = line.get_transform().transform_path(line.get_path())
    points = np.asarray(path.vertices, dtype=np.float64)
    points = points[np.isfinite(points).all(axis=1)]
    if line.get_linestyle() not in {"None", "none", "", " "} and len(points) > 1:
        return _dense(points)
    return points if line.get_marker() not in {"None", "none", "", " "} else points[:0]


def _dense(points):
    """The line through some points as points at most a pixel apart."""
    return _between(points[_STARTS], points[_ENDS])


def _between(starts, ends):
    """Straight pieces as points at most a pixel apart, with both ends; no more than can matter."""
    starts, ends = (np.clip(points, -1e4, 1e4) for points in (starts, ends))
    steps = np.maximum(np.ceil(np.hypot(*(ends - starts).T)).astype(int), 1)
    if steps.sum() > 200_000:
        return np.concatenate([starts, ends])
    number = np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)  # of the step in its piece
    step = np.repeat((ends - starts) / steps[:, None], steps, axis=0)
    return np.concatenate([np.repeat(starts, steps, axis=0) + number[:, None] * step, ends])


def _clipped(points, box):
    if box is None or not len(points):
        return points
    inside = (points >= [box.x0 - 1, box.y0 - 1]) & (points <= [box.x1 + 1, box.y1 + 1])
    return points[inside.all(axis=1)]


def _hits(points, box):
    inside = (points > [box.x0, box.y0]) & (points < [box.x1, box.y1])
    return bool(inside.all(axis=1).any())
