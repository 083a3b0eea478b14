"""The columns that an analysis has in a table of many runs, and the values in them.

A column is read from the input's part of result.json, so that the table and the result say the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

#: The type of a column: a float, a whole number, true or false, text.
Kind = Literal["number", "count", "truth", "text"]

Cell = str | float | int | bool | None

#: Units of results → the end of a column's name.
UNITS_IN_NAMES = MappingProxyType({
    "Hz": "hz", "s": "s", "1": "", "1/s": "per_s", "1/rad": "per_rad", "(rad/s)^-1/2/s": "per_sqrt_rad_s",
    "(rad/s)^(1-exponent)/s": "si", "Hz/s": "hz_per_s", "Hz/s^2": "hz_per_s2", "turns": "turns", "dB": "db",
    "T": "t", "T m": "t_m", "m": "m", "m/kg": "m_per_kg", "kg": "kg", "rad": "rad",
})  # fmt: skip


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


def name_with_unit(name: str, unit: str) -> str:
    """A quantity's name with its unit.

    >>> name_with_unit("newton_c2_u", "1/rad"), name_with_unit("slope", "1")
    ('newton_c2_u_per_rad', 'slope')
    """
    return f"{name}_{UNITS_IN_NAMES[unit]}".removesuffix("_")


def estimate(
    name: str,
    unit: str,
    meaning: str,
    read: Callable[[Mapping[str, Any]], Mapping[str, Any] | None] | None = None,
) -> tuple[Column, Column]:
    """The columns of a quantity: its value and its standard uncertainty.

    Args:
        name: of the column, without the unit.
        unit: as results have it.
        meaning: for people.
        read: from the input's part to the quantity; by default that of the same name among its values.
    """
    find = read or (lambda part: part["values"].get(name))
    return (
        Column(name_with_unit(name, unit), "number", meaning, lambda part: (find(part) or {}).get("value")),
        Column(name_with_unit(f"{name}_u", unit), "number", f"its standard uncertainty ({meaning})",
               lambda part: (find(part) or {}).get("u")),
    )  # fmt: skip


def value(name: str, unit: str, meaning: str, *, kind: Kind = "number") -> Column:
    """The column of a value that has no uncertainty."""
    return Column(name_with_unit(name, unit), kind, meaning, lambda part: (part["values"].get(name) or {}).get("value"))


def entry(name: str, kind: Kind, meaning: str, key: str = "") -> Column:
    """The column of what stands beside the values, by its dotted key, by default the name; of a list its length."""

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
    """A value as text, empty for None; a float with all its digits.

    >>> text_of(0.1 + 0.2), text_of(True), text_of(None)
    ('0.30000000000000004', 'true', '')
    """
    if cell is None:
        return ""
    return str(cell).lower() if isinstance(cell, bool) else str(cell)


def value_of_text(text: str, kind: Kind) -> Cell:
    """The value of a text.  Raises ValueError."""
    if not text:
        return None
    if kind == "text":
        return text
    if kind == "truth":
        if text not in {"true", "false"}:
            raise ValueError(f"{text!r} is neither true nor false")
        return text == "true"
    return float(text) if kind == "number" else int(text)
