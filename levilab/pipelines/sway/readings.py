"""Places of a top over time, seen from above: of a file, or of a simulated motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from levilab.errors import DataError
from levilab.formats.columns import NoSuchColumn, TableError
from levilab.formats.table import read_run_readings, read_table, refuse
from levilab.formats.understanding import Request, plan_of
from levilab.pipelines.options import SwayOptions
from levilab.pipelines.sources import Readings
from levilab.runs.run import STATES
from levilab.texts.text import Text

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from levilab.formats.table import Table
    from levilab.pipelines.options import InputOptions
    from levilab.runs.run import Run

    Array = NDArray[np.float64]

#: Columns of a table that are looked at, and those without which it is no track.
QUANTITIES = ("time_s", "x_m", "y_m", "height_m", "spin_frequency_hz")
NEEDED = QUANTITIES[:3]
#: Of a magnetometer's record.
_FIELD = ("time_s", "flux_density_x_t", "flux_density_y_t")
#: How the names of a film's track and of its spin end.
_TRACKS, _SPIN = ".tracks.csv", ".spin.csv"
#: Columns of a film from beside; the spin falls by this much at least [Hz]; order of its polynomial; fewest pictures.
_SIDE, _FALLS_HZ, _BENDS, _FEWEST = ("time_s", "height_m", "spin_frequency_hz"), 0.2, 6, 100
#: A top that is farther from the axis has left the field [m]: beyond, the unit is most likely another one.
_FARTHEST_M = 0.5


@dataclass(frozen=True, eq=False)
class SwayReadings(Readings):
    """A track, each array of shape (n,).

    Attributes:
        time: [s].
        x, y: across the axis, seen from above [m].
        height: [m]; None where the table has none, or not for each place.
        spin: [Hz]; None where the table has none.
        warnings: about the file.
    """

    time: Array
    x: Array
    y: Array
    height: Array | None
    spin: Array | None
    warnings: tuple[str, ...]

    compared: ClassVar[tuple[str, ...]] = ("time", "y", "x")


def read_track_file(path: Path, options: InputOptions) -> SwayReadings:
    """Return the track in a data file.  Raises DoesNotSuit for another table, DataError for what cannot be used."""
    try:
        table = read_table(path, quantities=QUANTITIES, needed=NEEDED, **options.of_tables | {"guess": False})
    except NoSuchColumn as missing:
        raise (_field_alone(path) or missing) from None
    readings = _readings(table)
    readings = readings if readings.spin is not None else _with_spin_beside(path, readings)
    return _with_heights(path, readings, options)


def _field_alone(path: Path) -> NoSuchColumn | None:
    """Return the error for a table of a magnetic field; None for any other."""
    try:
        plan_of(path, Request({}, _FIELD, _FIELD, guess=False))
    except TableError:
        return None
    return NoSuchColumn(
        path,
        "holds the magnetic field: it gives the frequencies of the swings, not their size, nor the tilt of the "
        "precession, which the split is corrected by; move the top by a known distance to learn how many µT a "
        "millimetre makes, and write columns x [mm] and y [mm], or film the top",
    )


def _with_spin_beside(path: Path, readings: SwayReadings) -> SwayReadings:
    """Return the track with the spin of the same film, where levilab analyze video wrote it beside the track."""
    beside = path.with_name(f"{path.name.removesuffix(_TRACKS)}{_SPIN}")
    if not (path.name.endswith(_TRACKS) and beside.exists()):
        return readings
    table = read_table(beside, quantities=("time_s", "spin_frequency_hz"), needed=("time_s", "spin_frequency_hz"))
    return _with_spin(readings, table)


def _with_heights(path: Path, readings: SwayReadings, options: InputOptions) -> SwayReadings:
    """Return the part of a track for which a film from beside has the heights; a spin that falls tells both clocks."""
    side = options.side if isinstance(options, SwayOptions) else None
    if side is None:
        return readings
    of_side = read_table(side, quantities=_SIDE, needed=_SIDE)
    time, height, spin = (of_side.column(name) for name in _SIDE)
    if readings.spin is None or not np.ptp(readings.spin) > _FALLS_HZ:
        raise DataError(f"{path}: a spin that falls is expected, by which the clock of {side.name} is compared")
    falls = np.polynomial.Polynomial.fit(readings.time, readings.spin, _BENDS)
    even = np.linspace(readings.time[0], readings.time[-1], readings.time.size)
    met = (spin < falls(even[0])) & (spin > falls(even[-1]))
    if met.sum() < _FEWEST:
        raise DataError(f"{side}: its spins are others than those of {path.name}: films of the same time are expected")
    late = float(np.median(np.interp(-spin[met], -falls(even), even) - time[met]))
    both = (readings.time >= time[0] + late) & (readings.time <= time[-1] + late)
    part = {name: getattr(readings, name)[both] for name in ("time", "x", "y", "spin")}
    note = Text(
        "{side:s} begins at {start:.2f} s of {track:s}, by the spin, and gives its heights",
        side=side.name,
        start=time[0] + late,
        track=path.name,
    )
    height = np.interp(part["time"], time + late, height)
    return replace(readings, **part, height=height, warnings=(*readings.warnings, note))


def _with_spin(readings: SwayReadings, table: Table) -> SwayReadings:
    if not table.column("time_s").size:  # nothing was counted
        return readings
    spin = np.interp(readings.time, table.column("time_s"), table.column("spin_frequency_hz"))
    return replace(readings, spin=spin, warnings=(*readings.warnings, *table.warnings))


def read_motion_run(run: Run, options: InputOptions) -> SwayReadings:
    """Return the track of a film with the counter's spins, or of a simulated motion."""
    readings = _readings(read_run_readings(run.folder / STATES, QUANTITIES))
    readings = readings if readings.spin is not None else _with_spin(readings, run.readings())
    return _with_heights(run.folder, readings, options)


def _readings(table: Table) -> SwayReadings:
    time, x, y = (table.column(name) for name in NEEDED)
    refuse(table, np.hypot(x - np.median(x), y - np.median(y)) > _FARTHEST_M, lambda i: (
        f"the top is {np.hypot(x, y)[i]:.3g} m off, less than {_FARTHEST_M:g} m is expected: if the unit is another "
        "one, say so, as `columns` = x=NAME [mm],y=NAME [mm]"
    ))  # fmt: skip
    height, spin = table.columns.get("height_m"), table.columns.get("spin_frequency_hz")
    if height is not None and not np.isfinite(height).all():
        height = None
    return SwayReadings(time, x, y, height, spin, table.warnings)
