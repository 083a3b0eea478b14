"""What the acquire commands ask of the person at the bench."""

from __future__ import annotations

import io
import json

import pytest
from typer.testing import CliRunner

from levilab.acquisition import loop
from levilab.acquisition.session import ExperimentFailed
from levilab.acquisition.table import EXPERIMENTS
from levilab.bench.person import Task, ask_no_person
from levilab.cli.acquire import _ask
from levilab.cli.main import app
from support.commands import command


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
    assert all(name in command("acquire", experiment, "--settings", cwd=tmp_path).out for name in settings)
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
    bench.write_text(
        "[counter]\nmodel = '53230A'\naddress = 'A::1'\n[generator]\nmodel = '33500B'\naddress = 'A::2'\n",
        encoding="utf-8",
    )
    monkeypatch.setattr(loop, "acquire", acquire)
    with pytest.raises(Stopped):
        CliRunner().invoke(
            app, ["acquire", "spin", "--bench", str(bench), "--out", str(tmp_path), *words], catch_exceptions=False
        )
    assert asked == [person]
