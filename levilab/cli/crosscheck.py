"""The cross-check.  Heavy imports happen inside the command."""

from pathlib import Path
from typing import Annotated

import typer

from levilab.cli import exit_codes
from levilab.cli.options import Json
from levilab.cli.output import message, result
from levilab.errors import UsageError


def crosscheck(
    subjects: Annotated[
        list[str] | None, typer.Argument(metavar="[SUBJECT]…", help="What is checked.", show_default="everything")
    ] = None,
    like: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RUN",
            help="Make up readings with the values, times, scatter and number of runs of this result, not worlds at "
            "random; repeat it for several runs.  Writes crosscheck.json beside the result, for the report.",
        ),
    ] = None,
    trials: Annotated[
        int | None,
        typer.Option(min=2, metavar="N", help="How many trials of each.", show_default="40; with --like 200"),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Of the first trial; the next have the next.", show_default="0"),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Write crosscheck.json and .png there.")] = None,
    as_json: Json = False,
) -> None:
    """Check the analyses, and end with 1 where an estimate or an uncertainty is wrong."""
    from levilab.crosscheck import command
    from levilab.crosscheck.stored import as_json as as_text

    if like:
        if seed is not None:
            raise UsageError("seed", "does not go with `like`: its trials follow from the readings")
        found = command.study_results(subjects or [], like, trials)
        studies, written = [one for one, _ in found], command.store_beside(found, out)
    else:
        studies = command.study_worlds(subjects or [], trials, seed or 0)
        written = [] if out is None else command.write(studies, out)
    if as_json:
        result(as_text(studies))
    else:
        command.print_studies(studies)
    for path in written:
        message(f"wrote {path}")
    if not all(one.holds for one in studies):
        raise typer.Exit(exit_codes.FAILED)
