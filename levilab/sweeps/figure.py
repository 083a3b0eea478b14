"""A map → its figure: cells, the windows of the theory, the thesis's limits, and a text that explains them.

Blue is up and hatched grey is lost, paler where a point was filled in; lines over the map have a white rim, and
differ in their dashes as well as in colour.
"""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.numbers import digits
from analysis.stability import Window
from levilab.errors import UsageError
from levilab.motion.lock import LAST_SHARE
from levilab.motion.summary import changing_energy
from levilab.present.drawing import SMALL, headline
from levilab.present.looks import LOOKS, PURPLE
from levilab.present.style import STYLE, WIDE, without_formula
from levilab.simulator.equilibrium import stability_of, windows_over
from levilab.simulator.scene import Scene
from levilab.stability.thesis import HIGHEST_HZ, MEASURED_HZ, MEASURED_U_HZ, SIMULATED_HZ, is_thesis_device
from levilab.sweeps.plan import Axis, Plan
from levilab.sweeps.quantities import quantity_of, step_in_words
from levilab.sweeps.store import Map
from levilab.texts.text import Sentences, Text, in_language

SPIN, MASS, HEIGHT, DRIVE = "start.spin_hz", "top.mass_kg", "start.position_m.2", "drive.frequency_hz"
#: Numbers, from few to many, darker to lighter all the way; blue stays for the tops that are up.
NUMBERS = "YlOrBr_r"
#: Columns whose values spread over decades.
LOGARITHMIC = {"energy_error", "position_error_m"}
#: Columns in which NaN says that the top is still up; in the others there is no value.
NAN_IS_UP = {"lifetime_s", "fall_spin_hz"}
#: Columns in which NaN says that the top was lost.
NAN_IS_LOST = {"height_spread_m"}
#: Most small multiples, most of them in a row, and most cells along a side of a picture.
MOST_PANELS, PANELS_IN_A_ROW, MOST_CELLS = 12, 3, 1600
#: Number of values of an axis at which a window that changes along it is computed.
CURVE_POINTS = 61
_HATCH = "#9A9A9A"
RIM = [withStroke(linewidth=3.2, foreground="white")]
DASHED: Any = {"color": "black", "linewidth": 1, "linestyle": "dashed"}
#: Where panels begin and end, as shares of the width: a colour bar fits beside them.
LEFT, RIGHT = 0.095, 0.845


@dataclass(frozen=True)
class _Kind:
    """A kind of cell: its colour, what it means, and its hatch, for print without colours."""

    colour: str
    meaning: str
    hatch: str = ""


