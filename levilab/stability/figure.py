"""A map of survival → its figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from levilab.present.style import STYLE

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from levilab.stability.map import Map

BLUE, GREY, ORANGE = "#0072B2", "#E6E6E6", "#D55E00"


def map_figure(found: Map) -> Figure:
    """Survivors over spin and mass, the edges of the linear window for each mass, and the masses that float."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8, 5.6))
        axes = figure.add_axes((0.09, 0.1, 0.87, 0.68))
        axes.pcolormesh(
            found.spins, 1000 * found.masses, found.survived, cmap=ListedColormap([GREY, BLUE]), vmin=0, vmax=1,
            shading="nearest", rasterized=True,
        )  # fmt: skip
        handles: list[Artist] = [
            Patch(color=BLUE, label=f"still up after {found.duration:g} s"),
            Patch(color=GREY, label="lost before"),
        ]
        handles += [*_draw_window(axes, found), *_draw_floating(axes, found)]
        axes.set(
            xlabel="spin at the start  [Hz]",
            ylabel="mass  [g]",
            xlim=(found.spins[0], found.spins[-1]),
            ylim=(1000 * found.masses[0], 1000 * found.masses[-1]),
        )
        count = int(np.count_nonzero(found.survived))
        name = (found.scene.name or "the scene").replace("$", r"\$")[:50]
        figure.text(
            0.09, 0.945, f"{name}: {count} of {found.survived.size} tops are still up after {found.duration:g} s",
            fontsize=11,
        )  # fmt: skip
        figure.text(0.09, 0.912, "\n".join(found.notes), fontsize=8, color="dimgrey")
        figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.08, 0.78), ncols=2, fontsize=8)
    return figure


def _draw_window(axes: Axes, found: Map) -> list[Artist]:
    """The slowest and the fastest spin that theory allows, of either sense."""
    label = "slowest and fastest spin for small motions (theory)"
    lines: list[Artist] = []
    for edge in (found.slowest, found.fastest, -found.slowest, -found.fastest):
        lines += axes.plot(edge, 1000 * found.masses, color=ORANGE, linewidth=1.5, label=label)
    return lines[:1]


def _draw_floating(axes: Axes, found: Map) -> list[Artist]:
    """Where the masses end that have an equilibrium, as far as the map shows them."""
    shown = [mass for region in found.floating for mass in region if found.masses[0] <= mass <= found.masses[-1]]
    label = f"no stable equilibrium beyond {' and '.join(f'{1000 * mass:.2f}' for mass in shown)} g: theory ends there"
    style: Any = {"color": "black", "linewidth": 1, "linestyle": "dashed"}
    lines: list[Artist] = [axes.axhline(1000 * mass, label=label, **style) for mass in shown]
    return lines[:1]
