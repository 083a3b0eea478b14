"""A report is written: what lies at some paths becomes one document, in the format that the file's name says.

Nothing is fetched when it is opened, what a person typed is never markup, and the same inputs give the same bytes.
"""

from __future__ import annotations

from hashlib import sha256
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from levilab.errors import DoesNotSuit, NoneUsable, UsageError
from levilab.files import replace_atomically, writing
from levilab.pipelines.catalogue import recall_suiting, remarks
from levilab.pipelines.document import NO_RESULT
from levilab.report.document import document_of, list_in_words, notebook_blocks
from levilab.report.html.page import fragment_of, page_of
from levilab.report.kinds import KINDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from levilab.pipelines.analyzed import A
    from levilab.pipelines.catalogue import Analysis
    from levilab.present.document.blocks import Document, Section
    from levilab.report.document import Results

#: The end of a file's name → how a document becomes its content.
FORMATS: Mapping[str, Callable[[Document], str | bytes]] = MappingProxyType({".html": page_of, ".htm": page_of})


class UnknownFormat(UsageError):
    """A report in a format that is not written."""


def write_report(
    paths: Sequence[Path],
    output: Path,
    given: Mapping[str, Any] | None = None,
    tell: Callable[[str], None] | None = None,
) -> Path:
    """Report what was found of the inputs at the paths; what has no result yet is analyzed, and nothing is stored.

    Args:
        paths: run folders, data files, folders to search, results.
        output: the file to write.
        given: options by their names; those at their defaults count as not given, see
            `levilab.pipelines.document.Document.look`.
        tell: called with what lies there and is not in the report, and with what has no result.

    Returns:
        The file.

    Raises:
        DataError: nothing can be reported of.
        UnknownFormat: of the output's name.
        CannotWrite: of the output.
    """
    form = FORMATS.get(output.suffix.lower())
    if form is None:
        expected = "reports are written as HTML, name the file report.html; a browser prints it to PDF"
        raise UnknownFormat("output", expected, value=output)
    others, left = _of_other_kinds(paths)
    results = _results(left, given or {}, tell, needed=not others)
    content = form(document_of(results, others))
    with writing(f"{output}: could not be written", "choose another place with `output`"):
        output.parent.mkdir(parents=True, exist_ok=True)
        replace_atomically(output, content)
    if tell:
        for remark in remarks([found.remarks for _, found in results]):
            tell(remark)
        for text in _without_result(results):
            tell(text)
    return output


def _results(
    paths: Sequence[Path], given: Mapping[str, Any], tell: Callable[[str], None] | None, *, needed: bool
) -> Results:
    """What was found of the measurements at the paths; none where there are none and none are needed."""
    try:
        return recall_suiting(paths, given, tell) if paths or needed else []
    except (DoesNotSuit, NoneUsable):
        if needed:
            raise
        return []


def _of_other_kinds(paths: Sequence[Path]) -> tuple[list[Section], list[Path]]:
    """The sections of inputs that are no measurement, and the paths that may hold measurements, too."""
    sections: list[Section] = []
    inputs = {path: [(kind, kind.find(path)) for kind in KINDS] for path in paths}
    for kind in KINDS:
        found = [one for of_path in inputs.values() for this, places in of_path if this is kind for one in places]
        sections += kind.sections(found) if found else ()
    only = {path for path, of_path in inputs.items() if any(path in places for _, places in of_path)}
    return sections, [path for path in paths if path not in only]


def _without_result(results: Results) -> Iterator[str]:
    """What was analyzed for the page since it has no result where it lies."""
    lacking = {
        source.name: None
        for _, found in results
        for source, origin in zip(found.sources, found.origins, strict=True)
        if origin.text.endswith(NO_RESULT)
    }
    if lacking:
        yield (
            f"no result lies beside {list_in_words([*lacking])}: analyzed for the page; if levilab analyze wrote one "
            "elsewhere (`out`), give that folder or file"
        )


def render(results: Results) -> str:
    """The HTML page of results."""
    return page_of(document_of(results))


def render_part(analysis: Analysis[A], found: A) -> str:
    """What one analysis found, as a part of a page that is not ours, such as a notebook."""
    return fragment_of(notebook_blocks(analysis, found), prefix=f"levilab-{_digest(found)}-")


def _digest(found: Any) -> str:
    """Letters that differ where the inputs do: ids of two results in one notebook do not meet."""
    return sha256("".join(source.sha256 for source in found.sources).encode()).hexdigest()[:8]
