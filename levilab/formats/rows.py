"""The numbers in the rows of a table of text, read at once where there are many and every line is plain, else by line.

Plain is a file in which the number of line ends and separators is that of full rows and every field that is used is
a number or a missed reading; pandas then reads it at its full speed. All else (comments among the rows, quotation
marks, blanks as separators, a damaged line) is read again line by line, so that an error can name its line.
"""

import contextlib
import csv
import io
import re
import warnings
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from levilab.formats.columns import SHORTHANDS, Column, DoubtfulRows, TableError, shorten
from levilab.formats.dialect import (
    CLOCK,
    MISSING,
    UNVALUED,
    clock_time,
    is_dated,
    slashed_date,
    unit_behind,
    value_and_u,
)
from levilab.formats.layout import CONTROL, Layout
from levilab.formats.texts import Text
from levilab.formats.titles import are_hours, dimension, is_unit, read_title, unit_factor
from levilab.formats.transposed import LIES
from levilab.texts.note import Note
from levilab.texts.text import Text as Said
from levilab.texts.text import how_many

#: Decimal mark → what is expected, for messages.
EXPECTED = {",": Said("a number with decimal comma"), ".": Said("a number with decimal point")}
FIELDS = "'{row:s}' has {fields}, {width} are expected: complete or remove the line{hint}"
FEW = 1 << 16  # bytes that are read line by line before pandas is imported
BLOCK = 1 << 17  # bytes counted at once: small enough for the cache
ONE_BYTE_ENCODINGS = ("utf-8", "utf-8-sig", "latin-1")  # those in which a line end is one byte, whatever precedes it
#: A field without a digit is a person's remark, the name of a mean, ####; so is #DIV/0!.
_NUMBER_IN = re.compile(r"\d")
#: Lines that are no rows, before the rest is not looked at, and those that a note names.
_MOST_REFUSED, _MOST_NAMED = 1000, 5
TRUTHS = (b"rue", b"RUE", b"alse", b"ALSE")  # of True and False, which pandas takes for 1 and 0
SPELLINGS = sorted({form for text in MISSING for form in (text, text.upper(), text.title(), "NaN")})


class _Words(TableError):
    """A row with words in the place of a number."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Numbers as they stand in the file.

    `values` has one array, shape (rows,), for each column that is used, NaN where a reading is missed; `lines`,
    shape (rows,), holds their 1-based lines; `notes` are about last lines that are left out, and about times that may
    be meant otherwise.
    """

    values: "tuple[NDArray[np.float64], ...]"
    lines: "NDArray[np.int64]"
    notes: tuple[str, ...] = ()


def read_rows(
    text: Text, layout: Layout, chosen: Sequence[Column], *, drop_unended: bool = False, skip_doubtful: bool = False
) -> Rows:
    """Read all rows of the chosen columns.

    A last line without line end is left out if it is no full row, or in any case if `drop_unended`; with
    `skip_doubtful` each line that is no row is.

    Raises:
        TableError: a line is damaged.
        OSError: the file cannot be read.
    """
    few = text.size < FEW
    rows = None if few else _read_at_once(text, layout, chosen, drop_unended=drop_unended)
    try:
        return rows or _read_lines(text, layout, chosen, drop_unended=drop_unended, skip_doubtful=skip_doubtful)
    except TableError as error:
        if not text.lies:
            raise
        raise TableError(error.path, "{wrong}; {lies}", error.message, LIES, line=error.line) from None


