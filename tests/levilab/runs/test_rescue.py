"""A run folder that is removed, replaced or cut under way: what was shown is on the disk nevertheless."""

import errno
import json
import os
import shutil
from pathlib import Path
from unittest.mock import Mock

import pytest

from levilab.computer import Computer
from levilab.files import CannotWrite
from levilab.runs.run import Run, RunRecord
from levilab.runs.writer import RunWriter
from support.acquisitions import QUICKLY
from support.commands import command
from support.paths import SAMPLE_DATA

CHANNELS = [
    {"name": "time_s", "unit": "s", "source": "clock"},
    {"name": "spin_frequency_hz", "unit": "Hz", "source": "counter"},
]
posix_only = pytest.mark.skipif(os.name != "posix", reason="Windows removes no file that is open")


def create(out, messages):
    record = RunRecord(experiment="spin", status="running", started_utc="2026-11-20T10:15:00Z", channels=CHANNELS)
    return RunWriter.create(out, record, tell=messages.append)


def row(k):
    return {"time_s": 10.0 * k, "spin_frequency_hz": 40.0 - k}


def times(folder):
    return list(Run.load(folder).readings().frame["time_s"])


def replace_file(folder):
    """As an editor does that writes a new file and renames it."""
    other = folder / "other"
    other.write_bytes((folder / "readings.csv").read_bytes())
    other.replace(folder / "readings.csv")


def link_file(folder):
    (folder / "readings.csv").rename(folder.parent / "elsewhere.csv")
    (folder / "readings.csv").symlink_to(folder.parent / "elsewhere.csv")


def replace_folder(folder):
    shutil.rmtree(folder)
    folder.mkdir()
    (folder / "readings.csv").write_text("theirs\n", encoding="utf-8")


LOSSES = {
    "the readings are removed": lambda folder: (folder / "readings.csv").unlink(),
    "the events are removed": lambda folder: (folder / "events.jsonl").unlink(),
    "the readings are replaced": replace_file,
    "the readings become a link": link_file,
    "the readings are cut": lambda folder: os.truncate(folder / "readings.csv", 30),
    "the folder is removed": shutil.rmtree,
    "the folder is moved": lambda folder: folder.rename(folder.parent / "moved"),
    "the folder is replaced": replace_folder,
    "all runs are removed": lambda folder: shutil.rmtree(folder.parent),
}


@posix_only
@pytest.mark.parametrize("name", LOSSES)
def test_a_loss_is_noticed_at_the_next_reading_and_rescued(tmp_path, name):
    messages = []
    with create(tmp_path / "runs", messages) as writer:
        before = writer.folder
        writer.event(None, "drive off", "drive off")
        for k in range(3):
            writer.reading(row(k))
        LOSSES[name](before)
        writer.reading(row(3))
        assert times(writer.folder) == [0, 10, 20, 30]  # on the disk when it is shown
        assert Run.load(writer.folder).status == "running"
        writer.reading(row(4))
        writer.finish("finished")
    assert writer.folder == before.with_name(before.name + "-rescued")
    run = Run.load(writer.folder)
    assert times(writer.folder) == [0, 10, 20, 30, 40]
    assert run.status == "finished"
    assert [event["kind"] for event in run.events()] == ["drive off", "rescued"]
    assert (run.record.model_extra or {})["rescued_from"] == str(before)
    (text,) = messages
    assert str(before) in text
    assert str(writer.folder) in text
    assert "all 4 readings" in text


@posix_only
@pytest.mark.parametrize("step", ["event", "update", "finish"])
def test_a_loss_is_noticed_by_whatever_is_written_next(tmp_path, step):
    steps = {
        "event": lambda writer: writer.event(None, "fell", "the top fell"),
        "update": lambda writer: writer.update(time_zero_utc="2026-11-20T10:16:00Z"),
        "finish": lambda writer: writer.finish("finished"),
    }
    messages = []
    with create(tmp_path, messages) as writer:
        writer.reading(row(0))
        shutil.rmtree(writer.folder)
        steps[step](writer)
    assert times(writer.folder) == [0]
    assert len(messages) == 1


