"""The options that commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else on standard output.")]
Columns = Annotated[
    str,
    typer.Option(
        metavar="NAME=COLUMN,…",
        help='Columns of your file: "t=Zeit,f=Kanal2" or "t=1,f=3"; with a unit in brackets: "f=Drehzahl \\[rpm]".',
    ),
]
ReadingU = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="Standard uncertainty of every reading; goes before what the data say."),
]
Channel = Annotated[
    str | None,
    typer.Option("--channel", metavar="NAME", help="Channel of a record with several, by its name or number."),
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--rate", metavar="HZ", help="Samples per second, of files that do not say it, as .npy; goes before the file's."
    ),
]
KeepOutliers = Annotated[bool, typer.Option("--keep-outliers", help="Fit readings that look like miscounts, too.")]
#: readable=False here and elsewhere: what may not be read is said by the reader, in one line, with what to do.
Paths = Annotated[
    list[Path], typer.Argument(metavar="PATH…", readable=False, help="Run folders, data files, or folders to search.")
]
#: Those that come with levilab, simple ones first; help is not to wait for their files.
SCENES = "undriven, friction, tilted, driven, loose-washers, precession, spindown, practice"
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
