"""One self-contained HTML page: what was measured, with what, the figures, the numbers, the warnings.

Nothing is fetched when it is opened, and everything that a person typed is escaped by the template.
"""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

from levilab.errors import UsageError, unquoted
from levilab.files import CannotWrite, replace_atomically
from levilab.pipelines.catalogue import Analysis, recall_suiting
from levilab.report.inputs import describe
from levilab.runs.run import utc_now
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from levilab.pipelines.analyzed import A, Analyzed


class UnknownFormat(UsageError):
    """A report in a format that is not written."""


def write_report(
    paths: Sequence[Path],
    output: Path,
    given: Mapping[str, Any] | None = None,
    tell: Callable[[str], None] | None = None,
) -> Path:
    """Report what was found of the inputs at the paths; what has no result yet is analyzed, and nothing is stored.

    given: options by their names; those at their defaults count as not given, see
    `levilab.pipelines.document.Document.recall`; tell: called with what lies there and is not in the report.
    Raises DataError, UnknownFormat, CannotWrite.
    """
    if output.suffix.lower() not in {".html", ".htm"}:
        expected = "reports are written as HTML, name the file report.html; a browser prints it to PDF"
        raise UnknownFormat("output", expected, value=output)
    analysis, found = recall_suiting(paths, given or {})
    page = render(analysis, found)
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        replace_atomically(output, page)
    except OSError as error:
        raise CannotWrite(
            f"{output}: could not be written ({error.strerror or error}): choose another place with `output`"
        ) from error
    if tell and found.remarks:
        for remark in found.remarks:
            tell(remark)
        tell(f"a report is of one analysis, here {analysis.name}: for others name their runs")
    return output


def render(analysis: Analysis[A], found: A) -> str:
    """The page's text."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("levilab", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    part = analysis.part(found)
    return environment.get_template("report/page.html.j2").render(
        part=part,
        banner=_banner(found),
        inputs=[describe(*pair) for pair in zip(found.sources, part.inputs, strict=True)],
        figure=_as_image(analysis.svg(found)),
        warnings=[unquoted(text) for text in found.all_warnings],
        software=software_versions(),
        written=utc_now()[:19].replace("T", " ") + " UTC",
    )


def _banner(found: Analyzed[Any, Any, Any, Any]) -> tuple[str, str] | None:
    """Which inputs are synthetic, and what that does to the result."""
    total, made_up = len(found.sources), [source.name for source in found.sources if source.synthetic]
    if not made_up:
        return None
    below = "How it was made stands below, under its name."
    if total == 1:
        return "SYNTHETIC.", f"This run did not come from a real bench. {below}"
    below = "How each was made stands below, under its name."
    if len(made_up) == total:
        return "SYNTHETIC.", f"None of these {total} runs came from a real bench. {below}"
    said = f"{len(made_up)} of {total} runs did not come from a real bench ({', '.join(made_up)})"
    mixed = "Means, comparisons and figure are of both together and so no measurement: report the real runs "
    return "REAL AND SYNTHETIC RUNS MIXED.", f"{said}. {mixed}by themselves. {below}"


def _as_image(svg: str) -> str:
    """An SVG as a data address: it keeps its ids to itself and runs no script."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode()