UP, UP_FILLED, LOST, LOST_FILLED, MISSING, NONE, SLIPS = range(7)
KINDS = {
    UP: _Kind(LOOKS["up"].colour, "still up"),
    UP_FILLED: _Kind("#6AA5CF", "filled in: still up"),
    LOST: _Kind(LOOKS["lost"].colour, "lost before", LOOKS["lost"].hatch),
    LOST_FILLED: _Kind("#F5F5F5", "filled in: lost before", LOOKS["lost"].hatch),
    MISSING: _Kind("#FFFFFF", "not computed"),
    NONE: _Kind("#F7F7F7", "has no such value"),
    SLIPS: _Kind("#D9A441", "up, but not locked", "..."),
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
    kinds, numbers = _cells(found, column)
    norm = _norm(numbers, column)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDE, 6.0))
        panels = [figure.add_subplot() for _ in view.chosen]
        lines: list[Artist] = []
        for axes, index, theory in zip(panels, view.chosen, _theories(found.plan, view), strict=True):
            _draw_cells(axes, view, _slice(kinds, view, index), _slice(numbers, view, index), norm)
            _hatch(axes, view, np.where(np.isnan(_slice(numbers, view, index)), _slice(kinds, view, index), UP))
            lines = max(_draw_limits(axes, found.plan, view, theory), lines, key=len)  # not every panel has every line
        _label(panels, view)
        handles = [*_kind_patches(kinds, numbers, column, found.plan), *lines]
        sentences = [*_reading_sentences(found.plan, view, column, lines), *notes]
        caption = _caption(found, view, sentences, figure.get_figwidth())
        box = _place(figure, panels, head=0.5 + 0.155 * -(-len(handles) // 2), foot=0.62 + 0.145 * len(caption))
        if norm is not None:
            _draw_colour_bar(figure, box, norm, column)
        top = figure.get_figheight()
        headline(figure, _headline(found, column), "SYNTHETIC")
        figure.legend(
            handles=handles, loc="upper left", bbox_to_anchor=(LEFT - 0.01, 1 - 0.44 / top), ncols=2, fontsize=SMALL,
            labelspacing=0.4,
        )  # fmt: skip
        style: Any = {"fontsize": SMALL, "color": "#404040", "va": "top", "linespacing": 1.35}
        figure.text(LEFT, (0.12 + 0.145 * len(caption)) / top, "\n".join(caption), **style)
    return figure


def has_figure(plan: Plan) -> bool:
    """Return whether a plan has a figure: two or three axes that form a grid."""
    return not plan.is_table and 2 <= len(plan.axes) <= 3 and min(plan.shape) > 1


# --- arrangement ---


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


def _place(figure: Figure, panels: list[Axes], *, head: float, foot: float) -> tuple[float, float, float]:
    """Place the panels by hand between head and foot, which keep their inches, and give the figure its height.

    Returns:
        Where a colour bar goes: its left, bottom and height, as shares of the figure.
    """
    columns = min(len(panels), PANELS_IN_A_ROW)
    rows = -(-len(panels) // columns)
    panel, gap, between = (3.6, 0.0, 0.0) if len(panels) == 1 else (1.5, 0.62, 0.04)
    above = 0.2 if len(panels) == 1 else 0.42
    height = head + above + rows * panel + (rows - 1) * gap + foot
    figure.set_figheight(height)
    wide = (RIGHT - LEFT - (columns - 1) * between) / columns
    for k, axes in enumerate(panels):
        row, place = divmod(k, columns)
        bottom = (foot + (rows - 1 - row) * (panel + gap)) / height
        axes.set_position((LEFT + place * (wide + between), bottom, wide, panel / height))
    return RIGHT + 0.015, foot / height, (rows * panel + (rows - 1) * gap) / height


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
    """Return the kind of each cell, and its number in the shown unit where it has one, NaN elsewhere."""
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
    numbers = np.where(found.computed, values * quantity_of(column).factor, np.nan)
    kinds[found.computed] = UP if column in NAN_IS_UP else LOST if column in NAN_IS_LOST else NONE
    if column in NAN_IS_UP and "survived" in found.values:
        kinds[filled & found.values["survived"]] = UP_FILLED
        kinds[filled & ~found.values["survived"]] = LOST_FILLED
    return kinds, numbers


def _norm(numbers: Array, column: str) -> Normalize | None:
    """Return how numbers become colours; None where there are none."""
    there = numbers[np.isfinite(numbers)]
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
        shown = np.clip(numbers, norm.vmin, norm.vmax)  # a logarithm has no place for an error of zero
        axes.pcolormesh(x, y, np.ma.masked_invalid(shown), cmap=NUMBERS, norm=norm, **flat)
    for axis, set_scale in ((view.x, axes.set_xscale), (view.y, axes.set_yscale)):
        if axis.scale == "log":
            set_scale("log")
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    axes.grid(visible=False)


def _hatch(axes: Axes, view: _View, kinds: NDArray[Any]) -> None:
    """Hatch the cells whose kind has a hatch, neighbours of a row as one piece."""
    x, y = _edges(view.x), _edges(view.y)
    for kind in (kind for kind, one in KINDS.items() if one.hatch and np.any(kinds == kind)):
        pieces = []
        for row, bottom, top in zip(kinds == kind, y[:-1], y[1:], strict=True):
            ends = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]])))
            pieces += [[(x[a], bottom), (x[b], bottom), (x[b], top), (x[a], top)] for a, b in ends.reshape(-1, 2)]
        axes.add_collection(
            PolyCollection(pieces, facecolor="none", edgecolor=_HATCH, hatch=KINDS[kind].hatch, linewidth=0),
            autolim=False,
        )


