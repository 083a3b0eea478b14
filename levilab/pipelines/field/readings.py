"""What a table of readings must fulfil before it is taken for a scan of a field."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from analysis.arrays import Array
from analysis.field.errors import TooFewHeights
from analysis.field.fit import FEWEST_HEIGHTS, SAME_HEIGHT_M
from analysis.numbers import digits
from levilab.formats.columns import TableError
from levilab.formats.table import Table, read_table, refuse
from levilab.pipelines.inputs.source import Readings
from levilab.pipelines.options import InputOptions
from levilab.runs.run import Run
from levilab.texts.note import of_file
from levilab.texts.text import Text, text_of

#: A stand is no higher [m], and no probe measures more [T]: beyond, the unit is another one.
_HIGHEST_M, _STRONGEST_T = 2.0, 35.0
#: No permanent magnet makes more [T]: beyond, the unit is most likely another one.
_STRONGEST_MAGNET_T = 2.0
#: The column of the uncertainty that is each reading's own, which runs of levilab have.
OWN_U = "flux_density_mean_u_t"


@dataclass(frozen=True, eq=False)
class FieldReadings(Readings):
    """Flux density against height, each array of shape (n,).

    Attributes:
        height: [m].
        flux_density: [T].
        height_u: standard uncertainty, None where not given [m].
        u: likewise [T].
        has_own_u: whether u is each reading's own, without what is common to all.
        warnings: about the file.
    """

    height: Array
    flux_density: Array
    height_u: Array | None
    u: Array | None
    has_own_u: bool
    warnings: tuple[str, ...]

    compared: ClassVar[tuple[str, ...]] = ("height", "flux_density")


def field_readings(table: Table) -> FieldReadings:
    """Return the readings of a scan.  Raises TableError, which names the line where there is one."""
    height, flux_density = table.column("height_m"), table.column("flux_density_t")
    if not len(height):
        raise TableError(table.path, "holds no readings yet: scan at least four heights")
    _must_be_in_range(table, height, _HIGHEST_M, "a height", unit="m", column="z=NAME [mm]")
    _must_be_in_range(table, flux_density, _STRONGEST_T, "a flux density", unit="T", column="b=NAME [mT]")
    heights = 1 + int(np.count_nonzero(np.diff(np.sort(height)) > SAME_HEIGHT_M))
    if heights < FEWEST_HEIGHTS:  # here and not in the fit alone: a scan broken off spoils no search of a folder
        span = {"lowest": float(height.min()), "highest": float(height.max())}
        raise TableError(table.path, text_of(TooFewHeights(seen=heights, needed=FEWEST_HEIGHTS, **span)))
    columns = table.columns
    own = OWN_U in columns
    u_name = OWN_U if own else "flux_density_u_t"
    height_u, u = columns.get("height_u_m"), columns.get(u_name)
    for values, what, lowest in ((height_u, "the uncertainty of a height", 0.0), (u, "an uncertainty", 1e-12)):
        if values is not None:
            refuse(table, values < lowest, "{what} is {value:g}, more than 0 is expected: correct it", what, values)
    strongest = float(np.abs(flux_density).max())
    doubts = []
    if strongest > _STRONGEST_MAGNET_T:
        said = "{name:s}: {tesla:n} T is more than a permanent magnet makes; say the unit, as b=NAME [mT]"
        doubts.append(of_file("strongest", Text(said, table.path.name, digits(strongest, 3))))
    return FieldReadings(height, flux_density, height_u, u, own, (*table.warnings, *doubts))


def _must_be_in_range(table: Table, values: Array, most: float, what: str, *, unit: str, column: str) -> None:
    said = (
        "{what} of {value:.6g} {unit:s} cannot be, up to {most:g} {unit:s} is expected: if the unit is another one, "
        "say so, as `columns` = {column:s}"
    )
    refuse(table, np.abs(values) > most, said, what, values, unit, most, column)


#: Columns of a table that are looked at.
QUANTITIES = ("height_m", "height_u_m", "flux_density_t", "flux_density_u_t")

#: Those without which a table is no scan.
NEEDED = ("height_m", "flux_density_t")


def read_scan_file(path: Path, options: InputOptions) -> FieldReadings:
    """Return the scan in a data file.  Raises DoesNotSuit for another table, DataError for what cannot be used."""
    table = read_table(path, quantities=QUANTITIES, needed=NEEDED, **options.of_tables)
    return field_readings(table)


def read_scan_run(run: Run, _: InputOptions) -> FieldReadings:
    """Return the scan of a run."""
    return field_readings(run.readings())
