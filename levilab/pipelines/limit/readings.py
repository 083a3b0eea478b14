"""What a table of limits must fulfil before an analysis may trust it."""

import math
import re
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from analysis.arrays import Array
from analysis.errors import AnalysisError
from analysis.limits import U_OF_WAY, spin_at_fall
from analysis.rotation import track_of_field
from analysis.spindown.fall import STOPPED_ABOVE_HZ
from levilab.errors import DoesNotSuit
from levilab.formats.columns import TableError
from levilab.formats.table import FEWEST, Table, must_be_positive, read_table
from levilab.formats.texts import locate, texts_of
from levilab.formats.titles import read_title, unit_factor
from levilab.formats.understanding import LEAST_TREND, is_possible_spin, trend_of
from levilab.pipelines.inputs.source import Readings
from levilab.pipelines.options import InputOptions
from levilab.pipelines.spin.magnetometer import FieldRecord, read_field_record
from levilab.runs.events import RunEvent
from levilab.runs.run import Run
from levilab.texts.note import of_file
from levilab.texts.text import Text

#: Columns that an analysis of limits looks at.
NEEDED = ("spin_frequency_hz",)
#: Times, too, where there are any, so that a fault in them is not overlooked: they are most likely a spin-down's.
QUANTITIES = ("time_s", *NEEDED, "spin_frequency_u_hz")
#: Limits that differ by more than this part of their mean are none of one top: most likely a spin-down.
_MOST_SPREAD = 0.25
#: Number of rows from which a trend counts: chance orders three limits in one file of three, whose times are then left
#: out; a spin-down's are never limits.
_FEWEST = 3
#: A number on a line of its own, with a decimal point or comma, and what is read of a file that holds nothing else.
_NUMBER, _MOST_BYTES = re.compile(r"[+-]?\d+(?:[.,]\d*)?(?:[eE][+-]?\d+)?"), 1 << 20


@dataclass(frozen=True, eq=False)
class LimitReadings(Readings):
    """Limits of the spin, one a repetition, each array of shape (n,).

    Attributes:
        limit: spin at which the top was lost [Hz].
        u: standard uncertainties [Hz], None where they are not known.
        warnings: about the table.
        common: of spins at which the pull of a drive equalled the drag, which are no limits: the part of each u that is
            the same error in all [Hz].
    """

    limit: Array
    u: Array | None
    warnings: tuple[str, ...]
    common: Array | None = None

    compared: ClassVar[tuple[str, ...]] = ("limit",)


def read_limit_file(path: Path, options: InputOptions) -> LimitReadings:
    """Return the limits in a data file.  Raises DoesNotSuit for another table, DataError for what cannot be used."""
    field = read_field_record(path, options)
    if field:
        return limits_in_field(path, field, options.near)
    try:
        table = read_table(path, quantities=QUANTITIES, needed=NEEDED, **options.of_tables)
    except TableError as error:  # a title of several words looks like several columns
        single = None
        with suppress(OSError):  # the error says that it may not be read
            single = single_column(path, guess=options.guess)
        if single is None:
            raise error from None
        table = single
    readings = limit_readings(table)
    if "time_s" in table.columns:
        _must_be_of_several(path, table.column("time_s"), readings.limit)
    return readings


def _must_be_of_several(path: Path, time: Array, limit: Array) -> None:
    """Raise DoesNotSuit for the spins of one top, or what may be meant for them."""
    no_times = "of limits one row a repetition is expected (leave out the column of times if these are limits)"
    if np.any(np.diff(time) <= 0):
        raise DoesNotSuit("{path:s}: its times do not increase from row to row; {do}", path, no_times)
    if len(limit) < _FEWEST:
        return
    if not np.ptp(limit):
        raise DoesNotSuit("{path:s}: the spin does not change with time: is the drive on? {do}", path, no_times)
    trend = trend_of(limit)
    if abs(trend) > LEAST_TREND:
        way = "falls" if trend < 0 else "rises"
        raise DoesNotSuit("{path:s}: the spin {way} with time, as that of one top does; {do}", path, way, no_times)


def limits_in_field(path: Path, record: FieldRecord, near: float | None) -> LimitReadings:
    """Return the spins at which tops fell in a magnetometer's record, each continued from its last windows.

    near: about where the spin is at first, to 10 % [Hz].

    Raises:
        DoesNotSuit: in the record no top falls after three windows or more, but is stopped by hand, or its folds cannot
            be distinguished.
    """
    try:
        track = track_of_field(record.times, record.field, near=near)
    except AnalysisError as error:
        raise DoesNotSuit("{path:s}: {error}", path, error) from error
    falls, slowing = [], []
    for one in track.flights:
        part = slice(one.first, one.last)
        known = not any(spin.doubtful for spin in track.spins[part])
        if one.ended and known and one.last - one.first >= FEWEST:
            reach = math.sqrt(3) * one.u_end  # of an even distribution of this u
            u = float(np.median(track.u[part]))
            slowing.append(track.frequency[one.last - 1] < track.frequency[one.first])
            falls.append(spin_at_fall(track.time[part], track.frequency[part], u, (one.end - reach, one.end + reach)))
    if not falls:
        raise DoesNotSuit("{path:s}: no top falls in it after {n} windows whose spin is certain", path, FEWEST)
    spins, u_spins = np.array([(one.value, one.u) for one in falls], dtype=float).T
    tops, notes, stopped = len(track.flights), [*record.warnings], np.array(slowing) & (spins > STOPPED_ABOVE_HZ)
    if stopped.any():
        said = (
            "{name:s}: {n} of {tops} tops are lost at {hz:.3g} Hz or above and are left out: no top falls so early, "
            "was it stopped?"
        )
        notes.append(of_file("stopped", Text(said, path.name, int(stopped.sum()), tops, float(spins[stopped].min()))))
    if stopped.all():
        raise DoesNotSuit(notes[-1])
    seen = Text("{name:s}: {n} of {tops} tops fall in this record", path.name, int((~stopped).sum()), tops)
    return LimitReadings(spins[~stopped], u_spins[~stopped], (*notes, of_file("falls", seen, "advice")))


