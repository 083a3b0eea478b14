"""The live view in other languages: nothing stands outside of the table, and a choice stays."""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest

from levilab.live.desk import Desk
from levilab.live.tuning import advice_on
from levilab.live.words import data_in
from levilab.telemetry.messages import Drive, Record, State
from levilab.texts import text
from levilab.texts.text import Text
from support.browser import DESK, PHONE
from support.live_pages import GrowingRun, address, publish, request, serving, spin_down, until

NAME = "20261122T100000Z-spin-0000"
#: What a person reads of a page: texts of elements, and of attributes.
READ = """[...document.querySelectorAll('body, body *')].filter((one) => !one.closest('script, noscript, .fit'))
.flatMap((one) => [...[...one.childNodes].filter((node) => node.nodeType === 3).map((node) => node.data),
  ...['title', 'aria-label', 'placeholder', 'data-drop', 'alt'].map((name) => one.getAttribute(name) || '')])"""
#: What is data, or the same in all languages: names of languages, numbers and units, names of runs and models.
DATA = re.compile(r"English|Deutsch|Klammer|[0-9].*|hertz|bar|min|UTC|SQU|Vpp|TestMaker|Model.*|spin|Group 7")


#: A bench that says nothing.
SILENT = SimpleNamespace(address=None, may_record=False, events=list)


@pytest.fixture
def hall(tmp_path):
    run = GrowingRun(tmp_path / "runs", NAME, note="note of a person")
    run.readings(spin_down(19))
    run.event("x", says=Text("the top follows the drive at {drive:.2f} Hz", drive=30.5).as_table())
    run.event("the top follows the drive up")
    with serving(tmp_path / "runs", desk=Desk(SILENT)) as hall:
        yield hall


def measure(hall, run=""):
    again = "switch it off, match the spin, and go up more slowly"
    said = Text("the drive has lost the top near {drive:.1f} Hz: {again}", drive=61.2, again=again)
    drive = Drive("SQU", 30.25, 10.0, output=True)
    wave = np.zeros(50, np.float32)
    publish(
        hall.watches[run],
        State(2.0, text=said, last={"spin_frequency_hz": 30.5, "flux_density_t": 1.25e-3}, drive=drive, virtual=True),
        Record(1, "tape", 2.0, 0.0, 1e-3, wave, wave, drawn=True),
    )


@pytest.fixture
def made_up(tmp_path, monkeypatch):
    """A language that is a file and nothing else: each text stands in brackets."""
    folder = tmp_path / "texts"
    folder.mkdir()
    for code in text.languages():
        (folder / f"{code}.toml").write_bytes((text.FOLDER / f"{code}.toml").read_bytes())
    german = text.language_of("de")
    tables = {"page": german.page, "all": {key: "" for key in german.texts if key not in german.page}}
    lines = ['name = "Klammer"', 'decimal = "·"']
    for name, keys in tables.items():
        lines += [f"[{name}]", *(f"{json.dumps(key)} = {json.dumps(f'⟦{key}⟧')}" for key in keys)]
    (folder / "xx.toml").write_text("\n".join(lines), encoding="utf-8")
    monkeypatch.setattr(text, "FOLDER", folder)
    text.language_of.cache_clear()
    yield
    text.language_of.cache_clear()


def outside(page):
    """What a page says outside of brackets, with three letters or more."""
    found = []
    for one in page.evaluate(READ):
        while re.search("⟦[^⟦⟧]*⟧", one):
            one = re.sub("⟦[^⟦⟧]*⟧", "", one)  # noqa: PLW2901 - from the inside out
        words = re.findall(r"[^\s,:;()]*[A-Za-z]{3,}[^\s,:;()]*", one)
        found += [one for word in words if not DATA.fullmatch(word)]
    return found


@pytest.mark.usefixtures("made_up")
def test_a_language_that_is_a_new_file_says_everything_of_a_page(hall, watched):
    page = watched()
    page.goto(f"{address(hall)}?language=xx#{hall.doors.token}")
    until(page, "document.body.dataset.state === 'setup' && levilab.frames > 0")
    assert outside(page) == []
    measure(hall)
    until(page, "levilab.data.bench && document.getElementById('trace').getAttribute('aria-label').includes('volt')")
    assert outside(page) == []
    assert page.inner_text("#spin-value") == "30·5000"
    page.fill("#frequency", "abc")
    page.press("#frequency", "Enter")
    assert page.inner_text("#frequency-wrong") == "⟦a number from 1 to 100 Hz, not abc⟧"
    page.select_option("#run", NAME)
    until(page, "levilab.drawn > 0 && levilab.data.fit")
    assert re.match("⟦the top follows the drive (up|at 30·50 Hz)⟧$", page.inner_text("#event-list li:last-child span"))
    assert page.inner_text("#fit-head").startswith("⟦⟦disc⟧ law")  # raised figures stand in elements of their own
    assert [one for one in outside(page) if NAME not in one and one not in {"note of a person", "2026-11-22"}] == []
    page.goto(f"{address(hall)}open")
    until(page, "document.getElementById('kept-in').textContent")
    assert [one for one in outside(page) if str(hall.opened.folder) not in one] == []


