"""levilab open in the terminal: what a file is understood as, corrected, kept, analyzed and reported."""

import json
import re
import sys

import numpy as np
import pytest
import xlsxwriter

from levilab.formats.titles import UNITS, dimension, read_title
from levilab.pipelines.look import QUANTITIES, look_at
from support.commands import command
from support.paths import ROOT

OMEGA = ROOT / "sample_data" / "student-files" / "angular-velocity.csv"


@pytest.fixture
def doubtful(tmp_path):
    """Angular velocities under a title that says nothing."""
    file = tmp_path / "my.csv"
    head, *rows = OMEGA.read_text("utf-8").splitlines()
    assert head == "t in s;ω in 1/s"
    file.write_text("\n".join(["Zeit;Wert", *rows, ""]), "utf-8")
    return file


def test_a_question_has_its_answers_as_commands(doubtful):
    ended = command("open", doubtful.name, cwd=doubtful.parent)
    assert ended.status == 1
    assert "Zeit" in ended.out
    assert "rad/s (38" in ended.out
    assert '--columns "t=1,f=2 [rad/s]"' in ended.out
    assert ended.err == "levilab: my.csv: is not read before the question is answered, by --columns\n"


def test_times_in_doubt_stay_out_of_a_folder_and_their_answer_is_kept(tmp_path):
    """No run in doubt goes into a mean, and after the answer each analysis reads it."""
    for k, unit in enumerate((1, 1, 1000)):
        rows = "".join(f"{10 * n * unit},{40 * 0.97**n + 0.01 * (n % 3):.2f}\n" for n in range(15 + k))
        (tmp_path / f"{k}.csv").write_text(f"t,f\n{rows}", "utf-8")
    ended = command("analyze", "spindown", ".", "--json", "--no-save", cwd=tmp_path)
    assert len(json.loads(ended.out)["inputs"]) == 2
    asked = command("open", "2.csv", cwd=tmp_path)
    assert (asked.status, '  ms (2.67 min): levilab open 2.csv --columns "t=1 [ms]"' in asked.out) == (1, True)
    assert command("open", "2.csv", "--columns", "t=1 [ms]", "--keep", cwd=tmp_path).status == 0
    assert 't = "1 [ms]"' in (tmp_path / "2.csv.levilab.toml").read_text("utf-8")
    ended = command("analyze", "spindown", ".", "--json", "--no-save", cwd=tmp_path)
    assert len(json.loads(ended.out)["inputs"]) == 3


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn_figures")
def test_numbered_pulses_may_be_turns_since_the_start(tmp_path):
    (tmp_path / "p.csv").write_text("Pulse,micros\n" + "".join(f"{n},{26316 * n}\n" for n in range(1, 40)), "utf-8")
    asked = command("open", "p.csv", cwd=tmp_path)
    assert 'Pulse, as turns since the start: levilab open p.csv --columns "f=1 [turns]"' in asked.out
    ended = command("open", "p.csv", "--columns", "f=1 [turns]", "--json", cwd=tmp_path)
    assert ended.status == 0, ended.err


def test_an_answer_is_kept_analyzed_and_reported(doubtful):
    words = ("--columns", "t=1,f=2 [rad/s]", "--keep", "-o", "my.html")
    ended = command("open", "my.csv", *words, cwd=doubtful.parent)
    assert ended.status == 0
    assert "the report is in my.html" in ended.out
    names = {path.name for path in doubtful.parent.iterdir()}
    assert names == {"my.csv", "my.html", "my.csv.levilab.toml"}
    again = command("open", "my.csv", cwd=doubtful.parent)
    assert len(again.out.splitlines()) <= 20  # with some messages a screen of 25
    assert "figure beside the file: levilab analyze my.csv" in again.err
    assert (again.status, "is read as my.csv.levilab.toml says" in again.out) == (0, True)


def test_no_title_of_a_file_is_translated(tmp_path):
    """Each has a German word in the table of texts."""
    (tmp_path / "my.csv").write_text("time [s],spin [Hz],readings,result\n0,38,1,time\n9,37,2,time\n", "utf-8")
    shown = command("open", "my.csv", "--language", "de", cwd=tmp_path).out
    assert all(title in shown for title in ("time [s]", "spin [Hz]", "readings", "result", "time, time"))
    (tmp_path / "p.csv").write_text("readings,micros\n" + "".join(f"{n},{26316 * n}\n" for n in range(9)), "utf-8")
    assert "readings, als Umdrehungen seit" in command("open", "p.csv", "--language", "de", cwd=tmp_path).out


