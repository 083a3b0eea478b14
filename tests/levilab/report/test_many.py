"""A report of many runs: an overview, in which nothing is said a hundred times and nothing is left out."""

import json
import re
import shutil

import pytest

from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.inputs.unread import NoneUsable
from levilab.pipelines.limit.figure import limit_figure
from levilab.pipelines.suits import save
from levilab.present.document.blocks import Fact
from levilab.report.document import MOST_IN_FULL
from levilab.report.groups.document import write_class
from levilab.report.inputs import Input, in_common
from levilab.report.page import write_report
from many_runs import make_runs
from support.pages import Page
from support.paths import SAMPLE_DATA

COUNT = 16


@pytest.fixture
def page(tmp_path, undrawn_figures):
    """Of sixteen runs, two of which are broken."""
    make_runs(tmp_path / "runs", COUNT, broken=8)
    output = write_report([tmp_path / "runs"], tmp_path / "report.html", tell=(told := []).append)
    assert [text.partition(" ")[0] for text in told] == ["skipped", "skipped"]
    return output.read_text(encoding="utf-8")


def test_facts_that_many_runs_share_stand_there_once(page):
    assert COUNT - 2 > MOST_IN_FULL
    assert page.count("<dt>Status</dt>") == page.count("no instruments recorded") == 1
    assert len(re.findall(r"<summary><strong>[^<]*spin-[0-9a-f]+</strong>", page)) == COUNT - 2
    assert page.count("This run alone") == COUNT - 2
    assert page.count("/run.json: is cut off") == 1, "a broken run is named once, not once by each analysis"
    assert "data:image/png;base64," in page
    assert all(f'id="{target}"' in page for target in re.findall(r'href="#([^"]+)"', page))


def test_a_single_fact_that_inputs_share_has_no_table_of_its_own():
    status, note, other = (Fact(name, ("text",)) for name in ("Status", "Note", "Other"))
    inputs = [Input(name, (status, note, last), ()) for name, last in (("a", other), ("b", note))]
    assert in_common(inputs) == (status, note)
    assert in_common([inputs[0], Input("c", (status,), ())]) == ()


def test_warnings_that_are_alike_stand_together(tmp_path):
    folders = make_runs(tmp_path / "runs", 6, broken=0)
    for folder in folders[:4]:
        with (folder / "readings.csv").open("a", encoding="utf-8") as file:
            file.write("200,")
    found = ANALYSES["spindown"].analyze([tmp_path / "runs"])
    torn = [alike for alike in found.grouped_warnings if "cut off" in alike[0]]
    assert [len(alike) for alike in torn] == [4]
    assert sorted(text for alike in found.grouped_warnings for text in alike) == sorted(found.all_warnings)


def test_of_many_runs_a_legend_does_not_name_each(tmp_path):
    limits = (SAMPLE_DATA / "upper-limits" / "readings.csv").read_text(encoding="utf-8")
    for k in range(9):
        (tmp_path / f"{k}.csv").write_text(limits.replace(",69.26", f",69.{k}6"), encoding="utf-8")
    found = ANALYSES["limit"].analyze([tmp_path])
    legend = limit_figure(found).axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts() if "runs" in text.get_text()] == ["9 runs: a top ± u"]
    assert len(legend.get_texts()) < len(found.sources)


@pytest.mark.usefixtures("undrawn_figures")
def test_several_results_of_one_file_are_all_shown_and_count_once_in_a_class(tmp_path):
    file = shutil.copy(SAMPLE_DATA / "spin-down-1" / "readings.csv", tmp_path / "a.csv")
    row, folders = ANALYSES["spindown"], [tmp_path / name for name in ("x1", "x2", "x4")]
    for folder, laws in zip(folders, [(), ("disc",), ("disc", "newton")], strict=True):
        save(row, row.analyze([file], row.options_from({"laws": laws} if laws else {})), folder)
    page = write_report(folders, tmp_path / "report.html").read_text(encoding="utf-8")
    assert re.findall(r"<h2>[^<]*top: a.csv \(([^<]*)\)</h2>", page) == ["x1", "x2", "x4"]
    assert "<h3>a.csv</h3>" in page
    assert re.findall(r"--laws ([^\s<]+)", page) == ["disc", "disc,newton"]
    page = write_class(folders, tmp_path / "class.html", tell=(told := []).append).read_text(encoding="utf-8")
    assert "a.csv (" in page
    assert "2 runs" not in page
    left_out = [text for text in told if "not counted, as a.csv (x1) is a result of the same" in text]
    assert [text.partition(":")[0] for text in left_out] == ["a.csv (x2)", "a.csv (x4)"]
    assert all(text in page for text in left_out)


