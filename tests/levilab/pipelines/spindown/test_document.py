"""From result.json back to what was found: nothing is analyzed that has a result which holds."""

import json
import re
import shutil
from dataclasses import replace

import pytest

from analysis.spindown import drag
from analysis.spindown.drag import LAWS
from levilab.errors import DataError, UsageError
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.result import save
from levilab.pipelines.spindown.document import SPINDOWN
from support.equal import differences
from support.spin_downs import spin_down_csv

recall_spindowns = SPINDOWN.recall


@pytest.fixture
def fitted(monkeypatch):
    """Names of the inputs that `recall_spindowns` fits."""
    names = []

    def noted(source, options):
        names.append(source.path.name)
        return SPINDOWN.fit(source, options)

    row = replace(SPINDOWN, fit=noted)
    monkeypatch.setitem(globals(), "recall_spindowns", row.recall)
    return names


@pytest.fixture
def runs(tmp_path, sample_data):
    """A folder of four runs."""
    for k in range(1, 5):
        shutil.copytree(sample_data / f"spin-down-{k}", tmp_path / "runs" / f"run-{k}")
    return tmp_path / "runs"


def analyzed(*paths, **options):
    """The analysis, and its result.json; the figure takes longer than all the rest."""
    analysis = SPINDOWN.analyze(paths, SpinDownOptions(**options))
    save(SPINDOWN.result_of(analysis, analysis.place), analysis.place, picture=b"")
    return analysis


@pytest.mark.parametrize("options", [{}, {"tilt": "none"}, {"reading_u": 0.05}, {"keep_outliers": True}])
def test_one_run_is_recalled_to_the_last_bit(tmp_path, fitted, options):
    path = spin_down_csv(tmp_path / "my.csv")
    path.write_text(path.read_text(encoding="utf-8").replace("\n50.0,", "\n50.0,1"), encoding="utf-8")  # an outlier
    before = analyzed(path, **options)
    assert before.runs[0].outliers
    after = recall_spindowns([path], SpinDownOptions())
    assert fitted == []
    assert differences(after.runs, before.runs) == []
    assert after.all_warnings == before.all_warnings
    assert after.options == before.options


@pytest.mark.parametrize("n", [3, 4, 5, 7])
def test_results_that_lack_numbers_are_recalled_too(tmp_path, fitted, n):
    before = analyzed(spin_down_csv(tmp_path / "my.csv", n=n, u=n != 4))
    after = recall_spindowns([tmp_path / "my.csv"], SpinDownOptions())
    assert fitted == []
    assert before.all_warnings  # of what they cannot tell
    assert SPINDOWN.document(after, tmp_path) == SPINDOWN.document(before, tmp_path)


def test_what_is_shown_is_what_stands_in_the_result(tmp_path):
    """Not a number is computed again."""
    analyzed(spin_down_csv(tmp_path / "my.csv"))
    file = tmp_path / "my.csv.result.json"
    result = json.loads(file.read_text(encoding="utf-8"))
    result["combined"]["verdict"]["excluded"] = ["mixed"]
    result["runs"][0]["result"]["verdict"]["excluded"] = ["mixed"]
    constant = dict(result["runs"][0]["result"]["fits"][2]["parameters"])["c32"]
    constant |= {"value": 1.25e-4}
    file.write_text(json.dumps(result), encoding="utf-8")
    recalled = recall_spindowns([tmp_path / "my.csv"], SpinDownOptions())
    constant = recalled.runs[0].fit("disc").parameters["c32"]
    assert constant.value == 1.25e-4
    assert "exclude mixed" in recalled.text


def test_a_run_that_changed_is_analyzed_and_no_other(runs, fitted):
    before = analyzed(runs, tilt="none")
    readings = runs / "run-2" / "readings.csv"
    readings.write_text("\n".join(readings.read_text(encoding="utf-8").splitlines()[:-2]) + "\n", encoding="utf-8")
    after = recall_spindowns([runs], SpinDownOptions())
    assert fitted == ["run-2"]
    assert differences(after.runs[0], before.runs[0]) == []
    assert differences(after.combined.fits, SPINDOWN.analyze([runs], SpinDownOptions(tilt="none")).combined.fits) == []
    assert not after.runs[1].has_tilt  # with the options of the result that held before
    assert "the readings are others than in" in after.origins[1].text
    assert after.origins[0].text.startswith("as levilab analyze found it")


