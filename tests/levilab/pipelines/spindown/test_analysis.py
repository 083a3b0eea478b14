"""From paths to results: what is found, what is refused, and that the numbers are the published ones."""

import json
import os
import re
import runpy
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.spindown.drag import LAWS
from levilab.errors import DataError, LevilabError
from levilab.files import CannotWrite
from levilab.formats.columns import NoSuchColumn
from levilab.formats.device import Device
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.spindown.figure import _finding as finding_of
from levilab.pipelines.spindown.figure import spindown_figure
from levilab.pipelines.spindown.readings import read_spin_file
from levilab.pipelines.spindown.report import meaning, spindown_part, spindown_tables
from levilab.pipelines.spindown.words import doubts_about_law
from levilab.pipelines.suits import save
from levilab.present.document.blocks import Tabular
from levilab.runs.run import Run
from levilab.texts.text import in_language, text_of
from support.paths import SAMPLE_DATA
from support.spin_downs import spin_down_csv

#: The thesis's constants, as printed: C₁ [1/s], |C₂| [1/rad].
PUBLISHED = (("0.003199", "1.760e-05"), ("0.003134", "1.707e-05"), ("0.003133", "1.669e-05"), ("0.003261", "1.772e-05"))


@pytest.fixture(scope="module")
def four():
    """What is found in the four sample runs."""
    return SPINDOWN.analyze([SAMPLE_DATA])


def test_the_straight_lines_give_the_published_constants_to_every_printed_digit(four):
    constants = [
        (run.fit("stokes").linearised["c1"].value, run.fit("newton").linearised["c2"].value) for run in four.runs
    ]
    assert tuple((f"{c1:.6f}", f"{c2:.3e}") for c1, c2 in constants) == PUBLISHED
    assert f"{np.mean([c1 for c1, _ in constants]):.8f}" in {"0.00318175", "0.00318176", "0.00318174"}


def _words(path):
    """Return what stands between separators, whatever git does to line ends."""
    return re.split(rb"[\s,\[\]{}]+", path.read_bytes())


def test_the_sample_data_are_what_their_script_makes(sample_data, tmp_path, monkeypatch):
    script = tmp_path / "make.py"
    script.write_text((sample_data / "make.py").read_text(encoding="utf-8"), encoding="utf-8")
    make = runpy.run_path(str(script))
    make["TRACES"].pop("trace-laser")  # made in the same way, and the simulator takes its time
    make["main"]()
    for made in sorted(path for path in tmp_path.glob("[!t]*/**/*") if path.is_file()):
        shipped = sample_data / made.relative_to(tmp_path)
        for one, other in zip(_words(made), _words(shipped), strict=True):
            # another processor may round a sum otherwise, and a voltage to the code beside
            assert one == other or float(one) == pytest.approx(float(other), rel=1e-12), (made, one, other)
    made_traces, shipped_traces = (Run.load(folder / "trace-tape").traces() for folder in (tmp_path, sample_data))
    for one, other in zip(made_traces, shipped_traces, strict=True):
        assert np.abs(one.trace.codes.astype(int) - other.trace.codes.astype(int)).max() <= 1


def test_the_sample_traces_are_small_and_labelled_synthetic(sample_data):
    for name in ("trace-tape", "trace-laser"):
        run = Run.load(sample_data / name)
        assert run.record.synthetic
        assert run.record.note.startswith("SYNTHETIC")
        assert len(run.traces()) >= 5
        assert sum(path.stat().st_size for path in (sample_data / name).rglob("*") if path.is_file()) < 200_000


