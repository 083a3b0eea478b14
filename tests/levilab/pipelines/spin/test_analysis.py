"""Records and pulse times at some paths: against closed forms, from all kinds of inputs, and what is passed over."""

import json
import re
import shutil
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

import levilab
from analysis.rotation.result import Kind
from instruments.drivers.oscilloscope import Trace
from levilab.computer import utc_now
from levilab.errors import DataError, DoesNotSuit
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import SpinDownOptions, SpinOptions
from levilab.pipelines.spin import words
from levilab.pipelines.spin.analysis import Series, drive_offset, in_a_sentence
from levilab.pipelines.spin.document import SPIN
from levilab.pipelines.spin.figure import spin_figure
from levilab.pipelines.spin.report import frequency_table, meaning, spin_part, spin_tables
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.suits import analyze_suiting, suiting
from levilab.pipelines.suits import save as save_found
from levilab.runs.run import Run, RunRecord
from levilab.runs.waveforms import run_waveforms
from levilab.runs.writer import RunWriter
from levilab.texts.text import in_language
from support.detector import C32, RELEASE_HZ, coasting_turns, coasting_wav, pulses, write_wav
from support.figures import faults
from support.paths import ROOT, SAMPLE_DATA
from support.spin_downs import spin_down_csv


def true_frequency(name, time):
    """Of the sample files, as sample_data/make.py makes them: 30 Hz at time 0 of scopes, 0.25 s into other files."""
    others = ("recording", "samples", "phone", "pulseview", "owon", "hantek", "microcontroller", "dsview-dscope")
    from_middle = time - 0.25 if name.startswith(others) else time
    return 30.0 - 0.095 * from_middle


def test_the_offset_from_a_drive_is_of_the_held_part_and_its_u_of_the_scatter():
    series = Series(np.arange(4.0), np.array([30.1, 29.9, 25.0, 20.0]), np.full(4, 0.02), (("held", 0.0, 1.0),))
    off = drive_offset(series, 30.0)
    assert (off.value, off.u) == pytest.approx((0.0, 0.1))  # ± 0.1 of two
    assert drive_offset(replace(series, phases=()), 30.0).value == pytest.approx(-3.75)


@pytest.fixture(scope="module")
def scope_files():
    """What is found in the sample files."""
    return SPIN.analyze([SAMPLE_DATA / "scope-files"])


def test_every_sample_file_gives_the_spin_that_it_was_made_with(scope_files):
    analysis = scope_files
    assert len(analysis.runs) == 27  # the array and times that fall need a rate
    for source, run in zip(analysis.sources, analysis.runs, strict=True):
        frequency, chirp = run.spin.frequency, run.spin.chirp
        truth = true_frequency(source.name, run.spin.reference_time)
        assert frequency.value == pytest.approx(truth, abs=4 * frequency.u), source.name
        assert chirp.value == pytest.approx(-0.095, abs=4 * chirp.u), source.name
        assert frequency.u < 1.4 * 3e-3, source.name
    assert [remark for remark in analysis.skipped if "samples-4000hz.npy" in str(remark)]
    assert {run.trend for run in analysis.runs if not run.which} == {None}  # of a single record the slope is its own


def test_a_laser_and_a_drive_are_no_spin(sample_data):
    sweep = sample_data / "precession-sweep"
    with pytest.raises(DoesNotSuit, match="records of laser, drive, none of which shows the spin: levilab analyze"):
        SPIN.analyze([sweep])
    named = SPIN.analyze([sweep], SpinOptions(channel="laser"))
    assert any("the frequency of laser is no spin, but how often" in text for text in named.all_warnings)


def test_options_reach_the_file_and_the_method(sample_data):
    array = sample_data / "scope-files" / "samples-4000hz.npy"
    (run,) = SPIN.analyze([array], SpinOptions(rate=4000.0, method="edges")).runs
    assert run.spin.method == "edges"
    assert run.spin.frequency.value == pytest.approx(true_frequency("samples.npy", run.spin.reference_time), abs=0.01)
    two = sample_data / "scope-files" / "rigol-ds1000z.csv"
    other = SPIN.analyze([two], SpinOptions(channel="2")).runs[0].spin
    assert other.frequency.value == pytest.approx(50, abs=0.01)  # 40 samples high, 40 low, at 4000 a second


