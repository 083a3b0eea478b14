"""A class → a spreadsheet: all digits, the numbers as numbers, every reading with its residual."""

import io
import math
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from typing import Any

from levilab.present.units import name_with_unit
from levilab.report.beside import REPEAT, Class, count_readings
from levilab.texts.text import in_language

Cell = str | float | int | None


#: Of a workbook without runs: its bytes depend on its inputs alone.
_NO_DATE = datetime(1980, 1, 1, tzinfo=UTC)
_WIDEST = 40
#: Rows of a sheet that programs read.
_MOST_ROWS = 1_048_575


def class_workbook(classes: Sequence[Class], date: datetime | None) -> bytes:
    """Return the workbook: for each analysis its groups, its means, and the readings.

    Args:
        classes: the groups, by each analysis.
        date: of the newest run.
    """
    import xlsxwriter

    buffer = io.BytesIO()
    # a text is never a formula, a link or a number, whatever a person typed
    never = {"strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False, "in_memory": True}
    with xlsxwriter.Workbook(buffer, never) as book:
        book.set_properties({"created": (date or _NO_DATE).replace(tzinfo=None), "keywords": "levilab"})
        bold = book.add_format({"bold": True, "text_wrap": True, "valign": "top"})
        red = {
            "type": "cell",
            "criteria": "==",
            "value": f'"{in_language(REPEAT)}"',
            "format": book.add_format({"color": "#b00020"}),
        }
        for of in classes:
            name = of.analysis.name
            for title, heads, rows in (
                (f"{name} groups", *_groups(of)),
                (f"{name} class", *_means(of)),
                (f"{name} readings", *_readings(of)),
            ):
                sheet = book.add_worksheet(title)
                _write(sheet, bold, heads, rows)
                sheet.conditional_format(1, 1, len(of.groups) + len(of.unread), 1, red)
    return buffer.getvalue()


def _write(sheet: Any, bold: Any, heads: Sequence[str], rows: Iterable[Sequence[Cell]]) -> None:
    widths = [len(head) for head in heads]
    for k, head in enumerate(heads):
        sheet.write_string(0, k, head, bold)
    for number, cells in enumerate(rows, start=1):
        if number > _MOST_ROWS:
            break
        for k, cell in enumerate(cells):
            if isinstance(cell, str):
                sheet.write_string(number, k, cell)
            elif cell is not None and math.isfinite(cell):
                sheet.write_number(number, k, cell)
            widths[k] = max(widths[k], len(str(cell)) if isinstance(cell, str) else 12)
    for k, width in enumerate(widths):
        sheet.set_column(k, k, min(width, _WIDEST) + 1)
    sheet.freeze_panes(1, 1)
    sheet.autofilter(0, 0, max(1, sheet.dim_rowmax or 0), len(heads) - 1)


def _groups(of: Class) -> tuple[list[str], list[list[Cell]]]:
    """Return a row for each group, in SI with the unit in the name."""
    heads = ["group", "result", "why", "run", "note", "started_utc", "seed", "synthetic"]
    columns: list[list[Cell]] = []
    for one in of.quantities:
        value, u, truth = (name_with_unit(f"{one.name}{end}", one.unit) for end in ("", "_u", "_truth"))
        heads += [value, u, f"{one.name}_from_the_others_in_u"]
        columns += [
            [found.value if found else None for found in one.estimates],
            [found.u if found else None for found in one.estimates],
            [*one.from_class],
        ]
        if of.knows_truth:
            heads += [truth, f"{one.name}_from_the_truth_in_u"]
            columns += [[*one.truths], [*one.from_truth]]
    names = "rms_residual", "reduced_chi_square"
    heads += ["readings", *names, "best_model"]
    rows = []
    for k, (group, mark, place) in enumerate(zip(of.groups, of.marks, of.places, strict=True)):
        source, record = group.source, group.source.run.record if group.source.run else None
        about: list[Cell] = [
            source.group or source.name,
            in_language(mark.word),
            "\n".join(map(in_language, mark.why)),
            place,
            source.note,
            (record.started_utc if record else None) or "",
            record.seed if record else None,
            "yes" if source.synthetic else "",
        ]
        fit = [count_readings(group), *map(group.statistics.get, names)]
        own = [column[k] for column in columns]
        rows.append([*about, *own, *fit, group.best_model])
    rows += [[name, in_language(mark.word), "\n".join(map(in_language, mark.why))] for name, mark in of.unread.items()]
    return heads, rows


def _means(of: Class) -> tuple[list[str], list[list[Cell]]]:
    """Return a row for each quantity of the whole class."""
    heads = ["quantity", "unit", "mean", "u", "scatter", "groups", "chi_square", "degrees_of_freedom", "p"]
    heads += ["mean_of_truths", "from_the_truth_in_u", "u_without_tops"]
    rows: list[list[Cell]] = []
    for one in of.quantities:
        if (found := one.together) is not None and one.mean is not None:
            mean = [one.mean.value, one.mean.u, found.scatter, found.freedom + 1]
            rows.append([one.name, one.unit, *mean, found.chi_square, found.freedom, found.p, *(one.truth or ())])
    return heads, rows


def _readings(of: Class) -> tuple[list[str], Iterator[list[Cell]]]:
    """Return the readings of all groups below each other, with their residuals."""
    each = [*of.analysis.columns(of.found)]
    names = list(dict.fromkeys(name for columns in each for name in columns))

    def rows() -> Iterator[list[Cell]]:
        for group, columns in zip(of.groups, each, strict=False):
            length = max((len(column) for column in columns.values()), default=0)
            lists = {name: column.tolist() for name, column in columns.items()}
            for k in range(length):
                yield [group.source.name, *(lists[name][k] if name in lists else None for name in names)]

    return ["group", *names], rows()
