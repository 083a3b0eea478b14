"""A DataFrame as the data file that analyses read: titles, units and checks are the same for both."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.errors import UsageError
from levilab.formats.titles import read_title
from levilab.present.units import split
from levilab.texts.text import how_many

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd


#: What DataFrames are called, in messages and beside saved results.
FRAME = "DataFrame"
#: Analysis → names of one, two or three arrays that are given without names; "": no analysis was chosen.
ARRAYS: dict[str, tuple[str, ...]] = {
    "": ("time_s", "spin_frequency_hz", "spin_frequency_u_hz"),
    "spin": ("time_s", "light_v"),
    "field": ("height_m", "flux_density_t", "flux_density_u_t"),
    "limit": ("spin_frequency_hz", "spin_frequency_u_hz"),
    "precession": ("drive_frequency_hz", "precession_frequency_hz", "precession_frequency_u_hz"),
}


#: A reading of less than this is no spin [Hz], nor are readings that are all below the second: no top floats so slowly.
_LEAST_HZ, _SLOWEST_HZ = 1e-3, 1.0
#: Arrays that a table of numbers may have: times, readings and their u.
_MOST_COLUMNS = 3


def frame_of(data: Any, kind: str | None) -> Any:
    """Return numbers in any form as a DataFrame, and all else (runs, paths, several DataFrames) as it is.

    Args:
        data: arrays, alone or in a tuple, also of `uncertainties`; a Series or a DataFrame with its index in seconds or
            dates; an object of xarray; a dictionary of columns; a list of (time, frequency).
        kind: of the analysis, which decides the columns; None: not chosen.

    Raises:
        UsageError: they are no numbers, or of unlike lengths.
    """
    names = ARRAYS.get(kind or "", ARRAYS[""])
    if getattr(getattr(data, "dtype", None), "names", None):  # an array of records
        data = {name: data[name] for name in data.dtype.names}
    if isinstance(data, Mapping) and not hasattr(data, "coords"):
        return _frame_of_mapping(data)
    if hasattr(data, "coords") and hasattr(data, "to_dataframe"):
        return _frame_of_xarray(data, names)
    if is_frame(data):
        return _with_index(data, names)
    if hasattr(data, "to_frame"):
        return _frame_of_series(data, names)
    return frame_of_arrays(data, kind) if are_arrays(data) else data


def are_arrays(data: Any) -> bool:
    """Return whether data are numbers: an array or a list of numbers, or several of them."""
    if hasattr(data, "dtype") and not is_frame(data):
        return True
    items = list(data) if isinstance(data, list | tuple) else []
    return any(map(_is_array, items)) or (bool(items) and all(map(_is_number, items)))


def _is_array(item: Any) -> bool:
    return hasattr(item, "dtype") or (isinstance(item, list | tuple) and (not item or _is_number(item[0])))


def _is_number(item: Any) -> bool:
    return isinstance(item, int | float) or hasattr(item, "nominal_value")


def kind_of(frame: Any, kind: str | None) -> str | None:
    """Return the analysis of numbers: limits alone say it themselves.

    Raises:
        UsageError: no analysis was chosen, and the numbers cannot be times and frequencies.
    """
    if kind is not None or not is_frame(frame) or not len(frame):
        return kind
    names = [*map(str, frame.columns)]
    if names == [*ARRAYS["limit"][: len(names)]]:
        return "limit"
    if names == [*ARRAYS[""][: len(names)]]:
        _refuse_what_is_no_spin(*(frame[name] for name in names[:2]))
    return kind


def _refuse_what_is_no_spin(time: pd.Series[Any], spin: pd.Series[Any]) -> None:
    """Raise UsageError where times and frequencies seem to be exchanged, or other quantities."""
    seen = f"{{}} from {spin.min():.3g} to {spin.max():.3g}"
    if spin.is_monotonic_increasing and time.is_monotonic_decreasing and len(time) > 2:
        expected = "times come first, and rise: analyze((t, f)), or sort both by time, analyze((t[::-1], f[::-1]))"
        raise UsageError("data", expected, value=seen.format("a second array that rises"))
    if spin.min() >= _LEAST_HZ and spin.max() >= _SLOWEST_HZ:
        return
    of_turns = "times of a turn are inverted first, analyze((t, 1 / T)); " if spin.min() > 0 else ""
    others = "of other numbers say which: kind='spin', or light=…, kind='field' for (heights, flux densities)"
    expected = f"spin frequencies in Hz are expected; {of_turns}{others}"
    raise UsageError("data", expected, value=seen.format("numbers"))


def frame_of_arrays(data: Any, kind: str | None) -> pd.DataFrame:
    """Return arrays as a DataFrame with the columns of data files.

    Args:
        data: one array or list, shape (n,), (n, columns) or (columns, n); several of one length, as (t, f) or
            (t, f, u), u a number, too: see `ARRAYS`; or a list of (t, f).
        kind: of the analysis, which decides what they are.

    Raises:
        UsageError: their number or their lengths are wrong, or they are no numbers.
    """
    import pandas as pd

    names = ARRAYS.get(kind or "", ARRAYS[""])
    columns = [*map(_as_array, _split_columns(data))]
    alone = np.ndim(data) == 1 if hasattr(data, "dtype") else not any(map(np.ndim, data))
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
        raise UsageError("data", expected, value=how_many(len(columns), "array"))
    return pd.DataFrame(dict(zip(names, columns, strict=False)))


def _split_columns(data: Any) -> Any:
    """Return the columns of an array or a list: it may have a row a reading, too, or be one itself."""
    if not hasattr(data, "dtype"):
        shapes = {np.shape(item) for item in data}
        listed = isinstance(data, list) and shapes == {(2,)}
        pairs = len(data) > _MOST_COLUMNS or all(isinstance(item, tuple) for item in data) or listed
        if shapes != {()} and not (len(data) >= _MOST_COLUMNS and shapes <= {(2,), (3,)} and pairs):
            return data
        data = _as_array(data)
    if data.ndim != 2:
        return [data]
    return data if len(data) <= _MOST_COLUMNS < data.shape[1] else data.T


def _as_array(item: Any) -> np.ndarray:
    """Return numbers, or numbers with u, as an array, NaN where a mask of numpy leaves one out.  Raises UsageError."""
    if isinstance(item, np.ma.MaskedArray) and item.dtype.kind in "iufmM":
        dates = item.dtype.kind in "mM"
        item = np.ma.filled(item, item.dtype.type("NaT")) if dates else np.ma.filled(item.astype(float), np.nan)
    array = np.asarray(item, dtype=object if _has_u(item) else None)
    if array.dtype.kind in "mM" and array.size:  # dates, or spans of time
        array = (array - array.flat[0] if array.dtype.kind == "M" else array) / np.timedelta64(1, "s")
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
    except ValueError:
        expected = "columns of one length are expected, as {'time_s': […], 'spin_frequency_hz': […]}"
        given = f"a dictionary with {', '.join(map(str, data))}"
        raise UsageError("data", expected, value=given) from None


def _frame_of_series(data: Any, names: tuple[str, ...]) -> pd.DataFrame:
    """Return a Series: its index, and its values; values alone where the index only counts."""
    if type(data.index).__name__ == "RangeIndex" and data.index.name is None:
        return frame_of_arrays(data.to_numpy(), None if names == ARRAYS[""] else "limit")
    titles = data.index.name or names[0], data.name or names[1]
    return frame_of_arrays((data.index, data.to_numpy()), "").set_axis([*titles], axis=1)


def _with_index(frame: pd.DataFrame, names: tuple[str, ...]) -> pd.DataFrame:
    """Return a DataFrame whose index is a column: with a name, or where it alone can be the times; else it counts."""
    if any(name is not None for name in frame.index.names):
        return frame.reset_index()
    known = any(read_title(str(title)).column == names[0] for title in frame.columns)
    if known or frame.index.dtype.kind not in "mMf" or not len(frame):
        return frame
    return frame.assign(**{names[0]: _as_array(frame.index)})[[names[0], *frame.columns]]


def _frame_of_xarray(data: Any, names: tuple[str, ...]) -> pd.DataFrame:
    """Return a DataArray or a Dataset of one dimension, its coordinate the first column, with the units it states."""
    if len(data.dims) != 1:
        raise UsageError("data", "one dimension is expected", value=f"an object of xarray over {', '.join(data.dims)}")
    (dimension,) = data.dims
    if hasattr(data, "to_dataset"):
        bare = split(names[1])[0] if "units" in data.attrs else names[1]
        named = data.to_dataset(name=data.name or bare)
    else:
        named = data
    frame = named.to_dataframe().reset_index()
    titles = {}
    for name in frame.columns:
        units = named[name].attrs.get("units") if name in named.variables else None
        titles[name] = f"{name} [{units}]" if units and split(str(name))[1] is None else name
    renamed: pd.DataFrame = frame.rename(columns=titles)
    return renamed.drop(columns=[] if dimension in named.coords else [dimension])


def write_frame(frame: pd.DataFrame, path: Path) -> None:
    """Write a DataFrame as CSV, every number to its last bit.

    Columns that are numbered, as those of a bare array, are written without titles: a row of numbers would pass for a
    reading.

    Args:
        frame: titles as in data files.
        path: of the file.

    Raises:
        UsageError: it has no column.
    """
    if not len(frame.columns):
        raise UsageError("data", "columns as time_s and spin_frequency_hz are expected", value="an empty table")
    numbered = has_numbers_for_titles(frame)
    titles = [" ".join(str(title).split()) for title in frame.columns]
    frame.to_csv(path, index=False, header=False if numbered else titles, encoding="utf-8", lineterminator="\n")


def is_frame(data: Any) -> bool:
    """Return whether data are a DataFrame: pandas need not be loaded to know."""
    return hasattr(data, "reset_index") and hasattr(data, "columns")


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
    if FRAME not in text:
        return text
    for separator in ("/", "\\"):
        text = text.replace(f"{folder}{separator}", "")
    text = re.sub(rf"\b{FRAME}(\d*)\.csv\b", lambda name: f"{FRAME} {name[1]}" if name[1] else "the data", text)
    if titles:
        text = re.sub(r", line 1\b", "", text)

    def as_row(line: re.Match[str]) -> str:
        return str(int(line[0]) - 1 - titles)

    return re.sub(r"\bline(s? \d+(?:, \d+)*)", lambda lines: "row" + re.sub(r"\d+", as_row, lines[1]), text)
