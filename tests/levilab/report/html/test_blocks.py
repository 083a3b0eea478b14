"""Blocks as HTML: structure, escaping, ids, typeset numbers."""

import json
import re

import pytest

from levilab.present.document.blocks import (
    Code,
    Details,
    Document,
    Listing,
    Note,
    Paragraph,
    Picture,
    Points,
    Section,
    Tabular,
    Verdict,
)
from levilab.present.tables import table
from levilab.report.html.page import fragment_of, page_of
from support.documents import all_blocks, drawn, of_all_blocks
from support.pages import Page

pytestmark = pytest.mark.usefixtures("drawn_figures")  # texts of a figure, and its ids, are in the page, too

EVIL = "</script></style></svg><b onclick=x>{{7*7}}${x}\"'&"


def document(text):
    return of_all_blocks(text, sections=2, contents=True, subject=text)


def test_a_verdict_of_several_inputs_has_a_line_for_each():
    assert '<p class="verdict">a: up<br>b: down</p>' in fragment_of((Verdict("a: up\nb: down"),))


def test_cells_of_a_table_that_stacks_have_their_heads():
    rows = [("a", "b")]
    stacked = Page(page_of(Document("t", "", (Tabular("one", table("", ("", "here"), rows), narrow="stack"),))))
    moved = Page(page_of(Document("t", "", (Tabular("one", table("", ("", "here"), rows)),))))
    assert [given for tag, given in stacked.tags if tag == "td"] == [{}, {"data-head": "here"}]
    assert [given for tag, given in moved.tags if tag == "td"] == [{}, {}]


def test_a_long_note_on_a_table_opens_from_a_line_that_suits_rows_and_columns():
    long = Tabular("one", table("", ("", "here"), [("a", "b")]), "x" * 300)
    assert re.search(r"About this table\s*x{300}", Page(page_of(Document("t", "", (long,)))).text)


def test_no_text_of_any_block_becomes_markup():
    hostile, tame = Page(page_of(document(EVIL))), Page(page_of(document("word")))
    assert [tag for tag, _ in hostile.tags] == [tag for tag, _ in tame.tags]
    assert hostile.text.count(EVIL) == tame.text.count("word")


def test_points_are_data_that_ends_no_script():
    html = page_of(document(EVIL))
    island = html.partition('id="points">')[2].partition("</script>")[0]
    assert "<" not in island
    assert json.loads(island) == {"figure-readings-0": [EVIL, EVIL], "figure-2-readings-0": [EVIL, EVIL]}


def test_no_two_elements_share_an_id_and_each_link_leads_somewhere():
    page = Page(page_of(document("word")))
    ids = [given["id"] for _, given in page.tags if "id" in given]
    assert len(ids) == len(set(ids))
    links = [str(given["href"])[1:] for tag, given in page.tags if tag == "a"]
    assert links == ["result", "result-2"]
    assert set(links) <= {*ids}


def test_headings_go_down_by_one():
    inner = Section("three", (Section("four", ()),))
    page = Page(page_of(Document("one", "", (Section("two", (inner,)), Section("two", ())))))
    assert page.headings == [(1, "one"), (2, "two"), (3, "three"), (4, "four"), (2, "two")]


def test_points_that_a_figure_does_not_have_one_by_one_answer_nothing():
    few = Picture("figure", "t", "c", "a", drawn, (Points("readings-0", ("one of two",)), Points("gone", ("x",))))
    assert "one of two" not in page_of(Document("d", "", (few,)))


def test_units_are_typeset_and_code_is_not():
    shown = fragment_of([Paragraph("C₃/₂ = 2.4×10⁻⁴ (rad/s)^−½/s, -3 Hz"), Code("x^−½ -3")])
    assert "C<sub>3/2</sub> = 2.4×10<sup>−4</sup> (rad/s)<sup>−½</sup>/s, −3\u00a0Hz" in shown
    assert "x^−½ -3" in shown


def test_a_listing_is_folded_into_pieces_that_lose_no_row():
    rows = [(str(k), f"v{k}") for k in range(23)]
    page = Page(fragment_of([Listing("l", table("L", ("k", "v"), rows, numbers=["k"]))]))
    assert sum(tag == "table" for tag, _ in page.tags) == 3
    assert re.findall(r"v\d+", page.text) == [v for _, v in rows]


def test_a_fragment_keeps_its_style_and_ids_to_itself_and_has_no_script():
    fragment = fragment_of(all_blocks("word"), prefix="one-")
    assert fragment.startswith('<div class="levilab-part"><style>.levilab-part {')
    assert "<script" not in fragment
    assert all(str(given["id"]).startswith("one-") for _, given in Page(fragment).tags if "id" in given)


@pytest.mark.parametrize("on_paper", ["whole", "summary", "out"])
def test_what_is_folded_knows_how_it_is_printed(on_paper):
    assert f'class="on-paper-{on_paper}"' in fragment_of([Details("s", (Note("n"),), on_paper=on_paper)])