@posix_only
def test_a_run_that_is_lost_twice_is_rescued_twice(tmp_path):
    messages = []
    with create(tmp_path, messages) as writer:
        first = writer.folder
        for k in range(3):
            writer.reading(row(k))
            (writer.folder / "readings.csv").unlink()
        writer.reading(row(3))
    assert times(writer.folder) == [0, 10, 20, 30]
    assert len(messages) == 3
    assert writer.folder.name == f"{first.name}-rescued-3"


@posix_only
@pytest.mark.parametrize("torn", [False, True])
def test_a_folder_that_was_cut_stays_readable_after_each_rescue(tmp_path, torn):
    folders = []
    with create(tmp_path, []) as writer:
        writer.reading(row(0))
        for k in range(1, 3):
            folders.append(writer.folder)
            size = (writer.folder / "readings.csv").stat().st_size
            os.truncate(writer.folder / "readings.csv", size - 3)  # within the last line, onto which the next one goes
            if torn:
                (writer.folder / "run.json").write_text('{"schema', encoding="utf-8")
            writer.reading(row(k))
        writer.finish("finished")
    for k, folder in enumerate(folders):
        run = Run.load(folder)
        assert (run.status, times(folder)) == ("interrupted", [10 * i for i in range(k)])
        assert run.continued_in == [*folders, writer.folder][k + 1]
    assert times(writer.folder) == [0, 10, 20]


def test_a_torn_record_is_written_anew_with_the_next_reading(tmp_path):
    with create(tmp_path, []) as writer:
        writer.reading(row(0))
        (writer.folder / "run.json").write_text('{"schema', encoding="utf-8")
        writer.reading(row(1))
        assert Run.load(writer.folder).status == "running"


@posix_only
def test_a_resumed_run_is_rescued_with_its_earlier_readings(tmp_path):
    with create(tmp_path, []) as writer:
        writer.reading(row(0))
        writer.event(0.0, "drive off", "drive off")
    with RunWriter.reopen(Run.load(writer.folder)) as again:
        again.reading(row(1))
        shutil.rmtree(again.folder)
        again.reading(row(2))
        again.finish("finished")
    assert times(again.folder) == [0, 10, 20]
    assert [event["kind"] for event in Run.load(again.folder).events()] == ["drive off", "rescued"]


@posix_only
def test_a_folder_that_goes_when_the_run_is_finished_is_written_again(tmp_path, monkeypatch):
    messages = []
    with create(tmp_path, messages) as writer:
        writer.reading(row(0))
        write = RunWriter._write_record

        def remove_after(one):
            write(one)
            if one.record.status == "finished" and one.folder.name == writer.folder.name:
                monkeypatch.undo()
                shutil.rmtree(one.folder)

        monkeypatch.setattr(RunWriter, "_write_record", remove_after)
        writer.finish("finished")
    assert writer.folder.name.endswith("-rescued")
    assert times(writer.folder) == [0]
    assert Run.load(writer.folder).status == "finished"
    assert (writer.folder / "datapackage.json").exists()
    (message,) = messages
    assert message.endswith(f"all 1 readings are in {writer.folder} now")


@posix_only
def test_readings_that_cannot_be_written_again_are_not_said_to_be_kept(tmp_path, monkeypatch):
    with create(tmp_path, []) as writer:
        for k in range(3):
            writer.reading(row(k))
        shutil.rmtree(writer.folder)
        monkeypatch.setattr(Computer, "make_folder", Mock(side_effect=OSError(errno.ENOSPC, "full")))
        with pytest.raises(CannotWrite, match="could not write 4 readings again that were removed") as refused:
            writer.reading(row(3))
    assert "kept" not in str(refused.value)


def test_what_else_lies_in_the_folder_is_rescued_with_it(tmp_path):
    with create(tmp_path, []) as writer:
        writer.wire("GPIB0::1::INSTR", ">", b"*IDN?\n")
        (writer.folder / "traces").mkdir()
        (writer.folder / "traces" / "000001.npy").write_bytes(b"codes")
        (writer.folder / "readings.csv").unlink()
        writer.reading(row(0))
        writer.wire("GPIB0::1::INSTR", "<", b"me\n")
    assert (writer.folder / "traces" / "000001.npy").read_bytes() == b"codes"
    assert len((writer.folder / "wire.log").read_text(encoding="utf-8").splitlines()) == 2


