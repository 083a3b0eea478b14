"""The readings of a run as they are, before any analysis; importing this loads matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from levilab.present.drawing import new_figure, panel
from levilab.present.looks import LOOKS
from levilab.present.style import without_formula
from levilab.present.units import shown_unit, split, u_of

if TYPE_CHECKING:
    import pandas as pd

#: Inches.
_LEFT, _WIDTH, _HEIGHT, _PITCH, _TOP, _BOTTOM = 0.95, 5.9, 1.35, 1.55, 0.5, 0.55
#: Letters of a quantity beside which its unit finds no room.
_LONG = 16
#: What the readings are drawn against: the first of these that they have, else their number.
_AGAINST = ("height_m", "time_s")


def readings_figure(frame: pd.DataFrame, title: str) -> Figure:
    """Draw each channel in a panel of its own, with its standard uncertainties where they are known.

    Args:
        frame: columns as in readings.csv.
        title: of the figure.
    """
    against = next((name for name in _AGAINST if name in frame), None)
    ours = [name for name in map(str, frame.columns) if name not in _AGAINST and "_u_" not in name]
    names = ours or [name for name in map(str, frame.columns) if name != against]
    count = max(len(names), 1)
    with new_figure(_TOP + _PITCH * (count - 1) + _HEIGHT + _BOTTOM, without_formula(title)) as figure:
        panels = [panel(figure, _LEFT, _TOP + _PITCH * k, _WIDTH, _HEIGHT) for k in range(count)]
        x = _in_axis_unit(frame, against) if against else frame.index + 1
        colour = LOOKS["readings"].colour
        for axes, name in zip(panels, names, strict=False):
            u = _uncertainty(frame, name)
            if u is not None:
                axes.errorbar(x, _in_axis_unit(frame, name), yerr=u, fmt="none", color=colour, elinewidth=0.8)
            axes.plot(x, _in_axis_unit(frame, name), ".", color=colour, gid=f"readings-{name}")
            axes.set_ylabel(_axis(name), fontsize=8)
            axes.set_xlim(panels[0].get_xlim())
            axes.tick_params(labelbottom=axes is panels[-1])
        panels[-1].set_xlabel(_axis(against) if against else "reading")
    return figure


def _axis(column: str) -> str:
    r"""Return a column's name for an axis: the quantity's name, its unit in brackets.

    >>> _axis("height_m"), _axis("precession_frequency_hz"), _axis("remark")
    ('height  [cm]', 'precession frequency\n[Hz]', 'remark')
    """
    quantity, unit = split(column)
    if unit is None:
        return column.replace("_", " ")
    return f"{quantity.replace('_', ' ')}{'  ' if len(quantity) < _LONG else chr(10)}[{unit.shown.unit}]"


def _in_axis_unit(frame: pd.DataFrame, name: str) -> pd.Series:
    """Return a column in the unit of its axis."""
    factor = shown_unit(name).factor
    return frame[name] if factor == 1 else frame[name] * factor  # of texts, too


def _uncertainty(frame: pd.DataFrame, name: str) -> pd.Series | None:
    """Return the column of its standard uncertainty, as spin_frequency_u_hz is of spin_frequency_hz."""
    return _in_axis_unit(frame, u_of(name)) if u_of(name) in frame else None
