"""The readings of a run as they are, before any analysis; importing this loads matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.figure import Figure

from levilab.present.style import STYLE

if TYPE_CHECKING:
    import pandas as pd

#: Inches.
_WIDTH, _HEIGHT, _MARGIN = 8.0, 1.9, 0.7
#: What the readings are drawn against: the first of these that they have, else their number.
_AGAINST = ("height_m", "time_s")


def readings_figure(frame: pd.DataFrame, title: str) -> Figure:
    """Each channel in a panel of its own, with its standard uncertainties where they are known.

    Args:
        frame: columns as in readings.csv.
        title: of the figure.
    """
    against = next((name for name in _AGAINST if name in frame), None)
    ours = [name for name in map(str, frame.columns) if name not in _AGAINST and "_u_" not in name]
    names = ours or [name for name in map(str, frame.columns) if name != against]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_WIDTH, _MARGIN + _HEIGHT * max(len(names), 1)), layout="constrained")
        panels = figure.subplots(max(len(names), 1), 1, sharex=True, squeeze=False)[:, 0]
        x = frame[against] if against else frame.index + 1
        for panel, name in zip(panels, names, strict=False):
            u = _uncertainty(frame, name)
            panel.errorbar(x, frame[name], yerr=u, fmt=".", color="#0072B2", elinewidth=1, capsize=0)
            panel.set_ylabel(name)
        panels[-1].set_xlabel(against or "reading")
        figure.suptitle(title, fontsize=10)
    return figure


def _uncertainty(frame: pd.DataFrame, name: str) -> pd.Series | None:
    """The column of its standard uncertainty, as spin_frequency_u_hz is of spin_frequency_hz."""
    quantity, _, unit = name.rpartition("_")
    return frame.get(f"{quantity}_u_{unit}")