def test_a_note_of_channels_names_its_file_and_them_as_they_are_in_german_too(tmp_path):
    """German has a word for "mark", which `channel` would not take; two files have a note each."""
    times = np.arange(2000) / 4000
    table = np.column_stack([times, pulses(30 * times), times % 0.1])
    for name in ("p1.csv", "p2.csv"):
        shifted = table + (name == "p2.csv") * 1e-3  # not the same readings twice
        np.savetxt(tmp_path / name, shifted, "%.7g", ",", header="time [s],mark,laser", comments="")
    found = SPIN.analyze([tmp_path / "p1.csv", tmp_path / "p2.csv"])
    said = [in_language(text, "de") for text in found.all_warnings]
    has = "hat Aufzeichnungen von mark, laser; ausgewertet wird mark, die Option `channel` wählt etwas anderes"
    assert [text for text in said if "Aufzeichnungen" in text] == [f"p1.csv: {has}", f"p2.csv: {has}"]


def test_a_long_record_is_followed_and_feeds_the_drag_laws(tmp_path):
    path = coasting_wav(tmp_path / "long.wav")
    (run,) = SPIN.analyze([path]).runs
    assert len(run.series) == 15  # windows of 2 s
    omega = ((2 * np.pi * RELEASE_HZ) ** -0.5 + C32 * run.series.time / 2) ** -2
    pulls = (run.series.frequency - omega / (2 * np.pi)) / run.series.u
    assert np.abs(pulls).max() < 4.5
    assert [kind for kind, _, _ in run.series.phases] == ["coasting"]
    down = SPINDOWN.analyze([path])
    disc = down.runs[0].fit("disc").parameters["c32"]
    assert disc.value == pytest.approx(C32, abs=4 * disc.u)
    assert disc.u < 2e-3 * C32
    assert any("frequency in a window of 2 s" in text for text in down.all_warnings)


def test_a_top_that_is_held_has_a_spin_and_no_spin_down(tmp_path):
    held = write_wav(tmp_path / "held.wav", pulses(30.0 * np.arange(8000) / 1000), 1000)
    ((row, found),) = analyze_suiting([held], {})
    assert row.name == "spin"
    assert found.runs[0].spin.frequency.value == pytest.approx(30, abs=1e-3)
    with pytest.raises(DoesNotSuit, match="is the drive still on"):
        SPINDOWN.analyze([held])


def test_a_long_list_of_pulse_times_feeds_the_drag_laws(tmp_path):
    t = np.linspace(0, 30, 30_001)
    times = np.interp(np.arange(1, int(coasting_turns(t)[-1])), coasting_turns(t), t)
    path = tmp_path / "pulses.csv"
    path.write_text("pulse time [s]\n" + "".join(f"{x:.7f}\n" for x in times), encoding="utf-8")
    disc = SPINDOWN.analyze([path]).runs[0].fit("disc").parameters["c32"]
    assert disc.value == pytest.approx(C32, rel=1e-3)
    assert len(SPIN.analyze([path]).runs[0].series) == 15


@pytest.mark.parametrize("analysis", [SPIN, SPINDOWN], ids=["spin", "spindown"])
@pytest.mark.parametrize(("marks", "seconds", "doubts"), [(2, 20, 1), (2, 90, 1), (1.53, 20, 0)])  # 1.53: 61 Hz
def test_a_spin_too_fast_for_hand_and_drive_is_doubted(analysis, marks, seconds, doubts, tmp_path):
    path, turns = tmp_path / "marks.csv", marks * coasting_turns(t := np.linspace(0, seconds, 1000 * seconds + 1))
    times = np.interp(np.arange(1, int(turns[-1])), turns, t)
    path.write_text("pulse time [s]\n" + "".join(f"{x:.7f}\n" for x in times), encoding="utf-8")
    found = analysis.analyze([path])
    said = [text for text in found.all_warnings if "Hz is too fast for a hand: without a drive there are two" in text]
    assert (len(found.doubts), len(said)) == (doubts, 1)
    assert analysis is SPIN or found.is_doubtful == bool(doubts)  # as of a table