def test_the_four_runs_exclude_stokes_and_newton_and_favour_the_disc(four):
    combined = four.combined
    lines = spindown_tables(four)[-1]
    assert [row.kind for row in lines.rows] == ["", "", "", "", "together", "together"]
    tables = [block for block in spindown_part(four).result if isinstance(block, Tabular)]
    (laws,) = (one.table for one in tables if one.name == "spindown-laws")
    cells = {row.cells[0]: row.cells[2] for row in laws.rows}
    assert re.fullmatch(r"5\.\d\(2\.\d\)×10⁻⁶ .*", cells["disc (best)"]), cells  # as below; u of it: s/√(2·3)
    assert combined.best == "disc"
    assert set(combined.verdict.excluded) == {"stokes", "newton"}
    disc = combined.fit("disc").constants["c32"]
    # refit of the published pairs (PHYSICS.md §5): 2.365, 2.309, 2.289, 2.397e-4
    assert disc.value == pytest.approx(np.mean([2.365e-4, 2.309e-4, 2.289e-4, 2.397e-4]), rel=3e-3)
    assert disc.scatter == pytest.approx(np.std([2.365, 2.309, 2.289, 2.397], ddof=1) * 1e-4, rel=0.15)
    assert disc.u == pytest.approx(disc.scatter / 2, rel=1e-9)


@pytest.mark.usefixtures("drawn_figures")
def test_the_result_is_written_as_the_interface_says(four, tmp_path):
    save(ANALYSES["spindown"], four, tmp_path)
    text = (tmp_path / "result.json").read_text(encoding="utf-8")
    result = json.loads(text, parse_constant=pytest.fail)
    assert list(result) == sorted(result)
    assert result["synthetic"] is True
    assert len(result["inputs"]) == len(result["runs"]) == 4
    assert (tmp_path / result["inputs"][0]["path"]).is_file()
    assert [model["name"] for model in result["models"]] == [*LAWS]
    run = result["runs"][0]
    assert set(run) >= {"path", "values", "models", "best_model", "warnings"}
    for model in run["models"]:
        assert set(model["parameters"]) >= {"start_frequency"}
        assert set(model["statistics"]) == {
            "n", "degrees_of_freedom", "rms_residual", "reduced_chi_square", "aicc", "bic", "weight", "durbin_watson",
            "runs_test_p", "difference",
        }  # fmt: skip
    assert run["models"][0]["linearised"]["c1"]["unit"] == "1/s"
    assert set(result["models"][2]["parameters"]) == {"c32"}
    assert (tmp_path / "spindown.png").stat().st_size > 10_000


def test_one_run_has_its_start_and_covariance_at_the_top(sample_data):
    analysis = SPINDOWN.analyze([sample_data / "spin-down-1"])
    result = ANALYSES["spindown"].document(analysis, analysis.output_folder)
    disc = next(model for model in result["models"] if model["name"] == "disc")
    assert set(disc["parameters"]) == {"start_frequency", "c32"}
    assert np.array(disc["covariance"]).shape == (2, 2)
    assert disc["covariance"][1][1] == pytest.approx(disc["parameters"]["c32"]["u"] ** 2)
    assert result["inputs"][0]["path"] == "readings.csv"


def test_a_plain_csv_is_analyzed_and_knows_nothing_of_synthetic(tmp_path):
    analysis = SPINDOWN.analyze([spin_down_csv(tmp_path / "my.csv")], SpinDownOptions(tilt="none"))
    result = ANALYSES["spindown"].document(analysis, analysis.output_folder)
    assert analysis.output_folder == tmp_path
    assert (result["synthetic"], result["best_model"]) == (False, "disc")
    assert result["values"]["c32"]["value"] == pytest.approx(2.34e-4, abs=4 * result["values"]["c32"]["u"])


def test_the_readings_of_a_run_are_that_run_and_as_synthetic(sample_data, tmp_path):
    (source,) = SPINDOWN.analyze([sample_data / "spin-down-1" / "readings.csv"]).sources
    assert source.synthetic
    shutil.copytree(sample_data / "spin-down-1", tmp_path / "broken")
    (tmp_path / "broken" / "run.json").write_text("{", encoding="utf-8")
    (source,) = SPINDOWN.analyze([tmp_path / "broken" / "readings.csv"]).sources
    assert any("whether it is SYNTHETIC is not known" in warning for warning in source.warnings)


def test_real_and_synthetic_inputs_together_are_warned_of(sample_data, tmp_path):
    path = spin_down_csv(tmp_path / "my.csv")
    analysis = SPINDOWN.analyze([path, sample_data / "spin-down-1"])
    assert "1 of 2 inputs are SYNTHETIC" in analysis.warnings[0]
    assert analysis.output_folder == Path()


