"""The run folder: nothing that was written is lost, and what is broken says so."""

import errno
import hashlib
import json
import os
import re
import tempfile
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from levilab.computer import Computer
from levilab.errors import DataError
from levilab.files import CannotWrite, replace_atomically
from levilab.runs.events import RunEvent
from levilab.runs.find import find_run, find_runs
from levilab.runs.listing import Listed, list_runs, print_runs
from levilab.runs.run import Run, RunRecord
from levilab.runs.writer import RunWriter

CHANNELS = [
    {"name": "time_s", "unit": "s", "source": "clock"},
    {"name": "spin_frequency_hz", "unit": "Hz", "source": "counter"},
    {"name": "spin_frequency_u_hz", "unit": "Hz", "source": "given"},
]


def record(**changes):
    return RunRecord(
        experiment="spin", status="running", started_utc="2026-11-20T10:15:00.000000Z", channels=CHANNELS
    ).model_copy(update=changes)


def row(k):
    return {"time_s": 10.0 * k, "spin_frequency_hz": 40.0 - k / 3, "spin_frequency_u_hz": None if k == 1 else 0.03}


def written(out, rows=4):
    with RunWriter.create(out, record()) as writer:
        for k in range(rows):
            writer.reading(row(k))
        writer.event(0.0, "drive off", "drive off")
        writer.finish("finished")
    return writer.folder


def failing(number):
    """Stands for a function of the system that fails."""
    return Mock(side_effect=OSError(number, os.strerror(number)))


def test_a_run_that_was_written_loads_as_it_was_and_with_numpy_alone(tmp_path):
    run = Run.load(written(tmp_path))
    assert (run.status, run.record.experiment) == ("finished", "spin")
    frame = run.readings().frame
    assert frame["time_s"].tolist() == [0, 10, 20, 30]
    assert frame["spin_frequency_hz"].tolist() == [40.0, 40 - 1 / 3, 40 - 2 / 3, 39.0]
    assert [event["kind"] for event in run.events()] == ["drive off"]
    table = np.genfromtxt(run.folder / "readings.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time_s", "spin_frequency_hz", "spin_frequency_u_hz")
    assert table["spin_frequency_hz"][3] == 39.0


def test_the_datapackage_holds_units_and_hashes(tmp_path):
    folder = written(tmp_path)
    package = json.loads((folder / "datapackage.json").read_text(encoding="utf-8"))
    readings = next(r for r in package["resources"] if r["path"] == "readings.csv")
    assert readings["hash"] == "sha256:" + hashlib.sha256((folder / "readings.csv").read_bytes()).hexdigest()
    assert [field["unit"] for field in readings["schema"]["fields"]] == ["s", "Hz", "Hz"]


def test_a_run_that_cannot_be_described_is_finished(tmp_path, monkeypatch):
    messages = []
    monkeypatch.setattr("levilab.runs.writer.package", lambda *_, **__: fail_to_read())
    with RunWriter.create(tmp_path, record(), tell=messages.append) as writer:
        writer.reading(row(0))
        writer.finish("finished")
    assert Run.load(writer.folder).status == "finished"
    assert not (writer.folder / "datapackage.json").exists()
    (message,) = messages
    assert message.startswith("datapackage.json is missing (Input/output error): the run is whole without it")


def test_a_run_whose_process_is_gone_is_interrupted_and_one_that_lives_is_running(tmp_path):
    with RunWriter.create(tmp_path, record()) as writer:
        writer.reading(row(0))
        assert Run.load(writer.folder).status == "running"
    assert Run.load(writer.folder).status == "interrupted"


