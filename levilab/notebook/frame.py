"""A DataFrame as the data file that analyses read: titles, units and checks are the same for both."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.errors import UsageError
from levilab.present.units import split

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


#: A spin of less than this is none [Hz]: a record of light was meant.
_LEAST_SPIN_HZ = 1e-3
#: From this number of tuples on they are readings, (time, frequency) each, and not arrays.
_FEWEST_PAIRS = 4


def frame_of(data: Any, kind: str | None) -> Any:
    """Return numbers in any form as a DataFrame, and all else (runs, paths, several DataFrames) as it is.

    Args:
        data: arrays, alone or in a tuple, also of `uncertainties`; a Series with its index in seconds; an object of
            xarray; a dictionary of columns; a list of (time, frequency).
        kind: of the analysis, which decides the columns; None: not chosen.

    Raises:
        UsageError: they are no numbers, or of unlike lengths.
    """
    names = ARRAYS.get(kind or "", ARRAYS[""])
    if isinstance(data, Mapping) and not hasattr(data, "coords"):
        return _frame_of_mapping(data)
    if hasattr(data, "coords") and hasattr(data, "to_dataframe"):
        return _frame_of_xarray(data, names)
    if hasattr(data, "to_frame") and not is_frame(data):
        return _frame_of_series(data, names)
    return frame_of_arrays(data, kind) if are_arrays(data) else data


def are_arrays(data: Any) -> bool:
    """Return whether data are numbers: an array or a list of numbers, or several of them."""
    if hasattr(data, "dtype") and not is_frame(data):
        return True
    items = list(data) if isinstance(data, list | tuple) else []
    return any(map(_is_array, items)) or (bool(items) and all(map(_is_number, items)))


def _is_array(item: Any) -> bool:
    return hasattr(item, "dtype") or (isinstance(item, list | tuple) and bool(item) and _is_number(item[0]))


def _is_number(item: Any) -> bool:
    return isinstance(item, int | float) or hasattr(item, "nominal_value")


def kind_of(frame: Any, kind: str | None) -> str | None:
    """Return the analysis of numbers: limits alone say it themselves.

    Raises:
        UsageError: no analysis was chosen, and the frequencies cannot be any.
    """
    if kind is not None or not is_frame(frame) or not len(frame):
        return kind
    names = [*map(str, frame.columns)]
    if names == [*ARRAYS["limit"][: len(names)]]:
        return "limit"
    if names == [*ARRAYS[""][: len(names)]]:
        least, most = frame[names[1]].min(), frame[names[1]].max()
        if least < _LEAST_SPIN_HZ:
            expected = "spin frequencies above 0 Hz are expected; of a detector's light say so: kind='spin', or light=…"
            raise UsageError("data", expected, value=f"numbers from {least:.3g} to {most:.3g}")
    return kind


def frame_of_arrays(data: Any, kind: str | None) -> pd.DataFrame:
    """Return arrays as a DataFrame with the columns of data files.

    Args:
        data: one array or list, shape (n,) or (n, columns); several of one length, as (t, f) or (t, f, u), u a number,
            too: see `ARRAYS`; or a list of (t, f).
        kind: of the analysis, which decides what they are.

    Raises:
        UsageError: their number or their lengths are wrong, or they are no numbers.
    """
    import pandas as pd

    names = ARRAYS.get(kind or "", ARRAYS[""])
    alone = np.ndim(data) == 1 if hasattr(data, "dtype") else all(np.ndim(item) == 0 for item in data)
    are_many = isinstance(data, list) and len(data) >= _FEWEST_PAIRS
    are_rows = are_many and all(np.shape(item) in {(2,), (3,)} for item in data)
    if are_rows or alone:
        data = _as_array(data)  # a row a reading, or numbers alone
    if hasattr(data, "dtype"):
        data = [data] if data.ndim == 1 else data.T  # an array of two dimensions has a row a reading
    columns = [*map(_as_array, data)]
    long = [one for one in columns if one.ndim]
    columns = [one if one.ndim else np.full(len(long[0]), one) for one in columns]  # one u of all readings
    if {one.ndim for one in columns} != {1} or len({len(one) for one in columns}) > 1:
        shapes = " and ".join(str(one.shape) for one in columns)
        raise UsageError("data", "arrays of one length are expected", value=f"arrays of the shapes {shapes}")
    columns = _split_u(columns)
    if alone and kind is None:
        names = ARRAYS["limit"]
    elif len(columns) > len(names) or (len(columns) < 2 and names[0] == "time_s"):
        expected = f"arrays of {', '.join(names[:2])}, in this order, are expected; or a DataFrame"
        raise UsageError("data", expected, value=f"{len(columns)} array{'s' * (len(columns) > 1)}")
    return pd.DataFrame(dict(zip(names, columns, strict=False)))


def _as_array(item: Any) -> np.ndarray:
    """Return numbers, or numbers with u, as an array.  Raises UsageError."""
    array = np.asarray(item, dtype=object if _has_u(item) else None)
    if not array.size:
        raise UsageError("data", "at least 3 readings are expected", value="an empty array")
    if array.dtype.kind not in "iufbO" or (array.dtype == object and not _has_u(array)):
        raise UsageError("data", "numbers are expected", value=f"an array of {array.flat[0]!s}, …")
    return array


def _has_u(item: Any) -> bool:
    """Return whether an array, a list or a number has numbers of `uncertainties`."""
    while isinstance(item, list | tuple) or getattr(getattr(item, "dtype", None), "kind", "") == "O":
        if not len(item):
            return False
        item = item[-1]
    return hasattr(item, "nominal_value")


def _split_u(columns: list[np.ndarray]) -> list[np.ndarray]:
    """Return columns as numbers, the u of the last one that has it behind them."""
    if not any(column.dtype == object for column in columns):
        return columns
    plain = [np.array([getattr(one, "n", one) for one in column], dtype=float) for column in columns]
    if columns[-1].dtype != object:
        return plain
    return [*plain, np.array([getattr(one, "s", 0.0) for one in columns[-1]], dtype=float)]


def _frame_of_mapping(data: Mapping[Any, Any]) -> pd.DataFrame:
    import pandas as pd

    try:
        return pd.DataFrame(data)
    except ValueError as error:
        expected = "columns of one length are expected, as {'time_s': […], 'spin_frequency_hz': […]}"
        given = f"a dictionary with {', '.join(map(str, data))}"
        raise UsageError("data", f"{expected} ({error})", value=given) from None


def _frame_of_series(data: Any, names: tuple[str, ...]) -> pd.DataFrame:
    """Return a Series: its index [s], and its values; values alone where the index only counts."""
    if type(data.index).__name__ == "RangeIndex":
        return frame_of_arrays(data.to_numpy(), None if names == ARRAYS[""] else "limit")
    index = data.index - data.index[0] if data.index.dtype.kind == "M" else data.index
    seconds = index.total_seconds() if index.dtype.kind == "m" else index
    titles = data.index.name or names[0], data.name or names[1]
    return frame_of_arrays((seconds.to_numpy(), data.to_numpy()), "").set_axis([*titles], axis=1)


def _frame_of_xarray(data: Any, names: tuple[str, ...]) -> pd.DataFrame:
    """Return a DataArray or a Dataset of one dimension, its coordinate the first column, with the units it states."""
    if len(data.dims) != 1:
        raise UsageError("data", "one dimension is expected", value=f"an object of xarray over {', '.join(data.dims)}")
    (dimension,) = data.dims
    named = data.to_dataset(name=data.name or names[1]) if hasattr(data, "to_dataset") else data
    frame = named.to_dataframe().reset_index()
    titles = {}
    for name in frame.columns:
        units = named[name].attrs.get("units") if name in named.variables else None
        titles[name] = f"{name} [{units}]" if units and split(str(name))[1] is None else name
    renamed: pd.DataFrame = frame.rename(columns=titles)
    return renamed.drop(columns=[] if dimension in named.coords else [dimension])


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
