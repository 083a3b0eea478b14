"""Files as students have them: each is read, gives the spin-down that it was made from, or asks."""

import importlib.util
import json
import re
import zipfile
from datetime import date, datetime, time
from pathlib import Path

import numpy as np
import pytest
import xlsxwriter

from levilab.errors import DataError
from levilab.formats import texts
from levilab.formats.columns import NoSuchColumn, NoTable, TableError
from levilab.formats.table import read_table
from levilab.formats.understanding import SPIN, SeveralRuns, understand
from levilab.formats.waveforms.header import NoWaveform
from levilab.formats.waveforms.record import read_record
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.inputs.files import data_files
from levilab.pipelines.suits import save
from levilab.texts.text import in_language
from support.paths import ROOT

FILES = ROOT / "sample_data" / "student-files"
C32, SPIN_HZ = 2.34e-4, 38.0
#: File → names of the runs in it, where there are several.
RUNS = {
    "capstone.csv": ["Durchlauf 1", "Durchlauf 2"],
    "excel-sheets.xlsx": ["Run 1", "Run 2"],
    "libreoffice.ods": ["Messung 1", "Messung 2"],
    "logger-pro-runs.csv": ["Run 1", "Run 2"],
    "runs-under-one-time.csv": ["Messung 1", "Messung 2", "Messung 3"],
}
#: File → what has to be said of it.
OPTIONS = {"tracker.txt": {"columns": {"f": "ω [°/s]"}}}
NAMES = sorted(path.name for path in FILES.iterdir() if path.name not in {"README.md", ".levilab-skip"})


def spin_down(path, **options):
    row = ANALYSES["spindown"]
    return row.analyze([path], row.options_from({"tilt": "none", **options}))


@pytest.mark.parametrize("name", NAMES)
def test_a_file_of_a_student_gives_the_spin_down_it_was_made_from(name):
    found = spin_down(FILES / name, **OPTIONS.get(name, {}))
    assert [source.name for source in found.sources] == RUNS.get(name, [name])
    for run in found.runs:
        parameters = run.fit("disc").parameters
        for key, truth in (("c32", C32), ("start_frequency", SPIN_HZ)):
            # 3.5 u: one of 90 numbers by chance in 20 such sets of files
            assert abs(parameters[key].value - truth) < 3.5 * parameters[key].u, (key, parameters[key])


def test_the_files_are_what_their_script_makes(tmp_path):
    spec = importlib.util.spec_from_file_location("student_files", ROOT / "sample_data" / "student_files.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.main(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(path.name for path in FILES.iterdir())
    for path in FILES.iterdir():
        if path.suffix not in {".xlsx", ".ods", ".zip"}:
            assert (tmp_path / path.name).read_bytes() == path.read_bytes(), path.name
            continue
        with zipfile.ZipFile(tmp_path / path.name) as made, zipfile.ZipFile(path) as kept:  # zlib's bytes may differ
            assert {n: made.read(n) for n in made.namelist()} == {n: kept.read(n) for n in kept.namelist()}, path.name


def test_a_folder_with_the_mark_is_left_out_of_a_search_above_it():
    assert data_files(FILES)
    assert not [path for path in data_files(FILES.parent) if FILES in path.parents]


# --- tables as hands and plugs leave them ----------------------------------------------------------------------------

INSTANTS, SPINS = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0), (40.0, 38.5, 37.1, 35.8, 34.5, 33.3)


def rows(form):
    return "".join(form.format(t=t, f=f) + "\n" for t, f in zip(INSTANTS, SPINS, strict=True))


def in_german(notes):
    return " ".join(in_language(one, "de") for one in notes)


@pytest.mark.parametrize(("text", "u"), [
    ("t,f\n" + rows("{t},{f} ± 0.03"), 0.03),
    ("t (s);n (U/min)\n" + rows("{t} ± 0.5;{f} ± 0.03").replace(".", ","), 0.03 / 60),
    (rows("{t} s   {f} +/- 0.03 Hz"), 0.03),
    ("t,f\n" + rows("{t:.0f},{f:.2f}(3)"), 0.03),
    ("t,f\n" + rows("{t},({f} ± 0.03) Hz"), 0.03),
    ("t,f\n" + rows("{t},{f} Hz ± 0.03 Hz"), 0.03),
    (rows("{t} s ± 0.5 s   {f} Hz ± 0.03 Hz"), 0.03),
    ("t,f\n" + rows("{t},{f} ± 0.1 %"), [0.001 * f for f in SPINS]),
    (rows("{t} s   {f} Hz ± 0.1 %"), [0.001 * f for f in SPINS]),
    ("t,f [Hz],u\n" + rows("{t},{f},0.1 %"), [0.001 * f for f in SPINS]),
    ("t;f\n" + rows("{t} s;{f} Hz ± 30 mHz"), 0.03),
    ("Zeit [s]|Frequenz [Hz]|z [mm]\ns|Hz|cm\n" + rows("{t}|{f}|2"), None),
    ("t   f\n[s]   [Hz]\n" + rows("{t}   {f}"), None),
    (rows("{t} s   {f} Hz"), None),
    ("Zeit Frequenz\n" + rows("{t} s {f} Hz"), None),
    ("sec,Hz\n" + rows("{t},{f}"), None),
    ("s;1/s\n" + rows("{t};{f}"), None),
    ("t (s)," + ",".join(map(str, INSTANTS)) + "\nf (Hz)," + ",".join(map(str, SPINS)) + "\n", None),
    ("Zeit;s;" + ";".join(map(str, INSTANTS)) + "\nFrequenz;Hz;" + ";".join(map(str, SPINS)) + "\n", None),
    ("\t".join(map(str, INSTANTS)) + "\n" + "\t".join(map(str, SPINS)) + "\n", None),
    ("\0\x01boot rst:0x1\nt,f\n" + rows("{t},{f}"), None),
    (
        "#;t [s];f [Hz]\n"
        + "".join(f"{k};{t};{f}\n" for k, (t, f) in enumerate(zip(INSTANTS, SPINS, strict=True))),
        None,
    ),
    ('"t" "f"\n' + "".join(f'"{k}" {t} {f}\n' for k, (t, f) in enumerate(zip(INSTANTS, SPINS, strict=True))), None),
    ('"t\n[s]";"f\n[Hz]";"Fehler\n[mHz]"\n' + rows("{t};{f};30"), 0.03),
    ("Zeit t [s]   Frequenz f [Hz]   ± [Hz]\n" + rows("{t}   {f}   0.03"), 0.03),
    ("t [s];Δn (U/min);n (U/min)\n" + rows("{t};0,03;{f}").replace(".", ","), 0.03 / 60),
    ("Zeit;Frequenz\nlinks;rechts\nms;Hz\n" + rows("{t}e3;{f} ×10^0") + "Mittel;k.A.\n", None),
    ("".join(f"0:00:{t:02.0f} -> {f} Hz\n" for t, f in zip(INSTANTS, SPINS, strict=True)), None),
    ("Y unit;Hz\nt;f [Hz] links;Comment\n" + rows("{t:.0f}s;{f}"), None),
])  # fmt: skip
def test_readings_are_read_however_they_are_written(text, u, write):
    path = write(text, "my.txt")
    table = read_table(path, quantities=SPIN, needed=SPIN[:2])
    factor = 60 if "U/min" in text else 1
    assert table.column("time_s").tolist() == [*INSTANTS]
    assert table.column("spin_frequency_hz") * factor == pytest.approx(SPINS, rel=1e-14)  # rounding of the factor
    assert ("spin_frequency_u_hz" in table.columns) == (u is not None)
    if u:
        assert table.column("spin_frequency_u_hz") == pytest.approx(u, rel=1e-14)
    if u and re.search(r"\d.*±|\(3\)", text):
        assert "behind the ± is taken as the standard uncertainty" in " ".join(table.warnings)