def test_inputs_of_the_same_name_have_their_folders_in_it(tmp_path):
    for k, folder in enumerate(("monday", "tuesday")):
        (tmp_path / folder).mkdir()
        spin_down_csv(tmp_path / folder / "run.csv", seed=k)
    paths = [tmp_path / "monday" / "run.csv", Path(os.path.relpath(tmp_path / "tuesday" / "run.csv"))]
    analysis = SPINDOWN.analyze(paths)
    assert [source.name for source in analysis.sources] == ["monday/run.csv", "tuesday/run.csv"]


@pytest.mark.parametrize(("unit", "factor"), [("rpm", 60), ("rad/s", 2 * np.pi), ("°/s", 360)])
def test_another_unit_taken_for_hertz_is_doubted(tmp_path, unit, factor):
    path = spin_down_csv(tmp_path / "my.csv", u=False)
    t, nu = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    np.savetxt(path, np.c_[t, factor * nu], delimiter=",", header="t,f", comments="")
    with pytest.raises(NoSuchColumn) as error:
        SPINDOWN.analyze([path])
    assert error.value.doubt.choices[0].columns == {"t": "1", "f": f"2 [{unit}]"}
    np.savetxt(path, np.c_[t, factor * nu], delimiter=",", header="t,f [Hz]", comments="")
    found = SPINDOWN.analyze([path])  # stated: a note
    (source,) = found.sources
    assert source.readings.doubtful
    assert found.text == "The unit comes first: laws are compared once it is known."  # and no "fits best … known to"
    (table,) = spindown_tables(found)  # without constants
    assert "undecided" in table.rows[0].cells
    document = SPINDOWN.document(found, tmp_path)
    assert (document["values"], document["models"], document["decided"]) == ({}, [], False)
    assert f"f=2 [{unit}]" in source.warnings[0]
    assert "describes" not in finding_of(found)  # nor has the figure
    assert not spindown_part(found).result
    assert not [line for axes in spindown_figure(found).axes for line in axes.lines if len(line.get_xdata()) == 200]
    stated = SPINDOWN.analyze([path], SpinDownOptions(columns={"t": "t", "f": f"f [{unit}]"}))
    assert stated.runs[0].frequency[0] == pytest.approx(40, abs=0.1)
    assert not stated.sources[0].readings.doubtful


