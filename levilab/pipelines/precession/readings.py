"""What a table must fulfil to be a sweep of the drive."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from analysis.arrays import Array
from analysis.numbers import digits
from analysis.precession.gates import Gates, Rate, rates_at_point, shared_scatter
from levilab.formats.columns import TableError
from levilab.formats.table import FEWEST, Table, read_table, refuse
from levilab.pipelines.options import InputOptions
from levilab.pipelines.sources import SAME, Readings
from levilab.present.numbers import how_many, pulses_too_many
from levilab.runs.gates import gates_of
from levilab.runs.run import Run
from levilab.texts.note import of_file

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
#: The columns that hold uncertainties, and what of.
_OF_U = {"precession_frequency_u_hz": "precession", "drive_frequency_u_hz": "drive", "spin_frequency_u_hz": "spin"}
_OF = {"precession_frequency_hz": "precession", "drive_frequency_hz": "drive", "spin_frequency_hz": "spin"}


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
    return readings if gates is None else _from_gates(readings, gates, _given_u(run))


def _given_u(run: Run) -> float | None:
    """Return what the configuration says a count scatters by [Hz]."""
    settings = run.record.configuration.get("precession")
    u = settings.get("reading_u_hz") if isinstance(settings, dict) else None
    return float(u) if isinstance(u, int | float) else None


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
        raise TableError(
            table.path, f"holds {how_many(drive.size, 'point')}, at least {FEWEST} are needed: sweep further"
        )
    if drive.size > MOST_POINTS:
        raise TableError(
            table.path,
            f"holds {drive.size} points, up to {MOST_POINTS} are expected: give one mean for each drive frequency",
        )
    for name, what in _OF.items():
        if name in table.columns:
            _check(table, table.column(name), f"the {what} frequency")
    if np.ptp(drive) <= SAME * drive.max():
        raise TableError(
            table.path, f"all {drive.size} points are at a drive frequency of {drive[0]:g} Hz: sweep the drive"
        )
    u = {name: table.column(name) for name in _OF_U if name in table.columns}
    warnings = list(table.warnings)
    if "spin_frequency_u_hz" in u and "spin_frequency_hz" not in table.columns and "precession_frequency_u_hz" not in u:
        u["precession_frequency_u_hz"] = u.pop("spin_frequency_u_hz")
        text = f"{table.path.name}: the column of uncertainties is taken for that of the precession"
        warnings.append(of_file("of the precession", text))
    for name, values in u.items():
        _check_u(table, values, _OF_U[name], precession)
    has_spin = "spin_frequency_hz" in table.columns
    return SweepReadings(
        drive=drive,
        precession=precession,
        u=u.get("precession_frequency_u_hz"),
        u_drive=u.get("drive_frequency_u_hz"),
        spin=table.column("spin_frequency_hz") if has_spin else None,
        u_spin=u.get("spin_frequency_u_hz") if has_spin else None,
        time=table.column("time_s") if "time_s" in table.columns else None,
        warnings=tuple(warnings),
    )


def _check(table: Table, values: Array, what: str) -> None:
    refuse(table, (values < SLOWEST_HZ) | (values > HIGHEST_HZ), lambda i: (
        f"{what} is {values[i]:.9g} Hz, a number above 0 and up to {HIGHEST_HZ:g} is expected: remove the point"
    ))  # fmt: skip


def _check_u(table: Table, values: Array, of: str, size: Array) -> None:
    """Refuse an uncertainty that is not above 0, or below the rounding of the number itself, is a mistake."""
    refuse(table, ~((values > 1e-15 * size) & (values < 1e15 * size)), lambda i: (
        f"the uncertainty of the {of} frequency is {digits(float(values[i]), 3)} Hz: correct it or remove the column"
    ))  # fmt: skip
