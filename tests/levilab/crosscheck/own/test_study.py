"""The cross-check with a result's own parameters: right for right analyses, the same each time, kept beside the run."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from analysis.uncertainty import student
from levilab.crosscheck.own.model import Own
from levilab.crosscheck.own.study import ENOUGH, FEWEST, OWN, TRIALS, seed_of, study_result, trials_of_report
from levilab.crosscheck.stored import file_of, read_study, store
from levilab.crosscheck.study import Spread, Verdict
from levilab.crosscheck.subject import Trial
from levilab.crosscheck.table import as_text, crosscheck_table
from levilab.errors import DataError
from levilab.pipelines.catalogue import ANALYSES
from levilab.present.document.blocks import Paragraph, Warnings
from levilab.report.document import document_of
from levilab.report.reproduction import Asked
from support.paths import ROOT, SAMPLE_DATA

CHEAP = (
    ("precession", "precession-sweep"),
    ("limit", "upper-limits"),
    ("spin", "trace-tape"),
    ("spin", "phone/magnetometer.csv"),
)


def result(name, *paths):
    row = ANALYSES[name]
    return row.analyze(list(paths))


@pytest.mark.parametrize(("name", "sample"), CHEAP)
def test_estimates_and_uncertainties_are_right_for_the_samples(sample_data, name, sample):
    found = study_result(name, result(name, sample_data / sample), {}, 150)
    assert found.holds, as_text(found)
    assert {one.n for one in found.spreads} == {150}
    assert not found.failures


@pytest.fixture(scope="module")
def runs():
    return result("spindown", ROOT / "sample_data/spin-down-1", ROOT / "sample_data/spin-down-2")


def test_a_mean_of_several_runs_has_trials_that_differ_as_the_runs_do(runs):
    own = OWN["spindown"](runs)
    assert own.law == "disc"
    means = [own.trial(np.random.default_rng(k)) for k in range(6)]
    c = np.array([trial.pulls[0].estimate for trial in means])
    u = runs.combined.fit("disc").constants["c32"].u
    assert np.std(c, ddof=1) > 0.3 * u  # each run's own readings would give a twelfth
    assert all(trial.law for trial in means)
    assert [pull.quantity for pull in means[0].pulls] == ["c32_of_one_run"] * 2 + ["c32", "exponent"]
    ones = np.array([pull.value for trial in means for pull in trial.pulls[:2]])
    assert np.std(ones) == pytest.approx(1, abs=0.65)  # 3 standard errors from 12


@pytest.mark.parametrize(
    ("cost_s", "trials"), [(1e-4, TRIALS), (0.02, 100), (0.13, ENOUGH), (0.3, 13), (0.8, FEWEST), (0.9, 0)]
)
def test_a_report_makes_as_many_trials_as_it_has_time_for(cost_s, trials):
    """Four runs of 20 readings cost 0.04 s, with the tilt 0.13 s."""
    assert trials_of_report(Own("", lambda _: Trial([]), cost_s)) == trials


def test_the_cost_of_a_spin_down_grows_with_its_runs_and_its_tilt(runs, monkeypatch):
    two = OWN["spindown"](runs)
    monkeypatch.setattr("analysis.spindown.lawfit.LawFit.has_tilt", True)
    tilted = OWN["spindown"](runs)
    assert FEWEST < trials_of_report(tilted) < trials_of_report(two) / 2


def test_one_spin_down_and_one_scan_come_to_their_own_values(sample_data):
    spin_down = study_result("spindown", result("spindown", sample_data / "spin-down-3"), {}, 6)
    assert [one.quantity for one in spin_down.spreads] == ["c32", "start_frequency", "exponent"]
    assert spin_down.laws.get("disc", 0) >= 3
    assert spin_down.excluded == 0
    scan = study_result("field", result("field", sample_data / "field-scan"), {}, 12)
    assert [one.quantity for one in scan.spreads] == ["strength", "origin", "thickness", "background"]
    assert max(abs(value) for one in [*spin_down.spreads, *scan.spreads] for value in one.pulls) < 5


def test_the_same_readings_have_the_same_trials_and_others_have_others(sample_data):
    found = result("limit", sample_data / "lower-limits")
    assert study_result("limit", found, {}, 20) == study_result("limit", found, {}, 20)
    assert seed_of("limit", ["a"]) != seed_of("limit", ["b"])


def spread(mean, deviation, n=400):
    z = np.random.default_rng(5).standard_normal(n)
    return Spread("x", tuple(mean + deviation * (z - z.mean()) / z.std(ddof=1)), 0.1)


def test_a_bias_and_a_u_that_is_too_small_are_noticed_and_a_u_too_large_is_named():
    assert spread(0.0, 1.0).verdict is Verdict.RIGHT
    assert spread(0.4, 1.0).verdict is spread(-0.4, 1.0).verdict is Verdict.WRONG
    assert spread(0.0, 1.4).verdict is Verdict.WRONG
    assert spread(0.0, 0.5).verdict is Verdict.TOO_LARGE


@pytest.mark.parametrize("freedom", [None, 12])
def test_chance_condemns_one_right_quantity_of_a_hundred(freedom):
    random = np.random.default_rng(8)
    draws = random.standard_normal((2000, 60)) if freedom is None else random.standard_t(freedom, (2000, 60))
    verdicts = [Spread("x", tuple(pulls), freedom=freedom).verdict for pulls in draws.tolist()]
    # a bound, not a rate: three numbers that hang together; with 60 pulls a deviation is skew, so up to twice as often
    assert sum(one is Verdict.WRONG for one in verdicts) <= 2000 * 0.02


def test_pulls_of_few_pulses_are_compared_with_students_law():
    t = np.random.default_rng(6).standard_t(9, 4000) / student(9)  # u with Student's factor
    pulls = Spread("x", tuple(t), widened=9)
    assert pulls.coverage == pytest.approx(0.683, abs=0.022)  # 3 standard errors
    assert pulls.deviation == pytest.approx(pulls.wanted_deviation, abs=3 * pulls.u_deviation)
    assert pulls.verdict is Verdict.RIGHT
    assert replace(pulls, widened=None).verdict is Verdict.WRONG
    assert replace(pulls, pulls=tuple(1.1 * t)).verdict is Verdict.WRONG


def test_a_record_of_few_pulses_says_by_how_much_pulls_scatter(sample_data):
    checked = study_result("spin", result("spin", sample_data / "trace-laser"), {}, 150)
    # 19 pulses, four coefficients; the noise counts for nothing
    assert [one.widened for one in checked.spreads] == pytest.approx([15, 15], abs=0.3)
    assert checked.holds
    assert "pulls have a standard deviation of 1.04" in as_text(checked)
    # single bends that were not fitted made it 1.3 to 1.5, single records at half the frequency 1000
    assert {round(one.deviation, 1) for one in checked.spreads} <= {0.9, 1.0, 1.1}


def test_the_table_says_what_is_wanted_of_each_row(runs):
    found = study_result("spindown", runs, {}, 6)
    # two runs that differ by more than their readings explain
    assert [one.freedom for one in found.spreads] == [None, 1, None]
    one_run, together, exponent = (row.cells for row in crosscheck_table([found]).rows)
    assert one_run[4].endswith(" (1)")
    assert one_run[5].endswith(" % (68 %)")
    assert together[4].endswith(" (not judged)")
    assert together[5].endswith(" % (50 %)")  # Student's t with one degree of freedom: 2 arctan(1)/π
    assert exponent[5].endswith(" % (68 %)")
    assert "Student's t with 1 degree of freedom has no finite standard deviation" in as_text(found)
    few, many = (
        replace(found, spreads=tuple(replace(one, freedom=n if one.freedom else None) for one in found.spreads))
        for n in (6, 20)
    )
    assert "Student's t with 6 degrees of freedom has long tails" in as_text(few)
    assert "not judged" not in as_text(many)


@pytest.mark.parametrize(
    ("of_trial", "said", "begins"),
    [
        ((0, 0.5), r"mean scatters by 2\.\d times its u", True),
        ((-0.6, 1), r"mean comes out 0\.\d u too small on average", False),
        ((1.5, 1), r"mean comes out 1\.\d u too large on average", True),
        ((-0.3, 0.5), r"mean comes out 0\.\d u too small on average and mean scatters by 2\.\d times its u", True),
    ],
)
def test_a_wrong_analysis_is_named_with_its_size(monkeypatch, tmp_path, of_trial, said, begins):
    """Above the answer only where that misleads."""
    bias, part = of_trial

    def off(random):
        trial = real.trial(random)
        return Trial([replace(one, estimate=one.estimate + bias * one.u, u=one.u * part) for one in trial.pulls])

    shutil.copytree(SAMPLE_DATA / "lower-limits", tmp_path / "run")
    found = result("limit", tmp_path / "run")
    real = OWN["limit"](found)
    monkeypatch.setattr("levilab.crosscheck.own.study.OWN", {"limit": lambda _: Own("wrong", off, 0.001)})
    checked = study_result("limit", found, (row := ANALYSES["limit"]).settings_of(found), 100)
    assert not checked.holds
    (said,) = re.findall(rf"In simulated readings like these {said}\.", as_text(checked))
    for stored in (False, True):
        for short in (False, True):
            result_first, *_ = document_of([(row, found)], (), Asked(short=short, crosscheck=False)).blocks
            assert (result_first.blocks[0] == Warnings(((said,),))) is (stored and begins)
            assert (result_first.blocks[-1] == Paragraph(said)) is (stored and not begins)
        store([checked], found.place)
    assert crosscheck_table([checked]).rows[0].cells[-1] == "NO"


def test_trials_are_kept_beside_the_run_and_read_for_just_this_result(sample_data, tmp_path):
    shutil.copytree(sample_data / "lower-limits", tmp_path / "run")
    row, found = ANALYSES["limit"], result("limit", tmp_path / "run")
    settings = row.settings_of(found)
    checked = study_result("limit", found, settings, 10)
    store([checked], found.place)
    file = file_of(found.place)
    assert file == tmp_path / "run" / "crosscheck.json"
    assert json.loads(file.read_text(encoding="utf-8"))["schema"] == "levilab-crosscheck/1"
    inputs = list(checked.inputs)
    assert read_study(found.place, "limit", inputs, settings) == checked
    assert read_study(found.place, "limit", ["other readings"], settings) is None
    assert read_study(found.place, "limit", inputs, settings | {"reading_u_hz": 0.1}) is None
    file.write_text('{"schema": "levilab-crosscheck/1", "checks": [{}]}', encoding="utf-8")
    with pytest.raises(DataError, match=r"crosscheck\.json.*--like"):
        read_study(found.place, "limit", inputs, settings)
    file.write_text('{"schema": "another program\'s"}', encoding="utf-8")
    assert read_study(found.place, "limit", inputs, settings) is None