def test_reopening_cuts_a_torn_line_and_goes_on(tmp_path):
    with RunWriter.create(tmp_path, record()) as writer:
        writer.reading(row(0))
    with (writer.folder / "readings.csv").open("ab") as file:
        file.write(b"10.0,39")
    with RunWriter.reopen(Run.load(writer.folder)) as again:
        again.reading(row(2))
        again.finish("finished")
    assert Run.load(writer.folder).readings().frame["time_s"].tolist() == [0, 20]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "cut off or not JSON"),
        ("", "cut off or not JSON"),
        ("[]", "schema"),
        ('{"schema": "levilab-run/7"}', "levilab-run/7"),
        ('{"schema": "levilab-run/1", "status": "finished", "started_utc": null}', "experiment"),
        ('{"schema": "levilab-run/1", "experiment": "spin", "status": "lost", "started_utc": null}', "status"),
    ],
)
def test_a_broken_run_json_says_what_is_wrong_and_how_to_save_the_readings(tmp_path, text, says):
    folder = written(tmp_path)
    (folder / "run.json").write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=says) as caught:
        Run.load(folder)
    assert f"levilab analyze {folder / 'readings.csv'}" in str(caught.value)
    listed = list_runs(tmp_path)
    assert [run.status for run in listed] == ["unreadable"]


def test_replacing_a_file_leaves_the_old_one_whole_when_writing_fails(tmp_path, monkeypatch):
    path = tmp_path / "run.json"
    replace_atomically(path, "old")
    monkeypatch.setattr("levilab.runs.writer.os.fsync", failing(errno.ENOSPC))
    with pytest.raises(OSError, match="No space"):
        replace_atomically(path, "new")
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("rows_until_full", range(6))
def test_when_the_disk_is_full_every_earlier_reading_is_kept(tmp_path, monkeypatch, rows_until_full):
    with RunWriter.create(tmp_path, record()) as writer:
        for k in range(rows_until_full):
            writer.reading({"time_s": k, "spin_frequency_hz": 40 - k, "spin_frequency_u_hz": 0.03})
        monkeypatch.setattr("levilab.runs.writer.os.fsync", failing(errno.ENOSPC))
        with pytest.raises(
            CannotWrite, match=r"77\.5,21\.5.*No space left on device.*earlier readings are kept"
        ) as full:
            writer.reading({"time_s": 77.5, "spin_frequency_hz": 21.5, "spin_frequency_u_hz": 0.03})
    assert "free space" in str(full.value)
    run = Run.load(writer.folder)
    assert run.status == "interrupted"
    assert run.readings().frame["time_s"].tolist()[:rows_until_full] == list(range(rows_until_full))


def test_a_folder_that_cannot_be_made_is_reported_in_one_line(tmp_path):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    (tmp_path / "link").symlink_to(tmp_path / "gone" / "away")
    for name in ("file", "link"):
        with pytest.raises(CannotWrite, match="`out`"):
            RunWriter.create(tmp_path / name, record())


def test_runs_are_found_below_a_folder_and_listed_oldest_first(tmp_path):
    late = RunWriter.create(tmp_path / "b", record(started_utc="2026-11-21T00:00:00Z", note="late"))
    early = RunWriter.create(tmp_path / "a" / "deep", record(started_utc="2026-11-20T00:00:00Z", note="early"))
    for writer in (late, early):
        with writer:
            writer.reading(row(0))
            writer.reading(row(2))
            writer.finish("finished")
    assert find_runs(tmp_path) == sorted([late.folder, early.folder])
    assert [(run.note, run.readings, run.length_s) for run in list_runs(tmp_path)] == [
        ("early", 2, 20.0),
        ("late", 2, 20.0),
    ]


def test_the_length_of_a_run_is_from_time_zero_or_not_known(tmp_path):
    """The first reading of a limit comes when the first top has fallen; a list of limits has no times."""
    with RunWriter.create(tmp_path / "1", record(time_zero_utc="2026-11-20T00:00:00Z")) as one:
        one.reading(row(5))
    limits = record(channels=[{"name": "spin_frequency_hz", "unit": "Hz", "source": "a list"}])
    with RunWriter.create(tmp_path / "2", limits) as other:
        other.reading({"spin_frequency_hz": 21.7})
    listed = list_runs(tmp_path)
    assert [run.length_s for run in listed] == [50.0, None]


def test_a_run_is_found_by_its_name_below_a_folder(tmp_path):
    folder = written(tmp_path)
    assert re.fullmatch(r"\d{8}T\d{6}Z-spin-[0-9a-f]{4}", folder.name)  # when and what
    short = folder.name.split("Z-")[1]
    assert find_run(Path(short), tmp_path) == folder
    assert find_run(Path(folder.name), tmp_path) == folder
    assert find_run(Path("spin-none"), tmp_path) == Path("spin-none")


