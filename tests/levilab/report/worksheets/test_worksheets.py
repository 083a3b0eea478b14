"""Worksheets and keys: each language is complete, the commands work, and students find the numbers of the key."""

import json
import re
import shlex
import signal
from dataclasses import replace

import numpy as np
import pytest

from levilab.acquisition.experiments.spin import SpinSettings
from levilab.errors import UsageError
from levilab.live.practice.experiments import PRACTICE
from levilab.pipelines.catalogue import ANALYSES
from levilab.report.beside import class_of
from levilab.report.worksheets.document import key as key_of
from levilab.report.worksheets.document import measure, read_language, write_worksheets
from levilab.report.worksheets.sheets import SHEETS
from levilab.runs.writer import RunWriter
from levilab.texts.text import in_language, languages
from levilab.world.spin_world import random_scene
from support.browser import watch
from support.pages import Page

LANGUAGES = languages()
#: The sheet of the precession has nothing of its own that the spin's has not, and its sweep in full motion takes 8 s.
TRIED = [name for name in SHEETS if name != "precession"]


@pytest.mark.parametrize("code", LANGUAGES)
def test_each_question_has_an_answer(code):
    assert all(len(texts.tasks) == len(texts.answers) for texts in read_language(code).sheets.values())


@pytest.mark.parametrize("code", LANGUAGES)
def test_the_key_of_the_spin_knows_both_ways_to_measure(code):
    clicked = dict(one.removeprefix("spin.").split("=") for one in PRACTICE["spin"].settings)
    typed = vars(SpinSettings())
    how = [(float(one["interval_s"]), float(one["drive_frequency_hz"])) for one in (typed, clicked)]
    for answer, (every, start) in zip(read_language(code).sheets["spin"].answers[0].split(";"), how, strict=True):
        assert f"{every:.0f} s, " in answer
        assert f" {start:.0f} Hz " in answer
    assert in_language("undecided", code) in read_language(code).sheets["spin"].answers[1]  # as the class says


@pytest.mark.parametrize("code", LANGUAGES)
def test_every_text_is_used(code, tmp_path):
    files = write_worksheets(["field"], tmp_path, {"A": 1}, language=code)
    files += write_worksheets(["limit"], tmp_path, {"A": 1}, language=code, keys=False)
    page = " ".join(Page(file.read_text(encoding="utf-8")).text for file in files)
    language = read_language(code)
    filled = [text.replace("{group}", "A").replace("{seed}", "1") for text in language.words.values()]
    texts = language.sheets["field"]
    missing = [text for text in (*filled, texts.title, texts.aim, *texts.tasks, *texts.answers) if text not in page]
    assert missing == []
    assert f'lang="{code}"' in files[0].read_text(encoding="utf-8")
    assert (f"--seed 1 --language {code} --out class" in page) is (code != "en")  # as the program speaks by itself


@pytest.mark.parametrize("moment", ["reading", "finish"])
def test_ctrl_c_at_any_moment_of_a_run_ends_the_key(monkeypatch, moment):
    """Also after its last reading: the other groups' runs would go on otherwise."""
    usual, runs = getattr(RunWriter, moment), []

    def interrupted(self, *given):
        signal.raise_signal(signal.SIGINT)
        runs.append(self.folder)
        return usual(self, *given)

    monkeypatch.setattr(RunWriter, moment, interrupted)
    with pytest.raises(KeyboardInterrupt):
        measure(SHEETS["field"], {"A": 1, "B": 2})
    assert len({*runs}) == 1


@pytest.mark.parametrize("code", LANGUAGES)
def test_a_key_is_whole_on_a_narrow_screen(code, tmp_path, browser):
    _, file = write_worksheets(["field"], tmp_path, {"Group 1": 100, "Group 2": 101}, language=code)
    with watch(browser, viewport={"width": 900, "height": 900}) as page:
        page.goto(file.as_uri())
        wide = "[...document.querySelectorAll('.scroll')].map((one) => one.scrollWidth - one.clientWidth)"
        assert page.evaluate(wide) == [0, 0]


#: Three tops in the place of ten, which take 2 s.
SHORT = SHEETS | {"limit": replace(SHEETS["limit"], settings=("limit.repetitions=3",))}


