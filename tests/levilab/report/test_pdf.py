"""A document as PDF: all of its text is data, the bytes are the same each time, and it has numbered pages."""

import json
import re
from datetime import UTC, datetime
from functools import cache, partial

import pytest

from levilab.pipelines.recall import recall_suiting
from levilab.present.document.blocks import (
    Banner,
    Code,
    Document,
    Note,
    Paragraph,
    Picture,
    Section,
    Tabular,
    Verdict,
    Warnings,
)
from levilab.present.style import as_pdf as as_pdf_page
from levilab.present.tables import table
from levilab.report.document import document_of
from levilab.report.html.page import page_of
from levilab.report.page import write_report
from levilab.report.pdf.renderer import NoTypst, as_pdf, files_of, fonts, settle
from levilab.report.reproduction import Asked
from support.commands import command
from support.documents import drawn, of_all_blocks
from support.paths import ROOT

#: What means something in typst, what no font has, what steers, and words that fit into no line.
HOSTILE = " ".join([
    '#panic("x") #import "@preview/x:1.0.0" $x^2$ @ref <label> [a] {b} `c` *d* _e_ \\u{41} ~ -- /* // = + \' "',
    "https://x.y \x00\x01\x1b[31m\x07\x7f\u0085 \u202e\u2066 שלום عربى 😀 中文 \ue000 \ufffe \U0010ffff \u0378 \u0301",
    "a\u0334\u0334 \ufeff",
    "w" * 300,
    "runs/" + "/".join(["20261120T101500Z-spin-7f3a"] * 12),
])  # fmt: skip


def said_of(document, label):
    """What the typeset document says of itself for tests."""
    import typst

    files = settle(document)
    return json.loads(
        typst.query(files, f"<{label}>", field="value", one=True, font_paths=fonts(), ignore_system_fonts=True)
    )


def pages_of(document):
    return said_of(document, "setting")["pages"]


def data_of(document):
    return json.loads(files_of(document)["document.json"])


def test_no_text_becomes_markup_or_ends_the_setting():
    pdf = as_pdf(of_all_blocks(HOSTILE))
    assert pdf.startswith(b"%PDF-1.7")
    files = files_of(Document(HOSTILE, HOSTILE, (Paragraph(HOSTILE),)))
    template = (ROOT / "levilab/report/pdf/report.typ").read_bytes()
    assert files["main.typ"] == template, "the template is the same whatever the text is"
    assert b"@preview" not in template
    assert b"eval(" not in template


def test_an_option_and_its_value_stand_on_one_line():
    document = Document("t", "", (Code('levilab acquire limit --group "Group 1" --mock --set limit.repetitions=10'),))
    (line,) = data_of(document)["before"][0]["lines"]
    assert [part for part in line if isinstance(part, list)] == [
        ["whole", '--group "Group 1"'], ["whole", "--set limit.repetitions=10"],
    ]  # fmt: skip
    assert as_pdf(document).startswith(b"%PDF")
    assert "<span>--set limit.repetitions=10</span>" in page_of(document)


def test_the_date_is_that_of_the_data_and_never_the_present_one():
    when = datetime(2026, 11, 20, 10, 15, 0, tzinfo=UTC)
    assert b"D:20261120101500" in as_pdf(Document("t", "", (), date=when))
    assert b"CreationDate" not in as_pdf(Document("t", "", ()))


def test_fonts_and_title_are_inside_and_the_file_is_tagged():
    pdf = as_pdf(of_all_blocks("ν and 中"))
    assert b"/MarkInfo" in pdf
    assert re.search(rb"/FontFile[23]", pdf)
    for name in (b"LibertinusSerif", b"DejaVuSans", b"LastResort"):
        assert name in pdf


def test_a_long_table_repeats_its_head_and_a_page_knows_how_many_there_are():
    rows = [(f"run {k}", f"{k}") for k in range(300)]
    long = Tabular("long", table("Many", ("run", "n"), rows, numbers=["n"]))
    assert pages_of(Document("t", "", (Section("Many", (long,)),))) >= 5
    assert pages_of(Document("t", "", (Paragraph("short"),))) == 1


def test_a_heading_and_what_introduces_its_table_stand_on_the_page_of_the_table():
    rows = [(f"run {k}", f"{k}") for k in range(10)]
    below = Section("Below", (Paragraph("It says what follows."), Tabular("t", table("Ten", ("run", "n"), rows))))
    seen = set()
    for lines in range(26, 42, 4):  # the heading comes to the end of the first page, and beyond
        above = Section("Above", (Paragraph("x"),) * lines)
        (_, heading), (place,) = said_of(Document("t", "", (above, below)), "places")
        assert heading == place
        seen.add(place)
    assert seen == {1, 2}


@pytest.mark.parametrize("heights", [(4.6,), (4.6, 4.6, 3.3)])
def test_a_tall_figure_stands_between_the_heading_of_its_chapter_and_the_next_one(monkeypatch, heights):
    monkeypatch.setattr("levilab.present.style.as_pdf", cache(as_pdf_page))  # few figures, again and again

    @cache
    def of(height):
        figure = drawn()
        figure.set_size_inches(7, height)
        return figure

    pictures = [Picture(f"p{k}", "", "c", "a", partial(of, height)) for k, height in enumerate(heights)]

    def chapter(name, lines):
        return Section(name, (Paragraph("x"), *pictures, *(Paragraph("x"),) * lines))

    pages = set()
    for lines in (2, 8, 14, 23, 32):  # the figures fit on the page, or leave it for the next one
        chapters = tuple(chapter(name, lines) for name in ("one", "two", "three"))
        headings, figures = map(sorted, said_of(Document("t", "", chapters), "spots"))
        beyond = [*headings[1:], [99, 0.0]]
        own = [figures[k : k + len(heights)] for k in range(0, len(figures), len(heights))]
        of_chapters = list(zip(headings, own, beyond, strict=True))
        assert all(h < f < b for h, those, b in of_chapters for f in those), lines
        assert all(y < 842 - 54 - 70 for _, y in headings), "no heading stands at the end of a page"
        pages |= {f[0] - h[0] for h, those, _ in of_chapters for f in those}
    assert pages >= {0, 1}


