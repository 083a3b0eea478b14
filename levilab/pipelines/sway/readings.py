"""Places of a top over time, seen from above: of a file, of a simulated motion, or of the field above the top."""

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from analysis.arrays import Array
from analysis.sway import Sensor, image, slow_part, without_image
from levilab.errors import DataError
from levilab.formats.columns import NoSuchColumn, TableError
from levilab.formats.device import Device
from levilab.formats.table import Table, read_run_readings, read_table, refuse
from levilab.formats.understanding import Request, plan_of
from levilab.pipelines.field.device import THESIS
from levilab.pipelines.inputs.source import Readings
from levilab.pipelines.options import InputOptions, SwayOptions
from levilab.pipelines.spin.analysis import DISTANCE_U_M
from levilab.pipelines.spin.magnetometer import FieldRecord
from levilab.pipelines.spindown.readings import field_readings
from levilab.runs.run import STATES, Run
from levilab.texts.text import Text

#: Columns of a table that are looked at, and those without which it is no track.
QUANTITIES = ("time_s", "x_m", "y_m", "height_m", "spin_frequency_hz")
NEEDED = QUANTITIES[:3]
#: Of a magnetometer's record; the first three are needed.
_FIELD = ("time_s", "flux_density_x_t", "flux_density_y_t", "flux_density_z_t", "spin_frequency_hz")
#: Relative u of the thesis's moment, for another top: those that float on a base differ by less.  Share of the image
#: that a phone's calibration does not make.
_MOMENT_U, _UNLIKE = 0.1, 0.2
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
        sensor: what saw the top's field, from which the places are; None: they were seen.
    """

    time: Array
    x: Array
    y: Array
    height: Array | None
    spin: Array | None
    warnings: tuple[str, ...]
    sensor: Sensor | None = None

    compared: ClassVar[tuple[str, ...]] = ("time", "y", "x")


def read_track_file(path: Path, options: InputOptions) -> SwayReadings:
    """Return the track in a data file.  Raises DoesNotSuit for another table, DataError for what cannot be used."""
    try:
        table = read_table(path, quantities=QUANTITIES, needed=NEEDED, **options.of_tables | {"guess": False})
    except NoSuchColumn as missing:
        if (of_field := _of_field(path, options)) is not None:
            return of_field
        raise missing from None
    readings = _readings(table)
    readings = readings if readings.spin is not None else _with_spin_beside(path, readings)
    return _with_heights(path, readings, options)


def _of_field(path: Path, options: InputOptions) -> SwayReadings | None:
    """Return the track in a record of the top's field; None for any other table.

    Three components are those of a phone above the top; two are those of two vertical probes beside it.  Raises
    NoSuchColumn: the distance is not known.
    """
    try:
        plan_of(path, Request(options.columns or {}, _FIELD, _FIELD[:3], guess=False))
    except TableError:
        return None
    far = options.sensor_m if isinstance(options, SwayOptions) else None
    if far is None:
        raise NoSuchColumn(
            path,
            "holds the magnetic field: the option `sensor`, the distance of the top from the phone above it, or from "
            "two vertical probes beside it, is expected; a record from another place has not the places of the top",
        )
    table = read_table(path, quantities=_FIELD, needed=_FIELD[:3], **options.of_tables | {"guess": False})
    time, x, y = (table.column(name) for name in _FIELD[:3])
    if time.size < _FEWEST or np.any(np.diff(time) <= 0):
        raise DataError("{path:s}: {n} samples or more, at times that increase, are expected", path, _FEWEST)
    z, spin = (table.columns.get(name) for name in _FIELD[3:])
    device = (options.device if isinstance(options, SwayOptions) else None) or Device()
    moment, u = THESIS["moment"][0], _MOMENT_U
    if device.top.moment_a_m2 is not None:
        moment, u = device.top.moment_a_m2, device.top.moment_u_a_m2 / device.top.moment_a_m2
    sensor = Sensor(far, DISTANCE_U_M, moment, u, z is not None, device.gravity_m_s2)
    if spin is None and z is not None and getattr(options, "spin_hz", None) is None:
        record = FieldRecord(time, np.stack([x, y, z], axis=1), ("x", "y", "z"), ())
        with suppress(DataError):  # too short, or without the line of the spin: then the spin is asked for
            found = field_readings(path, record, options)
            spin = np.interp(time, found.time, found.frequency)
    even, places = slow_part(time, np.asarray(x + 1j * y) / sensor.gain)
    share = image(even, places)
    places = without_image(places, share)
    height = None if z is None else slow_part(time, z)[1].real / sensor.gain
    spin = None if spin is None else np.interp(even, time, spin)
    notes = []
    if abs(share) > _UNLIKE:
        text = (
            "the gains of x and y, or the angle between them, are {share:.0f} % off, which is taken away: is the "
            "magnetometer where it should be?"
        )
        notes.append(Text(text, share=100 * abs(share)))
    if z is None:
        text = (
            "probes beside the top do not show the sense of the spin: the one in which the split is positive is taken"
        )
        notes.append(Text(text))
    return SwayReadings(even, places.real, places.imag, height, spin, (*table.warnings, *notes), sensor)


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
        said = "{path:s}: a spin that falls is expected, by which the clock of {side:s} is compared"
        raise DataError(said, path, side.name)
    falls = np.polynomial.Polynomial.fit(readings.time, readings.spin, _BENDS)
    even = np.linspace(readings.time[0], readings.time[-1], readings.time.size)
    met = (spin < falls(even[0])) & (spin > falls(even[-1]))
    if met.sum() < _FEWEST:
        said = "{side:s}: its spins are others than those of {path:s}: films of the same time are expected"
        raise DataError(said, side, path.name)
    late = float(np.median(np.interp(-spin[met], -falls(even), even) - time[met]))
    both = (readings.time >= time[0] + late) & (readings.time <= time[-1] + late)
    part = {name: getattr(readings, name)[both] for name in ("time", "x", "y", "spin")}
    note = Text(
        "{side:s} begins at {start:.2f} s of {track:s}, by the spin, and gives its heights",
        side=side.name, start=time[0] + late, track=path.name,
    )  # fmt: skip
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
    if not time.size:
        raise TableError(table.path, "holds no place of a top: it was not seen, or had fallen")
    said = (
        "the top is {m:.3g} m off, less than {most:g} m is expected: if the unit is another one, say so, as "
        "`columns` = x=NAME [mm],y=NAME [mm]"
    )
    off = np.hypot(x - np.median(x), y - np.median(y))
    refuse(table, off > _FARTHEST_M, said, off, _FARTHEST_M)
    height, spin = table.columns.get("height_m"), table.columns.get("spin_frequency_hz")
    if height is not None and not np.isfinite(height).all():
        height = None
    return SwayReadings(time, x, y, height, spin, table.warnings)
