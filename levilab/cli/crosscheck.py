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

    if like:
        if seed is not None:
            raise UsageError("seed", "does not go with `like`: its trials follow from the readings")
        _like(like, subjects or [], trials, out, as_json=as_json)
        return
    checked = command.check(subjects or [], trials, seed or 0)
    if as_json:
        result(command.as_json(checked))
    else:
        command.print_checked(checked)
    if out is not None:
        for path in command.write(checked, out):
            message(f"wrote {path}")
    if not all(one.holds for one in checked):
        raise typer.Exit(exit_codes.FAILED)


def _like(paths: list[Path], names: list[str], trials: int | None, out: Path | None, *, as_json: bool) -> None:
    """Return the trials with the parameters of results, stored beside these."""
    from levilab.crosscheck import command

    checked = command.check_like(names, paths, trials)
    written = command.store_like(checked, out)
    if as_json:
        result(command.like_as_json(checked))
    else:
        command.print_like(checked)
    for path in written:
        message(f"wrote {path}")
    if not all(one.holds for one, _ in checked):
        raise typer.Exit(exit_codes.FAILED)