def _read_at_once(text: Text, layout: Layout, chosen: Sequence[Column], *, drop_unended: bool) -> Rows | None:
    """Read all rows by pandas; None if any line is not plain, or the file grows meanwhile."""
    import pandas as pd

    dialect, fields, used = layout.dialect, layout.width, [column.index for column in chosen if not column.behind]
    count, rest = _plain_lines(text, layout) if _may_be_plain(layout, used) else (0, b"")
    if count == 0:
        return None
    try:
        with warnings.catch_warnings(action="ignore"):
            frame = pd.read_csv(
                text.path.absolute() if text.content is None else text.open(),
                sep=dialect.separator, decimal=dialect.decimal, header=None, names=list(range(fields)),
                usecols=None if len(used) == fields else sorted(used), skiprows=layout.first_line - 1, dtype="float64",
                index_col=False, quoting=csv.QUOTE_NONE, na_values=SPELLINGS, keep_default_na=False, compression=None,
                encoding_errors="replace",
            )  # fmt: skip
    except ValueError:  # text in a number column or too many fields: _read_lines tells where, or reads it
        return None
    if len(frame) != count + bool(rest.strip()):
        return None
    read = {index: frame[index].to_numpy()[:count] for index in used}
    # If all fields hold a number, the right sum of separators means the right number in each line. If not, one too
    # many in one line may hide one missing in another.
    certain = len(used) == fields and not any(np.isnan(column).any() for column in read.values())
    if not certain and not _every_line_is_full(text, layout):
        return None
    values = tuple(np.full(count, np.nan) if column.behind else read[column.index] for column in chosen)
    rows = Rows(values, np.arange(layout.first_line, layout.first_line + count))
    last = rest.decode(layout.encoding, "replace")
    return _with_last(text.path, layout, chosen, rows, last, drop_unended=drop_unended)


def _may_be_plain(layout: Layout, used: Sequence[int]) -> bool:
    """Return whether the fast way is safe; without the first field a comment with separators would pass for a row."""
    separator, decimal = layout.dialect.separator, layout.dialect.decimal
    first = 0 in used or layout.aligned
    return layout.encoding in ONE_BYTE_ENCODINGS and separator not in (None, decimal) and first


def _plain_lines(text: Text, layout: Layout) -> tuple[int, bytes]:
    """Return the number of lines with rows, and the text after the last line end; none if separators do not add up."""
    separator = ord(layout.dialect.separator or " ")
    lines = separators = 0
    rest = b""
    with text.open() as stream:
        stream.seek(layout.start)
        while not rest and (block := stream.read(BLOCK) + stream.readline()):
            end = block.rfind(b"\n") + 1
            codes, rest = np.frombuffer(block, np.uint8, count=end), block[end:]
            lines += int(np.count_nonzero(codes == ord("\n")))
            separators += int(np.count_nonzero(codes == separator))
            # pandas ends a field at the one, and a line at the other, wherever it stands
            if b"\0" in block or (b"\r" in block and block.count(b"\r") != block.count(b"\r\n")):
                return 0, b""
            # a single letter is found ten times as fast as a word
            if any(letter in block for letter in (b"u", b"U", b"s", b"S")) and any(word in block for word in TRUTHS):
                return 0, b""
    return (lines, rest) if separators == lines * (layout.width - 1) else (0, b"")


