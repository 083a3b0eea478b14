"""Commands that are made when they are called: a start need not read the options of those that it does not call."""

import re
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

import typer
import typer.core

from levilab.cli.importing import importing

#: Names that options had once → those that they have.
_FORMER = {"--output": "--out"}
#: What other programs have options for: their names, the option that our command has then, and what to do.
_OF_FILES = (
    (
        {"unit", "units", "einheit", "rpm", "hz", "time", "t", "frequency", "f", "col", "x", "y", "usecols"},
        "columns",
        'a unit goes with its column, by title or number: --columns "t=1,f=2 [rpm]"',
    ),
    (
        {"sep", "delimiter", "separator", "decimal", "skiprows", "skip", "header", "encoding"},
        "columns",
        "separator, decimal mark, titles and encoding are found in the file: levilab open FILE shows how it is read",
    ),
    (
        {"sheet", "sheet-name", "blatt", "tab"},
        "columns",
        "a sheet is named as if the file were a folder: my.xlsx/Sheet2",
    ),
)
#: How similar a name must be to be suggested, from 0 to 1.
_ALIKE = 0.6


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
        try:
            return self.command.make_context(info_name, [_with_present_name(word) for word in args], parent, **extra)
        except Exception as error:
            if hasattr(error, "option_name") and hasattr(error, "possibilities"):  # typer keeps the class to itself
                _explain_unknown(error, info_name or "", self.command)
            elif hasattr(error, "message") and "unexpected extra argument" in error.message:
                error.message = error.message.rstrip(".") + _explain_blank(args)
            raise


class NamedLast(typer.core.TyperGroup):
    """Commands whose name may stand behind their options: `levilab acquire --mock spin`.

    Attributes:
        typical: the command whose options say which words are the value of one.
    """

    typical = ""

    def with_name_first(self, args: list[str]) -> list[str] | None:
        """Return the words with the name of a command, or what was meant as one, in front; None if there is none."""
        k = self._first_word(args)
        if k is None or not (args[k] in self.commands or self._is_misspelt(args[k])):
            return None
        return [args[k], *args[:k], *args[k + 1 :]]

    def _first_word(self, args: list[str]) -> int | None:
        """Return the index of the first word that is neither an option nor the value of one; None if there is none."""
        typical: Any = self.commands[self.typical]
        options = [one for one in typical.command.params if not getattr(one, "is_flag", True)]
        with_value = {name for option in options for name in option.opts}
        numbered = iter(enumerate(args))
        for k, word in numbered:
            if word in with_value:
                next(numbered, None)
            elif word == "--" or not word.startswith("-"):
                return None if word == "--" else k
        return None

    def _is_misspelt(self, word: str) -> bool:
        """Return whether a word is similar to the name of a command, and no path."""
        return bool(get_close_matches(word, self.commands)) and not Path(word).exists()


def _explain_blank(args: list[str]) -> str:
    """Return the advice for a value with a blank before its unit; empty where there is none.

    >>> _explain_blank(["driven", "--duration", "5", "min"])
    '; write --duration 5min, without a blank'
    """
    for option, value, unit in zip(args, args[1:], args[2:], strict=False):
        if option.startswith("--") and re.fullmatch(r"[\d.,]+", value) and re.fullmatch(r"[^\W\d_]{1,4}", unit):
            return f"; write {option} {value}{unit}, without a blank"
    return ""


def _with_present_name(word: str) -> str:
    name, equals, value = word.partition("=")
    return f"{_FORMER.get(name, name)}{equals}{value}"


def _explain_unknown(error: Any, name: str, command: Any) -> None:
    """Add to the refusal of an unknown option what may have been meant: a similar option, or a key of --set."""
    word = error.option_name.lstrip("-")
    known = [one.lstrip("-") for one in error.possibilities or ()]
    own = {one.name for one in command.params}
    for words, needed, advice in _OF_FILES:
        if word in words and needed in own:
            error.message, error.possibilities = f"{error.message}; {advice}", []
            return
    error.possibilities = [f"--{one}" for one in get_close_matches(word, known, cutoff=_ALIKE)]
    if not any(one.name == "settings" for one in command.params):
        return
    if any(one.name == "list_settings" for one in command.params):  # an experiment
        if not error.possibilities:
            error.message += f"; --set changes its settings, which levilab acquire {name} --settings lists"
        return
    from levilab.simulator.keys import similar_keys
    from levilab.simulator.scene import preset

    keys = similar_keys(preset("driven").as_table(), word.replace("-", "_"))
    if error.possibilities and not any(key.rpartition(".")[2].split("_")[0] == word for key in keys):
        return  # but --mass is a quantity of a scene, and no mistyped --masses
    example = " or ".join(f"--set {key}=…" for key in keys) or "as --set top.mass_kg=25g"
    error.message += f"; --set changes the scene: {example}"


def _rewrap(text: str | None) -> str | None:
    """Return a help text with one line a paragraph: typer keeps a docstring's line breaks and adds its own."""
    if text is None:
        return None
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))