@pytest.mark.parametrize(("title", "unit"), [("u", "Hz"), ("u [%]", "%")])
def test_a_u_whose_cells_may_show_percent_is_said(title, unit, tmp_path):
    with xlsxwriter.Workbook(tmp_path / "u.xlsx") as book:
        sheet = book.add_worksheet()
        for k, row in enumerate([("t [s]", "f [Hz]", title), *((10 * k, f, 0.001) for k, f in enumerate(SPINS))]):
            sheet.write_row(k, 0, row)
    (note,) = read_table(tmp_path / "u.xlsx").warnings
    assert f"column '{title}' holds 0.001, taken in {unit}; if it shows 0.1 %, write u in Hz" in note


@pytest.mark.parametrize("head", ["\nMessung {}\n", "{}\n", "A\n", ""])
def test_tables_below_and_beside_one_another_are_runs(head, tmp_path):
    names = [head.strip("A\n").format(k) or str(k) for k in (1, 2)]
    (tmp_path / "below.csv").write_text("".join(f"{head.format(k)}t [s],f [Hz]\n{rows('{t},{f}')}" for k in (1, 2)))
    (tmp_path / "beside.csv").write_text("t/s,f1/Hz,t/s,f2/Hz\n" + rows("{t},{f},{t},{f}"))
    with xlsxwriter.Workbook(tmp_path / "my.xlsx") as book:
        sheet, clock = book.add_worksheet(), book.add_format({"num_format": "h:mm"})
        book.add_worksheet().hide()
        sheet.write_row(0, 0, ["Zeit [min:s]", "f / Hz", "", "", "mean:", 36.5])
        sheet.write_row(1, 0, ["", *names])
        for k, f in enumerate(SPINS):
            sheet.write_datetime(k + 2, 0, time(k * 2, 0), clock)
            sheet.write_row(k + 2, 1, [f, f])
    minutes = [120 * k for k in range(6)]
    for name, times in (("below.csv", [*INSTANTS]), ("beside.csv", [*INSTANTS]), ("my.xlsx", minutes)):
        tables = [read_table(run.path, quantities=SPIN) for run in understand(tmp_path / name).runs]
        assert [table.path.name[-1] for table in tables] == ["1", "2"]
        assert [table.column("spin_frequency_hz").tolist() for table in tables] == [[*SPINS]] * 2
        assert [table.column("time_s").tolist() for table in tables] == [times] * 2


@pytest.mark.parametrize(("count", "without"), [(12, [3]), (600, range(300)), (20000, range(19000))])
def test_a_column_in_which_some_rows_have_no_u_behind_the_number_says_so(count, without, tmp_path):
    path = tmp_path / "my.csv"
    lines = [f"{t},{40 - t / 1000}{'' if t in without else ' ± 0.03'}\n" for t in range(count)]
    path.write_text("t [s],f [Hz]\n" + "".join(lines), encoding="utf-8")
    table = read_table(path, quantities=SPIN, needed=SPIN[:2])
    assert table.column("spin_frequency_hz").size == count
    assert "spin_frequency_u_hz" not in table.columns
    said = f"column 'f [Hz]': the number behind the ± is missing in {len(without)} of {count} rows and is not used"
    assert [warning.partition(": ")[2] for warning in table.warnings] == [said]


@pytest.mark.parametrize(("cell", "do"), [
    ("38.5 Hz ± 30 ms", "one unit in all"), ("38.5 ± 1 %?", "the title u"), ("10²", "number"), ("4x1000", "number"),
])  # fmt: skip
def test_a_number_behind_a_mark_that_cannot_be_used_is_quoted_as_it_stands(cell, do, write):
    path = write("t,f\n" + rows("{t},{f} ± 0.03").replace("38.5 ± 0.03", cell), "my.csv")
    with pytest.raises(TableError, match=re.escape(f"'{cell}' stands in column 'f'") + f".*{do}"):
        read_table(path)


