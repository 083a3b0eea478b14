"""The groups of a class beside each other: page, PDF and spreadsheet, and on a virtual bench the truth."""

import json
import math
import re
import shlex
import shutil
import zipfile
from html import escape

import numpy as np
import pytest
import xlsxwriter
from python_calamine import CalamineWorkbook
from scipy import stats
from scipy.io import wavfile

from analysis.comparison import compare
from levilab.crosscheck.truth import Truth
from levilab.errors import UsageError
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.suits import analyze_suiting, save
from levilab.report.beside import (
    DIFFER,
    GOOD,
    LOOK,
    REPEAT,
    Compared,
    _beside_others,
    _quantity,
    _width,
    agreement,
    class_of,
    finding,
    statistics_of_agreement,
    verdict,
)
from levilab.report.groups.document import write_class
from levilab.report.groups.figure import class_figure
from levilab.report.page import render
from levilab.runs.find import RECORD
from levilab.texts.text import speaking
from levilab.world.spin_world import SpinScene, random_scene
from support.acquisitions import RAISED_QUICKLY, acquired
from support.pages import Page
from support.paths import SAMPLE_DATA
from support.spin_downs import spin_down_csv

#: What a spreadsheet, a page or a terminal could take for something else.
HOSTILE = "=1+1 <b>&$x_1$"


def measured(root, groups, experiment="spin", *settings):
    """Let groups measure on virtual benches; the k-th has the seed k."""
    settings = settings or RAISED_QUICKLY
    for seed, group in enumerate(groups, start=1):
        acquired(experiment, seed=seed, group=group, out=root, settings=settings)
    return root


def compared(root, analysis="spindown"):
    row = ANALYSES[analysis]
    return class_of(row, row.analyze([root]))


@pytest.fixture(scope="module")
def of_three(tmp_path_factory):
    return measured(tmp_path_factory.mktemp("class"), ["Group 10", "Group 2", HOSTILE])


def test_each_group_is_beside_the_truth_of_its_seed(of_three):
    of = compared(of_three)
    assert [group.source.name for group in of.groups] == [HOSTILE, "Group 2", "Group 10"]
    assert "3 of 3 results are good. What it means" in Page(render([(of.analysis, of.found)])).text
    (c32,) = of.quantities
    assert f"{np.std([1e2 * x.value for x in c32.estimates], ddof=1) / c32.mean.value:.2g} % (s.d.)" in agreement(of)
    assert c32.truths == tuple(random_scene(seed).constants[0] for seed in (3, 2, 1))
    assert all(abs(one) < 3 for one in c32.from_truth)  # each is so in 99.7 % of all seeds
    u = np.array([one.u for one in c32.estimates])  # tops that differ by 10 % make no mean agree with the truth
    assert c32.truth[1] == pytest.approx(u @ c32.from_truth / np.sqrt(u @ u))
    assert all(0 < group.statistics["rms_residual"] < 0.06 for group in of.groups)  # u of a reading is 0.03 Hz
    reported = of.found.combined.fit("disc").constants["c32"]
    assert (c32.mean.value, c32.mean.u) == pytest.approx((reported.value, reported.u), rel=1e-12)


def with_changes(root, into, group, changes):
    """Copy runs, and change the record of one group's."""
    for folder in root.glob("2*"):
        shutil.copytree(folder, into / folder.name)
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        changed = record | (changes if record["group"] == group else {})
        (into / folder.name / RECORD).write_text(json.dumps(changed), encoding="utf-8")
    return into


def test_a_real_run_has_no_truth(of_three, tmp_path):
    of = compared(with_changes(of_three, tmp_path, "Group 10", {"synthetic": False}))
    assert of.quantities[0].truths.count(None) == 1
    assert not of.others


@pytest.mark.parametrize("group", [HOSTILE, "Group 10"])
def test_the_page_names_groups_whose_seed_has_another_law(of_three, tmp_path, group):
    scene = {"drag": {"law": "stokes", "coefficient": 0.003}}
    root = with_changes(of_three, tmp_path, group, {"world": None, "configuration": {"scene": scene}})
    of = compared(root)
    assert of.model == "disc"
    assert of.quantities[0].truths.count(None) == 1
    assert of.others == {group: "stokes"}
    page = write_class([root], tmp_path / "class.html").read_text(encoding="utf-8")
    assert f"have another law, and so no truth to compare with: {escape(group)} (stokes)." in page


def test_two_runs_of_a_group_are_no_two_groups(of_three, tmp_path):
    assert "mean of 3 groups" in finding(compared(of_three))
    assert "3 runs of 2 groups" in finding(compared(with_changes(of_three, tmp_path, "Group 10", {"group": "Group 2"})))


def test_two_runs_of_a_group_have_two_names_in_the_figure(of_three, tmp_path):
    of = compared(with_changes(of_three, tmp_path, "Group 10", {"group": "Group 2"}))
    names = [label.get_text() for label in class_figure(of).axes[0].get_yticklabels()]
    assert len(set(names)) == 3
    assert sum(name.startswith("Group 2") for name in names) == 2


def test_a_folder_is_the_group_of_its_files(tmp_path):
    """Also of a file with several runs, and of one that cannot be read, where all files have the same name."""
    folders = [tmp_path / "class" / name for name in ("Anna", "Ben", "Carl", "Dora")]
    for seed, folder in enumerate(folders):
        folder.mkdir(parents=True)
        spin_down_csv(folder / "readings.csv", seed=seed)
    shutil.copy(SAMPLE_DATA / "student-files" / "runs-under-one-time.csv", folders[1] / "readings.csv")
    (folders[2] / "readings.csv").write_text("t [s],f [Hz]\n0,38\n10,37.2\n20,3x.5\n30,35\n", encoding="utf-8")
    for paths in ([tmp_path], [tmp_path / "class"], folders):
        page = Page(write_class(paths, tmp_path / "class.html").read_text(encoding="utf-8")).text
        assert re.search(r"Class of 4 groups.*To repeat: Carl", page, re.DOTALL)
        assert all(name in page for name in ("Anna", "Ben, ", "Dora"))
        assert "readings.csv," not in page.split("Made by")[0].replace("readings.csv, line", "")


