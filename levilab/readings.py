"""What a table of readings must fulfil before an analysis may trust it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from levilab.columns import TableError
from levilab.formats import FEWEST, Table

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Readings:
    """Spin readings, each array of shape (n,): increasing `time` [s], positive `frequency` and its `u` [Hz]."""

    time: "NDArray[np.float64]"
    frequency: "NDArray[np.float64]"
    u: "NDArray[np.float64] | None"
    warnings: tuple[str, ...]


def spin_readings(table: Table, *, fewest: int = FEWEST) -> Readings:
    """The readings of a spin-down: time, spin frequency and, if the table has it, its standard uncertainty.

    Args:
        table: with `time_s` and `spin_frequency_hz`.
        fewest: readings that are needed.

    Raises:
        TableError: a column is missing, there are too few readings, times repeat or go back, or a frequency or
            an uncertainty is not positive; the line of the file is named.
    """
    time, frequency = table.column("time_s"), table.column("spin_frequency_hz")
    has_u = "spin_frequency_u_hz" in table.frame.columns
    u = table.column("spin_frequency_u_hz") if has_u else None
    if time.size < fewest:
        raise TableError(table.path, f"holds {time.size} readings, at least {fewest} are needed: record longer")
    _must_increase(table, time)
    _must_be_positive(table, frequency, "the frequency", "Hz, but a spinning top is above 0: remove the reading")
    if u is not None:
        _must_be_positive(table, u, "the uncertainty", "Hz, but must be above 0: correct it or remove the column")
    return Readings(time, frequency, u, table.warnings)


def _must_increase(table: Table, time: "NDArray[np.float64]") -> None:
    late = np.flatnonzero(np.diff(time) <= 0)
    if late.size:
        i = int(late[0])
        before, after = (int(line) for line in table.lines[i : i + 2])
        what = "is repeated" if time[i] == time[i + 1] else "comes"
        raise TableError(
            table.path,
            f"the time {time[i + 1]:.9g} s {what} after {time[i]:.9g} s in line {before}, times must increase: sort "
            "the readings, or correct one",
            line=after,
        )


def _must_be_positive(table: Table, values: "NDArray[np.float64]", what: str, advice: str) -> None:
    wrong = np.flatnonzero(values <= 0)
    if wrong.size:
        i = int(wrong[0])
        raise TableError(table.path, f"{what} is {values[i]:.9g} {advice}", line=int(table.lines[i]))
