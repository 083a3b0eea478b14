"""The options that commands share, and the names by which the command line knows quantities."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from levilab.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else on standard output.")]
Columns = Annotated[
    str,
    typer.Option(
        metavar="NAME=COLUMN,…",
        help="Columns of your file: t=Zeit,f=Kanal2 or t=1,f=3; with a unit in brackets: 'f=Drehzahl \\[rpm]'.",
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
Paths = Annotated[list[Path], typer.Argument(metavar="PATH…", help="Run folders, data files, or folders to search.")]
Presets = Annotated[
    str,
    typer.Argument(
        metavar="SCENE", help="undriven, friction, tilted, driven, loose-washers, precession, spindown, or a file."
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the scene, as top.mass_kg=0.025; repeatable."),
]

#: A quantity in a message, and what it is set to, as in "take `rate` = 500 or less".
_QUANTITY = re.compile(r"`([a-z]\w*)`( = False\b| = True\b| = )?")


def option_names(app: Any) -> dict[str, tuple[str, str]]:
    """Quantity → the option that sets it, and the one that switches it off (empty if there is none), of all commands.

    app: the application, or the command of its name.

    A quantity has the name of the parameter by which a command takes it.
    """
    return {
        parameter.name: (parameter.opts[0], next(iter(parameter.secondary_opts), ""))
        for parameter in _parameters(typer.main.get_command(app) if isinstance(app, typer.Typer) else app)
        if parameter.opts[0].startswith("--")
    }


def _parameters(command: Any) -> Iterator[Any]:
    yield from command.params
    for below in getattr(command, "commands", {}).values():
        yield from _parameters(below)


def in_options(error: Exception, app: typer.Typer) -> str:
    """The text of an error with options in the place of quantities: "duration = -1: …" is "--duration -1: …"."""
    names = option_names(app)
    if not isinstance(error, UsageError):
        return with_options(str(error), names)
    head = names.get(error.name, (error.name, ""))[0]
    given = head if error.value is None else f"{head} {error.value}"
    return f"{given}: {with_options(error.text, names)}"


def with_options(text: str, names: Mapping[str, tuple[str, str]]) -> str:
    """A text with options in the place of quantities.  names: see `option_names`."""

    def option(match: re.Match[str]) -> str:
        name, setting = match[1], match[2] or ""
        if name not in names:
            return match[0]
        on, off = names[name]
        if setting == " = False" and off:
            return off
        return on if setting in {"", " = True"} else on + " "

    return _QUANTITY.sub(option, text)