# --- lines over the cells ---


@dataclass(frozen=True)
class _Theory:
    """What theory says of the top of a panel.

    Attributes:
        places: along y, as they are shown.
        low, high: the linear window [Hz] there, NaN where none is.
        lifted: heights and masses at which a fast top floats.
    """

    places: Array
    low: Array
    high: Array
    lifted: tuple[Window, ...]


def _theories(plan: Plan, view: _View) -> list[_Theory | None]:
    """Return the theory of each panel, computed once where the panels' axis does not change it; None for none."""
    if view.x.key != SPIN or view.x.scale == "log":
        return [None] * len(view.chosen)
    if view.panels is None or not _changes_the_window(view.panels):
        return [_theory_of(plan.scene, view.y)] * len(view.chosen)
    scenes = (plan.scene.changed({view.panels.key: float(view.panels.values[k])}) for k in view.chosen)
    return [_theory_of(scene, view.y) for scene in scenes]


def _changes_the_window(axis: Axis) -> bool:
    """Return whether the window is another along an axis; how the top starts does not change it."""
    return axis.key.startswith(("top.", "base.", "gravity"))


def _theory_of(scene: Scene, axis: Axis) -> _Theory | None:
    """Return what theory says at some values of an axis; None without weight, where it says nothing."""
    if scene.gravity_m_s2 == 0 or axis.key.startswith("gravity"):
        return None
    values = axis.values[np.unique(np.linspace(0, len(axis.values) - 1, CURVE_POINTS).round().astype(int))]
    if axis.key == MASS:
        found = windows_over(scene, values)
        return _Theory(values * quantity_of(axis.key).factor, found.slowest, found.fastest, found.adiabatic)
    if _changes_the_window(axis):
        windows = [_window(scene.changed({axis.key: float(value), "start.place": "given"})) for value in values]
    else:
        values = values[[0, -1]]
        windows = [_window(scene)] * 2
    low, high = np.array(windows).T
    return _Theory(values * quantity_of(axis.key).factor, low, high, stability_of(scene).lifted)


def _window(scene: Scene) -> tuple[float, float]:
    floating = stability_of(scene).floating
    return floating.spins[0] if floating and floating.spins else (math.nan, math.nan)


def _draw_limits(axes: Axes, plan: Plan, view: _View, theory: _Theory | None) -> list[Artist]:
    """Draw what theory and the thesis say of the spin at the start, and return what the legend needs."""
    if view.x.key == DRIVE:
        return _draw_spin_at_the_start(axes, plan.scene)
    if theory is None:
        return []
    return [*_draw_window(axes, theory), *_draw_adiabatic(axes, theory, view), *_draw_thesis(axes, plan)]


def _draw_spin_at_the_start(axes: Axes, scene: Scene) -> list[Artist]:
    spin = abs(scene.start.spin_hz)
    low, high = axes.get_xlim()
    if not low < spin < high:
        return []
    _draw_rim(axes, x=spin)
    return [axes.axvline(spin, label=Text("spin at the start, {spin:g} Hz", spin=spin), **DASHED)]


def _draw_window(axes: Axes, theory: _Theory) -> list[Artist]:
    """Draw the slowest and the fastest spin of small motions, of either sense."""
    if np.all(np.isnan(theory.low)):
        return []
    style: Any = {**LOOKS["theory"].as_line, "linewidth": 1.6, "path_effects": RIM, "scalex": False, "scaley": False}
    for edge in (theory.low, theory.high, -theory.low, -theory.high):
        axes.plot(edge, theory.places, **style)
    return [
        Line2D(
            [],
            [],
            linewidth=1.6,
            **LOOKS["theory"].as_line,
            label="slowest and fastest spin for small motions (linear)",
        )
    ]


