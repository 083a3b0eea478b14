"""What the page draws of each experiment's readings: one row an experiment."""

from dataclasses import dataclass


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
