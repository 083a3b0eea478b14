"""One self-contained HTML page: what was measured, with what, the figures, the numbers, the warnings.

Nothing is fetched when it is opened, and everything that a person typed is escaped by the template.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from levilab.errors import UsageError, unquoted
from levilab.files import replace_atomically, writing
from levilab.pipelines.catalogue import recall_suiting, remarks
from levilab.pipelines.document import NO_RESULT
from levilab.report.inputs import About, describe, in_common
from levilab.runs.run import utc_now
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from jinja2 import Template

    from levilab.pipelines.analyzed import A, Analyzed
    from levilab.pipelines.catalogue import Analysis
    from levilab.pipelines.part import ReportPart
    from levilab.pipelines.sources import Source

    Results = Sequence[tuple[Analysis[Any], Any]]

#: Inputs that a message names at most.
MOST_NAMES = 4
#: With more inputs the page is an overview: facts that all share stand there once, the section of each can be opened,
#: and the figure is a PNG, a tenth as large as an SVG of so many lines.
MOST_IN_FULL = 12


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
    if output.suffix.lower() not in {".html", ".htm"}:
        expected = "reports are written as HTML, name the file report.html; a browser prints it to PDF"
        raise UnknownFormat("output", expected, value=output)
    results = recall_suiting(paths, given or {}, tell)
    page = render(results)
    with writing(f"{output}: could not be written", "choose another place with `output`"):
        output.parent.mkdir(parents=True, exist_ok=True)
        replace_atomically(output, page)
    if tell:
        for remark in remarks([found.remarks for _, found in results]):
            tell(remark)
        for text in _without_result(results):
            tell(text)
    return output


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
            f"no result lies beside {_list_in_words([*lacking])}: analyzed for the page; if levilab analyze wrote one "
            "elsewhere (`out`), give that folder or file"
        )


def _list_in_words(names: Sequence[str]) -> str:
    """The names, or the first of them."""
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


@dataclass(frozen=True)
class Section:
    """What the page says of one analysis.

    Attributes:
        part: in its own words.
        count: of its inputs, in words.
        banner: which of them are synthetic, where that matters here.
        figure: as an address of data.
        warnings: in groups of similar ones.
    """

    part: ReportPart
    count: str
    banner: tuple[str, str] | None
    figure: str
    warnings: tuple[tuple[str, ...], ...]


def render_part(analysis: Analysis[A], found: A) -> str:
    """What one analysis found, as a part of a page that is not ours: result, figure, warnings, run by run."""
    section = _section(analysis, found, alone=True)
    made_up = [
        (source.name, source.run.record.synthetic_how or "not said how")
        for source in found.sources
        if source.run and source.run.record.synthetic
    ]
    return _template("report/notebook.html.j2").render(section=section, made_up=made_up)


def render(results: Results) -> str:
    """The page's text."""
    sections = [_section(analysis, found, alone=len(results) == 1) for analysis, found in results]
    abouts: dict[Path, list[About]] = {}
    for (_, found), section in zip(results, sections, strict=True):
        several = len(found.sources) > 1
        for source, part in zip(found.sources, section.part.inputs, strict=True):
            abouts.setdefault(source.path.resolve(), []).append(About(source, section.part, part, several))
    inputs = [describe(of_input) for of_input in abouts.values()]
    many = len(inputs) > MOST_IN_FULL
    common = in_common(inputs) if many else ()
    return _template("report/page.html.j2").render(
        sections=sections,
        many=many,
        common=common,
        banner=sections[0].banner if len(sections) == 1 else _banner([one[0].source for one in abouts.values()]),
        inputs=[one.without(common) for one in inputs],
        counted=counted([one[0].source for one in abouts.values()]),
        software=software_versions(),
        written=utc_now()[:19].replace("T", " ") + " UTC",
    )


def _template(name: str) -> Template:
    """What is typed into it is escaped, and what it lacks is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("levilab", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def _section(analysis: Analysis[Any], found: Analyzed[Any, Any, Any, Any], *, alone: bool) -> Section:
    """alone: there is no other, so that it says which inputs are synthetic even where they are not mixed."""
    many = len(found.sources) > MOST_IN_FULL
    mixes = any(0 < sum(one.synthetic for one in together) < len(together) for together in found.averaged)
    return Section(
        part=analysis.part(found),
        count=counted(found.sources),
        banner=_banner(found.sources, mixed=mixes) if alone or mixes else None,
        figure=_address("image/png", analysis.png(found))
        if many
        else _address("image/svg+xml", analysis.svg(found).encode()),
        warnings=tuple(tuple(map(unquoted, alike)) for alike in found.grouped_warnings),
    )


def _banner(sources: Sequence[Source[Any]], *, mixed: bool = False) -> tuple[str, str] | None:
    """Which inputs are synthetic, and what that does to numbers that are of both together."""
    total, made_up = len(sources), [source.name for source in sources if source.synthetic]
    files = sum(source.run is None for source in sources)
    if not made_up:
        return None
    below = "How it was made stands below, under its name."
    if total == 1:
        return "SYNTHETIC.", f"This run did not come from a real bench. {below}"
    below = "How each was made stands below, under its name."
    if len(made_up) == total:
        return "SYNTHETIC.", f"None of these {total} runs came from a real bench. {below}"
    said = f"{len(made_up)} of {total} runs did not come from a real bench ({_list_in_words(made_up)})."
    if not mixed and files:
        said = f"Of {counted(sources)} {len(made_up)} did not come from a real bench ({_list_in_words(made_up)})."
        return "SYNTHETIC IN PART.", f"{said} A data file does not say where it is from. {below}"
    if not mixed:
        return "REAL AND SYNTHETIC RUNS.", f"{said} {below}"
    consequence = "Means, comparisons and figure are of both together and so no measurement: report the real runs "
    return "REAL AND SYNTHETIC RUNS MIXED.", f"{said} {consequence}by themselves. {below}"


def counted(sources: Sequence[Source[Any]]) -> str:
    """How many inputs of which kind: "4 runs and 1 data file"."""
    files = sum(source.run is None for source in sources)
    kinds = ((len(sources) - files, "run"), (files, "data file"))
    return " and ".join(f"{n} {kind}{'s' * (n > 1)}" for n, kind in kinds if n)


def _address(kind: str, picture: bytes) -> str:
    """A picture as a data address: an SVG keeps its ids to itself and runs no script."""
    return f"data:{kind};base64,{base64.b64encode(picture).decode()}"