def test_a_new_run_beside_old_ones_is_the_only_one_analyzed(runs, sample_data, fitted):
    shutil.move(runs / "run-4", runs.parent / "run-4")
    analyzed(runs)
    shutil.move(runs.parent / "run-4", runs / "run-4")
    after = recall_spindowns([runs], SpinDownOptions())
    assert fitted == ["run-4"]
    assert len(after.runs) == 4
    assert "no result yet" in after.origins[3].text


def test_runs_analyzed_one_by_one_are_combined_without_a_new_fit(runs, fitted):
    for run in sorted(runs.iterdir()):
        analyzed(run)
    after = recall_spindowns([runs], SpinDownOptions())
    assert fitted == []
    assert differences(after.combined, SPINDOWN.analyze([runs]).combined) == []


def test_a_run_is_recalled_from_the_result_of_its_folder(runs, fitted):
    analyzed(runs)
    after = recall_spindowns([runs / "run-3"], SpinDownOptions())
    assert fitted == []
    assert differences(after.runs[0], SPINDOWN.analyze([runs / "run-3"]).runs[0]) == []


def test_a_part_of_a_run_is_recalled_as_that_part(runs, fitted):
    before = analyzed(runs / "run-1", between=(24.0, 30.0))
    after = recall_spindowns([runs / "run-1"], SpinDownOptions())
    assert fitted == []
    assert differences(after.sources[0].readings, before.sources[0].readings) == []


@pytest.mark.parametrize("given", [{"reading_u": 0.05}, {"keep_outliers": True}])
def test_other_options_analyze_anew_with_the_rest_as_before(tmp_path, fitted, given):
    path = spin_down_csv(tmp_path / "my.csv")
    analyzed(path, tilt="none")
    after = recall_spindowns([path], SpinDownOptions(**given))
    assert fitted == ["my.csv"]
    assert after.origins[0].options == replace(SpinDownOptions(tilt="none"), **given)
    assert "other options than those of" in after.origins[0].text
    assert recall_spindowns([path], SpinDownOptions()).runs[0].u[0] == 0.03


def test_the_columns_of_the_result_are_those_of_the_report(tmp_path, fitted):
    path = spin_down_csv(tmp_path / "my.csv", u=False)
    path.write_text(path.read_text(encoding="utf-8").replace("time_s,spin_frequency_hz", "Uhr,Kanal"), encoding="utf-8")
    analyzed(path, columns={"t": "Uhr", "f": "Kanal"})
    assert len(recall_spindowns([path], SpinDownOptions()).runs) == 1
    assert fitted == []


def test_names_of_columns_do_not_matter_to_a_run(runs, fitted):
    analyzed(runs)
    recall_spindowns([runs], SpinDownOptions(columns={"t": "1"}))
    recall_spindowns([runs / "run-1", runs / "run-2"], SpinDownOptions(columns={"t": "1"}))
    assert fitted == []


@pytest.mark.parametrize("path", ["run-1", "run-1/readings.csv"])
def test_names_of_columns_of_runs_alone_are_refused_with_those_of_the_run(runs, path):
    with pytest.raises(UsageError, match=r"run-1 is a run, whose columns are known \(time_s, spin_frequency_hz"):
        SPINDOWN.analyze([runs / path], SpinDownOptions(columns={"f": "zz"}))


