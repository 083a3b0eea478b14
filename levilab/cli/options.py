"""The options that commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else on standard output.")]
Title = Annotated[str, typer.Option(metavar="TEXT", help="In place of the report's own title.")]
Course = Annotated[str, typer.Option(metavar="TEXT", help="Below the title, as 'Physics lab 2'.")]
Author = Annotated[str, typer.Option(metavar="NAMES", help="Below the title.")]
Date = Annotated[str, typer.Option(metavar="TEXT", help="Below the title, as it is to stand there.")]
#: readable=False here and elsewhere: what may not be read is said by the reader, in one line, with what to do.
Paths = Annotated[
    list[Path], typer.Argument(metavar="PATH…", readable=False, help="Run folders, data files, or folders to search.")
]
#: Those that come with levilab, simple ones first; help is not to wait for their files.
SCENES = "undriven, friction, tilted, driven, loose-washers, motor, ramp, precession, spindown, sway, practice"
Presets = Annotated[
    str,
    typer.Argument(
        metavar="SCENE",
        help=f"{SCENES}, or a file.",
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the scene, as top.mass_kg=0.025; repeatable."),
]
