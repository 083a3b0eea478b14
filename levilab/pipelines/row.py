"""The quantities of an analysis: one row each, from which result.json, tables, budgets and columns are made.

A column of a table of many runs is read from the input's part of result.json, so that both say the same.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from analysis.uncertainty import Estimate
from levilab.present.numbers import column
from levilab.present.units import Scale, name_with_unit, unit

#: The type of a column: a float, a whole number, true or false, text.
Kind = Literal["number", "count", "truth", "text"]

Cell = str | float | int | bool | None


@dataclass(frozen=True)
class Column:
    """A column of the table.

    Attributes:
        name: with the unit at its end.
        meaning: for people.
        read: from the input's part of result.json; None where that has no such value.
    """

    name: str
    kind: Kind
    meaning: str
    read: Callable[[Mapping[str, Any]], Any]


@dataclass(frozen=True)
class Quantity:
    """A number that an analysis finds.

    Attributes:
        name: in result.json, and with its unit of the column.
        unit: of results; see `levilab.present.units`.
        meaning: for people.
        symbol: in tables and budgets, by default the name.
        of: attribute path from what the analysis found to an Estimate or a number; empty: the name; or a function.
        u: attribute path to the standard uncertainty of a number.
        has_u: whether it has a standard uncertainty, and a column for that.
        optional: whether it is left out where it is not found, in the place of null.
        fine: whether people read it in the fine unit, as dimensions, rather than in that of the bench.
        column: whether a table of many runs has it.
    """

    name: str
    unit: str
    meaning: str
    symbol: str = ""
    of: str | Callable[[Any], Estimate | float | None] = ""
    u: str = ""
    has_u: bool = True
    optional: bool = False
    fine: bool = False
    column: bool = True

    @property
    def shown_symbol(self) -> str:
        """Its symbol, or its name."""
        return self.symbol or self.name.replace("_", " ")

    @property
    def head(self) -> str:
        """Symbol and unit, above a column."""
        return f"{self.shown_symbol} [{self._scale.unit}]" if self._scale.unit else self.shown_symbol

    @property
    def _scale(self) -> Scale:
        return unit(self.unit).fine if self.fine else unit(self.unit).shown

    def find(self, found: Any) -> Estimate | None:
        """Return the quantity of what was found; None where it is left out."""
        value = self.of(found) if callable(self.of) else _at(found, self.of or self.name)
        if value is None and self.optional:
            return None
        if isinstance(value, Estimate):
            return replace(value, unit=self.unit)
        return Estimate(value, _at(found, self.u) if self.u else None, self.unit)

    def show(self, estimate: Estimate) -> Estimate:
        """Return an estimate in the unit that people read."""
        text, factor = self._scale
        value, u = (None if one is None else one * factor for one in (estimate.value, estimate.u))
        return Estimate(value, u, text)

    def show_all(self, of_each: Sequence[Any]) -> tuple[Estimate | None, ...]:
        """Return the quantity of each of several things that were found, in the unit that people read."""
        return tuple(self.show(value) if (value := self.find(found)) else None for found in of_each)

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of its value and of its standard uncertainty."""
        if not self.has_u:
            return (_of_value(self.name, self.name, self.unit, self.meaning, "value"),)
        return estimate(self.name, self.unit, self.meaning)


def _at(found: Any, path: str) -> Any:
    """Return what stands at an attribute path; None where something on the way is None."""
    for name in path.split("."):
        if found is None:
            return None
        found = getattr(found, name)
    return found


def find_all(quantities: Iterable[Quantity], found: Any) -> dict[str, Estimate]:
    """Return the quantities of what was found, by their names."""
    return {one.name: value for one in quantities if (value := one.find(found)) is not None}


def cells_of(quantities: Iterable[Quantity], of_each: Sequence[Any]) -> list[list[str]]:
    """Return a column of cells for each quantity, with a row for each of several things that were found."""
    return [column(one.show_all(of_each)) for one in quantities]


def symbols_of(quantities: Iterable[Quantity]) -> dict[str, str]:
    """Return how budgets and tables name quantities."""
    return {one.name: one.shown_symbol for one in quantities}


def columns_of(quantities: Iterable[Quantity]) -> Iterator[Column]:
    """Yield the columns of quantities."""
    for one in quantities:
        if one.column:
            yield from one.columns


def estimate(
    name: str, unit: str, meaning: str, read: Callable[[Mapping[str, Any]], Mapping[str, Any] | None] | None = None
) -> tuple[Column, Column]:
    """Return the columns of an estimate: its value and its standard uncertainty.

    Args:
        name: of the column, without the unit.
        unit: as results have it.
        meaning: for people.
        read: from the input's part to the estimate; by default that of the same name among its values.
    """
    of_u = f"its standard uncertainty ({meaning})"
    return _of_value(name, name, unit, meaning, "value", read), _of_value(name, f"{name}_u", unit, of_u, "u", read)


def _of_value(  # noqa: PLR0917 - the fields of a column
    name: str,
    heading: str,
    unit: str,
    meaning: str,
    key: str,
    read: Callable[[Mapping[str, Any]], Mapping[str, Any] | None] | None = None,
) -> Column:
    find = read or (lambda part: part["values"].get(name))
    return Column(name_with_unit(heading, unit), "number", meaning, lambda part: (find(part) or {}).get(key))


def statistic(name: str, unit: str, meaning: str, heading: str = "", *, kind: Kind = "number") -> Column:
    """Return the column of a statistic of an analysis with one model."""
    return Column(
        name_with_unit(heading or name, unit), kind, meaning, lambda part: part["models"][0]["statistics"][name]
    )


def entry(name: str, kind: Kind, meaning: str, key: str = "") -> Column:
    """Return the column of what stands beside the values, by its dotted key or its name; of a list its length."""

    def read(part: Mapping[str, Any]) -> Any:
        found: Any = part
        for one in (key or name).split("."):
            found = found.get(one)
        return len(found) if isinstance(found, list | tuple) else found

    return Column(name, kind, meaning, read)


def plain(found: Any, kind: Kind) -> Cell:
    """Return a value as a plain one of Python, a text in one line, None where there is no value."""
    if found is None:
        return None
    if kind == "text":
        return " ".join(str(found).split()) or None
    if kind == "truth":
        return bool(found)
    return float(found) if kind == "number" else int(found)


def text_of(cell: Cell) -> str:
    """Return a value as text, empty for None; a float with all its digits.

    >>> text_of(0.1 + 0.2), text_of(True), text_of(None)
    ('0.30000000000000004', 'true', '')
    """
    if cell is None:
        return ""
    return str(cell).lower() if isinstance(cell, bool) else str(cell)


def value_of_text(text: str, kind: Kind) -> Cell:
    """Return the value of a text.  Raises ValueError."""
    if not text:
        return None
    if kind == "text":
        return text
    if kind == "truth":
        if text not in {"true", "false"}:
            raise ValueError(f"{text!r} is neither true nor false")
        return text == "true"
    return float(text) if kind == "number" else int(text)
