"""Variables as netCDF and HDF5 have them: arrays over named dimensions, with the attributes of the CF conventions.

Source: NetCDF Climate and Forecast Metadata Conventions 1.8, §2.3 (names), 3.1 (units), 3.4 (ancillary variables), 3.5
(flags), 5 (coordinates).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.present.units import UNITS, split
from levilab.report.export.contents import free_name

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from levilab.report.export.contents import Column, Contents, Table, Value

CONVENTIONS = "CF-1.8"
_SI = {one.si for one in UNITS}


@dataclass(frozen=True, eq=False)
class Variable:
    """A variable.

    Attributes:
        name: letters, digits and low lines.
        dimensions: one for each axis of the values; a variable of the name of a dimension holds its coordinates.
        values: of int8, int32, float32 or float64.
        attributes: text, numbers or arrays.
    """

    name: str
    dimensions: tuple[str, ...]
    values: NDArray[Any]
    attributes: Mapping[str, Any]


def variables_of(contents: Contents) -> list[Variable]:
    """Return the variables of what is exported: a map's over its axes, else the columns of its tables and the result.

    Variables of all tables but the first begin with the table's name, those of a result with it and the analysis.
    """
    if contents.axes:
        keys = tuple(plain_name(axis.name) for axis in contents.axes)
        axes = [_variable(axis, key, (key,)) for axis, key in zip(contents.axes, keys, strict=True)]
        return [*axes, *(_variable(one, plain_name(one.name), keys) for one in contents.arrays)]
    taken: set[str] = set()
    tables = enumerate(contents.tables)
    found = [one for k, table in tables for one in _of_table(table, f"{table.name}_" if k else "", taken)]
    return [*found, *(one for value in contents.values for one in _of_value(value, taken))]


def attributes_of(contents: Contents) -> dict[str, str]:
    """Return the attributes of the whole file; those that are not known are left out."""
    facts = {"Conventions": CONVENTIONS, "title": contents.title, **contents.about}
    return {name: text for name, text in facts.items() if text}


def plain_name(name: str) -> str:
    """Return a name of letters, digits and low lines (§2.3).

    >>> plain_name("start.spin_hz"), plain_name("trace-000001_CH1 (x)_v"), plain_name("1")
    ('start_spin_hz', 'trace_000001_CH1_x_v', 'n1')
    """
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return plain if plain[:1].isalpha() else f"n{plain}"


def units_of(si: str) -> dict[str, str]:
    """Return the attribute `units`, which UDUNITS has to understand (§3.1); another name for other units.

    >>> units_of("T m"), units_of("Vpp"), units_of("(rad/s)^-1/2/s")
    ({'units': 'T m'}, {'units': 'V'}, {'unit': '(rad/s)^-1/2/s'})
    """
    # a power that is no whole number, a logarithm, a unit of a file's own
    if si not in _SI or si.startswith("(") or si == "dB":
        return {"unit": si}
    return {"units": {"Vpp": "V", "turns": "turn"}.get(si, si)}


def _of_table(table: Table, prefix: str, taken: set[str]) -> Iterator[Variable]:
    """Yield the columns of a table over the first one where that increases, else over the number of the row."""
    first, names = table.columns[0], {column.name for column in table.columns}
    increases = first.values.dtype.kind == "f" and bool(np.isfinite(first.values).all())
    increases &= bool((np.diff(first.values) > 0).all())
    dimension = plain_name(f"{prefix}{first.name if increases else 'row'}")
    if not increases:
        rows = np.arange(1, len(first.values) + 1, dtype=np.int32)
        taken.add(dimension)
        yield Variable(dimension, (dimension,), rows, {"long_name": f"number of {table.about}", "units": "1"})
    for column in table.columns:
        more = {}
        if "time_s" in names and column.name != "time_s" and not increases:
            more["coordinates"] = plain_name(f"{prefix}time_s")
        quantity, unit = split(column.name)
        if unit and (of_u := f"{quantity}_u_{unit.ending}") in names:
            more["ancillary_variables"] = plain_name(f"{prefix}{of_u}")
        yield _variable(column, free_name(plain_name(f"{prefix}{column.name}"), taken), (dimension,), more)


def _variable(
    column: Column, name: str, dimensions: tuple[str, ...], more: Mapping[str, str] | None = None
) -> Variable:
    comment = {"comment": column.source} if column.source else {}
    values, attributes = column.values, {"long_name": column.meaning or column.name, **comment, **(more or {})}
    if values.dtype.kind == "b":
        flags = {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "no yes"}
        return Variable(name, dimensions, values.astype(np.int8), attributes | flags)
    if values.dtype.kind in "US":
        words, numbers = np.unique(values, return_inverse=True)
        meanings = " ".join(re.sub(r"[^\w.+-]", "_", word) or "_" for word in words.tolist())
        flags = {"flag_values": np.arange(len(words), dtype=np.int32), "flag_meanings": meanings}
        return Variable(name, dimensions, numbers.astype(np.int32), attributes | flags)
    if values.dtype.kind in "iu":
        return Variable(name, dimensions, values.astype(np.int32), attributes | units_of(column.unit))
    missing = {} if (name,) == dimensions else {"_FillValue": np.array(np.nan, dtype=values.dtype)}
    return Variable(name, dimensions, values, attributes | units_of(column.unit) | missing)


def _of_value(value: Value, taken: set[str]) -> Iterator[Variable]:
    """Yield a quantity of a result, and its standard uncertainty."""
    name = free_name(plain_name(f"result_{value.analysis}_{value.model}_{value.name}"), taken)
    words = f"{value.name.replace('_', ' ')}{f' of the {value.model} model' * bool(value.model)}"
    missing = {"_FillValue": np.array(np.nan)}
    more = {"ancillary_variables": f"{name}_u"} if value.u is not None else {}
    attributes = {"long_name": words, **units_of(value.unit), **missing}
    yield Variable(name, (), np.array(np.nan if value.value is None else value.value), attributes | more)
    if value.u is not None:
        of_u = attributes | {"long_name": f"standard uncertainty of {words}"}
        yield Variable(f"{name}_u", (), np.array(value.u), of_u)
