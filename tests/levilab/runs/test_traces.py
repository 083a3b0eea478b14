"""Records of an oscilloscope in a run folder: kept raw, found again, and what is left of them when it is removed."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from instruments.drivers.oscilloscope import Trace
from levilab.computer import utc_now
from levilab.errors import DataError
from levilab.runs.run import Run, RunRecord
from levilab.runs.traces import load_traces, undescribed_codes
from levilab.runs.writer import RunWriter


def record_of(first):
    codes = np.arange(first, first + 100, dtype=np.uint8)
    return Trace(codes, dt_s=1e-4, t0_s=-5e-3, volts_per_code=0.01, offset_v=-1.0, channel=1)


@pytest.fixture
def said():
    return []


@pytest.fixture
def writer(tmp_path, said):
    channels = [{"name": "time_s", "unit": "s", "source": "a test"}]
    record = RunRecord(experiment="trace", status="running", started_utc=utc_now(), channels=channels)
    return RunWriter.create(tmp_path, record, tell=said.append)


def test_records_come_back_as_they_were(writer):
    with writer:
        assert [writer.trace(k / 10, record_of(k), "light") for k in range(3)] == [1, 2, 3]
        writer.finish("finished")
    stored = Run.load(writer.folder).traces()
    assert [one.time_s for one in stored] == [0.0, 0.1, 0.2]
    assert [one.trace.codes[0] for one in stored] == [0, 1, 2]
    assert np.array_equal(stored[2].trace.volts, record_of(2).volts)


@pytest.mark.parametrize("late", [False, True])
def test_a_record_on_its_way_may_be_kept_while_another_process_reads(writer, monkeypatch, late):
    part = replace(record_of(0), codes=record_of(0).codes[:40])
    with writer:
        writer.arriving(0.0, part, "light", 100)
        (there,) = Run.load(writer.folder).traces()
        assert there.trace.codes.size == 40
        read_text = Path.read_text

        def read_late(path, *args, **named):
            monkeypatch.undo()
            text = "" if late else read_text(path, *args, **named)
            writer.trace(0.0, record_of(0), "light")
            return read_text(path, *args, **named) if late else text

        monkeypatch.setattr(Path, "read_text", read_late)
        traces = load_traces(writer.folder)
    assert [one.trace.codes.size for one in traces] == [100]


@pytest.mark.parametrize("name", ["light\u2028left", "light\u0085", "light\x0cright", "Licht µ"])
def test_a_channel_may_have_any_name(writer, name):
    with writer:
        writer.trace(0.0, record_of(0), name)
        writer.trace(1.0, record_of(1), "other")
    assert [one.channel for one in Run.load(writer.folder).traces()] == [name, "other"]


def test_a_resumed_run_numbers_its_records_on(writer):
    with writer:
        writer.trace(0.0, record_of(0), "light")
        writer.finish("interrupted")
    with RunWriter.reopen(Run.load(writer.folder)) as again:
        assert again.trace(1.0, record_of(1), "light") == 2
        again.finish("finished")
    assert [one.number for one in Run.load(writer.folder).traces()] == [1, 2]


def test_codes_without_a_line_are_left_out_and_never_written_over(writer):
    """As a kill leaves them: between codes and line, and in the middle of the line."""
    with writer:
        for k in range(3):
            writer.trace(float(k), record_of(k), "light")
    index, folder = writer.folder / "traces.jsonl", writer.folder
    lines = index.read_text(encoding="utf-8").splitlines(keepends=True)
    index.write_text("".join([*lines[:2], lines[2][:40]]), encoding="utf-8")
    (folder / "traces" / "000001.npy").unlink()
    index.write_text("".join([lines[1], lines[2][:40]]), encoding="utf-8")  # numbers 1 gone, 2 whole, 3 torn
    assert [one.number for one in Run.load(folder).traces()] == [2]
    assert undescribed_codes(folder) == ["traces/000003.npy"]
    before = (folder / "traces" / "000003.npy").read_bytes()
    with RunWriter.reopen(Run.load(folder)) as again:
        assert again.trace(3.0, record_of(3), "light") == 4
        again.finish("finished")
    assert [one.number for one in Run.load(folder).traces()] == [2, 4]
    assert (folder / "traces" / "000003.npy").read_bytes() == before


def test_a_line_without_codes_is_an_error_that_says_what_to_do(writer):
    """No crash makes one: codes are on the disk before their line."""
    with writer:
        writer.trace(0.0, record_of(0), "light")
    (writer.folder / "traces" / "000001.npy").unlink()
    with pytest.raises(DataError, match=r"000001\.npy: cannot be read .*bring it back, or remove its line there"):
        Run.load(writer.folder).traces()


def test_a_folder_removed_before_a_record_costs_the_records_before_it_alone(writer, said):
    with writer:
        writer.trace(0.0, record_of(0), "light")
        shutil.rmtree(writer.folder)
        assert writer.trace(1.0, record_of(1), "light") == 2
        writer.finish("finished")
    assert [one.number for one in Run.load(writer.folder).traces()] == [2]
    assert "1 record of the oscilloscope" in said[0]


def test_an_index_removed_alone_is_written_anew_with_every_record(writer):
    with writer:
        writer.trace(0.0, record_of(0), "light")
        (writer.folder / "traces.jsonl").unlink()
        writer.trace(1.0, record_of(1), "light")
        writer.finish("finished")
    assert [one.number for one in Run.load(writer.folder).traces()] == [1, 2]


def test_an_index_that_cannot_be_read_is_an_error_in_a_line(writer):
    with writer:
        (writer.folder / "traces.jsonl").mkdir()
    with pytest.raises(DataError, match=r"traces\.jsonl: cannot be read"):
        Run.load(writer.folder).traces()
