"""The beginning of a text file, and its lines in pieces: any encoding, any line ends, padded with NULs or not."""

from __future__ import annotations

import codecs
from dataclasses import dataclass
from typing import TYPE_CHECKING

from levilab.formats.columns import TableError
from levilab.formats.layout import BYTE_ORDER_MARKS, EXPORT, HEAD, lines_of, refuse_other_kinds

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

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
        whole: whether these are all.
    """

    path: Path
    encoding: str
    lines: tuple[str, ...]
    whole: bool


def read_head(path: Path) -> Head:
    """Return the first 64 KiB of a text file as lines.

    Raises:
        NoTable: it is no text, or empty.
        OSError: it cannot be read.
    """
    with path.open("rb") as stream:
        head = stream.read(HEAD)
        whole = not stream.read(1)
    refuse_other_kinds(path, head)
    encoding = _encoding(head)
    lines = lines_of(path, head, encoding, whole=whole, padding="\0")  # some oscilloscopes pad a file with NULs
    return Head(path, encoding, tuple(lines), whole)


def _encoding(head: bytes) -> str:
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


def pieces(path: Path, encoding: str, first_line: int) -> Iterator[tuple[int, str, bool]]:
    """Yield whole lines of a file from a line on, about a million characters at a time.

    Yields:
        The 1-based number of the first line, the lines, and whether these are the last ones; only there the last line
        may lack its end.

    Raises:
        TableError: a line has no end.
    """
    number, rest = 1, ""
    with path.open(encoding=encoding, errors="replace", newline=None) as stream:
        text = stream.read(PIECE)
        while text:
            following = stream.read(PIECE)
            rest += text.replace("\0", "")
            end = rest.rfind("\n") + 1 if following else len(rest)
            if end == 0 and len(rest) > LONGEST_LINE:
                raise TableError(path, f"has a line of more than {LONGEST_LINE} characters; {EXPORT}", line=number)
            ready, rest, text = rest[:end], rest[end:], following
            lines = ready.count("\n")
            for _ in range(min(max(first_line - number, 0), lines)):
                ready = ready[ready.index("\n") + 1 :]
            yield max(number, min(first_line, number + lines)), ready, not following
            number += lines
