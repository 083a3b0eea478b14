"""Several analyses of the same inputs: each keeps its result, and only what does not suit one is passed over."""

import json
import shutil
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from levilab.errors import DataError, DoesNotSuit
from levilab.pipelines import catalogue
from levilab.pipelines.catalogue import ANALYSES, print_analysis
from levilab.pipelines.document import Analysis
from levilab.pipelines.inputs.unread import Skipped, skipped_by_all
from levilab.pipelines.recall import recall_suiting
from levilab.pipelines.result import Archive
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.suits import analyze_suiting, suiting
from levilab.pipelines.suits import save as save_found
from levilab.present.terminal import as_text
from levilab.report.document import blocks_of_part
from levilab.report.reproduction import Asked
from support.paths import SAMPLE_DATA
from support.spin_downs import spin_down_csv


def second_row(*experiments):
    """Another analysis that reads spin-downs."""
    return replace(SPINDOWN, name="second", experiments=frozenset(experiments))


class Content(Analysis[Any]):
    """An analysis that is content with anything."""

    def analyze(self, *_):
        return "other"

    recall = analyze


def content_row(*experiments):
    row = second_row(*experiments)
    return Content(**{one.name: getattr(row, one.name) for one in fields(row)})


def use(monkeypatch, *rows):
    """These rows, without drawing."""
    monkeypatch.setattr(Analysis, "png", lambda *_: b"")
    monkeypatch.setattr(catalogue, "ANALYSES", {row.name: row for row in rows})


@pytest.fixture
def two(monkeypatch):
    """A second analysis of the same runs and files, below the first."""
    use(monkeypatch, SPINDOWN, second_row("spin"))


@pytest.fixture
def runs(tmp_path, sample_data):
    for k in (1, 2):
        shutil.copytree(sample_data / f"spin-down-{k}", tmp_path / "runs" / f"run-{k}")
    return tmp_path / "runs"


def analyzed(*paths):
    """Name of each result → the analysis that it says it is of."""
    written = [save_found(row, found)[0] for row, found in analyze_suiting(paths, {})]
    return {file.name: json.loads(file.read_text(encoding="utf-8"))["analysis"] for file in written}


@pytest.mark.usefixtures("two")
def test_two_analyses_of_one_input_have_a_result_each(tmp_path, runs):
    both = {"result.json": "spindown", "result.second.json": "second"}
    assert analyzed(runs / "run-1") == both
    assert analyzed(runs) == both
    file = spin_down_csv(tmp_path / "my.csv")
    assert analyzed(file) == {f"my.csv.{name}": analysis for name, analysis in both.items()}


def test_a_result_in_a_given_folder_replaces_no_other_analysis(tmp_path, sample_data, monkeypatch):
    monkeypatch.setattr(Analysis, "png", lambda *_: b"")
    for _ in range(2):
        for name, run in (("field", "field-scan"), ("limit", "lower-limits"), ("spindown", "spin-down-1")):
            analysis = ANALYSES[name]
            save_found(analysis, analysis.analyze([sample_data / run]), tmp_path)
    held = {file.name: json.loads(file.read_text(encoding="utf-8"))["analysis"] for file in tmp_path.glob("*.json")}
    assert held == {"result.json": "field", "result.limit.json": "limit", "result.spindown.json": "spindown"}


@pytest.mark.usefixtures("two")
@pytest.mark.parametrize("name", ["runs", "runs/run-1", "my.csv"])
def test_each_analysis_finds_its_own_result_again(tmp_path, runs, name):
    spin_down_csv(tmp_path / "my.csv")
    path = runs.parent / name
    analyzed(path)
    (row, recalled), (second, _) = recall_suiting([path], {})
    assert (row.name, second.name) == ("spindown", "second")
    assert all(origin.text.startswith("as levilab analyze found it") for origin in recalled.origins)
    archive = Archive([path], second.model)
    whole = archive.whole(recalled.sources)
    assert whole.file.name.endswith("result.second.json")
    source = recalled.sources[-1]
    earlier = Archive([source.path], second.model).earlier(source.path, source.data, source.sha256)
    assert earlier.file.name.endswith("result.second.json")


