"""Limits from runs and files: the published statistics, theory beside them, result.json and back."""

import json
import re
import shutil
from types import MappingProxyType

import numpy as np
import pytest

from levilab.errors import DataError, DoesNotSuit
from levilab.formats.columns import TableError
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.inputs.source import mark_of
from levilab.pipelines.inputs.unread import SkippedRuns
from levilab.pipelines.limit.analysis import (
    ISLANDS,
    LOWER_EDGE,
    RESONANCE,
    SIMON,
    THESIS_HIGHEST,
    UPPER_EDGE,
    LimitOptions,
)
from levilab.pipelines.limit.document import LIMIT
from levilab.pipelines.limit.report import limit_part, limit_tables
from levilab.pipelines.look import look_at
from levilab.pipelines.suits import analyze_suiting, save
from levilab.present.document.blocks import Listing
from levilab.report.page import write_report
from levilab.report.tables.values import of_analysis
from support.spin_downs import spin_down_csv


def test_the_published_limits_give_the_published_statistics(sample_data):
    analysis = LIMIT.analyze([sample_data / "lower-limits"])
    values = ANALYSES["limit"].document(analysis, sample_data)["values"]
    assert round(values["mean"]["value"], 2) == 21.86
    assert round(values["scatter"]["value"], 2) == 0.25
    assert round(values["standard_error"]["value"], 2) == 0.08
    assert analysis.all_warnings == []


@pytest.mark.parametrize(
    ("title", "factor", "said"),
    [
        ("f [Hz]", 1, ""), ("Grenzfrequenz in Hz", 1, ""), ("omega [1/s]", 2 * np.pi, ""), ("omega", 2 * np.pi, ""),
        ("f [Hz]", 2, "with 2 marks a turn they are lower ones, at 21.80 Hz"),
        ("f [Hz]", 2 * np.pi, "is no upper limit of a top: is it in rad/s (21.8 Hz)"),
    ],
)  # fmt: skip
def test_lower_limits_in_other_units_are_read_or_named(tmp_path, title, factor, said):
    rows = factor * np.array([21.6, 21.9, 21.7, 22.0])
    (tmp_path / "limits.csv").write_text("\n".join([title, *(f"{row:.3f}" for row in rows), ""]), encoding="utf-8")
    found = LIMIT.analyze([tmp_path / "limits.csv"])
    (limits,) = found.runs
    if said:
        assert any(said in text for text in found.all_warnings)
    else:
        assert (limits.which, limits.statistics.mean.value) == ("lower", pytest.approx(21.8, abs=1e-4))
        assert not any("marks" in text for text in found.all_warnings)


def test_theory_beside_them_is_that_of_the_thesis_top(sample_data, tmp_path):
    """PHYSICS: window 21.65 to 80.6 Hz at z = 7.30 cm, computed there from the quartic; resonance 22.1 Hz."""
    file = tmp_path / "upper.csv"  # with no scene of its own
    file.write_text("61.2\n60.9\n61.0\n", encoding="utf-8")
    (lower, upper) = LIMIT.analyze([sample_data / "lower-limits", file]).groups
    expected = {one.name: one.expected for group in (lower, upper) for one in group.comparisons}
    share = 2779 * 2 * np.pi / 60 / 326  # of Simon's top 3: measured, and the edge of its quartic
    reached = {ISLANDS: 59.5, THESIS_HIGHEST: 61, SIMON: share * 80.6}
    assert expected == pytest.approx({LOWER_EDGE: 21.65, RESONANCE: 22.1, UPPER_EDGE: 80.6} | reached, abs=0.06)
    (highest,) = (one for one in upper.comparisons if one.name == THESIS_HIGHEST)
    assert highest.difference.u > 0.28  # 61 is printed without decimals, 0.5/√3
    assert "21.65 Hz (the lower edge of the linear window); the mean lies 0.21 Hz above it" in lower.text
    assert "likely because a tilted top leans ever more towards 22.15 Hz, the resonance of the wobble" in lower.text
    assert "below it, likely because a tilted top moves, and is lost sooner." in upper.text