def _every_line_is_full(text: Text, layout: Layout) -> bool:
    """Return whether each line, without all other characters, is the separators of one row."""
    line = (layout.dialect.separator or " ").encode() * (layout.width - 1) + b"\n"
    others = bytes(set(range(256)) - set(line))
    with text.open() as stream:
        stream.seek(layout.start)
        while block := stream.read(BLOCK) + stream.readline():
            marks = block[: block.rfind(b"\n") + 1].translate(None, others)
            if marks != line * (len(marks) // len(line)):
                return False
    return True


def _skips(layout: Layout, line: str) -> bool:
    """Return whether a line is no row: blank, a comment, or some separators that a spreadsheet left behind."""
    separator = layout.dialect.separator
    if layout.dialect.skips(line):
        return True
    return separator is not None and not line.strip(separator + " \n") and line.count(separator) < layout.width - 1


def _with_last(
    path: Path, layout: Layout, chosen: Sequence[Column], rows: Rows, rest: str, *, drop_unended: bool
) -> Rows:
    """Append the row behind the last line end, if there is one."""
    if _skips(layout, rest):
        return rows
    line = layout.first_line + rows.lines.size
    last = None if drop_unended else _row_or_none(path, layout, chosen, line, rest)
    if last is None:
        return replace(rows, notes=(left_out(line, rest, "was cut off"),))
    values = tuple(np.append(column, number) for column, number in zip(rows.values, last, strict=True))
    return Rows(values, np.append(rows.lines, line))


def _read_lines(
    text: Text, layout: Layout, chosen: Sequence[Column], *, drop_unended: bool, skip_doubtful: bool = False
) -> Rows:
    """Read all rows line by line; some 2 µs a number."""
    lines, values = array("q"), [array("d") for _ in chosen]
    time, path, notes = "", text.path, list[str]()
    layout, beside = _with_order_of_dates(text, layout, chosen, notes), _columns_of_remarks(layout, chosen)
    refused, remarks = list[tuple[TableError, str]](), list[tuple[TableError, str]]()
    for number, line in _lines(text, layout, notes):
        if not line.endswith("\n"):
            row = None if drop_unended else _row_or_none(path, layout, chosen, number, line)
            if row is None:
                notes.append(left_out(number, line, "was cut off"))
                break
        try:
            row = _row(path, layout, chosen, number, line)
        except TableError as error:
            (remarks if isinstance(error, _Words) else refused).append((error, line))
            if len(refused) > _MOST_REFUSED and not skip_doubtful:
                break
            continue
        time = time or _time_in(layout, chosen, line)
        notes += _remark(layout, beside, number, line)
        lines.append(number)
        for column, value in zip(values, row, strict=True):
            column.append(value)
    numbers = tuple(
        _clocks(np.array(found, np.float64), column, time, notes, cells=layout.aligned)
        if column.name == "time_s"
        else np.array(found, np.float64)
        for column, found in zip(chosen, values, strict=True)
    )
    refused = refused if lines else [*remarks[:1], *refused]
    notes += _notes_on_refused(refused, len(lines), skip=skip_doubtful, may_skip=not drop_unended)
    notes += _notes_on_remarks(remarks, len(lines) + len(refused))
    return Rows(numbers, np.array(lines, np.int64), (*notes, *_doubts_about(time, layout, chosen, numbers)))


def _notes_on_refused(
    doubtful: Sequence[tuple[TableError, str]], read: int, *, skip: bool, may_skip: bool
) -> Iterator[str]:
    """Yield the note on doubtful lines that are left out.

    Args:
        doubtful: what is wrong with each line, and the line.
        read: number of the rows.
        skip: whether they are to be left out.
        may_skip: whether they could be.

    Raises:
        TableError: of the first line, where they are not; DoubtfulRows, if they could be.
    """
    numbers = [str(error.line) for error, _ in doubtful]
    if doubtful and not skip:
        error, _ = doubtful[0]
        others = how_many(len(numbers) - 1, "other line")
        also = Said(" (also in {lines}: {places:s})", others, _places(numbers[1:])) if len(numbers) > 1 else ""
        do = "; `skip_doubtful` leaves such rows out" if may_skip and len(doubtful) < read else ""
        kind = DoubtfulRows if do else TableError
        raise kind(error.path, "{wrong}{also}{do}", error.message, also, do, line=error.line)
    if doubtful:
        many = "{n} doubtful rows are left out, as `skip_doubtful` says: lines {places:s}"
        one = "{n} doubtful row is left out, as `skip_doubtful` says: line {places:s}"
        yield Note("doubtful", Said(one if len(numbers) == 1 else many, len(numbers), _places(numbers)))


def _notes_on_remarks(remarks: Sequence[tuple[TableError, str]], others: int) -> Iterator[str]:
    """Yield the note on lines of words, which are left out; others: number of the other rows."""
    if len(remarks) == 1:
        yield left_out(remarks[0][0].line or 0, remarks[0][1], "is no reading")
    elif remarks:
        said = "{n} of {rows} rows hold no reading (first: '{first:s}') and are left out: lines {places:s}"
        first, places = shorten(" ".join(remarks[0][1].split())), _places([str(error.line) for error, _ in remarks])
        yield Note("words", Said(said, len(remarks), others + len(remarks), first, places))


def _places(numbers: Sequence[str]) -> str:
    """Return the numbers of lines, or the first few of them."""
    return ", ".join([*numbers[:_MOST_NAMED], *["…"] * (len(numbers) > _MOST_NAMED)])


def _lines(text: Text, layout: Layout, notes: list[str] | None = None) -> Iterator[tuple[int, str]]:
    """Yield the lines that should be rows, with their numbers; notes get those with bytes that are no text."""
    with io.TextIOWrapper(text.open(), layout.encoding, errors="replace", newline=None) as stream:
        for number, line in enumerate(stream, 1):
            if number < layout.first_line or _skips(layout, line):
                continue
            if not CONTROL.search(line):
                yield number, line
            elif notes is not None:
                notes.append(left_out(number, line, "has bytes that are no text"))


def _columns_of_remarks(layout: Layout, chosen: Sequence[Column]) -> list[int]:
    """Return the columns that are not read, and empty in most of the first rows."""
    unread = {*range(layout.width)} - {column.index for column in chosen}
    filled = {k: sum(any(row[k : k + 1]) for row in layout.sample) for k in unread}
    return sorted(k for k, cells in filled.items() if 2 * cells < len(layout.sample))


def _remark(layout: Layout, beside: Sequence[int], number: int, line: str) -> Iterator[str]:
    """Yield a note on the words that a person wrote beside a row: in columns of remarks, or behind the last one."""
    fields = layout.dialect.split(line)
    cells = [cell for k in beside for cell in fields[k : k + 1] if layout.dialect.kind(cell) == "text"]
    if remark := " ".join(filter(None, [*cells, *([] if layout.aligned else fields[layout.width :])])):
        yield Note("remark", Said("line {number}: the remark '{remark:s}' is not read", number, shorten(remark)))


def _with_order_of_dates(text: Text, layout: Layout, chosen: Sequence[Column], notes: list[str]) -> Layout:
    """Return a layout that knows whether months come first in dates with slashes; if no value tells, with a note.

    Where no number is above 12, the order in which the file lasts less is taken: a record of a top passes midnight.
    """
    column = next((column for column in chosen if column.name == "time_s"), None)
    if column is None or not any("/" in "".join(row[column.index : column.index + 1]) for row in layout.sample):
        return layout
    dates = {found for _, line in _lines(text, layout) if (found := slashed_date(_time_in(layout, chosen, line)))}
    months_first = replace(layout, dialect=replace(layout.dialect, month_first=True))
    if any(first > 12 for first, _, _ in dates):
        return layout
    if any(second > 12 for _, second, _ in dates):
        return months_first
    if len(dates) < 2:
        return layout
    days = [(date(y, b, a).toordinal(), date(y, a, b).toordinal()) for a, b, y in dates]
    by_day, by_month = (max(order) - min(order) for order in zip(*days, strict=True))
    name = "month/day" if by_month < by_day else "day/month"
    said = "its dates are taken for {order}/year, in which it lasts less: write 2026-12-31 if they are not"
    notes.append(Note("dates", Said(said, name)))
    return months_first if by_month < by_day else layout


def _time_in(layout: Layout, chosen: Sequence[Column], line: str) -> str:
    """Return the text for the time in a row, empty where it is missed."""
    fields = dict(enumerate(layout.dialect.split(line)))
    found = next((fields.get(column.index, "") for column in chosen if column.name == "time_s"), "")
    return "" if found.casefold() in MISSING else found


_DAY_S, _HOUR_S = 86400, 3600


def _clocks(
    times: "NDArray[np.float64]", column: Column, first: str, notes: list[str], *, cells: bool
) -> "NDArray[np.float64]":
    """Count dates and the time of a day from the first one on, beyond midnight; a stopwatch's times as they are.

    Args:
        times: shape (n,), NaN where one is missed [units of the column].
        column: that of the times.
        first: text of the first one.
        notes: get the one on a stopwatch's times.
        cells: whether they are of a spreadsheet, which takes a stopwatch's 0:10 for hours and minutes.
    """
    there = np.isfinite(times)
    if is_dated(first):
        return np.asarray(times - times[there][0])
    day = _DAY_S / column.factor
    read = times[there]
    if cells and first.count(":") == 2 and read[0] == 0 and read[-1] >= _HOUR_S and (read % 60 == 0).all():
        notes.append(
            Note("stopwatch", "the times, as 0:10:00, are taken for minutes and seconds, as a stopwatch shows 0:10")
        )
        return times / 60
    if CLOCK.fullmatch(first) and float(times[there].max()) < day:
        steps = np.diff(read, prepend=read[0])
        noon = (steps > -day / 2) & (steps < -day * 11 / 24)  # 12:59 and 1:00, of a clock with 12 hours
        times[there] += day * np.cumsum((steps <= -day / 2) + noon / 2)
        return np.asarray(times - read[0] * (read[0] >= _HOUR_S / column.factor))
    return times


#: A time that may be hours and minutes, or minutes and seconds.
_TWO_PARTS = re.compile(r"(\d{1,2}):\d\d")


def _doubts_about(
    first: str, layout: Layout, chosen: Sequence[Column], numbers: "Sequence[NDArray[np.float64]]"
) -> Iterator[str]:
    """Yield the doubt about times of two parts: a stopwatch begins at 0:00 or so, hours and minutes of a clock do not.

    Args:
        first: text of the first time.
        layout: of the table.
        chosen: its columns.
        numbers: of each column, shape (n,) [its unit].
    """
    found = _TWO_PARTS.fullmatch(first)
    k = next((k for k, column in enumerate(chosen) if column.name == "time_s"), 0)
    if not found or chosen[k].unit not in {"", "s"}:
        return
    hours, begins_at_0 = bool(are_hours(chosen[k].label, "")), not int(found[1])
    if hours != begins_at_0 or (not hours and float(np.nanmax(numbers[k])) >= _DAY_S / 60):
        return
    keys = {name: key for key, name in SHORTHANDS.items()}
    others = [one for one in chosen if not (layout.header or one.behind or one is chosen[k])]
    also = "".join(f",{keys.get(one.name, one.name)}={one.index + 1} [{one.unit}]" for one in others)
    says = [f"t={chosen[k].index + 1} [{unit}]{also}" for unit in ("hh:mm", "mm:ss")]
    kinds = Said("hours and minutes"), Said("minutes and seconds")
    said = (
        'the times, as {t:s}, are taken for {taken} and may be {other}: say which, `columns` = "{hours:s}" or '
        '"{minutes:s}"'
    )
    yield Note("clock", Said(said, first, *(kinds if hours else kinds[::-1]), *says), weight="doubt")


def _row(path: Path, layout: Layout, chosen: Sequence[Column], line: int, text: str) -> list[float]:
    """Return the numbers of one row, NaN where a reading is missed."""
    fields = layout.dialect.split(text)
    if not layout.aligned and (len(fields) < layout.width or any(map(_NUMBER_IN.search, fields[layout.width :]))):
        hint = Said("; if the comma is a decimal mark, separate by ; or tab") if layout.dialect.separator == "," else ""
        begins_with_words = not _NUMBER_IN.search(next(filter(None, fields), ""))
        said = Said(FIELDS, shorten(text.strip()), how_many(len(fields), "field"), layout.width, hint)
        raise (_Words if begins_with_words else TableError)(path, said, line=line)
    fields += [""] * (layout.width - len(fields))
    try:
        return [_number(path, layout, column, line, fields[column.index]) for column in chosen]
    except _Words:
        for column, cell in ((column, fields[column.index]) for column in chosen if column.unit and not column.inverse):
            unit = unit_factor(cell if is_unit(cell) else read_title(cell).unit or "", dimension(column.name))
            if unit not in {None, column.factor}:
                raise TableError(path, _other_unit(column, cell), line=line) from None
        raise


def _row_or_none(path: Path, layout: Layout, chosen: Sequence[Column], line: int, text: str) -> list[float] | None:
    try:
        return _row(path, layout, chosen, line, text)
    except TableError:
        return None


def _text_and_scale(layout: Layout, column: Column, cell: str) -> tuple[str, float]:
    """Return the text of a column's number in a cell, empty where it has none, and the factor of that number."""
    combined = value_and_u(cell)
    if combined is None:
        return "" if column.behind else cell, 1.0
    if column.behind and combined[1].endswith("%"):
        return combined[1][:-1].strip(), abs(layout.dialect.value(combined[0])) / 100
    return combined[column.behind], 1.0


def _number(path: Path, layout: Layout, column: Column, line: int, cell: str) -> float:
    text, scale = _text_and_scale(layout, column, cell)
    try:
        return scale * layout.dialect.number(text)
    except ValueError:
        if text.casefold() in MISSING:
            return float("nan")
    if unit_behind(text):
        return _number_with_unit(path, layout, column, line, cell)
    if column.name == "time_s":
        with contextlib.suppress(ValueError):
            minutes = _TWO_PARTS.fullmatch(text) and are_hours(column.label, column.unit)
            return clock_time(f"{text}:00" if minutes else text, month_first=layout.dialect.month_first) / column.factor
    if text == UNVALUED:
        what = "column '{label:s}' holds a formula without its value: open the file in Excel or LibreOffice, save it"
        raise TableError(path, what, shorten(column.label), line=line)
    no_number = "'{cell:s}' stands in column '{column:s}', {expected} is expected: {do}"
    usual = "correct it, or leave it empty if the reading was missed"
    if column.name == "time_s":
        usual = "write times as 62.5, 1:02.5, 14:05:12 or 2026-11-23 14:05:12"
    do = next((advice for seen, advice in _ADVICE.items() if re.match(seen, cell)), usual)
    expected = EXPECTED[layout.dialect.decimal]
    said = Said(no_number, cell=shorten(cell), column=shorten(column.label), expected=expected, do=do)
    raise (TableError if _NUMBER_IN.search(cell) and cell[0] != "#" else _Words)(path, said, line=line)


#: What to do about a cell that is no number, by how it looks.
_ADVICE = {
    ".*±": "write what stands behind the ± into a column of its own, with the title u",
    r"\d{4}-\d\d-\d\d": "a spreadsheet takes 30.1 for a date: format the column as text, and type the numbers again",
}


def _other_unit(column: Column, cell: str) -> Said:
    other = "'{cell:s}' stands in column '{column:s}', which is in {unit:s}: write one unit in all rows"
    return Said(other, cell=shorten(cell), column=shorten(column.label), unit=column.unit)


def _number_with_unit(path: Path, layout: Layout, column: Column, line: int, cell: str) -> float:
    """Return the number before a unit.  Raises TableError where the unit is not that of the column."""
    text, _ = _text_and_scale(layout, column, cell)
    unit = unit_behind(text)
    kind = "time" if column.inverse else dimension(column.name)
    factors = unit_factor(unit, kind), unit_factor(column.unit, kind)
    scale = factors[0] / factors[1] if column.behind and factors[0] and factors[1] else 1.0  # 40 Hz ± 30 mHz
    if factors[0] != factors[1] and scale == 1:
        raise TableError(path, _other_unit(column, cell), line=line)
    try:
        return scale * layout.dialect.number(text[: -len(unit)].strip())
    except ValueError:
        other = "'{cell:s}' has the other decimal mark, {expected} is expected: correct it"
        raise TableError(path, other, shorten(cell), EXPECTED[layout.dialect.decimal], line=line) from None


def left_out(line: int, text: str, why: str) -> str:
    """Return the note on a line that is left out."""
    return Note(why, Said("line {line}: '{text:s}' {why} and is left out", line, shorten(" ".join(text.split())), why))
