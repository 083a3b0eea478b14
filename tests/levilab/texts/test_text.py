"""Texts in other languages: each language has every text with its values, and a new one is a file."""

import ast
import json
import pickle
import re
from unittest.mock import Mock

import pytest

from analysis.errors import AnalysisError
from analysis.precession.miscounts import Miscount
from analysis.pulses.errors import OnlyHum, TooFewPulses
from analysis.uncertainty import Estimate
from levilab.acquisition.given import settings_without_bench, with_given_settings
from levilab.acquisition.table import EXPERIMENTS
from levilab.errors import LevilabError, UsageError, check_language
from levilab.formats import kinds as files
from levilab.live.practice.experiments import PRACTICE
from levilab.live.practice.tasks import TASKS
from levilab.live.practice.what_if import WHAT_IF
from levilab.live.server import PAGE
from levilab.live.views import VIEWS
from levilab.live.words import change_texts
from levilab.motion import effects
from levilab.motion.summary import ENDINGS, FALLS
from levilab.pipelines.analyzed import EachAlone
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.inputs.unread import OTHER_COLUMNS
from levilab.pipelines.look import QUANTITIES
from levilab.pipelines.precession.words import miscount_as_text
from levilab.pipelines.tune.advice import MET
from levilab.present.document.blocks import in_language_of_reader
from levilab.present.numbers import short_name, with_uncertainty
from levilab.present.tables import table
from levilab.present.units import split
from levilab.present.words import settings_in_words
from levilab.report.worksheets.document import read_language
from levilab.report.worksheets.sheets import TOPS
from levilab.settings import KINDS, LIMITS, WHOLE
from levilab.simulator.scene import REMARKS, RULES, SWITCHES, Scene, preset, presets
from levilab.texts.text import Text, in_language, language_of, languages, speak, text_from, text_of
from support.paths import SAMPLE_DATA
from support.sources import nodes

LANGUAGES = [code for code in languages() if code != "en"]
#: Functions whose text a person reads, in the modules of these rooms, and the number of the argument.
SAYING = {
    "_say": 0, "say": 0, "message": 0, "CommandRefused": 0, "event": 1, "warn": 0, "progress": 0, "tell": 0,
    "Task": 0, "FloatTop": 0, "PlaceProbe": 0, "ShieldProbe": 0,
    "ExperimentFailed": 0, "DidNotFollow": 0, "NoLight": 0, "_unfit": 0,
}  # fmt: skip
ROOMS = ("levilab.live.", "levilab.acquisition.")
#: Rooms in which every text of an error is looked for, also an f-string, which no table can have.
OF_FILES = ("levilab.formats", "levilab.pipelines")
#: Arguments of errors that are not values of a sentence.
NO_VALUES = {"line", "value", "kind", "doubt", "reasons", "left_out"}
_LITERAL = r'"((?:[^"\\]|\\.)*)"'
#: In JavaScript: a text, or one of two.
_PHRASE = re.compile(rf"phrase\((?:[^()\"]*\?)?\s*{_LITERAL}(?:\s*:\s*{_LITERAL})?")


def is_worded(text):
    """Whether there is a word beside the values: units, letters and names, as x_m, are the same in all languages."""
    return bool(re.search(r"[A-Za-z]{3,}", re.sub(r"\{[^}]*\}|\w+[_/]\w+", "", text)))


def fields(text):
    return set(re.findall(r"\{\w+(?::[^}]*)?\}", text))


def strings(node):
    """The strings that an argument may be; an f-string, which no table can have, as it stands in the program."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.JoinedStr):
        yield ast.unparse(node)
    elif isinstance(node, ast.IfExp):
        yield from strings(node.body)
        yield from strings(node.orelse)


def of_pages():
    """What the live view's pages say: HTML, JavaScript, and the rows that they show."""
    found = set()
    for html in PAGE.glob("*.html"):
        change_texts(html.read_text("utf-8"), lambda text: found.add(text) or text)
    for module in PAGE.glob("*.js"):
        found |= {one for pair in _PHRASE.findall(module.read_text("utf-8")) for one in pair if one}
    found |= {text for row in PRACTICE.values() for text in (row.title, row.asks)}
    found |= {text for row in TASKS.values() for text in (row.title, row.does, row.teaches)}
    found |= {text for change in WHAT_IF.values() for text in (change.title, change.shows)}
    found |= {label for view in VIEWS.values() for label in (view.x_label, view.y_label)}
    return found | {words for words, _ in QUANTITIES.values()}


