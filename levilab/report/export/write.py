"""What is exported is written, in the format that the file's name says."""

from __future__ import annotations

import io
import re
import zipfile
from dataclasses import dataclass, replace
from datetime import datetime
from importlib.util import find_spec
from itertools import chain, count
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from levilab.errors import LevilabError, UsageError, check_ending
from levilab.files import CannotWrite, check_writable, replace_atomically, writing
from levilab.report.export.contents import Column, Contents, Table, attributes_of, variables_of
from levilab.report.export.endings import ENDINGS
from levilab.runs.package import field, package, resource
from levilab.software import how_to_install

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from pathlib import Path

    import pandas as pd


class MissingH5py(LevilabError):
    """h5py is not installed."""


@dataclass(frozen=True)
class Format:
    """A format.

    Attributes:
        files: what is exported, and the file that was named → the files and their content.
        check: raises LevilabError if what it needs is not installed, before anything is analyzed.
    """

    files: Callable[[Contents, Path], Mapping[Path, bytes]]
    check: Callable[[], None] = lambda: None


def export(
    make: Callable[[], Contents], out: Path, *, creator: str = "", licence: str = "", force: bool = False
) -> list[Path]:
    """Write a run, a data file or a sweep in a format of other programs.

    Args:
        make: returns what is exported; called when the name is known to be right.
        out: the file; its ending chooses the format.
        creator: who measured; empty: the run's group.
        licence: under which others may use it, by SPDX.
        force: replace files that are there.

    Returns:
        The files.

    Raises:
        UsageError: the name has another ending.
        DataError: there is nothing to export.
        MissingH5py: HDF5, and the extra `hdf5` is not installed.
        CannotWrite: a file is there already, or cannot be written.
    """
    check_ending(out, ENDINGS)
    form = FORMATS[out.suffix.lower()]
    form.check()
    _refuse_to_replace([out], force=force)
    with writing(out):
        check_writable(out)  # before what takes long
    contents = make()
    given = {name: text for name, text in (("creator_name", creator), ("license", licence)) if text}
    files = form.files(replace(contents, about={**contents.about, **given}), out)
    _refuse_to_replace(files, force=force)
    for path, content in files.items():
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            replace_atomically(path, content)
    return [*files]


def _refuse_to_replace(paths: Iterable[Path], *, force: bool) -> None:
    if there := [path for path in paths if path.exists() and not force]:
        raise CannotWrite(f"{there[0]} is there already", "give another name with `out`, or `force` to replace it")


# --- formats -------------------------------------------------------------------------------------------


def _netcdf(contents: Contents, out: Path) -> dict[Path, bytes]:
    """Return netCDF-3 with 64-bit offsets, which any program for netCDF reads."""
    from scipy.io import netcdf_file

    buffer = io.BytesIO()
    file = netcdf_file(buffer, "w", version=2)
    for name, text in attributes_of(contents).items():
        setattr(file, name, text.encode(errors="replace"))
    for variable in variables_of(contents):
        for name, length in zip(variable.dimensions, variable.values.shape, strict=True):
            if name not in file.dimensions:
                file.createDimension(name, length)
        values, dimensions, attributes = variable.values, variable.dimensions, dict(variable.attributes)
        if values.dtype.kind == "U":  # a row of letters each, as netCDF-3 has it, and how xarray joins them
            letters = np.char.encode(values, "utf-8", "replace")
            values = letters.astype(f"S{max(letters.itemsize, 1)}").view("S1").reshape(len(values), -1)
            dimensions, attributes["_Encoding"] = (*dimensions, f"{variable.name}_length"), "utf-8"
            file.createDimension(dimensions[-1], values.shape[1])
        written = file.createVariable(variable.name, values.dtype, dimensions)
        written[...] = values
        for name, value in attributes.items():
            setattr(written, name, value.encode(errors="replace") if isinstance(value, str) else value)
    file.flush()
    return {out: buffer.getvalue()}


def _check_hdf5() -> None:
    if find_spec("h5py") is None:
        advice = f"{how_to_install('hdf5')}; netCDF, a name that ends in .nc, does without"
        raise MissingH5py(f"HDF5 needs h5py, which is not installed: {advice}")


