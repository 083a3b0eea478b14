"""The cross-check.  Heavy imports happen inside the command."""

from pathlib import Path
from typing import Annotated

import typer

from levilab.cli import exit_codes
from levilab.cli.options import Json
from levilab.cli.output import message, result


def crosscheck(
    subjects: Annotated[
        list[str] | None, typer.Argument(metavar="[SUBJECT]…", help="What is checked.", show_default="everything")
    ] = None,
    trials: Annotated[
        int | None, typer.Option(min=2, metavar="N", help="How many trials of each.", show_default="40")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the first trial; the next have the next.")] = 0,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Write crosscheck.json and .png there.")] = None,
    as_json: Json = False,
) -> None:
    """Check the analyses, and end with 1 where an estimate or an uncertainty is wrong."""
    from levilab.crosscheck import command

    checked = command.check(subjects or [], trials, seed)
    if as_json:
        result(command.as_json(checked))
    else:
        command.print_checked(checked)
    if out is not None:
        for path in command.write(checked, out):
            message(f"wrote {path}")
    if not all(one.holds for one in checked):
        raise typer.Exit(exit_codes.FAILED)
