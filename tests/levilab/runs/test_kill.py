"""A real acquiring process is killed: every reading that it had shown is in the run folder.

The process is a real `levilab acquire spin --mock`; what it shows is read from its standard error as it comes.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from levilab.runs.listing import list_runs
from levilab.runs.run import Run
from support.waiting import HANG_GUARD_S

SHOWN = re.compile(r"^ *(\d+\.\d\d) s +(\d+\.\d{4}) Hz")
posix_only = pytest.mark.skipif(os.name != "posix", reason="Windows has neither these signals nor resource limits")


def start(out: Path, *, before: str = "") -> subprocess.Popen[str]:
    """A levilab process; `before` is Python that it runs first."""
    program = f"{before}\nimport sys\nsys.argv[0] = 'levilab'\nfrom levilab.cli.main import main\nmain()"
    return subprocess.Popen(
        [sys.executable, "-c", program, "acquire", "spin", "--mock", "--seed", "7", "--out", str(out)],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    )


def shown_in(text: str) -> list[tuple[str, str]]:
    """Time and spin of each whole line that was shown, as text."""
    return [
        match.groups()
        for line in text.splitlines(keepends=True)
        if line.endswith("\n") and (match := SHOWN.match(line))
    ]  # type: ignore[misc]


def stored_in(run: Run) -> list[tuple[str, str]]:
    frame = run.readings().frame
    return [(f"{t:.2f}", f"{f:.4f}") for t, f in zip(frame["time_s"], frame["spin_frequency_hz"], strict=True)]


#: At the n-th time that the process puts something on the disk it does something, before or after.
AT_THE_NTH = """
import os, signal
sync, count = os.fsync, 0
def counting(descriptor):
    global count
    count += 1
    if count == {n} and {before}:
        {act}
    sync(descriptor)
    if count == {n} and not {before}:
        {act}
os.fsync = counting
"""
#: No process can prevent it: signal 9 ends one on Windows, too.
KILL = "os.kill(os.getpid(), 9)"


@pytest.mark.parametrize("before", [True, False], ids=["before", "after"])
@pytest.mark.parametrize("n", [3, 5, 8, 11, 12, 13, 17, 22])
def test_a_killed_process_loses_no_reading_that_it_had_shown(tmp_path: Path, n: int, before: bool) -> None:
    """Killed before or after the n-th sync: one of the record, or of a reading, or of an event."""
    process = start(tmp_path, before=AT_THE_NTH.format(n=n, before=before, act=KILL))
    _, told = process.communicate(timeout=HANG_GUARD_S)
    assert process.returncode
    shown = shown_in(told)
    listed = list_runs(tmp_path)
    assert listed or not shown  # killed before the record is there, it has shown nothing
    for one in listed:
        run = Run.load(Path(one.path))
        assert one.status == "interrupted"
        assert stored_in(run)[: len(shown)] == shown
        if len(shown) >= 3:
            assert analyzed(run.folder) >= len(shown)


def analyzed(folder: Path) -> int:
    """How many readings `levilab analyze spindown` uses."""
    done = subprocess.run(
        [sys.executable, "-m", "levilab", "analyze", "spindown", str(folder), "--json", "--no-save"],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=True,
        timeout=HANG_GUARD_S,
    )
    return int(json.loads(done.stdout)["models"][0]["statistics"]["n"])


@posix_only
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_the_process_with_130_and_the_run_kept(tmp_path: Path, name: str) -> None:
    send = f"os.kill(os.getpid(), signal.{name})"
    process = start(tmp_path, before=AT_THE_NTH.format(n=14, before=True, act=send))
    out, err = process.communicate(timeout=HANG_GUARD_S)
    assert process.returncode == 130
    assert "Traceback" not in err
    (listed,) = list_runs(tmp_path)
    assert listed.status == "interrupted"
    assert f"interrupted: {listed.readings} readings" in out
    record = Run.load(Path(listed.path)).record
    assert record.instruments["generator"]["settings_end"]["output"] is False


FULL = """
import builtins, errno, os
left = {room}
after_readings = []
class Small:
    '''A file on a disk with little room: what no longer fits is half written, then refused, as write(2) does.'''
    def __init__(self, file): self.file = file
    def __getattr__(self, name): return getattr(self.file, name)
    def __enter__(self): return self
    def __exit__(self, *_): self.file.close()
    def write(self, text):
        global left
        self.file.write(text[:left]); self.file.flush()
        short, left = len(text) > left, max(0, left - len(text))
        if self.file.name.endswith('readings.csv'): after_readings.append({room} - left)
        if short: raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return len(text)
from pathlib import Path
opened = Path.open
def small(self, mode="r", *args, **named):
    file = opened(self, mode, *args, **named)
    return Small(file) if self.name.endswith((".csv", ".jsonl", ".part")) and mode[0] in "awx" else file
Path.open = small
"""

LIMITED = """
import os, resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sync, count = os.fsync, 0
def limiting(fd):
    # from the first reading on no file may grow beyond some size: the kernel refuses in the middle of a row
    global count
    sync(fd)
    count += 1
    if count == 12:
        resource.setrlimit(resource.RLIMIT_FSIZE, ({room}, {room}))
os.fsync = limiting
"""


def survives(tmp_path: Path, before: str, reason: str) -> int:
    """The process ends with one line and status 1, and what it had shown is there; returns how much that was."""
    process = start(tmp_path, before=before)
    _, err = process.communicate(timeout=HANG_GUARD_S)
    assert process.returncode == 1, err
    assert "Traceback" not in err
    assert err.splitlines()[-1].startswith("levilab: could not ")
    assert reason in err.splitlines()[-1]
    shown = shown_in(err)
    runs = list_runs(tmp_path)
    for listed in runs:
        assert stored_in(Run.load(Path(listed.path)))[: len(shown)] == shown
        assert listed.status in {"interrupted", "failed"}
    assert runs or not shown
    return len(shown)


def written_after_readings(out: Path) -> list[int]:
    """How much a run has written after each line of readings.csv, in the reckoning of FULL."""
    told = "import atexit, sys; atexit.register(lambda: print(*after_readings, file=sys.stderr))\n"
    process = start(out, before=FULL.format(room=10**9) + told)
    _, err = process.communicate(timeout=HANG_GUARD_S)
    assert process.returncode == 0, err
    return [int(number) for number in err.splitlines()[-1].split()]


def test_a_disk_that_fills_up_at_any_moment_loses_no_reading_that_was_shown(tmp_path: Path) -> None:
    header, *readings = written_after_readings(tmp_path / "whole")
    rooms = (0, 40, header + 1000, *np.linspace(readings[0] - 20, readings[-1] + 20, 9).astype(int))
    shown = [survives(tmp_path / str(room), FULL.format(room=room), "No space left") for room in rooms]
    assert shown[0] == 0
    assert max(shown) > 3
    assert len(set(shown)) > 2


@posix_only
def test_a_write_error_at_any_moment_loses_no_reading_that_was_shown(tmp_path: Path) -> None:
    shown = [survives(tmp_path / str(room), LIMITED.format(room=room), "File too large") for room in (300, 444, 512)]
    assert shown == sorted(shown)
    assert 3 < shown[0] < shown[-1]
