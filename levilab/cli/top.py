"""The calculator for the top.  Heavy imports happen inside the command."""

from pathlib import Path
from typing import Annotated

import typer

from levilab.cli.options import Json
from levilab.cli.output import print_json


def top(
    device: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", readable=False, help="Describes the top's parts, as sample_data/device.toml does."
        ),
    ],
    as_json: Json = False,
) -> None:
    """Calculate mass and moments of inertia."""
    from levilab.pipelines.top import calculate_top, top_document, top_table, top_text

    found = calculate_top(device)
    if as_json:
        print_json(top_document(found), sort_keys=True)
        return
    from levilab.present.terminal import draw, terminal  # with rich

    console = terminal()
    console.print(draw(top_table(found)))
    console.print(top_text(found), markup=False)
