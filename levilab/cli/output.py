"""Where a command writes: results on standard output, progress and messages on standard error."""

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TextIO

import typer

from levilab.cli import exit_codes
from levilab.cli.quantities import with_options
from levilab.present.characters import printable
from levilab.texts.text import Text, in_language


def print_json(document: Any, *, indent: int | None = 2, sort_keys: bool = False) -> None:
    """Print one JSON document on standard output, without NaN."""
    import json

    typer.echo(json.dumps(document, indent=indent, sort_keys=sort_keys, allow_nan=False))


def result(text: str) -> None:
    """Print a line on standard output; names in it, which others chose, do not steer the terminal."""
    typer.echo(printable(in_language(text)))


def message(text: str) -> None:
    """Print a line on standard error in the person's language, with options in the place of quantities.

    A closed one, as with its terminal, ends nothing.
    """
    line = text
    with contextlib.suppress(OSError):  # no file can be opened any more, not even that of a module
        line = printable(with_options(in_language(text)))
    try:
        typer.echo(line, err=True)
    except OSError:
        silence(sys.stderr)


def silence(stream: TextIO) -> None:
    """Throw away what goes to a closed stream: Python flushes it when it ends, and would complain."""
    with contextlib.suppress(OSError, ValueError), open(os.devnull, "w", encoding="utf-8") as nowhere:  # noqa: PTH123 - a descriptor is needed
        os.dup2(nowhere.fileno(), stream.fileno())


def place_of_report(report: Path, said: str = "the report is in {file:s}") -> str:
    """Return where a report will be, as a line; a folder that it makes, or a file that it replaces, may be an error."""
    there = ", in place of an earlier file" * report.exists() if report.parent.exists() else ", in a new folder"
    return Text("{place}{there}", place=Text(said, file=report), there=there)


@contextlib.contextmanager
def interruptible(what_is_left: str | Callable[[], str]) -> Iterator[None]:
    """End the command with one line at Ctrl-C; the line says what is left."""
    try:
        yield
    except KeyboardInterrupt:
        left = what_is_left if isinstance(what_is_left, str) else what_is_left()
        message(Text("levilab: interrupted, {left}", left=left))
        raise typer.Exit(exit_codes.INTERRUPTED) from None
