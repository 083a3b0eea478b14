"""An option is one field: every door has it, with the same default and the same range."""

import inspect
import math

import pytest

import levilab
from levilab.cli.analyze import takes_options
from levilab.errors import UsageError
from levilab.pipelines.options import DEFAULTS, OPTIONS, read_options, typed_name

#: What is analyzed, beside the options.
READINGS = {"data", "kind", "u", "time", "frequency", "light"}


def test_the_notebook_has_each_option_with_its_default_and_a_sentence():
    parameters = inspect.signature(levilab.analyze).parameters
    assert {name: one.default for name, one in parameters.items() if name not in READINGS} == DEFAULTS
    lines = (inspect.getdoc(levilab.analyze) or "").splitlines()  # Python 3.13 takes the indentation off itself
    assert all(any(line.startswith(f"    {name}: ") for line in lines) for name in OPTIONS)


def test_the_command_line_has_the_same_defaults():
    @takes_options(OPTIONS)
    def command(context, paths, last=None, **given): ...

    given = {name: one.default for name, one in inspect.signature(command).parameters.items()}
    typed = {name: given[typed_name(name)] for name in OPTIONS}
    assert typed == {name: DEFAULTS[name] for name in typed}


@pytest.mark.parametrize("name", [name for name, one in OPTIONS.items() if one.kind is float])
@pytest.mark.parametrize("typed", [True, False])
def test_numbers_out_of_range_are_refused_by_name(name, *, typed):
    shown = typed_name(name) if typed else name
    goes_with = {typed_name("height_m") if typed else "height_m": 1.0} if OPTIONS[name].needs else {}
    for value in (-1e6, math.inf, math.nan):
        with pytest.raises(UsageError) as refused:
            read_options(goes_with | {shown: value}, typed=typed)
        assert refused.value.name == shown


def test_millimetres_of_the_command_line_are_metres_of_the_analysis():
    assert read_options({"height": 75.0, "height_u": 0.5}, typed=True) == {"height_m": 0.075, "height_u_m": 0.0005}
    assert read_options({"height_m": 0.075}) == {"height_m": 0.075}
    with pytest.raises(UsageError):
        read_options({"height_u": 0.5}, typed=True)


def test_words_that_are_no_choice_are_refused():
    assert read_options({"tilt": "fitted", "method": None}) == {"tilt": "fitted"}
    with pytest.raises(UsageError):
        read_options({"tilt": "maybe"})
