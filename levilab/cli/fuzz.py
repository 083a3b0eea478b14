"""The simulated laboratory, for people who work on levilab."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from levilab.cli import exit_codes
from levilab.cli.options import flag, option
from levilab.cli.output import message, result
from levilab.errors import UsageError

#: The tools for people who work on levilab, in a clone.
_TOOLS = Path(__file__).parents[2] / "fuzz"


def fuzz(
    seed: Annotated[int, option("N", "Of the laboratory, or of the first one.", min=0)] = 0,
    number: Annotated[int | None, option("N", "That many laboratories.", min=1, show_default="1, or no end")] = None,
    seconds: Annotated[float | None, option("S", "Begin no more after this time.", min=0)] = None,
    cores: Annotated[int | None, option("N", "Processes.", min=1, show_default="all cores")] = None,
    trace: Annotated[bool, flag("Print each step of one laboratory.", "--trace")] = False,
) -> None:
    """Carry out laboratories, and end with 1 where something is wrong."""
    if not _TOOLS.is_dir():
        raise UsageError("fuzz", "the laboratories lie in a clone of levilab: `pip install --editable .` there")
    sys.path.insert(0, str(_TOOLS))
    from laboratories.explore import explore
    from laboratories.plan import draw
    from laboratories.shrink import shrink
    from laboratories.visit import Told, visit

    def tell(told: Told) -> None:
        small = shrink(told, exit_codes.exit_status)
        message("\n".join([*small.story, *(f"{one.oracle.upper()}: {one.text}" for one in small.findings), ""]))

    if number is None and seconds is None:
        told = visit(draw(seed), exit_codes.exit_status)
        result("\n".join([*(told.trace if trace else ()), *told.story, f"trace {told.digest}"]))
        failed = [told] if told.findings else []
        for one in failed:
            tell(one)
    else:
        explored = explore(seed, exit_codes.exit_status, number=number, seconds=seconds, cores=cores, tell=tell)
        result(explored.text)
        failed = explored.failed
    if failed:
        raise typer.Exit(exit_codes.FAILED)
