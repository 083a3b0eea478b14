"""Where a text file keeps its table: encoding, header, row of units, first row; guessed from the first 64 KiB."""

import codecs
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from levilab.formats.columns import NoTable, TableError, shorten
from levilab.formats.dialect import (
    DIALECTS,
    SEPARATORS,
    Dialect,
    Line,
    content_lines,
    filled_count,
    find_dialect,
    most_common,
    unit_behind,
)
from levilab.formats.kinds import OTHER, kind_of_bytes
from levilab.formats.texts import Text
from levilab.formats.titles import UNITS, implied_unit, is_unit, known_titles, read_title, unit_factor

HEAD = 65536  # bytes that the guess rests upon
SAMPLE = 100  # lines, the last of the head: those are rows even below a long preamble

# UTF-32's mark begins with UTF-16's, so it goes first.
BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"), (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"), (codecs.BOM_UTF8, "utf-8-sig"),
)  # fmt: skip
ALIGNED = Dialect("\t", ".")  # of a text that was written from cells
CONTROL = re.compile("[\x00-\x08\x0e-\x19]")  # DOS may end a text with 0x1a
#: Part of the lines of a text that a starting micro-controller or a loose plug may have filled with other bytes.
_MOST_NOISE = 0.2
EXPORT = "a table of text is expected: export it as CSV"


@dataclass(frozen=True)
class Layout:
    """How one file's table is written.

    `header`, in line `header_line`, is empty if the file has none; `header_line` is then that of a text above the rows
    that may be titles and does not fit them, or 0. Rows may begin in line `first_line`, which lies `start` bytes into
    the file; lines count from 1. `width` is the number of fields a row must have. `above` are the fields of the line
    above the header; `aligned` is that of the text; `sample` are the fields of the first rows. Where no title has a
    unit, `units` are those behind the first numbers, and s for clocks.
    """

    encoding: str
    dialect: Dialect
    header: tuple[str, ...]
    header_line: int
    units: tuple[str, ...]
    first_line: int
    start: int
    width: int
    above: tuple[str, ...] = ()
    aligned: bool = False
    sample: tuple[tuple[str, ...], ...] = ()

    def titles(self) -> tuple[str, ...]:
        """Return the titles, or numbers in their place, each with the unit below it if it has none."""
        given, units = [], [*self.units, *[""] * self.width]
        for title, unit in zip(self.header or map(str, range(1, self.width + 1)), units, strict=False):
            own = "" if implied_unit(title) else read_title(title).unit
            given.append(f"{title} [{unit}]" if not is_unit(own or "") and (is_unit(unit) or unit == "%") else title)
        return tuple(given)

    @property
    def may_be_one_column(self) -> bool:
        """Whether times and spins without titles, as 20,1320, may be one column of numbers with a decimal comma."""
        two = not self.header and self.width == 2 and self.dialect == Dialect(",", ".")
        return two and not any("." in field for row in self.sample for field in row)

    def must_have_one_unit(self, path: Path, index: int) -> None:
        """Raise TableError for a column with another unit in its title than below it."""
        title, unit = "".join(self.header[index : index + 1]), "".join(self.units[index : index + 1])
        own = "" if implied_unit(title) else read_title(title).unit or ""
        if any(unit_factor(unit, kind) not in {None, unit_factor(own, kind) or 0} for kind in UNITS if is_unit(own)):
            what = "column '{title:s}' has the unit '{unit:s}' in the row beneath; correct one of them"
            raise TableError(path, what, shorten(title), shorten(unit))


def sniff(source: Text) -> Layout:
    """Guess how a text writes its table.

    Raises:
        NoTable: the file is empty or binary, or nothing in it looks like a table.
        OSError: the file cannot be read.
    """
    path = source.path
    with source.open() as stream:
        head = stream.read(HEAD)
        whole = not stream.read(1)
    refuse_other_kinds(path, head)
    encoding = encoding_of(head)
    lines = lines_of(path, head, encoding, whole=whole)
    dialect = ALIGNED if source.aligned else find_dialect(lines[-SAMPLE:], lines[:SAMPLE])
    if dialect is None and (words := _of_words(lines, encoding, head)):
        return words
    if dialect is None:
        at, line = next((n, line) for n, line in enumerate(lines, 1) if line.strip())
        alone = "; if it holds one quantity alone, its times are needed, too: a column of them before it"
        text = "'{seen:s}' begins no table of at least two columns; {export}{alone}"
        raise NoTable(path, text, shorten(line.strip()), EXPORT, alone, line=at)
    layout = lay_out(lines, encoding, dialect, head)
    if source.aligned and not layout.width:
        raise NoTable(path, "holds no rows of numbers")
    return _with_sample(source, layout, lines)


