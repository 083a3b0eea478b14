"""The numbers in the rows of a text file, piece by piece: by pandas where every line is plain, else line by line."""

import io
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.arrays import Array
from levilab.formats.columns import TableError, shorten
from levilab.formats.dialect import MISSING, OFF_RANGE, Dialect
from levilab.formats.layout import EXPORT, HEAD, encoding_of, lines_of, refuse_other_kinds
from levilab.formats.rows import EXPECTED, FIELDS, left_out
from levilab.formats.texts import Text
from levilab.formats.waveforms.waveform import HIGHEST
from levilab.texts.text import how_many

#: Characters of a piece: small beside memory, large beside the cost of a call of pandas.
PIECE = 1 << 20
#: No line of a table is longer.
LONGEST_LINE = 1 << 16


@dataclass(frozen=True)
class Head:
    """The first lines of a text file.

    Attributes:
        encoding: of all of it.
        lines: the whole ones.
        text: all of it.
    """

    path: Path
    encoding: str
    lines: tuple[str, ...]
    text: Text


def read_head(path: Path, text: Text) -> Head:
    """Return the first 64 KiB of a text at a path as lines.

    Raises:
        NoTable: it is no text, or empty.
        OSError: it cannot be read.
    """
    with text.open() as stream:
        head = stream.read(HEAD)
        whole = not stream.read(1)
    refuse_other_kinds(path, head)
    encoding = encoding_of(head)
    lines = lines_of(path, head, encoding, whole=whole, padding="\0")  # some oscilloscopes pad a file with NULs
    return Head(path, encoding, tuple(lines), text)


def pieces(source: Text, encoding: str, first_line: int) -> Iterator[tuple[int, str, bool]]:
    """Yield whole lines of a text from a line on, about a million characters at a time.

    Yields:
        The 1-based number of the first line, the lines, and whether these are the last ones; only there the last line
        may lack its end.

    Raises:
        TableError: a line has no end.
    """
    number, rest = 1, ""
    with io.TextIOWrapper(source.open(), encoding=encoding, errors="replace", newline=None) as stream:
        text = stream.read(PIECE)
        while text:
            following = stream.read(PIECE)
            rest += text.replace("\0", "")
            end = rest.rfind("\n") + 1 if following else len(rest)
            if end == 0 and len(rest) > LONGEST_LINE:
                what = "has a line of more than {most} characters; {export}"
                raise TableError(source.path, what, LONGEST_LINE, EXPORT, line=number)
            ready, rest, text = rest[:end], rest[end:], following
            lines = ready.count("\n")
            for _ in range(min(max(first_line - number, 0), lines)):
                ready = ready[ready.index("\n") + 1 :]
            yield max(number, min(first_line, number + lines)), ready, not following
            number += lines


#: Rows at the beginning and at the end of a piece whose fields are kept as text.
ENDS = 40


@dataclass(frozen=True, eq=False)
class Block:
    """Rows in order.

    Attributes:
        numbers: shape (rows, columns that are used), infinite where a sample is beyond the range of its input.
        line: 1-based line that the piece begins with; text: the piece.
        torn: a last line that was cut off and is left out, if there is one.
    """

    numbers: Array
    line: int
    text: str
    torn: str | None = None

    def line_of(self, row: int, dialect: Dialect) -> int:
        """Return the line of a row."""
        rows = (n for n, line in enumerate(self.text.split("\n"), self.line) if not dialect.skips(line))
        return next(n for k, n in enumerate(rows) if k == row)

    def fields(self, column: int, dialect: Dialect) -> list[str]:
        """Return the texts of a column in the first and the last rows."""
        lines = [line for line in self.text.split("\n") if not dialect.skips(line)]
        split = [dialect.split(line) for line in (*lines[:ENDS], *lines[-ENDS:])]
        return [fields[column] for fields in split if column < len(fields)]


def read_blocks(head: Head, dialect: Dialect, first_line: int, used: Sequence[int]) -> Iterator[Block]:
    """Yield the numbers of some columns, in memory that does not grow with the file.

    Raises:
        TableError: a line is damaged, or a sample is missing.
        OSError: the file cannot be read.
    """
    for line, text, last in pieces(head.text, head.encoding, first_line):
        numbers = _at_once(text, dialect, used)
        if numbers is None:
            yield _line_by_line(head.path, text, line, dialect, used, last=last)
        else:
            yield Block(numbers, line, text)


def _at_once(text: str, dialect: Dialect, used: Sequence[int]) -> Array | None:
    """Read all rows by pandas; None where a line is not plain."""
    import pandas as pd

    if not text.strip():
        return np.zeros((0, len(used)))
    if any(mark in text for mark in dialect.comments):
        return None
    try:
        with warnings.catch_warnings(action="ignore"):
            frame = pd.read_csv(
                io.StringIO(text), sep=dialect.separator or r"\s+", decimal=dialect.decimal, header=None,
                names=list(range(max(used) + 1)), usecols=sorted(set(used)), dtype="float64", index_col=False,
                skipinitialspace=True, keep_default_na=False,
            )  # fmt: skip
    except ValueError:
        return None
    numbers: Array = frame[list(used)].to_numpy(dtype=np.float64)
    return numbers if bool((np.abs(numbers) < HIGHEST).all()) else None


def _line_by_line(path: Path, text: str, first: int, dialect: Dialect, used: Sequence[int], *, last: bool) -> Block:
    rows, torn = [], None
    lines = text.split("\n")
    while last and lines and not lines[-1].strip(f"{dialect.separator or ''} \t"):  # programs end with empty rows
        lines.pop()
    for number, line in enumerate(lines, first):
        if dialect.skips(line):
            continue
        try:
            rows.append(_row(path, line, number, dialect, used))
        except TableError:
            if not (last and number == first + len(lines) - 1):
                raise
            torn = left_out(number, line, "was cut off")
    return Block(np.array(rows, dtype=np.float64).reshape(len(rows), len(used)), first, text, torn)


def _row(path: Path, text: str, line: int, dialect: Dialect, used: Sequence[int]) -> list[float]:
    fields = dialect.split(text)
    if max(used) >= len(fields):
        seen, number = shorten(text.strip()), how_many(len(fields), "field")
        raise TableError(path, FIELDS, seen, number, max(used) + 1, "", line=line)
    return [_number(path, fields[index], line, dialect) for index in used]


def _number(path: Path, text: str, line: int, dialect: Dialect) -> float:
    missing = text.casefold() in MISSING
    try:
        value = float("nan") if missing else dialect.number(text)
    except ValueError:
        what = "'{cell:s}' stands where {expected} is expected: correct it, or remove the line"
        raise TableError(path, what, shorten(text), EXPECTED[dialect.decimal], line=line) from None
    if not (abs(value) < HIGHEST or OFF_RANGE in text):
        what = "'{cell:s}' is a missing sample, but samples are evenly spaced: export again, or cut the file there"
        raise TableError(path, what, shorten(text), line=line)
    return value
