"""The order of a report, its short form, and what a person writes above it."""

import re

import pytest

from levilab.present.document.blocks import Document, in_language_of_reader
from levilab.report.page import write_report
from levilab.report.reproduction import Heading
from support.pages import Page
from support.paths import SAMPLE_DATA

RUNS = [SAMPLE_DATA / "spin-down-1", SAMPLE_DATA / "spin-down-2"]


@pytest.mark.usefixtures("undrawn_figures")
def test_a_report_begins_with_the_result_and_notes_follow_the_figure(tmp_path):
    page = Page(write_report(RUNS, tmp_path / "report.html").read_text(encoding="utf-8"))
    found = page.of_level(2)
    assert found[:3] == ["Result", "Figure", "Notes"]
    assert {"Uncertainty budget", "What was measured, and with what", "How to reproduce this"} <= set(found)


@pytest.mark.usefixtures("undrawn_figures")
def test_a_short_one_has_no_more_and_names_the_command_that_makes_it(tmp_path):
    heading = Heading("It's <7>", "Physics lab 2", "A. Kim", "28 November")
    text = write_report(RUNS, tmp_path / "report.html", short=True, heading=heading).read_text(encoding="utf-8")
    page = Page(text)
    assert page.of_level(2) == ["Result", "Figure", "Notes"]
    assert page.of_level(1) == ["It's <7>"]
    assert "Physics lab 2 · A. Kim · 28 November" in text
    assert "Spin-down of a levitated top: 2 runs" in text
    assert "Made by: levilab report" in text
    assert "--short --title" in text
    assert "readings.csv" not in text


def test_a_title_of_a_person_is_not_translated_and_what_stands_below_it_is():
    document = Heading("Result").above(Document("Figure", "no notes", ()))
    said = in_language_of_reader(document, "de")
    assert (said.title, said.lead) == ("Result", "Abbildung: keine Hinweise")


def test_a_short_one_of_few_spin_downs_is_one_page_without_criteria(tmp_path):
    runs = [*RUNS, SAMPLE_DATA / "spin-down-3"]
    pages = re.findall(rb"/Type */Page\b", write_report(runs, tmp_path / "short.pdf", short=True).read_bytes())
    assert len(pages) == 1
    text = Page(write_report(runs, tmp_path / "short.html", short=True).read_text(encoding="utf-8")).text
    assert not re.search("AICc|Durbin|order test", text)
    assert "-o short.html" in text