def test_what_was_known_beforehand_is_marked_and_no_law_wins_by_as_many_constants_as_readings(tmp_path):
    t, nu = np.loadtxt(spin_down_csv(tmp_path / "my.csv", u=False), delimiter=",", skiprows=1, unpack=True)
    np.savetxt(tmp_path / "few.csv", np.c_[t, nu][[0, len(t) // 2, -1]], delimiter=",", header="t,f", comments="")
    found = SPINDOWN.analyze([tmp_path / "few.csv"], SpinDownOptions(reading_u=0.02, tilt="none"))
    assert len(found.runs[0].time) == 3
    assert {"mixed", "power"} <= set(found.combined.verdict.needless)
    assert "mixed" not in found.text  # three constants fit any three readings
    shown = spindown_tables(SPINDOWN.analyze([tmp_path / "my.csv"], SpinDownOptions(tilt="fitted")))
    cells = " ".join(str(cell) for table in shown for row in table.rows for cell in row.cells)
    assert "Hz (prior)" in cells


@pytest.mark.parametrize(("u", "compared"), [(0.001, "BIC compares the laws"), (None, "to compare mixed, power, ")])
def test_few_readings_are_compared_as_their_note_says(tmp_path, u, compared):
    """Exact falls of the disc law: their verdict excludes laws where u is stated alone, and the note says by what."""
    t = np.array([0.0, 30.0, 60.0, 90.0])
    path = tmp_path / "four.csv"
    np.savetxt(path, np.c_[t, 39.93 / (1 + 1.87e-3 * t) ** 2], fmt="%.3f", delimiter=",", header="t,f", comments="")
    found = SPINDOWN.analyze([path], SpinDownOptions(reading_u=u))
    assert ("exclude" in found.text) == (u is not None)
    (note,) = (note for note in found.all_warnings if "4 readings are too few" in note)
    assert compared in note
    assert any("1.3 u to each side (Student's t)" in note for note in found.all_warnings) == (u is None)


def test_hertz_taken_for_another_unit_are_doubted(tmp_path):
    path = spin_down_csv(tmp_path / "my.csv", u=False)
    path.write_text(path.read_text("utf-8").replace(path.read_text("utf-8").split("\n", 1)[0], "time,speed"), "utf-8")
    for unit in ("rpm", "rad/s", "°/s"):
        (source,) = SPINDOWN.analyze([path], SpinDownOptions(columns={"f": f"speed [{unit}]"})).sources
        assert source.readings.doubtful
        assert "f=2 [Hz]" in source.warnings[0]
    (right,) = SPINDOWN.analyze([path], SpinDownOptions(columns={"f": "speed [Hz]"})).sources
    assert not right.warnings


def test_a_run_whose_unit_is_in_doubt_stays_out_of_the_means(four, sample_data, tmp_path):
    path = spin_down_csv(tmp_path / "my.csv", u=False)
    t, nu = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    np.savetxt(path, np.c_[t, 360 * nu], delimiter=",", header="t,f [Hz]", comments="")
    both = SPINDOWN.analyze([sample_data, path])
    assert both.combined.fit("disc").constants == four.combined.fit("disc").constants
    assert len(both.runs) == len(four.runs) + 1
    assert any("my" in warning for warning in both.about_all())


def test_a_run_that_no_law_describes_is_named_and_in_no_verdict_and_no_mean(tmp_path):
    good = [spin_down_csv(tmp_path / f"{k}.csv", seed=k) for k in (1, 2)]
    alone = SPINDOWN.analyze(good)
    for many in (1, 3):  # most of the runs, too
        odd = [spin_down_csv(tmp_path / f"odd{k}.csv", seed=k, jump=3.0) for k in range(many)]
        found = SPINDOWN.analyze([*odd, *good])
        assert found.combined == alone.combined
        assert (found.text, meaning(found)) == (alone.text, meaning(alone))
        assert found.budget == alone.budget != ()
        assert all(
            re.match(r"odd\d.csv: no law describes the readings: they rise by 3.* Hz", one) for one in found.doubts
        )
        assert len(found.doubts) == many
        assert "verdict and means leave out odd0.csv" in " ".join(found.about_all())
        assert finding_of(found).startswith("Spin-down of 2 runs: ")
        assert spindown_figure(found).axes[2].get_ylim()[1] < 1  # of readings less the law
    (doubt,) = SPINDOWN.analyze(odd[:1]).doubts
    assert in_language(doubt, "de").startswith("kein Gesetz beschreibt die Messwerte: Sie steigen zwischen ")


def test_a_change_counts_once_for_each_run_beside_it(tmp_path):
    runs = list(SPINDOWN.analyze([spin_down_csv(tmp_path / f"{k}.csv", seed=k) for k in range(3)]).runs)
    change = replace(runs[0].verdict.change, p=5e-4)  # alone below 0.001, among three by chance
    runs[0] = replace(runs[0], verdict=replace(runs[0].verdict, change=change))
    assert [len([*doubts_about_law(runs[0], many)]) for many in (1, 3)] == [1, 0]
    first, last = runs[0].frequency[[5, 9]]  # beyond a law that rises meanwhile they fall by more than they do
    change = replace(change, first=5, last=9, size=-25.0)
    (doubt,) = doubts_about_law(replace(runs[0], verdict=replace(runs[0].verdict, change=change)), 1)
    assert f"they fall by {first - last:.2g} Hz beyond each law" in doubt


@pytest.mark.parametrize(
    ("between", "size", "whole_ms", "cause"),
    [
        ((5, 6), -1.0, False, "as where a row was missed and the times were numbered on, or"),
        ((1, 3), 1.0, False, "as of a top that is still driven or held, or"),
        ((9, 12), 1.0, False, "as of a top that was spun again or touched"),
        ((5, 6), -1.0, True, "as of periods that are counted in whole milliseconds"),
    ],
)
def test_a_change_has_the_causes_that_fit_it(between, size, whole_ms, cause, tmp_path):
    run = SPINDOWN.analyze([spin_down_csv(tmp_path / "a.csv", jump=3.0)]).runs[0]
    change = replace(run.verdict.change, first=between[0], last=between[1], size=size)
    if whole_ms:
        run = replace(run, frequency=1e3 / np.round(1e3 / run.frequency))
    (doubt,) = doubts_about_law(replace(run, verdict=replace(run.verdict, change=change)), 1)
    assert cause in doubt


@pytest.mark.parametrize(("first", "option"), [(7, {"start_s": 50732.8}), (9, {"stop_s": 50734.7})])
def test_a_doubt_about_a_bend_advises_the_part_with_more_readings_to_its_last_one(first, option, tmp_path):
    run = SPINDOWN.analyze([spin_down_csv(tmp_path / "a.csv", jump=3.0)]).runs[0]
    change = replace(run.verdict.change, first=first, last=first + 1)
    late = replace(run, time=50717.6 + 1.9 * np.arange(20), verdict=replace(run.verdict, change=change))
    (doubt,) = doubts_about_law(late, 1)
    assert doubt.options == pytest.approx(option)


@pytest.mark.parametrize(
    ("factor", "mistake"),
    [
        (10, "tenths of a second that are taken for seconds. If the times are right, a drive pushes"),
        (1 / 10, "numbers of readings, 10 s apart, that are taken for seconds. If the times are right, more than air"),
        (1 / 24, "a spreadsheet's days that are taken for hours. If"),
    ],
)
def test_a_drag_that_no_air_has_is_doubted_and_left_out_of_means(factor, mistake, tmp_path):
    good, odd = (spin_down_csv(tmp_path / name) for name in ("good.csv", "odd.csv"))
    time, count, u = np.loadtxt(good, delimiter=",", skiprows=1, unpack=True)
    rows = np.column_stack([factor * time, count, u])
    np.savetxt(odd, rows, delimiter=",", header="time_s,spin_frequency_hz,spin_frequency_u_hz", comments="")
    (doubt,) = SPINDOWN.analyze([odd]).doubts
    assert mistake in doubt
    assert "Faktor von etwa" in in_language(doubt, "de")
    assert "von Kármán for" not in " ".join(meaning(SPINDOWN.analyze([odd])))
    both = SPINDOWN.analyze([good, odd])
    assert both.combined == SPINDOWN.analyze([good]).combined
    assert "verdict and means leave out odd.csv" in " ".join(both.about_all())


def test_a_drag_that_readings_do_not_tell_is_doubted(tmp_path):
    count = 35 - 0.02 * np.arange(12) + 0.5 * np.tile([1, -1], 6)
    rows = np.column_stack([np.arange(12), count, np.full(12, 0.5)])
    np.savetxt(path := tmp_path / "my.csv", rows, delimiter=",", header="t [s],f [Hz],u [Hz]", comments="")
    assert [doubt.kind for doubt in SPINDOWN.analyze([path]).doubts] == ["drag"]


def test_the_drag_is_compared_with_a_disc_of_the_top_in_the_devices_file(tmp_path):
    path = spin_down_csv(tmp_path / "my.csv")
    part = {"name": "disc", "mass_kg": 0.1, "outer_radius_m": 0.014, "height_m": 0.005}  # C of 0.18 times the thesis's
    heavy = Device.model_validate({"top": {"parts": [part]}})
    analysis = SPINDOWN.analyze([path], SpinDownOptions(device=heavy))
    assert analysis.doubts == []
    assert "as large as this top, 0.3526×10⁻⁴" in meaning(analysis)[0]
    for top in (
        {"magnet_radius_m": 0.03, "magnet_height_m": 0.01},
        {"inertia_transverse_kg_m2": 5e-6, "inertia_axial_kg_m2": 9e-6},
    ):  # of a larger top R⁴ and I₃ are larger
        half_known = SPINDOWN.analyze([path], SpinDownOptions(device=Device.model_validate({"top": top})))
        assert half_known.doubts == []
        assert "as large as the thesis's top, 2.235×10⁻⁴" in meaning(half_known)[0]


def test_a_speed_without_unit_may_be_in_hertz_or_turns_per_minute(tmp_path):
    path = tmp_path / "speed.csv"
    path.write_text("time,speed\n0,39.9\n10,38\n20,36\n30,34\n", "utf-8")
    with pytest.raises(DataError, match=r"'speed' has the values 39.9 to 34 and no unit: Hz .* or rpm\? say"):
        SPINDOWN.analyze([path])


def test_a_stated_reading_uncertainty_takes_the_place_of_the_scatter(tmp_path):
    path = spin_down_csv(tmp_path / "my.csv", u=False)
    without = SPINDOWN.analyze([path], SpinDownOptions(tilt="none")).runs[0].fit("disc")
    with_u = SPINDOWN.analyze([path], SpinDownOptions(reading_u=0.03, tilt="none")).runs[0].fit("disc")
    assert without.statistics.reduced_chi_square is None
    assert with_u.statistics.reduced_chi_square == pytest.approx(1, abs=1)
    ratio = without.parameters["c32"].u / with_u.parameters["c32"].u
    # what is stated counts as 8 readings beside the 18 that scatter; 0.15: u tells more of the correlation
    expected = with_u.statistics.reduced_chi_square / with_u.statistics.variance_factor
    assert ratio**2 == pytest.approx(expected, rel=0.15)


def test_in_a_searched_folder_what_is_broken_is_passed_over_and_told(sample_data, tmp_path):
    for name in ("spin-down-1", "spin-down-2", "lower-limits"):
        shutil.copytree(sample_data / name, tmp_path / name)
    (tmp_path / "spin-down-2" / "run.json").write_text("{", encoding="utf-8")
    analysis = SPINDOWN.analyze([tmp_path])
    assert [source.name for source in analysis.sources] == ["spin-down-1"]
    assert any("spin-down-2" in warning for warning in analysis.all_warnings)


def test_a_run_of_another_experiment_is_refused_by_name(sample_data):
    with pytest.raises(DataError, match="holds a limit run, spindown needs a spin run") as refused:
        SPINDOWN.analyze([sample_data / "lower-limits"])
    german = in_language(text_of(refused.value), "de")
    assert german.endswith("Art der Messung: Grenzmessung; spindown liest: Auslaufmessung")


def test_a_folder_without_a_spin_run_says_what_it_found(sample_data, tmp_path):
    shutil.copytree(sample_data / "lower-limits", tmp_path / "limits")
    with pytest.raises(DataError, match="found only 1 limit"):
        SPINDOWN.analyze([tmp_path])


@pytest.mark.usefixtures("undrawn_figures")
def test_a_folder_that_cannot_be_written_is_reported_in_one_line(four, tmp_path):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(CannotWrite, match="`out`") as caught:
        save(ANALYSES["spindown"], four, tmp_path / "file" / "below")
    assert isinstance(caught.value, LevilabError)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("factor", "unit"), [(1 / 60, "min"), (1000, "ms")])
def test_times_in_a_unit_that_no_fall_has_are_doubted_and_stay_out_of_means(tmp_path, factor, unit):
    seconds = np.arange(0, 190, 10.0)
    spin = (1 / np.sqrt(2 * np.pi * 40) + 2.34e-4 * seconds / 2) ** -2 / (2 * np.pi)
    file = tmp_path / "my.csv"
    rows = zip(seconds * factor, spin, strict=True)
    file.write_text("t [s],f\n" + "".join(f"{t:.5f},{f:.3f}\n" for t, f in rows), encoding="utf-8")
    readings = read_spin_file(file, SpinDownOptions())
    assert readings.doubtful
    assert f"t=1 [{unit}]" in readings.warnings[-1]