#: Texts of a field and of a choice that are wider than these, less the arrow of a choice.
CUT = """['group', 'motion'].flatMap((id) => {
  const one = document.getElementById(id), {font, paddingLeft, paddingRight} = getComputedStyle(one);
  const room = one.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight) - (one.options ? 16 : 0);
  const context = Object.assign(document.createElement('canvas').getContext('2d'), {font});
  const texts = one.options ? [...one.options].map(({text}) => text) : [one.placeholder];
  return texts.filter((text) => context.measureText(text).width > room);
})"""


@pytest.mark.parametrize("viewport", [DESK, PHONE], ids=["desk", "phone"])
def test_a_page_in_german_stays_german_and_nothing_is_cut(viewport, hall, watched):
    page = watched(viewport=viewport)
    page.goto(address(hall, token=True))
    until(page, "levilab.frames > 0")
    assert page.get_attribute("html", "lang") == "en"
    page.evaluate("levilab.history.mark(1, 'fell')")
    page.select_option("#language", "de")
    page.wait_for_url("**/?language=de")
    until(page, "levilab.frames > 0")
    assert page.evaluate("levilab.history.marks") == [[1, "fell"]]  # the last minutes are there in each language
    page.goto(address(hall))  # without it: the browser has kept the choice
    until(page, "levilab.frames > 0")
    assert page.get_attribute("html", "lang") == "de"
    measure(hall)
    until(page, "levilab.data.bench && !document.getElementById('controls').disabled")
    assert page.evaluate("levilab.data.bench.text") == (
        "der Antrieb hat den Kreisel nahe 61,2 Hz verloren: ausschalten, angleichen und langsamer hinauf"
    )
    until(page, "document.getElementById('spin-value').textContent == '30,5000'")
    assert page.inner_text("#field-value") == "1,250"
    assert page.evaluate("document.documentElement.scrollWidth") == viewport["width"]
    parts = "[...document.querySelectorAll('button, select, h2, dt')]"
    wide = f"{parts}.filter((one) => one.scrollWidth > one.clientWidth + 1)"
    assert page.evaluate(f"{wide}.map((one) => one.textContent)") == []
    assert page.evaluate(CUT) == []
    first, last = (f"document.querySelector('.looks label:{one}').offsetTop" for one in ("first-child", "last-child"))
    assert viewport == PHONE or page.evaluate(f"{last} - {first}") < 12


@pytest.mark.parametrize(("browser", "started_in", "seen"), [
    ("de-DE,de;q=0.9,en;q=0.8", "", "de"), ("fr,de;q=0.5", "", "de"), ("en-GB,de;q=0.5", "", "en"), ("fr", "", "en"),
    ("de-DE", "en", "en"), ("en", "de", "de"), ("en;q=0.5,de", "", "de"), ("fr, de;q=0", "", "en"),
])  # fmt: skip
def test_a_page_is_in_the_language_of_the_browser_where_none_was_chosen(hall, browser, started_in, seen):
    hall.language = started_in
    page = request(address(hall), "/", headers={"Accept-Language": browser})[1]
    assert f'<html lang="{seen}"' in page


def test_the_server_answers_in_the_language_of_the_page_that_asks(hall):
    said = data_in("de", advice_on({"top": "24.1", "washers": "0.4", "temperature": "20"}))["text"]
    assert said.startswith("Nimm keine Scheiben: Der Kreisel wiegt dann 24,1 g und schwebt mit")
    head, asked = {"Content-Type": "application/json"}, b'{"do": "say which washers", "top": "x"}'
    wrong = request(address(hall), "/do?language=de", asked, headers=head | {"X-Levilab-Token": hall.doors.token})[1]
    assert json.loads(wrong)["error"] == "Kreisel: erwartet wird eine Masse, etwa 24.98 g"
    said = [request(address(hall), f"/do?language={code}", b"{}", headers=head)[1] for code in ("en", "de", "zz")]
    english, german, other = (json.loads(one)["error"] for one in said)
    assert english == other == "this page may only look: open the address that the terminal shows"
    assert german == "diese Seite darf nur zusehen: öffne die Adresse, die das Terminal zeigt"
