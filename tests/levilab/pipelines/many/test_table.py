"""Many runs become one table, whatever becomes of some of them; the processes are really started once."""

import csv
import errno
import io
import json
import os
import shutil
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import pyarrow.parquet as pq
import pytest

from levilab.errors import DataError, UsageError, WorkersLost
from levilab.files import CannotWrite, locked
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.many import table as many
from levilab.pipelines.many.file import TableFile
from levilab.pipelines.many.table import Tally, Task, analyze_one, columns_of, write_table
from levilab.workers import Done
from many_runs import make_runs
from support.commands import command
from support.paths import SAMPLE_DATA

SPINDOWN = ANALYSES["spindown"]
COUNT = 8


@pytest.fixture
def runs(tmp_path):
    """Eight runs of which each second one is broken, each in its way."""
    make_runs(tmp_path / "runs", COUNT, broken=2)
    return tmp_path / "runs"


def tabulate(runs, name="all.csv", given=None, **options):
    """The table of a folder, made in this process unless it is said otherwise."""
    file = runs.parent / name
    write_table(SPINDOWN, [runs], given or {}, file, **({"cores": 1} | options))
    return file


def rows_of(file):
    with file.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def interrupt_after(count, tally):
    if tally.done == count:
        raise KeyboardInterrupt


