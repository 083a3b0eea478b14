"""The command: chapters by name, table, JSON, report, exit status."""

import json

import pytest

from levilab.errors import UsageError
from levilab.report.html.page import page_of
from levilab.reproduce import run
from levilab.reproduce.chapters import Chapter
from levilab.reproduce.check import Found, Verdict, statement
from levilab.reproduce.report import document_of
from levilab.reproduce.table import numbers
from support.commands import command
from support.paths import ROOT


def chapter(name, *, holds):
    found = Found((statement("<b>one</b>", "there", "it is", "we see", holds=holds),), (), "Said.", "made up")
    return Chapter(name, f"The {name}", lambda: found)


def test_chapters_come_in_their_order_and_a_wrong_name_is_refused(tmp_path):
    assert [one.name for one in run.choose(None)] == list(run.CHAPTERS)
    assert [one.name for one in run.choose("gans,limits")] == ["limits", "gans"]
    ended = command("reproduce", "--only", "limit", cwd=tmp_path)
    assert ended.status == 2
    assert "--only limit: did you mean limits? Known are stability, limits" in ended.err
    with pytest.raises(UsageError, match="known are stability, limits"):  # and not everything, which takes a minute
        run.choose("")


def test_a_report_has_its_verdicts_and_is_the_same_each_time_and_never_markup():
    found = run.reproduce([chapter("first", holds=True), chapter("second", holds=False)])
    assert found.counts == {Verdict.AGREES: 1, Verdict.DIFFERS: 0, Verdict.ADDED: 0, Verdict.UNEXPECTED: 1}
    assert not found.as_expected
    page = page_of(document_of(found))
    assert page == page_of(document_of(found))
    assert "<b>one</b>" not in page
    assert page.count("SYNTHETIC.") >= 3
    assert "1 are UNEXPECTED" in page
    assert "1 values and statements agree: 1 with what a source prints or says. 0 differ" in page


def test_the_command_prints_a_table_and_writes_a_report(tmp_path):
    ended = command("reproduce", "--only", "statistics", "-o", str(tmp_path / "deep" / "ten.html"), cwd=tmp_path)
    assert ended.status == 0, ended.err
    for text in (
        "compared with",
        "published",
        "here",
        "agreement",
        "21.86 Hz",
        "none is unexpected",
        "ten.html, in a new folder",
    ):
        assert text in ended.out
    page = (tmp_path / "deep" / "ten.html").read_text(encoding="utf-8")
    assert "Ten measured limits" in page
    assert "Gans" not in page


def test_json_is_one_document_and_writes_no_report(tmp_path):
    ended = command("reproduce", "--only", "stability", "--json", cwd=tmp_path)
    assert ended.status == 0, ended.err
    document = json.loads(ended.out)
    assert document["schema"] == "levilab-reproduction/1"
    assert document["as_expected"] is True
    (one,) = document["chapters"]
    assert one["findings"][0]["values"]["published"] == 0.458024
    kinds = {finding["comparison"] for finding in one["findings"]}
    assert kinds == {"recomputed", "fitted", "independent"}
    assert not list(tmp_path.iterdir())


def test_a_wrong_number_ends_the_command_with_one(monkeypatch, tmp_path):
    monkeypatch.setitem(run.CHAPTERS, "statistics", chapter("statistics", holds=False))
    ended = command("reproduce", "--only", "statistics", "-o", str(tmp_path / "ten.html"), cwd=tmp_path)
    assert ended.status == 1
    assert "UNEXPECTED" in ended.out
    assert "new folder" not in ended.out
    assert (tmp_path / "ten.html").exists()


def test_a_name_of_another_format_is_refused_before_anything_is_computed(tmp_path):
    ended = command("reproduce", "-o", str(tmp_path / "report.docx"), cwd=tmp_path)
    assert ended.status == 2
    assert ".html" in ended.err


@pytest.mark.slow
def test_no_chapter_has_anything_unexpected_and_the_page_has_all_counts(monkeypatch):
    """In steps that are two to five times as wide as the command's, which are in what a chapter allows for."""
    for name, step in {"limits.STEP_HZ": 0.02, "limits.UPPER_STEP_HZ": 0.1, "simon.STEP_RAD_S": 3.0}.items():
        monkeypatch.setattr(f"levilab.reproduce.{name}", step)
    found = run.reproduce(run.choose(None))
    assert found.unexpected == ()
    page = (ROOT / "docs/reproduce.md").read_text(encoding="utf-8").splitlines()
    for chapter, of_chapter in found.chapters:
        (row,) = (line for line in page if line.startswith(f"| `{chapter.name}`: "))
        assert [cell.strip() for cell in row.strip("|").split("|")[1:]] == numbers(of_chapter.findings), chapter.name
