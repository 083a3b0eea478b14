"""A map → its figure: what was found, the windows that theory gives, the thesis's limits, and what all of it means.

Blue is up and grey is lost, paler where a point was filled in; lines over the map have a white rim, and differ in their
dashes as well as in colour.
"""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from levilab.errors import UsageError
from levilab.present.style import STYLE
from levilab.simulator.equilibrium import stability_of
from levilab.stability.thesis import HIGHEST_HZ, MEASURED_HZ, MEASURED_U_HZ, SIMULATED_HZ, is_thesis_device
from levilab.sweeps.observables import OBSERVABLES
from levilab.sweeps.quantities import quantity_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from levilab.simulator.scene import Scene
    from levilab.sweeps.plan import Axis, Plan
    from levilab.sweeps.store import Map

    Array = NDArray[np.float64]

SPIN, MASS, HEIGHT, DRIVE = "start.spin_hz", "top.mass_kg", "start.position_m.2", "drive.frequency_hz"
ORANGE, PURPLE = "#D55E00", "#7A1F5C"
#: Numbers, from few to many; blue stays for the tops that are up.
NUMBERS = "YlOrBr_r"
#: Columns whose values spread over decades.
LOGARITHMIC = {"energy_error", "position_error_m"}
#: Columns in which NaN says that the top is still up; in the others there is no value.
NAN_IS_UP = {"lifetime_s", "fall_spin_hz"}
#: The most small multiples, how many beside each other, and the most cells along a side that a picture can show.
MOST_PANELS, PANELS_IN_A_ROW, MOST_CELLS = 12, 4, 1600
#: A window that changes along an axis is found for so many of its values.
CURVE_POINTS = 61
RIM = [withStroke(linewidth=3.5, foreground="white")]


@dataclass(frozen=True)
class _Kind:
    """A kind of cell: its colour, and what it means."""

    colour: str
    meaning: str


UP, UP_FILLED, LOST, LOST_FILLED, MISSING, NONE, SLIPS = range(7)
KINDS = {
    UP: _Kind("#0072B2", "still up"),
    UP_FILLED: _Kind("#85B9DC", "the same, filled in"),
    LOST: _Kind("#B8B8B8", "lost before"),
    LOST_FILLED: _Kind("#E4E4E4", "the same, filled in"),
    MISSING: _Kind("#FFFFFF", "not computed"),
    NONE: _Kind("#F7F7F7", "no value"),
    SLIPS: _Kind("#E8C07D", "up, but not locked"),
}


@dataclass(frozen=True)
class _View:
    """What lies along the axes of the panels.

    Attributes:
        x, y: axes of each panel.
        panels: axis whose values are the panels; None: there is one panel.
        order: dimensions of the map in the order panels, y, x.
        chosen: indices of the panels' values.
    """

    x: Axis
    y: Axis
    panels: Axis | None
    order: tuple[int, ...]
    chosen: tuple[int, ...] = (0,)


def map_figure(found: Map, column: str = "survived", notes: Sequence[str] = ()) -> Figure:
    """Draw a column of a map of two or three axes.

    Args:
        found: the map; nothing is simulated.
        column: of `OBSERVABLES`.
        notes: sentences for below the map, as `adaptive.in_words` has them.

    Raises:
        UsageError: the map has no such column, or is no map: one axis, or the rows of a table.
    """
    if column not in found.values:
        raise UsageError("observe", f"the map has {', '.join(found.values)}", value=column)
    view = _view_of(found.plan)
    with mpl.rc_context(STYLE):
        figure, panels = _panels(view)
        kinds, numbers = _cells(found, column)
        norm = _norm(numbers, column)
        for axes, index in zip(panels, view.chosen, strict=True):
            _draw_cells(axes, view, _slice(kinds, view, index), _slice(numbers, view, index), norm)
            artists = _draw_limits(axes, found.plan, view)
        _label(panels, view)
        if norm is not None:
            _draw_colour_bar(figure, panels, norm, column)
        handles = [*_kind_patches(kinds, column, found.plan), *artists]
        _head(figure, found, column, kinds)
        figure.legend(
            handles=handles, loc="upper left", bbox_to_anchor=(0.075, 1 - _inches(figure, 0.42)), ncols=2, fontsize=8
        )
        _caption(figure, found, view, column, artists, notes)
    return figure


def has_figure(plan: Plan) -> bool:
    """Whether a plan has a figure: two or three axes that form a grid."""
    return not plan.is_table and 2 <= len(plan.axes) <= 3 and min(plan.shape) > 1


# --- what goes where ---


def _view_of(plan: Plan) -> _View:
    if not has_figure(plan):
        raise UsageError("sweep", "a figure needs two or three axes, each with two values or more")
    axes = list(plan.axes)
    x = next((axis for key in (SPIN, DRIVE) for axis in axes if axis.key == key), axes[0])
    rest = [axis for axis in axes if axis is not x]
    y = max(rest, key=lambda axis: len(axis.values))
    panels = next((axis for axis in rest if axis is not y), None)
    order = tuple(axes.index(axis) for axis in (panels, y, x) if axis is not None)
    if panels is None:
        return _View(x, y, None, order)
    count = len(panels.values)
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_PANELS)).round().astype(int))
    return _View(x, y, panels, order, tuple(chosen.tolist()))


