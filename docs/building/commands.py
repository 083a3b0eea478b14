"""The page of all commands, from the help that each of them has."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sphinx.application import Sphinx

PAGE = "reference/commands"
MARK = "<!-- all commands -->"


def reference() -> str:
    """Return usage, explanation, options and example of every command, in Markdown."""
    import typer.main

    from levilab.cli.main import app

    return "\n\n".join(_described(typer.main.get_command(app), "levilab", None))


def _described(command: Any, name: str, parent: Any) -> Iterator[str]:
    command = getattr(command, "command", command)  # of a stand-in, see levilab.cli.later
    context = command.context_class(command, info_name=name.rpartition(" ")[2], parent=parent)
    yield f"{'#' * (1 + name.count(' '))} `{name}`" if parent else ""
    yield f"```text\n{' '.join(command.get_usage(context).removeprefix('Usage:').split())}\n```"
    yield _in_plain_text(command.help or "")
    rows = [row for parameter in command.get_params(context) if (row := _row(parameter, context))]
    if rows:
        yield "\n".join(rows)
    if command.epilog:
        yield _example(command.epilog)
    for sub in sorted(getattr(command, "commands", {})):
        yield from _described(command.commands[sub], f"{name} {sub}", context)


def _row(parameter: Any, context: Any) -> str:
    """Return a term and its definition; empty for --help, which all commands have."""
    if parameter.name == "help" or getattr(parameter, "hidden", False):
        return ""
    record = parameter.get_help_record(context)
    if record is None:
        return ""
    term, text = record
    return f"`{' '.join(term.split())}`\n: {_in_plain_text(text) or 'see above'}\n"


def _example(epilog: str) -> str:
    """``Example: levilab …`` as a block."""
    head, _, command = epilog.partition(": ")
    return f"{head}:\n\n```text\n{command}\n```" if command else _in_plain_text(epilog)


def _in_plain_text(text: str) -> str:
    """Help is plain text: nothing in it is markup."""
    return re.sub(r"([\\*_<>`$\[\]])", r"\\\1", re.sub(r"[ \t]+", " ", text)).strip()


def _read(_: Sphinx, page: str, source: list[str]) -> None:
    if page == PAGE:
        source[0] = source[0].replace(MARK, reference())


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("source-read", _read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
