"""Readings with the fitted curve, and residuals, side by side; importing this loads matplotlib."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from levilab.notebook.fit import axes_of
from levilab.present.drawing import SMALL, headline, new_figure, panel, run_look, synthetic_mark
from levilab.present.looks import BLACK
from levilab.present.style import STYLE, WIDE, as_png, for_notebooks, label_of_run
from levilab.present.units import shown_unit, split, u_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes as Axes  # noqa: PLC0414 - for others, who may not name matplotlib

    Curve = Callable[[np.ndarray], np.ndarray]

#: Places [inch]: left edges, width, top, and height of the panels; height of the figure.
_LEFT, _RIGHT, _WIDTH, _TOP, _PANEL, _HEIGHT = 0.66, 4.16, 2.75, 0.42, 1.55, 2.45
#: Points of a curve; pictures per inch, and colours of a small picture: 5 to 12 kB.
_POINTS, _DPI, _COLOURS = 200, 110, 24


def residuals_figure(
    frame: pd.DataFrame, residual: str, title: str, synthetic: Sequence[bool], curves: Mapping[str, Curve | None]
) -> Figure:
    """Draw the readings of each input with its curve, and beside them the residuals.

    Args:
        frame: the readings, with the column input.
        residual: the column of the residuals.
        title: of the figure.
        synthetic: whether each input is synthetic.
        curves: input → its fitted curve, None where there is none.
    """
    with new_figure(_HEIGHT, title, synthetic) as figure:
        left = panel(figure, _LEFT, _TOP, _WIDTH, _PANEL)
        right = panel(figure, _RIGHT, _TOP, _WIDTH, _PANEL, sharex=left)
        for axes, kind in ((left, "fit"), (right, "residuals")):
            draw_fit(axes, kind, frame, residual, curves)
    return figure


def draw_fit(axes: Axes, kind: str, frame: pd.DataFrame, residual: str, curves: Mapping[str, Curve | None]) -> None:
    """Draw one panel: "fit", the readings of each input with its curve, or "residuals"; see `residuals_figure`."""
    x, y = axes_of(frame, residual)
    column = residual if kind == "residuals" else y
    for k, (name, curve) in enumerate(curves.items()):
        own, look = frame[frame["input"] == name], run_look(k, len(curves))
        style: Any = {"linestyle": "none", "marker": ".", "color": look.colour}
        at, readings = (own[one].to_numpy(dtype=float) * shown_unit(one).factor for one in (x, column))
        if kind == "residuals":
            axes.errorbar(at, readings, yerr=_bars(own, y), elinewidth=0.8, **style)
            continue
        axes.plot(at, readings, label=label_of_run(name, k, len(curves), "readings"), **style)
        if curve and len(at):
            fine = np.linspace(own[x].min(), own[x].max(), _POINTS)
            axes.plot(fine * shown_unit(x).factor, curve(fine) * shown_unit(y).factor, color=look.colour, linewidth=1.0)
    if kind == "residuals":
        axes.axhline(0.0, color=BLACK, linewidth=0.7)
    elif len(curves) > 1:
        axes.legend(fontsize=SMALL)
    axes.set(xlabel=_label(x), ylabel=_label(column))


def draw_column(axes: Axes, x: str, y: str, frame: pd.DataFrame, style: str = "-") -> None:
    """Draw a column against another one, in the units of axes, with bars where its u is known.

    Of yes and no there is nothing in between, and no line.
    """
    style = "o" if frame[y].dtype == bool else style
    at, values = (frame[one].to_numpy(dtype=float) * shown_unit(one).factor for one in (x, y))
    axes.errorbar(at, values, yerr=_bars(frame, y), fmt=style, elinewidth=0.8)
    axes.set(xlabel=_label(x), ylabel=_label(y))
    if frame[y].dtype == bool:
        axes.set_yticks([0, 1], ["no", "yes"])


def draw_windows(axes: Axes, frame: pd.DataFrame) -> None:
    """Draw the spins that hold a top at each height where field and weight balance; dashed: it is not stable."""
    for height, stable, low, high in frame.to_numpy().tolist():
        axes.plot([low, high], [100 * height] * 2, "-" if stable else "--", linewidth=3, color=BLACK)
    axes.set(xlabel="spin  [Hz]", ylabel="height  [cm]")


def drawn(
    draw: Callable[[Axes], None],
    ax: Axes | None,
    *,
    title: str | None = None,
    logy: bool = False,
    figsize: tuple[float, float] | None = None,
    synthetic: Sequence[bool] = (True,),
) -> Figure | Axes:
    """Draw one panel into the given axes, which are returned, or into a figure of its own.

    Args:
        draw: the panel.
        ax: a person's axes, whose style stays as it is; None: there are none.
        title: above it.
        logy: whether the ordinate is logarithmic.
        figsize: width and height of its own figure [inch].
        synthetic: whether each input is synthetic, which a figure of its own says.
    """
    with mpl.rc_context({} if ax else STYLE):
        figure = Figure(figsize=(WIDE, _HEIGHT + 0.6))
        axes = ax or panel(figure, _LEFT, _TOP, WIDE - 1.2 * _LEFT, _PANEL + 0.6)
        draw(axes)
        if ax is None:
            headline(figure, title or "", synthetic_mark(synthetic))
        elif title is not None:
            ax.set_title(title)
        if logy:
            axes.set_yscale("log")
    return ax or for_notebooks(figure, figsize)


def _bars(frame: pd.DataFrame, column: str) -> np.ndarray | None:
    """Return the standard uncertainties of a column, in the unit of its axis; None where they are not known."""
    u = u_of(column)
    known = u in frame and bool(frame[u].notna().any())
    return frame[u].to_numpy(dtype=float) * shown_unit(column).factor if known else None


def _label(column: str) -> str:
    quantity, unit = split(column)
    return f"{quantity.replace('_', ' ')}  [{unit.shown.unit}]" if unit else column


def small_png(figure: Figure) -> bytes:
    """Return a figure as a picture of few colours, for a notebook that keeps it in its file."""
    buffer = io.BytesIO()
    picture = Image.open(io.BytesIO(as_png(figure, dpi=_DPI))).convert("RGB")
    picture.quantize(_COLOURS).save(buffer, format="png", optimize=True)
    return buffer.getvalue()
