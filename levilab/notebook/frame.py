"""A DataFrame as the data file that analyses read: titles, units and checks are the same for both."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd


#: Analysis → names of one, two or three arrays that are given without names; "": no analysis was chosen.
ARRAYS: dict[str, tuple[str, ...]] = {
    "": ("time_s", "spin_frequency_hz", "spin_frequency_u_hz"),
    "spin": ("time_s", "light_v"),
    "field": ("height_m", "flux_density_t", "flux_density_u_t"),
    "limit": ("spin_frequency_hz", "spin_frequency_u_hz"),
    "precession": ("drive_frequency_hz", "precession_frequency_hz", "precession_frequency_u_hz"),
}


def are_arrays(data: Any) -> bool:
    """Return whether data are numbers: an array or a list of numbers, or several of them."""
    if hasattr(data, "dtype") and not is_frame(data):
        return True
    items = list(data) if isinstance(data, list | tuple) else []
    return bool(items) and all(
        hasattr(item, "dtype") or _is_number(item) or (isinstance(item, list | tuple) and item and _is_number(item[0]))
        for item in items
    )


def _is_number(item: Any) -> bool:
    return isinstance(item, int | float)


def frame_of_arrays(data: Any, kind: str | None) -> pd.DataFrame:
    """Return arrays as a DataFrame with the columns of data files.

    Args:
        data: one array or list, shape (n,) or (n, columns); or several of one length, as (t, f) or (t, f, u): see
            `ARRAYS`.
        kind: of the analysis, which decides what they are.

    Raises:
        UsageError: their number or their lengths are wrong.
    """
    import pandas as pd

    names = ARRAYS.get(kind or "", ARRAYS[""])
    if not hasattr(data, "dtype") and all(np.ndim(item) == 0 for item in data):
        data = np.asarray(data)  # numbers alone
    if hasattr(data, "dtype"):
        data = [data] if data.ndim == 1 else data.T  # an array of two dimensions has a row a reading
    columns = [np.asarray(item) for item in data]
    if len(columns) > len(names) or (len(columns) < 2 and names[0] == "time_s"):
        expected = f"arrays of {', '.join(names[:2])}, in this order, are expected; or a DataFrame"
        raise UsageError("data", expected, value=f"{len(columns)} array{'s' * (len(columns) > 1)}")
    if {one.ndim for one in columns} != {1} or len({len(one) for one in columns}) > 1:
        shapes = " and ".join(str(one.shape) for one in columns)
        raise UsageError("data", "arrays of one length are expected", value=f"arrays of the shapes {shapes}")
    return pd.DataFrame(dict(zip(names, columns, strict=False)))


def frame_of(data: Any, kind: str | None) -> Any:
    """Return arrays, or a dictionary of columns, as a DataFrame, and all else as it is.  Raises UsageError."""
    if isinstance(data, Mapping):
        return _frame_of_mapping(data)
    return frame_of_arrays(data, kind) if are_arrays(data) else data


def _frame_of_mapping(data: Mapping[Any, Any]) -> pd.DataFrame:
    import pandas as pd

    try:
        return pd.DataFrame(data)
    except ValueError as error:
        expected = "columns of one length are expected, as {'time_s': […], 'spin_frequency_hz': […]}"
        given = f"a dictionary with {', '.join(map(str, data))}"
        raise UsageError("data", f"{expected} ({error})", value=given) from None


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
        raise UsageError("data", "columns as time_s and spin_frequency_hz are expected", value="an empty table")
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
    r"""Translate a message about such a file for who gave a DataFrame or arrays: no file, and rows, counted from 0.

    Args:
        text: of the message.
        folder: that holds the file.
        titles: lines of titles in it, 0 or 1.

    >>> from pathlib import Path
    >>> in_rows("folder/DataFrame.csv, line 5: the time 3 s is repeated", Path("folder"), titles=1)
    'the data, row 3: the time 3 s is repeated'
    >>> in_rows("folder/DataFrame.csv, line 1: no title is known", Path("folder"), titles=1)
    'the data: no title is known'
    """
    for separator in ("/", "\\"):
        text = text.replace(f"{folder}{separator}", "")
    text = re.sub(r"\bDataFrame(\d*)\.csv\b", lambda name: f"DataFrame {name[1]}" if name[1] else "the data", text)
    if titles:
        text = re.sub(r", line 1\b", "", text)

    def as_row(line: re.Match[str]) -> str:
        return str(int(line[0]) - 1 - titles)

    return re.sub(r"\bline(s? \d+(?:, \d+)*)", lambda lines: "row" + re.sub(r"\d+", as_row, lines[1]), text)