def of_worksheets():
    """What worksheets say."""
    sheets = read_language("en")
    texts = {*sheets.words.values()}
    for sheet in sheets.sheets.values():
        texts |= {sheet.title, sheet.aim, *sheet.tasks, *sheet.answers}
    return {text.replace(f"{TOPS} tops", "{tops} tops") for text in texts}


def of_files():
    """What is said of files and runs that are left out, and of scenes."""
    kinds = (*files.KINDS, files.OTHER, files.EMPTY, OTHER_COLUMNS)
    runs = {f"{name} run" for name in EXPERIMENTS}
    needed = {one.runs for one in ANALYSES.values()}
    texts = {text for kind in kinds for text in (kind.name, kind.several, kind.advice)}
    scenes = {preset(name).description for name in presets()}
    return texts | needed | scenes | runs | {f"{r}s" for r in runs}


def errors(base):
    """The names of a class of errors and of those below it."""
    return {base.__name__}.union(*map(errors, base.__subclasses__()))


def of_analyses():
    """What errors of the analyses say, and of what."""
    found = set()
    for name, call in ((name, call) for name, calls in nodes(ast.Call).items() for call in calls):
        if name.startswith("analysis.") and ast.unparse(call.func) in {"super().__init__", *errors(AnalysisError)}:
            found |= {text for one in (*call.args, *(word.value for word in call.keywords)) for text in strings(one)}
    return found | {TooFewPulses.HINT, OnlyHum.HINT}


def of_tables():
    """What tables say of a scene's settings and of its effects, of ends and of faults."""
    said = {text for one in (*effects.KINDS, *effects.field_kinds(Scene())) for text in (one.name, one.what)}
    settings = {one.expected for one in RULES} | {one.text for one in REMARKS} | {one.why for one in SWITCHES}
    tables = (FALLS, ENDINGS, MET, LIMITS, KINDS, WHOLE)
    return said.union(settings, *(table.values() for table in tables))


def assigned(module):
    """Name → the strings that a module assigns to it."""
    named = {}
    for node in nodes(ast.Assign)[module]:
        if isinstance(node.targets[0], ast.Name):
            named.setdefault(node.targets[0].id, set()).update(strings(node.value))
    return named


def of_program():
    """What the program says in sentences: each `Text`, errors of files, and what the functions of SAYING are given."""
    found = of_analyses() | of_tables()
    refusals, usage = {*errors(LevilabError), "refuse"}, errors(UsageError)
    for name, calls in ((name, calls) for name, calls in nodes(ast.Call).items() if name.startswith("levilab.")):
        named = assigned(name)
        for call in calls:
            called = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
            said = call.args[: called in {"Text", "Said", "title_of"}]
            if called in refusals and (name.startswith(OF_FILES) or {word.arg for word in call.keywords} - NO_VALUES):
                said = call.args[called in usage :]
            elif called in SAYING and name.startswith(ROOMS):
                said = call.args[SAYING[called] :][:1]
            found |= {text for one in said for text in (*strings(one), *named.get(ast.unparse(one), ()))}
    return found


@pytest.mark.parametrize("code", LANGUAGES)
def test_a_language_has_every_text(code):
    page, texts = language_of(code).page, language_of(code).texts
    said = of_program() | of_worksheets() | of_files()
    assert sorted(text for text in of_pages() if is_worded(text) and text not in page) == []
    assert sorted(text for text in said if is_worded(text) and text not in texts) == []


@pytest.mark.parametrize("code", LANGUAGES)
def test_a_text_has_the_values_of_the_english_one(code):
    texts = language_of(code).texts
    assert {english: text for english, text in texts.items() if fields(english) != fields(text) or not text} == {}