@pytest.mark.parametrize(("marks", "warns"), [(1.4, True), (1, False)])
def test_a_record_that_ends_at_twice_the_lower_limit_may_be_of_two_marks(marks, warns, tmp_path):
    turns = marks * coasting_turns(t := np.linspace(0, 60, 60_001))
    times = np.interp(np.arange(1, int(turns[-1])), turns, t)
    (tmp_path / "marks.csv").write_text("pulse time [s]\n" + "".join(f"{x:.7f}\n" for x in times), encoding="utf-8")
    said = SPINDOWN.analyze([tmp_path / "marks.csv"]).all_warnings
    assert any("if there are 2 marks a turn" in text for text in said) == warns


def test_windows_whose_turns_count_once_and_twice_are_doubted_where_they_are_used(tmp_path):
    turns, t = coasting_turns(np.linspace(0, 24, 24_001)), np.linspace(0, 24, 24_001)
    halves = np.arange(1, 2 * turns[-1]) / 2
    times = np.interp(halves, turns, t)
    doubts = []
    for name, twice in (("mixed", (8, 12)), ("sound", (20, 24))):  # the last windows are no part of the spin-down
        kept = times[(halves % 1 == 0) | ((times > twice[0]) & (times < twice[1]))]
        (path := tmp_path / f"{name}.csv").write_text("pulse time [s]\n" + "".join(f"{x:.7f}\n" for x in kept), "utf-8")
        doubts.append(" ".join(SPINDOWN.analyze([path]).doubts))
    assert "pulses are missing or doubled in a pattern" in doubts[0]
    assert doubts[1] == ""
    assert SPINDOWN.analyze([tmp_path / "mixed.csv"], SpinDownOptions(start_s=14.0)).doubts == []
    with pytest.raises(DataError, match=r"they go from 11.* s to 23.* s"):  # of the longer part
        SPINDOWN.analyze([tmp_path / "mixed.csv"], SpinDownOptions(start_s=50.0))


def test_a_coil_whose_spin_is_taken_off_as_hum_is_doubted(tmp_path):
    time = np.arange(16000) / 8000
    volts = 0.3 * np.sin(2 * np.pi * 49.8 * time) + 0.05 * np.sin(4 * np.pi * 49.8 * time + 1)
    np.savetxt(tmp_path / "coil.csv", np.column_stack([time, volts]), delimiter=",", header="time_s,voltage_v")
    (doubt,) = SPIN.analyze([tmp_path / "coil.csv"]).doubts
    assert "Hz was taken off as hum of the mains, and less is left: is it the spin?" in doubt


def test_a_record_that_is_too_short_is_no_spin_down(sample_data):
    with pytest.raises(DoesNotSuit, match=r"lasts 0\.5 s, a spin-down needs 3 windows of 2 s"):
        SPINDOWN.analyze([sample_data / "scope-files" / "recording.wav"])


def run_of(runs, records):
    """A run with records of the light, 10 s apart."""
    channels = [{"name": "time_s", "unit": "s", "source": "a test"}]
    record = RunRecord(experiment="trace", status="running", started_utc=utc_now(), channels=channels)
    with RunWriter.create(runs, record, tell=lambda _: None) as writer:
        for k, trace in enumerate(records):
            writer.trace(10.0 * k, trace, "light")
        writer.finish("finished")
    return writer.folder


@pytest.fixture
def traced(tmp_path):
    """A run with three records of the light at 30, 29 and 28 Hz."""
    t = -0.2 + np.arange(1600) / 4000
    codes = (np.round(pulses((30 - k) * t, seed=k) / 0.01).astype(np.uint8) for k in range(3))
    of_one = {"dt_s": 2.5e-4, "t0_s": -0.2, "volts_per_code": 0.01, "offset_v": 0.0, "channel": 1}
    return run_of(tmp_path / "runs", (Trace(one, **of_one) for one in codes))


