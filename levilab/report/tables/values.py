"""Results → tables for programs: all values with all their digits, units in the names of columns."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from levilab.pipelines.row import Column, plain, text_of
from levilab.present.units import split

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from levilab.pipelines.document import Analysis
    from levilab.pipelines.row import Cell
    from levilab.pipelines.sources import Source

#: A spreadsheet takes a text that begins with one of these for a formula.
_FORMULA = re.compile(r"\s*[=+\-@\t\r]")
#: The first columns of both kinds of tables.
INPUT, GROUP, NOTE, SYNTHETIC = "input", "group", "note", "synthetic"


@dataclass(frozen=True)
class Values:
    """A table of values.

    Attributes:
        name: of its file, without the ending.
        about: what a row is, for people.
        heads: names of the columns, with the unit at the end.
        rows: of cells; a float is written with all its digits, None is empty.
    """

    name: str
    about: str
    heads: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


def as_csv(values: Values) -> str:
    """Return the table as CSV; no text in it is a formula to a spreadsheet.

    >>> print(as_csv(Values("x", "", ("input", "c1_per_s"), (("=1+1", -0.5), ("a, b", None)))), end="")
    input,c1_per_s
    '=1+1,-0.5
    "a, b",
    """
    written = io.StringIO()
    writer = csv.writer(written, lineterminator="\n")
    writer.writerow([_harmless(head) for head in values.heads])
    writer.writerows([[_harmless(cell) for cell in row] for row in values.rows])
    return written.getvalue()


def _harmless(cell: Cell) -> str:
    """Return a cell as text; an apostrophe, which spreadsheets do not show, keeps a text from being a formula."""
    if isinstance(cell, str):
        text = " ".join(cell.split("\n")).replace("\r", " ")
        return f"'{text}" if _FORMULA.match(text) else text
    return text_of(cell)


# --- of an analysis ------------------------------------------------------------------------------------


def of_analysis(analysis: Analysis[Any], found: Any, folder: Path) -> Iterator[Values]:
    """Return the tables of an analysis: a row for each input, and a row for each quantity.

    Args:
        analysis: the row of the catalogue.
        found: what it found.
        folder: of the tables.
    """
    document = analysis.document(found, folder)
    yield _by_input(analysis, document, found.sources)
    yield Values(
        f"{analysis.name}-quantities",
        f"{analysis.name}: a row for each quantity of each input, and of all inputs together",
        (INPUT, SYNTHETIC, "model", "quantity", "value", "u", "unit", "interval_68_low", "interval_68_high",
         "scatter", "runs"),
        tuple(_quantities(found, document, unit_of_residuals(analysis))),
    )  # fmt: skip


def unit_of_residuals(analysis: Analysis[Any]) -> str:
    """Return the unit in the name of the column of their root mean square; empty where there is no such column."""
    names = [column.name for column in analysis.row if "rms_residual" in column.name]
    unit = split(names[0])[1] if names else None
    return unit.si if unit else ""


def _by_input(analysis: Analysis[Any], document: Mapping[str, Any], sources: Sequence[Source[Any]]) -> Values:
    columns: tuple[Column, ...] = analysis.row
    rows = [
        (
            source.name,
            source.group,
            source.note,
            bool(part["synthetic"]),
            *(plain(column.read(part), column.kind) for column in columns),
        )
        for source, part in zip(sources, document["runs"], strict=True)
    ]
    heads = (INPUT, GROUP, NOTE, SYNTHETIC, *(column.name for column in columns))
    return Values(f"{analysis.name}-inputs", f"{analysis.name}: a row for each input", heads, tuple(rows))


def _quantities(found: Any, document: Mapping[str, Any], residuals: str) -> Iterator[tuple[Cell, ...]]:
    """Yield a row for each quantity.  residuals: their unit."""
    if len(found.sources) > 1:
        yield from _of_part("all together", residuals, document, found.inputs_of)
    for source, part in zip(found.sources, document["runs"], strict=True):
        yield from _of_part(source.name, residuals, part)


def _of_part(
    name: str,
    residuals: str,
    part: Mapping[str, Any],
    inputs_of: Callable[[int | None], Sequence[Source[Any]]] | None = None,
) -> Iterator[tuple[Cell, ...]]:
    """Yield a row for each value.

    inputs_of: returns the inputs of a group, whose values are synthetic where one of them is; None: as the part is.
    """
    for model, quantity, found in _values_in(part, residuals):
        of = inputs_of(found.get("group")) if inputs_of else ()
        synthetic = any(source.synthetic for source in of) if inputs_of else bool(part["synthetic"])
        low, high = found.get("interval_68") or (None, None)
        value, u, unit = (found.get(key) for key in ("value", "u", "unit"))
        yield name, synthetic, model, quantity, value, u, unit, low, high, found.get("scatter"), found.get("runs")


def _values_in(part: Mapping[str, Any], residuals: str) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Yield model, name and value of each quantity; values without a model come first."""
    for name, value in part["values"].items():
        yield "", name, value
    for model in part.get("models") or ():
        for name, value in model["parameters"].items():
            yield model["name"], name, value
        for name, value in (model.get("linearised") or {}).items():
            yield model["name"], f"{name}_linearised", value
        for name, value in (model.get("statistics") or {}).items():
            unit = residuals if name == "rms_residual" else "1"
            if unit and value is not None:
                yield model["name"], name, {"value": value, "unit": unit}