def settings_fields():
    """Names of settings: fields of the classes of experiments' settings, and what drivers declare by `Setting`."""
    named = set()
    for one in (node for classes in nodes(ast.ClassDef).values() for node in classes):
        for node in one.body:
            if isinstance(node, ast.AnnAssign) and one.name.endswith("Settings"):
                named.add(ast.unparse(node.target))
            elif isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("Setting("):
                named.add(ast.unparse(node.targets[0]))
    return named


@pytest.mark.parametrize("code", LANGUAGES)
def test_no_text_is_of_a_sentence_that_is_said_no_more(code):
    samples = ast.walk(ast.parse((SAMPLE_DATA / "make.py").read_text("utf-8")))
    constants = (node for found in (*nodes(ast.Constant).values(), samples) for node in found)
    said = of_pages() | of_worksheets() | of_files()
    said |= {node.value for node in constants if isinstance(getattr(node, "value", None), str)}
    said |= {re.sub(r"(_frequency)?_(hz|v|t|m|s)$", "", text).replace("_", " ") for text in said}  # heads of columns
    said |= {split(name)[0].replace("_", " ") for name in settings_fields()}
    said |= {re.sub(r"\s+\[[^]]+\]$", "", text) for text in said}  # heads of columns without the unit
    said |= {f"{text}s" for text in said}  # as `how_many` makes them
    said |= {text.capitalize() for text in said}  # as figures have them
    said |= {text for module in PAGE.glob("*.js") for text in re.findall(_LITERAL, module.read_text("utf-8"))}
    assert sorted(text for text in language_of(code).texts if text not in said) == []


def test_a_text_is_the_english_sentence_and_comes_through_json_and_pickle():
    why = Text("the top spins at {spin:.2f} Hz", spin=21.5)
    said = Text("drive on at {hz:g} Hz, but {beside}: {takes}", hz=30.5, beside=why, takes="no more")
    assert said == "drive on at 30.5 Hz, but the top spins at 21.50 Hz: no more"
    german = "Antrieb ein bei 30,5 Hz, aber der Kreisel dreht sich mit 21,50 Hz: no more"
    for copy in (said, pickle.loads(pickle.dumps(said)), text_from(json.loads(json.dumps(said.as_table())))):
        assert copy == said
        assert in_language(copy, "de") == german


@pytest.mark.parametrize(
    "table", [None, {}, {"template": 3, "values": {}}, {"template": "{a}", "values": {}},
              {"template": "x", "values": [1]},
              {"template": "{a:d}", "values": {"a": "x"}}, {"template": "{a:99999999}", "values": {"a": [[[[]]]]}}]
)  # fmt: skip
def test_a_table_that_a_person_has_changed_is_no_text(table):
    assert text_from(table, "as it was") in {"as it was", "x", "{a:99999999}"}


def test_a_process_speaks_one_language_and_no_unknown_one(monkeypatch):
    monkeypatch.setattr("levilab.texts.text._of_process", "en")
    assert in_language("the top follows the drive") == "the top follows the drive"
    speak("de")
    assert in_language("the top follows the drive") == "der Kreisel folgt dem Antrieb"
    with pytest.raises(UsageError, match="language = xx: one of de, en is expected"):
        check_language("xx")


def test_a_name_keeps_its_point_and_a_number_gets_a_comma():
    assert [in_language(name, "de") for name in ("z1.5.csv", "v1.2", "d0.1")] == ["z1.5.csv", "v1.2", "d0.1"]
    listed = Text("{values:.1f} Hz and {text:n}", values=(1.5, 2.0), text="0.12(3) Hz")
    assert in_language(listed, "de") == "1,5; 2,0 Hz and 0,12(3) Hz"
    said = Text("{name}: {value}", name="d0.1.csv", value=with_uncertainty(Estimate(39.853, 0.031, "Hz")))
    assert in_language(said, "de") == "d0.1.csv: 39,853(31) Hz"
    shown = table("", ["input", "spin"], [["z1.5.csv", "1.50"], [short_name("result"), "—"]], numbers=["spin"])
    assert [row.cells for row in in_language_of_reader(shown, "de").rows] == [("z1.5.csv", "1,50"), ("result", "—")]
    drive = settings_in_words({"output": False, "frequency_hz": 49.4925, "amplitude_vpp": 4.9654, "burst_phase_deg": 9})
    assert in_language(drive, "de") == "Ausgang aus; letzter Antrieb 49,4925 Hz; 4,9654 Vss; Startphase des Bursts 9 °"
    over = Text("{longest:g} s are over ({experiment:s}.longest_s)", longest=9, experiment="sway")
    assert in_language(over, "de") == "9 s sind um (sway.longest_s)"