def test_the_traces_of_a_run_are_read_in_volts_on_its_clock(traced):
    waveform = run_waveforms(Run.load(traced))[1]
    assert (waveform.start, waveform.step, waveform.count) == (pytest.approx(9.6), 2.5e-4, 1600)
    assert waveform.samples().max() == pytest.approx(1.1, abs=0.1)
    analysis = SPIN.analyze([traced])
    series = analysis.runs[0].series
    assert series.frequency == pytest.approx([30, 29, 28], abs=0.01)
    assert series.time == pytest.approx([-0.2, 9.8, 19.8], abs=0.05)  # the middles of 0.4 s before they were complete
    by_start = 0.1 * 0.02 / np.sqrt(3)  # the slope, and how often a driver asks whether a record is complete
    assert series.u[1] == pytest.approx(np.hypot(analysis.runs[0].spin.frequency.u, by_start), rel=0.01)
    assert "It loses 0.3446(7) % of its spin a second, as a free top does in air." in meaning(analysis)[0]
    alone = Series(series.time[1:2], series.frequency[1:2], series.u[1:2])  # of 0.4 s
    (text,) = meaning(replace(analysis, runs=(replace(analysis.runs[0], series=alone),)))
    assert "In 0.38 s no change of its spin shows beyond the uncertainty: it loses or gains less than" in text
    assert "A free top loses some 0.3 % a second to the air: a longer record shows that" in text
    held = Series(series.time, series.frequency.mean() + series.u * [1, -1, 1], series.u)
    (text,) = meaning(replace(analysis, runs=(replace(analysis.runs[0], series=held),)))
    assert "less than air takes from a free top: does a drive hold it?" in text
    document = ANALYSES["spin"].document(analysis, traced)
    assert document["inputs"][0]["path"] == "traces.jsonl"
    assert save_found(ANALYSES["spin"], analysis)[0] == traced / "result.json"


def test_a_run_that_was_killed_before_its_first_record_has_nothing_to_analyze(traced):
    (traced / "traces.jsonl").unlink()
    with pytest.raises(DataError, match=r"holds no traces\.jsonl, so nothing was recorded; analyze another run"):
        SPIN.analyze([traced])


def test_records_of_a_run_that_are_left_out_are_counted_in_a_note(traced):
    first, *others = (stored.trace for stored in Run.load(traced).traces())
    dark = replace(first, codes=np.full_like(first.codes, 10))
    analysis = SPIN.analyze([run_of(traced.parent, [dark, *others])])
    assert len(analysis.runs[0].series) == 2
    (note,) = [text for text in analysis.all_warnings if text.endswith("(no-pulses)")]
    assert "1 of 3 records are left out: no pulses" in note


def test_a_finding_in_some_records_of_a_run_names_them(traced):
    """The table shows the record in the middle alone."""
    *others, last = (stored.trace for stored in Run.load(traced).traces())
    codes = last.codes.copy()  # at 28 Hz, from -0.2 s on: its sixth turn
    codes[int((0 - 0.5 / 28 + 0.2) * 4000) : int((0.5 / 28 + 0.2) * 4000)] = 10
    analysis = SPIN.analyze([run_of(traced.parent, [*others, replace(last, codes=codes)])])
    assert analysis.runs[0].spin.missing == 0
    assert [text for text in analysis.all_warnings if text.endswith("record 3: 1 turn has no pulse (missing)")]


