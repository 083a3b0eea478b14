"""A report in another language: what a person reads of it, and its figures."""

import json
import re

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text as Label

from levilab.pipelines.catalogue import ANALYSES
from levilab.present.style import as_png
from levilab.report.page import write_report
from levilab.texts.text import Text, speak
from support.pages import Page
from support.paths import SAMPLE_DATA


@pytest.fixture
def german():
    speak("de")
    yield
    speak("en")


@pytest.mark.usefixtures("german")
def test_a_german_report_has_german_headings_and_answer(tmp_path):
    run = SAMPLE_DATA / "spin-down-1"
    page = write_report([run], tmp_path / "report.html", short=True).read_text(encoding="utf-8")
    for said in (">Ergebnis<", "Am besten passt das Scheibengesetz", "--language de", 'lang="de"'):
        assert said in page
    assert ">Result<" not in page


#: English words that no German sentence has, and that no path, command or name of an instrument has, either.
_ENGLISH = re.compile(r"(?<![-/.])\b(?:the|of|and|is|are|not|each|from|by|with|which|its|than|but|where)\b(?![-/.])")


@pytest.mark.usefixtures("german")
@pytest.mark.parametrize(
    "run",
    ["spin-down-1", "lower-limits", "loose-washers", "precession-sweep", "field-scan", "trace-laser", "trace-tape",
     "hold", "sway/track.csv", "sway", "phone/magnetometer.csv", "spin-down-1 phone/magnetometer.csv"],
)  # fmt: skip
def test_no_english_sentence_is_left_in_a_german_report(tmp_path, run):
    """But for what the person at the bench wrote down."""
    paths = [SAMPLE_DATA / one for one in run.split()]
    page = write_report(paths, tmp_path / "report.html", {"reading_u": 0.03}, crosscheck=run == "trace-tape")
    text = Page(page.read_text(encoding="utf-8")).text
    for record in (one for path in paths for one in path.glob("**/run.json")):
        text = text.replace(json.loads(record.read_text(encoding="utf-8"))["note"], "")
    left = [text[max(found.start() - 50, 0) : found.end() + 50] for found in _ENGLISH.finditer(text)]
    assert left == []


@pytest.mark.usefixtures("german")
def test_a_figure_says_its_texts_and_numbers_in_german():
    figure = Figure()
    axes = figure.add_subplot(title=Text("Spin-down: {said}", said="fits"), xlabel="time  [s]", xlim=(0.0, 1.0))
    as_png(figure)
    assert (axes.get_title(), axes.get_xlabel()) == ("Auslaufen: passt", "Zeit  [s]")
    assert axes.get_xticklabels()[1].get_text() == "0,2"


@pytest.mark.usefixtures("german")
@pytest.mark.parametrize(("name", "path"), [("video", "video/top.mp4"), ("hold", "hold")])
def test_no_english_text_is_left_in_a_german_figure(name, path):
    """Nor one that is longer than its axes: it would run into the next ones."""
    if name == "video":
        pytest.importorskip("av")
    analysis = ANALYSES[name]
    paths = sorted((SAMPLE_DATA / path).glob("*-hz")) or [SAMPLE_DATA / path]
    options = analysis.options_from({"rim_m": 0.03, "stop_s": 1.5} if name == "video" else {})
    figure = analysis.figure(analysis.analyze(paths, options))
    as_png(figure)
    said = [text.get_text() for text in figure.findobj(Label)]
    left = [text for text in said if re.search(r"\b(mark|rim|base|path|turns|drag|law|by|the|spin)\b", text)]
    assert left == []
    assert not any("Bewertung" in text for text in said)
    for axes in figure.axes:
        label, room = axes.yaxis.label.get_window_extent(), axes.get_window_extent()
        assert label.height <= room.height


@pytest.mark.usefixtures("german")
def test_the_conditions_above_a_figure_of_limits_have_german_numbers():
    limit = ANALYSES["limit"]
    as_png(figure := limit.figure(limit.analyze([SAMPLE_DATA / "upper-limits"])))
    assert "24,3 g" in figure.axes[0].get_title(loc="left")
