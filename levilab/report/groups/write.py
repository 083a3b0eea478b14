"""A class is written: page, PDF or spreadsheet, as the file's name says."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from levilab.files import check_writable, replace_atomically
from levilab.pipelines.suits import recall_suiting
from levilab.report.groups.beside import class_of
from levilab.report.groups.document import class_document
from levilab.report.groups.sheet import class_workbook
from levilab.report.heading import Heading
from levilab.report.page import FORMATS, UnknownFormat, newest_of, writing_report

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

SPREADSHEET = ".xlsx"


def write_class(
    paths: Sequence[Path],
    output: Path,
    given: Mapping[str, Any] | None = None,
    tell: Callable[[str], None] | None = None,
    heading: Heading | None = None,
) -> Path:
    """Put the groups of a class beside each other; what has no result yet is analyzed, and nothing is stored.

    Args:
        paths: run folders, data files, folders to search.
        output: the file to write; its ending, .html, .pdf or .xlsx, chooses the format.
        given: options of analyses by their names.
        tell: called with what lies there and is of no use.
        heading: title, course, authors and date above it.

    Returns:
        The file.

    Raises:
        DataError: there is no run.
        UnknownFormat: of the output's name.
        NoTypst: PDF, and the extra `pdf` is not installed.
        CannotWrite: of the output.
    """
    ending = output.suffix.lower()
    form = FORMATS.get(ending)
    if form is None and ending != SPREADSHEET:
        raise UnknownFormat("out", "a name that ends in .html, .pdf or .xlsx is expected", value=output)
    if form:
        form.check()
    with writing_report(output):
        check_writable(output)
    results = recall_suiting(paths, given or {}, tell)
    classes = [class_of(analysis, found) for analysis, found in results]
    date = newest_of(results)
    if form:
        document = (heading or Heading()).above(class_document(classes, paths, form.ending))
        content = form.content(replace(document, date=date))
    else:
        content = class_workbook(classes, date)
    with writing_report(output):
        output.parent.mkdir(parents=True, exist_ok=True)
        replace_atomically(output, content)
    return output