def _with_sample(source: Text, layout: Layout, lines: list[str]) -> Layout:
    """Return the layout with the first rows, and the titles and the units that they have."""
    if source.titles:
        layout = replace(layout, header=source.titles, header_line=0, units=(), first_line=1, start=0)
        layout = replace(layout, width=len(source.titles))
    sample = tuple(line.fields for line in content_lines(lines[layout.first_line - 1 :][:SAMPLE], layout.dialect))
    units = _with_units_of_numbers(layout, sample)
    return replace(layout, aligned=source.aligned, sample=sample, units=units)


def _with_units_of_numbers(layout: Layout, sample: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Return the units of the columns: where no title and no row below has one, that of the first number."""
    units = [*layout.units, *[""] * (layout.width - len(layout.units))]
    for k in range(layout.width):
        first = next((row[k] for row in sample if k < len(row) and layout.dialect.kind(row[k]) != "missing"), "")
        title = read_title("".join(layout.header[k : k + 1]))
        if not units[k] and not is_unit(title.unit or ""):
            clock = layout.dialect.kind(first) == "clock" and title.column is None
            units[k] = "s" if clock else unit_behind(first)
    return tuple(units) if any(units) else ()


def lines_of(path: Path, head: bytes, encoding: str, *, whole: bool, padding: str = "") -> list[str]:
    """Return the first lines of a text.

    Args:
        path: of the file.
        head: its first bytes.
        encoding: of the text.
        whole: whether these are all; else the last line is left out, which may be torn.
        padding: characters that are no part of the text.

    Raises:
        NoTable: it is no text, or empty.
    """
    text = codecs.getincrementaldecoder(encoding)(errors="replace").decode(head, final=whole)
    text = text.replace(padding, "") if padding else text
    lines = _joined(list(io.StringIO(text, newline=None)))
    if CONTROL.search(text):
        clean = ["\n" if CONTROL.search(line) else line for line in lines]
        if sum(one != line for one, line in zip(clean, lines, strict=True)) > _MOST_NOISE * len(lines):
            raise NoTable(path, "is a binary file; {export}", EXPORT)
        lines = clean
    if not whole and lines and not lines[-1].endswith("\n"):
        lines.pop()
    if not any(line.strip() for line in lines):
        seen = "is empty; {export}" if whole else "is one line without end; {export}"
        raise NoTable(path, seen, EXPORT)
    return lines


#: A quoted field that goes on in the next line, and the lines that it has at most.
_OPEN, _MOST_LINES = re.compile(r'(?:^|[;,\t])\s*"[^"]*$'), 6


def _joined(lines: list[str]) -> list[str]:
    """Return lines with each quoted title that has line ends in the last line of it, behind blank ones."""
    for k in (k for k, line in enumerate(lines[:SAMPLE]) if line.count('"') % 2):
        if _OPEN.search(re.sub(r'"[^"]*"', "", lines[k].rstrip("\n"))):
            for end in range(k + 1, min(k + _MOST_LINES, len(lines))):
                title = "".join(lines[k : end + 1])
                if title.count('"') % 2 == 0:
                    lines[k : end + 1] = [*["\n"] * (end - k), title.replace("\n", " ").rstrip() + "\n"]
                    break
    return lines


def refuse_other_kinds(path: Path, head: bytes) -> None:
    """Raise NoTable for a file that is no text by its first bytes, with what to do."""
    kind = kind_of_bytes(head)
    if kind is not OTHER:
        raise NoTable(path, "is {kind}: {advice}", kind.name, kind.advice, kind=kind)


def _of_words(lines: list[str], encoding: str, head: bytes) -> Layout | None:
    """Return the layout of a table below unknown titles, without two numbers in any row."""
    for separator in filter(None, SEPARATORS):
        dialect = Dialect(separator, ".")
        content = list(content_lines(lines[:SAMPLE], dialect))
        if len(content) < 2 or not content[0].is_text:
            continue
        first = content[0]
        if {line.filled_count for line in content} == {first.filled_count}:
            header = first.fields[: first.filled_count]
            start = _offset(head, first.number + 1)
            return Layout(encoding, dialect, header, first.number, (), first.number + 1, start, len(header))
    return None


def encoding_of(head: bytes) -> str:
    """Return the encoding by the mark at the beginning; else UTF-16 by its NULs, UTF-8, or Latin-1."""
    for mark, encoding in BYTE_ORDER_MARKS:
        if head.startswith(mark):
            return encoding
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        halves = head[first:200:2], head[1 - first : 200 : 2]
        if len(head) >= 4 and halves[0].count(0) > 0.9 * len(halves[0]) and 0 not in halves[1]:
            return encoding
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def lay_out(lines: list[str], encoding: str, dialect: Dialect, head: bytes) -> Layout:
    """Find the table in lines that were read.

    Args:
        lines: the first ones of the file.
        encoding: of the file.
        dialect: of the table.
        head: the lines' bytes, for the offset of the first row.
    """
    sample = content_lines(lines[-SAMPLE:], dialect, 1 + max(0, len(lines) - SAMPLE))
    rows = [line for line in sample if line.is_row]
    width = most_common(row.filled_count for row in rows)
    numeric = [i for i in range(width) if 2 * sum(r.kinds[i : i + 1] == ("text",) for r in rows) < len(rows)]
    above, first_line = _above_rows(content_lines(lines, dialect), width, numeric)
    above = [_without_results(line, width) for line in above]
    place = _header(above, width)
    units: tuple[str, ...] = ()
    named = runs = units
    if place is None:
        header, header_line = _header_in_comment(lines[: first_line - 1], dialect, width)
        header_line = header_line or _other_titles(lines[: first_line - 1], width)
        if above and not header_line and _may_be_one_column(rows, dialect, width):
            header_line = above[-1].number
    else:
        header, header_line = above[place].fields, above[place].number
        below = [*above[place + 1 :], *content_lines(lines[first_line - 1 : first_line], dialect, first_line)]
        units = next(filter(None, map(_units, below)), ()) or _units_above(above[:place])
        header, runs = _spread(_with_all_titles(header, lines[header_line - 1], dialect, rows, width), below)
        first_line = (below[0] if runs or (units and _units(below[0])) else above[place]).number + 1
        named = runs or (above[place - 1].fields if place and above[place - 1].is_text else ())
    fields = most_common(len(row.fields) for row in rows) or len(header)
    header = header[: min(filled_count(header), fields)]  # LabVIEW titles a column of comments that no row has
    start = _offset(head, first_line)
    return Layout(encoding, dialect, header, header_line, units, first_line, start, len(header) or width, named)


def _above_rows(lines: Iterator[Line], width: int, numeric: Sequence[int]) -> tuple[list[Line], int]:
    """Return the lines above the first that has numbers where later rows mostly have them, and that line's number."""
    above: list[Line] = []
    for line in lines:
        if line.is_row and len(line.fields) >= width and not any(line.kinds[i] == "text" for i in numeric):
            return above, line.number
        above.append(line)
    return above, above[-1].number + 1 if above else 1


def _header(above: list[Line], width: int) -> int | None:
    """Find the header among the lines above the rows: known titles count, then the width, then nearness.

    A row of units is not it, unless there is nothing else; sentences are not.
    """
    texts = [i for i, line in enumerate(above) if line.is_text and not _is_sentence(line.fields, width)]
    titles = [i for i in texts if not all(is_unit(field) for field in above[i].fields if field)] or texts
    known = {i: known_titles(above[i].fields) for i in titles}
    likely = [i for i in titles if known[i] or above[i].filled_count >= width]
    return max(likely, key=lambda i: (known[i] > 1, above[i].filled_count >= width, known[i], i), default=None)


#: A word before a comma, as blanks separate it, or before the end of a sentence.
_SENTENCE = re.compile(r"(?!N[ro]\.)\b\w{2,}(?:,\s|[.!?](?:\s+[^\W\d_a-z]|\s*$))")


def _is_sentence(fields: Sequence[str], width: int) -> bool:
    """Return whether fields are a sentence: more than two words a column, of which titles are fewer than half."""
    text, bare = " ".join(fields), [field.strip(",.;:") for field in fields]
    few = 2 * known_titles(bare) < filled_count(fields)
    return bool(_SENTENCE.search(text)) and len(text.split()) > 2 * width and few


def _without_results(line: Line, width: int) -> Line:
    """Return a line of titles without the numbers that stand beside the table, as a mean does in a spreadsheet."""
    own = Line(line.number, line.fields[:width], line.kinds[:width])
    return own if own.is_text and not line.is_text and not _is_sentence(line.fields, width) else line


def _with_all_titles(
    header: tuple[str, ...], text: str, dialect: Dialect, rows: Sequence[Line], width: int
) -> tuple[str, ...]:
    """Return titles with many blanks between them, and those of R, which writes none above the rows' numbers."""
    apart = tuple(re.split(r"\s{2,}", text.strip()))
    if dialect.separator is not None or len(header) == width:
        return header
    counts = [(before.fields[0], after.fields[0]) for before, after in pairwise(rows)]
    of_r = len(header) == width - 1 and all(a.isdigit() and b == str(int(a) + 1) for a, b in counts)
    return apart if len(apart) == width else ("", *header) if of_r else header


def _spread(header: tuple[str, ...], below: Sequence[Line]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return titles of which one stands over several columns, once over each, and the names of runs below it."""
    names = below[0].fields if below else ()
    within = [k for k in range(1, len(names)) if names[k] and not any(header[k : k + 1])]
    if not within or names[0] or not header[0]:
        return header, ()
    wide = [*header, *[""] * (len(names) - len(header))]
    for k in within:
        wide[k] = wide[k - 1]
    return tuple(wide), names


def _may_be_one_column(rows: Sequence[Line], dialect: Dialect, width: int) -> bool:
    """Return whether two columns, as 21,7, may be one with decimal commas: no number has a point."""
    return width == 2 and dialect.separator == "," and not any("." in "".join(row.fields) for row in rows)


def _other_titles(above: list[str], width: int) -> int:
    """Return the line of known titles, in any dialect, that do not fit the rows below; 0 without such a line."""
    fields = [(n, dialect.split(line)) for n, line in enumerate(above, 1) for dialect in DIALECTS if line.strip()]
    known = [(n, known_titles(titles), len(titles)) for n, titles in fields]
    return next((n for n, k, count in known if k == count or (count == width and k > 1)), 0)


def _units_above(above: Sequence[Line]) -> tuple[str, ...]:
    """Return the fields of a line above the header that says to hold units, as LabVIEW's Y_Unit_Label."""
    said = (line.fields for line in reversed(above) if "unit" in line.fields[0].casefold())
    return next((("", *fields[1:]) for fields in said if any(map(is_unit, fields[1:]))), ())


def _units(line: Line) -> tuple[str, ...]:
    """Return the fields of a line below the header, if it is a row of units."""
    if line.is_text:
        bare = (re.sub(r"^[\[(](.*)[\])]$", r"\1", field) for field in line.fields)
        fields = tuple(re.sub(r"^(in|en|i)\s+", "", field) for field in bare)
        if any(is_unit(field) for field in fields):
            return fields
    return ()


def _header_in_comment(above: list[str], dialect: Dialect, width: int) -> tuple[tuple[str, ...], int]:
    """Return the last comment above the rows and its line if it names the columns, as numpy.savetxt writes it."""
    for number in range(len(above), 0, -1):
        if above[number - 1].lstrip().startswith(dialect.comments):
            fields = tuple(dialect.split(above[number - 1].lstrip(" \t#%/;'".replace(dialect.separator or ";", ""))))
            return (fields, number) if known_titles(fields) and filled_count(fields) >= width else ((), 0)
    return (), 0


def _offset(head: bytes, line: int) -> int:
    """Return where a line begins [bytes]; right for encodings that write a line end as one byte."""
    ends = [end.end() for end in re.finditer(rb"\r\n|\r|\n", head)]
    return ends[line - 2] if 1 < line <= len(ends) + 1 else 0 if line == 1 else len(head)
