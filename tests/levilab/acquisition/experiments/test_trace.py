"""Records of the oscilloscope: from the virtual bench into a run folder, and every way out of it."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.errors import OutOfRange
from instruments.virtual.core.signal import crossings
from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.acquisition.session import ExperimentFailed
from levilab.acquisition.table import settings_of
from levilab.bench.config import ConfigError
from levilab.runs.listing import list_runs
from levilab.runs.run import Run
from levilab.runs.writer import RunWriter
from levilab.world.bench import VIRTUAL, virtual_wiring
from levilab.world.spin_world import SpinScene, SpinWorld, random_scene
from support.acquisitions import Impatient, Meanwhile, Silent, asked, texts
from support.commands import command

#: The thesis's driven top, put where it floats: as IC1 it swings so far that the laser misses it now and then.
CALM = """
    [top]
    mass_kg = 0.02445
    moment_tilt = [0.03, 0.97]
    [drive]
    waveform = "sine"
    amplitude_t = 4e-4
    frequency_hz = 30.0
    [start]
    place = "equilibrium"
    precession = "steady"
    spin_hz = 30.0
"""


def mock_trace(folder, lines="", **options):
    """Records on the virtual bench, with lines of the bench file's table [trace]."""
    bench = folder / "bench.toml"
    bench.write_text(f"[trace]\n{lines}\n", encoding="utf-8")
    return asked("trace", bench=bench, out=folder / "runs", **options)


def pulses(run, k, slope=1.0):
    """When the pulses of a trace begin [s]."""
    trace = run.traces()[k].trace
    return crossings(slope * trace.volts, slope * 0.65, 0.1) * trace.dt_s


def frequency(run, k):
    """From the first pulse of a trace to the last [Hz]."""
    edges = pulses(run, k)
    return float((edges.size - 1) / np.ptp(edges))


def test_the_tape_is_recorded_raw_with_what_reads_it(tmp_path):
    run = acquire(mock_trace(tmp_path, "records = 3", seed=1), Silent())
    assert run.status == "finished"
    traces = run.traces()
    assert [(t.number, t.channel, t.trace.channel) for t in traces] == [(k, "tape", 1) for k in (1, 2, 3)]
    assert all(t.trace.codes.dtype == np.uint8 for t in traces)
    assert traces[0].trace.codes.size >= 6000
    # 30 Hz, and 0.1 Hz/s less; jitter of the tape is 2 % of a turn in the 14 of a record
    expected = [float(SpinWorld(random_scene(1), VirtualClock()).motion(np.array([t.time_s]))[0][0]) for t in traces]
    assert [frequency(run, k) for k in range(3)] == pytest.approx(np.array(expected) / (2 * np.pi), abs=0.15)
    readings = run.readings()
    assert readings.column("record").tolist() == [1, 2, 3]
    assert np.diff(readings.column("time_s")) == pytest.approx(10, abs=0.1)  # a trigger comes once a turn
    assert readings.column("highest_v").max() == pytest.approx(1.2, abs=0.05)
    [listed] = list_runs(run.folder)
    assert (listed.size, listed.experiment) == ("3 records", "trace")


def test_a_given_setting_leaves_the_others_to_the_scene(tmp_path):
    (tmp_path / "calm.toml").write_text(CALM, encoding="utf-8")
    scene = str(tmp_path / "calm.toml")
    plain, given = (
        settings_of(mock_trace(tmp_path, scene=scene, seed=1, settings=some).config, "trace")
        for some in ((), ("trace.records=2",))
    )
    assert given.records == 2
    assert given.shows == plain.shows == ("tape", "laser")
    assert given.drive_frequency_hz == plain.drive_frequency_hz


def test_with_a_scene_the_laser_is_recorded_beside_the_tape(tmp_path):
    (tmp_path / "calm.toml").write_text(CALM, encoding="utf-8")
    run = acquire(mock_trace(tmp_path, "records = 2", scene=str(tmp_path / "calm.toml"), seed=1), Silent())
    assert [t.channel for t in run.traces()] == ["tape", "laser"] * 2
    assert [event["kind"] for event in run.events()] == ["drive on"]
    assert run.record.instruments["generator"]["settings_end"]["output"] is False
    for k in (0, 2):
        tape, laser = pulses(run, k), pulses(run, k + 1, -1.0)
        # cut once in a turn of the tape, but for one at either end of the record
        assert abs(tape.size - laser.size) <= 1
        assert tape.size > 12