def test_a_run_is_a_row_and_a_broken_one_says_why(runs):
    rows = rows_of(tabulate(runs))
    assert [row["path"] for row in rows] == [f"runs/{folder.name}" for folder in sorted(runs.iterdir())]
    assert [bool(row["problem"]) for row in rows] == [False, True] * (COUNT // 2)
    said = [row["problem"] for row in rows[1::2]]
    for text, expected in zip(said, ("not JSON", "no readings.csv", "2 readings", "times must increase"), strict=True):
        assert expected in text
    assert not any(rows[3][column.name] for column in SPINDOWN.row)
    assert (rows[3]["status"], rows[3]["synthetic"]) == ("finished", "true")


def test_a_row_has_the_values_of_the_result_of_its_run(runs):
    row = rows_of(tabulate(runs))[0]
    folder = runs.parent / row["path"]
    printed = json.loads(command("analyze", "spindown", folder, "--no-save", "--json", cwd=runs).out)
    disc = next(model for model in printed["models"] if model["name"] == "disc")
    assert float(row["disc_c32_per_sqrt_rad_s"]) == disc["parameters"]["c32"]["value"]
    assert float(row["disc_c32_u_per_sqrt_rad_s"]) == disc["parameters"]["c32"]["u"]
    assert float(row["disc_reduced_chi_square"]) == disc["statistics"]["reduced_chi_square"]
    assert (row["best_model"], row["verdict"]) == (printed["best_model"], printed["verdict"])
    assert row["readings_sha256"] == printed["inputs"][0]["sha256"]
    assert int(row["warnings"]) == len(printed["warnings"])
    assert not [*runs.glob("*/*result*")]


def test_the_table_does_not_depend_on_the_number_of_processes(runs):
    assert tabulate(runs, "two.csv", cores=2).read_bytes() == tabulate(runs, "one.csv").read_bytes()


def test_a_table_that_was_interrupted_goes_on(runs):
    whole = tabulate(runs, "whole.csv").read_bytes()
    with pytest.raises(KeyboardInterrupt):
        tabulate(runs, show=partial(interrupt_after, 3))
    part = runs.parent / "all.csv.part.csv"
    assert len(rows_of(part)) == 3
    with part.open("ab") as file:
        file.write(b"runs/torn,2026")  # as after a kill under way
    seen = []
    assert tabulate(runs, resume=True, show=lambda tally: seen.append(tally.done)).read_bytes() == whole
    assert seen == [*range(2, COUNT + 1)]  # of the three, one had failed, and is tried again
    assert not part.exists()


def test_a_table_whose_process_ended_while_it_cleared_up_goes_on(runs, monkeypatch):
    removed = []

    def end_at_the_second(path, before=Path.unlink, **more):
        if path.name.startswith("all.csv.part") and removed:
            raise KeyboardInterrupt
        removed.extend([path] * path.name.startswith("all.csv.part"))
        before(path, **more)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", end_at_the_second)
        with pytest.raises(KeyboardInterrupt):
            tabulate(runs)
    assert tabulate(runs, resume=True).read_bytes() == tabulate(runs, "whole.csv").read_bytes()


class FullDisk(io.FileIO):
    def write(self, _):
        raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_says_what_to_do(tmp_path):
    table = TableFile(tmp_path / "all.csv", columns_of(SPINDOWN), {}).open(resume=False)
    table._file.close()
    table._file = io.BufferedRandom(FullDisk(table.part, "r+b"))
    with pytest.raises(CannotWrite, match=r"No space left.*make room, and go on with `resume`"), table:
        table.add(["a run"])


def test_rows_of_an_earlier_call_are_never_overwritten(runs):
    with pytest.raises(KeyboardInterrupt):
        tabulate(runs, show=partial(interrupt_after, 3))
    with pytest.raises(UsageError, match="go on with it"):
        tabulate(runs)
    with pytest.raises(UsageError, match="other settings"):
        tabulate(runs, given={"keep_outliers": True}, resume=True)
    assert len(rows_of(runs.parent / "all.csv.part.csv")) == 3


@pytest.mark.parametrize("name", ["all.csv", "all.parquet"])
def test_resume_of_a_complete_table_analyzes_only_new_runs(runs, name):
    last = max(runs.iterdir())
    shutil.move(last, runs.parent)
    tabulate(runs, name)
    shutil.move(runs.parent / last.name, last)
    seen = []
    grown = tabulate(runs, name, resume=True, show=lambda tally: seen.append(tally.done))
    assert seen == [*range(COUNT // 2, COUNT + 1)]  # those that failed are tried again
    if name.endswith(".csv"):
        assert grown.read_bytes() == tabulate(runs, "again.csv").read_bytes()
    else:
        assert pq.read_table(grown).equals(pq.read_table(tabulate(runs, "again.parquet")))


def test_of_a_whole_table_only_what_changed_is_done_again(runs):
    tabulate(runs)
    changed, mended, *_ = sorted(runs.iterdir())
    shutil.copy(changed / "run.json", mended)
    readings = changed / "readings.csv"
    readings.write_bytes(readings.read_bytes().replace(b",0.03", b",0.06"))
    seen = []
    rows = rows_of(tabulate(runs, resume=True, show=seen.append))
    assert seen[-1].kept == COUNT // 2 - 1
    assert not rows[1]["problem"]
    assert rows_of(tabulate(runs, "again.csv")) == rows


@pytest.mark.parametrize("name", ["all.csv", "all.parquet"])
def test_a_table_that_is_damaged_is_refused_and_left_alone(runs, name):
    table = tabulate(runs, name)
    damaged = table.read_bytes() + b"torn\n"
    table.write_bytes(damaged)
    with pytest.raises(DataError, match=rf"{name}: is damaged: begin again"):
        tabulate(runs, name, resume=True)
    assert table.read_bytes() == damaged
    assert sorted(file.name for file in runs.parent.glob("*all.*")) == [name, f"{name}.json"]


def test_two_processes_do_not_write_one_table(runs):
    with locked(runs.parent / "all.csv", "busy"), pytest.raises(CannotWrite, match="another process is writing it"):
        tabulate(runs)
    assert not [*runs.parent.glob("*all.csv*")]
    tabulate(runs)
    assert sorted(file.name for file in runs.parent.glob("*all.csv*")) == ["all.csv", "all.csv.json"]


def test_a_name_of_any_letters_is_a_row_and_one_alone(tmp_path):
    names = ["a  b", "a b", 'c,"d" é'] + ["two\nlines"] * (os.name == "posix")
    for name in names:
        shutil.copytree(SAMPLE_DATA / "spin-down-1", tmp_path / "runs" / name)
    table = tmp_path / "t.csv"
    both = [tmp_path / "runs", tmp_path / "runs" / ".." / "runs"]
    tally = write_table(SPINDOWN, both, {}, table, cores=1)
    found = [row["path"].removeprefix("runs/") for row in rows_of(table)]
    assert sorted(found) == sorted(name.replace("\n", "\\n") for name in names)
    assert tally.total == tally.rows == len(names)
    assert write_table(SPINDOWN, both, {}, table, cores=1, resume=True).kept == len(names)


def test_parquet_holds_the_same_numbers_with_their_types(runs):
    texts, table = rows_of(tabulate(runs)), pq.read_table(tabulate(runs, "all.parquet"))
    assert table.column_names == [column.name for column in columns_of(SPINDOWN)] == list(texts[0])
    exponents = table["power_exponent"].to_pylist()
    assert exponents == [float(row["power_exponent"]) if row["power_exponent"] else None for row in texts]
    first = table.slice(0, 1).to_pylist()[0]
    assert (first["synthetic"], first["outliers"], first["best_model"]) == (True, 0, texts[0]["best_model"])
    units = {field.name: (field.metadata or {}).get(b"unit") for field in table.schema}
    numbers = {name: unit for name, unit in units.items() if table.schema.field(name).type == "double"}
    assert (units["path"], units["synthetic"], None in numbers.values()) == (None, None, False)
    wanted = {"stokes_c1_per_s": b"1/s", "stokes_c1_u_per_s": b"1/s", "power_exponent": b"1"}
    assert {name: numbers[name] for name in wanted} == wanted


def test_a_run_that_kills_its_process_has_a_row(runs, monkeypatch):
    def results(function, tasks, *_):
        first, *others = tasks
        yield from (Done(task, function(task)) for task in others)
        yield Done(first, error=WorkersLost("the process that does it died 3 times"))

    monkeypatch.setattr(many, "results_of", results)
    rows = rows_of(tabulate(runs))
    assert "died 3 times" in rows[0]["problem"]
    assert len(rows) == COUNT


@pytest.mark.parametrize("raised", [MemoryError(), ZeroDivisionError("by zero")])
def test_a_defect_of_levilab_becomes_the_problem_of_a_row(runs, monkeypatch, raised):
    monkeypatch.setattr(type(SPINDOWN), "analyze", Mock(side_effect=raised))
    found = analyze_one(Task(min(runs.iterdir()), True, True, "spindown", SPINDOWN.options_from({}), runs))
    assert ("memory ran out" if isinstance(raised, MemoryError) else "ZeroDivisionError: by zero") in found.problem


@pytest.mark.parametrize(
    ("name", "sample"),
    [("spin", "trace-laser"), ("field", "field-scan"), ("limit", "upper-limits"), ("precession", "precession-sweep")],
)
def test_every_analysis_fills_its_columns(name, sample):
    analysis = ANALYSES[name]
    task = Task(SAMPLE_DATA / sample, True, True, name, analysis.options_from({}), SAMPLE_DATA)
    row = analyze_one(task)
    empty = {column.name for column, cell in zip(columns_of(analysis), row.cells, strict=True) if cell is None}
    # which the samples leave out; a sound record has no notes
    assert empty - {"notes"} == {"problem", "started_utc", "group"}


def test_inputs_of_other_analyses_are_passed_over_and_counted(tmp_path):
    shutil.copytree(SAMPLE_DATA / "trace-laser", tmp_path / "runs" / "trace")
    shutil.copytree(SAMPLE_DATA / "spin-down-1", tmp_path / "runs" / "one")
    shutil.copytree(SAMPLE_DATA / "spin-down-1", tmp_path / "runs" / "two")
    (tmp_path / "runs" / "notes.csv").write_text("day,who\n1,me\n2,you\n", encoding="utf-8")
    printed = json.loads(
        command("analyze", "spindown", "runs", "--table", "t.csv", "--cores", "1", "--json", cwd=tmp_path).out
    )
    assert printed == {
        "table": "t.csv", "rows": 2, "failed": 0, "kept": 0, "passed_over": {"a trace run": 1}, "same_readings": 1,
    }  # fmt: skip


def test_save_writes_a_result_beside_each_run_and_no_figure(runs):
    ended = command("analyze", "spindown", "runs", "--table", "t.csv", "--cores", "1", "--save", cwd=runs.parent)
    assert (ended.status, ended.out.split(";")[1].strip()) == (0, "4 could not be analyzed")
    assert len([*runs.glob("*/result.json")]) == COUNT // 2
    assert not [*runs.glob("*/*.png")]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["runs", "--table", "t.csv"], "name it, as levilab analyze spindown runs --table t.csv"),
        (["spindown", "runs", "--table", "t.xlsx"], "--table t.xlsx: a name that ends in .csv or .parquet is expected"),
        (["spindown", "runs", "--table", "t.csv", "--out", "x"], "--out: does not go with --table"),
        (["spindown", "runs", "--cores", "2"], "--cores: goes with --table alone"),
    ],
)
def test_wrong_options_are_errors(runs, words, said):
    ended = command("analyze", *words, cwd=runs.parent)
    assert ended.status == 2
    assert said in ended.err