@pytest.mark.parametrize(
    ("spin", "asks"),
    [(40.0, "was it stopped, or held by a drive?"), (21.9, ""), (10.9, "was each second turn counted?")],
)
def test_spins_at_which_no_top_falls_are_doubted(spin, asks, tmp_path):
    (file := tmp_path / "limits.csv").write_text(f"f [Hz]\n{spin}\n{spin + 0.02}\n{spin - 0.02}\n", encoding="utf-8")
    doubts = LIMIT.analyze([file]).doubts
    assert [text.partition(": ")[2] for text in doubts] == ([asks] if asks else [])


def test_whole_numbers_that_may_be_times_and_rpm_are_no_limits_without_an_answer(tmp_path):
    (file := tmp_path / "a.csv").write_text("20,1320\n21,1291\n22,1262\n23,1235\n24,1207\n", encoding="utf-8")
    asked = "is 20,1320 a time and a spin, or one number with decimal comma? For one number write the title f [Hz]"
    with pytest.raises(DataError, match=re.escape(asked)):
        analyze_suiting([file], {})
    assert asked in look_at(file, {}).problem
    ((two, _),) = analyze_suiting([file], {"columns": {"t": "1", "f": "2 [rpm]"}})
    file.write_text("f [Hz]\n" + file.read_text(encoding="utf-8"), encoding="utf-8")
    ((one, _),) = analyze_suiting([file], {})
    assert (two.name, one.name, look_at(file, {}).holds) == ("spindown", "limit", "5 limits")
    file.write_text("22,8634\n21,9291\n22,1262\n", encoding="utf-8")  # times do not fall
    notes = LIMIT.analyze([file]).all_warnings
    assert any("its rows, as 22,8634, are taken for one number each, with a decimal comma" in note for note in notes)


def test_times_and_whole_spins_below_words_are_no_limits_and_decimal_commas_no_times(tmp_path):
    (file := tmp_path / "a.csv").write_text("Levitron Tuesday\n6,37\n16,35\n26,33\n36,32\n46,31\n", "utf-8")
    assert 'say `columns` = "t=1,f=2"' in look_at(file, {}).problem
    file.write_text("21,7\n22,1\n21,9\n21,5\n22,2\n", "utf-8")
    ((row, found),) = analyze_suiting([file], {})
    assert (row.name, found.groups[0].statistics.mean.value) == ("limit", pytest.approx(21.88))
    with pytest.raises(DataError, match="'21,7' is one number with decimal comma, or a time that does not increase"):
        ANALYSES["spindown"].analyze([file])


def test_both_kinds_together_have_values_of_both(sample_data, tmp_path):
    analysis = ANALYSES["limit"].analyze([sample_data])
    document = ANALYSES["limit"].document(analysis, tmp_path)
    assert {"lower_mean", "upper_1_mean", "upper_2_standard_error"} <= document["values"].keys()
    assert "The top was lost by the drive 8 times." in analysis.groups[1].text
    assert [run["result"]["which"] for run in document["runs"]] == ["upper", "lower", "upper"]
    assert [group["statistics"]["n"] for group in document["groups"]] == [10, 8, 8]
    off, warning, conditions = sorted(analysis.all_warnings)  # spin-downs are a remark
    assert "the upper limits are of 2 conditions" in conditions
    assert off.startswith("loose-washers: limits 1 and 2 do not belong to the others; the mean has them")
    assert "LOOSE WASHERS" in warning
    assert warning.endswith("(the first of 16 such warnings)")
    assert SkippedRuns("spin", 4) in analysis.skipped
    assert limit_tables(analysis)[1].title == "Beside theory, for 3 kinds of top"  # of 26 tops
    # the lower limits are real, so nothing that is made of them alone bears the mark
    assert marks_of_budgets(analysis) == ["", "SYNTHETIC.", "SYNTHETIC."]
    assert mark_of(analysis.sources) == "SYNTHETIC IN PART (loose-washers, upper-limits)."
    _, quantities = of_analysis(ANALYSES["limit"], analysis, tmp_path)
    together = {row[3]: row[1] for row in quantities.rows if row[0] == "all together"}
    assert {name: made_up for name, made_up in together.items() if str(name).endswith("_mean")} == {
        "lower_mean": False, "upper_1_mean": True, "upper_2_mean": True,
    }  # fmt: skip


def change(run, settings=MappingProxyType({}), **entries):
    """Change settings of the experiment and entries of run.json."""
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    record["configuration"]["limit"] |= settings
    (run / "run.json").write_text(json.dumps(record | entries), encoding="utf-8")


