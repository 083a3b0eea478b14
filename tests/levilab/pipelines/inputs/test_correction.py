"""FILE.levilab.toml beside a data file: read by every analysis, below the options that are given."""

import asyncio
import json
import math

import numpy as np
import pytest
import xlsxwriter

import levilab
from levilab.errors import UsageError
from levilab.live.opened import Opened
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.inputs.correction import CorrectionError, place_of_correction, read_correction, write_correction
from levilab.pipelines.look import look_as_kept, name_of
from levilab.pipelines.many.table import write_table
from support.commands import command
from support.paths import SAMPLE_DATA
from support.spin_downs import spin_down_csv

#: A frequency in the first column and the time in the second, in turns a minute: not what a reader would guess.
READ = {"columns": {"t": "2", "f": "1 [rpm]"}}


@pytest.fixture
def swapped(tmp_path):
    """A spin-down whose columns have no titles and stand the other way around."""
    spin_down_csv(file := tmp_path / "my.csv")
    rows = [line.split(",")[:2] for line in file.read_text("utf-8").splitlines()[1:]]
    file.write_text("".join(f"{60 * float(f):.9g},{t}\n" for t, f in rows), encoding="utf-8")
    return file


def first(found, number=0):
    """The first spin frequency of an input [Hz]."""
    return float(found.sources[number].readings.frequency[0])


def kept(file, text):
    path = place_of_correction(file)
    path.write_text(text, encoding="utf-8")
    return path


def test_what_was_written_is_read_again(tmp_path):
    options = {"columns": {"t": 'Zeit "t", s', "f": "Drehzahl [1/min] \x7fé\\"}, "channel": "CH2", "rate": 44100.0}
    path = write_correction(tmp_path / "my.csv", options)
    assert path.name == "my.csv.levilab.toml"
    assert read_correction(tmp_path / "my.csv") == options


def test_the_correction_is_used_named_and_recorded(swapped):
    with pytest.raises(levilab.errors.DataError):
        levilab.analyze(swapped, "spindown")
    write_correction(swapped, READ)
    result = levilab.analyze(swapped, "spindown")
    assert first(result.found) == pytest.approx(40, rel=0.01)
    assert any("is read as my.csv.levilab.toml says: columns t=2,f=1 [rpm]" in text for text in result.warnings)
    ended = command("analyze", "spindown", "my.csv", cwd=swapped.parent)
    assert ended.status == 0
    written = json.loads((swapped.parent / "my.csv.result.json").read_text("utf-8"))
    assert written["settings"]["columns"] == READ["columns"]


def test_a_correction_of_a_sheet_holds_for_that_sheet_alone(tmp_path):
    """The first sheet has turns a minute first and the time behind, the second is as a reader expects it."""
    times, noise = 4.0 * np.arange(30), np.random.default_rng(1).normal(0, 0.03, 30)  # without it a fit takes seconds
    spins = 40 * (1 + 4e-3 * times / 2) ** -2 + noise - noise[0]
    with xlsxwriter.Workbook(path := tmp_path / "my.xlsx") as book:
        for name, columns in (("Mine", [60 * spins, times]), ("Right", [["t [s]", *times], ["f [Hz]", *(spins - 1)]])):
            sheet = book.add_worksheet(name)
            for k, column in enumerate(columns):
                sheet.write_column(0, k, column)
    kept = command("open", "my.xlsx/Mine", "--columns", "t=2,f=1 [rpm]", "--keep", cwd=tmp_path)
    assert kept.status == 0, kept.err
    assert (
        place_of_correction(path).read_text("utf-8").endswith('\n[sheet."Mine"]\ncolumns = {t = "2", f = "1 [rpm]"}\n')
    )
    assert read_correction(path) == {}
    assert read_correction(path / "Mine") == READ
    assert read_correction(path / "Right") == {}
    found = levilab.analyze(path, "spindown").found
    assert [source.path for source in found.sources] == [path / "Mine", path / "Right"]
    assert [first(found, k) for k in (0, 1)] == pytest.approx([40, 39])
    assert first(levilab.analyze(path / "Mine", "spindown").found) == pytest.approx(40)
    shown = look_as_kept(path, {})
    assert [(run.name, run.columns[0].quantity) for run in shown.runs] == [
        ("Mine", "spin_frequency_hz"),
        ("Right", "time_s"),
    ]
    write_correction(path, {"rate": 100.0})  # of the whole file: what is kept of the sheet stays
    assert read_correction(path / "Mine") == {**READ, "rate": 100.0}