def test_a_missing_parquet_library_is_named_before_the_work(runs, monkeypatch):
    monkeypatch.setattr("levilab.pipelines.many.file.find_spec", lambda _: None)
    ended = command("analyze", "spindown", "runs", "--table", "t.parquet", cwd=runs.parent)
    assert ended.status == 2
    assert 'pip install ".[parquet]"' in ended.err


def test_a_table_without_any_sound_run_ends_with_a_failure(runs):
    for folder in sorted(runs.iterdir())[::2]:
        shutil.rmtree(folder)
    ended = command("analyze", "spindown", "runs", "--table", "t.csv", "--cores", "1", cwd=runs.parent)
    assert ended.status == 1
    assert "none of 4 runs could be analyzed" in ended.err
    assert len(rows_of(runs.parent / "t.csv")) == 4


def test_ctrl_c_says_where_the_rows_are(runs, monkeypatch):
    monkeypatch.setattr(Tally, "count", lambda tally, _: interrupt_after(0, tally))
    ended = command("analyze", "spindown", "runs", "--table", "t.csv", "--cores", "1", cwd=runs.parent)
    assert ended.status == 130
    assert "the rows so far are in t.csv.part.csv" in ended.err
    assert len(rows_of(runs.parent / "t.csv.part.csv")) == 1
