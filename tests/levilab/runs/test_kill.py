"""A real acquiring process is killed: every reading that it had shown is in the run folder.

A few processes are really killed: a `levilab acquire spin --mock`, of which what it shows is read from its standard
error.  What a kill would leave at each other moment is copied in this process.
"""

import errno
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from levilab.runs.listing import list_runs
from levilab.runs.run import Run
from support.acquisitions import QUICKLY
from support.commands import command
from support.waiting import HANG_GUARD_S

SHOWN = re.compile(r"^ *(\d+\.\d\d) s +(\d+\.\d{4}) Hz")
posix_only = pytest.mark.skipif(os.name != "posix", reason="Windows has neither these signals nor resource limits")


def start(out, *, before=""):
    """A levilab process; `before` is Python that it runs first."""
    program = f"{before}\nimport sys\nsys.argv[0] = 'levilab'\nfrom levilab.cli.main import main\nmain()"
    return subprocess.Popen(
        [sys.executable, "-c", program, "acquire", "spin", "--mock", *QUICKLY, "--seed", "7", "--out", str(out)],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    )


def shown_in(text):
    """Time and spin of each whole line that was shown, as text."""
    return [
        match.groups()
        for line in text.splitlines(keepends=True)
        if line.endswith("\n") and (match := SHOWN.match(line))
    ]


def stored_in(run):
    frame = run.readings().frame
    return [(f"{t:.2f}", f"{f:.4f}") for t, f in zip(frame["time_s"], frame["spin_frequency_hz"], strict=True)]


#: When the process has put something on the disk for the n-th time it does something.
AT_THE_NTH = """
import os, signal
sync, count = os.fsync, 0
def counting(descriptor):
    global count
    count += 1
    sync(descriptor)
    if count == {n}:
        {act}
os.fsync = counting
"""
#: No process can prevent it: signal 9 ends one on Windows, too.
KILL = "os.kill(os.getpid(), 9)"


def loses_nothing(out, shown, *, finished=False):
    """What a killed process has left holds each reading that it had shown."""
    listed = list_runs(out)
    assert listed or not shown  # killed before the record is there, it has shown nothing
    for one in listed:
        assert one.status == ("finished" if finished else "interrupted")
        assert stored_in(Run.load(Path(one.path)))[: len(shown)] == shown


def test_a_killed_process_loses_no_reading_that_it_had_shown(tmp_path):
    """Killed at the 16th time that something is on the disk, which is a reading."""
    process = start(tmp_path, before=AT_THE_NTH.format(n=16, act=KILL))
    _, output = process.communicate(timeout=HANG_GUARD_S)
    assert process.returncode
    shown = shown_in(output)
    assert shown
    loses_nothing(tmp_path, shown)


def test_at_no_moment_would_a_kill_lose_a_reading_that_was_shown(tmp_path, monkeypatch):
    """A kill leaves the files as they are: they are copied before and after each sync, with what was shown by then."""
    out, sync = tmp_path / "runs", os.fsync
    going_on = []
    analyzed = {}

    def copying(descriptor):
        copy()
        sync(descriptor)
        copy()

    def copy():
        sys.stderr.flush()
        shown = shown_in(sys.stderr.buffer.getvalue().decode("utf-8"))
        left = tmp_path / "left"
        shutil.copytree(out, left)
        record = next(left.rglob("run.json"), None)
        finished = record is not None and '"finished"' in record.read_text(encoding="utf-8")
        loses_nothing(left, shown, finished=finished)
        going_on.append(not finished)
        if len(shown) % 6 == 3 and len(shown) not in analyzed:
            ended = command("analyze", "spindown", left, "--json", "--no-save", cwd=tmp_path)
            assert ended.status == 0, ended.err
            analyzed[len(shown)] = json.loads(ended.out)["models"][0]["statistics"]["n"]
        shutil.rmtree(left)

    monkeypatch.setattr(os, "fsync", copying)
    ended = command("acquire", "spin", "--mock", *QUICKLY, "--seed", "7", "--out", out, cwd=tmp_path)
    assert ended.status == 0, ended.err
    assert going_on.count(True) > 60
    assert going_on == sorted(going_on, reverse=True)
    assert len(analyzed) >= 3
    assert all(used >= shown for shown, used in analyzed.items())


