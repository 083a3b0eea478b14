"""A class → blocks of a document, and page, PDF or spreadsheet, as the file's name says."""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from levilab.errors import unquote
from levilab.files import check_writable, replace_atomically
from levilab.pipelines.suits import recall_suiting
from levilab.present.document.blocks import Document, Fact, Facts, Note, Picture, Section, Tabular, Verdict
from levilab.present.numbers import column, enumeration, plain, with_sign, without_unit
from levilab.present.tables import Row, table
from levilab.report.document import banner_of, count_inputs
from levilab.report.groups.beside import class_of, finding, verdict
from levilab.report.groups.sheet import class_workbook
from levilab.report.page import FORMATS, UnknownFormat, newest_of, writing_report
from levilab.report.reproduction import Heading
from levilab.report.tables.values import unit_of_residuals

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from analysis.uncertainty import Estimate
    from levilab.present.document.blocks import Block
    from levilab.present.style import Figure
    from levilab.report.groups.beside import Class, Compared


#: Distance from the truth, in u, beyond which a group is named in red: one in four hundred is by chance.
_FAR = 3.0
_FROM_CLASS, _TRUTH, _FROM_TRUTH = "from the others [u]", "truth", "from the truth [u]"


def class_document(classes: Sequence[Class], paths: Sequence[Path], ending: str) -> Document:
    """Return the document of a class.

    Args:
        classes: the groups, by each analysis.
        paths: as they were typed.
        ending: of the document's name.
    """
    sources = list({source.path.resolve(): source for of in classes for source in of.found.sources}.values())
    alone = len(classes) == 1
    chapters: list[Block] = []
    for k, of in enumerate(classes):
        own = tuple(_blocks(of, deeper=not alone))
        chapters += own if alone else [Section(_subject(of), own, anchor=of.analysis.name, new_page=k > 0)]
    names = {source.group or source.name for source in sources}
    return Document(
        title=f"Class of {len(names)} group{'s' * (len(names) > 1)}",
        lead=f"{count_inputs(sources)}: {', '.join(map(_subject, classes))}",
        blocks=(*chapters, _made_by(paths, ending)),
        banner=banner_of(sources),
        contents=True,
    )


def _subject(of: Class) -> str:
    return of.analysis.part(of.found).subject


def _blocks(of: Class, *, deeper: bool) -> Iterator[Block]:
    def section(title: str, anchor: str, *blocks: Block) -> Section:
        return Section(title, blocks, anchor=f"{of.analysis.name}-{anchor}" if deeper else anchor)

    tables = (_values(of, one) for one in of.quantities)
    yield section("Result", "result", Verdict(verdict(of)), *tables, _groups(of))
    if of.quantities:
        yield section("Figure", "figure", _picture(of))
    if of.found.warnings or any(group.warnings or group.source.note for group in of.groups):
        yield section("Notes", "notes", Facts(tuple(_notes(of))))


def _values(of: Class, quantity: Compared) -> Tabular:
    """Return a row for each group: its value, how far it lies from the others, and from the truth."""
    estimates = [quantity.show(one.value, one.u) if one else None for one in quantity.estimates]
    together = quantity.together
    mean = quantity.show(together.mean, together.u) if together else None
    columns = [column([*estimates, mean]), [*map(_distance, quantity.from_class), ""]]
    heads = ["group", quantity.head, _FROM_CLASS]
    if of.knows_truth:
        columns += [
            [*map(truth_text, map(quantity.show, quantity.truths), estimates), ""],
            [*map(_distance, quantity.from_truth), ""],
        ]
        heads += [_TRUTH, _FROM_TRUTH]
    names = [*(group.source.name for group in of.groups), "mean"]
    far = [*(one is not None and abs(one) > _FAR for one in quantity.from_truth), False]
    rows = [
        Row(cells, "together" if k == len(of.groups) else "outlier" if far[k] else "")
        for k, cells in enumerate(zip(names, *columns, strict=True))
    ]
    note = "value(u): the digits in parentheses are the standard uncertainty of the last digits."
    if of.knows_truth:
        note += f" Red: more than {_FAR:.0f} u from its truth."
    name = f"{of.analysis.name}-{quantity.name.replace('_', '-')}"
    return Tabular(name, table("", heads, rows, numbers=heads[1:]), note, first_column_wraps=True, narrow="turn")


def truth_text(truth: Estimate | None, estimate: Estimate | None) -> str:
    """Return a truth with as many digits as the estimate beside it."""
    if truth is None:
        return "—"
    return re.sub(r"\(.*\)", "", without_unit(replace(truth, u=estimate.u if estimate else None)))


def _distance(distance: float | None) -> str:
    return "—" if distance is None else with_sign(distance, 1)


def _groups(of: Class) -> Tabular:
    """Return a row for each group: its readings, how well the law fits them, how many warnings it has."""
    shown = f" [{unit}]" if (unit := unit_of_residuals(of.analysis)) else ""
    heads = ["group", "run", "readings", f"rms residual{shown}", "χ²/dof", "warnings", "best law"]
    rows = [
        (
            group.source.name,
            group.source.path.name,
            str(group.statistics.get("n") or len(group.source.readings)),
            plain(group.statistics.get("rms_residual")),
            plain(group.statistics.get("reduced_chi_square"), 2),
            str(len(group.warnings)) if group.warnings else "",
            group.best_model,
        )
        for group in of.groups
    ]
    full = [k for k in range(len(heads)) if any(row[k] not in {"", "—"} for row in rows)]
    heads, rows = [heads[k] for k in full], [tuple(row[k] for k in full) for row in rows]  # type: ignore[misc]
    note = f"Residuals are those of the law {of.model}, whose constants are compared." if of.model else ""
    if of.others:
        laws = enumeration([f"{name} ({law})" for name, law in of.others.items()])
        note += f" The seeds of these groups have another law, and so no truth to compare with: {laws}."
    numbers = [head for head in heads if head not in {"group", "run", "best law"}]
    return Tabular(f"{of.analysis.name}-groups", table("", heads, rows, numbers=numbers), note, first_column_wraps=True)


def _notes(of: Class) -> Iterator[Fact]:
    """Yield what is to be known of all runs, as that one was given twice, and notes and warnings of each group."""
    if of.found.warnings:
        yield Fact("all", tuple(map(unquote, of.found.warnings)))
    for group in of.groups:
        note = [f"note: {group.source.note}"] if group.source.note else []
        if note or group.warnings:
            yield Fact(group.source.name, (*note, *group.warnings))


def _picture(of: Class) -> Picture:
    truth = "; diamonds are the truth that each seed made, and the last panel has the distance from it" * of.knows_truth
    return Picture(
        name=f"{of.analysis.name}-class",
        title="The class.",
        caption=f"Each group's value with its u, and the mean of the class{truth}.",
        alt=finding(of),
        draw=partial(_draw, of),
    )


def _draw(of: Class) -> Figure:
    from levilab.report.groups.figure import class_figure  # with matplotlib

    return class_figure(of)


def _made_by(paths: Sequence[Path], ending: str) -> Note:
    typed = " ".join(shlex.quote(str(path)) for path in paths)
    each = "each group's readings, figure and budget of uncertainties are in that of levilab report"
    return Note(f"Made by: levilab class {typed} -o class{ending}; {each}.")


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
