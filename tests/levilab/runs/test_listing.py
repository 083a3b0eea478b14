"""The list of runs: what it shows of thousands of them, and on a narrow terminal."""

import io
import json
import sys
from dataclasses import replace

import pytest

from levilab.present.terminal import Terminal
from levilab.runs import listing
from levilab.runs.find import RECORD
from levilab.runs.listing import MOST_PROBLEMS, Listed, list_runs, print_runs
from levilab.runs.run import Run
from many_runs import make_runs
from support.commands import command

RUN = Listed("20261120T101500Z-spin-7f3a", "2026-11-20T10:15:00Z", "spin", "interrupted", 20, 190.0, True, "")


def shown(monkeypatch, root, runs, width):
    """The lines of the list on a terminal of this width."""
    written = io.StringIO()
    monkeypatch.setattr(sys, "stdout", written)
    monkeypatch.setattr(listing, "terminal", lambda: Terminal(file=written, width=width, highlight=False))
    print_runs(runs, root)
    return written.getvalue().splitlines()


@pytest.mark.parametrize(("width", "columns"), [(60, 4), (68, 5), (80, 6), (130, 7)])
def test_the_list_stays_a_table_on_a_narrow_terminal(tmp_path, monkeypatch, width, columns):
    runs = [replace(RUN, path=str(tmp_path / RUN.path), scene="loose-washers", note="warm")]
    lines = shown(monkeypatch, tmp_path, runs, width)
    assert all(len(line) <= width for line in lines)
    head = " ".join(lines[:3])
    heads = ["run", "what", "status", "when", "readings", "length", "note"]
    assert [name for name in heads if name in head] == heads[:columns]
    assert any("spin-7f3a" in line and "interrupted" in line for line in lines)


def test_a_run_of_one_record_does_not_last_0_s(tmp_path, monkeypatch):
    runs = [replace(RUN, path=str(tmp_path / RUN.path), length_s=0.3)]
    assert any("< 1 s" in line for line in shown(monkeypatch, tmp_path, runs, 130))


def test_of_many_broken_runs_the_first_are_explained(tmp_path, monkeypatch):
    runs = [replace(RUN, path=str(tmp_path / RUN.path), problem=f"problem {k}") for k in range(MOST_PROBLEMS + 3)]
    notes = [line for line in shown(monkeypatch, tmp_path, runs, 120) if line.startswith("note:")]
    assert notes[0] == "note: problem 0"
    assert notes[-1] == "note: and 3 more that cannot be read; JSON has the reason for each"
    assert len(notes) == MOST_PROBLEMS + 1


def test_the_fast_reader_finds_the_same_as_loading(tmp_path, monkeypatch):
    folders = make_runs(tmp_path, 8, broken=2)
    for folder, change in zip(
        folders[::2], ('"seed": -1', '"seed": NaN', '"status": "running"', '"seed": 3'), strict=True
    ):
        key = change.split(":", maxsplit=1)[0]
        text = (folder / RECORD).read_text(encoding="utf-8").split("\n")
        changed = [f"  {change}," if line.strip().startswith(key) else line for line in text]
        (folder / RECORD).write_text("\n".join(changed), encoding="utf-8")
    quick = list_runs(tmp_path)
    monkeypatch.setattr(listing, "_load", Run.load)
    monkeypatch.setattr(listing, "_glance", lambda _: None)
    slow = list_runs(tmp_path)
    assert quick == slow
    assert sorted(run.status for run in quick) == ["finished"] * 4 + ["interrupted"] + ["unreadable"] * 3


def test_the_latest_runs_alone(tmp_path):
    make_runs(tmp_path / "runs", 5, broken=0)
    listed = json.loads(command("runs", "--last", "2", "--json", cwd=tmp_path).out)
    assert [run["note"] for run in listed] == ["run 3 of 5", "run 4 of 5"]
