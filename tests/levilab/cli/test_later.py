"""Commands are made when they are called: the first page of help makes none."""

import re

import typer.main
from typer.testing import CliRunner

from levilab.cli.later import Later
from levilab.cli.main import app
from support.commands import command


def test_the_first_help_lists_every_command_and_makes_none(monkeypatch):
    made = []
    monkeypatch.setattr(Later, "command", property(lambda self: made.append(self.name)))
    shown = CliRunner().invoke(app, ["--help"]).stdout
    commands = typer.main.get_command(app).commands
    assert len(commands) >= 10
    assert all(f" {name} " in shown for name, one in commands.items() if not one.hidden)
    assert made == []


def test_a_command_has_the_texts_of_its_stand_in_and_the_options_of_its_function():
    stand_in = typer.main.get_command(app).commands["report"]
    assert stand_in.params == []
    assert {"paths", "out", "columns"} <= {one.name for one in stand_in.command.params}
    assert stand_in.command.help.split() == stand_in.help.split()
    assert stand_in.command.epilog == "Example: levilab report sample_data/ -o report.html, or -o report.pdf --tables"


def commands_of(command):
    """A command and those below it, each made."""
    made = getattr(command, "command", command)
    return [made, *(one for below in getattr(made, "commands", {}).values() for one in commands_of(below))]


def test_each_value_has_a_word_and_no_type_of_python():
    """As --seed N, --tilt auto|none|fitted, and [PATH] of the usage; a switch has its name alone."""
    for made in commands_of(typer.main.get_command(app)):
        context = made.context_class(made)
        assert "[[" not in made.get_usage(context)
        for one in made.get_params(context):
            term, is_switch = (one.get_help_record(context) or [""])[0], getattr(one, "is_flag", False)
            assert is_switch or re.search(r"(^|[^-] )([A-Z]|\w+\|)[^<>]*$", term), (made.name, term)
            assert "x" not in (one._get_number_range_help_str() or ""), (made.name, term)


def test_a_misspelt_command_below_a_stand_in_gets_its_suggestion(tmp_path):
    assert "Did you mean 'spin'?" in command("acquire", "spni", cwd=tmp_path).err
