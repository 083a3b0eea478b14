"""A report is written: what lies at some paths becomes one document, in the format that the file's name says.

Nothing is fetched when it is opened, what a person typed is never markup, and the same inputs give the same bytes.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any

from levilab.errors import DoesNotSuit, check_ending
from levilab.files import check_writable, replace_atomically, writing
from levilab.pipelines.analyzed import A
from levilab.pipelines.document import Analysis
from levilab.pipelines.inputs.files import data_files
from levilab.pipelines.inputs.unread import NoneUsable, SkippedRuns, skipped_by_all, texts_of
from levilab.pipelines.recall import recall_suiting
from levilab.present.clock import local
from levilab.present.document.blocks import Document, in_language_of_reader
from levilab.report.document import Results, document_of, notebook_blocks
from levilab.report.html.page import fragment_of, page_of
from levilab.report.kinds import KINDS, Kind
from levilab.report.pdf.renderer import as_pdf, check_typst
from levilab.report.reproduction import Asked, Heading
from levilab.report.tables.values import Values, folder_of, of_analysis, write_tables
from levilab.runs.find import find_runs
from levilab.texts.text import spoken

#: Each kind of input with those that were found.
Found = Sequence[tuple[Kind, Sequence[Path]]]


@dataclass(frozen=True)
class Format:
    """A format of reports.

    Attributes:
        ending: of the file's name.
        content: of the file, from a document.
        check: raises LevilabError if what it needs is not installed, before anything is analyzed.
    """

    ending: str
    content: Callable[[Document], str | bytes]
    check: Callable[[], None] = lambda: None


_HTML, _PDF = Format(".html", page_of), Format(".pdf", as_pdf, check_typst)
#: The end of a file's name → its format.
FORMATS: Mapping[str, Format] = MappingProxyType({".html": _HTML, ".htm": _HTML, ".pdf": _PDF})


def write_report(
    paths: Sequence[Path],
    output: Path,
    given: Mapping[str, Any] | None = None,
    tell: Callable[[str], None] = lambda _: None,
    *,
    tables: bool = False,
    crosscheck: bool = False,
    short: bool = False,
    heading: Heading | None = None,
) -> Path:
    """Report what was found of the inputs at the paths; what has no result yet is analyzed, and nothing is stored.

    Args:
        paths: run folders, data files, folders to search, results, simulated motions, sweeps.
        output: the file to write; its ending chooses the format.
        given: options by their names; those at their defaults count as not given, see
            `levilab.pipelines.document.Analysis.recall_found`.
        tell: called with what lies there and is not in the report, and with what has no result.
        tables: whether tables of the results are written, too, into the folder that `folder_of` names.
        short: whether answer, values, figure and notes are all of it.
        heading: title, course, authors and date above it.
        crosscheck: whether one is made where none lies beside the result and it takes two seconds at most.

    Returns:
        The file.

    Raises:
        DataError: nothing can be reported of.
        UsageError: of the output's name.
        NoTypst: PDF, and the extra `pdf` is not installed.
        CannotWrite: of the output.
    """
    form = format_of(output)  # before what takes long
    others, left = _sorted_by_kind(paths)
    sections = [section for kind, found in others for section in kind.sections(found)]
    results = _results(left, given or {}, tell, needed=not others)
    heading = heading or Heading()
    asked = Asked(paths, output.name, given or {}, crosscheck, short, heading)
    document = heading.above(document_of(results, sections, asked))
    document = replace(document, date=newest_of(results, others))
    content = form.content(in_language_of_reader(replace(document, language=spoken())))
    write_content(output, content)
    if tables:
        write_tables(document, _values(results, others, folder_of(output)), folder_of(output))
    for text in _skipped(results, others):
        tell(text)
    return output


def format_of(output: Path) -> Format:
    """Return the format that a file's name asks for.

    Raises:
        UsageError: there is no such format.
        NoTypst: PDF, and the extra `pdf` is not installed.
        CannotWrite: of the file.
    """
    check_ending(output, FORMATS)
    form = FORMATS[output.suffix.lower()]
    form.check()
    with writing_report(output):
        check_writable(output)
    return form


def write_content(output: Path, content: str | bytes) -> None:
    """Write a report, also into a folder that is not there yet.  Raises CannotWrite."""
    with writing_report(output):
        output.parent.mkdir(parents=True, exist_ok=True)
        replace_atomically(output, content)


def writing_report(output: Path) -> AbstractContextManager[None]:
    """Explain errors of writing a report."""
    return writing(output, "choose another place with `out`")


def _sorted_by_kind(paths: Sequence[Path]) -> tuple[Found, list[Path]]:
    """Return each kind of input that is no measurement, with those at the paths; and the paths for the analyses."""
    inputs = {path: [(kind, kind.find(path)) for kind in KINDS] for path in paths}
    found = [
        (kind, list(dict.fromkeys(one for of_path in inputs.values() for one in dict(of_path)[kind]))) for kind in KINDS
    ]
    taken = {path: {one for _, places in of_path for one in places} for path, of_path in inputs.items()}
    left = [path for path in paths if not taken[path] or (path.is_dir() and _holds_more(path, taken[path]))]
    return [(kind, places) for kind, places in found if places], left


def _results(paths: Sequence[Path], given: Mapping[str, Any], tell: Callable[[str], None], *, needed: bool) -> Results:
    """Return what was found of the measurements at the paths; none where there are none and none are needed."""
    try:
        return recall_suiting(paths, given, skips=True) if paths or needed else []
    except (DoesNotSuit, NoneUsable) as error:
        if needed:
            raise
        for one in error.skipped if isinstance(error, NoneUsable) else ():
            tell(one.note)
        return []


def _holds_more(folder: Path, taken: Collection[Path]) -> bool:
    """Return whether a folder holds more than inputs of the other kinds."""
    return folder not in taken and (any(run not in taken for run in find_runs(folder)) or bool(data_files(folder)))


def newest_of(results: Results, others: Found = ()) -> datetime | None:
    """Return when the newest of the inputs ended; None where none of them says."""
    records = [source.run.record for _, found in results for source in found.sources if source.run]
    texts = [record.ended_utc or record.started_utc for record in records]
    texts += [kind.when(path) for kind, found in others for path in found]
    newest = max(filter(None, map(local, texts)), default=None)
    return newest.astimezone(UTC) if newest else None


def _values(results: Results, others: Found, folder: Path) -> Iterator[Values]:
    """Yield the tables for programs."""
    for analysis, found in results:
        yield from of_analysis(analysis, found, folder)
    for kind, places in others:
        yield from kind.tables(places)


def _skipped(results: Results, others: Found) -> list[str]:
    """Return what lies there and is not in the report: inputs that cannot be used each by itself."""
    reported = {kind.experiment for kind, _ in others}
    skipped = skipped_by_all([found.skipped for _, found in results])
    return texts_of([one for one in skipped if not (isinstance(one, SkippedRuns) and one.experiment in reported)])


def render(results: Results) -> str:
    """Return the HTML page of results."""
    return page_of(document_of(results))


def render_part(analysis: Analysis[A], found: A) -> str:
    """Return what one analysis found, as a part of a page that is not ours, such as a notebook."""
    return fragment_of(notebook_blocks(analysis, found), prefix=f"levilab-{_digest(found)}-")


def _digest(found: Any) -> str:
    """Return letters that differ where the inputs do: ids of two results in one notebook do not meet."""
    return sha256("".join(source.sha256 for source in found.sources).encode()).hexdigest()[:8]