def test_rows_that_a_person_doubts_are_left_out_on_request_and_named(write):
    path = write("t,f\n" + rows("{t},{f}").replace("37.1", "37.1?").replace("30.0,35", "~30.0,35"), "my.csv")
    with pytest.raises(TableError, match=r"line 4: '37.1\?'.*also in 1 other line: 5\)"):
        read_table(path)
    table = read_table(path, skip_doubtful=True)
    assert table.column("time_s").tolist() == [0, 10, 40, 50]
    assert "2 doubtful rows are left out, as `skip_doubtful` says: lines 4, 5" in " ".join(table.warnings)
    assert "2 zweifelhafte Zeilen sind ausgelassen, wie `skip_doubtful` sagt: Zeilen 4, 5" in in_german(table.warnings)
    path.write_text("t,f\n" + "".join(f"{t},40\n{t},40?\n" for t in range(1002)), encoding="utf-8")
    assert len(read_table(path, skip_doubtful=True)) == 1002  # beyond the lines after which an error ends the reading


def test_a_line_with_bytes_that_are_no_text_is_left_out_with_its_number(write):
    path = write("t,f\n" + rows("{t},{f}").replace("37.1", "3\x007.1"), "my.csv")
    table = read_table(path)
    assert table.column("time_s").tolist() == [0, 10, 30, 40, 50]
    assert "line 4: '20.0,3�7.1' has bytes that are no text and is left out" in " ".join(table.warnings)
    assert "Zeile 4: '20.0,3�7.1' hat Bytes, die kein Text sind, und ist ausgelassen" in in_german(table.warnings)


@pytest.mark.parametrize(("unit", "sensor"), [("m/s^2", "accelerometer"), ("rad/s", "gyroscope")])
def test_a_phones_sensor_of_its_own_motion_is_no_record_of_the_top(unit, sensor, tmp_path):
    path = tmp_path / "phone.csv"
    samples = "".join(f"{k / 100},{k % 7},{k % 5},9.8\n" for k in range(50))
    path.write_text(f"Time (s),x ({unit}),y ({unit}),z ({unit})\n{samples}", encoding="utf-8")
    with pytest.raises(NoWaveform, match=f"of the {sensor}, which shows no turns of the top"):
        read_record(path)


# --- several runs in a file ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("inside", "first"), [("Messung 2", 37.9), ("Tabelle1/Messung 2", 37.9)])
def test_a_run_in_a_file_is_named_as_if_the_file_were_a_folder(inside, first):
    table = read_table(FILES / "libreoffice.ods" / inside, quantities=SPIN)
    assert table.column("spin_frequency_hz")[0] == pytest.approx(first, abs=0.15)  # 38 ± noise
    assert table.column("time_s")[-1] == 180


def test_a_file_with_several_runs_says_how_to_name_one():
    with pytest.raises(
        SeveralRuns, match=r"'Messung 1', 'Messung 2', 'Messung 3'\): name one, as .*/Messung 1"
    ) as error:
        read_table(FILES / "runs-under-one-time.csv", quantities=SPIN)
    assert error.value.paths[2] == FILES / "runs-under-one-time.csv" / "Messung 3"
    with pytest.raises(TableError, match=r"no sheet, file or run 'Lauf 9'; it has 'Messung 1'"):
        read_table(FILES / "runs-under-one-time.csv" / "Lauf 9", quantities=SPIN)


def test_a_shorter_run_beside_a_longer_one_misses_nothing():
    table = read_table(FILES / "runs-under-one-time.csv" / "Messung 3", quantities=SPIN)
    assert len(table) == 15
    assert not table.warnings


def test_what_was_found_of_runs_in_a_file_is_recalled(tmp_path):
    file = tmp_path / "runs.csv"
    file.write_bytes((FILES / "runs-under-one-time.csv").read_bytes())
    row = ANALYSES["spindown"]
    found = row.analyze([file], row.options_from({}))
    assert [path.name for path in save(row, found, with_figure=False)] == ["runs.csv.result.json"]
    inputs = json.loads((tmp_path / "runs.csv.result.json").read_text(encoding="utf-8"))["inputs"]
    assert [one["path"] for one in inputs] == ["runs.csv/Messung 1", "runs.csv/Messung 2", "runs.csv/Messung 3"]
    assert len({one["sha256"] for one in inputs}) == 3
    recalled = row.recall([file], row.options_from({}))
    assert not any("no result yet" in origin.text for origin in recalled.origins)
    constants = [[run.fit("disc").parameters["c32"] for run in of.runs] for of in (recalled, found)]
    assert constants[0] == constants[1]


# --- understanding ---------------------------------------------------------------------------------------------------


def test_what_is_shown_of_a_file_is_what_is_read():
    for name in sorted({*NAMES} - {*OPTIONS}):
        understanding = understand(FILES / name)
        assert not understanding.problem, name
        for run in (run for run in understanding.runs if not run.problem):
            table = read_table(run.path, quantities=SPIN)
            used = {column.quantity: column for column in run.columns if column.quantity}
            assert set(used) == set(table.columns), name
            spin = used["spin_frequency_hz"]
            if not spin.inverse:
                assert table.factors["spin_frequency_hz"] == spin.factor


def test_an_angular_velocity_of_tracker_is_a_question_with_its_choices():
    (run,) = understand(FILES / "tracker.txt").runs
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.column) == ("unit", 2)
    assert "column 3 'ω' has the values 13690 to 7785 and no unit" in doubt.text
    assert doubt.choices[0].text == "°/s (38 to 21.6 Hz)"
    assert {column.quantity for column in run.columns} == {"time_s", "spin_frequency_hz", None}
    with pytest.raises(
        NoSuchColumn, match=r"no unit, and would be in rad/s: °/s .* say `columns` = \"t=1,f=3 \[°/s\]\""
    ):
        spin_down(FILES / "tracker.txt")
    (source,) = spin_down(FILES / "tracker.txt", columns=doubt.choices[0].columns).sources
    assert not source.readings.doubtful


