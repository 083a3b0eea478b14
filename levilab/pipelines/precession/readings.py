"""What a table must fulfil to be a sweep of the drive."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from analysis.arrays import Array
from analysis.precession.gates import Gates, Rate, rates_at_point, shared_scatter
from levilab.formats.columns import TableError
from levilab.formats.table import FEWEST, Table, read_table, refuse
from levilab.formats.titles import companion
from levilab.pipelines.inputs.source import SAME, Readings
from levilab.pipelines.options import InputOptions
from levilab.present.numbers import pulses_too_many
from levilab.runs.gates import gates_of
from levilab.runs.run import Run
from levilab.texts.note import of_file
from levilab.texts.text import Text, how_many

#: Columns that an analysis of sweeps looks at.
QUANTITIES = (
    *("time_s", "drive_frequency_hz", "drive_frequency_u_hz", "precession_frequency_hz"),
    *("precession_frequency_u_hz", "spin_frequency_hz", "spin_frequency_u_hz"),
)
#: Those without which a table is no sweep.
NEEDED = ("drive_frequency_hz", "precession_frequency_hz")
#: Relative: a reading is that of its gates, but for rounding.
_SAME_RATE = 1e-6
#: Beyond these a number is no measurement, and its powers would leave the range of floating point [Hz].
SLOWEST_HZ, HIGHEST_HZ = 1e-9, 1e12
#: No sweep has more points; a recording of all counts has.
MOST_POINTS = 10_000
#: The columns that hold frequencies, with their names, and those that hold their uncertainties.
_OF = {f"{name}_frequency_hz": f"{name} frequency" for name in ("precession", "drive", "spin")}
_OF_U = {companion(name): what for name, what in _OF.items()}


@dataclass(frozen=True, eq=False)
class SweepReadings(Readings):
    """The points of a sweep, each array of shape (n,) [Hz], None where the table has no such column.

    Attributes:
        laser: the gates of each point, which a run holds.
    """

    drive: Array
    precession: Array
    u: Array | None
    u_drive: Array | None
    spin: Array | None
    u_spin: Array | None
    time: Array | None
    warnings: tuple[str, ...]
    laser: tuple[Gates, ...] | None = None

    compared: ClassVar[tuple[str, ...]] = ("drive", "precession")


def read_sweep_file(path: Path, options: InputOptions) -> SweepReadings:
    """Return the sweep in a data file.  Raises DoesNotSuit for another table, DataError for what cannot be used."""
    table = read_table(path, quantities=QUANTITIES, needed=NEEDED, **options.of_tables)
    return sweep_readings(table)


def read_sweep_run(run: Run, _: InputOptions) -> SweepReadings:
    """Return the sweep of a run; where it holds the gates, rates and uncertainties come from all of them."""
    readings = sweep_readings(run.readings())
    if readings.time is None:
        return readings
    gates = gates_of(run, readings.time.tolist(), readings.drive.tolist())
    given_u = run.record.number("precession", "reading_u_hz")
    return readings if gates is None else _from_gates(readings, gates, given_u)


def _from_gates(readings: SweepReadings, gates: Sequence[tuple[Gates, Gates]], given_u: float | None) -> SweepReadings:
    """Return the points with the rates of their gates.  given_u: if the points keep the u that follows from it [Hz]."""
    spins, lasers = zip(*(rates_at_point(spin, laser) for spin, laser in gates), strict=True)
    counted = np.array([rate.value for rate in lasers])
    if not np.allclose(counted, readings.precession, rtol=_SAME_RATE, atol=0):
        text = "the readings are not those of the gates in events.jsonl: the gates are not used"
        return replace(readings, warnings=(*readings.warnings, text))

    def u_of(rates: Sequence[Rate]) -> Array:
        return shared_scatter(rates, readings.drive) * [rate.per_scatter for rate in rates]

    return replace(
        readings,
        precession=counted,
        u=u_of(lasers) if given_u is None else readings.u,
        spin=np.array([rate.value for rate in spins]),
        u_spin=u_of(spins) if given_u is None else readings.u_spin,
        laser=tuple(laser for _, laser in gates),
        warnings=(*readings.warnings, *_about_gates(readings, lasers)),
    )


def _about_gates(readings: SweepReadings, lasers: Sequence[Rate]) -> Iterable[str]:
    """Return a remark on the gates that were left out."""
    for k, (rate, drive) in enumerate(zip(lasers, readings.drive.tolist(), strict=True), 1):
        for gate, pulses in rate.wrong:
            yield f"point {k}, at {drive:.5g} Hz: gate {gate + 1} counted {pulses_too_many(pulses)}, and is left out"
        if rate.missing:
            yield f"point {k}, at {drive:.5g} Hz: {rate.missing} of its gates have no count"


def sweep_readings(table: Table) -> SweepReadings:
    """Return the points of a sweep.

    Args:
        table: with `drive_frequency_hz` and `precession_frequency_hz`; their uncertainties, the spin and the time are
            taken where it has them.

    Raises:
        TableError: a column is missing, there are too few or too many points, or a number cannot be meant; the line of
            the file is named.
    """
    drive, precession = table.column("drive_frequency_hz"), table.column("precession_frequency_hz")
    if drive.size < FEWEST:
        few = "holds {points}, at least {fewest} are needed: sweep further"
        raise TableError(table.path, few, how_many(drive.size, "point"), FEWEST)
    if drive.size > MOST_POINTS:
        many = "holds {n} points, up to {most} are expected: give one mean for each drive frequency"
        raise TableError(table.path, many, drive.size, MOST_POINTS)
    for name, what in _OF.items():
        if name in table.columns:
            _check(table, table.column(name), what)
    if np.ptp(drive) <= SAME * drive.max():
        one = "all {n} points are at a drive frequency of {hz:g} Hz: sweep the drive"
        raise TableError(table.path, one, drive.size, drive[0])
    u = {name: table.column(name) for name in _OF_U if name in table.columns}
    warnings = list(table.warnings)
    if "spin_frequency_u_hz" in u and "spin_frequency_hz" not in table.columns and "precession_frequency_u_hz" not in u:
        u["precession_frequency_u_hz"] = u.pop("spin_frequency_u_hz")
        text = "{name:s}: the column of uncertainties is taken for that of the precession"
        warnings.append(of_file("of the precession", Text(text, table.path.name)))
    for name, values in u.items():
        _check_u(table, values, _OF_U[name], precession)
    spin = table.columns.get("spin_frequency_hz")
    return SweepReadings(
        drive=drive,
        precession=precession,
        u=u.get("precession_frequency_u_hz"),
        u_drive=u.get("drive_frequency_u_hz"),
        spin=spin,
        u_spin=None if spin is None else u.get("spin_frequency_u_hz"),
        time=table.columns.get("time_s"),
        warnings=tuple(warnings),
    )


def _check(table: Table, values: Array, what: str) -> None:
    said = "the {quantity} is {hz:.9g} Hz, a number above 0 and up to {most:g} is expected: remove the point"
    refuse(table, (values < SLOWEST_HZ) | (values > HIGHEST_HZ), said, what, values, HIGHEST_HZ)


def _check_u(table: Table, values: Array, of: str, size: Array) -> None:
    """Refuse an uncertainty that is not above 0, or below the rounding of the number itself, is a mistake."""
    said = "the uncertainty of the {quantity} is {hz:.3g} Hz: correct it or remove the column"
    refuse(table, ~((values > 1e-15 * size) & (values < 1e15 * size)), said, of, values)
