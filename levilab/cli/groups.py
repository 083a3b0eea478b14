"""A class.  Heavy imports happen inside the commands that need them."""

from pathlib import Path
from typing import Annotated, Any

import typer

from levilab.cli.analyze import takes_options
from levilab.cli.options import Author, Course, Date, Paths, Title, place, writable
from levilab.cli.output import interruptible, message, result
from levilab.cli.quantities import with_options
from levilab.pipelines.options import OF_REPORT, read_options


@takes_options(OF_REPORT)
def of_class(
    context: typer.Context,
    paths: Paths = None,
    out: Annotated[
        Path, place("FILE", "The file to write; its ending is .html, .pdf or .xlsx.", callback=writable)
    ] = Path("class.html"),
    title: Title = "",
    course: Course = "",
    author: Author = "",
    date: Date = "",
    **given: Any,
) -> None:
    """Put the groups of a class beside each other."""
    from levilab.report.groups.write import write_class
    from levilab.report.heading import Heading

    app = context.find_root().command
    with interruptible("nothing is written"):
        written = write_class(
            paths or (),
            out,
            read_options(given, typed=True),
            lambda text: message(with_options(text, app)),
            Heading(title, course, author, date),
        )
    result(f"the class is in {written}")
