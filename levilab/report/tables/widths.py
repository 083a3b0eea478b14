"""How wide a table is in LaTeX, and what makes it fit: units in heads, smaller letters, folded lines, several parts.

Widths are those of Computer Modern, in points of letters of ten; they need to be right to some per cent only, since a
page has more room than is asked for here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

from levilab.present.document.typesetting import typeset
from levilab.present.units import is_unit

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from levilab.present.tables import Table

#: Width of the text of the class article [pt]; A4 with margins of 1.5 cm has 512.
LINE = 345.0
#: A column of texts longer than this is a paragraph [characters] of so much of the line.
_LONG, PARAGRAPH = 48, 0.4
#: Space at both sides of a column [pt]: LaTeX's own, and that of a wide table.
_SEPARATION, SMALL_SEPARATION = 6.0, 3.0
#: Letters of \footnotesize beside those of ten points, raised ones beside those on the line, bold ones beside others.
_SMALL, _RAISED, _BOLD = 0.85, 0.72, 1.15
#: A column is folded to so much of its width at a time.
_STEP = 0.9
#: Letters of so many thousandths of ten points [Knuth, Computer Modern Typefaces]; others are wide signs.
_WIDTHS = {
    **dict.fromkeys("il.,;:'!|/[]", 278), **dict.fromkeys("fjt()-", 389), **dict.fromkeys("rs ", 394),
    **dict.fromkeys("acegovxyzkq0123456789", 510), **dict.fromkeys("bdhnpu", 556), **dict.fromkeys("mwMW", 833),
}  # fmt: skip
_WIDE = 740
#: A number, and what stands behind it.
_WITH_UNIT = re.compile(r"(?:< )?[−+-]?\d[\d.]*(?:\([\d.]+\))?(?:×10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)? (?P<behind>.+)")
#: A blank where a line may end: not between a number and its unit, beside a sign, behind "per", before a single letter
#: (but for "combined: u"), or in brackets; and behind a dash between words.
_BREAK = re.compile(
    r"(?<![\d⁰¹²³⁴⁵⁶⁷⁸⁹)<=±−])(?<!\bper) (?![=±−])(?:(?<=: )|(?![^\W\d_](?:\W|$)))(?![^\[]*\])"
    r"|(?<=[^\W\d_]–)(?=[^\W\d_])"
)
#: Where a line may end only if the table does not fit otherwise: also between a number and a unit that is a fraction.
_LAST_BREAK = re.compile(rf"{_BREAK.pattern}|(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹)]) (?=\()")
#: Heads are not folded to less than this [pt].
_LEAST = 50.0


@dataclass(frozen=True)
class Fitted:
    """A table as LaTeX sets it.

    Attributes:
        table: with units in heads where a column has one, and folded lines where it would be too wide.
        small: whether in smaller letters, with less space between the columns.
        paragraphs: columns whose texts LaTeX folds.
        parts: columns of the tables that stand below each other; one unless the table is too wide.
    """

    table: Table
    small: bool
    paragraphs: frozenset[int]
    parts: tuple[tuple[int, ...], ...]


def fit(table: Table) -> Fitted:
    """A table that fits into a line: as it is, or folded, or in parts that stand below each other.

    Only a column that is too wide by itself does not fit.
    """
    table = units_in_heads(table)
    columns = tuple(range(len(table.heads)))
    paragraphs = frozenset(k for k in columns if k not in table.numbers and _longest(table, k) > _LONG)
    if _width(table, columns, paragraphs) + 2 * _SEPARATION * len(columns) <= LINE:
        return Fitted(table, small=False, paragraphs=paragraphs, parts=(columns,))
    for breaks in (_BREAK, _LAST_BREAK):
        folded = _folded_to_fit(table, paragraphs, breaks)
        if _fits(folded, columns, paragraphs):
            return Fitted(folded, small=True, paragraphs=paragraphs, parts=(columns,))
    return Fitted(folded, small=True, paragraphs=paragraphs, parts=_parts(folded, paragraphs))


def _folded_to_fit(table: Table, paragraphs: frozenset[int], breaks: re.Pattern[str]) -> Table:
    """A table with its widest columns folded until it fits, or nothing can be folded any more."""
    columns = tuple(range(len(table.heads)))
    free = set(columns) - paragraphs
    limits: dict[int, float] = {}
    folded = _folded(table, limits, paragraphs, breaks)
    while free and not _fits(folded, columns, paragraphs):
        widest = max(sorted(free), key=lambda k: _column(folded, k))
        before = _column(folded, widest)
        tried = _folded(table, limits | {widest: _STEP * before}, paragraphs, breaks)
        if _column(tried, widest) < before:
            limits[widest], folded = _STEP * before, tried
        else:
            free.remove(widest)
    return folded


def _fits(table: Table, columns: Sequence[int], paragraphs: frozenset[int]) -> bool:
    """Whether columns fit into a line, in small letters."""
    return _width(table, columns, paragraphs, _SMALL) + 2 * SMALL_SEPARATION * len(columns) <= LINE


def _parts(table: Table, paragraphs: frozenset[int]) -> tuple[tuple[int, ...], ...]:
    """The columns in as few parts as fit, of about as many columns; each begins with the first one, if it is words."""
    first = () if 0 in table.numbers else (0,)
    others = range(len(first), len(table.heads))
    parts: tuple[tuple[int, ...], ...] = ((*first, *others),)
    for n in range(2, len(others) + 1):
        ends = [round(k * len(others) / n) for k in range(n + 1)]
        parts = tuple((*first, *others[low:high]) for low, high in pairwise(ends))
        if all(_fits(table, part, paragraphs) for part in parts):
            break
    return parts


def units_in_heads(table: Table) -> Table:
    r"""The table with the unit that all numbers of a column have in its head, once.

    >>> from levilab.present.tables import table
    >>> found = units_in_heads(table("", ["u"], [["0.96 mT"], ["1.2(3)×10⁻³ mT"], ["—"]], numbers=["u"]))
    >>> found.heads, [row.cells for row in found.rows]
    (('u\n[mT]',), [('0.96',), ('1.2(3)×10⁻³',), ('—',)])
    >>> units_in_heads(table("", ["a", "b"], [["0.10 ± 0.07", "3 of 5"]], numbers=["a", "b"])).heads
    ('a', 'b')
    """
    columns = [[row.cells[k] for row in table.rows] for k in range(len(table.heads))]
    heads = list(table.heads)
    for k in sorted(table.numbers):
        units = {_unit(cell) for cell in columns[k] if _counts(cell)}
        if len(units) == 1 and heads[k] and (unit := units.pop()):
            heads[k] = f"{heads[k]}\n[{unit}]"
            columns[k] = [cell.removesuffix(f" {unit}") for cell in columns[k]]
    rows = (replace(row, cells=tuple(column[i] for column in columns)) for i, row in enumerate(table.rows))
    return replace(table, heads=tuple(heads), rows=tuple(rows))


def _unit(cell: str) -> str:
    """The unit of the number of a cell; empty where something else stands behind it, or nothing.

    >>> _unit("0.87(2) mT cm per mm"), _unit("1.2 Hz (u not known)"), _unit("1.5 s ago")
    ('mT cm per mm', '', '')
    """
    found = _WITH_UNIT.fullmatch(cell)
    return found["behind"] if found and is_unit(found["behind"]) else ""


def _counts(cell: str) -> bool:
    """Whether a number stands in a cell."""
    return any(one.isdigit() for one in cell)


def _longest(table: Table, k: int) -> int:
    return max((len(line) for row in table.rows for line in row.cells[k].split("\n")), default=0)


def _folded(table: Table, limits: Mapping[int, float], paragraphs: frozenset[int], breaks: re.Pattern[str]) -> Table:
    """Columns folded to their limits [pt], and heads to the width of what stands below them."""

    def folded(cells: Sequence[str]) -> tuple[str, ...]:
        return tuple(_fold(cell, limits[k], breaks) if k in limits else cell for k, cell in enumerate(cells))

    rows = tuple(replace(row, cells=folded(row.cells)) for row in table.rows)
    found = replace(table, rows=rows)
    heads = (
        head if k in paragraphs else _fold(head, max(_of_cells(found, k) / _BOLD, _LEAST))
        for k, head in enumerate(table.heads)
    )
    return replace(found, heads=tuple(heads))


def _fold(cell: str, limit: float, breaks: re.Pattern[str] = _BREAK) -> str:
    r"""A cell whose lines are as wide as the limit, or as a word [pt].

    >>> _fold("clock of the readings", 60)
    'clock of the\nreadings'
    >>> _fold("ln ω against t", 58)
    'ln ω\nagainst t'
    >>> _fold("0.97(3) (rad/s)^−½/s per Hz", 10)
    '0.97(3) (rad/s)^−½/s\nper Hz'
    >>> _fold("0.97(3) (rad/s)^−½/s per Hz", 10, _LAST_BREAK), _fold("Durbin–Watson", 50)
    ('0.97(3)\n(rad/s)^−½/s\nper Hz', 'Durbin–\nWatson')
    """
    lines: list[str] = []
    for line in cell.split("\n"):
        begin, between = 0, ""
        for k, found in enumerate([*breaks.finditer(line), None]):
            piece = line[begin : found.start() if found else None]
            together = f"{lines[-1]}{between}{piece}" if k else piece
            if k and width(together) <= limit:
                lines[-1] = together
            else:
                lines.append(piece)
            if found:
                begin, between = found.end(), found[0]
    return "\n".join(lines)


def _width(table: Table, columns: Sequence[int], paragraphs: frozenset[int], size: float = 1.0) -> float:
    """Width of columns without the space between them [pt]; that of a paragraph is the same in small letters."""
    return sum(PARAGRAPH * LINE if k in paragraphs else size * _column(table, k) for k in columns)


def _column(table: Table, k: int) -> float:
    return max(_BOLD * _of_lines(table.heads[k]), _of_cells(table, k))


def _of_cells(table: Table, k: int) -> float:
    return max((_of_lines(row.cells[k]) for row in table.rows), default=0.0)


def _of_lines(cell: str) -> float:
    return max(map(width, cell.split("\n")))


@lru_cache(1 << 14)
def width(line: str) -> float:
    """Width of a line in letters of ten points [pt].

    >>> round(width("share of u²"))
    50
    """
    return sum(_of_letters(run.text) * (_RAISED if run.level else 1.0) for run in typeset(line))


def _of_letters(text: Sequence[str]) -> float:
    return sum(_WIDTHS.get(one, _WIDE) for one in text) / 100
