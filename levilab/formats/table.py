"""Other people's files, and our own readings.csv, as one table in SI.

A file is opened (`texts`) and understood (`understanding`), and its rows are read (`rows`).
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.errors import UsageError
from levilab.formats.columns import SHORTHANDS, Column, TableError, key_of, shorten
from levilab.formats.dialect import Dialect
from levilab.formats.layout import Layout
from levilab.formats.rows import Rows, left_out, read_rows
from levilab.formats.texts import Text, must_be_file
from levilab.formats.titles import CANONICAL, COMPANIONS, QUANTITIES, companion
from levilab.formats.understanding import Plan, Request, no_column, plan_of
from levilab.texts.note import of_file, reword
from levilab.texts.text import Sentences, how_many
from levilab.texts.text import Text as Said

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

FEWEST = 3  # readings below which no analysis has anything to say
NO_READING = 9.9e37  # SCPI-1999, 7.2.1.4: infinity is 9.9E37, "not a number" 9.91E37
LONGEST_HEADER = 1 << 16  # bytes


@dataclass(frozen=True, eq=False)
class Table:
    """A table of readings.

    `columns` are canonical (`time_s`, `spin_frequency_hz`, …): SI, float64, shape (rows,), all finite but for a run's
    other channels, where NaN is a value that was not known; `lines`, shape (rows,), is the 1-based line of `path` that
    each row stands in; `header` are the titles in the file; `factors` are those to SI that the file's numbers were
    multiplied by, and `numbers` those of its columns, from 1 on.
    """

    path: Path
    columns: "Mapping[str, NDArray[np.float64]]"
    warnings: tuple[str, ...]
    header: tuple[str, ...]
    lines: "NDArray[np.int64]"
    factors: Mapping[str, float] = field(default_factory=dict)
    numbers: Mapping[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        """Return the number of readings."""
        return self.lines.size

    @cached_property
    def frame(self) -> "pd.DataFrame":
        """The columns as pandas has them."""
        import pandas as pd

        return pd.DataFrame(dict(self.columns), dtype=np.float64)

    def column(self, name: str) -> "NDArray[np.float64]":
        """Return a canonical column in SI, shape (rows,).

        Raises:
            TableError: the file has no such column.
        """
        if name not in self.columns:
            raise no_column(self.path, name, self.header)
        return self.columns[name]


def read_table(
    path: Path,
    *,
    columns: Mapping[str, str] | None = None,
    quantities: Collection[str] = CANONICAL,
    needed: Collection[str] = (),
    guess: bool = True,
    skip_doubtful: bool = False,
) -> Table:
    """Read a table: CSV of any kind, a spreadsheet, a zip, JSON; decimal point or comma, with or without units.

    Args:
        path: the file; of several sheets or runs in it one, as if the file were a folder: ``mess.xlsx/Tabelle2``.
        columns: {canonical column, or t, f, u: title in the file or 1-based number}, where titles are not known.
        quantities: canonical columns that are wanted; others are not looked at.
        needed: canonical columns without which the table is of another kind, whatever stands in its rows.
        guess: whether columns without titles are taken as time, spin frequency and its uncertainty.
        skip_doubtful: whether rows in which a cell is no number are left out, with a note.

    Returns:
        At least three rows. Rows with a missed reading (empty, -, n/a, nan, inf, 9.91E37 …) are left out, with a
        warning that lists what counts as missed.

    Raises:
        SeveralRuns: the file holds several tables; its `paths` are theirs.
        TableError: there is no such table, or it cannot be understood without doubt.
    """
    with file_errors(path):
        plan = plan_of(path, Request(columns or {}, quantities, needed, guess))
        layout = plan.layout
        rows = read_rows(plan.text, layout, plan.columns, skip_doubtful=skip_doubtful)
    table = _table(plan.path, plan.header, plan.columns, _of_run(rows, plan), plan.warnings, wanted=quantities)
    path = plan.path
    if len(table) >= FEWEST:
        return table
    holds = how_many(len(table), "reading") if rows.lines.size else Said("only a header")
    missed = rows.lines.size - len(table)
    holds = Said("{readings} and {n} missed (no number)", holds, missed) if missed else holds
    advice = "record longer, or fill in what is missing" if missed else "record longer"
    what = "holds {what}, at least {fewest} readings are needed: {advice}"
    what = Sentences(Said(what, holds, FEWEST, advice), *rows.notes, between="; ")
    raise TableError(path, what, line=layout.header_line or layout.first_line)


def refuse(table: Table, wrong: "NDArray[np.bool_]", message: str, *values: Any) -> None:
    """Raise TableError, which names the line, for the first of the wrong readings.

    Args:
        table: of the readings.
        wrong: which of them, shape (n,).
        message: what is wrong with it, a template.
        values: in the message; of an array that of the reading.
    """
    if wrong.any():
        i = int(wrong.argmax())
        of_it = (value[i] if isinstance(value, np.ndarray) else value for value in values)
        raise TableError(table.path, message, *of_it, line=int(table.lines[i]))


def must_be_positive(table: Table, values: "NDArray[np.float64]", what: str, advice: str) -> None:
    """Raise TableError, which names the line, for the first of these values that is not above 0."""
    refuse(table, values <= 0, "{what} is {value:.9g} {advice}", what, values, advice)


def read_run_readings(path: Path, channels: Collection[str] = ()) -> Table:
    """Read the readings.csv of a run folder, which may still be being written.

    A last line without its line end is torn and left out, with a warning. No rows, or no header yet, are no error.

    Args:
        path: the file.
        channels: columns that the run declares, beside the canonical ones.

    Raises:
        TableError: it cannot be read, its header is not ours, or a line is damaged.
    """
    with file_errors(path):
        with path.open("rb") as stream:
            first = stream.readline(LONGEST_HEADER)
        title = first.decode("utf-8-sig", errors="replace")
        header = tuple(title.removesuffix("\n").removesuffix("\r").split(",")) if title.endswith("\n") else ()
        known = dict.fromkeys((*channels, *CANONICAL))
        chosen = tuple(Column(n, header.index(n), n, 1) for n in known if n in header)
        if header and not (chosen and "".join(header).isprintable()):
            raise TableError(path, "'{title:s}' is no header of a run, as time_s,… is", shorten(title.strip()), line=1)
        layout = Layout("utf-8-sig", Dialect(",", "."), header, 1, (), 2, len(first), len(header))
        cut = (left_out(1, title, "was cut off"),) if title else ()
        nothing = Rows((), np.zeros(0, np.int64), cut)
        rows = read_rows(Text(path), layout, chosen, drop_unended=True) if header else nothing
    return _table(path, header, chosen, rows, (), gaps=set(channels) - set(CANONICAL))


class ColumnsError(UsageError):
    """`columns` cannot be understood."""


#: What stands before the name of a quantity in the option `columns`: a comma, a semicolon; a blank before a short one.
_BETWEEN = re.compile(rf"[,;](?=\s*[^\W\d]\w*\s*=)|\s+(?=(?:time|frequency|{'|'.join(SHORTHANDS)})\s*=)")


def parse_columns(given: object) -> dict[str, str]:
    """Return the option `columns` as `read_table` takes it; titles in its text may hold commas and equals signs.

    >>> parse_columns("t=Zeit, s,f=3"), parse_columns("time=1 f=2 [rpm]")
    ({'t': 'Zeit, s', 'f': '3'}, {'t': '1', 'f': '2 [rpm]'})

    Raises:
        ColumnsError: it is not NAME=COLUMN,NAME=COLUMN.
    """
    if isinstance(given, Mapping):
        parts = [(str(name), str(title)) for name, title in given.items()]
    elif isinstance(given, str):
        texts = (part.partition("=") for part in _BETWEEN.split(given) if given.strip())
        parts = [(name.strip(), title.strip()) for name, _, title in texts]
    else:
        expected = 'names of quantities with their columns are expected, as {"t": "Zeit", "f": 3} or "t=Zeit,f=3"'
        raise ColumnsError("columns", expected, value=given)
    keys = [key_of(name) for name, _ in parts]
    quantities = [SHORTHANDS.get(key, key) for key in keys if key]
    if len({*quantities}) < len(quantities) or not all(name and title for name, title in parts):
        expected = "NAME=COLUMN,NAME=COLUMN is expected, each NAME once, as t=Zeit,f=3"
        raise ColumnsError("columns", expected, value=f"'{shorten(str(given))}'")
    if None in keys:
        unknown = shorten(parts[keys.index(None)][0])
        what = "'{unknown:s}' is no quantity known here; {known:s} are, as t=Zeit,f=3"
        raise ColumnsError("columns", what, unknown, ", ".join(SHORTHANDS))
    return {key: title for key, (_, title) in zip(keys, parts, strict=True) if key}


@contextmanager
def file_errors(path: Path) -> Iterator[None]:
    """Say in one line what keeps a file from being opened."""
    try:
        must_be_file(path)
        yield
    except FileNotFoundError as error:
        raise TableError(path, "no such file; check the name and the folder") from error
    except PermissionError as error:
        raise TableError(path, "may not be read by you; change its permissions or copy it") from error
    except OSError as error:
        what = "cannot be read ({why:s}); check the name and the disk"
        raise TableError(path, what, error.strerror or type(error).__name__) from error


def _of_run(rows: Rows, plan: Plan) -> Rows:
    """Return the rows of a run beside others: those below its last reading are of longer runs."""
    own = [values for column, values in zip(plan.columns, rows.values, strict=True) if column.index in plan.own]
    if not own or not rows.lines.size:
        return rows
    filled = np.logical_or.reduce([~np.isnan(values) for values in own])
    return replace(rows, values=tuple(values[filled] for values in rows.values), lines=rows.lines[filled])


def _table(
    path: Path,
    header: tuple[str, ...],
    chosen: Sequence[Column],
    rows: Rows,
    warnings: tuple[str, ...],
    *,
    wanted: Collection[str] = (),
    gaps: Collection[str] = (),
) -> Table:
    """Leave out missed readings, and columns of uncertainties with gaps; then convert to SI.

    wanted: names of columns that are taken from behind a ±, where the file has none of their own.
    gaps: names of columns that may have some, at no cost of a row.
    """
    name = shorten(str(path), 200)
    notes = [*warnings, *(reword(note, Said("{path:s}: {what}", name, note), names_input=True) for note in rows.notes)]
    numbers = dict(zip(chosen, rows.values, strict=False))
    notes += [of_file("±", Said("{seen} is not used", _seen(name, c)), "advice") for c in _drop_unused(numbers, wanted)]
    # The comparison is false for NaN, too.
    present = {column: np.abs(values) < NO_READING for column, values in numbers.items() if column.name not in gaps}
    present = {column: there & (numbers[column] != 0) if column.inverse else there for column, there in present.items()}
    companions = {companion(column.name) for column in chosen} | COMPANIONS.keys()
    quantity = [p for c, p in present.items() if c.name not in companions]
    read = np.logical_and.reduce(quantity) if quantity else np.ones(rows.lines.size, bool)
    for column, missing in [(c, read & ~p) for c, p in present.items() if c.name in companions]:
        notes += _notes_on_u(_seen(name, column), column, missing, read)
        if missing.any():  # better no uncertainties than readings lost for want of them
            del present[column]
    good = np.logical_and.reduce(list(present.values())) if present else np.ones(rows.lines.size, bool)
    kept = {column: values for column, values in numbers.items() if column in present or column.name in gaps}
    lines = rows.lines
    if not good.all():
        notes.append(_missed_warning(name, lines[~good], good.size, periods=any(column.inverse for column in present)))
        lines, kept = lines[good], {column: values[good] for column, values in kept.items()}
    columns = _in_si(kept)
    for total in [c for c in kept if c.is_total]:
        _must_not_fall(path, columns["time_s"], columns[total.name], lines)
        u = Said("that of both counts") if companion(total.name) in columns else _WHOLE_TURNS
        columns, lines = _differences(columns, total.name), lines[1:]
        notes.append(of_file("turns", Said(_OF_TOTALS, name=name, label=shorten(total.label), u=u)))
    factors = {c.name: c.factor for c in kept if not c.inverse}
    return Table(path, columns, tuple(notes), header, lines, factors, {c.name: c.index + 1 for c in kept})


def _in_si(kept: "Mapping[Column, NDArray[np.float64]]") -> "dict[str, NDArray[np.float64]]":
    """Return columns in SI by their names, of a period the frequency."""
    columns = {c.name: values if c.factor == 1 else values * c.factor for c, values in kept.items()}
    for name in [c.name for c in kept if c.inverse and c.name in QUANTITIES]:
        columns[name] = 1 / columns[name]
        if any(c.inverse and c.name == companion(name) for c in kept):
            columns[companion(name)] = columns[companion(name)] * columns[name] ** 2  # u(1/T) = u(T)/T²
    for c in kept:
        if c.unit == "%":
            columns[c.name] = columns[c.name] * np.abs(columns[COMPANIONS[c.name]])
    return columns


#: Rows that are left out, several and one.
_MISSED = (
    "{path:s}: {n} of {rows} rows are left out as missed (empty, -, n/a, nan, inf{zero} or 9.91E37): lines {places:s}"
)
_MISSED_ONE = (
    "{path:s}: {n} of {rows} rows is left out as missed (empty, -, n/a, nan, inf{zero} or 9.91E37): line {places:s}"
)
#: u of a difference of two counts, each cut to whole turns: two rectangular distributions, GUM 4.3.7 [turns].
_U_OF_TURNS = 6**-0.5
_WHOLE_TURNS = Said("0.41 turns, of two counts cut to whole turns")
#: Measured in tests/levilab/pipelines/spindown: of differences that share a count, which the fit takes as independent.
_OF_TOTALS = (
    "{name:s}: column '{label:s}' counts turns since the start: each reading is the mean between two rows, at the "
    "middle of their times, with u from {u}; neighbours share a count, which the fit does not know, so that u of the "
    "results is 3 to 4 times too large"
)


def _must_not_fall(
    path: Path, time: "NDArray[np.float64]", turns: "NDArray[np.float64]", lines: "NDArray[np.int64]"
) -> None:
    """Raise TableError, which names the line, for a count of turns that falls while time goes on."""
    falls = (np.diff(turns) < 0) & (np.diff(time) > 0)
    if falls.any():
        k = int(falls.argmax())
        said = "the count falls from {before:g} to {after:g}, so the counter was reset: keep the rows on one side alone"
        raise TableError(path, Said(said, before=turns[k], after=turns[k + 1]), line=int(lines[k + 1]))


def _differences(columns: "Mapping[str, NDArray[np.float64]]", name: str) -> "dict[str, NDArray[np.float64]]":
    """Return times and mean spins between rows, and their u, of turns that were counted since the start."""
    time, turns = columns["time_s"], columns[name]
    wait = np.diff(time)
    with np.errstate(divide="ignore", invalid="ignore"):  # times that repeat are refused later
        u_turns = columns.get(companion(name))
        u = _U_OF_TURNS if u_turns is None else np.hypot(u_turns[1:], u_turns[:-1])
        spin, u = np.diff(turns) / wait, u / np.abs(wait)
    return {"time_s": (time[1:] + time[:-1]) / 2, name: spin, companion(name): u}


def _drop_unused(numbers: "dict[Column, NDArray[np.float64]]", wanted: Collection[str]) -> list[Column]:
    """Drop the columns behind a ± that are not wanted, or stand in the file by themselves; return those with numbers.

    Those in which no row has a ± are dropped, too.
    """
    own = {column.name for column in numbers if not column.behind}
    with_numbers = {column for column, values in numbers.items() if column.behind and np.isfinite(values).any()}
    used = {column for column in with_numbers if column.name in wanted and column.name not in own}
    for column in [column for column in numbers if column.behind and column not in used]:
        del numbers[column]
    return sorted(with_numbers - used, key=lambda column: column.index)


def _seen(name: str, column: Column) -> str:
    """Return the beginning of a note on a column."""
    behind = "{name:s}: column '{label:s}': the number behind the ±"
    return Said(behind if column.behind else "{name:s}: column '{label:s}'", name, shorten(column.label))


def _notes_on_u(seen: str, column: Column, missing: "NDArray[np.bool_]", read: "NDArray[np.bool_]") -> Iterator[str]:
    """Yield a note on a column of uncertainties that has gaps among the rows that are read, or stands behind a ±."""
    if missing.any():
        gap = "{seen} is {missing} in {n} of {rows} rows and is not used"
        how = "missing" if column.behind else "empty"
        yield of_file("gaps", Said(gap, seen, how, missing.sum(), read.sum()))
    elif column.behind:
        yield of_file("±", Said("{seen} is taken as the standard uncertainty", seen), "advice")


def _missed_warning(name: str, lines: "NDArray[np.int64]", rows: int, *, periods: bool) -> str:
    """Return the warning about rows left out, with what counts as missed, a period of 0 with `periods`."""
    zero = ", a period of 0" * periods
    places = ", ".join(str(line) for line in lines[:5]) + (", …" if lines.size > 5 else "")
    said = _MISSED_ONE if lines.size == 1 else _MISSED
    return of_file("missed", Said(said, name, lines.size, rows, zero, places), "advice")
