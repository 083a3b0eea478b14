"""The pages of the Python API as they are built: `make site` runs it on the new site."""

import html
import re

import pytest

from support.paths import ROOT

PAGES = sorted((ROOT / "build/site/reference").glob("python*.html"))


@pytest.mark.skipif(not PAGES, reason="make site makes them")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_docstrings_are_whole_and_signatures_are_short(page):
    """A field "Type" is the half of a sentence before its colon, "b (a,)" were the names of one attribute."""
    text = html.unescape(re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8")))
    torn = r"\nType:| \(\w\w+,\): |Alias for|model_config|Annotated\[|_Buffer|<factory>|ndarray\[tuple|~\w| -- "
    assert re.findall(torn, text) == []


@pytest.mark.skipif(not PAGES, reason="make site makes them")
@pytest.mark.parametrize(("page", "first"), [("python", "acquire"), ("python-spin", "fit_spin_down")])
def test_a_page_begins_with_its_functions(page, first):
    text = (ROOT / f"build/site/reference/{page}.html").read_text(encoding="utf-8")
    assert re.findall(r'<dt class="sig.*?id="([\w.]+)"', text, re.DOTALL)[0].rpartition(".")[2] == first


@pytest.mark.skipif(not PAGES, reason="make site makes them")
def test_indices_and_powers_of_the_physics_are_set():
    text = (ROOT / "build/site/physics.html").read_text(encoding="utf-8")
    assert "ν<sub>d</sub> turns the top" in text
    assert "(rad/s)<sup>−1/2</sup>/s" in text


@pytest.mark.skipif(not PAGES, reason="make site makes them")
def test_a_fit_has_an_entry_for_each_of_its_names():
    names = "redchi", "covar", "correl", "best_fit", "eval", "eval_uncertainty", "conf_interval", "ci_report"
    text = (ROOT / "build/site/reference/python-results.html").read_text(encoding="utf-8")
    assert [name for name in names if f'id="levilab.notebook.fit.FittedModel.{name}"' not in text] == []