def test_nothing_is_written_where_results_are_recalled(runs):
    analyzed(runs / "run-1")
    before = {path: path.read_bytes() for path in runs.rglob("*") if path.is_file()}
    recall_spindowns([runs], SpinDownOptions())
    assert {path: path.read_bytes() for path in runs.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("place", ["run-2", ""])
def test_a_damaged_result_of_a_run_or_of_the_folder_is_an_error_that_names_it(runs, place):
    file = runs / place / "result.json"
    file.write_text("{", encoding="utf-8")
    with pytest.raises(DataError, match=f"^{re.escape(str(file))}: is cut off"):
        recall_spindowns([runs], SpinDownOptions())


def test_a_file_of_that_name_above_the_input_may_be_anything(tmp_path):
    (tmp_path / "result.json").write_text('{"mine": 1}', encoding="utf-8")
    assert len(recall_spindowns([spin_down_csv(tmp_path / "my.csv")], SpinDownOptions()).runs) == 1


@pytest.mark.parametrize(("key", "value"), [
    ("solution", [1.0]),
    ("solution", [1e308, 1e308]),
    ("residuals", [0.0]),
])  # fmt: skip
def test_a_fit_whose_curve_cannot_be_drawn_is_an_error(tmp_path, key, value):
    analyzed(spin_down_csv(tmp_path / "my.csv"))
    file = tmp_path / "my.csv.result.json"
    result = json.loads(file.read_text(encoding="utf-8"))
    result["runs"][0]["result"]["fits"][2][key] = value
    file.write_text(json.dumps(result), encoding="utf-8")
    with pytest.raises(DataError) as caught:
        recall_spindowns([tmp_path / "my.csv"], SpinDownOptions())
    assert str(caught.value).startswith(f"{file}: ")


def test_a_result_is_read_with_the_laws_of_its_day(tmp_path, fitted, monkeypatch):
    before = analyzed(spin_down_csv(tmp_path / "my.csv"))
    with monkeypatch.context() as later:
        later.setattr(drag, "LAWS", dict(LAWS))
        later.setitem(drag.LAWS, "turbulent", replace(LAWS["disc"], name="turbulent"))
        later.setattr("levilab.pipelines.spindown.document.LAWS", drag.LAWS)
        after = recall_spindowns([tmp_path / "my.csv"], SpinDownOptions())
    assert fitted == []
    assert differences(after.runs, before.runs) == []
    assert [table.title for table in SPINDOWN.tables(after)] == [table.title for table in SPINDOWN.tables(before)]


def test_a_result_with_a_law_that_is_gone_is_analyzed_again(tmp_path, fitted):
    analyzed(spin_down_csv(tmp_path / "my.csv"))
    (result,) = tmp_path.glob("*.json")
    result.write_text(result.read_text(encoding="utf-8").replace('"newton"', '"gone"'), encoding="utf-8")
    after = recall_spindowns([tmp_path / "my.csv"], SpinDownOptions())
    assert fitted == ["my.csv"]
    assert after.origins[0].text.endswith("its result has a drag law that this version lacks, gone")


@pytest.mark.parametrize("text", ['{"mine": 1}', "[1, 2]", "mine", '{"schema": "mine/1"}'])
def test_another_program_may_have_a_result_in_the_present_folder(runs, monkeypatch, text):
    monkeypatch.chdir(runs.parent)
    (runs.parent / "result.json").write_text(text, encoding="utf-8")
    assert len(recall_spindowns([runs / "run-1", runs / "run-2"], SpinDownOptions()).runs) == 2


def test_a_result_of_another_version_in_the_present_folder_is_an_error(runs, monkeypatch):
    monkeypatch.chdir(runs.parent)
    (runs.parent / "result.json").write_text('{"schema": "levilab-result/9"}', encoding="utf-8")
    with pytest.raises(DataError, match="levilab-result/9"):
        recall_spindowns([runs / "run-1", runs / "run-2"], SpinDownOptions())


def test_a_warning_about_an_input_is_recalled_once_however_it_is_named(tmp_path, monkeypatch):
    paths = [spin_down_csv(tmp_path / name, seed=k) for k, name in enumerate(("one.csv", "two.csv"))]
    for path in paths:
        lines = path.read_text(encoding="utf-8").splitlines()
        path.write_text("\n".join([*lines[1:], ""]), encoding="utf-8")
        analyzed(path)
    monkeypatch.chdir(tmp_path)
    after = recall_spindowns([path.relative_to(tmp_path) for path in paths], SpinDownOptions())
    about = [text for text in after.all_warnings if "no header" in text]
    assert len(about) == 2
    assert [text.count("one.csv") + text.count("two.csv") for text in about] == [1, 1]  # named once
