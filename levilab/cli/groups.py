"""A class.  Heavy imports happen inside the commands that need them."""

from pathlib import Path
from typing import Annotated, Any

from levilab.cli.analyze import LINE_EVERY_S, takes_options
from levilab.cli.options import HEADING, Language, Paths, among, argument, flag, option, place
from levilab.cli.output import interruptible, message, place_of_report, result
from levilab.errors import UsageError
from levilab.pipelines.options import OF_REPORT, read_options
from levilab.report.worksheets.sheets import SHEETS
from levilab.texts.text import Text


def _read_sheets(names: list[str] | None) -> list[str]:
    """Return the experiments that are named; the keys of all four take minutes, and are not made by accident."""
    if not names:
        text = Text("name some of {sheets:s}, as levilab worksheet spin, or all", sheets=(*SHEETS,))
        raise UsageError("EXPERIMENT", text)
    named: list[str] = among([*SHEETS, "all"], "experiment")(names)
    return [*SHEETS] if "all" in named else named


@takes_options(OF_REPORT, HEADING)
def of_class(
    paths: Paths = None,
    out: Annotated[
        Path, place("FILE", "The file to write; its ending is .html, .pdf or .xlsx.", (".html", ".pdf", ".xlsx"))
    ] = Path("class.html"),
    language: Language = "en",  # noqa: ARG001 - its callback speaks it
    **given: Any,
) -> None:
    """Put the groups of a class beside each other."""
    from levilab.present.progress import ShareBar
    from levilab.present.terminal import draw, terminal
    from levilab.report.groups.document import write_class
    from levilab.report.reproduction import Heading

    place = place_of_report(out, "the class is in {file:s}")
    heading = Heading(**{one.name: given.pop(one.name) for one in HEADING})
    with interruptible("nothing is written"):
        options, show = read_options(given, typed=True), lambda one: terminal().print(draw(one))
        bar = ShareBar("inputs", line_every=LINE_EVERY_S)
        try:
            write_class(paths or (), out, options, tell=message, show=show, heading=heading, progress=bar)
        finally:
            bar.close()
    result(place)


def worksheet(
    experiments: Annotated[
        list[str] | None,
        argument("EXPERIMENT", f"Of {', '.join(SHEETS)}; or all.", callback=_read_sheets, show_default=False),
    ] = None,
    out: Annotated[Path, place("DIR", "Where the files are written.")] = Path("worksheets"),
    groups: Annotated[int, option("N", "How many, each with its seed.", min=1, max=500)] = 20,
    seed: Annotated[int, option("N", "Of the first group; the next ones count up.", min=0)] = 1,
    language: Language = "en",
    pdf: Annotated[bool, flag(r"PDF instead of HTML; needs levilab\[pdf].", "--pdf")] = False,
    keys: Annotated[bool, flag("Keys for the teacher, beside the worksheets.", "--key/--no-key")] = True,
) -> None:
    """Write worksheets and keys."""
    from levilab.report.worksheets.document import read_language, write_worksheets

    name = read_language(language).words["group"].capitalize()
    seeds = {f"{name} {k + 1}": seed + k for k in range(groups)}
    with interruptible("keys that are not finished are not written"):
        ending = ".pdf" if pdf else ".html"
        files = write_worksheets(
            experiments or (), out, seeds, language=language, ending=ending, keys=keys, tell=message
        )
    for file in files:
        result(str(file))
