"""A class → blocks of a document, and page, PDF or spreadsheet, as the file's name says."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from levilab.errors import DataError, as_typed, check_ending
from levilab.files import check_writable
from levilab.formats.texts import locate
from levilab.pipelines.analyzed import A
from levilab.pipelines.inputs.files import data_files, is_archive_of
from levilab.pipelines.inputs.names import by_group, each_once, natural, short_paths, with_short_names
from levilab.pipelines.inputs.search import Found
from levilab.pipelines.inputs.unread import (
    OTHER_COLUMNS,
    LeftOut,
    Skipped,
    kind_of_unused,
    number_by_kind,
)
from levilab.pipelines.recall import recall_suiting
from levilab.present.document.blocks import (
    Block,
    Details,
    Document,
    Fact,
    Facts,
    Note,
    Paragraph,
    Picture,
    Section,
    Tabular,
    Verdict,
    Warnings,
    in_language_of_reader,
)
from levilab.present.numbers import column, enumeration, plain, with_sign, without_unit
from levilab.present.tables import Row, Table, table
from levilab.report.beside import (
    FAR,
    GOOD,
    LOOK,
    REPEAT,
    Class,
    Compared,
    Mark,
    agreement,
    class_of,
    count_readings,
    count_sources,
    finding,
    plain_text,
    statistics_of_agreement,
    verdict,
)
from levilab.report.document import Results, banner_of, count_inputs, count_notes
from levilab.report.groups.sheet import class_workbook
from levilab.report.page import FORMATS, newest_of, write_content, writing_report
from levilab.report.reproduction import Heading, language_option
from levilab.report.tables.values import unit_of_residuals
from levilab.runs.find import RECORD
from levilab.runs.run import Run, read_record
from levilab.texts.note import Note as OneNote
from levilab.texts.note import of_file
from levilab.texts.text import Sentences, Text, spoken, verbatim

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from analysis.uncertainty import Estimate
    from levilab.pipelines.document import Analysis
    from levilab.pipelines.inputs.source import Source
    from levilab.present.style import Figure


#: Rows of groups by their marks.
_ROWS = {GOOD: "best", LOOK: "", REPEAT: "outlier"}
_FROM_CLASS, _TRUTH, _FROM_TRUTH = "from the others [u]", "truth", "from the truth [u]"


def class_document(
    classes: Sequence[Class], paths: Sequence[Path], name: str, others: str = "", unread: Iterable[str] = ()
) -> Document:
    """Return the document of a class.

    Args:
        classes: the groups, by each analysis.
        paths: as they were typed.
        name: of the document's file.
        others: about files that hold no readings.
        unread: groups of inputs that could not be used.
    """
    sources = each_once(source for of in classes for source in of.found.sources)
    alone = len(classes) == 1
    warnings = dict.fromkeys(plain_text(text) for text in (*_notes_of(classes), others) if text)
    notes = [Section("Notes", (Warnings(tuple((text,) for text in warnings)),), anchor="notes")] if warnings else []
    chapters: list[Block] = []
    for k, of in enumerate(classes):
        own = tuple(_blocks(of, deeper=not alone))
        chapters += own if alone else [Section(_subject(of), own, anchor=of.analysis.name, new_page=k > 0)]
    return Document(
        title=Text("Class of {groups}", groups=count_sources(sources, unread)),
        lead=Text(
            "{inputs}: {subjects}, {notes}",
            count_inputs(sources),
            tuple(map(_subject, classes)),
            count_notes(len(warnings)),
        ),
        blocks=(*chapters, *notes, _made_by(paths, name)),
        banner=banner_of(sources),
        contents=True,
    )


def _left_out(results: Results) -> tuple[dict[Path, str], str]:
    """Return why inputs that can hold readings were not used, and a sentence about all other files."""
    said = (
        "{file}: a table whose columns are not certain, which no search reads: `levilab open {typed}` asks for them, "
        "and keeps an answer with --columns and --keep"
    )
    used = {source.path for _, found in results for source in found.sources}
    workbooks = {locate(path)[0] for path in used}  # of which sheets are read
    skipped = dict.fromkeys(one for _, found in results for one in found.skipped)  # not all analyses search all folders
    unread = {one.path: _with_command(one, one.path) for one in skipped if isinstance(one, Skipped) and one.path}
    left_out = [one for one in skipped if isinstance(one, LeftOut) and one.path not in used | workbooks]
    for folder in [path for path in unread if path.is_dir() and not (path / RECORD).exists()]:
        if files := data_files(folder):  # each has its own reason
            left_out += [LeftOut(file, kind_of_unused(file)) for file in files]
            del unread[folder]
    for one in left_out:
        if one.kind == OTHER_COLUMNS or (one.why and len(results) > 1):
            unread.setdefault(one.path, Text(said, file=str(one.path), typed=as_typed(one.path)))
        elif one.kind.may_hold_readings:
            why = Text("{file:s}: {kind} ({advice})", str(one.path), kind=one.kind.name, advice=one.kind.advice)
            unread.setdefault(one.path, one.why or why)
    named = [LeftOut(path, kind_of_unused(path)) for path in unread if path.is_file()]
    others = [one for one in {*named, *left_out} if not one.kind.may_hold_readings]
    others.sort(key=lambda one: one.path)
    names = tuple(one.path.name for one in others)
    about = Text("without readings: {kinds} ({names:s})", number_by_kind(others), names) if others else ""
    left_out_paths = {one.path for one in others}
    return {path: unread[path] for path in sorted(unread) if path not in used | left_out_paths}, about


def _with_command(one: Skipped, path: Path) -> str:
    """Return why an input cannot be used, with the command that answers its question."""
    said = '{reason}: levilab open {typed:s} --columns "{answer:s}" --keep answers so for all commands'
    return Text(said, one.reason, as_typed(path), one.answer) if one.answer else one.reason


def _why_unread(path: Path, why: str) -> Text:
    """Return why an input was not read."""
    with suppress(DataError):
        if Run.load(path).status == "interrupted":
            return Text("not read, and the run was interrupted: {problem}", problem=plain_text(why))
    return Text("not read: {problem}", problem=plain_text(why))


def _copies(results: Results) -> dict[Path, Path]:
    """Return the inputs that were left out, each with the input whose readings it holds."""
    texts = (text for _, found in results for text in found.warnings)
    notes = (text for text in texts if isinstance(text, OneNote) and text.kind == "same readings")
    return {note.paths[0]: note.paths[1] for note in notes}


def _of_two_groups(path: Path, first: Path, folder_of: Callable[[Path], str]) -> bool:
    """Return whether two inputs are of two groups: copies of one group, or without a group, are one input."""
    return folder_of(path) != folder_of(first) and bool(folder_of(path) and folder_of(first))


def _same_as(other: str) -> str:
    return Text("holds the same readings as {other:s}: a group needs a seed or a file of its own", other)


def _with_copies(of: Class, copies: Mapping[str, Path]) -> Class:
    """Return a class whose groups have a remark on each other group with the same readings."""
    groups = []
    for group in of.groups:
        remarks = [_same_as(name) for name, first in copies.items() if first == group.source.path]
        groups.append(replace(group, warnings=(*group.warnings, *remarks)))
    return replace(of, groups=tuple(groups))


def _with_folders_as_groups(results: Results, folder_of: Callable[[Path], str]) -> Results:
    """Return results in the order of their groups, where files have that of their folder, as Anna/readings.csv."""
    done = []
    for analysis, found in results:
        each = [one if one.run else replace(one, folder=folder_of(one.path)) for one in found.sources]
        sources = by_group(sorted(each, key=lambda one: [*natural(one.path.name)]))
        numbers = [*map([one.name for one in each].index, (one.name for one in sources))]
        ordered = _of_sources(analysis, [found], [found.sources[k] for k in numbers], found.warnings, numbers)
        named = with_short_names(sources) if any(one.folder for one in sources) else ordered.sources
        done.append((analysis, replace(ordered, sources=named)))
    return done


def _folders_of_groups(results: Results, unread: Iterable[Path], paths: Sequence[Path]) -> Callable[[Path], str]:
    """Return the function file → its folder below the deepest one of all inputs, empty there; run → its group."""
    used = (one.path for _, found in results for one in found.sources if not one.run)
    files = {path: locate(path)[0].resolve() for path in (*used, *unread)}
    folders = {path: file.parent.parts for path, file in files.items() if not (file / RECORD).exists()}
    of_runs = [one.path.resolve().parent.parts for _, found in results for one in found.sources if one.run]
    common = takewhile(lambda parts: len({*parts}) == 1, zip(*folders.values(), *of_runs, strict=False))
    depth = len([*common]) - (len(files) == 1 and not of_runs and files.keys().isdisjoint(paths))  # of one group alone
    groups = {path: _group_in(file) for path, file in files.items() if path not in folders}
    return lambda path: groups.get(path) or "".join(folders.get(path, ())[depth : depth + 1])


def _group_in(run: Path) -> str:
    """Return the group of a run; empty where its record cannot be read."""
    try:
        return read_record(run).group
    except DataError:
        return ""


def _names_of_unread(paths: Sequence[Path], results: Results, folder_of: Callable[[Path], str]) -> list[str]:
    """Return names of inputs that could not be used: the folder of a group that has no other one, or a short path."""
    folders = [*map(folder_of, paths)]
    known = Counter([*folders, *(source.group for _, found in results for source in found.sources)])
    for files in ([path.name for path in paths], short_paths(paths)):
        names = [
            folder if folder and known[folder] == 1 else ", ".join(filter(None, [folder, file]))
            for file, folder in zip(files, folders, strict=True)
        ]
        if len({*names}) == len(names):
            break
    return names


def _each_reading_once(results: Results) -> Results:
    """Return one result of each analysis, with the same readings once, as a mean would count them twice, and a note."""
    joined: dict[str, tuple[Analysis[Any], Any]] = {}
    for analysis, found in results:
        _, first = joined.get(analysis.name, (analysis, None))
        joined[analysis.name] = analysis, _with_other_readings(analysis, first, found) if first else found
    return [*joined.values()]


def _without_spins_of_falls(results: Results) -> Results:
    """Return results without spin frequencies of inputs whose fall is analyzed: a fall has no common frequency."""
    falls = {source.path for analysis, found in results if analysis.name == "spindown" for source in found.sources}
    kept = []
    for analysis, found in results:
        sources = [one for one in found.sources if analysis.name != "spin" or one.path not in falls]
        if len(sources) == len(found.sources):
            kept.append((analysis, found))
        elif sources:
            kept.append((analysis, _of_sources(analysis, [found], sources, found.warnings)))
    return kept


def _of_sources(
    analysis: Analysis[A],
    results: Sequence[A],
    sources: Sequence[Source[Any]],
    warnings: Iterable[str],
    order: Sequence[int] = (),
) -> A:
    """Return the result of some inputs of results; order: the numbers of all inputs of one result in another order."""
    done = {
        source.name: (source, run, origin)
        for one in results
        for source, run, origin in zip(one.sources, one.runs, one.origins, strict=True)
    }
    skipped = tuple(skipped for one in results for skipped in one.skipped)
    together = Found(tuple(sources), tuple(warnings), skipped)
    paths = [source.path for source in sources]
    recall = (lambda _: analysis.renumber(results[0].combined, order)) if order else None
    return analysis.gather(paths, together, results[0].options, lambda source: done[source.name], recall)


def _with_other_readings(analysis: Analysis[A], first: A, found: A) -> A:
    """Return a result together with those inputs of another one whose readings it has not, and a note of the rest."""
    said = "{names:s}: not counted, as {first:s} is a result of the same readings; levilab report shows all"
    known = {source.sha256: source.name for source in first.sources}
    again = {source.name: known[source.sha256] for source in found.sources if source.sha256 in known}
    note = of_file("repeated", Text(said, names=(*again,), first=(*again.values(),)))
    sources = (*first.sources, *(source for source in found.sources if source.name not in again))
    warnings = (*first.warnings, *found.warnings, *([note] if again else []))
    return _of_sources(analysis, [found, first], sources, warnings)


def _subject(of: Class) -> str:
    return of.analysis.part(of.found).subject


def _notes_of(classes: Sequence[Class]) -> list[str]:
    """Return what to know of the inputs, with the analysis where there are several and the text names no input."""
    return [
        text
        if len(classes) == 1 or getattr(text, "names_input", False)
        else Text("{subject}: {text}", subject=_subject(of), text=text)
        for of in classes
        for text in of.found.warnings
    ]


def _blocks(of: Class, *, deeper: bool) -> Iterator[Block]:
    def section(title: str, anchor: str, *blocks: Block) -> Section:
        return Section(title, blocks, anchor=f"{of.analysis.name}-{anchor}" if deeper else anchor)

    tables = (_values(of, one) for one in of.quantities)
    agree: list[Block] = [Paragraph(text)] if (text := agreement(of)) else []
    agree += [Details("Statistics", (Paragraph(text),))] if (text := statistics_of_agreement(of)) else []
    yield section("Result", "result", Verdict(verdict(of)), *_marks(of), *tables, *agree)
    if of.quantities and len(of.groups) > 1:
        yield section("Figure", "figure", _picture(of))
    yield section("Runs", "runs", _groups(of))
    pairs = zip(of.groups, of.marks, strict=True)
    if remarks := tuple(Fact(group.source.name, one.notes) for group, one in pairs if one.notes):
        yield section("Remarks of the analysis", "remarks", Facts(remarks))
    noted = [group.source for group in of.groups if group.source.note]
    if noted:
        notes = tuple(Fact(source.name, (verbatim(source.note),)) for source in noted)
        yield section("Notes of the groups", "notes-of-groups", Facts(notes))


def _each(of: Class) -> list[tuple[str, Mark]]:
    """Return the name and the mark of each group, and of what was not read."""
    return [*zip((group.source.name for group in of.groups), of.marks, strict=True), *of.unread.items()]


def _marks(of: Class) -> Iterator[Tabular]:
    """Yield a row for each group whose result is not good, and why; nothing where all are."""
    rows = [
        Row((name, mark.word, Sentences(*mark.why, between="\n")), _ROWS[mark.word])
        for name, mark in _each(of)
        if mark.word != GOOD
    ]
    note = Text(
        "repeat: not read, no value, one more than {far:.0f} u from its truth or far beyond what tops differ by, or a "
        "doubt about the readings; look: a warning, another group's readings, or, where no truth is known, more than "
        "{far:.0f} u from the others.",
        far=FAR,
    )
    if rows:
        shown = table("", ["group", "result", "why"], rows)
        yield Tabular(f"{of.analysis.name}-marks", shown, note, first_column_wraps=True, wraps=("why",), narrow="stack")


def _short_table(of: Class) -> Table:
    """Return a row for each group: its mark, and the value that is compared first."""
    shown = [
        (one.head, [one.show(each.value, each.u) if each else None for each in one.estimates]) for one in of.quantities
    ]
    head, estimates = shown[0] if shown else ("", [None] * len(of.groups))
    values = [*column(estimates), *[""] * len(of.unread)]
    rows = [(name, mark.word, value) for (name, mark), value in zip(_each(of), values, strict=True)]
    return table(_subject(of), ["group", "result", head], rows, numbers=[head])


def _values(of: Class, quantity: Compared) -> Tabular:
    """Return a row for each group: its value, how far it lies from the others, and from the truth."""
    unread = [None] * len(of.unread)
    estimates = [*(quantity.show(one.value, one.u) if one else None for one in quantity.estimates), *unread]
    mean, difference = (
        quantity.show(one.value, one.u) if one else None for one in (quantity.mean, quantity.difference)
    )
    marks = [*(mark.word for _, mark in _each(of)), "", ""]
    columns = [column([*estimates, mean, difference]), [*map(_distance, [*quantity.from_class, *unread]), "", ""]]
    heads = ["group", quantity.head, _FROM_CLASS]
    if of.knows_truth:
        truth, distance, _ = quantity.truth or (None, None, None)
        columns += [
            [*map(truth_text, map(quantity.show, (*quantity.truths, *unread, truth)), (*estimates, mean)), ""],
            [*map(_distance, [*quantity.from_truth, *unread]), "", _distance(distance)],
        ]
        heads += [_TRUTH, _FROM_TRUTH]
    columns, numbers, heads = [marks, *columns], heads[1:], [heads[0], "result", *heads[1:]]  # what a phone shows first
    names = [*(name for name, _ in _each(of)), "class mean", "mean − truth"]
    kinds = [*(_ROWS[mark.word] for _, mark in _each(of)), "together", "together"]
    rows = [Row(cells, kind) for kind, cells in zip(kinds, zip(names, *columns, strict=True), strict=True)]
    several = len(of.groups) > 1
    rows = rows[: len(estimates) + (several and mean is not None) + (several and difference is not None)]
    note = "value(u): the digits in parentheses are u of the last digits."
    limits = quantity.limits(FAR)
    if max(limits) > FAR:
        said = (
            "u comes from few repetitions: only a value more than {far:.1f} u from its truth is far off (Student's t); "
            "distances from the others allow for that."
        )
        note = Sentences(note, Text(said, far=max(limits)))
    if difference and several:
        note = Sentences(note, "mean − truth: each top has its own truth, so their differences are not in this u.")
    if mean and any(one and not use for one, use in zip(quantity.estimates, quantity.used, strict=True)):
        note = Sentences(note, "The mean is without results to repeat.")
    name = f"{of.analysis.name}-{quantity.name.replace('_', '-')}"
    return Tabular(name, table("", heads, rows, numbers=numbers), note, first_column_wraps=True, narrow="turn")


def truth_text(truth: Estimate | None, estimate: Estimate | None) -> str:
    """Return a truth with as many digits as the estimate beside it."""
    if truth is None:
        return "—"
    return re.sub(r"\(.*\)", "", without_unit(replace(truth, u=estimate.u if estimate else None)))


def _distance(distance: float | None) -> str:
    return "—" if distance is None else with_sign(distance, 1)


def _groups(of: Class) -> Tabular:
    """Return a row for each group: its seed, its readings, how well the law fits them, its folder."""
    shown = f" [{unit}]" if (unit := unit_of_residuals(of.analysis)) else ""
    heads = ["group", "seed", "readings", Text("rms residual{unit:s}", unit=shown), "χ²/dof", "best law", "run"]
    rows = [
        (
            group.source.name,
            str(group.source.run.record.seed) if group.source.run and group.source.run.record.seed is not None else "",
            str(count_readings(group)),
            plain(group.statistics.get("rms_residual")),
            plain(group.statistics.get("reduced_chi_square"), 2),
            group.best_model,
            verbatim(place),
        )
        for group, place in zip(of.groups, of.places, strict=True)
    ]
    full = [k for k in range(len(heads)) if any(row[k] not in {"", "—"} for row in rows)]
    heads, rows = [heads[k] for k in full], [tuple(row[k] for k in full) for row in rows]  # type: ignore[misc]
    note = Text("Residuals are those of the law {law}, whose constants are compared.", law=of.model) if of.model else ""
    note = of.analysis.common or note
    if of.others:
        laws = enumeration([Text("{name:s} ({law})", name=name, law=law) for name, law in of.others.items()])
        other = Text("The seeds of these groups have another law, and so no truth to compare with: {laws}.", laws=laws)
        note = Sentences(note, other)
    numbers = [head for head in heads if head not in {"group", "run", "best law"}]
    return Tabular(f"{of.analysis.name}-groups", table("", heads, rows, numbers=numbers), note, first_column_wraps=True)


def _picture(of: Class) -> Picture:
    truth = "; diamonds are the truth that each seed made, and the last panel has the distance from it" * of.knows_truth
    mean = ", and the mean of the class" * any(one.mean for one in of.quantities)
    return Picture(
        name=f"{of.analysis.name}-class",
        title="The class.",
        caption=Text("Each group's value with its u{mean}{truth}.", mean=mean, truth=truth),
        alt=finding(of),
        draw=partial(_draw, of),
    )


def _draw(of: Class) -> Figure:
    from levilab.report.groups.figure import class_figure  # with matplotlib

    return class_figure(of)


def _made_by(paths: Sequence[Path], name: str) -> Note:
    typed = " ".join([*(shlex.quote(str(path)) for path in paths), *language_option()])
    each = "each group's readings, figure and budget of uncertainties are in that of levilab report"
    return Note(Text("Made by: levilab class {paths:s} -o {out:s}; {each}.", typed, shlex.quote(name), each))


SPREADSHEET = ".xlsx"


def write_class(
    paths: Sequence[Path],
    output: Path,
    given: Mapping[str, Any] | None = None,
    *,
    tell: Callable[[str], None] = lambda _: None,
    show: Callable[[Table], None] = lambda _: None,
    heading: Heading | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Path:
    """Put the groups of a class beside each other; what has no result yet is analyzed, and nothing is stored.

    Args:
        paths: run folders, data files, folders to search.
        output: the file to write; its ending, .html, .pdf or .xlsx, chooses the format.
        given: options of analyses by their names.
        tell: called with what lies there and is of no use.
        show: called with a table of the groups by each analysis.
        heading: title, course, authors and date above it.
        progress: called with the share of the inputs that are analyzed.

    Returns:
        The file.

    Raises:
        DataError: there is no run.
        UsageError: of the output's name.
        NoTypst: PDF, and the extra `pdf` is not installed.
        CannotWrite: of the output.
    """
    check_ending(output, (*FORMATS, SPREADSHEET))
    form = FORMATS.get(output.suffix.lower())
    if form:
        form.check()
    with writing_report(output):
        check_writable(output)
    results = _without_spins_of_falls(
        _each_reading_once(recall_suiting(paths, given or {}, skips=True, progress=progress))
    )
    unread, others = _left_out(results)
    copies = _copies(results)
    used = [source.path for _, found in results for source in found.sources]
    runs = [path for path in (*used, *copies, *unread) if (path / RECORD).exists()]
    unread = {path: why for path, why in unread.items() if not (path.is_file() and is_archive_of(path, runs))}
    folder_of = _folders_of_groups(results, [*unread, *copies, *copies.values()], paths)
    results = _with_folders_as_groups(results, folder_of)
    classes = [class_of(analysis, found) for analysis, found in results]
    classes.sort(key=lambda of: -len(of.groups))  # what one group alone measured comes last
    missing = {path: Mark(REPEAT, (_why_unread(path, why),)) for path, why in unread.items()}
    names = {source.path: source.name for _, found in results for source in found.sources}
    copies = {
        path: first for path, first in copies.items() if first in names and _of_two_groups(path, first, folder_of)
    }
    missing |= {path: Mark(LOOK, (_same_as(names[first]),)) for path, first in copies.items()}
    named = dict(zip(missing, _names_of_unread([*missing], results, folder_of), strict=True))
    classes = [_with_copies(of, {named[path]: first for path, first in copies.items()}) for of in classes]
    classes[0] = replace(classes[0], unread={named[path]: mark for path, mark in missing.items()})
    date = newest_of(results)
    if form:
        groups = [folder_of(path) or path.name for path in missing]
        document = (heading or Heading()).above(class_document(classes, paths, output.name, others, groups))
        content = form.content(in_language_of_reader(replace(document, date=date, language=spoken())))
    else:
        content = class_workbook(classes, date)
    write_content(output, content)
    for text in dict.fromkeys([*_notes_of(classes), *([others] if others else [])]):
        tell(text)
    for of in classes:
        show(_short_table(of))
        for name, mark in _each(of):
            if mark.why:
                tell(Text("{subject}: {text}", verbatim(name), Sentences(*mark.why, between="; ")))
    return output