@pytest.mark.parametrize("unit", ["krpm", "1000/min", "10^3/min", "10³ min⁻¹", "1000 rpm", "1000 U/min"])
def test_thousands_of_turns_a_minute_are_a_unit(tmp_path, unit):
    for title, columns in ((f"n [{unit}]", {}), ("n", {"t": "1", "f": f"2 [{unit}]"})):
        (tmp_path / "my.csv").write_text(f"t / min,{title}\n0,2.4\n1,2.2\n2,2.0\n", "utf-8")
        (look,) = look_at(tmp_path / "my.csv", {"columns": columns}).plots[0]
        assert look.y == pytest.approx([40, 36.667, 33.333], abs=1e-3)


def test_an_unknown_unit_is_named(tmp_path):
    (tmp_path / "my.csv").write_text(
        "t / min,n / kturns\n" + "".join(f"{t},{2.4 - t / 9}\n" for t in range(9)), "utf-8"
    )
    asked = command("open", "my.csv", "--language", "de", cwd=tmp_path).out
    assert "„n / kturns“ ist in kturns, was keine Einheit dieser Größe ist (Frequenz): welche Spalte" in asked
    assert "enthält die Drehfrequenz?" in asked
    taken = command("open", "my.csv", "--columns", "f=2", cwd=tmp_path)
    assert "'n / kturns' is taken in Hz: 'kturns' is no unit of frequency known here" in taken.out + taken.err


@pytest.mark.parametrize("name", ["Magnetometer.csv", "MagnetometerUncalibrated.csv", "Gyroscope.csv", "top.csv"])
def test_sensor_logger_names_its_sensor_in_the_name_of_the_file(tmp_path, name):
    """Its columns are those of each sensor; the first is the time since 1970 in ns."""
    turns = 2 * np.pi * 21 * np.arange(900) / 100
    rows = zip(np.arange(900) / 100, 30 * np.cos(turns), 30 * np.sin(turns), strict=True)
    lines = (f"{1.7e18 + 1e9 * t:.0f},{t:.4f},-20.5,{y:.3f},{x:.3f}\n" for t, x, y in rows)
    (tmp_path / name).write_text("time,seconds_elapsed,z,y,x\n" + "".join(lines), "utf-8")
    words = ("analyze", name, "--no-save", "--near", "21")
    ended = command(*words, cwd=tmp_path)
    if not name.startswith("Magnetometer"):
        assert (ended.status, f"are x, y and z of {name} those of the magnetometer?" in ended.err) == (1, True)
        (doubt,) = look_at(tmp_path / name, {}).runs[0].doubts
        columns = ",".join(f"{key}={to}" for key, to in doubt.choices[0].columns.items())
        ended = command(*words, "--columns", columns, cwd=tmp_path)
    assert "21.00" in ended.out


@pytest.mark.parametrize("text", ["lower limit\n21.86\n21.7\n22.03\n", "untere Grenze [Hz]\n21,86\n21,7\n22,03\n"])
def test_a_column_of_limits_is_shown(text, tmp_path):
    (tmp_path / "limits.txt").write_text(text, encoding="utf-8")
    look = look_at(tmp_path / "limits.txt", {})
    assert (look.problem, look.runs[0].columns[0].quantity) == ("", "spin_frequency_hz")
    assert look.plots[0][0].y == (21.86, 21.7, 22.03)


def test_a_cell_is_shown_as_a_spreadsheet_shows_it(tmp_path):
    with xlsxwriter.Workbook(tmp_path / "my.xlsx") as book:
        sheet = book.add_worksheet()
        sheet.write_row(0, 0, ["t [s]", "f [Hz]", "p"])
        sheet.write_row(1, 0, [0, 39.9759420572424, 1981.9199999999998])
        sheet.write_row(2, 0, [1e9 + 0.2, 37, 1.5e-7])
    columns = look_at(tmp_path / "my.xlsx", {}).runs[0].columns
    assert [column.values for column in columns] == [("0", "1000000000"), ("39.9759", "37"), ("1981.92", "1.5e-07")]


def test_a_folder_is_for_other_commands(tmp_path):
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "a.csv").touch()
    said = "levilab: runs: is a folder, which levilab analyze, report and class take; here a file is expected: "
    assert command("open", "runs", cwd=tmp_path).err == f"{said}name one in it: a.csv\n"


def test_broken_rows_are_counted_in_one_sentence(tmp_path):
    rows = "".join(f"{10 * k},{'x' if k % 3 == 1 else 38 - k / 3}\n" for k in range(20))
    (tmp_path / "my.csv").write_text(f"t,f\n{rows}", "utf-8")
    ended = command("open", "my.csv", cwd=tmp_path)
    (note,) = re.findall(r".* left out.*", ended.out + ended.err)
    assert (
        note == "note: my.csv: 7 of 20 rows hold no reading (first: '10,x') and are left out: lines 3, 6, 9, 12, 15, …"
    )