def _draw_adiabatic(axes: Axes, theory: _Theory, view: _View) -> list[Artist]:
    """Draw where the masses, or the heights, end at which a fast top floats."""
    if view.y.key == MASS:
        regions = [(window.light, window.heavy) for window in theory.lifted]
        label = "masses that float (adiabatic): {said} {unit}"
    elif view.y.key == HEIGHT:
        regions = [(window.low, window.high) for window in theory.lifted]
        label = "heights that are stable (adiabatic): {said} {unit}"
    else:
        return []
    quantity, (low, high) = quantity_of(view.y.key), axes.get_ylim()
    regions = [(a * quantity.factor, b * quantity.factor) for a, b in regions]
    shown = [(a, b) for a, b in regions if low < a < high or low < b < high]
    for place in [place for region in shown for place in region if low < place < high]:
        _draw_rim(axes, y=place)
        axes.axhline(place, **DASHED)
    said = tuple(Text("{a:.2f} to {b:.2f}", a=a, b=b) for a, b in shown)
    return [Line2D([], [], **DASHED, label=Text(label, said=said, unit=quantity.unit))] if shown else []


def _draw_rim(axes: Axes, *, x: float | None = None, y: float | None = None) -> None:
    """Draw a white line below one with dashes, so that it can be seen on all cells."""
    style: Any = {"color": "white", "linewidth": 2.6}
    if x is not None:
        axes.axvline(x, **style)
    if y is not None:
        axes.axhline(y, **style)


def _draw_thesis(axes: Axes, plan: Plan) -> list[Artist]:
    """Mark the limits of the thesis where they are of this device: measured ones as lines, simulated ones above."""
    if not is_thesis_device(plan.scene):
        return []
    low, high = axes.get_xlim()
    artists: list[Artist] = []
    for spin, dashes, label in (
        (MEASURED_HZ, "dashdot", "thesis, measured: lower limit {spin} ± {u} Hz"),
        (HIGHEST_HZ, "dotted", "thesis, measured: highest locked spin, about {spin:g} Hz"),
    ):
        if low < spin < high:
            _draw_rim(axes, x=spin)
            said = Text(label, spin=spin, u=MEASURED_U_HZ)
            artists.append(axes.axvline(spin, color=PURPLE, linewidth=1.3, linestyle=dashes, label=said))
    simulated = [spin for pair in SIMULATED_HZ.values() for spin in pair if low < spin < high]
    if simulated:
        style: Any = {"color": PURPLE, "marker": "v", "markersize": 5, "linestyle": "none"}
        axes.plot(
            simulated, np.full(len(simulated), 1.02), transform=axes.get_xaxis_transform(), clip_on=False, **style
        )
        said = Text("thesis, simulated: limits of {names:s}", names=", ".join(SIMULATED_HZ))
        artists.append(Line2D([], [], **style, label=said))
    return artists


# --- words ---


def _label(panels: list[Axes], view: _View) -> None:
    across = min(len(panels), PANELS_IN_A_ROW)
    for k, axes in enumerate(panels):
        if k + across >= len(panels):
            axes.set_xlabel(quantity_of(view.x.key).label)
        else:
            axes.tick_params(labelbottom=False)
        if k % across == 0:
            axes.set_ylabel(quantity_of(view.y.key).label)
        else:
            axes.tick_params(labelleft=False)
        if view.panels is not None:
            quantity = quantity_of(view.panels.key)
            text = f"{quantity.name} {quantity.text(view.panels.values[view.chosen[k]])}"
            axes.set_title(text, loc="left", fontsize=SMALL, pad=8)
            axes.tick_params(labelsize=SMALL)
            if view.x.scale != "log":
                axes.locator_params(axis="x", nbins=4)


