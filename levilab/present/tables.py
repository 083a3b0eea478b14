"""A table as data: the terminal and the report draw the same one, each in its way."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One row.

    Attributes:
        cells: text, of several lines perhaps.
        kind: "best", "outlier", "together" (below a line), or none.
    """

    cells: tuple[str, ...]
    kind: str = ""


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        heads: of the columns.
        numbers: which columns are aligned to the right.
    """

    title: str
    heads: tuple[str, ...]
    rows: tuple[Row, ...]
    numbers: frozenset[int] = frozenset()


def table(
    title: str, heads: Sequence[str], rows: Iterable[Row | Sequence[str]], *, numbers: Iterable[str] = ()
) -> Table:
    """Return a table from rows of cells.

    Args:
        title: above it, empty for none.
        heads: of its columns.
        rows: of cells.
        numbers: heads of the columns that are aligned to the right.

    >>> table("", ["law", "rms"], [("disc", "0.03")], numbers=["rms"]).numbers
    frozenset({1})
    """
    made = tuple(row if isinstance(row, Row) else Row(tuple(row)) for row in rows)
    right = set(numbers)
    return Table(title, tuple(heads), made, frozenset(k for k, head in enumerate(heads) if head in right))