def test_definitions_of_cassy_may_stand_one_below_the_other(write):
    heads = "".join(f'MIN=0\tMAX=200\tSCALE=20\tDEF="{title}"\n' for title in ("t/s", "f_1/Hz"))
    table = read_table(write(heads + "0\t38\n10\t37.5\n20\t37\n"), quantities=SPIN)
    assert table.column("spin_frequency_hz").tolist() == [38, 37.5, 37]
    assert table.lines.tolist() == [3, 4, 5]


@pytest.mark.parametrize("name", ["/etc/x.csv", "C:/x.csv", "C:\\x.csv", "a/b/x.csv"])
def test_a_member_of_a_zip_stays_in_it_whatever_its_name(tmp_path, name):
    file = tmp_path / "my.zip"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(name, "t,f\n0,38\n10,37\n20,36\n")
    table = read_table(file, quantities=SPIN)
    assert table.path.relative_to(file).name == "x.csv"
    assert ".." not in table.path.relative_to(file).parts


def test_a_table_that_holds_no_samples_says_what_to_do():
    for name in ("excel.xlsx", "arduino-monitor.txt"):
        with pytest.raises(NoWaveform, match="save samples as CSV"):
            read_record(FILES / name)


def test_text_above_numbers_without_titles_is_skipped(write):
    file = write("counter v1\nready\n1000,38.0\n31000,34.0\n61000,31.0\n121000,26.0\n181000,22.0\n", "log.txt")
    (run,) = understand(file).runs
    choice = run.doubts[0].choices[0]  # the first answer suffices
    assert (choice.text, choice.columns) == ("ms (3 min)", {"t": "1 [ms]", "f": "2"})
    assert read_table(file, quantities=SPIN, columns=choice.columns).column("spin_frequency_hz")[0] == 38


def test_a_temperature_beside_a_spin_down_is_no_time(write):
    table = read_table(write("t/s,f/Hz,T/°C\n0,38,21\n60,31,21\n120,26,21\n", "t.csv"), quantities=SPIN)
    assert (list(table.columns), table.warnings) == ([*SPIN[:2]], ())


def test_a_column_without_name_and_unit_is_asked_about(write):
    file = write("Zeit;Wert\n0;239\n60;195\n120;162\n180;136\n", "wert.csv")
    with pytest.raises(
        NoSuchColumn, match=r"column 2 'Wert' has the values 239 to 136 and no unit: rad/s \(38 to"
    ) as error:
        read_table(file, quantities=SPIN)
    table = read_table(file, quantities=SPIN, columns=error.value.doubt.choices[0].columns)
    assert table.column("spin_frequency_hz")[0] == pytest.approx(239 / (2 * np.pi))
    (run,) = understand(file).runs
    assert run.doubts == (error.value.doubt,)
    assert run.problem == str(error.value)
    file.write_text("Zeit;Wert\n0;38\n60;31\n120;26\n180;22\n", encoding="utf-8")
    table = read_table(file, quantities=SPIN)
    assert table.column("spin_frequency_hz")[0] == 38
    assert "'Wert' has no unit and is taken as the spin in Hz" in table.warnings[0]
    assert "'Wert' hat keine Einheit und gilt als Drehfrequenz in Hz" in in_german(table.warnings)
    with pytest.raises(NoSuchColumn):  # of a folder nothing is guessed
        read_table(file, quantities=SPIN, needed=SPIN[:2], guess=False)


@pytest.mark.parametrize(("rows", "unit", "columns"), [
    ("t,f\n0,38\n60000,31\n120000,26\n180000,22\n", "ms (3 min)", {"t": "1 [ms]"}),
    ("t,rpm\n0,2280\n1,1860\n2,1560\n3,1320\n", "min (3 min)", {"t": "1 [min]"}),
    ("t,T [ms]\n0,26\n0.02,32\n0.03,38\n0.04,45\n", "h (2.4 min)", {"t": "1 [h]"}),
    ("0,38,.1\n60000,31,.1\n120000,26,.1\n", "ms (2 min)", {"t": "1 [ms]", "f": "2", "u": "3"}),
    ("t,f 1,f 2\n0,38,39\n60000,31,31\n120000,26,27\n", "ms (2 min)", {"t": "1 [ms]"}),
    ("t1,f1,t2,f2\n0,38,0,39\n60000,31,50000,31\n120000,26,90000,27\n", "ms (2 min)", {"t": "1 [ms]", "f": "2"}),
    ("t,f\n" + "".join(f"{25 * k},{40 - k / 2000 :.4f}\n" for k in range(3001)), "ms (75 s)", {"t": "1 [ms]"}),
])  # fmt: skip
def test_times_in_which_no_spin_falls_are_asked_about(rows, unit, columns, write):
    file = write(rows, "mine.csv")
    run, *others = understand(file).runs
    assert "and no unit, and would be in s, in which the spin falls by " in run.problem
    assert [(choice.text, choice.columns) for choice in run.doubts[0].choices] == [
        (unit, columns), ("s", {**columns, "t": "1 [s]"}),
    ]  # fmt: skip
    read = understand(file, columns=columns).runs
    assert len(read) == 1 + len(others) * (len(columns) == 1)
    assert not any(one.problem or one.doubts for one in read)
    table = read_table(read[0].path, columns=columns, quantities=SPIN, needed=SPIN[:2])
    assert 75 <= table.column("time_s")[-1] <= 180
    (run,) = understand(file, columns=run.doubts[0].choices[1].columns).runs[:1]  # in s, as a person says: with a note
    assert (run.problem, len(run.doubts)) == ("", 1)


def test_times_of_a_long_run_in_minutes_do_not_pass_for_seconds(write):
    (run,) = understand(write("t,f\n" + "".join(f"{k},{40 - 1.8 * k}\n" for k in range(11)), "mine.csv")).runs
    assert "in which the spin falls by 45 % in 10 s: s (10 s) or min (10 min)?" in run.problem