def test_going_on_with_an_empty_file_writes_its_header_first(tmp_path):
    folder = written(tmp_path)
    (folder / "readings.csv").write_text("", encoding="utf-8")
    with RunWriter.reopen(Run.load(folder)) as writer:
        writer.reading({"time_s": 1.0, "spin_frequency_hz": 39.0, "spin_frequency_u_hz": 0.03})
    assert Run.load(folder).count() == 1


def test_rows_are_not_written_below_another_header(tmp_path):
    folder = written(tmp_path)
    (folder / "readings.csv").write_text("time_s,height_m\n", encoding="utf-8")
    with pytest.raises(CannotWrite, match="its header is"):
        RunWriter.reopen(Run.load(folder))


def test_damaged_events_are_left_out(tmp_path):
    folder = written(tmp_path)
    with (folder / "events.jsonl").open("ab") as file:
        file.write(b'{"kind": 1\n[]\n{"text": 3}\n\xff\xfe\n{"text": "fine", "time_s": "soon"}\n')
    events = Run.load(folder).events()
    assert [(event["text"], event["time_s"]) for event in events] == [("drive off", 0.0), ("fine", None)]


def test_events_that_the_disk_does_not_give_are_a_warning_and_the_readings_are_read(tmp_path, monkeypatch):
    folder, read = written(tmp_path), Path.read_text
    monkeypatch.setattr(
        Path, "read_text", lambda self, *a, **k: fail_to_read() if self.name == "events.jsonl" else read(self, *a, **k)
    )
    run = Run.load(folder)
    assert run.count() > 0
    (warning,) = run.warnings()
    assert "events.jsonl cannot be read (Input/output error)" in warning


def fail_to_read():
    raise OSError(errno.EIO, "Input/output error")


def test_a_clock_that_was_set_back_is_found_before_a_run_is_gone_on_with(tmp_path):
    ahead = (datetime.now(UTC) + timedelta(hours=1)).isoformat()
    run = Run.load(written(tmp_path))
    changed = run.record.model_copy(update={"time_zero_utc": ahead})
    with pytest.raises(DataError, match="set back"):
        Run(run.folder, changed, "interrupted").elapsed()
    past = datetime.now(UTC) - timedelta(seconds=100)
    changed = run.record.model_copy(update={"time_zero_utc": past.isoformat()})
    elapsed = Run(run.folder, changed, "interrupted").elapsed()
    assert 100 <= elapsed <= (datetime.now(UTC) - past).total_seconds()


def test_a_linked_run_is_found_once(tmp_path):
    folder = written(tmp_path / "real")
    (tmp_path / "look").mkdir()
    (tmp_path / "look" / "link").symlink_to(folder, target_is_directory=True)
    (tmp_path / "look" / "loop").symlink_to(tmp_path / "look", target_is_directory=True)
    assert find_runs(tmp_path / "look") == [tmp_path / "look" / "link"]


# --- the list ---

#: Fields of a line as this program writes them, and others.
FIELDS = st.sampled_from(
    ["0.0", "10.5", "-3", "1e-05", "", "nan", "inf", "9.91E37", "9.9e+37", "1e400", "2,0", '"1"', "x", " 1"]
)
ENDS = st.sampled_from(["\n", "\n", "\n", "\r\n", "\n\n", "\n# note\n", ""])


@given(st.lists(st.tuples(st.lists(FIELDS, min_size=2, max_size=4), ENDS), max_size=5), st.booleans())
#: A line lacks a field, and the next one has one too many.
@example(lines=[(["0.0", "10.5"], "\n"), (["0.0", "10.5", "1", "2"], "\n")], three=False)
@settings(max_examples=100)  # 40 do not meet a number too large to be a reading
def test_a_glance_at_readings_says_what_reading_them_does(lines, three):
    channels = CHANNELS if three else [*CHANNELS[:2], {"name": "record"}]
    header = ",".join(channel["name"] for channel in channels)
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "run.json").write_text(record(status="finished", channels=channels).as_json(), encoding="utf-8")
        text = f"{header}\n" + "".join(",".join(fields) + end for fields, end in lines)
        (Path(place) / "readings.csv").write_bytes(text.encode())
        glanced = list_runs(Path(place))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("levilab.runs.listing._glance", lambda _: None)
            assert glanced == list_runs(Path(place))


