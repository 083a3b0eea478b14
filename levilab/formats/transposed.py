"""Tables that lie on their side, a row for each quantity, a column for each reading; and tables below one another."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from levilab.formats.columns import TableError
from levilab.formats.dialect import DIALECTS, Dialect, Line, content_lines
from levilab.formats.layout import ALIGNED, HEAD, Layout, encoding_of, lines_of
from levilab.formats.texts import Text
from levilab.formats.titles import is_unit, read_title

#: What to know of a table that was turned.
LIES = "the table lies on its side, a row for each quantity: line 5 in a message is its column 5"
#: Part of the readings that may be doubted, as 35.8?, so that the message about them can say where they stand.
_MOST_TEXTS = 0.2
#: Rows at most, and readings at least: a table that stands has fewer columns than rows.
_MOST_ROWS, _FEWEST_READINGS = 6, 5


def set_upright(text: Text) -> Text:
    """Return a table that lies on its side as one that stands, whose n-th line is the n-th column; any other as it is.

    Raises OSError.
    """
    if text.size >= HEAD:
        return text
    with text.open() as stream:
        content = stream.read()
    try:
        lines = lines_of(text.path, content, encoding_of(content), whole=True)
    except TableError:
        return text
    if sum(bool(line.strip()) for line in lines) > 2 * _MOST_ROWS:
        return text
    for dialect in (ALIGNED,) if text.aligned else DIALECTS:
        rows = [line for line in content_lines(lines, dialect) if line.filled_count > 1]
        if _lies(rows, dialect):
            width = max(line.filled_count for line in rows)
            columns = zip(*((line.fields + ("",) * width)[:width] for line in rows), strict=True)
            upright = "".join("\t".join(column) + "\n" for column in columns)
            return replace(text, content=upright.encode(), lies=True)
    return text


def tables_of(text: Text, layout: Layout) -> list[Text]:
    """Return the tables of a text whose titles stand again, below no row or above earlier times; of others the text.

    Raises OSError.
    """
    if text.size >= HEAD or not layout.header_line:
        return [text]
    with text.open() as stream:
        lines = lines_of(text.path, stream.read(), layout.encoding, whole=True)
    titles = [k for k, line in enumerate(lines) if line.strip() == lines[layout.header_line - 1].strip()]
    if len(titles) < 2 or titles[0] != layout.header_line - 1:
        return [text]
    names, starts = [], []
    for k in titles:
        above = [field for field in layout.dialect.split(lines[k - 1]) if field and k]
        named = len(above) == 1 or "number" not in map(layout.dialect.kind, above)
        if named or k == titles[0] or _times(lines[k - 1 : k], layout) >= _times(lines[k + 1 : k + 3], layout) > []:
            names.append(" ".join(above).replace("/", "-") if named else "")
            starts.append(k - bool(names[-1]))
    parts = ["\n" * a + "".join(lines[a:b]) for a, b in pairwise([*starts, len(lines)])]
    names = [name if name and names.count(name) == 1 else f"{name or 'table'} {n}" for n, name in enumerate(names, 1)]
    return [replace(text, path=text.path / name, content=one.encode()) for name, one in zip(names, parts, strict=True)]


def _times(lines: Sequence[str], layout: Layout) -> list[float]:
    place = next((k for k, title in enumerate(layout.header) if read_title(title).column == "time_s"), 0)
    fields = [field for line in lines for field in layout.dialect.split(line)[place : place + 1]]
    return [layout.dialect.value(field) for field in fields if layout.dialect.kind(field) == "number"]


def _lies(rows: Sequence[Line], dialect: Dialect) -> bool:
    """Return whether rows begin with titles, one of them that of a time, or with times, and go on with numbers."""
    if not 2 <= len(rows) <= _MOST_ROWS or min(line.filled_count for line in rows) <= _FEWEST_READINGS:
        return False
    titles = [line.fields[0] for line in rows]
    if all(line.kinds[0] == "text" for line in rows):
        first = 2 if all(is_unit(line.fields[1]) for line in rows) else 1
        known = any(read_title(title).column == "time_s" for title in titles)
    else:
        first, times = 0, [dialect.value(field) for field in rows[0].fields if dialect.kind(field) == "number"]
        known = len(rows) == 2 and all(before < after for before, after in pairwise(times))
    kinds = [kind for line in rows for kind in line.kinds[first : line.filled_count]]
    return known and kinds.count("text") <= _MOST_TEXTS * len(kinds)