def test_the_result_says_what_the_interface_promises(sample_data, tmp_path):
    shutil.copy(sample_data / "scope-files" / "keysight-dsox.csv", tmp_path)
    analysis = SPIN.analyze([tmp_path / "keysight-dsox.csv"])
    written = save_found(ANALYSES["spin"], analysis)[0]
    assert written.name == "keysight-dsox.csv.result.spin.json"
    result = json.loads(written.read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert result["values"]["frequency"]["unit"] == "Hz"
    assert result["values"]["chirp"]["unit"] == "Hz/s"
    assert result["values"]["reference_time"]["value"] == analysis.runs[0].spin.reference_time
    assert result["values"]["bound"]["value"] > 0
    assert result["method"] == result["runs"][0]["method"] == "matched"


def test_findings_are_notes_with_their_names(tmp_path):
    t = np.arange(4000) / 1000
    turns = 30 * t
    signal = np.where(np.isin(np.rint(turns), (20, 21, 50)), 0.1, pulses(turns))  # three turns without their pulse
    analysis = SPIN.analyze([write_wav(tmp_path / "a.wav", signal, 1000)])
    assert analysis.runs[0].spin.missing == 3
    assert any(text.endswith("(missing)") for text in analysis.all_warnings)


@pytest.mark.parametrize("analysis", [SPIN, SPINDOWN], ids=["spin", "spindown"])
def test_a_silent_channel_is_passed_over_and_one_without_pulses_names_the_others(analysis, tmp_path):
    light = pulses(coasting_turns(time := np.arange(8000) / 1000))
    for name, left in (("silent", np.zeros(8000)), ("dark", np.random.default_rng(2).normal(0, 0.01, 8000))):
        rows = np.column_stack([time, left, light])
        np.savetxt(tmp_path / f"{name}.csv", rows, "%.6f", ",", header="time_s,left_v,right_v", comments="")
    found = analysis.analyze([tmp_path / "silent.csv"])
    assert "right_v is analyzed, the option `channel` chooses another" in " ".join(found.all_warnings)
    with pytest.raises(DataError, match=r"pulses in .*left_v is analyzed, the option `channel` chooses another"):
        analysis.analyze([tmp_path / "dark.csv"])


def test_a_record_without_pulses_is_refused_in_one_line(tmp_path):
    path = write_wav(tmp_path / "dark.wav", np.full(4000, 0.1), 1000)
    with pytest.raises(DataError, match=r"dark\.wav: 0 pulses in 4 s, at least 4 are needed"):
        SPIN.analyze([path])


@pytest.mark.parametrize("find", [SPIN.analyze, ANALYSES["spin"].recall])
def test_a_record_without_pulses_among_others_is_passed_over(find, tmp_path):
    """By a report, too, which recalls."""
    write_wav(tmp_path / "dark.wav", np.full(4000, 0.1), 1000)
    write_wav(tmp_path / "spins.wav", pulses(30.0 * np.arange(4000) / 1000), 1000)
    found = find([tmp_path], SpinOptions())
    assert [source.name for source in found.sources] == ["spins.wav"]
    assert [text for text in found.all_warnings if "skipped " in text and "dark.wav: 0 pulses" in text]


def test_each_analysis_takes_its_own_out_of_a_folder(sample_data, tmp_path):
    root = shutil.copytree(sample_data, tmp_path / "data")
    for name, text in {
        "notes.txt": "hello\n",
        "field.csv": "z [mm];B [mT]\n1;2\n3;4\n",
        "no titles.csv": "0,40\n9,39\n",
    }.items():
        (root / name).write_text(text, encoding="utf-8")
    coasting_wav(root / "long.wav", seconds=10)
    found = {one.analysis.name: one.found for one in suiting([root], {})}
    down, spin = found["spindown"], found["spin"]
    assert [source.name for source in down.sources][:2] == ["spin-down-1", "spin-down-2"]
    assert [source.name for source in down.sources][4:] == ["long.wav"]
    assert len(spin.sources) == 30  # 27 files, the long one, two runs with traces of a tape
    quiet = [text for each in (down, spin) for text in each.warnings]
    assert not [text for text in quiet if any(name in text for name in ("notes", "field.csv", "no titles"))]
    assert {one.kind.name for one in down.skipped if "npy" in str(one)} == {"a NumPy array"}


def test_what_is_damaged_is_a_note_of_the_analysis_that_it_belongs_to(sample_data, tmp_path):
    shutil.copy(sample_data / "scope-files" / "recording.wav", tmp_path)
    cut = (sample_data / "scope-files" / "siglent-sds1202x-e.csv").read_text(encoding="utf-8")
    (tmp_path / "cut.csv").write_text(cut.replace("-0.20000000000,", "-0.20000000000,x "), encoding="utf-8")
    ((row, found),) = analyze_suiting([tmp_path], {})
    assert row.name == "spin"
    assert len(found.runs) == 1
    assert [text for text in found.all_warnings if "cut.csv, line 213: " in text]


@pytest.mark.parametrize("what", ["trace", "times", "long", "many"])
def test_the_figure_shows_the_trace_the_turns_the_residuals_and_the_frequency(what, scope_files, sample_data, tmp_path):
    files = {
        "trace": [sample_data / "scope-files" / "recording.wav"],
        "times": [sample_data / "scope-files" / "pulse-times.txt"],
        "long": [coasting_wav(tmp_path / "long.wav", seconds=14, rate=4000)] if what == "long" else [],
    }
    figure = spin_figure(scope_files if what == "many" else SPIN.analyze(files[what]))
    panels = figure.get_axes()
    assert len(panels) == (12 if what == "many" else 4)
    assert faults(figure) == []
    if what in {"trace", "long"}:
        marks = [line for line in panels[0].get_lines() if len(line.get_xdata()) == 2]
        assert 5 <= len(marks) <= 7  # a turn each, of six that are shown
    if what != "long":
        assert panels[3].get_title("left") == "Frequency by the fit, ± u"
    residuals = np.concatenate([np.asarray(line.get_ydata(), float) for line in panels[2].get_lines()[1:]])
    assert len(residuals) > 10
    assert np.abs(residuals).max() < 200  # µs: a fifth of a pulse's width
    assert abs(residuals.mean()) < 1  # µs: no more than those that stand alone are worth


@pytest.mark.parametrize("what", ["trace", "times"])
def test_residuals_of_a_bent_frequency_have_no_bend_left(what, tmp_path):
    """The slope changes by 0.6 Hz/s in a second, 1.5 turns at the ends: a parabola leaves milliseconds."""
    random, time = np.random.default_rng(5), np.arange(10_000) / 2000
    away = time - 2.5
    turns = 0.3 + 30 * away - 0.3 * away**2 / 2 + 0.6 * away**3 / 6
    if what == "times":
        number = np.arange(np.ceil(turns[0]), np.floor(turns[-1]))
        passes = np.interp(number, turns, time) + random.normal(0, 2e-5, number.size)
        text = "pulse time [s]\n" + "".join(f"{one:.7f}\n" for one in passes)
    else:
        light = np.exp(-0.5 * (((turns + 0.5) % 1 - 0.5) / 0.02) ** 2) + random.normal(0, 0.02, time.size)
        text = "time [s],signal [V]\n" + "".join(f"{a:.4f},{b:.4f}\n" for a, b in zip(time, light, strict=True))
    file = tmp_path / "curved.csv"
    file.write_text(text, encoding="utf-8")
    analysis = SPIN.analyze([file])
    bend = analysis.runs[0].spin.bend
    assert bend.value == pytest.approx(0.6, abs=4 * bend.u)
    panel = spin_figure(analysis).get_axes()[2]
    (dots,) = [line for line in panel.get_lines() if line.get_marker() == "."]
    at, residuals = (np.asarray(values, dtype=float) for values in (dots.get_xdata(), dots.get_ydata()))
    assert len(at) > 140  # of 150 turns
    third = np.polynomial.Polynomial.fit(at, residuals, 3)
    assert np.ptp(third(at)) < 40  # µs: twice the noise of one pulse, and 8 of its standard errors at an end
    assert residuals.std() < 30


def test_records_that_scatter_by_more_than_their_u_are_of_a_spin_that_swings(sample_data):
    """A driven top of the sample swings by 0.3 Hz; one that coasts loses its spin along a line."""
    swings, coasts = (ANALYSES["spin"].analyze([sample_data / name]) for name in ("trace-laser", "trace-tape"))
    assert swings.runs[0].swing[0] == pytest.approx(np.std(swings.runs[0].series.frequency), rel=0.5)
    assert "they scatter about the curve of a drag by 0.35 Hz, 190 times their uncertainties" in meaning(swings)[0]
    assert "scatter" not in meaning(coasts)[0]


def test_the_frequencies_of_a_mock_run_scatter_about_the_disc_law_as_u_says(tmp_path):
    """ν^(-1/2) falls on a straight line in time: dν/dt = -c ν^(3/2).

    u of a record comes from some 13 degrees of freedom of its own. So χ² is 1.16 times its degrees of freedom in the
    mean, and scatters by 10: of 40 seeds of 50, by fits to the exact times of the pulses, where it is 14.
    """
    settings = {"trace.records": 25, "trace.interval_s": 2.0}
    run = levilab.acquire("trace", mock=True, seed=2, out=tmp_path, settings=settings)
    found = SPIN.analyze([run.folder]).runs[0]
    straight, weight = found.series.frequency**-0.5, 2 * found.series.frequency**1.5 / found.series.u
    line = np.polynomial.Polynomial.fit(found.series.time, straight, 1, w=weight)
    squares = float((((straight - line(found.series.time)) * weight) ** 2).sum())
    assert squares == pytest.approx(23 * 1.16, abs=2 * 10)
    (note,) = [note for note in found.notes if note.name == "scattered"]
    assert note.where == (1, 25, 25)  # a mean pulse was fitted to two, of which one was 6 u off


def test_of_several_records_it_is_said_which_the_numbers_are_of(sample_data):
    found = SPIN.analyze([sample_data / "trace-tape"])
    (run,) = found.runs
    assert run.which == "record 3 of 5"
    assert (run.trend.value, run.trend.u) == pytest.approx((-0.0870, 0.00075), abs=5e-5)  # single ones: u of 0.4 Hz/s
    frequencies, pulses, _ = spin_tables(found)
    assert dict(zip(frequencies.heads, frequencies.rows[0].cells, strict=True))["of"] == "record 3 of 5"
    assert pulses.title.endswith("those of the one above")
    assert "28.111(31) Hz at 20.322 s, record 3 of 5. " in found.text
    assert "In the middle of all records its slope is −0.0870(8) Hz/s." in found.text
    part = spin_part(found)
    assert part.lead == "5 records used"
    assert "It loses 0.3094(28) % of its spin a second" in part.result[0].text
    assert next(iter(found.about_run(run))).startswith(
        "in all 5 records, as in record 1: the pulses come early or late"
    )


def test_each_finding_about_pulses_and_lines_has_a_sentence():
    source = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "analysis/pulses").glob("*.py"))
    made = set(re.findall(r'Finding\("([\w-]+)"', source)) | {"no-pulses", *get_args(Kind)}
    assert made == {name for name, _ in words._SENTENCES}


def test_the_time_that_is_said_moves_the_spin_by_less_than_its_u(tmp_path):
    times = np.arange(300.0) / 39.4
    times += 0.002 * times**2  # it slows by 0.16 Hz/s
    path = tmp_path / "pulses.csv"
    path.write_text("time_s\n" + "".join(f"{t:.9f}\n" for t in times), encoding="utf-8")
    found = SPIN.analyze([path])
    spin = found.runs[0].spin
    (said,) = re.findall(r" at ([\d.]+) s", in_a_sentence(found.runs[0]))
    assert abs((float(said) - spin.reference_time) * spin.chirp.value) < spin.frequency.u / 2
    assert len(said) < 14
    assert said in frequency_table(found).rows[0].cells


def test_a_spin_nearby_is_of_no_use_for_pulses_and_tables(tmp_path):
    wav = coasting_wav(tmp_path / "tape.wav", seconds=3)
    for name, path in (("spin", wav), ("spindown", spin_down_csv(tmp_path / "mine.csv"))):
        row = ANALYSES[name]
        assert words.NEAR_UNUSED in row.analyze([path], row.options_from({"near": 20.0})).all_warnings
