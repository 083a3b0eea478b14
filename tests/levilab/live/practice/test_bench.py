"""The bench for practice in a process of its own, whose parent dies."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest

from levilab.live.practice.bench import BenchGone, PracticeBench
from levilab.live.practice.commands import Pause
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


def test_where_the_parent_dies_the_run_is_kept_and_the_process_ends(tmp_path: Path) -> None:
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


def test_a_bench_that_is_not_there_says_so(tmp_path: Path) -> None:
    bench = PracticeBench(tmp_path)
    assert bench.events() == []
    with pytest.raises(BenchGone, match="start it anew"):
        bench.command(Pause(on=True))
    bench.close()