def test_result_json_belongs_to_the_first_row_for_the_experiment(monkeypatch, runs):
    use(monkeypatch, ANALYSES["field"], second_row("spin"), SPINDOWN)
    found = SPINDOWN.analyze([runs / "run-1"])
    rows = catalogue.ANALYSES
    assert save_found(rows["second"], found)[0].name == "result.json"
    assert save_found(rows["spindown"], found)[0].name == "result.spindown.json"
    together = SPINDOWN.analyze([runs])
    assert save_found(rows["second"], together)[0].name == "result.second.json"


def test_several_inputs_leave_the_result_of_the_present_run_alone(runs, monkeypatch):
    monkeypatch.chdir(runs / "run-1")
    paths = [Path(), Path("../run-2")]
    monkeypatch.setattr(Analysis, "png", lambda *_: b"")
    written = save_found(SPINDOWN, SPINDOWN.analyze(paths))[0]
    assert written.resolve() == runs / "result.json"
    assert SPINDOWN.recall(paths).origins[1].text.endswith(str(written))


@pytest.mark.usefixtures("two")
@pytest.mark.parametrize("name", ["run-1", ""])
def test_damage_is_not_passed_over_because_another_analysis_runs(monkeypatch, runs, name):
    """The second row is content with anything; the first one finds its result damaged."""
    use(monkeypatch, SPINDOWN, content_row("spin"))
    (runs / name / "result.json").write_text("{", encoding="utf-8")
    with pytest.raises(DataError, match="is cut off"):
        recall_suiting([runs / name], {})


def test_what_one_analysis_cannot_use_keeps_no_other_from_its_own(tmp_path, sample_data):
    root = tmp_path / "runs"
    shutil.copytree(sample_data / "lower-limits", root / "limits")
    for name, rows in (("spin-down-1", 1), ("field-scan", 2)):  # broken off: too few readings
        readings = shutil.copytree(sample_data / name, root / name) / "readings.csv"
        lines = readings.read_text(encoding="utf-8").splitlines(keepends=True)
        readings.write_text("".join(lines[: 1 + rows]), encoding="utf-8")
    ((row, found),) = analyze_suiting([root], {})
    skipped = [one for one in skipped_by_all([found.skipped]) if isinstance(one, Skipped)]
    assert (row.name, [one.path.name for one in skipped]) == ("limit", ["spin-down-1", "field-scan"])


def test_of_several_paths_each_analysis_takes_those_that_suit_it(tmp_path, sample_data):
    """Named one by one as in a folder of mixed runs; a path that suits none is refused, and named."""
    paths = [sample_data / name for name in ("lower-limits", "spin-down-1", "spin-down-2")]
    for found in (analyze_suiting(paths, {}), recall_suiting(paths, {})):
        taken = {row.name: [source.name for source in result.sources] for row, result in found}
        assert taken == {"spindown": ["spin-down-1", "spin-down-2"], "limit": ["lower-limits"]}
    other = tmp_path / "names.csv"
    other.write_text("a,b\n1,2\n2,3\n3,4\n4,5\n", encoding="utf-8")
    with pytest.raises(DoesNotSuit, match=r"names\.csv"):
        analyze_suiting([sample_data / "lower-limits", sample_data / "spin-down-1", other], {})


def test_a_result_beside_a_run_of_another_kind_is_reported(tmp_path, sample_data):
    limit = ANALYSES["limit"]
    save_found(limit, limit.analyze([sample_data / "lower-limits"]), tmp_path)
    found = recall_suiting([sample_data / "spin-down-1", tmp_path], {})
    assert [row.name for row, _ in found] == ["spindown", "limit"]