def test_a_dropped_workbook_opens_with_its_sheets_to_be_corrected_alone(tmp_path):
    async def pieces():
        yield (SAMPLE_DATA / "student-files" / "excel-sheets.xlsx").read_bytes()

    opened = Opened(tmp_path)
    whole = asyncio.run(opened.receive("my.xlsx", pieces()))
    keys = {name_of(one.path): key for key, one in opened.files.items()}
    assert [*keys] == ["my.xlsx/Run 1", "my.xlsx/Run 2", "my.xlsx"]
    opened.look(keys["my.xlsx/Run 2"], {"columns": {"t": "1", "f": "2 [rad/s]"}})
    assert opened.keep(keys["my.xlsx/Run 2"]) == "my.xlsx.levilab.toml"
    again = opened.look(whole)
    assert [run["columns"][1]["unit"] for run in again["runs"]] == ["Hz", "rad/s"]
    assert again["options"] == {}


def test_options_that_are_given_go_before_it(swapped):
    kept(swapped, 'columns = "t=1,f=2"\n')
    result = levilab.analyze(swapped, "spindown", columns=READ["columns"])
    assert result.found.options.columns == READ["columns"]
    assert not any("levilab.toml" in text for text in result.warnings)


def test_doubtful_rows_are_refused_where_that_is_asked_for_and_a_correction_leaves_them_out(tmp_path):
    spin_down_csv(file := tmp_path / "my.csv")
    titles, first_row, second_row, *others = file.read_text("utf-8").splitlines()
    file.write_text("\n".join([titles, first_row, second_row.replace(",", "?,"), *others, ""]), encoding="utf-8")
    kept(file, "skip_doubtful = true\n")
    assert "1 doubtful row is left out" in " ".join(levilab.analyze(file, "spindown").warnings)
    with pytest.raises(levilab.errors.DataError, match=r"my\.csv, line 3: "):
        levilab.analyze(file, "spindown", skip_doubtful=False)


def test_each_file_of_a_folder_has_its_own(swapped):
    write_correction(swapped, READ)
    spin_down_csv(swapped.parent / "other.csv", seed=2)
    found = ANALYSES["spindown"].analyze([swapped.parent])
    assert first(found, 0) == pytest.approx(first(found, 1), rel=1e-3)
    table = swapped.parent / "all.csv"
    assert write_table(ANALYSES["spindown"], [swapped], {}, table, cores=1).failed == 0


def test_a_report_follows_a_changed_correction(swapped):
    analysis = ANALYSES["spindown"]
    write_correction(swapped, {"columns": {"t": "2", "f": "1 [Hz]"}})
    assert command("analyze", "spindown", "my.csv", cwd=swapped.parent).status == 0
    as_written = analysis.recall([swapped])
    assert as_written.origins[0].text.startswith("as levilab analyze found it")
    write_correction(swapped, READ)
    again = analysis.recall([swapped])
    assert math.isclose(first(as_written), 60 * first(again), rel_tol=1e-6)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("columns = 3", "columns"),
        ('colums = "t=1"', "colums: did you mean columns?"),
        ("rate = -5", "rate"),
        ('rate = "fast"', "rate"),
        ('columns = {colour = "2"}', "columns"),
        ('columns = "t"', "columns"),
        ("columns = {t = 1", "is no TOML"),
        ("sheet = 3", "sheet"),
        ('[sheet."A"]\nrate = -5', "rate"),
        ("\xff", "is no TOML"),
    ],
)
def test_a_broken_correction_is_refused_with_path_and_key(swapped, text, key):
    path = place_of_correction(swapped)
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(CorrectionError) as refused:
        levilab.analyze(swapped, "spindown")
    assert str(refused.value).startswith(f"{path}: ")
    assert key in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_broken_correction_leaves_out_its_file_alone(swapped):
    path = kept(swapped, "rate = -5")
    spin_down_csv(swapped.parent / "other.csv", seed=2)
    result = levilab.analyze(swapped.parent, "spindown")
    assert [source.name for source in result.found.sources] == ["other.csv"]
    assert any(str(path) in text for text in result.warnings)


def test_nothing_is_kept_without_an_option(tmp_path):
    with pytest.raises(UsageError, match="keep"):
        write_correction(tmp_path / "my.csv", {"columns": None})
