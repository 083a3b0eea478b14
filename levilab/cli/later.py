"""Commands that are made when they are called: a start need not read the options of those that it does not call."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import typer
import typer.core

from levilab.cli.importing import importing


class Later(typer.core.TyperCommand):
    """A stand-in for a command, with its name and its texts.

    Its function takes no options.  It imports and returns what the command is made of: a function whose parameters are
    the options, or an application of several commands.  Name, help and epilog are those of the stand-in:

        @app.command(cls=Later, epilog="Example: levilab top sample_data/device.toml")
        def top() -> Callable[..., None]:
            '''Mass and moments of inertia of a top from its parts, taken as cylinders, with uncertainties.'''
            from levilab.cli.report import top
            return top
    """

    @cached_property
    def command(self) -> Any:
        """The command itself."""
        assert self.callback is not None
        with importing():
            made = self.callback()
        if not isinstance(made, typer.Typer):
            made, function = typer.Typer(add_completion=False), made
            made.command(self.name)(function)
        command = typer.main.get_command(made)
        command.help, command.epilog = _rewrap(self.help), self.epilog
        return command

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Return the command itself, which is called, asked for help or completed."""
        return self.command.make_context(info_name, args, parent, **extra)


def _rewrap(text: str | None) -> str | None:
    """Return a help text with one line a paragraph: typer keeps a docstring's line breaks and adds its own."""
    if text is None:
        return None
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))