def marks_of_budgets(analysis):
    return [mark_of(analysis.inputs_of(budget.group)) for budget in analysis.budget]


def test_groups_of_the_same_mean_have_each_a_section(sample_data, tmp_path):
    limits = ["67.5,0.25", "68.5,0.25", "68,0.25", "69,0.25"]
    for name, changes, rows in (("a", {}, limits), ("b", {"drive_amplitude_vpp": 20.0}, reversed(limits))):
        folder = shutil.copytree(sample_data / "upper-limits", tmp_path / name)
        change(folder, changes, synthetic=name == "a")
        text = "\n".join(["spin_frequency_hz,spin_frequency_u_hz", *rows, ""])
        (folder / "readings.csv").write_text(text, encoding="utf-8")
    analysis = ANALYSES["limit"].analyze([tmp_path])
    one, other = (group.statistics.mean for group in analysis.groups)
    assert one == other
    assert marks_of_budgets(analysis) == ["SYNTHETIC.", ""]
    document = ANALYSES["limit"].document(analysis, tmp_path)
    assert [document["values"][f"upper_{k}_mean"]["group"] for k in (1, 2)] == [0, 1]
    assert [budget["group"] for budget in document["budget"]] == [0, 1]
    (tmp_path / "result.json").write_text(json.dumps(document), encoding="utf-8")
    assert marks_of_budgets(ANALYSES["limit"].recall([tmp_path])) == ["SYNTHETIC.", ""]
    document["budget"][0]["group"] = 2
    (tmp_path / "result.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(DataError, match="a budget is of none of the 2 groups"):
        ANALYSES["limit"].recall([tmp_path])


@pytest.mark.usefixtures("undrawn_figures")
def test_measured_and_made_up_runs_are_never_one_mean(sample_data, tmp_path):
    """Three runs of one top, of which the second is made up and lies 10 Hz higher; the third is the first, reversed."""
    for name, synthetic in (("a", False), ("b", True), ("c", False)):
        folder = shutil.copytree(sample_data / "lower-limits", tmp_path / name)
        change(folder, synthetic=synthetic, synthetic_how="made up" if synthetic else None)
        head, *limits = (folder / "readings.csv").read_text(encoding="utf-8").split()
        limits = {"a": limits, "b": [f"{32.0 + 0.1 * k:.1f}" for k in range(10)], "c": limits[::-1]}[name]
        (folder / "readings.csv").write_text("\n".join([head, *limits, ""]), encoding="utf-8")
    analysis = ANALYSES["limit"].analyze([tmp_path])
    assert sorted(group.runs for group in analysis.groups) == [(0, 2), (1,)]
    (measured,) = (group for group in analysis.groups if group.runs == (0, 2))
    assert measured.statistics.mean.value == pytest.approx(21.86)
    assert "not known to be SYNTHETIC" in measured.text
    assert any("are of 2 conditions and are not combined" in text for text in analysis.all_warnings)
    assert not any("says nothing about a real top" in text for text in analysis.all_warnings)
    document = ANALYSES["limit"].document(analysis, tmp_path)
    assert [group["conditions"]["synthetic"] for group in document["groups"]] == [False, True]
    assert [run["result"]["conditions"]["synthetic"] for run in document["runs"]] == [False, True, False]
    save(ANALYSES["limit"], analysis)
    assert ANALYSES["limit"].recall([tmp_path]).groups == analysis.groups
    page = write_report([tmp_path], tmp_path / "page.html").read_text(encoding="utf-8")
    assert "MIXED" not in page
    (alone,) = ANALYSES["limit"].analyze([tmp_path / "a", tmp_path / "c"]).groups
    assert alone.statistics == measured.statistics
    assert alone.conditions.synthetic is False
    assert "SYNTHETIC" not in alone.text  # nothing to be distinguished from


@pytest.mark.usefixtures("undrawn_figures")
@pytest.mark.parametrize(
    ("name", "synthetic"),
    [("upper-limits", True), ("lower-limits", False), ("my.csv", None), ("my.csv and a run", None)],
)
def test_what_is_made_up_is_said_of_each_run_and_group(sample_data, tmp_path, monkeypatch, name, synthetic):
    """A data file does not say it."""
    monkeypatch.chdir(tmp_path)  # where the result of several inputs goes
    paths = [tmp_path / "my.csv"] if "my.csv" in name else [shutil.copytree(sample_data / name, tmp_path / name)]
    (tmp_path / "my.csv").write_text("f [Hz]\n21.9\n21.8\n22.0\n", encoding="utf-8")
    if "and a run" in name:
        paths.append(shutil.copytree(sample_data / "lower-limits", tmp_path / "lower-limits"))
    analysis = ANALYSES["limit"].analyze(paths)
    assert "SYNTHETIC" not in analysis.text  # nothing to be distinguished from
    (file, *_) = save(ANALYSES["limit"], analysis)
    document = json.loads(file.read_text(encoding="utf-8"))
    (group,) = document["groups"]
    assert group["conditions"]["synthetic"] is synthetic
    assert document["runs"][0]["result"]["conditions"]["synthetic"] is synthetic
    assert [run["result"]["conditions"]["synthetic"] for run in document["runs"][1:]] == [False] * (len(paths) - 1)
    recalled = ANALYSES["limit"].recall(paths)
    assert (recalled.runs, recalled.groups) == (analysis.runs, analysis.groups)


@pytest.mark.usefixtures("undrawn_figures")
def test_what_was_written_is_what_a_report_shows(sample_data, tmp_path):
    folder = shutil.copytree(sample_data / "loose-washers", tmp_path / "run")
    analysis = LIMIT.analyze([folder])
    assert [file.name for file in save(ANALYSES["limit"], analysis)] == ["result.json", "limit.png"]
    page = write_report([folder], tmp_path / "page.html").read_text(encoding="utf-8")
    assert "LOOSE WASHERS" in page
    assert analysis.groups[0].text.split(".")[0] in page
    other = ANALYSES["limit"].recall([folder], LimitOptions(reading_u=0.5))  # other options than the result's
    assert other.origins[0].text.startswith("analyzed for this page")


def test_a_file_of_ones_own_needs_nothing_but_the_spins(tmp_path):
    file = tmp_path / "my.csv"
    file.write_text("top,f [Hz]\n1,80.1\n2,80.3\n3,79.9\n", encoding="utf-8")
    (group,) = LIMIT.analyze([file]).groups
    assert (group.which, group.statistics.n) == ("upper", 3)  # by the nearer edge of the window


@pytest.mark.parametrize(
    "text",
    [
        "21.7\n21.4\n21.9\n",
        "limit [Hz]\n21,7\n21,4\n21,9\n",
        "Grenze\n21,7\n21,4\n21,9\n",
        "# ours\nf [mHz]\n21700\n21400\n\n21900\n",
        "1302\n1284\n1314",
    ],
    ids=["numbers", "a title", "an unknown title", "another unit", "rpm"],
)
def test_a_column_of_limits_alone_is_enough(tmp_path, text, request):
    file = tmp_path / "my.csv"
    file.write_text(("rpm\n" if request.node.callspec.id == "rpm" else "") + text, encoding="utf-8")
    (group,) = LIMIT.analyze([file]).groups
    assert group.statistics.mean.value == pytest.approx(65.0 / 3)
    assert (group.which, group.statistics.n) == ("lower", 3)


def test_limits_that_grow_under_an_unknown_title_are_no_table_of_times(tmp_path):
    (tmp_path / "my.csv").write_text("Grenze\n21,7\n22,4\n23,9\n24,1\n25,2\n26,1\n", encoding="utf-8")
    (group,) = LIMIT.analyze([tmp_path / "my.csv"]).groups
    assert (group.which, group.statistics.n, round(group.statistics.mean.value, 1)) == ("lower", 6, 23.9)


@pytest.mark.parametrize(
    "text", ["time [s]\n21.7\n21.4\n", "21.7\nhigh\n21.9\n", "28571\n28605\n28700\n", "height [mm]\n21.7\n"]
)
def test_another_column_is_no_limit(tmp_path, text):
    file = tmp_path / "my.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(TableError):
        LIMIT.analyze([file])


def test_runs_of_other_conditions_stand_apart(sample_data, tmp_path):
    """The same drive twice is one group, with the scatter between the runs; a stronger one or another creep is not."""
    changed = {"strong": {"drive_amplitude_vpp": 20.0}, "slow": {"creep_hz_per_s": 0.05}}
    names = {"one": {}, "two": {}} | changed
    for k, (name, changes) in enumerate(names.items()):
        folder = shutil.copytree(sample_data / "upper-limits", tmp_path / name)
        change(folder, changes)
        off = 4.0 * k + np.tile([-0.1, 0.1], 4)
        rows = ["spin_frequency_hz,spin_frequency_u_hz", *(f"{67 + one},0.05" for one in off)]
        (folder / "readings.csv").write_text("\n".join([*rows, ""]), encoding="utf-8")
    analysis = LIMIT.analyze([tmp_path / name for name in names])
    assert sorted(group.runs for group in analysis.groups) == [(0, 1), (2,), (3,)]
    both = next(group for group in analysis.groups if group.runs == (0, 1))
    assert both.statistics.between.value == pytest.approx(8**0.5, rel=0.01)  # 4 Hz apart
    assert both.statistics.mean.u == pytest.approx(2.0, rel=0.01)  # their scatter over the root of 2
    assert "The means of the 2 runs scatter by" in both.text
    assert any("are of 3 conditions and are not combined" in text for text in analysis.all_warnings)
    values = ANALYSES["limit"].document(analysis, tmp_path)["values"]
    assert {"upper_1_mean", "upper_2_mean", "upper_3_standard_error", "upper_1_between_runs"} <= values.keys()


def test_a_repetition_far_off_is_numbered_in_its_run_and_the_page_shows_200(tmp_path):
    """The fourth of the second run, and not the 14th of all."""
    for name, n in (("one", 10), ("two", 240)):
        limits = 21.9 + 0.1 * np.sin(1.0 + np.arange(n))
        limits[3] += 2.0 * (name == "two")
        (tmp_path / f"{name}.csv").write_text("\n".join(f"{one:.3f}" for one in limits), encoding="utf-8")
    analysis = LIMIT.analyze([tmp_path / "one.csv", tmp_path / "two.csv"])
    (note,) = (text for text in analysis.all_warnings if "not belong to the others" in text)
    assert note.startswith("two.csv: limit 4 does not belong to the others; the mean has it")
    one, two = (part.blocks[0] for part in limit_part(analysis).inputs)
    assert isinstance(one, Listing)
    assert isinstance(two, Listing)
    assert (len(one.table.rows), len(two.table.rows)) == (10, 200)
    assert two.note == "The first 200 of 240; all of them are in the data."


def test_upper_limits_that_do_not_scatter_are_no_better_than_a_step(sample_data, tmp_path):
    folder = shutil.copytree(sample_data / "upper-limits", tmp_path / "run")
    header, *rows = (folder / "readings.csv").read_text(encoding="utf-8").splitlines()
    alike = [",".join([row.split(",")[0], *rows[0].split(",")[1:]]) for row in rows]
    (folder / "readings.csv").write_text("\n".join([header, *alike, ""]), encoding="utf-8")
    analysis = LIMIT.analyze([folder])
    (run,) = analysis.runs
    assert run.statistics.mean.u == pytest.approx(float(rows[0].split(",")[2]))
    assert any("however often it is repeated: creep slower" in text for text in analysis.all_warnings)


def test_a_mean_within_a_step_of_the_drive_is_not_called_better(sample_data, tmp_path):
    folder = shutil.copytree(sample_data / "upper-limits", tmp_path / "run")
    header, *rows = (folder / "readings.csv").read_text(encoding="utf-8").splitlines()
    at = header.split(",").index("spin_frequency_hz")
    cells = [[row.split(",")[0], *rows[0].split(",")[1:]] for row in rows]
    cells[0][at] = str(float(cells[0][at]) + 0.01)
    (folder / "readings.csv").write_text("\n".join([header, *map(",".join, cells), ""]), encoding="utf-8")
    text = str(limit_part(LIMIT.analyze([folder])).result[0])
    assert "times as good" not in text
    assert "do not become less by more tops" in text


def test_causes_of_losses_are_counted_over_runs_and_explained(sample_data, tmp_path):
    folders = [shutil.copytree(sample_data / "upper-limits", tmp_path / name) for name in "ab"]
    for folder in folders:
        with (folder / "events.jsonl").open("a", encoding="utf-8") as file:
            file.write('{"time_s": 5000.0, "kind": "note", "text": "", "cause": "left behind by the drive"}\n')
    readings = folders[1] / "readings.csv"
    readings.write_text(readings.read_text(encoding="utf-8").replace("69.", "68."), encoding="utf-8")
    analysis = LIMIT.analyze(folders)
    (group,) = analysis.groups
    assert group.causes == {"left behind by the drive": 18}
    assert "The phase before each loss tells why: left behind by the drive 18 times." in group.text
    assert "likely" not in group.text  # of no other cause
    assert "Simon" not in group.text  # what others reached stands in the table alone
    meaning = str(limit_part(analysis).result[0])
    assert "a stronger drive gets higher" in meaning
    assert "no drive gets much higher" not in meaning
    assert "islands" in meaning


def test_a_spin_down_is_no_limit_and_runs_without_limits_are_told(tmp_path, sample_data):
    file = spin_down_csv(tmp_path / "my.csv")
    assert [row.name for row, _ in analyze_suiting([file], {})] == ["spindown"]
    with pytest.raises(DoesNotSuit, match="no limits of one top"):
        LIMIT.analyze([file])
    file.write_text("t,f\n0,40\n10,39\n20,37\n30,37.5\n40,36\n50,35\n", encoding="utf-8")  # not far down
    with pytest.raises(DoesNotSuit, match="the spin falls with time"):
        LIMIT.analyze([file])
    file.write_text("t,f\n" + "".join(f"{k},21.8\n" for k in range(6)), encoding="utf-8")  # a top under the drive
    with pytest.raises(DoesNotSuit, match="the spin does not change with time: is the drive on"):
        LIMIT.analyze([file])
    with pytest.raises(DataError, match="Is the drive still on"):
        analyze_suiting([file], {})
    for wrong, says in (("0,40\nca. 9,39\n20,40\n30,39.5\n", "'ca. 9' stands in"), ("0,40\n0,39\n9,40\n", "repeated")):
        file.write_text(f"t,f\n{wrong}", encoding="utf-8")
        with pytest.raises(DataError, match=says):  # a damaged spin-down is no list of limits
            analyze_suiting([file], {})
    empty = shutil.copytree(sample_data / "lower-limits", tmp_path / "run")
    (empty / "readings.csv").write_text("spin_frequency_hz\n", encoding="utf-8")
    with pytest.raises(TableError, match="at least one repetition is needed"):
        LIMIT.analyze([empty])
    (empty / "readings.csv").write_text("spin_frequency_hz\n21.9\n-1\n", encoding="utf-8")
    with pytest.raises(TableError, match="line 3: the limit is -1 Hz"):
        LIMIT.analyze([empty])


def test_a_scene_that_was_measured_is_the_one_compared_with(sample_data, tmp_path):
    folder = shutil.copytree(sample_data / "lower-limits", tmp_path / "run")
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    record["configuration"]["scene"] = {"name": "mine", "top": {"mass_kg": 0.025}}
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    (run,) = LIMIT.analyze([folder]).runs
    assert run.device.name == "scene mine, 25 g"
    record["configuration"]["scene"]["top"]["mass_kg"] = 0.03  # floats nowhere
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(DataError, match=r"configuration\.scene: no spin keeps this top up"):
        LIMIT.analyze([folder])


@pytest.mark.parametrize(
    ("limits", "often"),
    [
        ("21.4\n21.6\n21.9\n21.7\n", r"in \d\d % of such runs \(p = 0\.\d"),
        ("21.75\n21.9\n22.1\n21.95\n", r"once in \d\d such runs \(p = 0\.0"),
        ("21.9\n21.91\n21.92\n21.9\n", r"in fewer than one of 1000 such runs \(p"),
    ],
)
def test_how_often_chance_makes_such_a_difference_is_a_number_of_runs(tmp_path, limits, often):
    (file := tmp_path / "lower.csv").write_text(limits, encoding="utf-8")
    assert re.search(f"By chance alone so large a difference comes {often}", LIMIT.analyze([file]).text)


def test_of_limits_under_several_conditions_no_sentence_is_said_twice(sample_data):
    limits = LIMIT.analyze([sample_data / "upper-limits", sample_data / "loose-washers"])
    assert limit_part(limits).result[0].text.count("From 59.5 to 81 Hz a simulated top") == 1
    assert [line.count("The drive lost the top") for line in limits.text.split("\n")] == [1, 1]