def _panels(view: _View) -> tuple[Figure, list[Axes]]:
    """Return the figure with its panels, placed by hand: head and caption keep their inches."""
    count = len(view.chosen)
    columns = min(count, PANELS_IN_A_ROW)
    rows = -(-count // columns)
    width, panel = (8.0, 4.2) if count == 1 else (10.0, 2.1)
    head, caption, gap = 1.65, 1.75, 0.5
    height = head + caption + rows * panel + (rows - 1) * gap
    figure = Figure(figsize=(width, height))
    left, right, between = 0.075, 0.965, 0.03
    wide = (right - left - (columns - 1) * between) / columns
    panels = []
    for k in range(count):
        row, place = divmod(k, columns)
        bottom = (caption + (rows - 1 - row) * (panel + gap)) / height
        panels.append(figure.add_axes((left + place * (wide + between), bottom, wide, panel / height)))
    return figure, panels


def _inches(figure: Figure, inches: float) -> float:
    """Return a height in inches as a share of the figure's."""
    return float(inches / figure.get_figheight())


def _slice(values: NDArray[Any], view: _View, index: int) -> NDArray[Any]:
    """Return the values of a panel, shape (y, x), thinned to what a picture can show."""
    arranged = values.transpose(view.order)
    panel = arranged if view.panels is None else arranged[index]
    down, across = (-(-n // MOST_CELLS) for n in panel.shape)
    return np.asarray(panel[::down, ::across])


def _edges(axis: Axis) -> Array:
    """Return the edges of the cells of an axis, as it is shown; between values in the middle, as its scale has it."""
    values = axis.values[:: -(-len(axis.values) // MOST_CELLS)] * quantity_of(axis.key).factor
    places = np.log(values) if axis.scale == "log" else values
    middle = (places[1:] + places[:-1]) / 2
    edges = np.concatenate([[1.5 * places[0] - places[1] / 2], middle, [1.5 * places[-1] - places[-2] / 2]])
    return np.asarray(np.exp(edges) if axis.scale == "log" else edges)


# --- cells ---


def _cells(found: Map, column: str) -> tuple[NDArray[np.int8], Array]:
    """Return the kind of each cell, and its number where it has one, NaN elsewhere."""
    values = found.values[column]
    known = found.computed if found.filled is None else found.computed | found.filled
    filled = np.zeros_like(known) if found.filled is None else found.filled
    kinds = np.full(values.shape, MISSING, dtype=np.int8)
    if values.dtype == np.bool_:
        kinds[known] = np.where(values, UP, LOST)[known]
        if column == "locked" and "survived" in found.values:
            kinds[known & found.values["survived"] & ~values & ~filled] = SLIPS
        kinds[filled & (kinds == UP)] = UP_FILLED
        kinds[filled & (kinds == LOST)] = LOST_FILLED
        return kinds, np.full(values.shape, np.nan)
    numbers = np.where(found.computed, values, np.nan)
    kinds[found.computed] = UP if column in NAN_IS_UP else NONE
    if column in NAN_IS_UP and "survived" in found.values:
        kinds[filled & found.values["survived"]] = UP_FILLED
        kinds[filled & ~found.values["survived"]] = LOST_FILLED
    return kinds, numbers


def _norm(numbers: Array, column: str) -> Normalize | None:
    """Return how numbers become colours; None where there are none."""
    there = numbers[np.isfinite(numbers)] * quantity_of(column).factor
    if not there.size:
        return None
    if column in LOGARITHMIC and (positive := there[there > 0]).size:
        return LogNorm(positive.min(), positive.max())
    low, high = float(there.min()), float(there.max())
    return Normalize(low, high if high > low else low + 1.0)


def _draw_cells(axes: Axes, view: _View, kinds: NDArray[Any], numbers: Array, norm: Normalize | None) -> None:
    x, y = _edges(view.x), _edges(view.y)
    flat: dict[str, Any] = {"shading": "flat", "rasterized": True}
    colours = ListedColormap([KINDS[kind].colour for kind in sorted(KINDS)])
    axes.pcolormesh(x, y, kinds, cmap=colours, vmin=-0.5, vmax=len(KINDS) - 0.5, **flat)
    if norm is not None:
        shown = numbers * norm_factor if (norm_factor := getattr(norm, "factor", 1.0)) != 1.0 else numbers
        axes.pcolormesh(x, y, np.ma.masked_invalid(shown), cmap=NUMBERS, norm=norm, **flat)
    for axis, set_scale in ((view.x, axes.set_xscale), (view.y, axes.set_yscale)):
        if axis.scale == "log":
            set_scale("log")
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    axes.grid(visible=False)