def test_a_resumed_run_keeps_its_records_and_counts_on(tmp_path):
    first = acquire(mock_trace(tmp_path, "records = 4\ninterval_s = 2.0", seed=3), Impatient(2))
    assert first.status == "interrupted"
    before = [(path.name, path.read_bytes()) for path in sorted((first.folder / "traces").iterdir())]
    show = Silent()
    options = AcquisitionOptions(resume=first.folder, out=tmp_path / "runs")
    run = acquire(request_for("trace", options), show)
    assert run.status == "finished"
    after = [(path.name, path.read_bytes()) for path in sorted((run.folder / "traces").iterdir())]
    assert len(after) == 4
    assert after[:2] == before
    assert len(show.readings) == 2
    assert show.messages[0] == "resumed after 2 records, the next record is number 3"
    heads = show.messages[1]
    assert heads.split() == ["time", "record", "lowest", "highest", "tape"]
    assert len(heads) == len(show.readings[0])
    whole = acquire(mock_trace(tmp_path, "records = 4\ninterval_s = 2.0", seed=3), Silent())
    # the virtual top is where it would have been: a question or two earlier or later
    assert frequency(run, 3) == pytest.approx(frequency(whole, 3), abs=0.15)
    assert run.readings().column("time_s") == pytest.approx(whole.readings().column("time_s"), abs=0.1)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ("trigger_level_v = 1.35", r"1\.35 V on channel 1 within 5 s.*between 0\.\d\d and 1\.2\d V; set trace\.trig"),
        ("channels = [4]\nshows = []", r"0\.65 V on channel 4.*between -?0\.00 and 0\.00 V; is the top up and lit"),
        ("trigger_channel = 4", r"0\.65 V on channel 4.*plugged in there"),
    ],
    ids=["level", "dark", "elsewhere"],
)
def test_without_a_trigger_the_error_has_the_level_and_the_signal(tmp_path, settings, said):
    with pytest.raises(ExperimentFailed, match=said):
        acquire(mock_trace(tmp_path, settings + "\ndrive_frequency_hz = 30.0", seed=1), Silent())
    [folder] = (tmp_path / "runs").iterdir()
    [listed] = list_runs(folder)
    assert listed.status == "failed"


def test_a_channel_that_the_scope_does_not_have_is_refused(tmp_path):
    with pytest.raises(OutOfRange, match="channel = 7 is refused, allowed is one of 1, 2, 3, 4"):
        acquire(mock_trace(tmp_path, "channels = [1, 7]", seed=1), Silent())
    with pytest.raises(ConfigError, match="each channel is expected once"):
        mock_trace(tmp_path, "channels = [1, 1]")


def test_a_channel_that_shows_nothing_or_too_much_is_reported(tmp_path):
    settings = "records = 1\nchannels = [1, 4]\nvolts_per_division = 0.1\npoints = 1000"
    run = acquire(mock_trace(tmp_path, settings, seed=1), Silent())
    texts = [event["text"] for event in run.events()]
    assert "channel 1 (tape) is beyond the screen" in texts[0]
    assert "channel 4 (channel 4) shows nothing" in texts[1]


def test_a_record_without_a_single_sample_is_kept_and_reported(tmp_path, monkeypatch):
    whole = RigolDS1000Z.trace

    def hollow(scope, channel, arrived=None):
        trace = whole(scope, channel, arrived)
        return replace(trace, codes=np.zeros_like(trace.codes), none=0)

    monkeypatch.setattr(RigolDS1000Z, "trace", hollow)
    run = acquire(mock_trace(tmp_path, "records = 1\npoints = 1000", seed=1), Silent())
    assert run.status == "finished"
    assert len(run.traces()) == 1
    assert "shows nothing" in run.events()[0]["text"]
    assert run.readings().frame[["lowest_v", "highest_v"]].isna().all(axis=None)


def test_a_channel_that_another_program_turns_off_is_turned_on_again(tmp_path):
    request = mock_trace(tmp_path, "records = 2\ninterval_s = 2.0", seed=1)
    wiring = virtual_wiring(SpinWorld(random_scene(1), VirtualClock()))

    scope = wiring.library.bench.instruments[VIRTUAL["oscilloscope"].address]
    meddler = Meanwhile(1, lambda: scope.settings.update(chan1_display=False))
    run = acquire(replace(request, wiring=lambda: wiring), meddler)
    assert run.status == "finished"
    assert [event["kind"] for event in run.events()] == ["instrument lost", "found again"]
    assert len(run.traces()) == 2


def watched(tmp_path, message, scene=None):
    """Three driven records; after the first the generator gets this message from its front panel."""
    settings = "records = 3\ninterval_s = 2.0\npoints = 1000\ndrive_frequency_hz = 30.0"
    wiring = virtual_wiring(SpinWorld(scene or SpinScene(), VirtualClock()))
    generator = wiring.library.bench.instruments[VIRTUAL["generator"].address]
    meddler = Meanwhile(1, lambda: generator.execute(message))
    return acquire(replace(mock_trace(tmp_path, settings, seed=1), wiring=lambda: wiring), meddler)


@pytest.mark.parametrize("message", ["FREQ 35", "OUTP1 OFF", "VOLT 1"])
def test_a_drive_that_is_changed_by_hand_is_seen_after_the_record(tmp_path, message):
    run = watched(tmp_path, message)
    assert run.count() == 3
    kinds = [event["kind"] for event in run.events()]
    assert kinds == ["drive on", "warning", "instrument lost", "drive on", "found again"]
    (warning,) = run.warnings()
    assert warning.startswith("record 1 may be of another drive: the generator was changed")
    settings = run.record.instruments["generator"]["settings_end"]
    assert (settings["frequency_hz"], settings["output"]) == (30.0, False)


