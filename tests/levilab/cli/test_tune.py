"""levilab tune: a question at a time, or all by options."""

import io
import json
import os
import signal
import subprocess
import sys

import pytest

from support.commands import command

BENCH = ("--top", "24.9", "--washers", "0.06,0.06,0.1,0.2")


@pytest.fixture
def answers(monkeypatch, tmp_path):
    def run(*lines, options=()):
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{line}\n" for line in lines)))
        return command("tune", "--ask", *options, cwd=tmp_path)

    return run


def test_the_next_step_comes_first_and_is_one_sentence(tmp_path):
    ended = command("tune", *BENCH, "--temperature", "21", "--trial", "0.06 g, 21 C, rises", cwd=tmp_path)
    assert ended.status == 0
    first, why, window, *_ = ended.out.splitlines()
    assert first.startswith("Add the 0.")
    assert "floats with a chance of" in first
    assert why.startswith("It rose")
    assert window.startswith("Mass to set at 21 °C: 25.")
    assert ended.err == "kept in tune.toml: 1 trial\n"


def test_json_is_one_document_in_si(tmp_path):
    ended = command("tune", *BENCH, "--temperature", "21 °C", "--json", cwd=tmp_path)
    document = json.loads(ended.out)
    assert document["schema"] == "levilab-tune/1"
    assert document["values"]["mass_to_set"]["unit"] == "kg"
    assert document["best"] in document["choices"]


def test_a_person_is_asked_and_every_answer_is_kept_at_once(answers, tmp_path):
    ended = answers("24,9", "24.9 g", "0.06, 0.06, 0.1", "21", "rises", "what", "22 C", "floats", "")
    assert ended.status == 0
    asked = ended.err.splitlines()
    assert asked[0] == "How heavy is the top without washers?  [g]"
    assert asked[1] == "a mass such as 24.98 g is expected; write a decimal point, not a comma"
    assert asked.count("kept in tune.toml: 2 trials") == 1
    kept = (tmp_path / "tune.toml").read_text("utf-8")
    assert kept.count("21 °C, rises") == kept.count("22 °C, floats") == 1
    again = answers("22", "")
    assert (again.status, again.out.startswith("Leave the washers as they are")) == (0, True)


def test_what_was_typed_is_kept_where_a_later_question_ends_it(answers, tmp_path):
    assert answers("24.9").status == 2  # standard input ends, as a person would by Ctrl-C
    assert answers("0.06, 0.1").err.startswith("Which washers have you")
    assert answers().err.startswith("How warm are the magnets")
    assert 'top = "24.9 g"' in (tmp_path / "tune.toml").read_text("utf-8")


def test_washers_without_commas_or_as_heavy_as_a_top_are_asked_again(answers):
    asked = answers("24.9", "0.06 0.1", "60", "60 mg", "21", "").err.splitlines()
    assert asked[2] == "a comma is expected between two masses, as 0.06, 0.1 g"
    assert asked[4] == "a washer of 60 g on a top of 24.9 g? mg are typed as 60 mg, kg as 0.0249 kg"


def test_washers_with_an_outcome_are_no_temperature(answers):
    ended = answers("0.06 floats", "", options=(*BENCH, "--temperature", "21"))
    assert "a mass or washers, a temperature and an outcome" in ended.err
    assert "temperature of a room" not in ended.err


def test_the_end_of_input_ends_as_enter_does(answers):
    assert answers(options=(*BENCH, "--temperature", "21")).status == 0
    ended = answers(options=("--file", "other.toml"))
    assert (ended.status, ended.err.splitlines()[-1]) == (2, "levilab: --top: is needed, and standard input is closed")


@pytest.mark.parametrize(("options", "words"), [
    ((), "levilab: --top: is needed, such as 24.9g, or --ask to be asked for it"),
    ((*BENCH,), "levilab: --temperature: is needed, such as 21.5, or --ask to be asked for it"),
    ((*BENCH, "--temperature", "21,5"), "--temperature 21,5: a temperature of a room such as"),
    ((*BENCH, "--temperature", "21", "--trial", "25 g, rises"), "levilab: --trial 25 g, rises: a mass or washers, "),
    ((*BENCH, "--temperature", "21", "--device", "x"), "levilab: --device: goes with --scan"),
])  # fmt: skip
def test_a_wrong_call_is_one_line_and_leaves_no_file(options, words, tmp_path):
    ended = command("tune", *options, cwd=tmp_path)
    assert (ended.status, ended.out, words in ended.err, ended.err.count("\n")) == (2, "", True, 1)
    assert list(tmp_path.iterdir()) == []


def test_another_top_needs_a_file_of_its_own(tmp_path):
    command("tune", *BENCH, "--temperature", "21", "--trial", "0.06 g, 21 C, rises", cwd=tmp_path)
    ended = command("tune", "--top", "22", "--temperature", "21", cwd=tmp_path)
    assert (ended.status, "name another --file" in ended.err) == (2, True)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT")
def test_ctrl_c_at_a_question_keeps_what_was_said(tmp_path):
    words = [sys.executable, "-m", "levilab", "tune", "--ask", *BENCH, "--temperature", "21"]
    with subprocess.Popen(words, cwd=tmp_path, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdin.write("rises\n")
        process.stdin.flush()
        assert any("1 trial" in line for line in process.stderr)
        process.send_signal(signal.SIGINT)
        rest = process.stderr.read()
    assert (process.returncode, rest.splitlines()[-1]) == (130, "levilab: interrupted")
    assert "21 °C, rises" in (tmp_path / "tune.toml").read_text("utf-8")
