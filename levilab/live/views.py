"""What the page draws of each experiment's readings: one row an experiment."""

from dataclasses import dataclass

from levilab.present.units import split


@dataclass(frozen=True)
class View:
    """Two columns of readings.csv, one against the other.

    Attributes:
        x, y: names of the columns.
        x_label, y_label: names of the quantities.
    """

    x: str
    y: str
    x_label: str = "time"
    y_label: str = "spin"


VIEWS = {
    "spin": View("time_s", "spin_frequency_hz"),
    "hold": View("time_s", "spin_frequency_hz"),
    "sway": View("time_s", "spin_frequency_hz"),
    "limit": View("time_s", "spin_frequency_hz", y_label="limit of the spin"),
    "precession": View("drive_frequency_hz", "precession_frequency_hz", "drive", "precession"),
    "field": View("height_m", "flux_density_t", "height", "flux density"),
    "trace": View("time_s", "tape_frequency_hz", y_label="frequency of the tape"),
}


def view_of(experiment: str, columns: tuple[str, ...]) -> View | None:
    """Return the row of an experiment if its columns are there, else a row of the first two columns."""
    view = VIEWS.get(experiment)
    if view and view.x in columns and view.y in columns:
        return view
    values = [name for name in columns[1:] if "_u_" not in name]
    return View(columns[0], values[0], columns[0], values[0]) if values else None


def u_of(column: str) -> str:
    """Return the name of the column with a column's standard uncertainty.

    >>> u_of("spin_frequency_hz")
    'spin_frequency_u_hz'
    """
    quantity, unit = split(column)
    return f"{quantity}_u_{unit.ending if unit else ''}"


def unit_of(column: str) -> tuple[str, float]:
    """Return the unit in which a column is shown, and how many of it are one of the column's.

    >>> [tuple(unit_of(column)) for column in ("height_m", "spin_frequency_hz", "record")]
    [('cm', 100.0), ('Hz', 1.0), ('', 1.0)]
    """
    _, unit = split(column)
    return unit.shown if unit else ("", 1.0)