@pytest.mark.parametrize("rows", [
    "t,f\n0,22.1\n600,21.7\n1200,22\n1800,21.8\n",  # limits of a top, one every ten minutes
    "t,f\n" + "".join(f"{k},{40 - max(0, k - 150) / 10}\n" for k in range(300)),  # after a drive has held it
    "t,f\n0,22\n600000,38\n900000,44\n", "t,f\n0,40\n10,38\n20,\n30,36\n", "t,f\n0:00,38\n0:02,30\n0:03,22\n",
])  # fmt: skip
def test_times_that_may_be_seconds_are_not_asked_about(rows, write):
    (run,) = understand(write(rows, "mine.csv")).runs
    assert (run.problem, run.doubts) == ("", ())


def test_limits_in_one_column_of_a_spreadsheet_are_read(tmp_path):
    rows = "".join(f'<row r="{k}"><c r="A{k}"><v>{23 + 0.1 * k}</v></c></row>' for k in range(1, 6))
    sheet = f'<worksheet xmlns="{MAIN}"><sheetData>{rows}</sheetData></worksheet>'
    empty = {"xl/worksheets/sheet2.xml": f'<worksheet xmlns="{MAIN}"><sheetData/></worksheet>'}
    row = ANALYSES["limit"]
    found = row.analyze([workbook(tmp_path / "limits.xlsx", sheet, **empty)], row.options_from({}))
    assert len(found.sources[0].readings) == 5


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("t;f\n0 s;38 Hz\n1 s;0.0379 kHz\n2 s;37 Hz\n", "line 3: '0.0379 kHz' stands in column 'f', which is in Hz"),
        ("t;Lauf [Hz];Motor [Hz]\n0;38;1\n1;37;1\n2;36;1\n", "no column is known to be spin_frequency_hz"),
        ("Datum;f\n31.02.2026 10:00:00;38\n01.03.2026 10:00:01;37\n01.03.2026 10:00:02;36\n", "'31.02.2026 10:00:00'"),
    ],
)
def test_what_could_be_read_in_two_ways_is_refused(text, says, write):
    file = write(text, "odd.csv")
    with pytest.raises(TableError) as error:
        read_table(file, quantities=SPIN, needed=SPIN[:2])
    assert says in str(error.value)


# --- hostile and damaged spreadsheets --------------------------------------------------------------------------------


MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"


def workbook(path, sheet, **more):
    with zipfile.ZipFile(FILES / "excel-sheets.xlsx") as kept, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as out:
        for name in kept.namelist():
            out.writestr(name, sheet if name == "xl/worksheets/sheet1.xml" else more.get(name, kept.read(name)))
    return path


def test_a_spreadsheet_or_zip_that_unpacks_to_gigabytes_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(texts, "MOST_UNPACKED", 1 << 20)
    blank = b" " * (2 << 20)
    workbook(tmp_path / "bytes.xlsx", blank)
    with zipfile.ZipFile(tmp_path / "zip.zip", "w", zipfile.ZIP_DEFLATED) as out:
        out.writestr("a.csv", blank)
    said, lie = (size.to_bytes(4, "little") for size in (2 << 20, 100))  # what its directory says
    (tmp_path / "lying.zip").write_bytes((tmp_path / "zip.zip").read_bytes().replace(said, lie))
    for path in list(tmp_path.iterdir()):
        with pytest.raises(TableError, match=r"unpacks to .*, up to 1 MB"):
            read_table(path)


def test_a_cell_far_away_and_repeated_cells_are_refused_before_they_are_unpacked(tmp_path):
    far = f'<worksheet xmlns="{MAIN}"><sheetData><row r="1"><c r="A1"><v>1</v></c></row><row r="1048576">'
    far += '<c r="XFD1048576"><v>1</v></c></row></sheetData></worksheet>'
    with pytest.raises(TableError, match="1,048,576 rows of 16,384 columns"):
        read_table(workbook(tmp_path / "far.xlsx", far))
    with zipfile.ZipFile(FILES / "libreoffice.ods") as kept, zipfile.ZipFile(tmp_path / "many.ods", "w") as out:
        for name in kept.namelist():
            text = kept.read(name).replace(
                b'<table:table-cell office:value-type="float"',
                b'<table:table-cell table:number-columns-repeated="16000" office:value-type="float"',
                1,
            )
            text = text.replace(b"<table:table-row>", b'<table:table-row table:number-rows-repeated="1000000">')
            out.writestr(name, text)
    with pytest.raises(TableError, match=r"unpacks to .* rows of 16,00. columns"):
        read_table(tmp_path / "many.ods")


