"""The simulated laboratory, for people who work on levilab."""

from typing import Annotated

import typer

from levilab.cli import exit_codes
from levilab.cli.options import flag, option
from levilab.cli.output import message, result


def fuzz(
    seed: Annotated[int, option("N", "Of the laboratory, or of the first one.", min=0)] = 0,
    number: Annotated[int | None, option("N", "That many laboratories.", min=1, show_default="1, or no end")] = None,
    seconds: Annotated[float | None, option("S", "Begin no more after this time.", min=0)] = None,
    cores: Annotated[int | None, option("N", "Processes.", min=1, show_default="all cores")] = None,
    trace: Annotated[bool, flag("Print each step of one laboratory.", "--trace")] = False,
) -> None:
    """Carry out laboratories, and end with 1 where something is wrong."""
    from levilab.laboratory.explore import explore
    from levilab.laboratory.plan import draw
    from levilab.laboratory.shrink import shrink
    from levilab.laboratory.visit import Told, visit

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