def test_a_sound_run_is_listed_by_a_glance_at_its_readings(tmp_path, monkeypatch):
    with RunWriter.create(tmp_path, record()) as writer:
        for k in (0, 2, 3):
            writer.reading(row(k))
        writer.finish("finished")
    monkeypatch.delattr(Run, "readings")
    assert [(run.readings, run.length_s) for run in list_runs(tmp_path)] == [(3, 30.0)]


def test_a_long_run_is_listed_with_all_its_readings(tmp_path, monkeypatch):
    with RunWriter.create(tmp_path, record(channels=CHANNELS[:2])) as writer:
        for k in range(40):
            writer.reading({"time_s": 10 * k + 1 / 7, "spin_frequency_hz": 40 - k / 7})
        writer.finish("finished")
        line = len((writer.folder / "readings.csv").read_bytes().splitlines()[-1])
    for bytes_read in range(600, 601 + line):  # a glance ends at each place of a line
        monkeypatch.setattr("levilab.runs.listing._GLANCED_BYTES", bytes_read)
        assert [run.readings for run in list_runs(tmp_path)] == [40]


def test_a_list_of_many_runs_looks_like_one_of_a_few(capsys):
    run = Listed(
        "r/20261120T101500Z-spin-7f3a", "2026-11-20T10:15", "spin", "finished", 20, 190.0, synthetic=True, note="n ü"
    )
    odd = replace(run, note="", status="\x1b]0;x\x07", experiment="[red]limit")
    print_runs([run, odd], Path("r"))
    few = capsys.readouterr().out.splitlines()
    print_runs([run, odd] * 150, Path("r"))
    many = capsys.readouterr().out.splitlines()
    assert [line.rstrip() for line in many[:5]] == [line.rstrip() for line in few[:5]]
    assert len(many) == len(few) + 298
    assert "[red]limit" in few[4]
    assert "\x1b" not in "".join(many)


# --- the disk ---


def test_every_new_folder_above_a_run_is_on_the_disk(tmp_path, monkeypatch):
    synchronised = []
    monkeypatch.setattr(Computer, "sync_folder", lambda _, folder: synchronised.append(folder))
    with RunWriter.create(tmp_path / "a" / "b" / "c", record()):
        pass
    assert {tmp_path, tmp_path / "a", tmp_path / "a" / "b", tmp_path / "a" / "b" / "c"} <= set(synchronised)


def test_a_file_that_begins_under_way_keeps_its_name_when_power_is_lost(tmp_path, monkeypatch):
    """Its content alone is not enough: POSIX promises the name of a new file only when its folder is synchronised."""
    synchronised = []
    with RunWriter.create(tmp_path, record()) as writer:
        monkeypatch.setattr(Computer, "sync_folder", lambda _, folder: synchronised.append(folder))
        writer.event(None, RunEvent.DRIVE_ON, "drive on")
        writer.event(None, RunEvent.DRIVE_OFF, "drive off")
    assert synchronised == [writer.folder]


def test_a_disk_that_fails_is_no_full_one(tmp_path, monkeypatch):
    with RunWriter.create(tmp_path, record()) as writer:
        monkeypatch.setattr("os.fsync", failing(errno.EIO))
        with pytest.raises(CannotWrite, match="look at the folder and its disk"):
            writer.reading(row(0))


def test_a_run_folder_that_cannot_be_filled_is_taken_away(tmp_path, monkeypatch):
    monkeypatch.setattr("levilab.runs.writer.replace_atomically", failing(errno.ENOSPC))
    with pytest.raises(CannotWrite):
        RunWriter.create(tmp_path / "runs", record())
    assert not [*(tmp_path / "runs").iterdir()]
