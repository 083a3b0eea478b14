"""Captures of sigrok: levels and voltages in pieces, as sigrok-cli 0.7.2 writes them, and ZIPs that are bombs."""

import zipfile
from dataclasses import replace

import numpy as np
import pytest

from levilab.errors import DataError
from levilab.formats.columns import NoTable
from levilab.formats.waveforms import sigrok
from levilab.formats.waveforms.record import read_record

METADATA = """[global]
sigrok version=0.5.2

[device 1]
capturefile=logic-1
total probes=4
samplerate=10 kHz
total analog=2
probe1=D0
probe10=D9
analog17=A0
analog18=A1
unitsize=2
"""
LEVELS = np.arange(2000, dtype="<u2")
VOLTS = np.sin(np.arange(2000) / 7).astype("<f4")


def capture(path, *, metadata=METADATA, **members):
    """A capture in pieces that a sample may be cut by, in no order; members: by name, instead of these."""
    levels, volts = LEVELS.tobytes(), VOLTS.tobytes()
    parts = {
        "version": b"2",
        "metadata": metadata,
        "analog-1-17-1": volts[:4001],
        "analog-1-17-2": volts[4001:],
        "logic-1-2": levels[3000:3500],
        "logic-1-1": levels[:3000],
        "logic-1-10": levels[3500:],
    } | members
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return path


def test_levels_and_voltages_are_read_from_their_pieces(tmp_path, monkeypatch):
    monkeypatch.setattr(sigrok, "BLOCK", 99)
    record = read_record(capture(tmp_path / "a.sr"))
    assert [(one.name, one.unit) for one in record.signals] == [("D0", "logic"), ("D9", "logic"), ("A0", "V")]
    assert (record.format, record.count, record.step) == ("sigrok capture", 2000, pytest.approx(1e-4))
    np.testing.assert_array_equal(record.samples("D0"), LEVELS & 1)
    np.testing.assert_array_equal(record.samples("D9"), LEVELS >> 9 & 1)
    np.testing.assert_array_equal(record.samples("A0"), VOLTS)


def test_silent_levels_that_are_longer_than_voltages_are_passed_over_and_read_once(tmp_path, monkeypatch):
    monkeypatch.setattr(sigrok, "BLOCK", 99)
    record = read_record(capture(tmp_path / "a.sr", **{"logic-1-1": bytes(5000), "logic-1-2": b"", "logic-1-10": b""}))
    reads = []
    record = replace(record, read=lambda k, read=record.read: (reads.append(k), read(k))[1])
    assert [record.signal(), record.signal()] == [2, 2]
    assert reads == [0, 1, 2]


def test_the_sample_capture_has_the_tape_in_both_of_its_channels(sample_data):
    record = read_record(sample_data / "scope-files" / "pulseview.sr")
    written = np.load(sample_data / "scope-files" / "samples-4000hz.npy")
    np.testing.assert_array_equal(record.samples("A0"), written)
    np.testing.assert_array_equal(record.samples("D0"), written > 0.5)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"metadata": METADATA.replace("10 kHz", "fast")}, "sample rate of 'fast'"),
        ({"metadata": METADATA.replace("10 kHz", "0 Hz")}, "the sampling interval is 1e+99 s"),
        ({"metadata": METADATA.replace("unitsize=2", "unitsize=two")}, "no capture that can be read"),
        ({"metadata": "no section"}, "no capture that can be read"),
        ({"metadata": "[device 1]\nsamplerate=1 kHz\n"}, "no channel with samples"),
        ({"metadata": " " * (1 << 21)}, "its metadata has 2097152 bytes"),
        ({"analog-1-17-1": np.full(2000, np.nan, "<f4").tobytes()}, "A0 that are no numbers"),
    ],
)
def test_a_damaged_capture_is_refused_in_one_line(tmp_path, changes, says):
    path = capture(tmp_path / "a.sr", **changes)
    with pytest.raises(DataError) as caught:
        read_record(path).samples("A0")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_capture_that_is_cut_off_or_changed_is_refused(tmp_path):
    content = bytearray(capture(tmp_path / "a.sr").read_bytes())
    (tmp_path / "cut.sr").write_bytes(content[: len(content) // 2])
    content[300:320] = b"\xff" * 20
    (tmp_path / "changed.sr").write_bytes(content)
    for name in ("cut.sr", "changed.sr"):
        with pytest.raises(DataError):
            read_record(tmp_path / name).samples("A0")


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(sigrok, "MOST_BYTES", 1 << 20)
    path = capture(tmp_path / "a.sr", **{"logic-1-3": bytes(1 << 21)})
    assert path.stat().st_size < 30_000
    with pytest.raises(DataError, match=r"unpacks to 0\.0 GB, at most 0\.0 GB are read"):
        read_record(path)


def test_a_zip_of_something_else_is_no_capture(tmp_path):
    path = tmp_path / "a.sr"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("version", "2")
    with pytest.raises(NoTable):
        read_record(path)
