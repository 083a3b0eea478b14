"""The cross-check, and the thesis's tables and figures computed again.  Heavy imports happen inside the commands."""

import contextlib
from pathlib import Path
from typing import Annotated

import typer

from levilab.cli import exit_codes
from levilab.cli.options import Json, among, argument, existing_paths, flag, option, place
from levilab.cli.output import interruptible, message, place_of_report, print_json, result
from levilab.crosscheck.catalogue import ROWS
from levilab.errors import UsageError
from levilab.reproduce.chapters import CHAPTERS


def crosscheck(
    subjects: Annotated[
        list[str] | None,
        argument("SUBJECT", f"Of {', '.join(ROWS)}.", show_default="all", callback=among(ROWS, "subject")),
    ] = None,
    like: Annotated[
        list[Path] | None,
        option(
            "RUN",
            "Make up readings with the values, times, scatter and number of runs of this result, not worlds at "
            "random; repeat it for several runs.  Writes crosscheck.json beside the result, for the report.",
            callback=existing_paths,
        ),
    ] = None,
    trials: Annotated[
        int | None, option("N", "How many trials of each.", min=2, show_default="40; with --like 200")
    ] = None,
    seed: Annotated[
        int | None, option("N", "Of the first trial; the next have the next.", min=0, show_default="0")
    ] = None,
    calibrate: Annotated[
        bool,
        flag(
            "Judge the whole distribution of the ranks of the truths, which is uniform where values and "
            "uncertainties are right, by a simultaneous band; --out writes calibration.png, too.  With 200 trials.",
            "--calibrate",
        ),
    ] = False,
    out: Annotated[Path | None, place("DIR", "Write crosscheck.json and .png there.")] = None,
    as_json: Json = False,
) -> None:
    """Check the analyses, and end with 1 where an estimate or an uncertainty is wrong."""
    from levilab.crosscheck import command
    from levilab.crosscheck.calibration import by_ranks
    from levilab.crosscheck.stored import as_json as as_text
    from levilab.crosscheck.study import by_pulls

    judge = by_ranks if calibrate else by_pulls
    if like:
        if calibrate:
            raise UsageError("calibrate", "does not go with `like`: it is of worlds at random")
        if seed is not None:
            raise UsageError("seed", "does not go with `like`: its trials follow from the readings")
        found = command.study_results(subjects or [], like, trials)
        studies, written = [one for one, _ in found], command.store_beside(found, out)
    else:
        trials = trials or (command.CALIBRATION if calibrate else None)
        studies = command.study_worlds(subjects or [], trials, seed or 0)
        written = [] if out is None else command.write(studies, out, calibrate=calibrate)
    if as_json:
        result(as_text(studies))
    else:
        command.print_studies(studies, judge)
    for path in written:
        message(f"wrote {path}")
    if not all(one.holds_by(judge) for one in studies):
        raise typer.Exit(exit_codes.FAILED)


def reproduce(
    out: Annotated[
        Path | None,
        place(
            "FILE",
            r"The report; its ending, .html or .pdf, chooses the format.  PDF needs levilab\[pdf].",
            (".html", ".pdf"),
            show_default="reproduce.html, and none with --json",
        ),
    ] = None,
    only: Annotated[
        str | None,
        option("CHAPTER,…", f"These chapters alone: {', '.join(CHAPTERS)}.", callback=among(CHAPTERS, "only")),
    ] = None,
    as_json: Json = False,
) -> None:
    """Make the chapters, print them, write the report, and end with 1 where something is unexpected.

    All of them take about a minute, the first time half a minute more.
    """
    from levilab.reproduce.run import choose

    wanted = choose(only)

    from levilab.present.progress import ShareBar
    from levilab.report.page import format_of, write_content
    from levilab.reproduce.report import document_of
    from levilab.reproduce.run import document, reproduce

    report = out or (None if as_json else Path("reproduce.html"))
    form = format_of(report) if report is not None else None
    place = place_of_report(report) if report is not None else None
    with interruptible("no report is written"):
        with contextlib.closing(ShareBar("reproducing")) as progress:
            found = reproduce(wanted, progress)
        if report is not None and form is not None:
            write_content(report, form.content(document_of(found)))
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
