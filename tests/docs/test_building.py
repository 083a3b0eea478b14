"""What is done to the pages when they become a site; the site itself is built by `make site`."""

import re

import pytest
import typer.main

from building.commands import MADE, PAGES, checks, columns, fit, observables, overview, reference, scene
from building.docstrings import as_markup, shorten
from building.outside_pages import lead_to_site
from building.requests import loaded_from_elsewhere
from building.wrapping import keep_options_whole
from levilab.cli.main import app
from levilab.pipelines.catalogue import ANALYSES
from support.paths import DOCS


def test_the_pages_of_commands_have_each_command_with_its_options():
    commands = typer.main.get_command(app).commands
    assert sorted(name for names in PAGES.values() for name in names) == sorted(commands)
    assert all(f"## `levilab {name}`" in reference(page) for page, names in PAGES.items() for name in names)
    acquire = reference("reference/commands-acquire")
    assert "### `levilab acquire spin`\n\n```text\nlevilab acquire spin [OPTIONS]\n```" in acquire
    assert acquire.count("`--resume RUN`") == 1  # of all, said once
    assert r'"f=Drehzahl \[rpm\]"' in reference("reference/commands-analyze")
    assert "`--tolerance X`\n: Error that is accepted" in reference("reference/commands-simulate")
    assert "| [`levilab sweep`](commands-simulate.md#levilab-sweep) | Map a scene" in overview()


def test_the_page_of_data_has_each_column_and_each_mark_stands_in_its_page():
    made = columns()
    names = [column.name for analysis in ANALYSES.values() for column in analysis.row]
    assert [name for name in names if f"| `{name}` |" not in made and "_u" not in name] == []
    for page, marks in MADE.items():
        text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
        assert [mark for mark in marks if text.count(mark) != 1] == []
    assert "   .. attribute:: redchi\n\n      χ² per degree" in fit()
    assert "\nmass_kg = " in scene()
    assert "| `survived` | Whether" in observables()
    assert "| `spin`, 1000 | frequency | 200 |" in checks()


@pytest.mark.parametrize(("page", "written", "led"), [
    ("tutorial", "[a](../README.md)", "[a](index.md)"),
    ("experiments/field", "[a](../../sample_data/README.md#x)", "[a](../sample-data.md#x)"),
    ("data", "[a](../sample_data/device.toml)", "[a](../sample_data/device.toml)"),
    ("data", "[a](speed.md#b)", "[a](speed.md#b)"),
    ("instruments/index", "[a](../../CONTRIBUTING.md)", "[a](../contributing.md)"),
    ("instruments/index", "[a](../README.md)", "[a](../README.md)"),
])  # fmt: skip
def test_links_that_leave_the_pages_lead_to_the_site(page, written, led):
    assert lead_to_site(written, page) == led


def test_an_indented_block_of_a_docstring_is_code_and_doctests_stay():
    lines = ["", "    run()", "As:", "", "    >>> 1"]
    assert as_markup(["As:", *lines]) == ["As::", *lines]
    assert as_markup(["of `Error`s"]) == ["of `Error`\\ s"]


def test_names_of_one_attribute_stay_together_and_a_signature_has_no_checks():
    assert as_markup(["Attributes:", "    a, b: [m]."])[1] == "    a,\u200bb: [m]."
    assert as_markup(["Raises:", "    A, B: no data."])[1] == "    A, B: no data."
    assert shorten("(a: Annotated[list[int], Gt(gt=[0])] = [])", {"list[int]": "Array"}) == "(a: Array = [])"


def test_the_reference_names_its_members():
    """So that no helper of a module and no constant stands there."""
    for page in sorted((DOCS / "reference").glob("python*.md")):
        blocks = page.read_text(encoding="utf-8").split(".. automodule:: ")[1:]
        assert [block for block in blocks if not re.match(r"[\w.]+\n   :members: \w", block)] == [], page


@pytest.mark.parametrize(("name", "text", "found"), [
    ("a.html", '<script src="https://cdn.example/x.js"></script>', ["https://cdn.example/x.js"]),
    ("a.html", '<link rel="stylesheet" href="//fonts.example/a.css">', ["//fonts.example/a.css"]),
    ("a.css", '@import "https://fonts.example/a.css"; b { background: url(a.png) }', ["https://fonts.example/a.css"]),
    ("a.html", '<img src="_images/a.png"><a href="https://example.org">there</a>', []),
])  # fmt: skip
def test_what_a_page_loads_from_elsewhere_is_found(tmp_path, name, text, found):
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert loaded_from_elsewhere(tmp_path) == [(name, address) for address in found]


def test_a_command_that_is_wider_than_the_page_goes_on_below(page):
    page.set_content(keep_options_whole(f"<pre>$ levilab sweep {'--no-open start.spin_hz=18:90:145 ' * 9}</pre>"))
    page.add_style_tag(path=DOCS / "building/style/site.css")
    assert page.evaluate("document.documentElement.scrollWidth - innerWidth") == 0
    assert page.evaluate("[...document.querySelectorAll('span')].map((one) => one.getClientRects().length)") == [1] * 9


def test_what_is_copied_of_a_block_are_its_commands(page):
    page.add_script_tag(path=DOCS / "building/style/copy.js")
    block = "$ levilab runs  # all\nspin-1\n$ levilab report runs/ --title 'no # 3'\n"
    assert page.evaluate("text => toCopy(text)", block) == "levilab runs\nlevilab report runs/ --title 'no # 3'"
    assert page.evaluate("text => toCopy(text)", "a = 1  # one\n") == "a = 1  # one"


def test_no_menu_of_the_site_is_longer_than_its_screen():
    menus = re.findall(r":hidden:\n\n(.*?)```", (DOCS / "index.md").read_text(encoding="utf-8"), re.DOTALL)
    assert max(len(menu.split()) for menu in menus) <= 12


#: Labels of a drawing through which an outline passes, in letters of 13 px.
CROSSED = """() => {
    const shapes = [...document.querySelectorAll("line, path, rect, circle, ellipse, polyline, polygon")];
    const on = (shape) => Array.from({length: shape.getTotalLength()}, (_, k) =>
        shape.getPointAtLength(k).matrixTransform(shape.getScreenCTM()));
    const points = shapes.filter((shape) => !shape.closest("defs")).flatMap(on);
    const across = ({left, right, top, bottom}) => points.some(({x, y}) =>
        x > left + 1 && x < right - 1 && y > top + 3 && y < bottom - 3);
    const labels = [...document.querySelectorAll("text")];
    return labels.filter((text) => across(text.getBoundingClientRect())).map((text) => text.textContent);
}"""


@pytest.mark.parametrize("drawing", [*DOCS.glob("*.svg"), *DOCS.glob("experiments/*.svg")], ids=lambda one: one.stem)
def test_no_line_of_a_drawing_crosses_a_label(page, drawing):
    page.set_content(drawing.read_text(encoding="utf-8"))
    assert page.evaluate(CROSSED) == []


def test_the_search_ranks_pages_of_users_before_those_of_developers(page):
    sphinx = "const Documentation = {addTranslations() {}}, Search = {_index: {docnames: [], indexentries: {}}}"
    page.add_script_tag(content=sphinx)
    page.add_script_tag(path=DOCS / "building" / "scorer.js")
    names = ["decisions/0014-records", "reference/python", "pulses", "data"]
    scores = page.evaluate("names => names.map(name => Scorer.score([name, '', '', '', 10, '']))", names)
    assert scores == sorted(scores)
    assert scores[0] < scores[-1]