@posix_only
def test_a_record_that_is_removed_is_written_again(tmp_path):
    messages = []
    with create(tmp_path, messages) as writer:
        (writer.folder / "run.json").unlink()
        writer.reading(row(0))
        assert Run.load(writer.folder).status == "running"
    assert messages == []


def test_a_run_without_a_loss_is_not_rescued(tmp_path):
    messages = []
    with create(tmp_path, messages) as writer:
        for k in range(5):
            writer.reading(row(k))
            writer.event(10.0 * k, "kept", "kept")
        writer.finish("finished")
    assert messages == []
    assert [path.name for path in tmp_path.iterdir()] == [writer.folder.name]


# --- what is never discarded ---


def test_a_run_is_discarded_that_never_began_and_no_other(tmp_path):
    with create(tmp_path, []) as writer:
        assert writer.discard()
    assert list(tmp_path.iterdir()) == []
    with create(tmp_path, []) as writer:
        writer.reading(row(0))
        assert not writer.discard()
    with create(tmp_path, []) as other:
        with (other.folder / "readings.csv").open("a", encoding="utf-8") as file:
            file.write("0.0,40.0\n")  # another program's
        assert not other.discard()
    with create(tmp_path, []) as resumed:
        pass
    with RunWriter.reopen(Run.load(resumed.folder)) as again:
        assert not again.discard()
    assert [times(one.folder) for one in (writer, other)] == [[0], [0]]
    assert (resumed.folder / "run.json").exists()


def test_a_resume_at_a_bench_that_does_not_answer_keeps_the_run(tmp_path):
    """Nothing listens on port 9 of this machine; the run names no instruments, as those of other programs may not."""
    folder = tmp_path / "run"
    shutil.copytree(SAMPLE_DATA / "spin-down-1", folder)
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    changes = {
        "status": "interrupted",
        "instruments": {},
        "seed": None,
        "time_zero_utc": "2026-11-20T10:15:00Z",
        "configuration": {"spin": {"reading_u_hz": 0.03}},
    }
    (folder / "run.json").write_text(json.dumps(record | changes), encoding="utf-8")
    (tmp_path / "bench.toml").write_text(
        '[counter]\nmodel = "53230A"\naddress = "TCPIP0::127.0.0.1::9::SOCKET"\n'
        '[generator]\nmodel = "33500B"\naddress = "TCPIP0::127.0.0.1::9::SOCKET"\n',
        encoding="utf-8",
    )
    before = (folder / "readings.csv").read_bytes()
    assert command("acquire", "spin", "--resume", folder, cwd=tmp_path).status == 3
    assert (folder / "readings.csv").read_bytes() == before
    assert Run.load(folder).status == "failed"


# --- a whole acquisition ---

ACTS = {
    "folder": shutil.rmtree,
    "readings": lambda folder: (folder / "readings.csv").unlink(),
    "all runs": lambda folder: shutil.rmtree(folder.parent),
}


@posix_only
@pytest.mark.parametrize("act", ACTS)
@pytest.mark.parametrize("at", [12, 20, 30])
def test_an_acquisition_whose_run_is_removed_loses_no_reading(tmp_path, monkeypatch, act, at):
    """Removed when something is put on the disk for the n-th time."""
    out, sync, count = tmp_path / "runs", os.fsync, 0

    def removing(descriptor):
        nonlocal count
        sync(descriptor)
        count += 1
        if count == at:
            (folder,) = out.iterdir()
            ACTS[act](folder)

    monkeypatch.setattr(os, "fsync", removing)
    done = command("acquire", "spin", "--mock", *QUICKLY, "--seed", "7", "--out", out, "--json", cwd=tmp_path)
    assert done.status == 0, done.err
    result = json.loads(done.out)
    folder = Path(result["run"])
    assert folder.name.endswith("-rescued")
    shown = [line.split() for line in done.err.splitlines() if " Hz" in line and line.lstrip()[:1].isdigit()]
    assert len(shown) == result["readings"] > 12
    frame = Run.load(folder).readings().frame
    assert [f"{t:.2f}" for t in frame["time_s"]] == [words[0] for words in shown]
    assert Run.load(folder).status == "finished"
