"""The bench for practice in a process of its own, whose parent dies."""

import subprocess
import sys
import time
from multiprocessing import Pipe
from pathlib import Path
from unittest.mock import Mock

import pytest

from levilab.live.practice.bench import BenchGone, PracticeBench
from levilab.live.practice.commands import Pause, PracticeEvent, RecordRun
from levilab.runs.run import Run

#: Long enough for a machine that is busy [s]; a test that passes waits less.
PATIENCE_S = 120.0

PARENT = """
import os, sys, time
from pathlib import Path
from levilab.live.practice.bench import PracticeBench
from levilab.live.practice.commands import RecordRun, SetSpeed

bench = PracticeBench(Path(sys.argv[1])).start()
assert bench.address is None
while True:
    for event in bench.events():
        if event.kind == "ready":
            assert bench.address and not event.token and event.scene["name"] == "practice"
            bench.command(SetSpeed(speed=0.5))
            bench.command(RecordRun(experiment="field"))
        if event.kind == "recording":
            print(event.folder, flush=True)
            os._exit(7)
        assert event.kind not in {"ended", "refused"}, event
    time.sleep(0.02)
"""


def test_where_the_parent_dies_the_run_is_kept_and_the_process_ends(tmp_path):
    parent = subprocess.run(
        [sys.executable, "-c", PARENT, str(tmp_path)], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert (parent.returncode, parent.stderr) == (7, "")
    folder, end = Path(parent.stdout.strip()), time.monotonic() + PATIENCE_S
    while Run.load(folder).status == "running" and time.monotonic() < end:
        time.sleep(0.05)
    run = Run.load(folder)
    assert run.status == "interrupted"
    assert run.events()[-1]["text"] == "interrupted by the end of the program, outputs are off"


def test_a_bench_that_is_not_there_says_so(tmp_path):
    bench = PracticeBench(tmp_path)
    assert bench.events() == []
    with pytest.raises(BenchGone, match="start it again"):
        bench.command(Pause(on=True))
    bench.close()


class Busy:
    """A process that does not end by itself, as one that compiles."""

    def __init__(self):
        self.did = []

    def join(self, timeout):
        self.did.append(f"join {timeout:g} s")

    def is_alive(self):
        return "kill" not in self.did

    def __getattr__(self, name):
        return lambda: self.did.append(name)


def test_without_a_run_the_end_waits_a_second_and_with_one_for_its_reading(tmp_path):
    for answers, may_record in (
        ([], True),
        ([PracticeEvent("done", number=1), PracticeEvent("recording")], True),
        ([PracticeEvent("refused", number=1)], False),
        ([PracticeEvent("done", number=1), PracticeEvent("recorded", number=1, status="failed")], False),
        ([PracticeEvent("recorded", number=0)], True),  # of another command
    ):
        bench, process = PracticeBench(tmp_path), Busy()
        near_end, far_end = Pipe()
        bench._pipe, bench._process = near_end, process
        assert not bench.may_record
        bench.command(RecordRun(experiment="field"))
        for answer in answers:
            far_end.send(answer)
        bench.close()
        assert bench.may_record is may_record
        assert process.did[0] == ("join 20 s" if may_record else "join 1 s")
        assert process.did[1] == ("terminate" if may_record else "kill")
        far_end.close()


def test_ctrl_c_while_a_bench_ends_that_records_nothing_kills_it_at_once(tmp_path, monkeypatch):
    bench, process = PracticeBench(tmp_path), Busy()
    bench._process = process
    monkeypatch.setattr(process, "join", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        bench.close()
    assert process.did == ["kill"]
