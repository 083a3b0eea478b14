"""The command: its port, its ends, and what it needs."""

import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from queue import Queue

import pytest

from levilab.animation.three import MissingThree, three_js
from levilab.interruption import End
from levilab.live.analyzed import TEXTS, Analyses
from levilab.live.practice.bench import PracticeBench
from levilab.live.serve import LiveOptions, ViewServer, farewell, serve_live
from support.commands import command
from support.live_pages import GrowingRun

#: Long enough for a machine that is busy [s]; a test that passes waits less.
PATIENCE_S = 60.0
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]


def test_a_port_that_is_taken_is_named(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        ended = command("live", "--no-open", "--port", str(port), cwd=tmp_path)
    assert ended.status == 1
    assert f"port {port} is in use" in ended.err
    assert "--port" in ended.err


def test_a_run_that_is_not_there_is_named(tmp_path):
    ended = command("live", "nothere", "--no-browser", "--port", "0", cwd=tmp_path)
    assert ended.status == 1
    assert "nothere: there is no such run" in ended.err


def test_a_run_and_a_bench_for_practice_exclude_each_other(tmp_path):
    GrowingRun(tmp_path, "one")
    ended = command("live", "one", "--mock", "--no-open", "--port", "0", cwd=tmp_path)
    assert (ended.status, "--mock" in ended.err) == (2, True)


def test_without_the_extra_the_message_names_it(monkeypatch, tmp_path):
    monkeypatch.setattr("levilab.animation.three.find_spec", lambda _: None)
    with pytest.raises(MissingThree, match=r'pip install "\.\[live\]"'):
        three_js("the live view")
    ended = command("live", "--no-open", cwd=tmp_path)
    assert (ended.status, ".[live]" in ended.err) == (1, True)


def test_the_help_loads_no_server():
    code = (
        "import sys\nfrom levilab.cli.main import app\n"
        "try: app(['live', '--help'])\nexcept SystemExit: pass\n"
        "assert not {'nicegui', 'starlette', 'uvicorn'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_ctrl_c_says_at_once_what_the_end_waits_for(tmp_path, monkeypatch):
    bench = PracticeBench(tmp_path)
    assert farewell(None) == ""
    assert farewell(bench) == "the bench is switched off"
    monkeypatch.setattr(PracticeBench, "may_record", True)
    assert farewell(bench, {Path("run-2"), Path("run-1")}) == (
        "the run that is being recorded ends with the reading under way and is kept; "
        "the analysis of run-1, run-2 is given up; levilab analyze makes it; the bench is switched off"
    )


def test_what_is_damaged_of_a_result_is_not_shown(tmp_path):
    value = {"template": "C = {value:n}.", "values": {"value": "2.34(1)"}}
    for result, said in (
        ({"sentences": [value, 3, {"template": "{other}", "values": {}}, {}, None]}, ["C = 2.34(1)."]),
        ({"text": "as earlier versions"}, ["as earlier versions"]), ({"sentences": {}, "doubts": 1}, []), ({}, []),
    ):  # fmt: skip
        (tmp_path / "result.json").write_text(json.dumps(result), encoding="utf-8")
        about = Analyses().about(tmp_path)
        assert (about["verdict"], about["doubts"]) == (said, [])


def test_a_page_shows_what_each_analysis_of_a_file_says(tmp_path):
    """A phone's magnetic field is a spin, and where the top coasts a spin-down."""
    file = tmp_path / "phone.csv"
    spin = {"analysis": "spin", "sentences": ["36.86 Hz."], "doubts": ["folded"], "notes": ["steps"]}
    (tmp_path / "phone.csv.result.spin.json").write_text(json.dumps(spin), encoding="utf-8")
    about = Analyses().about(file)
    assert [about[key] for key in ("analysis", *TEXTS)] == ["spin", ["36.86 Hz."], ["folded"], ["steps"]]
    spindown = {"analysis": "spindown", "sentences": ["The disc law."], "doubts": ["folded"]}
    (tmp_path / "phone.csv.result.json").write_text(json.dumps(spindown), encoding="utf-8")
    about = Analyses().about(file)
    assert [about[key] for key in TEXTS] == [["The disc law.", "36.86 Hz."], ["folded"], ["steps"]]


@pytest.fixture
def started(monkeypatch):
    """The processes of analyses, as they are started."""
    processes = Queue()
    start = subprocess.Popen

    def note(*args, **kwargs):
        process = start(*args, **kwargs)
        processes.put(process)
        return process

    monkeypatch.setattr("levilab.live.analyzed.subprocess.Popen", note)
    return processes


def test_an_analysis_ends_with_the_view(tmp_path, started):
    analyses = Analyses()
    analyses.begin(tmp_path)
    process = started.get(timeout=PATIENCE_S)
    if sys.platform != "win32":  # a signal to the view's group leaves it to the view to end the analysis, and to say so
        assert os.getpgid(process.pid) != os.getpgid(0)
    analyses.end()
    assert process.returncode not in {None, 0}
    assert not analyses.running
    (tmp_path / "result.json").write_text(json.dumps({"text": "earlier"}), encoding="utf-8")
    (tmp_path / "report.html").touch()
    (tmp_path / "spindown.png").touch()
    assert [analyses.about(tmp_path)[key] for key in ("verdict", "figures")] == [["earlier"], ["spindown.png"]]
    analyses.begin(tmp_path)
    analyses.end()
    assert started.empty()
    assert analyses.failed == {tmp_path: "the live view was ended"}
    # what an earlier analysis has written stays on the disk, and is not shown for this one
    assert {path.name for path in tmp_path.iterdir()} == {"result.json", "report.html", "spindown.png"}
    about = analyses.about(tmp_path)
    assert [about[key] for key in ("report", "figures", "analysis")] == ["", [], ""]
    assert "verdict" not in about


def test_an_analysis_that_takes_too_long_is_killed(tmp_path, started, monkeypatch):
    monkeypatch.setattr("levilab.live.analyzed._LONGEST_S", 0.0)
    analyses = Analyses()
    analyses.begin(tmp_path)
    status = started.get(timeout=PATIENCE_S).wait(PATIENCE_S)
    assert status == (1 if sys.platform == "win32" else -signal.SIGKILL)
    analyses.end()
    assert "was given up" in analyses.failed[tmp_path]


def test_a_second_analysis_replaces_the_result_that_is_shown(tmp_path, monkeypatch):
    analyses, verdicts, meanwhile = Analyses(), iter(["first", "the second"]), []

    def analyze(words):
        if words[0] == "analyze":
            meanwhile.append(analyses.about(tmp_path).get("verdict"))
            text = json.dumps({"text": next(verdicts)})
            (tmp_path / "result.json").write_text(text, encoding="utf-8")
        return 0, ""

    monkeypatch.setattr(analyses, "carry_out", analyze)
    for verdict in ("first", "the second"):
        analyses.begin(tmp_path)
        analyses.end()  # which waits for the thread
        assert analyses.about(tmp_path)["verdict"] == [verdict]
    assert meanwhile == [None, None]


class Bench(PracticeBench):
    """A bench without a process.  Signals come while it is looked at, and while it is closed."""

    def start(self):
        return self

    def events(self):
        signal.raise_signal(signal.SIGINT)
        return []

    def close(self):
        for number in SIGNALS:
            signal.raise_signal(number)


def test_no_signal_is_given_back_before_the_bench_is_closed(tmp_path, monkeypatch):
    given_back = []
    before = {number: signal.signal(number, lambda number, _: given_back.append(number)) for number in SIGNALS}
    monkeypatch.setattr("levilab.live.serve.PracticeBench", Bench)
    try:
        ended = command("live", "--mock", "--no-open", "--port", "0", cwd=tmp_path)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert (ended.status, given_back) == (130, [])
    assert ended.err.splitlines()[-2:] == ["the bench is switched off", "levilab: the view is closed"]


def test_a_signal_before_the_server_leaves_it_unstarted(tmp_path, monkeypatch):
    monkeypatch.setattr(ViewServer, "run", lambda *_, **__: pytest.fail("it serves"))
    end = End()
    end(signal.SIGTERM, None)
    serve_live(LiveOptions(out=tmp_path, port=0), end, pytest.fail, pytest.fail)


@pytest.mark.skipif(sys.platform == "win32", reason="no signal to one process alone")
def test_a_signal_ends_the_view_in_one_line(tmp_path):
    """One to which the server listens, too."""
    words = [sys.executable, "-m", "levilab", "live", "--no-open", "--port", "0"]
    process = subprocess.Popen(
        words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    )
    try:
        assert process.stdout.readline().startswith("http://127.0.0.1:")
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130
    assert err.splitlines()[-1] == "levilab: the view is closed"
    assert "Traceback" not in err


@pytest.mark.parametrize("words", [("live", "--mock", "--no-open", "--port", "0"), ("acquire", "field", "--mock")])
@pytest.mark.parametrize("out", ["taken", "taken/runs"])
def test_a_file_in_the_place_of_the_folder_of_runs_is_refused(tmp_path, words, out, monkeypatch):
    monkeypatch.setattr(PracticeBench, "start", lambda _: pytest.fail("the bench starts"))
    (tmp_path / "taken").touch()
    ended = command(*words, "--out", out, cwd=tmp_path)
    assert ended.status != 0
    assert "taken: is a file, a folder is expected; choose another place with --out" in ended.err