def _hdf5(contents: Contents, out: Path) -> dict[Path, bytes]:
    """Return HDF5 with the dimension scales by which netCDF-4, xarray and others find the axes."""
    import h5py

    buffer, variables = io.BytesIO(), variables_of(contents)
    with h5py.File(buffer, "w") as file:
        file.attrs.update(attributes_of(contents))
        for one in variables:
            values = one.values.astype(h5py.string_dtype()) if one.values.dtype.kind == "U" else one.values
            file.create_dataset(one.name, data=values).attrs.update(one.attributes)
            if (one.name,) == one.dimensions:
                file[one.name].make_scale(one.name)
        for one in variables:
            for axis, name in enumerate(one.dimensions):
                if name != one.name:
                    file[one.name].dims[axis].attach_scale(file[name])
    return {out: buffer.getvalue()}


def _csv(contents: Contents, out: Path) -> dict[Path, bytes]:
    """Return a file for each table: the first with the name itself, the others with that of the table behind it."""
    first, *others = _tables(contents)
    return {out: _as_csv(first)} | {out.with_suffix(f".{table.name}.csv"): _as_csv(table) for table in others}


def _xlsx(contents: Contents, out: Path) -> dict[Path, bytes]:
    """Return a spreadsheet with a sheet for each table."""
    import pandas as pd

    buffer = io.BytesIO()
    plain = {"strings_to_formulas": False, "strings_to_urls": False}  # what people typed is no formula
    with pd.ExcelWriter(buffer, engine="xlsxwriter", engine_kwargs={"options": plain}) as book:
        tables = _tables(contents)
        mark = {"keywords": "levilab"} if any(table.name == "inputs" for table in tables) else {}
        book.book.set_properties({"title": contents.title, "created": _NO_DAY, **mark})  # the same bytes each time
        for table, name in zip(tables, _sheet_names(table.name for table in tables), strict=True):
            if len(table.columns[0].values) >= _MOST_ROWS:
                raise UsageError("out", f"{table.name} has more rows than a spreadsheet: .csv, .nc or .h5", value=out)
            _frame(table).to_excel(book, sheet_name=name, index=False)
    return {out: buffer.getvalue()}


def _sheet_names(names: Iterable[str]) -> list[str]:
    """Return names that Excel takes for sheets: short, without its signs, and each once, whatever their case.

    >>> _sheet_names(["Readings", "readings", "'a/b'", "x" * 40, "x" * 41])[1:4]
    ['readings 2', 'a-b', 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx']
    """
    taken: dict[str, str] = {}
    for name in names:
        valid = re.sub(r"[\[\]:*?/\\]", "-", name).strip("'")[:31].rstrip("'") or "table"
        numbered = (f"{valid[:26]} {k}" for k in count(2))
        free = next(one for one in chain([valid], numbered) if one.lower() not in taken)
        taken[free.lower()] = free
    return [*taken.values()]


#: Rows of a sheet of Excel.
_MOST_ROWS = 1 << 20
_NO_DAY = datetime(1980, 1, 1)  # noqa: DTZ001 - of the format


def _zip(contents: Contents, out: Path) -> dict[Path, bytes]:
    """Return a data package: CSV, the files of the run, and datapackage.json, which describes them with units."""
    tables = {f"{table.name}.csv": (table, _as_csv(table)) for table in _tables(contents)}
    resources = [
        *(resource(name, text, [*map(_field, table.columns)], table.about) for name, (table, text) in tables.items()),
        *(resource(name, content) for name, content in contents.files.items()),
    ]
    about = dict(contents.about)
    text = package(
        contents.name,
        contents.title,
        resources,
        created=about.get("date_created"),
        creator=about.get("creator_name", ""),
        licence=about.get("license", ""),
        description=about.get("comment", ""),
        sources=[{"title": about.get("source", contents.title)}],
        synthetic=about.get("synthetic", ""),
    )
    files = {"datapackage.json": text.encode(), **{name: text for name, (_, text) in tables.items()}, **contents.files}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)  # without the time of today
    return {out: buffer.getvalue()}


def _tables(contents: Contents) -> list[Table]:
    return [*contents.tables, *contents.traces, *([contents.result] if contents.values else [])]


def _field(column: Column) -> dict[str, str]:
    kind = {"b": "boolean", "U": "string", "i": "integer"}.get(column.values.dtype.kind, "number")
    return field(column.name, column.unit, column.source or column.meaning, kind)


def _frame(table: Table) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame({column.name: column.values for column in table.columns})


def _as_csv(table: Table) -> bytes:
    """Return a table as CSV: all digits, what is not known is empty."""
    return _frame(table).to_csv(index=False, lineterminator="\n").encode(errors="replace")


FORMATS: Mapping[str, Format] = MappingProxyType(
    dict(
        zip(
            ENDINGS,
            (Format(_netcdf), Format(_hdf5, _check_hdf5), Format(_csv), Format(_xlsx), Format(_zip)),
            strict=True,
        )
    )
)
