"""The groups of a class: their names are those of their runs, in every table, figure, report and list."""

import json

import pytest

from levilab.errors import UsageError
from levilab.pipelines.catalogue import ANALYSES
from levilab.report.document import document_of
from levilab.report.html.page import page_of
from levilab.report.tables.values import of_analysis
from levilab.runs.find import RECORD
from levilab.runs.listing import list_runs
from levilab.runs.run import READINGS
from support.acquisitions import asked
from support.paths import SAMPLE_DATA

SPINDOWN = ANALYSES["spindown"]


def make(folder, sample, **record):
    """Write a run of the sample data with another record."""
    sample_folder = SAMPLE_DATA / f"spin-down-{sample}"
    folder.mkdir(parents=True)
    content = json.loads((sample_folder / RECORD).read_text(encoding="utf-8"))
    (folder / RECORD).write_text(json.dumps(content | {"note": ""} | record), encoding="utf-8")
    (folder / READINGS).write_bytes((sample_folder / READINGS).read_bytes())
    return folder


def analyzed(*paths):
    return SPINDOWN.analyze(paths)


@pytest.fixture(scope="module")
def of_class(tmp_path_factory):
    root = tmp_path_factory.mktemp("class")
    make(root / "a", 1, group="Group 10")
    make(root / "20261120T101500Z-spin-7f3a", 2, group="Group 2")
    make(root / "20261120T101501Z-spin-0000", 3, group="Group 2", note="second try, with more washers")
    make(root / "d", 4, note="a demonstration")
    return analyzed(root)


def test_runs_have_the_names_of_their_groups_in_a_persons_order(of_class):
    assert [source.name for source in of_class.sources] == [
        "Group 2, spin-7f3a", "Group 2, spin-0000 (second try, with mo…)", "Group 10", "d",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("others", "shown"), [([], "Group 2"), (["Group 3"], "Group 2"), (["Group 2"], "Group 2, x (hurried)")]
)
def test_a_groups_only_run_needs_no_other_name(tmp_path, others, shown):
    make(tmp_path / "x", 1, note="hurried", group="Group 2")
    for k, group in enumerate(others):
        make(tmp_path / f"y{k}", 2 + k, group=group)
    assert analyzed(tmp_path).sources[0].name == shown


@pytest.mark.usefixtures("undrawn_figures")
def test_tables_report_files_and_list_name_group_and_note(of_class, tmp_path):
    in_terminal = [cell for table in SPINDOWN.tables(of_class) for row in table.rows for cell in row.cells]
    assert {"Group 10", "Group 2, spin-7f3a"} <= set(in_terminal)
    page = page_of(document_of([(SPINDOWN, of_class)]))
    assert all(text in page for text in ("Group 10", "second try, with more washers", "a demonstration"))
    by_input, _ = of_analysis(SPINDOWN, of_class, tmp_path)
    group, note = by_input.heads.index("group"), by_input.heads.index("note")
    assert [(row[group], row[note]) for row in by_input.rows][1::2] == [
        ("Group 2", "second try, with more washers"), ("", "a demonstration"),
    ]  # fmt: skip
    assert [run.get("group") for run in SPINDOWN.document(of_class, tmp_path)["runs"]] == [
        "Group 2", "Group 2", "Group 10", None,
    ]  # fmt: skip
    assert {run.group for run in list_runs(of_class.sources[0].path.parent)} == {"Group 2", "Group 10", ""}


def test_runs_of_one_second_are_in_the_order_of_their_beginning(tmp_path):
    for sample, (name, begun) in enumerate([("ffff", "00.1"), ("0000", "00.2"), ("7f3a", "00.3")], start=1):
        make(tmp_path / f"20261120T101500Z-spin-{name}", sample, started_utc=f"2026-11-20T10:15:{begun}Z")
    assert [source.name[-4:] for source in analyzed(tmp_path).sources] == ["ffff", "0000", "7f3a"]


@pytest.mark.parametrize("odd", ["x" * 25, "a\x1bb"])
def test_a_name_without_room_or_that_does_not_print_is_refused(odd):
    with pytest.raises(UsageError, match="24 letters"):
        asked("spin", group=odd)


def test_a_run_keeps_its_group():
    assert asked("spin", seed=1, group=" Group \t 7").group == "Group 7"
