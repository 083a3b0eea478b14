"""Messages name quantities, as `duration`; on the command line they have the names of options, as --duration."""

import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import typer

from levilab.cli.later import Later
from levilab.errors import UsageError
from levilab.texts.text import in_language, text_of

#: A quantity in a message, and its value, as in "take `rate` = 500 or less".
_QUANTITY = re.compile(r"`([a-z]\w*)`( = False\b| = True\b| = )?")


#: The application, which `main` adds.
APPLICATION: list[typer.Typer] = []


@cache
def option_names(*, made: bool = False) -> dict[str, tuple[str, str]]:
    """Return quantity → the options that set it and switch it off (empty if there is none), of all commands.

    A quantity has the name of the parameter by which a command takes it.

    Args:
        made: of the commands alone whose options are read already, as those of the one that was called.
    """
    return {
        parameter.name: (parameter.opts[0], next(iter(parameter.secondary_opts), ""))
        for app in APPLICATION
        for parameter in _parameters(command_of(app), made=made)
        if parameter.opts[0].startswith("--")
    }


#: The command of an application, made once: those below it that were called keep their options.
command_of = cache(typer.main.get_command)


def _parameters(command: Any, *, made: bool) -> Iterator[Any]:
    if isinstance(command, Later):
        if made and "command" not in vars(command):
            return
        command = command.command
    yield from command.params
    for below in getattr(command, "commands", {}).values():
        yield from _parameters(below, made=made)


def _option(name: str) -> tuple[str, str] | None:
    """Return the options of a quantity; commands that were not called are asked last, for their imports."""
    return option_names(made=True).get(name) or option_names().get(name)


def in_options(error: Exception) -> str:
    """Return the text of an error with options in the place of quantities: "duration = -1: …" is "--duration -1: …"."""
    if not isinstance(error, UsageError):
        return with_options(in_language(text_of(error)))
    head = (_option(error.name) or (error.name, ""))[0]
    given = head if error.value is None else f"{head} {error.value}"
    return f"{given}: {with_options(in_language(error.text))}"


def with_options(text: str) -> str:
    """Return a message with options in the place of quantities."""
    if not _QUANTITY.search(text):
        return text

    def option(match: re.Match[str]) -> str:
        name, setting = match[1], match[2] or ""
        found = _option(name) or _option(name.rpartition("_")[0])  # `height_m` is --height, which takes a number
        if found is None:
            return match[0]
        on, off = found
        if setting == " = False" and off:
            return off
        return on if setting in {"", " = True"} else on + " "

    return _QUANTITY.sub(option, text)