def test_a_top_that_the_drive_does_not_hold_is_warned_of_once(tmp_path):
    """It begins at 27 Hz, which no drive of 30 Hz takes hold of."""
    run = watched(tmp_path, "*CLS", SpinScene(start_hz=27.0))
    (warning,) = run.warnings()
    assert "record 1 shows a tape of 2" in warning
    assert "the drive of 30 Hz lost the top" in warning


def test_what_was_cut_short_is_said_and_taken_anew(tmp_path):
    """Killed in the second record: codes of its first channel with a line, those of its second without."""
    settings = "records = 2\ninterval_s = 2.0\npoints = 1000\nchannels = [1, 2]"
    whole = acquire(mock_trace(tmp_path, settings, seed=3), Silent())
    for name, kept in (("readings.csv", 2), ("traces.jsonl", 3)):
        lines = (whole.folder / name).read_text(encoding="utf-8").splitlines(keepends=True)
        (whole.folder / name).write_text("".join(lines[:kept]), encoding="utf-8")
    record = (whole.folder / "run.json").read_text(encoding="utf-8")
    killed = record.replace('"status": "finished"', '"status": "interrupted"')
    (whole.folder / "run.json").write_text(killed, encoding="utf-8")
    run = acquire(request_for("trace", AcquisitionOptions(resume=whole.folder, out=tmp_path)), Silent())
    cut = texts(run, "cut short")
    assert cut[0].startswith("traces/000004.npy: the run was cut short before traces.jsonl said how to read it")
    assert cut[1] == "record 2 was cut short after 1 of 2 channels; it is taken again"
    assert [one.number for one in run.traces()] == [1, 2, 3, 5, 6]
    assert run.count() == 2


def test_what_had_come_of_a_record_when_killed_is_found_again(tmp_path, monkeypatch):
    """Killed before the third of three pieces of the second record: of the folder at that moment a copy is made."""
    left, copied = tmp_path / "left", 0
    monkeypatch.setattr(RigolDS1000Z, "_LONGEST_BLOCK", 5000)
    whole = RunWriter.arriving

    def arriving(writer, time_s, trace, *more):
        nonlocal copied
        whole(writer, time_s, trace, *more)
        if trace.codes.size == 10_000 and (writer.folder / "traces" / "000001.npy").exists():
            shutil.copytree(writer.folder, left)
            copied += 1

    monkeypatch.setattr(RunWriter, "arriving", arriving)
    run = acquire(mock_trace(tmp_path, "records = 2\ninterval_s = 2.0\npoints = 12000", seed=3), Silent())
    assert copied == 1
    assert not (run.folder / "traces" / "arriving.json").exists()
    assert not (run.folder / "traces" / "arriving.codes").exists()
    codes = run.traces()[1].trace.codes

    monkeypatch.undo()
    found = Run.load(left)
    assert found.status == "interrupted"
    assert [(one.number, one.announced) for one in found.traces()] == [(1, None), (2, 12_000)]
    np.testing.assert_array_equal(found.traces()[1].trace.codes, codes[:10_000])
    ended = command("analyze", "spin", left, "--no-save", cwd=tmp_path)
    assert ended.status == 0, ended.err
    assert "record 2 was cut short: 10000 of its 12000 points are kept" in " ".join((ended.out + ended.err).split())

    again = acquire(request_for("trace", AcquisitionOptions(resume=left, out=tmp_path)), Silent())
    assert again.count() == 2
    assert [(one.number, one.trace.codes.size, one.announced) for one in again.traces()] == [
        (1, 12_000, None),
        (2, 10_000, 12_000),
        (3, 12_000, None),
    ]
    np.testing.assert_array_equal(again.traces()[1].trace.codes, codes[:10_000])
    kinds = texts(again, "cut short")
    assert kinds[0] == "traces.jsonl: record 2 (tape) was cut short: 10000 of its 12000 points are kept"


def test_the_generator_is_needed_only_by_a_drive(tmp_path):
    bench = tmp_path / "bench.toml"
    scope = '[oscilloscope]\nmodel = "DS1000Z"\naddress = "TCPIP0::192.0.2.1::inst0::INSTR"\n'
    bench.write_text(scope, encoding="utf-8")
    request_for("trace", AcquisitionOptions(bench=bench, out=tmp_path))
    bench.write_text(scope + "[trace]\ndrive_frequency_hz = 30.0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="generator"):
        request_for("trace", AcquisitionOptions(bench=bench, out=tmp_path))
    bench.write_text(scope + "[trace]\ndrive_frequency_hz = 300.0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"trace\.drive_frequency_hz = 300 is more than this bench allows"):
        request_for("trace", AcquisitionOptions(bench=bench, out=tmp_path))


def test_time_left_is_that_of_the_records_to_come(tmp_path):
    show = Silent()
    acquire(mock_trace(tmp_path, "records = 3\ninterval_s = 2.0", seed=1), show)
    assert show.left == [4.0, 2.0, 0.0]
