"""Results → tables for programs: all digits, units in the names of columns; the folder of tables beside a report."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from levilab.files import replace_atomically, writing
from levilab.pipelines.row import Cell, Column, plain, text_of
from levilab.present.document.blocks import Banner, Block, Details, Document, Section, Tabular
from levilab.present.units import split
from levilab.present.words import free_name
from levilab.report.tables.latex import as_latex, title_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from levilab.pipelines.document import Analysis
    from levilab.pipelines.inputs.source import Source


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


#: The list of the files, which is one of them.
CONTENTS = "contents.csv"
_HEADS = ("file", "what")
#: Tables of a report that hold no results: what happened, which settings changed, hashes.
_NO_RESULTS = frozenset({"events", "changes", "data"})
#: A name that this module gave: nothing else is ever taken away.
_OURS = re.compile(r"[a-z0-9][a-z0-9_-]*\.(csv|tex)")


def folder_of(report: Path) -> Path:
    """Return the folder of a report's tables.

    >>> from pathlib import Path
    >>> folder_of(Path("out/report.pdf")).as_posix()
    'out/report.tables'
    """
    return report.with_suffix(".tables")


def write_tables(document: Document, values: Iterable[Values], folder: Path) -> list[Path]:
    """Write all tables of a report into a folder; those of an earlier report are replaced.

    Args:
        document: the report, whose tables are written as LaTeX.
        values: what is written as CSV.
        folder: which is made; other files in it stay.

    Returns:
        The files, the list of them first.

    Raises:
        CannotWrite: the folder or a file cannot be written.
    """
    files = {**dict(_csv_files(values)), **dict(_latex_files(document))}
    listed = tuple((name, about) for name, (about, _) in sorted(files.items()))
    contents = as_csv(Values(CONTENTS, "", _HEADS, listed))
    with writing(f"{folder}: the tables could not be written", "choose another place with `out`"):
        folder.mkdir(parents=True, exist_ok=True)
        for name in _listed_before(folder / CONTENTS) - files.keys():
            (folder / name).unlink(missing_ok=True)
        for name, (_, text) in files.items():
            replace_atomically(folder / name, text)
        replace_atomically(folder / CONTENTS, contents)
    return [folder / CONTENTS, *(folder / name for name in sorted(files))]


def _listed_before(contents: Path) -> set[str]:
    """Return the files of an earlier report."""
    if not contents.is_file():
        return set()
    text = contents.read_text(encoding="utf-8", errors="replace")
    return {row[0] for row in csv.reader(text.splitlines()) if row and _OURS.fullmatch(row[0])} - {CONTENTS}


def _csv_files(values: Iterable[Values]) -> Iterator[tuple[str, tuple[str, str]]]:
    taken: set[str] = set()
    for one in values:
        yield f"{_file_name(one.name, taken)}.csv", (one.about, as_csv(one))


def _latex_files(document: Document) -> Iterator[tuple[str, tuple[str, str]]]:
    taken: set[str] = set()
    for block, around in _tables_in(document.blocks, document.banner.lead if document.banner else ""):
        mark = around if block.mark is None else block.mark
        name = _file_name(block.name, taken)
        latex = as_latex(name, block.table, note=block.note, mark=mark)
        yield f"{name}.tex", (block.table.title or title_of(block.name), latex)


def _tables_in(blocks: Sequence[Block], mark: str) -> Iterator[tuple[Tabular, str]]:
    """Yield every table of results with its mark: that of the section, or of the document."""
    mark = next((block.lead for block in blocks if isinstance(block, Banner)), mark)
    for block in blocks:
        if isinstance(block, Tabular) and block.name not in _NO_RESULTS:
            yield block, mark
        elif isinstance(block, Section | Details):
            yield from _tables_in(block.blocks, mark)


def _file_name(name: str, taken: set[str]) -> str:
    """Return a name for a file that no other one has."""
    return free_name(re.sub(r"[^a-z0-9_]+", "-", name.lower()).strip("-_") or "table", taken, "-")
