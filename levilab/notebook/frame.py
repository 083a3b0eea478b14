"""A DataFrame as the data file that analyses read: titles, units and checks are the same for both."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from levilab.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd


def write_frame(frame: pd.DataFrame, path: Path) -> None:
    """Write a DataFrame as CSV, every number to its last bit; an index with names becomes columns.

    Columns that are numbered, as those of a bare array, are written without titles: a row of numbers would pass for a
    reading.

    Args:
        frame: titles as in data files.
        path: of the file.

    Raises:
        UsageError: it has no column.
    """
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    if not len(frame.columns):
        raise UsageError("data", "columns as time_s and spin_frequency_hz are expected", value="a DataFrame with none")
    numbered = has_numbers_for_titles(frame)
    titles = [" ".join(str(title).split()) for title in frame.columns]
    frame.to_csv(path, index=False, header=False if numbered else titles, encoding="utf-8", lineterminator="\n")


def is_frame(data: Any) -> bool:
    """Return whether data are a DataFrame: pandas need not be loaded to know."""
    return hasattr(data, "to_csv") and hasattr(data, "columns")


def has_numbers_for_titles(frame: pd.DataFrame) -> bool:
    """Return whether the columns are numbered."""
    return all(isinstance(title, int) for title in frame.columns)


def in_rows(text: str, folder: Path, *, titles: int) -> str:
    r"""Translate a message about such a file for a DataFrame: rows, counted from 0, and no folder.

    Args:
        text: of the message.
        folder: that holds the file.
        titles: lines of titles in it, 0 or 1.

    >>> from pathlib import Path
    >>> in_rows("folder/DataFrame.csv, line 5: the time 3 s is repeated", Path("folder"), titles=1)
    'DataFrame.csv, row 3: the time 3 s is repeated'
    >>> in_rows("folder/DataFrame.csv, line 1: no title is known", Path("folder"), titles=1)
    'DataFrame.csv: no title is known'
    """
    for separator in ("/", "\\"):
        text = text.replace(f"{folder}{separator}", "")
    if titles:
        text = re.sub(r", line 1\b", "", text)

    def as_row(line: re.Match[str]) -> str:
        return str(int(line[0]) - 1 - titles)

    return re.sub(r"\bline(s? \d+(?:, \d+)*)", lambda lines: "row" + re.sub(r"\d+", as_row, lines[1]), text)