def test_what_no_analysis_takes_is_refused_with_what_is_there(tmp_path, sample_data):
    run = shutil.copytree(sample_data / "spin-down-1", tmp_path / "runs" / "one")
    text = (run / "run.json").read_text(encoding="utf-8")
    (run / "run.json").write_text(text.replace('"experiment": "spin"', '"experiment": "dummy"'), encoding="utf-8")
    for path in (run, run.parent):
        for look in (analyze_suiting, recall_suiting):
            with pytest.raises(DoesNotSuit, match=r"there is no analysis of a dummy run \(found 1 dummy run\)$"):
                look([path], {})
    (tmp_path / "empty").mkdir()
    with pytest.raises(DoesNotSuit, match="holds no run and no data file"):
        analyze_suiting([tmp_path / "empty"], {})


def test_a_damaged_file_is_refused_for_its_damage(tmp_path):
    table = tmp_path / "my.csv"
    table.write_text("time_s,spin_frequency_hz\n0,1\n1,two\n2,3\n", encoding="utf-8")
    with pytest.raises(DataError, match="line 3"):
        analyze_suiting([table], {})


def test_a_file_with_columns_of_one_analysis_alone_is_for_that_one(tmp_path, sample_data):
    """The readings of a sweep have times and spins, too, as those of a spin-down."""
    file = shutil.copy(sample_data / "precession-sweep" / "readings.csv", tmp_path / "sweep.csv")
    assert [one.analysis.name for one in suiting([Path(file)], {})] == ["precession"]


@pytest.mark.usefixtures("undrawn_figures")
def test_a_sweep_that_keeps_records_is_a_sweep_first(tmp_path, sample_data):
    """Its records suit the analysis of spins, too, if one of them is named; that one stands above that of sweeps."""
    run = shutil.copytree(sample_data / "precession-sweep", tmp_path / "sweep")
    ((row, found),) = recall_suiting([run], {})
    assert row.name == "precession"
    assert save_found(row, found)[0].name == "result.json"
    spin = ANALYSES["spin"]
    assert save_found(spin, spin.analyze([run], spin.options_from({"channel": "laser"})))[0].name == "result.spin.json"


def test_what_makes_an_answer_doubtful_comes_before_it():
    limit = ANALYSES["limit"]
    found = limit.analyze([SAMPLE_DATA / "loose-washers"])
    shown = " ".join(as_text(lambda console: print_analysis(limit, found, console=console)).split())
    said = "What the data say. The drive lost the tops at 70.26(15) Hz on average: 8 upper limits"
    in_order = ("LOOSE WASHERS", said, "Limits of the spin, 1 run, SYNTHETIC", "Beside theory")
    assert sorted(in_order, key=shown.index) == list(in_order)
    result, *others = blocks_of_part(limit, found, limit.part(found), Asked(crosscheck=False))
    assert [type(block).__name__ for block in result.blocks[:2]] == ["Warnings", "Verdict"]
    assert "LOOSE WASHERS" in repr(result.blocks[0])
    assert not any("LOOSE WASHERS" in repr(section) for section in others if section.title == "Notes")


@pytest.mark.usefixtures("two")
def test_a_result_of_one_analysis_takes_no_input_from_those_of_the_others(tmp_path):
    """Beside an input without results; where each has one, these are what a person asked for."""
    one, other = (spin_down_csv(tmp_path / name, seed=k) for k, name in enumerate(("a.csv", "b.csv")))
    row = catalogue.ANALYSES["second"]
    save_found(row, row.analyze([one]))

    def inputs(*paths):
        return {row.name: [source.name for source in found.sources] for row, found in recall_suiting(paths, {})}

    assert inputs(one) == {"second": ["a.csv"]}
    assert inputs(one, other) == inputs(tmp_path) == {"spindown": ["a.csv", "b.csv"], "second": ["a.csv", "b.csv"]}
    save_found(row, row.analyze([other]))
    assert inputs(tmp_path) == {"second": ["a.csv", "b.csv"]}
