"""What the acquire commands ask of the person at the bench."""

import io
import json
import re

import pytest
from typer.testing import CliRunner

from levilab.acquisition import loop
from levilab.acquisition.session import ExperimentFailed
from levilab.acquisition.table import EXPERIMENTS
from levilab.bench.person import PlaceProbe, Task, ask_no_person
from levilab.cli.acquire import _ask
from levilab.cli.main import app
from levilab.pipelines.tune.owner import read_scan
from levilab.runs.run import Run
from levilab.texts.text import Text, speak
from support.commands import command
from support.paths import ROOT


def test_the_person_is_asked_on_the_terminal(monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO("6.1 cm\n"))
    assert _ask(Task("How high is the probe?")) == "6.1 cm\n"
    assert capsys.readouterr().err == "How high is the probe?  [Enter]\n"


def test_a_question_without_a_terminal_ends_with_what_to_do(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    with pytest.raises(ExperimentFailed, match="standard input is closed"):
        _ask(Task("How high is the probe?"))


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_the_settings_of_an_experiment_are_listed_with_what_may_stand_there(tmp_path, experiment):
    listed = command("acquire", experiment, "--settings", "--json", cwd=tmp_path)
    settings = {one["name"]: one for one in json.loads(listed.out)["settings"]}
    assert settings.keys() == EXPERIMENTS[experiment].settings.model_fields.keys()
    units = {name: one["expected"].endswith("]") for name, one in settings.items()}
    assert [name for name in units if name.endswith(("_s", "_hz", "_v", "_m", "_t", "_vpp")) and not units[name]] == []
    shown = command("acquire", experiment, "--settings", cwd=tmp_path).out
    assert [name for name in settings if name not in shown] == []
    assert list(tmp_path.iterdir()) == []


def test_the_limits_of_the_bench_are_among_the_ranges(tmp_path):
    (tmp_path / "lab.toml").write_text("[limits]\ndrive_frequency_hz = 60.0\n", encoding="utf-8")
    listed = command("acquire", "spin", "--settings", "--bench", "lab.toml", cwd=tmp_path).out
    assert "a number above 0 up to 60 [Hz]" in listed


@pytest.mark.parametrize(("words", "person"), [((), _ask), (("--yes",), ask_no_person)])
def test_the_command_hands_the_person_over(monkeypatch, tmp_path, words, person):
    class Stopped(Exception):
        pass

    asked = []

    def acquire(request, show):
        asked.append(request.wiring().person)
        raise Stopped

    bench = tmp_path / "bench.toml"
    described = "[counter]\nmodel = '53230A'\naddress = 'A::1'\n[generator]\nmodel = '33500B'\naddress = 'A::2'\n"
    bench.write_text(described, encoding="utf-8")
    monkeypatch.setattr(loop, "acquire", acquire)
    with pytest.raises(Stopped):
        CliRunner().invoke(
            app, ["acquire", "spin", "--bench", str(bench), "--out", str(tmp_path), *words], catch_exceptions=False
        )
    assert asked == [person]


def test_a_run_keeps_temperature_and_washers_and_its_report_shows_them(tmp_path):
    words = ("acquire", "field", "--mock", "--yes", "--seed", "3", "--temperature", "68 F", "--washers", "0.06+0.1 g")
    assert command(*words, cwd=tmp_path).status == 0
    (folder,) = (tmp_path / "runs").iterdir()
    record = Run.load(folder).record
    assert (record.temperature_c, record.washers_kg) == (20.0, (6e-5, 1e-4))
    assert command("report", folder, "--no-crosscheck", "-o", "r.html", cwd=tmp_path).status == 0
    page = (tmp_path / "r.html").read_text("utf-8").replace("\u00a0", " ")
    assert all(text in page for text in ("Temperature", "20 °C", "Washers", "0.06 + 0.1 g"))
    # and the scan is at that temperature for levilab tune
    assert read_scan(folder, None, ROOT / "sample_data" / "device.toml", lambda _: None).temperature_c == 20.0


@pytest.mark.parametrize(("words", "says"), [
    (("--temperature", "294"), ("levilab: --temperature 294: a number from -30 to 60 °C is expected. "
     "Were kelvins meant? 294 K are 20.85")),
    (("--washers", "0.06kg"), "levilab: --washers 0.06kg: a number from 0.001 to 20 g is expected"),
    (("--washers", "0,06"), "levilab: --washers 0,06: a decimal point is expected, and a comma between two masses"),
])  # fmt: skip
def test_a_wrong_condition_is_refused_before_a_run_is_made(tmp_path, words, says):
    ended = command("acquire", "spin", "--mock", *words, cwd=tmp_path)
    assert (ended.status, ended.err, list(tmp_path.iterdir())) == (2, f"{says}\n", [])


@pytest.mark.parametrize(("words", "says"), [
    (("spin", "--spin", "500"), "--spin 500: spin.drive_frequency_hz = 500 is more than this bench allows, limits."),
    (("spin", "--spin", "-5"), "--spin -5: a number above 0 up to 100 [Hz] is expected"),
    (("spin", "--drive", "no"), "--drive no: ramp or triggered is expected"),
    (("spin", "--spin", "40", "--set", "drive_frequency_hz=500"),
     "--set drive_frequency_hz=500: spin.drive_frequency_hz = "),
    (("spin", "--spin", "500", "--language", "de"), "--spin 500: spin.drive_frequency_hz = 500 ist mehr, als dieser"),
    (("precession", "--drive", "triggered"), "--drive triggered: precession.drive = triggered: the drive sets"),
    (("field", "--set", "drive=ramp"), "--set field.drive: there is no such setting; levilab acquire field --settings"),
])  # fmt: skip
def test_a_refused_setting_is_called_as_it_was_typed(tmp_path, words, says):
    assert command("acquire", *words, "--mock", cwd=tmp_path).err.startswith(f"levilab: {says}")


def said_at_the_bench(tmp_path, name, *words):
    ended = command("acquire", "limit", "--mock", "--seed", "5", "--out", name, *words, cwd=tmp_path)
    events = [
        json.loads(line) for line in next((tmp_path / name).glob("*/events.jsonl")).read_text("utf-8").splitlines()
    ]
    return ended.err.splitlines(), [(one["kind"], one["text"]) for one in events], ended.out


def test_a_run_is_the_same_in_german_and_its_files_are_english(tmp_path, monkeypatch):
    monkeypatch.setattr("levilab.texts.text._of_process", "en")
    words = ("--set", "limit.repetitions=1")
    english, events, _ = said_at_the_bench(tmp_path, "english", *words)
    monkeypatch.setenv("LEVILAB_LANGUAGE", "de")
    german, events_of_german, result = said_at_the_bench(tmp_path, "german", *words)
    assert events_of_german == events
    assert events[-1][1].startswith("no light pulses any more: the top fell between ")
    said = {text.partition(",")[0] for text in english}
    assert {"drive off", "drive on at the top's spin", "the drive takes hold: count 6 of 27", "no reading"} <= said
    assert [line for line in german if line in english and re.search("[A-Za-z]{3}", line)] == []
    numbers = [re.findall(r"\d+(?:[.,]\d+)?", line) for line in german]
    assert [[one.replace(",", ".") for one in line] for line in numbers] == [
        re.findall(r"\d+(?:\.\d+)?", line) for line in english
    ]
    assert german[-3].startswith("keine Lichtpulse mehr: der Kreisel fiel zwischen ")
    assert result.startswith("beendet: 1 Messwert in german")


def test_an_error_and_a_question_are_in_the_language_of_the_person(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("levilab.texts.text._of_process", "en")
    words = ("acquire", "spin", "--mock", "--set", "spin.drive_frequency_hz=1e5", "--language", "de")
    assert "mehr, als dieser Versuchsstand erlaubt" in command(*words, cwd=tmp_path).err
    unknown = command("acquire", "spin", "--mock", "--language", "xx", cwd=tmp_path)
    assert (unknown.status, unknown.err) == (2, "levilab: --language xx: one of de, en is expected\n")
    monkeypatch.setenv("LEVILAB_LANGUAGE", "fr")
    assert command("runs", cwd=tmp_path).err == "levilab: LEVILAB_LANGUAGE fr: one of de, en is expected\n"
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    speak("de")
    _ask(PlaceProbe(Text("Height {which}: {height:.1f} mm.", which="1", height=61.5), 0.0615))
    assert capsys.readouterr().err.startswith("Höhe 1: 61,5 mm. Die Sonde dorthin auf die Achse stellen")