@pytest.mark.parametrize("experiment", TRIED)
@pytest.mark.usefixtures("undrawn_figures")
def test_the_commands_of_a_worksheet_find_the_numbers_of_its_key(experiment, tmp_path, levilab, monkeypatch):
    monkeypatch.setattr("levilab.report.worksheets.document.SHEETS", SHORT)
    sheet, seeds = SHORT[experiment], {"Group 1": 41}
    (file,) = write_worksheets([experiment], tmp_path, seeds, keys=False)
    typed = re.search(r"<pre>.*?</pre>", file.read_text("utf-8"), re.DOTALL)[0]
    commands = re.findall(r"levilab [^\n]+", re.sub("<[^>]+>", "", typed))
    assert len(commands) == len(sheet.commands("", 0))
    for command in commands:
        levilab(*shlex.split(command.replace("&quot;", '"'))[1:])
    analysis = ANALYSES[sheet.analysis]
    students = class_of(analysis, analysis.recall([tmp_path / "class"]), sheet.asked)
    key = measure(sheet, seeds)
    assert [one.estimates for one in students.quantities] == [one.estimates for one in key.quantities]
    assert [one.truths for one in students.quantities] == [one.truths for one in key.quantities]
    assert all(None not in one.truths for one in key.quantities if one.name not in sheet.asked)
    assert {*sheet.asked} <= {one.name for one in key.quantities}
    assert json.loads(next((tmp_path / "class").glob("2*/run.json")).read_text(encoding="utf-8"))["seed"] == 41
    if experiment == "spin":  # what students calculate by hand is within the 0.5 % of the key's answer
        (readings,) = (tmp_path / "class").glob("2*/readings.csv")
        (t1, nu1), *_, (t2, nu2) = np.loadtxt(readings, delimiter=",", skiprows=1, usecols=(0, 1))
        by_hand = 2 * ((2 * np.pi * nu2) ** -0.5 - (2 * np.pi * nu1) ** -0.5) / (t2 - t1)
        assert by_hand == pytest.approx(key.quantities[0].estimates[0].value, rel=0.005)
    if experiment == "limit":  # of the tops that the seed draws, each within 0.05 Hz, the u of a line through its fall
        falls = [random_scene(41).fall_of(k) for k in range(3)]
        (mean, scatter), u = (quantity.estimates[0].value for quantity in key.quantities), 0.05 / 3**0.5
        assert (mean, scatter) == pytest.approx((np.mean(falls), np.std(falls, ddof=1)), abs=4 * u)


def test_a_key_has_the_values_and_truths_of_each_seed_and_the_worksheet_none(tmp_path):
    seeds = {"Gruppe 1": 7, "Gruppe 2": 8}
    sheet, key = write_worksheets(["spin"], tmp_path, seeds, language="de")
    assert (sheet.name, key.name) == ("spin-de.html", "spin-key-de.html")
    measured = measure(SHEETS["spin"], seeds)
    found = measured.quantities[0]
    page = Page(key.read_text(encoding="utf-8")).text
    english = read_language("en")
    assert "Who clicked" in str(key_of(SHEETS["spin"], english, seeds, measured))
    assert "Who clicked" not in str(key_of(SHEETS["limit"], english, seeds, measured))  # whose sheet has no clicks
    values = [1e4 * value for value in (*(one.value for one in found.estimates), *found.truths)]
    assert all(f"{value:.3f}"[:4].replace(".", ",") in page for value in values)
    assert min(abs(value - float(english.words["notation"].partition("(")[0])) for value in values) > 1  # no answer
    assert "SYNTHETISCH." in page
    assert "×10⁻⁴" not in Page(sheet.read_text(encoding="utf-8")).text


@pytest.mark.parametrize(("experiment", "language"), [("orbit", "en"), ("spin", "xx"), ("precesion", "en")])
def test_what_is_unknown_is_refused_with_what_there_is(experiment, language, tmp_path):
    with pytest.raises(UsageError, match=r"precession|de, en"):
        write_worksheets([experiment], tmp_path, {"A": 1}, language=language)
