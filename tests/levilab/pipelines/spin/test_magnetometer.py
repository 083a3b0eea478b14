"""A phone's record through the analyses: its spin, its drag law, its limit, and what is in doubt."""

import importlib.util

import numpy as np
import pytest

from levilab.errors import DataError, DoesNotSuit
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import LimitOptions, SpinDownOptions, SpinOptions
from levilab.pipelines.spin.figure import spin_figure
from levilab.pipelines.spin.report import meaning
from levilab.pipelines.suits import analyze_suiting
from phone_records import synthetic_field, synthetic_flight
from support.figures import faults
from support.paths import ROOT


def phone(path, times, field):
    """Write a record as phyphox does."""
    titles = ["Time (s)", *(f"Magnetic Field {axis} (µT)" for axis in "xyz"), "Absolute field (µT)"]
    rows = np.column_stack([times, 1e6 * field, 1e6 * np.linalg.norm(field, axis=1)])
    head = ",".join(f'"{title}"' for title in titles)
    np.savetxt(path, rows, fmt="%.9E", delimiter=",", header=head, comments="", encoding="utf-8")
    return path


def said(found):
    return [text for group in found.grouped_warnings for text in group]


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    times, field, _ = synthetic_flight(np.random.default_rng(51), duration=170.0, up=(0.0, 163.2), start_hz=37.0)
    return phone(tmp_path_factory.mktemp("phone") / "long.csv", times, field)


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    return phone(tmp_path_factory.mktemp("phone") / "short.csv", *synthetic_field(np.random.default_rng(52)))


def test_a_phones_record_gives_spin_amplitudes_and_budget(short):
    found = ANALYSES["spin"].analyze([short])
    (run,) = found.runs
    assert abs(run.spin.frequency.value - 31.0) < 4 * run.spin.frequency.u
    values = ANALYSES["spin"].document(found, short.parent)["values"]
    assert values["amplitude_1"]["value"] == pytest.approx(1e-6, rel=0.15)  # 6 dB over 0.5 µT: 6 u
    assert {one.name for budget in found.budget for one in budget.components} >= {"noise", "drag"}
    assert "clockwise" in " ".join(meaning(found))


def test_samples_that_an_app_writes_again_are_left_out(tmp_path):
    """Of a sensor read 50 times a second and written 100 times; with its repeats it has lines of both rates."""
    times, field = synthetic_field(np.random.default_rng(53))
    (run,) = ANALYSES["spin"].analyze([phone(tmp_path / "twice.csv", times, np.repeat(field[::2], 2, axis=0))]).runs
    assert 31.0 in {round(fold.frequency, 1) for fold in run.line.folds}
    (once,) = ANALYSES["spin"].analyze([phone(tmp_path / "once.csv", times[::2], field[::2])]).runs
    assert run.spin.frequency.value == pytest.approx(once.spin.frequency.value, abs=1e-9)


def test_a_field_at_rest_is_no_sample_written_again(tmp_path):
    _, field = synthetic_field(np.random.default_rng(54))
    field = np.vstack([field, np.repeat(field[-1:], 700, axis=0)])  # a coarse sensor, after the top was taken away
    found = ANALYSES["spin"].analyze([phone(tmp_path / "rest.csv", np.arange(len(field)) / 100, field)])
    assert not any("repeat the one before" in text for text in said(found))


def test_the_tilt_of_the_moment_follows_from_distance_and_moment(short):
    found = ANALYSES["spin"].analyze([short], SpinOptions(distance_m=0.2, moment_a_m2=0.714))
    (run,) = found.runs
    size = 1e-6 * np.sqrt(1 + 0.25 + 0.09)  # as the record was made, at the top's height: √5 μ₀m/4πr³
    assert run.transverse.value == pytest.approx(size * 0.2**3 / 1e-7 / np.sqrt(5), abs=3 * run.transverse.u)
    assert run.tilt.value == pytest.approx(np.arcsin(run.transverse.value / 0.714))


def test_a_long_record_gives_the_drag_law_and_the_limit(long):
    spindown = ANALYSES["spindown"].analyze([long])
    stokes = spindown.runs[0].fit("stokes").parameters["c1"]
    assert abs(stokes.value - 3.2e-3) < 4 * stokes.u
    limit = ANALYSES["limit"].analyze([long])
    truth = 37.0 * np.exp(-3.2e-3 * 163.2)
    assert limit.sources[0].readings.limit == pytest.approx([truth], abs=4 * limit.sources[0].readings.u[0])


def test_a_top_that_is_stopped_by_hand_shows_no_lower_limit(tmp_path):
    stopped = synthetic_flight(np.random.default_rng(58), duration=60.0, up=(0.0, 40.0), start_hz=42.0)
    path = phone(tmp_path / "stopped.csv", *stopped[:2])
    with pytest.raises(DoesNotSuit, match=r"1 of 1 tops are lost at 37 Hz or above and are left out"):
        ANALYSES["limit"].analyze([path])
    assert [analysis.name for analysis, _ in analyze_suiting([path], {})] == ["spindown", "spin"]
    rising = synthetic_flight(np.random.default_rng(58), duration=60.0, up=(0.0, 40.0), start_hz=36.0, loss=-2e-3)
    limit = ANALYSES["limit"].analyze([phone(tmp_path / "rising.csv", *rising[:2])]).sources[0].readings.limit
    assert limit == pytest.approx([39.0], abs=0.1)  # that of a drive
    (file := tmp_path / "mine.csv").write_text("38.1\n37.9\n38\n", encoding="utf-8")
    found = ANALYSES["limit"].analyze([file])
    assert "Hz above it, more than a tilt explains." in found.text
    assert "is no lower limit of a top: was it stopped, or held by a drive?" in found.doubts[0]