def test_turns_a_minute_have_their_usual_unit():
    assert [read_title(f"Umdrehungen pro {word}").unit for word in ("Minute", "Sekunde", "h")] == ["1/min", "1/s", "/h"]


def test_a_note_on_the_file_is_said_once(tmp_path):
    (tmp_path / "my.csv").write_text("t [s],f [Hz],f_std [Hz]\n" + "0,38,1\n9,37,1\n19,36,1\n30,35,1\n", "utf-8")
    ended = command("open", "my.csv", cwd=tmp_path)
    assert (ended.out + ended.err).count("column 'f_std [Hz]' is not read") == 1


def test_json_is_the_understanding_alone(doubtful):
    ended = command("open", str(OMEGA), "--json", cwd=doubtful.parent)
    (look,) = json.loads(ended.out)
    used = {column["quantity"]: (column["title"], column["unit"]) for column in look["runs"][0]["columns"]}
    assert used == {"time_s": ("t in s", "s"), "spin_frequency_hz": ("ω in 1/s", "rad/s")}
    assert [path.name for path in doubtful.parent.iterdir()] == ["my.csv"]  # nothing is written


def test_a_magnetometer_s_record_is_understood_and_analyzed(tmp_path):
    path = ROOT / "sample_data" / "phone" / "magnetometer.csv"
    look = look_at(path, {})
    used = [column.quantity for column in look.runs[0].columns]
    assert (look.problem, used[:4]) == ("", ["time_s", *(f"flux_density_{axis}_t" for axis in "xyz")])
    rows = [line.split(",") for line in path.read_text("utf-8").splitlines()]
    for name, columns in {"one axis": (0, 2), "magnitude": (0, 4)}.items():
        file = tmp_path / f"{name}.csv"
        file.write_text("".join(",".join(row[k] for k in columns) + "\n" for row in rows), "utf-8")
        ended = command("open", file.name, cwd=tmp_path)
        assert ended.status == 0
        (spin,) = re.findall(r"; (36\.8\d+)\(\d+\) Hz at 22\.\d+ s", ended.out)
        assert float(spin) == pytest.approx(36.8569, abs=0.012)  # of all axes; twice the u of one
        assert ("lies at twice the spin" in ended.out) == (name == "magnitude")


def test_a_sheet_without_numbers_asks_nothing():
    sheets = look_at(ROOT / "sample_data" / "student-files" / "phyphox.xlsx", {}).runs
    assert [(sheet.name, sheet.doubts) for sheet in sheets] == [("Peak history", ()), ("Metadata Device", ())]
    assert "is a sheet without numbers" in sheets[1].problem


@pytest.mark.parametrize(("words", "says"), [
    ((), "FILE: name a data file"),
    (("my.csv", "--columns", "t=1,f=9"), "has no column '9'"),
    ((str(OMEGA), "--keep"), "--keep: goes with --columns"),
    (("my.csv", "--rate", "-1"), "--rate"),
])  # fmt: skip
def test_a_mistake_is_said_in_one_line(doubtful, words, says):
    ended = command("open", *words, cwd=doubtful.parent)
    assert ended.status in {1, 2}
    assert says in ended.err
    assert len(ended.err.splitlines()) == 1


def test_no_browser_opens_without_a_terminal(doubtful, monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("levilab.cli.open._serve", lambda _: pytest.fail("it serves"))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: False, raising=False)
    assert command("open", doubtful.name, cwd=doubtful.parent).status == 1


def test_a_record_shows_its_channels_and_the_chosen_one():
    look = look_at(ROOT / "sample_data" / "scope-files" / "rigol-ds1000z.csv", {"channel": "2"})
    assert look.problem == ""
    assert [column.quantity for column in look.runs[0].columns][:2] == [None, "signal"]
    (plot,) = look.plots[0]
    assert len(plot.x) == len(plot.y) > 100


def test_several_runs_side_by_side_are_shown_each():
    look = look_at(ROOT / "sample_data" / "student-files" / "runs-under-one-time.csv", {})
    assert [run.name for run in look.runs] == ["Messung 1", "Messung 2", "Messung 3"]
    assert {*look.plots} == {0, 1, 2}


def test_a_field_scan_is_understood_as_one():
    scan = next((ROOT / "sample_data" / "field-scan").glob("readings.csv"))
    used = {column.quantity for column in look_at(scan, {}).runs[0].columns}
    assert {"height_m", "flux_density_t"} <= used


def test_every_unit_to_choose_is_known():
    for name, (_, units) in QUANTITIES.items():
        assert {*units} <= {*UNITS[dimension(name)]}, name