def test_a_column_of_long_sentences_is_wider_than_one_of_short_words():
    reason = "There is no single limit: every top is up to this spin, and the last one is far above it. " * 4
    rows = [("one mass", "25.285 g, in steps of 0.005 g, which floats", "found here")]
    rows += [(f"top {k}: upper limit, all tops up to", "70.46 Hz", reason) for k in range(6)]
    wide = Tabular("t", table("", ("what is compared", "here", "agreement"), rows), wraps=("here", "agreement"))
    below = Section("Below", (Paragraph("x"),))
    (_, y) = said_of(Document("t", "", (Section("Many", (wide, below)),)), "spots")[0][1]
    assert y < 500, "the long column has most of the width"


def test_a_first_page_of_several_chapters_says_what_each_found(monkeypatch):
    mind = [Warnings((("mind",),))]
    chapters = tuple(
        Section(name, (Section("Result", (*doubts, Verdict(f"{name} holds"))), *notes), name, new_page=new)
        for name, doubts, notes, new in (("one", [], mind, False), ("two", mind, [], True))
        # the first one of a report follows its title where it can
    )
    last = Section("How to reproduce this", (Paragraph("x"),))
    said = data_of(Document("t", "", (*chapters, last)))["chapters"]
    assert [(one["title"], one["verdict"], one["notes"]) for one in said] == [
        ("one", "one holds", "1 note"),
        ("two", ["Before you use the numbers. mind", ["line", ""], "two holds"], "1 note"),
        ("How to reproduce this", "", ""),
    ]
    assert data_of(Document("t", "", (chapters[0], last)))["chapters"] == []
    head = page_of(Document("t", "", (*chapters, last), contents=True)).partition("<section")[0]
    assert "two holds" in head
    assert "two holds" not in page_of(Document("t", "", (chapters[1],), contents=True)).partition("<section")[0]
    monkeypatch.setattr("levilab.texts.text._of_process", "de")
    assert data_of(Document("t", "", (*chapters, last)))["chapters"][0]["notes"] == "1 Hinweis"
    assert pages_of(Document("t", "", (*chapters, last))) == 1


@pytest.mark.parametrize("run", ["precession-sweep", "field-scan"])
def test_a_short_report_of_a_run_is_one_page(sample_data, run):
    asked = Asked(short=True, crosscheck=False)
    assert pages_of(document_of(recall_suiting([sample_data / run], {}), (), asked)) == 1


def test_what_is_synthetic_is_marked_on_every_page():
    assert data_of(Document("t", "", (), Banner("SYNTHETIC.", "of a model")))["mark"] == "SYNTHETIC"
    assert data_of(Document("t", "", ()))["mark"] == ""


def test_a_tall_figure_without_words_of_its_own_has_no_heading_and_text_fills_the_page_before_it():
    def tall():
        figure = drawn()
        figure.set_size_inches(7, 12)
        return figure

    picture = Picture("p", "", "c", "a", tall)
    above, below = Section("Result", (Paragraph("x"),) * 9), Section("Notes", (Note("n"),))
    document = Document("t", "", (above, Section("Figure", (picture,)), below))
    _, found, _ = data_of(document)["blocks"]
    assert (found["kind"], found["floats"]) == ("picture", True)
    assert found["width"] < 100, "it fits on a page with its caption"
    (_, notes), (figure,) = said_of(document, "spots")
    assert (notes[0], figure[0]) == (1, 2)


def test_the_figure_of_a_short_report_grows_into_the_room_that_its_page_has():
    picture = Picture("p", "", "c", "a", drawn, most_inch=1.0)

    def factor(lines):
        return json.loads(settle(Document("t", "", (*(Paragraph("x"),) * lines, picture)))["setting.json"])["enlarged"]

    assert [factor(lines) for lines in (10, 39, 40, 41)] == [1.5, 1.5, 1.35, 1.0]  # a line takes 1.8 % of the page


def test_letters_are_smaller_where_that_saves_a_last_page():
    def said(lines):
        return said_of(Document("t", "", (Paragraph("x"),) * lines), "setting")

    pages = [said(lines) for lines in range(46, 54)]  # the second page begins
    assert {one["pages"] for one in pages} == {1, 2}
    full = max(k for k, one in enumerate(pages) if one["pages"] == 1)
    assert pages[full]["end"] > 0.85
    assert min(one["end"] for one in pages[full + 1 :]) > 0.11  # a line ends at 0.075, and each adds 0.018


def test_without_the_extra_the_message_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setattr("levilab.report.pdf.renderer.find_spec", lambda _: None)
    with pytest.raises(NoTypst, match=r'pip install "\.\[pdf\]"'):
        write_report([tmp_path / "nothing is read before"], tmp_path / "x.pdf")
    ended = command("report", ROOT / "sample_data/spin-down-1", "-o", "x.pdf", "--no-crosscheck", cwd=tmp_path)
    assert ended.status == 1
    assert 'pip install ".[pdf]"' in ended.err
    assert not (tmp_path / "x.pdf").exists()


def test_another_ending_is_wrong_usage_and_says_which_two_work(tmp_path):
    ended = command("report", ROOT / "sample_data/spin-down-1", "-o", "x.docx", cwd=tmp_path)
    assert ended.status == 2
    assert ".html or .pdf" in ended.err