def test_a_spin_that_is_held_is_compared_with_the_drive(tmp_path, long):
    record = synthetic_flight(np.random.default_rng(57), duration=60.0, start_hz=31.0, loss=1e-9)[:2]
    path, locked = phone(tmp_path / "held.csv", *record), []
    for one, hertz in ((long, 29.0), (path, 31.03), (path, 31.0)):  # the long one falls from 37 to 22 Hz
        found = ANALYSES["spin"].analyze([one], SpinOptions(drive=hertz))
        locked.append("The top is locked to the drive" in found.text)
    off = ANALYSES["spin"].document(found, tmp_path)["values"]["drive_offset"]
    assert abs(off["value"]) < 3 * off["u"] < 0.006  # six windows of 3.4 mHz
    assert locked == [False, False, True]


def test_a_tilt_that_the_readings_do_not_show_is_given_as_a_bound(long):
    text = ANALYSES["spindown"].analyze([long]).text
    assert "do not make certain that the moment of the top is tilted against its axis: it is by less than" in text


@pytest.mark.parametrize(("name", "options"), [("spindown", SpinDownOptions), ("limit", LimitOptions)])
def test_the_spin_that_is_searched_can_be_chosen_in_each_analysis(name, options, long):
    assert ANALYSES[name].analyze([long], options(near=36.0)).runs
    with pytest.raises(DataError, match=r"from 49\.5 to 60\.5 Hz"):
        ANALYSES[name].analyze([long], options(near=55.0))


def test_a_record_suits_the_analyses_that_find_something_in_it(long, short):
    assert [analysis.name for analysis, _ in analyze_suiting([long], {})] == ["spindown", "spin", "limit"]
    assert [analysis.name for analysis, _ in analyze_suiting([short], {})] == ["spin"]


def test_a_spin_that_may_be_folded_is_named_with_its_choices(tmp_path):
    made = synthetic_field(np.random.default_rng(53), frequency=61.0, chirp=0.0, jitter=0.0)
    path = phone(tmp_path / "even.csv", *made)
    found = ANALYSES["spin"].analyze([path])
    assert " or " in found.text
    assert any("39.00" in text and "61.00" in text for text in said(found))
    chosen = ANALYSES["spin"].analyze([path], SpinOptions(near=60.0))
    assert chosen.runs[0].spin.frequency.value == pytest.approx(61.0, abs=0.02)
    assert not any("fold" in text for text in said(chosen))


def test_a_field_too_strong_for_a_phone_is_in_another_unit(tmp_path):
    times, field = synthetic_field(np.random.default_rng(54))
    path = tmp_path / "bare.csv"
    np.savetxt(path, np.column_stack([times, 1e6 * field]), delimiter=",", header="t,Bx,By,Bz", comments="")
    found = ANALYSES["spin"].analyze([path])
    assert any("[µT]" in text for text in said(found))
    assert abs(found.runs[0].spin.frequency.value - 31.0) < 5 * found.runs[0].spin.frequency.u


def test_times_that_go_back_are_refused_with_their_line(tmp_path):
    times, field = synthetic_field(np.random.default_rng(55))
    path = phone(tmp_path / "twice.csv", np.concatenate([times, times]), np.concatenate([field, field]))
    with pytest.raises(DataError, match="line 1002"):
        ANALYSES["spin"].analyze([path])


@pytest.mark.parametrize("name", ["short", "long"])
def test_the_figure_of_a_phones_record_has_no_faults(name, request):
    assert not faults(spin_figure(ANALYSES["spin"].analyze([request.getfixturevalue(name)])))


def test_the_sample_record_is_made_by_its_script_and_gives_the_tilt(sample_data):
    path = sample_data / "phone" / "magnetometer.csv"
    made = importlib.util.spec_from_file_location("phone", ROOT / "sample_data" / "phone.py")
    module = importlib.util.module_from_spec(made)
    made.loader.exec_module(module)
    ours = np.loadtxt(module.make().splitlines(), delimiter=",", skiprows=1)
    kept = np.loadtxt(path, delimiter=",", skiprows=1, encoding="utf-8")
    np.testing.assert_allclose(kept, ours, rtol=1e-8)  # its last digits depend on the processor
    run = ANALYSES["spin"].analyze([path], SpinOptions(distance_m=0.2, moment_a_m2=0.714)).runs[0]
    assert abs(run.tilt.value - 0.03) < 3 * run.tilt.u
    spin = 40.0 * (1 + 2.34e-4 * np.sqrt(2 * np.pi * 40) * run.series.time / 2) ** -2  # of a laminar disc
    assert np.all(np.abs(run.series.frequency - spin) < 4 * run.series.u)