def single_column(path: Path, *, guess: bool) -> Table | None:
    """Return the table of a file with one number a line, which are limits by its title or, if guess, for want of one.

    None of a file that holds anything else, or that may hold times before commas that never fall.
    """
    file, inside = locate(path)
    one = next((text for text in texts_of(file) if not inside or text.path == path), None)
    if one is None:
        return None
    with one.open() as stream:
        text = stream.read(_MOST_BYTES).decode("utf-8-sig", errors="replace")
    lines = [(k, line.strip()) for k, line in enumerate(text.splitlines(), 1)]
    filled = [(k, line) for k, line in lines if line and not line.startswith("#")]
    titles = [line for _, line in filled if not _NUMBER.fullmatch(line)]
    numbers = filled[len(titles) :]
    if not numbers or len(titles) > 1 or not all(_NUMBER.fullmatch(line) for _, line in numbers):
        return None
    title = read_title(titles[0]) if titles else None
    named = title is not None and title.column == NEEDED[0]
    other = title is not None and title.column not in {None, NEEDED[0]}
    unit = title and ("rad/s" if title.counts_radians(title.unit) else title.unit)
    factor = unit_factor(unit, "frequency") if unit else 1.0
    if other or factor is None or not (guess or named):
        return None
    notes: tuple[str, ...] = ()
    times = [int(line.partition(",")[0]) for _, line in numbers if re.fullmatch(r"\d+,\d+", line)]
    if len(times) == len(numbers) >= _FEWEST and not named:
        increase = times[0] < times[-1] and times == sorted(times)
        if increase and (not titles or np.ptp(times) > _MOST_SPREAD * np.mean(times)):
            return None
        said = "{path:s}: its rows, as {row:s}, are taken for one number each, with a decimal comma"
        notes = (of_file("decimal comma", Text(said, path.name, numbers[0][1])),)
    values = factor * np.array([float(line.replace(",", ".")) for _, line in numbers])
    if not (named or is_possible_spin(float(np.median(values)))):
        return None
    return Table(path, {NEEDED[0]: values}, notes, tuple(titles), np.array([k for k, _ in numbers], dtype=np.int64))


def read_limit_run(run: Run, _: InputOptions) -> LimitReadings:
    """Return the limits of a run; spins at which tops levelled off are none, and are left out if there are others."""
    table = run.readings()
    found = limit_readings(table)
    tops = [int(event["top"]) for event in run.events() if event["kind"] == RunEvent.LEVELS_OFF]
    levels = np.isin(np.arange(1, len(found) + 1), tops)
    if not levels.any():
        return found
    if levels.all():
        return replace(found, common=U_OF_WAY * (found.limit - table.column("spin_seen_hz")))
    left_out = ", ".join(f"{spin:.2f} Hz" for spin in found.limit[levels])
    said = (
        "{n} of {tops} tops got no faster than {spins:n}, where the pull of the drive equals the drag: these are no "
        "limits, and left out"
    )
    note = Text(said, levels.sum(), levels.size, left_out)
    u = None if found.u is None else found.u[~levels]
    return LimitReadings(found.limit[~levels], u, (*found.warnings, note))


def limit_readings(table: Table) -> LimitReadings:
    """Return the limits of a run or of a data file.

    Args:
        table: with `spin_frequency_hz`, one row a repetition.

    Raises:
        TableError: a column is missing, there is no row, or a limit or an uncertainty is not positive; the line of the
            file is named.
        DoesNotSuit: the spins differ so much that they are no limits.
    """
    limit = table.column("spin_frequency_hz")
    if not limit.size:
        raise TableError(table.path, "holds no limit: at least one repetition is needed")
    u = table.columns.get("spin_frequency_u_hz")
    must_be_positive(
        table, limit, "the limit", "Hz; above 0 is expected: a sign is the sense of the spin, give the magnitude"
    )
    if u is not None:
        must_be_positive(table, u, "the uncertainty", "Hz, but must be above 0: correct it or remove the column")
    spread = float(np.ptp(limit) / limit.mean())
    if spread > _MOST_SPREAD:
        said = (
            "{path:s}: its spins differ by {percent:.0f} % of their mean, so they are no limits of one top: one row a "
            "repetition is expected"
        )
        raise DoesNotSuit(said, table.path, 100 * spread)
    return LimitReadings(limit, u, table.warnings)