@posix_only
def test_a_signal_ends_the_process_with_130_and_the_run_kept(tmp_path):
    process = start(tmp_path, before=AT_THE_NTH.format(n=14, act="os.kill(os.getpid(), signal.SIGHUP)"))
    out, err = process.communicate(timeout=HANG_GUARD_S)
    assert process.returncode == 130
    assert "Traceback" not in err
    (listed,) = list_runs(tmp_path)
    assert listed.status == "interrupted"
    assert f"interrupted: {listed.readings} reading" in out
    record = Run.load(Path(listed.path)).record
    assert record.instruments["generator"]["settings_end"]["output"] is False


class Disk:
    """A disk with little room.  left: bytes; seen: how much had been written after each line of readings.csv."""

    def __init__(self, left):
        self.left, self.written, self.seen = left, 0, list[int]()

    def put_in(self, monkeypatch):
        """From now on the files of runs are written to this disk."""
        opened = Path.open

        def small(path, mode="r", *args, **named):
            file = opened(path, mode, *args, **named)
            on_it = path.name.endswith((".csv", ".jsonl", ".part")) and mode[0] in "awx"
            return Small(file, self) if on_it else file

        monkeypatch.setattr(Path, "open", small)


class Small:
    """A file on it: what no longer fits is half written, then refused, as write(2) does."""

    def __init__(self, file, disk):
        self.file, self.disk = file, disk

    def __getattr__(self, name):
        return getattr(self.file, name)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()

    def write(self, text):
        disk = self.disk
        self.file.write(text[: disk.left])
        self.file.flush()
        short, put = len(text) > disk.left, min(len(text), disk.left)
        disk.left, disk.written = disk.left - put, disk.written + put
        if self.file.name.endswith("readings.csv"):
            disk.seen.append(disk.written)
        if short:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return len(text)


LIMITED = """
import os, resource, signal, sys
# Python before 3.12.8 and 3.13.1 keeps the bytecode of a module that is cut short here, and cannot import it again
sys.dont_write_bytecode = True
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sync, count = os.fsync, 0
def limiting(fd):
    # from the first reading on no file may grow beyond some size: the kernel refuses in the middle of a row
    global count
    sync(fd)
    count += 1
    if count == 14:
        resource.setrlimit(resource.RLIMIT_FSIZE, (512, 512))
os.fsync = limiting
"""


def survives(out, status, err, reason):
    """The command has ended with one line and status 1, and what it had shown is there; returns how much that was."""
    assert status == 1, err
    assert "Traceback" not in err
    assert err.splitlines()[-1].startswith("levilab: could not ")
    assert reason in err.splitlines()[-1]
    shown = shown_in(err)
    runs = list_runs(out)
    for listed in runs:
        assert stored_in(Run.load(Path(listed.path)))[: len(shown)] == shown
        assert listed.status in {"interrupted", "failed"}
    assert runs or not shown
    return len(shown)


def acquire_on(disk, out):
    with pytest.MonkeyPatch.context() as patch:
        disk.put_in(patch)
        out.mkdir()
        return command("acquire", "spin", "--mock", *QUICKLY, "--seed", "7", "--out", out, cwd=out)


def test_a_disk_that_fills_up_at_any_moment_loses_no_reading_that_was_shown(tmp_path):
    large = Disk(10**9)
    assert acquire_on(large, tmp_path / "whole").status == 0
    header, *readings = large.seen
    shown = []
    for room in (0, 40, header + 1000, *np.linspace(readings[0] - 20, readings[-1] + 20, 9).astype(int)):
        out = tmp_path / str(room)
        ended = acquire_on(Disk(int(room)), out)
        shown.append(survives(out, ended.status, ended.err, "No space left"))
    assert shown[0] == 0
    assert max(shown) > 3
    assert len(set(shown)) > 2


@posix_only
def test_a_write_error_of_the_kernel_loses_no_reading_that_was_shown(tmp_path):
    process = start(tmp_path, before=LIMITED)
    _, err = process.communicate(timeout=HANG_GUARD_S)
    assert survives(tmp_path, process.returncode, err, "File too large") > 3
