"""What goes into files that programs read."""

import errno
import math
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from levilab.computer import Computer
from levilab.files import finite, parse_json, replace_atomically, stamp


def test_what_no_number_can_say_is_null_at_any_depth():
    value = {"a": [1.0, math.nan, {"b": (math.inf, np.float64("-inf"))}], "c": "nan", "d": True, "e": 2}
    assert finite(value) == {"a": [1.0, None, {"b": [None, None]}], "c": "nan", "d": True, "e": 2}


def test_a_file_that_was_written_or_replaced_has_another_stamp(tmp_path):
    path = tmp_path / "file"
    found = [stamp(path)]
    for change in (lambda: path.write_text("a"), lambda: path.write_text("bb"), lambda: replace_atomically(path, "cc")):
        change()
        os.utime(path, ns=(1, 1))  # as on a disk whose clock is coarse
        found.append(stamp(path))
    assert found[0] is None
    assert len(set(found)) == 4


def test_what_is_not_json_is_said_by_its_place_alone():
    with pytest.raises(ValueError, match=r"^from line 2, column 1 on$"):
        parse_json("{\nx}")


def test_a_write_takes_the_part_away_that_a_killed_process_left(tmp_path):
    killed = subprocess.Popen([sys.executable, "-c", ""])
    killed.wait()
    left, of_a_live_process, of_another_file = (
        tmp_path / name for name in (f".t.csv.{killed.pid}.part", f".t.csv.{os.getppid()}.part", ".u.csv.1.part")
    )
    for part in (left, of_a_live_process, of_another_file):
        part.touch()
    replace_atomically(tmp_path / "t.csv", "a")
    kept = {tmp_path / "t.csv", of_another_file} | ({of_a_live_process} if os.name == "posix" else set())
    assert {*tmp_path.iterdir()} == kept


@pytest.mark.parametrize("takes_the_order", [True, False])
def test_on_macos_a_file_is_on_the_disk_itself(tmp_path, monkeypatch, takes_the_order):
    """There fsync leaves it in the disk's own memory; a disk of the network takes only that."""
    asked = []

    def order(number, what):
        asked.append(what)
        if not takes_the_order:
            raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP))

    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr("levilab.computer.fcntl", SimpleNamespace(F_FULLFSYNC=51, fcntl=order), raising=False)
    monkeypatch.setattr(os, "fsync", lambda _: asked.append("fsync"))
    with (tmp_path / "file").open("wb") as file:
        Computer().sync(file)
    assert asked == ([51] if takes_the_order else [51, "fsync"])