def test_a_note_and_a_finding_of_several_inputs_keep_their_language():
    spin = Text("The spin is {at}, its slope {slope:n}.", at="30.5 Hz", slope="0.1 Hz/s")
    sources = [Mock(warnings=(spin,)), Mock(warnings=())]
    for source, name in zip(sources, ("run0.5.csv", "b.csv"), strict=True):
        source.name = name
    runs = [Mock(text=spin, warnings=()) for _ in sources]
    found = EachAlone(tuple(sources), tuple(runs), None, Mock(), Mock(), (), (), (), ())
    said = "Die Drehfrequenz ist 30.5 Hz, ihre Änderung 0,1 Hz/s."
    assert in_language(found.text, "de") == f"run0.5.csv: {said}\nb.csv: {said}"
    assert [in_language(text, "de") for text in found.all_warnings] == [f"run0.5.csv: {said}"]


@pytest.mark.parametrize(
    ("times", "said"), [((2, 1), "gezählt wurde die doppelte Frequenz"), ((3, 2), "gezählt wurden 3/2 der Frequenz")]
)
def test_a_miscount_is_a_german_sentence(times, said):
    assert in_language(miscount_as_text(Miscount(0, times)), "de") == said


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("gate_s=abc", "erwartet wird eine Zahl über 0 [s]; levilab acquire spin --settings zeigt alle"),
        ("gates=1", "meintest du spin.gate_s"),
        ("gate_s=99", "gate_s = 99 muss kürzer sein als interval_s = 10"),
    ],
)
def test_a_wrong_setting_is_answered_in_german(given, said):
    with pytest.raises(UsageError) as refused:
        with_given_settings(settings_without_bench("spin"), "spin", [given])
    assert said in (german := in_language(text_of(refused.value), "de"))
    assert " or " not in german


@pytest.mark.parametrize(
    "words",
    [
        pytest.param("simulate tilted --duration 2 --explain", marks=pytest.mark.slow),  # it compiles the simulator
        "simulate driven --duration 9 --set drive.cycle_turns=1.5",
        "stability sway", "stability undriven --set top.mass_kg=1", "simulate undriven --set top.masse=3",
        "simulate undriven --set base.outer_radius_m=0.01", "simulate undriven --set top.mass_kg=abc",
        "simulate undriven --duration abc", "simulate sway --set drag.law=foo", "tune --top 24 --temperature x",
        "tune --top 24.9 --temperature 21 --washers 0.06,0.1 --trial 0.1g,20C,sink --trial 0.06g,20C,seitlich",
        "acquire --mock", "open --no-browser", "class . -o x.png",
        "sweep undriven --sweep start.spin_hz=18:40:3 --sweep top.mass_kg=25g:25.5g:2 --duration 0.1",
    ],
)  # fmt: skip
def test_what_commands_say_is_german_to_the_last_word(levilab, words, monkeypatch):
    monkeypatch.setenv("LEVILAB_LANGUAGE", "de")
    done = levilab(*words.split(), check=None)
    said = set(re.findall(r"\w+", done.stdout + done.stderr))
    assert len(said) > 5
    assert {"the", "of", "is", "are", "and", "to", "with", "not", "it", "or", "at"} & said == set()
    assert not any(one in done.stdout + done.stderr for one in ("Pendeln:", "= 0,03", "--trial", "= Sinus"))
