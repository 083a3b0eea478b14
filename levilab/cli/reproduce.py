"""The thesis's tables and figures, computed again.  Heavy imports happen inside the command."""

import contextlib
from pathlib import Path
from typing import Annotated

import typer

from levilab.cli import exit_codes
from levilab.cli.options import Json
from levilab.cli.output import interruptible, place_of_report, print_json, result


def reproduce(
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help=r"The report; its ending, .html or .pdf, chooses the format.  PDF needs levilab\[pdf].",
            show_default="reproduce.html, and none with --json",
        ),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(
            metavar="CHAPTER,…",
            help="These chapters alone: stability, limits, paths, driven, spindown, statistics, dipole, errata, "
            "beyond, simon, gans.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Make the chapters, print them, write the report, and end with 1 where something is unexpected.

    All of them take about a minute, the first time half a minute more.
    """
    from levilab.reproduce.run import choose

    wanted = choose(only)  # a wrong name is refused before anything is computed

    from levilab.present.progress import ShareBar
    from levilab.reproduce.report import format_of, write
    from levilab.reproduce.run import document, reproduce

    report = output or (None if as_json else Path("reproduce.html"))
    if report is not None:
        format_of(report)
    place = place_of_report(report) if report is not None else None
    with interruptible("no report is written"):
        with contextlib.closing(ShareBar("reproducing")) as progress:
            found = reproduce(wanted, progress)
        if report is not None:
            write(found, report)
    if as_json:
        print_json(document(found))
    else:
        from levilab.present.terminal import draw, terminal
        from levilab.reproduce.table import findings_table, in_words

        for chapter, of_chapter in found.chapters:
            terminal().print(draw(findings_table(chapter.title, of_chapter.findings)))
        result(in_words(found))
        if place is not None:
            result(place)
    if not found.as_expected:
        raise typer.Exit(exit_codes.FAILED)
