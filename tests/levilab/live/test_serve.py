"""The command: its port, its ends, and what it needs."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

from levilab.live.analyzed import Analyses
from levilab.live.practice.bench import PracticeBench
from levilab.live.serve import farewell
from levilab.motion.animation.three import MissingThree, three_js
from support.commands import command
from support.live_pages import GrowingRun

if TYPE_CHECKING:
    from pathlib import Path


def test_a_port_that_is_taken_is_named(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        ended = command("live", "--no-open", "--port", str(port), cwd=tmp_path)
    assert ended.status == 1
    assert f"port {port} is in use" in ended.err
    assert "--port" in ended.err


def test_a_run_that_is_not_there_is_named(tmp_path: Path) -> None:
    ended = command("live", "nothere", "--no-open", "--port", "0", cwd=tmp_path)
    assert ended.status == 1
    assert "nothere: there is no such run" in ended.err


def test_a_run_and_a_bench_for_practice_exclude_each_other(tmp_path: Path) -> None:
    GrowingRun(tmp_path, "one")
    ended = command("live", "one", "--mock", "--no-open", "--port", "0", cwd=tmp_path)
    assert (ended.status, "--mock" in ended.err) == (2, True)


def test_without_the_extra_the_message_names_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("levilab.motion.animation.three.find_spec", lambda _: None)
    with pytest.raises(MissingThree, match=r'pip install "levilab\[live\]"'):
        three_js("the live view")
    ended = command("live", "--no-open", cwd=tmp_path)
    assert (ended.status, "levilab[live]" in ended.err) == (1, True)


def test_the_help_loads_no_server() -> None:
    code = (
        "import sys\nfrom levilab.cli.main import app\n"
        "try: app(['live', '--help'])\nexcept SystemExit: pass\n"
        "assert not {'nicegui', 'starlette', 'uvicorn'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_ctrl_c_says_at_once_what_the_end_waits_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = PracticeBench(tmp_path)
    assert farewell(None) == ""
    assert farewell(bench) == "the bench is switched off"
    monkeypatch.setattr(PracticeBench, "may_record", True)
    assert farewell(bench, {"run-2", "run-1"}) == (
        "the run that is being recorded ends with the reading under way and is kept; "
        "the analysis of run-1, run-2 is given up; levilab analyze makes it; the bench is switched off"
    )


def test_a_result_without_a_verdict_is_said_by_its_values(tmp_path: Path) -> None:
    frequency, bound = ({"value": -29.44559, "u": u, "unit": "Hz"} for u in (5e-4, None))
    wrong = {"frequency": {"value": 1.0, "u": -1.0}, "other": {"value": 10**400, "u": 1.0}, "last": {"value": 1.0}}
    for values, said in (
        ({"frequency": frequency, "bound": bound}, ["frequency −29.4456(5) Hz"]), ([1], []), ({}, []), (wrong, []),
    ):  # fmt: skip
        (tmp_path / "result.json").write_text(json.dumps({"runs": [{}], "values": values}), encoding="utf-8")
        assert Analyses().about(tmp_path)["verdict"] == said


def test_an_analysis_ends_with_the_view(tmp_path: Path) -> None:
    analyses = Analyses()
    under_way = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"], text=True)
    analyses._processes.add(under_way)
    analyses.begin(tmp_path)
    while len(analyses._processes) < 2:
        time.sleep(0.001)
    if sys.platform != "win32":  # a signal to the view's group leaves it to the view to end the analysis, and to say so
        (process,) = analyses._processes - {under_way}
        assert os.getpgid(process.pid) != os.getpgid(0)
    analyses.end()
    assert under_way.wait() != 0
    while analyses.running:
        time.sleep(0.001)
    (tmp_path / "result.json").write_text(json.dumps({"runs": [{"verdict": "earlier"}]}), encoding="utf-8")
    (tmp_path / "report.html").touch()
    (tmp_path / "spindown.png").touch()
    assert [analyses.about(tmp_path)[key] for key in ("verdict", "figures")] == [["earlier"], ["spindown.png"]]
    analyses.begin(tmp_path)
    while analyses.running:
        time.sleep(0.001)
    assert analyses.failed == {tmp_path.name: "the live view was ended"}
    # what an earlier analysis has written stays on the disk, and is not shown for this one
    assert {path.name for path in tmp_path.iterdir()} == {"result.json", "report.html", "spindown.png"}
    about = analyses.about(tmp_path)
    assert [about[key] for key in ("report", "figures", "analysis")] == ["", [], ""]
    assert "verdict" not in about


@pytest.mark.skipif(sys.platform == "win32", reason="no signal to one process alone")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_the_view_in_one_line(tmp_path: Path, name: str) -> None:
    words = [sys.executable, "-m", "levilab", "live", "--no-open", "--port", "0"]
    process = subprocess.Popen(
        words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    )
    assert process.stdout is not None
    try:
        assert process.stdout.readline().startswith("http://127.0.0.1:")
        process.send_signal(getattr(signal, name))
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130
    assert err.splitlines()[-1] == "levilab: the view is closed"
    assert "Traceback" not in err