def _draw_colour_bar(figure: Figure, box: tuple[float, float, float], norm: Normalize, column: str) -> None:
    left, bottom, height = box
    bar = figure.colorbar(mpl.cm.ScalarMappable(norm, NUMBERS), cax=figure.add_axes((left, bottom, 0.015, height)))
    bar.set_label(quantity_of(column).label)
    bar.outline.set_visible(False)


def _kind_patches(kinds: NDArray[Any], numbers: Array, column: str, plan: Plan) -> list[Artist]:
    meanings = {kind: one.meaning for kind, one in KINDS.items()}
    meanings[UP] = Text("still up after {seconds:g} s", seconds=plan.duration_s)
    if column == "locked":
        meanings |= {UP: "locked to the drive", LOST: "not locked"}
        meanings |= {UP_FILLED: "filled in: locked", LOST_FILLED: "filled in: not locked"}
        if np.any(kinds == SLIPS):
            meanings[LOST] = "lost"
    drawn = [kind for kind in KINDS if np.any((kinds == kind) & np.isnan(numbers))]
    return [
        Patch(
            facecolor=KINDS[kind].colour, edgecolor=_HATCH, linewidth=0.5, hatch=KINDS[kind].hatch, label=meanings[kind]
        )
        for kind in drawn
    ]


def _headline(found: Map, column: str) -> str:
    name = without_formula(found.plan.scene.name or "scene", 50)
    said = {
        "survived": "{scene:s}: {n} of {size} tops are still up after {seconds:g} s",
        "locked": "{scene:s}: {n} of {size} tops are locked to the drive after {seconds:g} s",
    }.get(column, "{scene:s}: {quantity}, of {size} tops in {seconds:g} s")
    n, called = np.count_nonzero(found.values[column]), quantity_of(column).name
    size, seconds = found.computed.size, found.plan.duration_s
    return Text(said, scene=name, n=n, quantity=called, size=size, seconds=seconds)


def _caption(found: Map, view: _View, sentences: Sequence[str], width: float) -> list[str]:
    wide, high = (step_in_words(one.key, one.values, logarithmic=one.scale == "log") for one in (view.x, view.y))
    cell = Text(
        "Each cell is one top, simulated for {seconds:g} s, and spans {wide} × {high}: a limit is known no better.",
        seconds=found.plan.duration_s, wide=wide, high=high,
    )  # fmt: skip
    said = [cell, *sentences]
    if view.panels is not None and len(view.chosen) < (values := len(view.panels.values)):
        said.append(Text("{n} of {all} values of the third axis are shown.", n=len(view.chosen), all=values))
    if found.filled is None and (left := np.count_nonzero(~found.computed)):
        said.append(Text("{left} of {all} points are not computed yet.", left=left, all=found.computed.size))
    text = in_language(Sentences(*said)).replace(" %", "\N{NO-BREAK SPACE}%")
    return textwrap.wrap(text, round(15.6 * width))


def _reading_sentences(plan: Plan, view: _View, column: str, lines: Sequence[Artist]) -> list[str]:
    if column == "locked":
        slowest = 1 / (LAST_SHARE * plan.duration_s)
        return [
            Text(
                "Locked: the top is up, and its body slipped by no turn behind the drive in the last half of the time; "
                "a slip slower than {slowest:n} Hz would not show.",
                slowest=digits(slowest),
            )
        ]
    if view.x.key != SPIN or not lines:
        return []
    said = (
        "Between the orange lines small motions stay small. A top that is lost there started too far from its place "
        "for its spin; one that is up outside would take longer to be lost, or swings on a wider path."
    )
    left_out = changing_energy(plan.scene)
    return [said, *([Text("The lines leave out effects of the scene: {names}.", names=left_out)] if left_out else [])]