def test_groups_are_in_the_order_of_their_numbers_and_one_that_was_not_read_has_its_row(tmp_path):
    (tmp_path / "files").mkdir()
    for k in (1, 3, 10):
        (tmp_path / f"Group {k}").mkdir()
        spin_down_csv(tmp_path / f"Group {k}" / "ours.csv", seed=k)
        spin_down_csv(tmp_path / "files" / f"g{k}.csv", seed=k)
    (tmp_path / "Group 4").mkdir()
    (tmp_path / "Group 4" / "ours.csv").write_text("t [s],f [Hz]\n0,38\n10,37.2\n20,3x.5\n30,35\n", "utf-8")
    page = write_class(sorted(tmp_path.glob("Group *")), tmp_path / "class.html").read_text(encoding="utf-8")
    values = Page(page).text.split("from the others [u]")[1]
    assert re.search(r"Group 1 good.*Group 3 good.*Group 10 good.*Group 4 repeat — —\s+class mean", values, re.DOTALL)
    shown = []
    write_class([tmp_path / "files" / f"g{k}.csv" for k in (10, 3, 1)], tmp_path / "c.html", show=shown.append)
    assert [row.cells[0] for row in shown[0].rows] == ["g1.csv", "g3.csv", "g10.csv"]


def test_a_group_whose_readings_exclude_the_law_of_the_class_is_to_look_at(tmp_path):
    for seed in range(10, 22):  # with few others its law is that of the class
        spin_down_csv(tmp_path / f"{seed}.csv", seed=seed)
    rows, omega = ["time_s,spin_frequency_hz,spin_frequency_u_hz"], 2 * np.pi * 40
    for k, noise in enumerate(0.03 * np.random.default_rng(5).standard_normal(20)):  # a hair touches the top
        rows.append(f"{10 * k},{omega / 2 / np.pi + noise:.4f},0.03")
        for _ in range(1000):
            omega -= 0.01 * (2.0e-4 * omega**1.5 + 0.12)
    (tmp_path / "5.csv").write_text("\n".join([*rows, ""]), encoding="utf-8")
    page = Page(write_class(sorted(tmp_path.glob("*.csv")), tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert page.count("its readings exclude the law by which the class is compared") == 1
    assert re.search(r"5.csv look .*its readings exclude the law", page)


def test_the_only_folder_beside_runs_is_a_group(of_three, tmp_path):
    shutil.copytree(of_three, tmp_path / "class")
    (tmp_path / "class" / "Group 5").mkdir()
    spin_down_csv(tmp_path / "class" / "Group 5" / "ours.csv")
    page = Page(write_class([tmp_path / "class"], tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert re.search(r"Group 5\s+(good|look)", page)


def test_files_with_one_name_are_listed_with_their_folders(tmp_path):
    for seed, name in enumerate(("Anna", "Ben")):
        (tmp_path / name).mkdir()
        spin_down_csv(tmp_path / name / "spin.csv", seed=seed)
    page = Page(write_class([tmp_path], tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert re.search(r"Anna [^A-Z]*Anna/spin.csv Ben [^A-Z]*Ben/spin.csv", page.split("Runs")[-1])
    book = CalamineWorkbook.from_path(write_class([tmp_path], tmp_path / "class.xlsx"))
    assert [row[3] for row in book.get_sheet_by_name("spindown groups").to_python()] == [
        "run", "Anna/spin.csv", "Ben/spin.csv",
    ]  # fmt: skip


def test_files_of_one_folder_and_runs_of_no_group_are_each_by_itself(tmp_path):
    """The folder that holds all of them is no group; a browser's duplicate and a run copied there are none, too."""
    for name in ("anna", "ben"):
        spin_down_csv(tmp_path / f"{name}.csv", seed=len(name))
        shutil.copytree(SAMPLE_DATA / "spin-down-1", tmp_path / "runs" / name)
    shutil.copy(tmp_path / "anna.csv", tmp_path / "anna (1).csv")
    page = Page(write_class([tmp_path], tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert "Class of 3 runs" in page
    assert "To repeat" not in page
    for name, copied in (("anna (1).csv", "anna.csv"), ("ben", "anna")):
        assert re.search(rf"{re.escape(name)}: holds the same readings as \S*{re.escape(copied)}, counted once", page)


def test_a_group_with_the_seed_of_another_one_is_named_and_two_copies_of_a_run_are_not(of_three, tmp_path):
    root = with_changes(of_three, tmp_path, "Group 2", {})
    for name, group in (("again", "Group 2"), ("seed", "Group 3")):
        (run,) = (one for one in root.glob("2*") if '"group": "Group 2"' in (one / RECORD).read_text(encoding="utf-8"))
        shutil.copytree(run, root / name)
        record = json.loads((run / RECORD).read_text(encoding="utf-8"))
        (root / name / RECORD).write_text(json.dumps(record | {"group": group}), encoding="utf-8")
    page = Page(write_class([root], tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert "Class of 4 groups" in page
    assert "2 of 4 results are good. To look at: Group 2 and Group 3." in page
    assert "mean of 3 groups" in page
    for name, other in (("Group 2", "Group 3"), ("Group 3", "Group 2")):
        assert f"{name} look holds the same readings as {other}: a group needs a seed or a file of its own" in page


def test_a_zip_beside_the_run_that_it_holds_is_no_group_and_one_alone_is(of_three, tmp_path):
    root = with_changes(of_three, tmp_path / "class", "", {})
    first, second, alone = sorted(root.glob("2*"))
    for name, run in (("sent", first), (second.name, second), ("alone", alone)):
        shutil.make_archive(str(root / name), "zip", root, run.name)
    shutil.rmtree(alone)
    (second / RECORD).write_text((second / RECORD).read_text(encoding="utf-8") + "\n", encoding="utf-8")
    for paths in ([root], sorted(root.iterdir())):
        page = Page(write_class(paths, tmp_path / "class.html").read_text(encoding="utf-8")).text
        assert "Class of 3 groups" in page
        assert "2 of 3 results are good. To repeat: alone.zip." in page
        assert "sent.zip" not in page.split("Made by")[0]
        assert f"{second.name}.zip" not in page.split("Made by")[0]


def test_a_run_given_twice_is_named(of_three, tmp_path):
    root = with_changes(of_three, tmp_path, "Group 2", {})
    run, *_ = sorted(root.glob("2*"))
    shutil.copytree(run, root / "copy")
    assert "holds the same readings as" in write_class([root], tmp_path / "class.html").read_text(encoding="utf-8")


def test_what_levilab_has_written_about_a_class_is_no_group_of_it(of_three, tmp_path, levilab):
    root = with_changes(of_three, tmp_path / "class", "", {})
    for name in ("all.csv", "all.xlsx", "all.zip"):
        levilab("export", root, "-o", root / name)
    levilab("export", next(root.glob("2*")), "-o", root / "one.xlsx")
    write_class([root], root / "class.xlsx")
    page = Page(write_class([root], tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert "Class of 3 groups" in page
    assert "3 of 3 results are good." in page


def test_runs_of_several_scenes_are_named_where_a_truth_is_not_known(of_three, tmp_path):
    changed = {"configuration": {"scene": {"name": "practice"}}}
    known = with_changes(of_three, tmp_path / "known", "Group 2", changed)
    assert "several scenes" not in verdict(compared(known))  # each beside its own truth
    unknown = with_changes(of_three, tmp_path / "unknown", "Group 2", changed | {"seed": None})
    assert "several scenes of the virtual bench (a spin alone and practice)" in verdict(compared(unknown))


@pytest.mark.parametrize(("value", "u"), [(1.0, float("nan")), (1.0, 0.0), (1.0, None), (float("nan"), 1.0)])
def test_a_value_without_a_finite_u_is_not_compared(value, u):
    parts = [{"values": {"mean": {"value": one, "u": of, "unit": "Hz"}}} for one, of in [(1.0, 0.1), (value, u)]]
    quantity = _quantity("mean", ANALYSES["limit"], "", parts, [Truth(), Truth()], runs=parts, doubts=[False, False])
    assert [one is None for one in quantity.estimates] == [False, True]
    assert quantity.mean.value == 1.0


def test_no_number_of_groups_makes_the_u_of_the_sway_smaller_which_is_common_to_them():
    parts = [{"values": {"ratio": {"value": 1.0028 + k * 1e-4, "u": 0.0018, "unit": "1"}}} for k in range(8)]
    truth = Truth({"ratio": 1.0})
    of = [
        _quantity("ratio", ANALYSES["sway"], "", parts[:n], [truth] * n, runs=parts[:n], doubts=[False] * n)
        for n in (1, 2, 8)
    ]
    assert [one.mean.u for one in of] == pytest.approx([0.0018] * 3, rel=0.01)
    assert [one.truth[1] for one in of] == pytest.approx([1.6] * 3, abs=0.2)


def scans_of_one_base(root):
    """Four groups scan one base: a noise of their own, and the calliper of one group."""
    for k in range(4):
        scan = shutil.copytree(SAMPLE_DATA / "field-scan", root / f"G{k}" / "scan")
        head, *rows = (scan / "readings.csv").read_text(encoding="utf-8").splitlines()
        cells = [row.split(",") for row in rows]
        column, noise = head.split(",").index("flux_density_t"), 5e-5 * np.random.default_rng(k).normal(size=len(rows))
        for row, more in zip(cells, noise, strict=True):
            row[column] = str(float(row[column]) + more)
        (scan / "readings.csv").write_text("\n".join([head, *map(",".join, cells)]), encoding="utf-8")
    return root


def test_the_mean_of_a_class_has_the_u_of_the_analysis_of_its_runs(tmp_path):
    of = compared(scans_of_one_base(tmp_path), "field")
    for one in of.quantities:
        assert one.mean.u == pytest.approx(of.found.values[one.name].u)
        assert one.mean.u >= np.mean([group.u for group in one.estimates])
    assert "added in quadrature" in statistics_of_agreement(of)
    with speaking("de"):
        page = write_class([tmp_path], tmp_path / "class.html").read_text(encoding="utf-8")
    assert "kommt quadratisch hinzu" in page
    assert len(re.findall(r"<td[^>]*>scan</td>", page)) == 4  # a folder's name has no language
    for budget in ANALYSES["field"].budget_of_all(of.found):
        assert budget.u == pytest.approx(np.sqrt(sum(row.contribution**2 for row in budget.included)))


def test_what_a_tilt_leaves_to_the_drag_is_no_smaller_in_the_mean_of_a_class(of_three):
    row = ANALYSES["spindown"]
    of = class_of(row, row.analyze([of_three], row.options(tilt="fitted")))
    (c32,) = of.quantities
    assert all(c32.shared_u)
    assert c32.mean.u == pytest.approx(of.found.combined.fit("disc").constants["c32"].u)


@pytest.mark.parametrize(("experiment", "names"), [("field", ["strength", "origin", "thickness"]), ("limit", ["mean"])])
def test_other_experiments_have_their_truths_too(experiment, names, tmp_path):
    settings = {"field": ("field.settle_s=0",), "limit": ("limit.repetitions=3", "limit.hold_s=0")}
    of = compared(measured(tmp_path, ["A", "B"], experiment, *settings[experiment]), experiment)
    assert [one.name for one in of.quantities] == names
    scene = random_scene(1)
    truth = {"strength": scene.base.strength_t_m, "mean": SpinScene().fall_hz}[names[0]]
    assert of.quantities[0].truths[0] == truth
    assert all(abs(one) < 3.5 for quantity in of.quantities for one in quantity.from_truth)
    if experiment == "field":
        assert [mark.word for mark in of.marks] == [GOOD, GOOD]


def test_held_spins_are_compared_by_their_drag_and_no_residuals_are_spoken_of(tmp_path):
    root = measured(tmp_path, ["A", "B"], "hold", "hold.longest_s=100")
    (drag,) = compared(root, "hold").quantities
    assert drag.symbol == "d"
    assert drag.truths[0] != drag.truths[1]
    assert all(abs(one) < 3.5 for one in drag.from_truth)
    assert "Residuals" not in write_class([root], tmp_path / "class.html").read_text(encoding="utf-8")


def test_groups_that_held_different_spins_have_no_mean_drag(tmp_path, monkeypatch):
    monkeypatch.setattr("levilab.report.beside.gross_errors", lambda values, _: np.arange(len(values)) == 1)
    for k, run in enumerate(sorted((SAMPLE_DATA / "hold").glob("*-hz"))):
        folder = tmp_path / "class" / run.name
        shutil.copytree(run, folder)
        record = json.loads((run / RECORD).read_text(encoding="utf-8"))
        (folder / RECORD).write_text(json.dumps(record | {"group": f"Group {k}"}), encoding="utf-8")
    of = compared(tmp_path / "class", "hold")
    (drag,) = of.quantities
    assert all(drag.estimates)
    assert drag.from_class == (None,) * 4
    assert "The groups have no common d: the groups held different spins, and the drag rises" in verdict(of)
    assert "scatter" not in agreement(of)
    assert finding(of) == "d of 4 groups"
    page = write_class([tmp_path / "class"], tmp_path / "class.html").read_text(encoding="utf-8")
    assert "mean of the class" not in page
    assert "class mean" not in page
    assert "χ²" not in page
    write_class([tmp_path / "class"], tmp_path / "class.xlsx")


def test_a_group_whose_limits_are_twice_those_of_the_others_is_to_look(tmp_path):
    for group, factor in enumerate((1, 1, 2)):
        limits = np.random.default_rng(group).normal(21.9 * factor, 0.2, 8).round(2)
        (tmp_path / f"G{group}.csv").write_text(
            "\n".join(["Nr.;Fallfrequenz in Hz", *(f"{k};{one}" for k, one in enumerate(limits, 1))]), encoding="utf-8"
        )
    of = compared(tmp_path, "limit")
    assert [mark.word for mark in of.marks] == [GOOD, GOOD, LOOK]
    assert of.marks[2].why[0].startswith("upper limits, where most groups have lower ones")


def test_lower_and_upper_limits_have_no_mean(tmp_path):
    for kind in ("lower", "upper"):
        shutil.copytree(SAMPLE_DATA / f"{kind}-limits", tmp_path / kind)
        record = json.loads((tmp_path / kind / RECORD).read_text(encoding="utf-8"))
        (tmp_path / kind / RECORD).write_text(json.dumps(record | {"group": kind}), encoding="utf-8")
    of = compared(tmp_path, "limit")
    assert all(of.quantities[0].estimates)
    assert "no common mean: some groups measured lower limits, others upper ones; compare each kind alone." in verdict(
        of
    )


def test_a_file_of_a_folder_that_only_one_analysis_searches_is_named(of_three, tmp_path):
    """Analyses of the runs do not search the folder with files; one file has a question that a command answers."""
    measured(tmp_path / "runs", ["Group 1"], "field", "field.settle_s=0")
    (files := tmp_path / "files").mkdir()
    spin_down_csv(files / "good.csv")
    (files / "rpm.csv").write_text("t,f\n" + "".join(f"{10 * k},{2400 - 60 * k}\n" for k in range(15)), "utf-8")
    write_class([tmp_path / "runs", files], tmp_path / "class.html", tell=(told := []).append)
    assert f"levilab open {files / 'rpm.csv'} asks for them" in str(told)
    write_class([of_three, files / "rpm.csv"], tmp_path / "class.html", tell=(told := []).append)
    (files / "good.csv").unlink()
    page = Page(write_class([of_three, files], tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert re.search(r"repeat not read: \S+rpm.csv: a table.* levilab open \S+rpm.csv asks for them", page)
    assert f'levilab open {files / "rpm.csv"} --columns "t=1,f=2 [rpm]" --keep answers' in str(told)


def test_a_group_with_a_seed_that_is_not_its_worksheets_is_named(tmp_path):
    for group, seed in (("Group 1", 7), ("Group 2", 8), ("Group 3", 5), ("Lions", 90)):
        acquired("spin", seed=seed, group=group, out=tmp_path, settings=RAISED_QUICKLY)
    of = compared(tmp_path)
    whys = {group.source.name: mark.why for group, mark in zip(of.groups, of.marks, strict=True)}
    assert whys["Group 3"] == ("seed 5, where the worksheet of the other groups lists 9",)
    assert not any("worksheet" in why for name, why in whys.items() if name != "Group 3")


def test_the_u_beside_a_mean_and_its_distance_from_the_truth_are_of_one_number(of_three, tmp_path):
    page = Page(write_class([of_three], tmp_path / "class.html").read_text(encoding="utf-8")).text
    value, digits, distance = re.search(r"mean − truth (−?[\d.]+)\(([\d.]+)\)×10\S+ (\S+) value", page).groups()
    shown = float(value.replace("−", "-")) / float(digits)  # 1.0(1.6)
    assert float(distance.replace("−", "-")) == pytest.approx(shown, rel=0.1, abs=0.06)  # of rounded digits
    assert f"truth (mean − truth = {value}({digits})×10⁻" in page


def test_page_and_pdf_begin_with_the_result(of_three, tmp_path):
    page = write_class([of_three], tmp_path / "new" / "class.html").read_text(encoding="utf-8")
    places = [page.index(f">{title}<") for title in ("Result", "Figure", "Runs")]
    assert places == sorted(places)
    assert "SYNTHETIC." in page
    assert "rms residual [Hz]" in page
    assert "3 of 3 values lie within 2 u of it" in page
    assert HOSTILE not in page
    assert write_class([of_three], tmp_path / "class.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("sample", ["hold", "sway", "trace-tape", "precession-sweep", "upper-limits"])
def test_every_analysis_can_be_compared(sample, tmp_path):
    page = write_class([SAMPLE_DATA / sample], tmp_path / "class.html").read_text(encoding="utf-8")
    assert ">Result<" in page
    assert (">Figure<" in page) is (sample == "hold") or "alone measured this:" in page
    assert ("the mean keeps the u of one group" in page) is (sample == "sway")


def test_who_must_repeat_is_said_first_and_why(of_three, tmp_path):
    """A group that wrote half of each spin down, and one whose readings are no numbers."""
    root = with_changes(of_three, tmp_path, "", {})
    (wrong,) = (folder for folder in root.glob("2*") if '"group": "Group 2"' in (folder / RECORD).read_text("utf-8"))
    heads, *rows = (wrong / "readings.csv").read_text(encoding="utf-8").splitlines()
    halved = [f"{t},{float(spin) / 2},{u}" for t, spin, u in (row.split(",") for row in rows)]
    (wrong / "readings.csv").write_text("\n".join([heads, *halved, ""]), encoding="utf-8")
    (root / "Group 4.csv").write_text("t in s,f in Hz\n0,40\n10,abc\n20,37\n", encoding="utf-8")
    in_rpm = "".join(f"{10 * k},{2400 - 60 * k}\n" for k in range(15))  # or in Hz: the file does not say it
    (root / "Group 5.csv").write_text(f"t,f\n{in_rpm}", encoding="utf-8")
    of = compared(root)
    assert {group.source.name: one.word for group, one in zip(of.groups, of.marks, strict=True)} == {
        HOSTILE: GOOD, "Group 2": REPEAT, "Group 10": GOOD,
    }  # fmt: skip
    assert verdict(of).startswith(whose := "2 of 3 results are good. To repeat: Group 2.")
    assert f"{whose} levilab class says why." in Page(render([(of.analysis, of.found)])).text
    assert of.quantities[0].used == tuple(group.source.name != "Group 2" for group in of.groups)
    assert of.quantities[0].mean.value == pytest.approx(2.4e-4, rel=0.03)  # the halved spins have 3.3e-4
    assert [[line.get_marker() for line in axes.lines].count(">") for axes in class_figure(of).axes] == [1, 1]
    (root / "Group 6.xlsx").write_bytes(b"PK\x03\x04" + bytes(300))
    (root / "Group 7.csv").write_bytes(b"")
    (root / "photo.jpg").write_bytes(b"\xff\xd8\xff" + bytes(300))
    unread = {
        "Group 4.csv": ", line 1: holds 2 readings.* line 3: '10,abc' is no reading",
        "Group 5.csv": r': a table whose columns are not certain, which no search reads: `?levilab open "[^"]+5.csv"',
        "Group 6.xlsx": ": is a damaged ZIP or Excel file",
        "Group 7.csv": r": an empty file \(record again\)",
    }
    for paths in ([root], [*root.iterdir()]):
        written = write_class(paths, tmp_path / "class.html", tell=(told := []).append, show=(shown := []).append)
        page = Page(written.read_text("utf-8")).text
        assert f"2 of 7 results are good. To repeat: Group 2, {', '.join([*unread][:-1])} and Group 7.csv." in page
        for name, why in unread.items() if paths == [root] else ():
            assert re.search(rf"{name} repeat not read: \S*{name[:-4]}.*{why}", page)
            (said,) = (text for text in told if text.startswith(f"{name}: not read: "))
            assert re.search(why, said)
            assert (name, REPEAT, "") in [row.cells for row in shown[0].rows]
        assert "without readings: a picture (photo.jpg)" in told
        assert "without readings: a picture (photo.jpg)" in page
        assert "1 note" in page
        write_class(paths, book := tmp_path / "class.xlsx")
        rows = CalamineWorkbook.from_path(book).get_sheet_by_name("spindown groups").to_python()
        assert {row[0] for row in rows if row[1] == REPEAT} == {"Group 2", *unread}
    assert re.search(r"Group 2 repeat \S+: the spin is about [^:]+ C₃/₂: \+\d+\.\d u from its truth", page)


def test_a_wrong_unit_is_the_first_reason_and_what_no_law_fits_then_is_none(tmp_path):
    for k in range(2):
        spin_down_csv(tmp_path / f"{k}.csv", seed=k)
    heads, *rows = (tmp_path / "1.csv").read_text(encoding="utf-8").splitlines()
    times_60 = [f"{t},{60 * float(f)},{u}" for t, f, u in (row.split(",") for row in rows)]
    (tmp_path / "1.csv").write_text("\n".join([heads, *times_60, ""]), encoding="utf-8")
    _, mark = compared(tmp_path).marks
    assert "Hz, a Levitron spins at 20 to 60 Hz; say the unit" in mark.why[0]
    assert not any("fit" in text for text in mark.why)
    assert any("the fit did not converge" in text for text in mark.notes)


def test_tables_without_u_and_with_fewer_readings_in_the_same_time_are_good(tmp_path):
    heads, *rows = (SAMPLE_DATA / "spin-down-1" / "readings.csv").read_text(encoding="utf-8").splitlines()
    for every in (1, 3):
        shown = [row.rpartition(",")[0] for row in (heads, *rows[::every])]
        (tmp_path / f"each {every}.csv").write_text("\n".join([*shown, ""]), encoding="utf-8")
    of = compared(tmp_path)
    assert any("no uncertainties" in text for text in of.found.all_warnings)
    assert [one.why for one in of.marks if one.word != GOOD] == []
    assert finding(of).endswith("mean of 2 runs")
    assert [group.best_model for group in of.groups] == [
        run.best if run.verdict.decided else "undecided" for run in of.found.runs
    ]


def test_a_group_whose_readings_no_law_describes_repeats_and_is_in_no_mean(tmp_path):
    for seed in (1, 2, 3):
        spin_down_csv(tmp_path / f"Ben {seed}.csv", seed=seed)
    good = compared(tmp_path)
    spin_down_csv(tmp_path / "Anna.csv", jump=3.0)
    of = compared(tmp_path)
    assert [one.word for one in of.marks] == [REPEAT, GOOD, GOOD, GOOD]
    assert of.marks[0].why[0].startswith("no law describes the readings: they rise by ")
    assert [one.mean for one in of.quantities] == [one.mean for one in good.quantities]
    page = Page(write_class([tmp_path], tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert "3 of 4 results are good. To repeat: Anna.csv." in page
    assert "Anna.csv repeat no law describes the readings" in page


def test_sheets_that_are_read_leave_no_workbook_unread_and_names_with_commas_stay_apart(tmp_path):
    for group in ("Eva", "Fay"):
        (tmp_path / group).mkdir()
    spin_down_csv(tmp_path / "Eva" / "a.csv", u=False)
    (tmp_path / "Eva" / "b.csv").write_bytes(b"")
    (tmp_path / "Fay" / "c.csv").write_bytes(b"")
    with xlsxwriter.Workbook(tmp_path / "Fay" / "1.xlsx") as book:
        for name, seed in (("Run A", 2), ("Run B", 3)):
            path = spin_down_csv(tmp_path / "made.csv", u=False, seed=seed)
            for k, row in enumerate(path.read_text("utf-8").splitlines()):
                sheet = book.get_worksheet_by_name(name) or book.add_worksheet(name)
                sheet.write_row(k, 0, [float(cell) if k else cell for cell in row.split(",")])
    path.unlink()
    shutil.copy(SAMPLE_DATA / "scope-files" / "recording.wav", tmp_path)
    page = Page(write_class([tmp_path], tmp_path / "class.html").read_text("utf-8")).text
    assert "1.xlsx repeat" not in page
    assert "To repeat: Eva, b.csv; Fay, c.csv." in page


def test_a_table_that_was_analyzed_without_doubtful_rows_is_not_called_unusable(tmp_path):
    table = tmp_path / "a.csv"
    table.write_text("t in s,f in Hz\n" + "".join(f"{10 * k},{40 - k}\n" for k in range(12)) + "130,2l\n", "utf-8")
    save(row := ANALYSES["spindown"], row.analyze([table], row.options_from({"skip_doubtful": True})))
    write_class([tmp_path], tmp_path / "class.html", tell=(told := []).append)
    (said,) = told
    assert f"{tmp_path.name}: the readings lie on the power law" in said  # as they are made, and nothing of a row


def test_page_and_spreadsheet_of_a_mixed_class_have_the_same_groups_and_numbers(of_three, tmp_path):
    """Three groups with spin-downs, one with a damaged run, one with limits alone, and a data file."""
    root = with_changes(of_three, tmp_path / "class", "", {})
    measured(root, ["Group 4"], "limit", "limit.repetitions=8", "limit.hold_s=0")
    damaged = root / "d"
    shutil.copytree(next(one for one in root.glob("2*-spin-*")), damaged)
    record = json.loads((damaged / RECORD).read_text(encoding="utf-8"))
    (damaged / RECORD).write_text(json.dumps(record | {"group": "Group 5"}), encoding="utf-8")
    (damaged / "readings.csv").write_text("xx,yy\n", encoding="utf-8")
    spin_down_csv(root / "a.csv")
    page = Page(write_class([root], tmp_path / "class.html").read_text(encoding="utf-8")).text
    assert "Class of 6 groups" in page
    assert "4 of 5 results are good. To repeat: Group 5." in page
    assert "Of 4 runs and 1 data file, 4 did not come from a real bench" in page
    assert "spin-down: 3 of 4 inputs are SYNTHETIC" in page
    book = CalamineWorkbook.from_path(write_class([root], tmp_path / "class.xlsx"))
    (heads, own), (of_class, together) = (
        book.get_sheet_by_name(f"limit {name}").to_python() for name in ("groups", "class")
    )
    row, mean = dict(zip(heads, own, strict=True)), dict(zip(of_class, together, strict=True))
    assert (row["mean_hz"], row["mean_u_hz"], row["readings"]) == (mean["mean"], mean["u"], 8)
    assert row["mean_u_hz"] == compared(root, "limit").found.runs[0].statistics.mean.u  # that of levilab analyze
    expected = (row["mean_hz"] - row["mean_truth_hz"]) / row["mean_u_hz"]
    assert row["mean_from_the_truth_in_u"] == pytest.approx(expected)
    assert mean["from_the_truth_in_u"] == pytest.approx(expected / _width(7))
    assert mean["u_without_tops"] == pytest.approx(row["mean_u_hz"] * _width(7))


def test_a_run_of_few_readings_is_named_before_what_the_analysis_says(of_three, tmp_path):
    root = with_changes(of_three, tmp_path, "", {})
    (short,) = (folder for folder in root.glob("2*") if '"group": "Group 2"' in (folder / RECORD).read_text("utf-8"))
    lines = (short / "readings.csv").read_text(encoding="utf-8").splitlines()
    (short / "readings.csv").write_text("\n".join([*lines[:6], ""]), encoding="utf-8")
    of = compared(root)
    mark = of.marks[[group.source.name for group in of.groups].index("Group 2")]
    assert re.fullmatch(r"\d\d s of readings instead of \d{3} s: measure longer, if the times are right", mark.why[0])
    assert not any("AICc" in text for text in mark.why)
    assert any("AICc" in text for text in mark.notes)


def test_an_interrupted_run_is_continued_or_named_as_such(of_three, tmp_path):
    root = with_changes(of_three, tmp_path, "Group 2", {"status": "interrupted"})
    (run,) = (one for one in root.glob("2*") if '"group": "Group 2"' in (one / RECORD).read_text(encoding="utf-8"))
    lines = (run / "readings.csv").read_text(encoding="utf-8").splitlines()
    for count, says in ((6, f"s: the run was interrupted, levilab acquire spin --resume {run} continues it"),
                        (1, "not read, and the run was interrupted: ")):  # fmt: skip
        (run / "readings.csv").write_text("\n".join([*lines[:count], ""]), encoding="utf-8")
        page = Page(write_class([root], tmp_path / "class.html").read_text(encoding="utf-8")).text
        assert says in page


def test_groups_of_few_tops_differ_by_chance_as_often_as_p_says():
    """By u alone 5 tops each would make 13 % of all classes differ."""
    random, width, seldom = np.random.default_rng(1), _width(4), 0
    for _ in range(300):
        tops = random.normal(0, 0.25, (8, 5))
        seldom += compare(tops.mean(axis=1), width * tops.std(axis=1, ddof=1) / math.sqrt(5)).p < DIFFER
    assert seldom <= 11  # 300 × 2 %, and two standard deviations


def test_a_value_of_few_repetitions_is_far_off_as_seldom_as_a_normal_one():
    of = Compared("mean", "f", "Hz", (None,) * 3, (None, 2, 9), (None,) * 3, None, None, (False,) * 3)
    exact, *few = of.limits(3)
    assert exact == 3
    assert stats.t.sf(few, [2, 9]) == pytest.approx(stats.norm.sf(3))


def test_the_spreadsheet_has_numbers_texts_and_each_reading(of_three, tmp_path):
    file = write_class([of_three], tmp_path / "class.xlsx")
    book = CalamineWorkbook.from_path(file)
    assert book.sheet_names == ["spindown groups", "spindown class", "spindown readings"]
    heads, *rows = book.get_sheet_by_name("spindown groups").to_python()
    by_head = [dict(zip(heads, row, strict=True)) for row in rows]
    assert [row["group"] for row in by_head] == [HOSTILE, "Group 2", "Group 10"]
    c32 = compared(of_three).quantities[0]
    assert [row["c32_per_sqrt_rad_s"] for row in by_head] == pytest.approx([one.value for one in c32.estimates])
    assert [row["c32_from_the_truth_in_u"] for row in by_head] == pytest.approx(c32.from_truth)
    readings = book.get_sheet_by_name("spindown readings").to_python()
    assert len(readings) - 1 == sum(len(group.source.readings) for group in compared(of_three).groups)
    assert file.read_bytes() == write_class([of_three], tmp_path / "again.xlsx").read_bytes()


def test_another_ending_is_refused_with_those_that_are_known(of_three, tmp_path):
    with pytest.raises(UsageError, match=r"\.html, \.htm, \.pdf or \.xlsx"):
        write_class([of_three], tmp_path / "class.ods")


def test_a_law_whose_constants_are_not_compared_has_no_part_in_what_to_look_at(tmp_path):
    """Over a small fall of the spin c of the power law is known to a factor of several only."""
    t = np.arange(0, 100, 10.0)
    for k, start in enumerate([40.0, 39.0], start=1):
        spin = (start**-0.5 + 3e-4 * t) ** -2 + 0.03 * np.random.default_rng(k).standard_normal(t.size)
        rows = (f"{at:g},{hz:.3f},0.03\n" for at, hz in zip(t, spin, strict=True))
        (tmp_path / f"{k}.csv").write_text(f"t in s,f in Hz,u in Hz\n{''.join(rows)}", encoding="utf-8")
    of = compared(tmp_path)
    assert [one.name for one in of.quantities] == ["c32"]
    assert any("Power: c is known only to a factor" in text for text in of.found.all_warnings)
    assert not any("Power: " in text for mark in of.marks for text in (*mark.why, *mark.notes))


def class_of_files(root, factors):
    """Write a file of each group; factors: of its times and its spins."""
    for k, (times, spins) in enumerate(factors):
        path = spin_down_csv(root / f"G{k}.csv", seed=k)
        heads, *rows = path.read_text(encoding="utf-8").splitlines()
        scaled = (map(float, row.split(",")) for row in rows)
        rows = [f"{t * times!r},{f * spins!r},{u * spins!r}" for t, f, u in scaled]
        path.write_text("\n".join([heads, *rows, ""]), encoding="utf-8")
    return root


def test_a_value_far_beyond_the_others_repeats_and_is_in_no_mean(tmp_path):
    of = compared(class_of_files(tmp_path, [(3, 1), (0.3, 1), (1, 1), (1, 1), (1, 1), (0.75, 1)]))
    assert [mark.word for mark in of.marks] == [REPEAT, REPEAT, GOOD, GOOD, GOOD, LOOK]
    assert [mark.why for mark in of.marks if mark.why] == [
        (f"C₃/₂: {factor} times the median of the others{beyond}",)
        for factor, beyond in (
            ("0.33", ", more than tops differ"), ("3.3", ", more than tops differ"), ("1.3", ""),
        )
    ]  # fmt: skip
    assert of.quantities[0].used == (False, False, True, True, True, True)


def test_half_of_the_value_of_five_others_is_more_probably_wrong_than_not(tmp_path):
    of = compared(class_of_files(tmp_path, [(2, 1), *[(1, 1)] * 5]))
    assert [mark.word for mark in of.marks] == [REPEAT, *[GOOD] * 5]


def test_a_wrong_value_of_what_may_be_zero_is_some_u_and_no_multiple_of_the_others():
    values = [0.01, -0.01, 0.0, 0.5]
    parts = [{"values": {"intercept": {"value": one, "u": 0.01, "unit": "Hz"}}} for one in values]
    of = _quantity("intercept", ANALYSES["precession"], "", parts, [Truth()] * 4, runs=parts, doubts=[False] * 4)
    assert of.wrong[3] > 0.95
    assert _beside_others(of, 3).endswith(": +35.4 u from the others")


def test_groups_of_which_each_is_probably_wrong_are_compared_and_not_left_out():
    values, u = [0.8892, 0.002807, 56.43, 0.8727, 28.40, -0.00134], [4.75e-3, 6.6e-7, 0.55, 0.0735, 0.223, 8.6e-5]
    parts = [{"values": {"mean": {"value": x, "u": of, "unit": "Hz"}}} for x, of in zip(values, u, strict=True)]
    of = _quantity("mean", ANALYSES["limit"], "", parts, [Truth()] * 6, runs=parts, doubts=[False] * 6)
    assert min(of.wrong) > 0.5
    assert of.together
    assert of.used == (True,) * 6


def test_groups_that_all_differ_by_more_than_tops_do_are_not_said_to_differ_as_tops(tmp_path):
    of = compared(class_of_files(tmp_path, [(1, 1), (3, 1)]))
    assert [mark.word for mark in of.marks] == [LOOK, LOOK]
    assert "more than their u, and more than tops do: compare how they measured" in agreement(of)


def test_a_class_that_is_analyzed_says_how_much_is_done(tmp_path):
    shares = []
    write_class([class_of_files(tmp_path, [(1, 1)] * 4)], tmp_path / "class.html", progress=shares.append)
    assert shares == [0, 0.25, 0.5, 0.75]


def test_a_run_that_is_too_long_makes_no_other_one_short(tmp_path):
    of = compared(class_of_files(tmp_path, [(1, 1), (3.5, 1), (1, 1)]))
    assert [mark.why for mark in of.marks if mark.word != REPEAT] == [(), ()]


def test_a_group_whose_stored_result_has_other_options_is_to_look_at(tmp_path):
    row = ANALYSES["spindown"]
    class_of_files(tmp_path, [(1, 1)] * 3)
    save(row, row.analyze([tmp_path / "G1.csv"], row.options_from({"tilt": "none", "laws": ("disc", "stokes")})))
    marks = class_of(row, row.recall([tmp_path])).marks
    assert [mark.word for mark in marks] == [GOOD, LOOK, GOOD]
    assert marks[1].why[0] == "analyzed with --tilt none --laws disc,stokes, most groups with no options"


def test_the_command_that_a_doubt_advises_gives_the_class_another_result(tmp_path, levilab):
    """Also where the whole class has a result, which is older then."""
    for k, jump in enumerate((0.0, 3.0)):
        spin_down_csv(tmp_path / f"G{k}.csv", seed=k, jump=jump, n=20)
    row = ANALYSES["spindown"]
    save(row, row.analyze([tmp_path]))
    write_class([tmp_path], tmp_path / "class.html", tell=(told := []).append)
    (command,) = re.findall(r"levilab (analyze .* --st\w+ \S+) fits a part", str(told))
    levilab(*shlex.split(command))
    write_class([tmp_path], tmp_path / "class.html", tell=(told := []).append)
    assert "no law describes" not in str(told)
    assert "are fitted, as asked" in str(told)


def test_the_command_that_a_doubt_of_two_marks_advises_makes_the_group_good(tmp_path, levilab):
    class_of_files(tmp_path, [(1, 1), (1, 1), (1, 2)])
    write_class([tmp_path], tmp_path / "class.html", tell=(told := []).append)
    (command,) = re.findall(r"levilab (open \S*G2.csv --columns .* --keep) answers", str(told))
    levilab(*shlex.split(command))
    write_class([tmp_path], tmp_path / "class.html", tell=(told := []).append)
    assert "G2.csv: G2.csv" not in str(told)


def test_what_lies_far_beyond_the_others_is_an_arrow_with_its_value_and_stretches_no_axis(tmp_path):
    root = class_of_files(tmp_path, [(1, 1), (1, 1), (20, 1), (1, 1)])
    values = compared(root).quantities[0].estimates
    (axes,) = class_figure(compared(root)).axes
    assert [line.get_marker() for line in axes.lines].count("<") == 1
    assert [text.get_text().strip() for text in axes.texts] == [f"{1e4 * values[2].value:.3g}"]
    low, high = axes.get_xlim()
    assert high - low < 2e4 * np.ptp([values[k].value + side * values[k].u for k in (0, 1, 3) for side in (-1, 1)])


def test_a_group_without_u_leaves_no_error_in_the_spreadsheet(tmp_path):
    for k in range(3):
        spin_down_csv(tmp_path / f"{k}.csv", seed=k, u=k > 0)
    with zipfile.ZipFile(write_class([tmp_path], tmp_path / "class.xlsx")) as book:
        assert not any(b"#NUM!" in book.read(name) for name in book.namelist())


def test_sentences_in_a_text_file_are_no_result_to_repeat(tmp_path):
    class_of_files(tmp_path, [(1, 1), (1, 1)])
    (tmp_path / "notes.txt").write_text("Anna was ill.\nGroup 2 began at 12:30 with 3 tops\n", "utf-8")
    (tmp_path / "G3.txt").write_text("t in s\tf in Hz\n0\t40\n10\t39\n", "utf-8")
    (tmp_path / "G4.txt").write_text('time of the reading;spin of the top\n"0";"40"\n"10";"39"\n"20";"38"\n', "utf-8")
    page = write_class([tmp_path], tmp_path / "class.html", tell=(told := []).append).read_text("utf-8")
    assert "2 of 4 results are good. To repeat: G3.txt and G4.txt." in Page(page).text
    assert "without readings: a text without readings (notes.txt)" in told


def test_the_only_file_of_a_folder_is_of_the_folders_group(tmp_path):
    (tmp_path / "Anna").mkdir()
    file = spin_down_csv(tmp_path / "Anna" / "spin.csv")
    for path, name in ((tmp_path, "Anna"), (tmp_path / "Anna", "Anna"), (file, "spin.csv")):
        write_class([path], tmp_path / "class.html", show=(shown := []).append)
        assert [row.cells[0] for row in shown[0].rows] == [name]


def test_long_and_short_records_of_a_spin_are_one_class(tmp_path):
    for k, seconds in enumerate((3, 3, 30)):  # the longest has several windows
        np.savetxt(
            tmp_path / f"{k}.csv", np.arange(1, 38 * seconds) / 38.0, "%.7f", header="pulse time [s]", comments=""
        )
    (of,) = [class_of(row, found) for row, found in analyze_suiting([tmp_path], {})]
    assert [mark.word for mark in of.marks[:2]] == [GOOD, GOOD]


def test_recordings_of_falls_are_compared_by_their_drag_and_not_by_a_frequency(tmp_path):
    time = np.arange(4000 * 30) / 4000
    for k, c in enumerate((2.3e-4, 2.4e-4)):
        root = (2 * np.pi * 40) ** -0.5 + c * time / 2
        pulses = np.exp(20 * (np.cos(2 / c * (2 * np.pi * 40) ** 0.5 - 2 / c / root) - 1))
        noise = 0.02 * np.random.default_rng(k).standard_normal(time.size)
        wavfile.write(tmp_path / f"{k}.wav", 4000, (12000 * (pulses + noise)).astype(np.int16))
    write_class([tmp_path], tmp_path / "class.html", show=(shown := []).append)
    assert [one.title for one in shown] == ["spin-down"]
    shutil.copy(SAMPLE_DATA / "scope-files" / "recording.wav", tmp_path)  # of a spin that does not fall
    write_class([tmp_path], tmp_path / "class.html", show=(shown := []).append)
    assert [[row.cells[0] for row in one.rows] for one in shown] == [["0.wav", "1.wav"], ["recording.wav"]]