def test_a_damaged_locked_or_foreign_file_says_what_to_do(tmp_path):
    whole = (FILES / "excel.xlsx").read_bytes()
    cases = {
        "cut.xlsx": (whole[: len(whole) // 2], "damaged"),
        "old.xls": (b"\xd0\xcf\x11\xe0" + b"\0" * 600, "save it again as .xlsx"),
        "cut.json": (b'{"t": [0, 1', "is cut off or no JSON"),
        "deep.json": (b"[" * 100_000, "JSON"),
        "run.json": (b'{"schema": "levilab-run/1"}', "name the folder of the run"),
        "words.json": (b'{"a": "b"}', "JSON file without a table"),
        "exp.cmbl": (b"<?xml?>", "in Logger Pro: File, Export As, CSV"),
        "logic.dsl": (whole, "in DSView: File, Export, CSV"),
        "exp.cap": (whole, "in Capstone: File, Export Data"),
    }
    for name, (content, says) in cases.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(TableError, match=says):
            read_table(tmp_path / name)
    with zipfile.ZipFile(tmp_path / "pictures.zip", "w") as out:
        out.writestr("a.png", b"x")
    with pytest.raises(NoTable, match="ZIP file without a table"):
        read_table(tmp_path / "pictures.zip")


@pytest.mark.parametrize("name", ["a-spin/run.json", "run.json", "run-001.json"])
def test_a_run_in_a_zip_is_no_table_as_it_would_lose_its_mark_of_a_virtual_bench(tmp_path, name):
    with zipfile.ZipFile(tmp_path / "run.zip", "w") as out:
        out.writestr(name, "{}")
        out.writestr("a-spin/readings.csv", "t,f\n0,38\n10,37.9\n20,37.8\n")
    with pytest.raises(TableError, match=rf"holds a run of levilab \({name}\): unpack it"):
        read_table(tmp_path / "run.zip")


@pytest.mark.parametrize("name", ["excel.xlsx", "libreoffice.ods", "phyphox.zip"])
def test_a_file_with_wrong_bytes_is_read_or_refused(name, tmp_path):
    rng = np.random.default_rng(5)
    whole = bytearray((FILES / name).read_bytes())
    for _ in range(40):
        damaged = bytearray(whole)
        for place in rng.integers(0, len(whole), 3):
            damaged[place] = int(rng.integers(256))
        (tmp_path / name).write_bytes(damaged)
        try:
            understand(tmp_path / name)
        except DataError as error:
            pytest.fail(f"understand raised {error}")


def test_a_number_in_a_cell_keeps_its_last_bit(tmp_path):
    value = 37.224252878824654
    cells = f'<c r="A{{0}}"><v>{{0}}</v></c><c r="B{{0}}"><v>{value!r}</v></c>'
    rows = "".join(f'<row r="{k}">{cells.format(k)}</row>' for k in range(1, 5))
    first, second = (f'<worksheet xmlns="{MAIN}"><sheetData>{one}</sheetData></worksheet>' for one in (rows, ""))
    path = workbook(tmp_path / "bits.xlsx", first, **{"xl/worksheets/sheet2.xml": second})
    assert read_table(path, quantities=SPIN).column("spin_frequency_hz").tolist() == [value] * 4


def test_a_title_with_a_unit_goes_before_a_column_without_one(write):
    """N is the number of repeats, and the scatter in Hz is no spin of a top."""
    path = write("t [s],f mean [rpm],f std [rpm],N\n0,2400,4,10\n10,2310,4,10\n20,2220,4,10\n", "repeats.csv")
    table = read_table(path, quantities=SPIN)
    assert table.column("spin_frequency_hz").tolist() == [40.0, 38.5, 37.0]
    assert "spin_frequency_u_hz" not in table.columns


@pytest.mark.parametrize("title", ["2σ [Hz]", "U (k=2) [Hz]", "max. Fehler [Hz]", "f_std [Hz]"])
def test_an_expanded_uncertainty_is_named_and_not_read(write, title):
    path = write(f"t [s],f [Hz],{title},T-Fehler [K]\n0,40,0.04,1\n10,38.5,0.04,1\n20,37,0.04,1\n", "wide.csv")
    (note,) = read_table(path, quantities=SPIN).warnings
    assert f"'{title}' is not read: u is half of 2σ" in note


def test_a_cell_of_midnight_is_a_time_among_times():
    """The library returns a date for it, and a column of dates alone stays one of dates."""
    clock = [datetime.fromisoformat("2026-03-01 23:59:50"), date(2026, 3, 2)]
    lines = texts._lines([[at, date(2026, 3, 1), 40.0] for at in clock]).decode().splitlines()
    assert lines[1] == "2026-03-02 00:00:00\t2026-03-01\t40.0"


@pytest.mark.parametrize("value", ["", "<v/>", "<v></v>"])
def test_formulas_that_were_never_worked_out_say_what_to_do(tmp_path, value):
    rows = "".join(
        f'<row r="{k}"><c r="A{k}"><v>{k}</v></c><c r="B{k}"><f>38-A{k}</f>{value}</c></row>' for k in (1, 2, 3)
    )
    sheet = f'<worksheet xmlns="{MAIN}"><sheetData>{rows}</sheetData></worksheet>'
    path = workbook(tmp_path / "formulas.xlsx", sheet)
    with pytest.raises(TableError, match=r"Run 1, line 1: column '2' holds a formula without its value: open the file"):
        read_table(path / "Run 1", quantities=SPIN)
    table = read_table(path, quantities=SPIN)  # the other sheet, with a note
    assert table.path == path / "Run 2"
    assert table.warnings[0].startswith("not read: ")
    assert "Run 1, line 1" in table.warnings[0]


def test_formulas_without_values_beside_the_readings_refuse_nothing(tmp_path):
    cells = '<c r="A{0}"><v>{0}</v></c><c r="B{0}"><v>{1}</v></c><c r="D{0}"><f>B{0}</f></c>'
    rows = "".join(f'<row r="{k}">{cells.format(k, 38 - k)}</row>' for k in range(1, 5))
    last = '<row r="5"><c r="A5" t="inlineStr"><is><t>mean</t></is></c><c r="B5"><f>AVERAGE(B1:B4)</f></c></row>'
    sheet = f'<worksheet xmlns="{MAIN}"><sheetData>{rows}{last}</sheetData></worksheet>'
    table = read_table(workbook(tmp_path / "beside.xlsx", sheet) / "Run 1", columns={"t": "1", "f": "2"})
    assert table.column("spin_frequency_hz").tolist() == [37, 36, 35, 34]
    assert "is no reading and is left out" in table.warnings[0]


AS_ONE, WHICH = r"its times stand in two columns, .* or as 1:20", "say which: `columns` = t=1 or t=2"
TIMES = "0;0;38\n0;40;37.5\n1;20;37.2\n1;55;37"


@pytest.mark.parametrize(
    ("text", "says"),
    [(f"{titles}\n{TIMES}", AS_ONE) for titles in ("min;s;f", "Minuten;Sekunden;f / Hz", "Zeit min;Zeit s;f")]
    + [(f"t [min];t [s];f\n{rows}", WHICH) for rows in ("0;0;38\n1;60;37\n2;120;36", "0;9;38\n0;20;37\n0;30;36")]
    + [("t [min];t [s];f\n0.5;30;38\n0.6;36;37\n0.75;45;36", WHICH), (f"t;t;f\nmin;s;Hz\n{TIMES}", AS_ONE)],
)
def test_times_in_two_columns_are_asked_about(text, says, write):
    path = write(text, "two.csv")
    with pytest.raises(TableError, match=says):
        read_table(path, quantities=SPIN)


@pytest.mark.parametrize(("titles", "seconds", "columns"), [
    ("t [min];u_t [s];f", 1, {}), ("t [min];T [s];n", 0.026, {}), ("t [min];t [s];f", 20, {"t": "1"}),
])  # fmt: skip
def test_minutes_beside_other_seconds_are_the_times(titles, seconds, columns, tmp_path):
    path = tmp_path / "u.csv"
    rows = "".join(f"{k};{seconds};{38 - k}\n" for k in range(3))
    path.write_text(f"{titles}\n{rows}", encoding="utf-8")
    assert read_table(path, quantities=SPIN, columns=columns).column("time_s").tolist() == [0, 60, 120]


@pytest.mark.parametrize("begins", [(0, 30), (0, 0)])
@pytest.mark.parametrize("times", ["One", "No"])
def test_packets_of_labview_are_one_run_where_their_times_go_on(begins, times, write):
    text = f"Separator\tTab\nDecimal_Separator\t,\nMulti_Headings\tYes\nX_Columns\t{times}\n"
    for start, k in zip(begins, (0, 3), strict=True):
        text += f"Channels\t1\nY_Unit_Label\trpm\nX0\t{start}\nDelta_X\t1,0E+1\nX_Value\tUntitled\tComment\n"
        packet = [(start + 10 * n if times == "One" else "", 60 * SPINS[k + n]) for n in range(3)]
        text += "".join(f"{t}\t{f}\t\n".replace(".", ",") for t, f in packet) + "\n"
    tables = [read_table(run.path, quantities=SPIN) for run in understand(write(text, "my.lvm")).runs]
    assert [f for table in tables for f in table.column("spin_frequency_hz")] == pytest.approx(SPINS, rel=1e-14)
    assert [t for table in tables for t in table.column("time_s")] == [t + k for t in begins for k in (0, 10, 20)]
    assert len(tables) == (1 if begins[1] else 2)


def test_a_path_into_no_file_stays_a_path():
    assert texts.locate(Path("no/such/file.csv")) == (Path("no/such/file.csv"), "")
    assert texts.locate(FILES / "excel.xlsx" / "Messung") == (FILES / "excel.xlsx", "Messung")


def test_two_units_in_doubt_are_one_question_whose_answer_is_complete(tmp_path):
    rows = (f"{1234 + 10_000 * k}, {2279 - 48 * k}\n" for k in range(20))  # millis() and rpm, as a sketch prints them
    (path := tmp_path / "arduino.txt").write_text("".join(rows))
    (doubt,) = understand(path).runs[0].doubts
    assert [choice.columns for choice in doubt.choices][:2] == [
        {"t": "1 [ms]", "f": "2 [rpm]"},
        {"t": "1 [ms]", "f": "2 [Hz]"},
    ]
    table = read_table(path, columns=doubt.choices[0].columns)
    assert table.column("time_s")[1] - table.column("time_s")[0] == pytest.approx(10)
    assert table.column("spin_frequency_hz")[0] == pytest.approx(2279 / 60)


def test_times_of_a_turn_without_a_unit_are_a_question(tmp_path):
    (path := tmp_path / "periods.csv").write_text(
        "t,T\n" + "".join(f"{10 * k},{0.0263 + k / 1000}\n" for k in range(20))
    )
    (run,) = understand(path, columns={"t": "1", "f": "2"}).runs
    (doubt,) = run.doubts
    assert doubt.choices[0].text == "s (38 to 22.1 Hz)"
    assert read_table(path, columns=doubt.choices[0].columns).column("spin_frequency_hz")[0] == pytest.approx(
        38, abs=0.1
    )


def test_turns_since_the_start_are_a_question_whose_first_answer_gives_the_mean_spins(tmp_path):
    """Against the counts themselves: differences over time, with u of two counts cut to whole turns."""
    t, n = np.arange(0.0, 200.0, 10.0), np.floor(390 * np.arange(20) - 3.0 * np.arange(20) ** 2)
    path = tmp_path / "counts.csv"
    np.savetxt(path, np.c_[t, n], fmt="%d", delimiter=",", header="Zeit (s),Impulse", comments="")
    (run,) = understand(path).runs
    (doubt,) = run.doubts
    assert doubt.choices[0].text == "turns since the start (38.7 to 27.9 Hz)"
    table = read_table(path, columns=doubt.choices[0].columns)
    assert table.column("time_s").tolist() == [*np.arange(5.0, 190.0, 10.0)]
    np.testing.assert_array_equal(table.column("spin_frequency_hz"), np.diff(n) / 10)
    assert table.column("spin_frequency_u_hz") == pytest.approx(np.full(19, 0.0408), abs=1e-4)  # √(1/6) turns in 10 s
    assert "counts turns since the start" in table.warnings[0]
    assert "3 to 4 times too large" in table.warnings[0]  # see test_readings of spindown


@pytest.mark.parametrize(
    ("titles", "columns"),
    [("N,u", {"t": "1", "f": "2 [turns]"}), ("n [turns],u", {}), ("n [turns],u [counts]", {"f": "2"})],
)
def test_a_count_of_turns_uses_its_own_u(titles, columns, write):
    path = write(f"t [s],{titles}\n0,0,3\n10,390,4\n20,770,0\n30,1140,0\n", "u.csv")
    table = read_table(path, quantities=SPIN, needed=SPIN[:2], columns=columns)
    assert table.column("spin_frequency_hz").tolist() == [39, 38, 37]
    assert table.column("spin_frequency_u_hz").tolist() == [0.5, 0.4, 0]  # √(u1² + u2²) turns in 10 s
    if not columns:
        assert not understand(path).problem


@pytest.mark.parametrize(
    ("table", "quantities", "said"),
    [
        ("t,n [turns]\n0,0\n10,390\n20,70\n", SPIN, "line 4: the count falls from 390 to 70, so the counter was reset"),
        ("t,n [turns],x_m\n0,0,1\n10,390,1\n20,770,1\n", (*SPIN, "x_m"), "between two rows, and none for what else"),
        ("t,n [turns],u [Hz]\n0,0,1\n10,390,1\n20,770,1\n", SPIN, "give u of the count, in turns"),
    ],
)
def test_a_count_of_turns_that_gives_no_spins_says_what_to_do(table, quantities, said, write):
    path = write(table, "u.csv")
    with pytest.raises(TableError) as refused:
        read_table(path, quantities=quantities, columns={"f": "2"})
    assert said in str(refused.value)


def test_a_count_of_turns_costs_no_row_of_another_analysis(write):
    path = write("t,n [turns],x_m\n0,0,1\n10,390,1\n20,770,1\n", "u.csv")
    table = read_table(path, quantities=(*SPIN, "x_m"), needed=["x_m"])
    assert ([*table.columns], len(table)) == (["time_s", "x_m"], 3)
    assert "not used: column 'n [turns]' counts turns since the start" in table.warnings[0]


def test_of_two_columns_without_titles_the_other_one_is_the_time(write):
    assert read_table(write(rows("{t} {f}")), columns={"f": "2 [Hz]"}).column("time_s")[1] > 0


@pytest.mark.parametrize("line", [
    "nach {t} s: {de} Hz", "- {t} s: {f} Hz", "t={t}s;f={de}Hz", "after {m} min {s} s  {f} Hz",
    "nach {m} Minuten {s} Sekunden: {de} Hz", "nach {t} Sek.: {de} Hz", "after {t} seconds: {f} Hz",
])  # fmt: skip
def test_times_and_spins_in_the_notes_of_a_person_are_read(line, write):
    times = (0, 10, 20, 70, 80, 90, 100)
    said = [line.format(t=t, m=t // 60, s=t % 60, f=35 - t / 10, de=f"{35 - t / 10}".replace(".", ",")) for t in times]
    table = read_table(write("Kreisel 2, 12.11.\n" + "\n".join(said) + "\n"))
    np.testing.assert_allclose(table.column("time_s"), times)
    np.testing.assert_allclose(table.column("spin_frequency_hz"), 35 - np.array(times) / 10)


@pytest.mark.parametrize("number", ["{}", "{}."])
def test_numbers_of_the_rows_are_no_times(number, write):
    rows = [f"{number.format(k)} {10 * k} {35 - k / 2:.1f}\n" for k in range(1, 9)]
    assert read_table(write("".join(rows))).column("time_s")[0] == 10
    for slope in (-0.5, 0.5):  # of the spin, which may grow, too
        rows = [f"{number.format(k)} {35 + slope * k:.1f} 0.1\n" for k in range(1, 9)]
        assert read_table(write("".join(rows))).column("time_s")[0] == 1


def test_counts_at_even_times_are_no_spins(write):
    path = write("t [s];Counts\n" + "".join(f"{2 * k};{70 - k}\n" for k in range(20)))
    with pytest.raises(NoSuchColumn, match=r"turns in 2 s \(35 to 25\.5 Hz\), Hz"):
        read_table(path, quantities=SPIN, needed=SPIN[:2])


@pytest.mark.parametrize(
    "title", ["Pulse pro Minute", "Pulse/min", "Drehzahl (Umdr./min)", "n (1/Min.)", "Drehzahl 1/min"]
)
def test_pulses_a_minute_and_units_with_a_point_are_spins(title, write):
    path = write(f"Zeit (Sek.);{title}\n" + "".join(f"{2 * k};{2100 - 9 * k}\n" for k in range(20)))
    assert read_table(path).column("spin_frequency_hz")[0] == pytest.approx(35)


@pytest.mark.parametrize(("title", "factor"), [("1/T", 35.0), ("Umdrehungszeit [ms]", 1000 / 35)])
def test_other_names_of_the_spin_and_its_period_are_known(title, factor, write):
    rows = "".join(f"23.11.2026 14:00:{k:02d};{factor}\n" for k in range(20))
    assert read_table(write(f"Datum/Uhrzeit;{title}\n{rows}")).column("spin_frequency_hz")[0] == pytest.approx(35)


@pytest.mark.parametrize("form", ["{t}, {f}; ", "{t} {f} "])
def test_readings_in_one_line_are_asked_for_a_line_each(form, write):
    with pytest.raises(NoSuchColumn, match="all readings stand in one line: write a line for each"):
        read_table(write("".join(form.format(t=2 * k, f=35 - k / 10) for k in range(30)) + "\n"))


def test_times_of_turns_without_their_own_times_say_what_is_missing(write):
    path = write("n,T\n" + "".join(f"{k},{25 + k / 100}\n" for k in range(20)))
    with pytest.raises(NoSuchColumn, match=r"at which the turns were timed: .* keep the times of the turns alone"):
        read_table(path, columns={"f": "2 [ms]"}, quantities=SPIN, needed=SPIN[:2])


def test_numbers_of_readings_are_no_times_and_get_the_length_of_a_step(write):
    path = write("Messung;Frequenz / Hz\n" + "".join(f"{k + 1};{35 - k / 10}\n" for k in range(20)))
    with pytest.raises(NoSuchColumn, match=r"'Messung' has the numbers of the readings: .* \"t=1 \[2 s\]\""):
        read_table(path, quantities=SPIN, needed=SPIN[:2])
    assert read_table(path, columns={"t": "1 [2 s]"}).column("time_s")[[0, -1]] == pytest.approx([2, 40])