@pytest.mark.parametrize("laws", [(), ("disc",)])
@pytest.mark.usefixtures("undrawn_figures")
def test_of_results_that_share_an_input_a_class_counts_that_once_and_all_others(tmp_path, laws):
    row = ANALYSES["spindown"]
    a, b, c = (
        shutil.copy(SAMPLE_DATA / f"spin-down-{k}" / "readings.csv", tmp_path / f"{name}.csv")
        for k, name in enumerate("abc", 1)
    )
    save(row, row.analyze([a, b]), tmp_path / "x1")
    save(row, row.analyze([a, c], row.options_from({"laws": laws} if laws else {})), tmp_path / "x2")
    paths = [tmp_path / "x1", tmp_path / "x2"]
    told, shown = [], []
    written = write_class(paths, tmp_path / "class.html", tell=told.append, show=shown.append)
    page = Page(written.read_text(encoding="utf-8")).text
    assert [text.partition(";")[0] for text in told if "not counted" in text] == [
        "a.csv (x2): not counted, as a.csv (x1) is a result of the same readings"
    ]
    assert [(one.title, len(one.rows)) for one in shown] == [("spin-down", 3)]
    save(row, row.analyze([a, b, c]), tmp_path / "x3")
    once = Page(write_class([tmp_path / "x3"], tmp_path / "class.html").read_text(encoding="utf-8")).text
    mean = r"class mean \S* ?\d\S+"
    assert re.findall(mean, page) == re.findall(mean, once) != []


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("write", [write_report, write_class])
@pytest.mark.usefixtures("undrawn_figures")
def test_an_input_that_cannot_be_used_is_named_and_ends_nothing(tmp_path, write, named):
    """A field whose base is not known, a track without a spin, a damaged result, and what is no table of readings."""
    (root := tmp_path / "runs").mkdir()
    for k in (1, 2):
        shutil.copytree(SAMPLE_DATA / f"spin-down-{k}", root / f"group-{k}")
    (root / "group-2" / "result.json").write_text("{", encoding="utf-8")
    shutil.copy(SAMPLE_DATA / "field-scan" / "readings.csv", root / "field.csv")
    shutil.copy(SAMPLE_DATA / "spin-down-3" / "readings.csv", root / "good.csv")
    places = "".join(f"{0.02 * k:.2f},{k % 7}e-3,{k % 5}e-3\n" for k in range(400))
    (root / "track.csv").write_text(f"t in s,x in m,y in m\n{places}", encoding="utf-8")
    (root / "short.csv").write_text("t in s,f in Hz\n0,40\n10,abc\n", encoding="utf-8")
    (root / "unit.csv").write_text("t,f\n" + "".join(f"{10 * k},{2400 - 60 * k}\n" for k in range(15)), "utf-8")
    (root / "empty.csv").write_text("", encoding="utf-8")
    paths = sorted(root.iterdir()) if named else [root]
    said = {write_report: "skipped", write_class: "repeat not read:"}[write]
    page = Page(write(paths, tmp_path / "page.html").read_text(encoding="utf-8")).text
    for name, reason in [
        ("field.csv", "the radii of the base are not known: write"), ("track.csv", "the spin is not known: a column"),
        ("short.csv", "at least 3 readings are needed"), ("group-2", "is cut off or not JSON"),
    ]:  # fmt: skip
        assert len(re.findall(f"{said} {root / name}.{{0,40}}{reason}", page)) == 1
    for name, doubt in [("unit.csv", "no unit, and would be in Hz"), ("empty.csv", "is empty")] if named else []:
        assert len(re.findall(f"{said} {root / name}.{{0,99}}{doubt}", page)) == 1
    assert "group-1" in page
    assert "good.csv" in page


@pytest.mark.usefixtures("undrawn_figures")
def test_inputs_of_which_an_analysis_can_use_none_are_each_named_with_its_reason(tmp_path):
    (root := tmp_path / "runs").mkdir()
    shutil.copy(SAMPLE_DATA / "spin-down-1" / "readings.csv", root / "good.csv")
    head, *rows = (SAMPLE_DATA / "field-scan" / "readings.csv").read_text("utf-8").splitlines()
    radii = "the radii of the base are not known"
    reasons = {"f1.csv": (radii, rows), "f2.csv": (radii, rows[1:]), "f3.csv": ("line 2", ["0.03,x"])}
    for name, (_, of_file) in reasons.items():
        (root / name).write_text("\n".join([head, *of_file, ""]), "utf-8")
    for paths in ([root], sorted(root.iterdir())):
        for write, said in ((write_report, "skipped"), (write_class, "repeat not read:")):
            page = Page(write(paths, tmp_path / "page.html").read_text(encoding="utf-8")).text
            for name, (why, _) in reasons.items():
                assert len(re.findall(f"{said} {root / name}[^ ]* {why}", page)) == 1
    with pytest.raises(NoneUsable, match=r"f1.csv: the radii .*; \S*f2.csv: the radii"):
        write_report([root / "f1.csv", root / "f2.csv"], tmp_path / "none.html")


@pytest.mark.usefixtures("undrawn_figures")
def test_a_file_with_a_result_and_another_result_of_it_are_both_shown(tmp_path):
    file = shutil.copy(SAMPLE_DATA / "spin-down-1" / "readings.csv", tmp_path / "a.csv")
    row = ANALYSES["spindown"]
    own, *_ = save(row, row.analyze([file]))
    save(row, row.analyze([file], row.options_from({"laws": ("disc",)})), tmp_path / "x2")
    paths = [tmp_path / "a.csv", own, tmp_path / "x2"]
    page = write_report(paths, tmp_path / "report.html").read_text(encoding="utf-8")
    assert re.findall(r"<h2>[^<]*top: (a.csv[^<]*)</h2>", page) == ["a.csv", "a.csv (x2)"]


@pytest.mark.usefixtures("undrawn_figures")
def test_two_experiments_of_a_group_have_two_names_where_all_inputs_stand(tmp_path):
    for name in ("spin-down-1", "field-scan"):
        shutil.copytree(SAMPLE_DATA / name, tmp_path / name)
        record = json.loads((tmp_path / name / "run.json").read_text(encoding="utf-8"))
        (tmp_path / name / "run.json").write_text(json.dumps(record | {"group": "Group 1"}), encoding="utf-8")
    page = Page(write_report([tmp_path], tmp_path / "report.html").read_text(encoding="utf-8")).text
    for about in (r"Each by itself", "The data"):
        assert re.search(rf"{about}.*?Group 1, spin-down-1.*?Group 1, field-scan", page)
