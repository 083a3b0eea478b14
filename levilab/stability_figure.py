"""A map of survival → its figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from levilab.figures import STYLE

if TYPE_CHECKING:
    from levilab.stability_map import Map

BLUE, GREY, RED = "#0072B2", "#E6E6E6", "#D55E00"


def map_figure(found: Map) -> Figure:
    """Survivors over spin and mass, with the edges of the linear window for each mass."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8, 5))
        axes = figure.add_axes((0.09, 0.11, 0.87, 0.74))
        axes.pcolormesh(
            found.spins, 1000 * found.masses, found.survived, cmap=ListedColormap([GREY, BLUE]), vmin=0, vmax=1,
            shading="nearest", rasterized=True,
        )  # fmt: skip
        for edge in (found.slowest, found.fastest):
            axes.plot(edge, 1000 * found.masses, color=RED, linewidth=1.5)
        axes.set(
            xlabel="spin at the start  [Hz]",
            ylabel="mass  [g]",
            xlim=(found.spins[0], found.spins[-1]),
            ylim=(1000 * found.masses[0], 1000 * found.masses[-1]),
        )
        count = int(np.count_nonzero(found.survived))
        figure.text(
            0.09, 0.945, f"{found.scene.name or 'the scene'}: blue survives {found.duration:g} s "
            f"({count} of {found.survived.size} tops)", fontsize=11,
        )  # fmt: skip
        figure.text(0.09, 0.89, "red: the window of spins for small motions", fontsize=9, color=RED)
    return figure
