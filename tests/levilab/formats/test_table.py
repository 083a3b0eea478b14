"""Foreign tables: what people's programs write, what is refused and how, and properties over all dialects."""

import codecs
import math
import os
import re
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from levilab.errors import DataError, UsageError
from levilab.formats import dialect
from levilab.formats.columns import Column, NoSuchColumn, NoTable, TableError, quote_names, shorten
from levilab.formats.dialect import DIALECTS, Dialect
from levilab.formats.layout import Layout, sniff
from levilab.formats.rows import FEW, _read_at_once, _read_lines
from levilab.formats.table import ColumnsError, parse_columns, read_run_readings, read_table
from levilab.formats.texts import Text
from levilab.formats.titles import read_title, unit_factor
from levilab.texts.note import is_doubt
from levilab.texts.text import in_language

T, F, U = "time_s", "spin_frequency_hz", "spin_frequency_u_hz"
PLAIN = {T: [0, 0.5, 1], F: [61.5, 61.25, 61]}
SECONDS = PLAIN | {T: [0, 1, 2]}
WITH_U = PLAIN | {U: [0.25, 0.5, 0.125]}
ENGLISH = re.compile(r"\b(the|of|is|are|and|to|with|not|it|or|at|say|holds|column)\b")
SLOW = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(params=[FEW, 0], ids=["by line", "at once"])
def either_way(request, monkeypatch):
    """A short table is read line by line, a long one at once if its lines are plain: here short ones are, too."""
    monkeypatch.setattr("levilab.formats.rows.FEW", request.param)


BOTH_WAYS = pytest.mark.usefixtures("either_way")

TABLES = {
    "canonical": (f"{T},{F},{U}\n0,61.5,.25\n0.5,61.25,.5\n1,61,.125\n", WITH_U),
    "canonical in another order": (f"{U},{F},{T}\n.25,61.5,0\n.5,61.25,.5\n.125,61,1e0\n", WITH_U),
    "short names": ("t,f,u\n0,61.5,.25\n0.5,61.25,.5\n1,61,.125\n", WITH_U),
    "canonical goes before an alias": (f"t,f,{F}\n0,1,61.5\n0.5,1,61.25\n1,1,61\n", PLAIN),
    "German Excel": ('\ufeff"Zeit [s]";"Frequenz [Hz]"\r\n0;61,5\r\n0,5;61,25\r\n1;61\r\n', PLAIN),
    "German Excel, trailing separators": ("Zeit (s);Frequenz (Hz);;\r\n0;61,5;;\r\n0,5;61,25;;\r\n1;61;;\r\n", PLAIN),
    "quoted decimal commas": ('Zeit,f\n"0","61,5"\n"0,5","61,25"\n"1","61,0"\n', PLAIN),
    "units row": ("t;f\ns;Hz\n0;61.5\n0.5;61.25\n1;61\n", PLAIN),
    "units row in brackets, milli and kilo": ("t,f\n[ms],[kHz]\n0,.0615\n500,.06125\n1000,.061\n", PLAIN),
    "rpm": ("t,rpm\n0,3690\n0.5,3675\n1,3660\n", PLAIN),
    "rpm, u without a unit of its own": ("t,rpm,u\n0,3690,15\n0.5,3675,30\n1,3660,7.5\n", WITH_U),
    "1/min with a superscript": ("t,Drehfrequenz / min⁻¹\n0,3690\n0.5,3675\n1,3660\n", PLAIN),
    "Excel's own first line": ("sep=;\r\nZeit;Drehzahl [1/min]\r\n0;3690\r\n0,5;3675\r\n1;3660\r\n", PLAIN),
    "milliseconds": ("t [ms]\tfrecuencia de rotacion (hercios)\n0\t61.5\n500\t61.25\n1000\t61\n", PLAIN),
    "microseconds, two letters mu": ("t/µs,f,u_f/μHz\n0,61.5,250000\n500000,61.25,5e5\n1e6,61,125e3\n", WITH_U),
    "minutes": (f"t_min,f_hz\n0,61.5\n{0.5 / 60!r},61.25\n{1 / 60!r},61\n", PLAIN),
    "kHz as a suffix": ("elapsed,f_khz\n0,.0615\n.5,.06125\n1,.061\n", PLAIN),
    "in words": ("Time in ms, Spin frequency in Hz\n0, 61.5\n500, 61.25\n1000, 61\n", PLAIN),
    "nu with a subscript": ("t,ν₃\n0,61.5\n0.5,61.25\n1,61\n", PLAIN),
    "blanks": ("  t [s]    f / Hz\n   0     61.5\n   0.5   61.25\n   1     61   \n", PLAIN),
    "blanks and decimal commas": ("t f\n0,0 61,5\n0,5 61,25\n1,0 61,0\n", PLAIN),
    "thousands of blanks": (f"t,f\n0,{' ' * 3000}61.5\n0.5,61.25{' ' * 3000}\n1,61\n", PLAIN),
    "numpy.savetxt": ("# t f\n0.0e+00 6.15e+01\n5e-01 6.125e+01\n1e+00 6.1e+01\n", PLAIN),
    "comments everywhere": ("# made\n% by\nt,f\n// hand\n0,61.5\n#\n0.5,61.25\n; x\n1,61\n' end\n", PLAIN),
    "preamble": ("Counter,CNT-91\nGate time,0.1,s\n\nnote: a, b\n\nt,f\n0,61.5\n0.5,61.25\n1,61\n", PLAIN),
    "preamble with blanks, table with tabs": ("Run 5 of 12\nt\tf\n0\t61.5\n0.5\t61.25\n1\t61\n", PLAIN),
    "preamble that begins like a title": ("Time: noon, lab\nZeit;Frequenz\n0;61,5\n0,5;61,25\n1;61\n", PLAIN),
    "unbalanced quotation mark above": ('5" disk\nt,f\n0,61.5\n0.5,61.25\n1,61\n', PLAIN),
    "carriage returns": ("t,f\r0,61.5\r0.5,61.25\r1,61\r", PLAIN),
    "blank lines, no last line end": ("\n\nt,f\n\n0,61.5\n  \n0.5,61.25\n\n1,61", PLAIN),
    "text and clock beside": ("when,t,f,ok\n9:00 am,0,61.5,yes\n9:01,0.5,61.25,no\n9:02,1,61,\n", PLAIN),
    "notes with commas among semicolons": ("t;f;note\n0;61,5;a, 7, 8\n0,5;61,25;b, 1, 2\n1;61;c, 3\n", PLAIN),
    "Latin-1": ("t/µs;f;Gerät\n0;61,5;ä\n500000;61,25;ö\n1000000;61;ü\n".encode("latin-1"), PLAIN),
    "UTF-16 little": (codecs.BOM_UTF16_LE + "Zeit;f\r\n0;61,5\r\n0,5;61,25\r\n1;61\r\n".encode("utf-16-le"), PLAIN),
    "UTF-16 big": (codecs.BOM_UTF16_BE + "t\tf\r\n0\t61.5\r\n.5\t61.25\r\n1\t61\r\n".encode("utf-16-be"), PLAIN),
    "angle": ("t,omega\n" + "".join(f"{t},{2 * np.pi * f!r}\n" for t, f in zip(*PLAIN.values(), strict=True)), PLAIN),
    "stopwatch": ("t,f\n0:00,61.5\n0:00.5,61.25\n0:01,61\n", PLAIN),
    "stopwatch in a column of minutes": ("t [min],f\n0:00,61.5\n0:00.5,61.25\n0:01,61\n", PLAIN),
    "clock": ("Uhrzeit;f\n14:05:12;61,5\n14:05:12,5;61,25\n14:05:13;61\n", PLAIN | {T: [0, 0.5, 1]}),
    "dates": ("t,f\n2026-11-20T14:05:12Z,61.5\n2026-11-20T14:05:12.5Z,61.25\n2026-11-20T15:05:13+01:00,61\n", PLAIN),
    "thousands with points": ("Temps (s);vitesse (tr.min-1)\n0;3.690,0\n0,5;3.675,0\n1;3.660,0\n", PLAIN),
    "thousands with commas": ("t;rpm\n0;3,690.0\n0.5;3,675.0\n1;3,660.0\n", PLAIN),
    "midnight": ("t,f\n23:59:59,61.5\n00:00:00,61.25\n0:00:01,61\n", PLAIN | {T: [0, 1, 2]}),
    "noon of half days": ("Time,f\n11:59 am,61.5\n12:00 PM,61.25\n12:01 PM,61\n", PLAIN | {T: [0, 60, 120]}),
    "a year of two digits": ("Zeit;f\n31.12.25 23:59:59;61.5\n01.01.26 00:00;61.25\n1.1.26 00:00:01;61\n", SECONDS),
    "month first": ("t,f\n12/31/2025 11:59:59 PM,61.5\n1/1/2026 12:00:00 AM,61.25\n1/1/2026 12:00:01 AM,61\n", SECONDS),
    "names of months": (
        "Datum;f\n28. Februar 2026 23:59:59;61.5\n1. März 2026 00:00;61.25\n1-Mar-2026 0:00:01;61\n",
        SECONDS,
    ),
    "names of months before days": (
        't,f\n"Dec. 31, 2025 11:59:59 PM",61.5\n"Jan 1, 2026 12:00:00 AM",61.25\n1 Jan 2026 00:00:01,61\n',
        SECONDS,
    ),
    "seconds since 1970": (
        "epoch,f\n1795442712,61.5\n1795442713,61.25\n1795442714,61\n",
        PLAIN | {T: [1795442712 + k for k in range(3)]},
    ),
    "time of 50 turns": ("t [s],T_50 [s]\n0,1\n1,1.25\n2,2\n", {T: [0, 1, 2], F: [50, 40, 25]}),
    "one day": ("Date/Time,f\n1/2/2026 9:59:59,61.5\n1/2/2026 10:00,61.25\n1/2/2026 10:00:01,61\n", SECONDS),
    "percent": ("t,f,u [%]\n0,50,1\n1,40,1\n2,20,5\n", {T: [0, 1, 2], F: [50, 40, 20], U: [0.5, 0.4, 1]}),
    "scatter": ("t,rpm,Std. Dev. [rpm]\n0,3000,6\n1,2400,6\n2,1200,6\n", {T: [0, 1, 2], F: [50, 40, 20], U: [0.1] * 3}),
    "Arduino's clock": ("millis,rpm\n0,3690\n500,3675\n1000,3660\n", PLAIN),
    "Arduino's finer clock": ("micros,rpm\n0,3690\n500000,3675\n1000000,3660\n", PLAIN),
    "guarded against formulas": ("t,f\n'-1,61.5\n0,61.25\n1,61\n", PLAIN | {T: [-1, 0, 1]}),
    "numbered columns beside a spin are no runs": ("t,f,x1,x2\n0,61.5,1,2\n.5,61.25,1,2\n1,61,1,2\n", PLAIN),
    "half days with points": (
        "hora,f\n11:59:59 p. m.,61.5\n12:00:00 a.m.,61.25\n12:00:01 A.M.,61\n",
        PLAIN | {T: [0, 1, 2]},
    ),
    "day first": ("t,f\n31/12/2025 23:59:59,61.5\n1/1/2026 0:00:00,61.25\n1/1/2026 0:00:01,61\n", SECONDS),
    "Arduino's greeting, labels with =": ("= Start =\nt=0 f=61.5\nt=0.5 f=61.25\nt=1 f=61\n", PLAIN),
    "labels without marks": ("Time 0, Freq 61.5\nTime .5, Freq 61.25\nTime 1, Freq 61\n", PLAIN),
    "a stopwatch": ("t [mm:ss],f [Hz]\n0:00,61.5\n0:00.5,61.25\n0:01,61\n", PLAIN),
    "LabVIEW's title of the times": ("X_Value,f [Hz]\n0,61.5\n0.5,61.25\n1,61\n", PLAIN),
    "field scan": (
        "z/mm;u_z/mm;B [mT]\n10;0,5;20\n20;0,5;10\n30;0,5;5\n",
        {"height_m": [0.01, 0.02, 0.03], "height_u_m": [5e-4] * 3, "flux_density_t": [0.02, 0.01, 0.005]},
    ),
}


ANGULAR = (
    "ω in 1/s", "omega [1/s]", "ω in s^-1", "ω [s⁻¹]", "ω / s⁻¹", "Winkelgeschwindigkeit in 1/s",
    "angular velocity (1/s)", "Kreisfrequenz / (1/s)", "Winkelgeschwindigkeit ω in 1/s", "Frequenz ω / s⁻¹", "ω\ns;1/s",
)  # fmt: skip


@pytest.mark.parametrize("title", ANGULAR)
def test_an_angular_frequency_in_1_per_s_is_in_rad_per_s(title, write):
    """As German textbooks write it: 1/s of an ω is no Hz; its uncertainty likewise."""
    name, _, units = title.partition("\n")
    head = f"t in s;{name};u_ω in 1/s\n" + (f"{units};1/s\n" if units else "")
    rows = "".join(f"{t};{2 * math.pi * f!r};{2 * math.pi * 0.25!r}\n" for t, f in zip(*PLAIN.values(), strict=True))
    table = read_table(write(head + rows))
    np.testing.assert_allclose(table.column(F), PLAIN[F], rtol=4e-16)
    np.testing.assert_allclose(table.column(U), [0.25] * 3, rtol=4e-16)
    assert any("rad/s" in warning for warning in table.warnings)


@pytest.mark.parametrize(
    "title", ["f in 1/s", "Drehzahl [1/s]", "Drehzahl n / s^-1", "Frequenz f", "ω in Hz", "n / s⁻¹"]
)
def test_turns_in_1_per_s_stay_turns(title, write):
    table = read_table(write(f"Zeit t in s;{title}\n0;61.5\n0.5;61.25\n1;61\n"))
    np.testing.assert_array_equal(table.column(T), PLAIN[T])
    np.testing.assert_array_equal(table.column(F), PLAIN[F])
    assert not table.warnings


@BOTH_WAYS
@pytest.mark.parametrize("name", TABLES)
def test_a_table_reads_the_same_in_every_dialect(name, write):
    text, expected = TABLES[name]
    table = read_table(write(text))
    assert set(table.frame.columns) == set(expected)
    for column, values in expected.items():
        np.testing.assert_allclose(table.column(column), values, rtol=4e-16, atol=0)
    assert table.warnings == ()
    assert (table.frame.dtypes == np.float64).all()


def test_times_of_hours_and_minutes_are_doubted(write):
    """A stopwatch begins at 0 minutes, as in the tables above; 14:05 and 14:06 may be a minute apart."""
    path = write("time,f\n14:05,61.5\n14:06,61.25\n14:07,61\n")
    table = read_table(path)
    np.testing.assert_allclose(table.column(T), [845, 846, 847])
    (warning,) = table.warnings
    said = "the times, as 14:05, are taken for minutes and seconds and may be hours and minutes: say which, `columns` ="
    assert f'{said} "t=1 [hh:mm]" or "t=1 [mm:ss]"' in warning
    assert is_doubt(warning)
    for unit, step in (("hh:mm", 60), ("mm:ss", 1)):
        table = read_table(path, columns={"t": f"1 [{unit}]"})
        assert (np.diff(table.column(T)).tolist(), table.warnings) == ([step, step], ())


@pytest.mark.parametrize(
    ("title", "first", "step", "doubts"),
    [("Uhrzeit", 14, 60, 0), ("Datum/Uhrzeit", 14, 60, 0), ("time of day", 9, 60, 0), ("Heure", 14, 60, 0),
     ("Zeit [hh:mm]", 0, 60, 0), ("t [min]", 14, 1, 0), ("Uhrzeit", 0, 60, 1), ("t", 0, 1, 0), ("t", 24, 1, 0)],
)  # fmt: skip
def test_a_title_that_means_the_time_of_day_makes_hours_and_minutes(write, title, first, step, doubts):
    table = read_table(write(f"{title},f [Hz]\n{first}:05,61.5\n{first}:06,61.25\n{first}:07,61\n"))
    assert (np.diff(table.column(T)).round(9).tolist(), sum(map(is_doubt, table.warnings))) == ([step, step], doubts)


@pytest.mark.parametrize("text", [
    "Levitron, Tuesday. Top 25 g, room 22 C\n0  61.5 Hz\n0.5  61.25 Hz\n1  61 Hz\n",
    "Levitron Tuesday. Top 25 g\n0:00  61.5 Hz\n0:00.5  61.25 Hz\n0:01  61 Hz\n",
    "We spun it by hand, then let go.\n0 61.5\n0.5 61.25\n1 61\n",
    "Levitron, Tuesday. Top 25 g\n0,61.5\n0.5,61.25\n1,61\n",
])  # fmt: skip
def test_a_sentence_above_a_table_is_no_header(write, text):
    table = read_table(write(text))
    assert {name: values.tolist() for name, values in table.columns.items()} == SECONDS | {T: [0, 0.5, 1]}
    assert any("no header; the columns are taken as time_s, spin_frequency_hz" in note for note in table.warnings)


def test_titles_with_a_comma_or_a_point_are_no_sentence(write):
    table = read_table(write("Zeit, Drehzahl [Hz]\n0 61.5\n0.5 61.25\n1 61\n"))
    assert table.column(F).tolist() == [61.5, 61.25, 61]
    with pytest.raises(NoSuchColumn, match="no title is known"):
        read_table(write("Umg. Temp.;Luftf. Mittel\n20;61.5\n21;61.25\n22;61\n"))


def test_hours_and_minutes_go_on_beyond_midnight(write):
    table = read_table(write("Uhrzeit,f [Hz]\n23:59,61.5\n0:00,61.25\n0:01,61\n"))
    assert np.diff(table.column(T)).tolist() == [60, 60]


def test_a_clock_of_12_hours_goes_on_after_noon_and_a_run_at_another_time_does_not(write):
    table = read_table(write("time,f [Hz]\n12:59:50,61.5\n01:00:00,61.25\n01:00:10,61\n"))
    assert np.diff(table.column(T)).tolist() == [10, 10]
    table = read_table(write("time,f [Hz]\n12:59:50,61.5\n09:00:00,61.25\n09:00:10,61\n"))
    assert table.column(T)[1] < table.column(T)[0]


def test_numbers_of_rows_with_a_point_are_titles_and_no_sentence(write):
    table = read_table(
        write("Nr.;Umdrehungsfrequenz beim Fall in Hz;t in s\n1;38.5;0\n2;37.5;10\n3;36.5;20\n"), columns={"f": "2"}
    )
    assert table.column(T).tolist() == [0, 10, 20]


def test_a_date_in_place_of_a_decimal_says_how_it_came_there(write):
    with pytest.raises(TableError, match=r"'2026-01-30' stands in column 'f / Hz', .*: a spreadsheet takes 30\.1 for"):
        read_table(write("t / s,f / Hz\n0,32.2\n10,31.1\n20,2026-01-30\n30,29.4\n40,28.6\n"))


@pytest.mark.parametrize(("text", "says"), [
    ("t,f\n01/02/2026 23:59:59,61.5\n02/02/2026 0:00:00,61.25\n02/02/2026 0:00:01,61\n", "for day/month/year"),
    ("t,f\n1/2/2026 23:59:59,61.5\n1/3/2026 0:00:00,61.25\n1/3/2026 0:00:01,61\n", "for month/day/year"),
    ("t,f\n0,61.5\nt,f\n1,61.25\nk.A.,#DIV/0!\n2,61\n", "2 of 5 rows hold no reading (first: 't,f')"),
    ("t,f,u\n0,61.5,\n1,61.25,\n2,61,\n", "'u' is empty"),
    ("t,f,u [ppm]\n0,61.5,1\n1,61.25,1\n2,61,1\n", "'ppm' is no unit of frequency"),
    ("t,f\n0,61.5\n1,61.25\n2,61\nmean,61.25\nEnd of data\n", "of 5 rows hold no reading (first: 'mean,61.25')"),
])  # fmt: skip
def test_what_is_taken_for_what_it_looks_like_has_a_note(write, text, says):
    table = read_table(write(text))
    assert {name: values.tolist() for name, values in table.columns.items()} == SECONDS
    assert says in table.warnings[0]


def test_dates_count_from_the_first_that_is_written(write):
    text = "t,f,u\n,61.5,\n2026-11-20T14:05:12Z,61.5,\n2026-11-20T14:05:13Z,61.25,\n2026-11-20T14:05:14Z,61,\n"
    assert read_table(write(text)).column(T).tolist() == [0, 1, 2]


@BOTH_WAYS
@pytest.mark.parametrize(
    "missed", ["", "-", "--", "n/a", "nan", "NaN", "inf", "-Infinity", "9.91E37", "9.9e+37", "1e999"]
)
def test_a_missed_reading_is_left_out_with_a_warning(missed, write):
    table = read_table(write(f"t,f\n0,61.5\n0.2,{missed}\n0.5,61.25\n1,61\n"))
    assert table.column(T).tolist() == PLAIN[T]
    assert table.lines.tolist() == [2, 4, 5]
    assert len(table.warnings) == 1
    assert "1 of 4 rows" in table.warnings[0]
    assert table.warnings[0].endswith("line 3")


@BOTH_WAYS
def test_many_missed_readings_make_one_warning(write):
    table = read_table(write("t;f\n" + "".join(f"{i};{'' if i % 2 else '61,5'}\n" for i in range(30))))
    (warning,) = table.warnings
    assert warning.partition(": ")[2] == (
        "15 of 30 rows are left out as missed (empty, -, n/a, nan, inf or 9.91E37): lines 3, 5, 7, 9, 11, …"
    )


def test_a_column_of_true_and_false_is_refused_by_its_line(write):
    # those that the layout is guessed from hold the titles, or do not; beyond 64 kB
    for rows, digits in ((5, 0), (200, 0), (1000, 60)):
        path = write("time_s,spin_frequency_hz\n" + "".join(f"{k:.{digits}f},{k % 2 == 0}\n" for k in range(rows)))
        with pytest.raises(TableError, match="line 2: 'True' stands in column 'spin_frequency_hz', a number"):
            read_table(path)
    titles_below = "".join(f"{k},{k}\n" for k in range(20)) + "time_s,spin_frequency_hz\n" + 200 * "no row, but words\n"
    with pytest.raises(NoTable, match="'0,0' begins no table of at least two columns"):
        read_table(write(titles_below))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize(("header", "row"), [
    (("Datum", "Temperatur", "Kommentar"), ("2024-01-05", "21.5", "kalt")),
    (("Temperatur", "Kommentar"), ("21", "kalt")),
])  # fmt: skip
def test_the_error_of_a_table_of_words_names_the_known_titles(separator, header, row, write):
    path = write("\n".join(map(separator.join, [header, *[row] * 19])) + "\n")
    with pytest.raises(
        NoSuchColumn, match=f'no title is known .* among {quote_names(header)}: say `columns` = "t=NAME'
    ):
        read_table(path)
    with pytest.raises(TableError, match="line 2: 'kalt' stands in column 'Kommentar'"):
        read_table(path, columns={"t": "Temperatur", "f": "Kommentar"})


@BOTH_WAYS
@pytest.mark.parametrize("last", ["1.5", "1.5,6x", "1.5,60.5,7", "1.5,-e"])
def test_a_torn_last_line_is_left_out_with_a_warning(last, write):
    table = read_table(write("t,f\n0,61.5\n0.5,61.25\n1,61\n" + last))
    assert table.column(T).tolist() == PLAIN[T]
    assert f"line 5: '{last}' was cut off" in table.warnings[0]


def test_numbers_without_header_are_time_frequency_and_uncertainty_with_a_warning(write):
    table = read_table(write("0,61.5,.25\n0.5,61.25,.5\n1,61,.125\n"))
    assert {name: table.column(name).tolist() for name in table.frame} == WITH_U
    assert f"no header; the columns are taken as {T}, {F}, {U}" in table.warnings[0]


def test_a_first_column_that_falls_beside_times_from_0_is_the_spin(write):
    table = read_table(write("61.5,0,.25\n61.25,0.5,.5\n61,1,.125\n"))
    assert {name: table.column(name).tolist() for name in table.frame} == WITH_U
    assert f"no header; the columns are taken as {F}, {T}, {U}" in table.warnings[0]
    table = read_table(write("1,61\n0.5,61.25\n0,61.5\n"))  # the latest row first
    assert f"no header; the columns are taken as {T}, {F}" in table.warnings[0]


def test_units_behind_the_numbers_tell_the_columns_of_a_text_without_titles(write):
    table = read_table(write("".join(f"Reading {k}: {38 - 0.8 * k:.2f} Hz at {10 * k} s\n" for k in range(5))))
    assert table.column("time_s").tolist() == [0, 10, 20, 30, 40]
    assert table.column("spin_frequency_hz").tolist() == [38.0, 37.2, 36.4, 35.6, 34.8]


@pytest.mark.parametrize(
    ("text", "columns", "expected"),
    [
        ("A;B;C\n7;0;61,5\n7;0,5;61,25\n7;1;61\n", {"t": "B", "f": "C"}, PLAIN),
        ("A;B;C\n7;0;61,5\n7;0,5;61,25\n7;1;61\n", {"t": "2", F: "3"}, PLAIN),
        ("7,0,61.5,x\n7,0.5,61.25,x\n7,1,61,x\n", {"t": "2", "f": "3"}, PLAIN),
        ("Scope 7\n0,61.5\n0.5,61.25\n1,61\n", {"t": "1", "f": "2"}, PLAIN),
        ("t,f,freq\n0,1,61.5\n0.5,1,61.25\n1,1,61\n", {"f": "FREQ"}, PLAIN),
        ("t,CH1 [kHz]\n0,.0615\n0.5,.06125\n1,.061\n", {"f": "CH1"}, PLAIN),
        ("t,CH1 (top)\n0,61.5\n0.5,61.25\n1,61\n", {"f": "CH1 (top)"}, PLAIN),
        ("t,rpm\n0,3690\n0.5,3675\n1,3660\n", {"f": "rpm"}, PLAIN),
        ("t,x,w\n0,20,2\n0.5,25,0.5\n1,40,1\n", {"f": "2 [ms]"}, {T: PLAIN[T], F: [50, 40, 25]}),
        (
            "t,x,w\n0,20,2\n0.5,25,5\n1,40,1\n",
            {"f": "2 [ms]", "u": "w [%]"},
            {T: PLAIN[T], F: [50, 40, 25], U: [1, 2, 0.25]},
        ),
    ],
)
def test_columns_can_be_named(text, columns, expected, write):
    table = read_table(write(text), columns=columns)
    assert set(table.frame) == set(expected)
    for name, values in expected.items():
        np.testing.assert_allclose(table.column(name), values, rtol=4e-16)


GOOD = "t,f\n0,61.5\n0.5,61.25\n1,61\n"
# content, columns, words that the message must have
ERRORS = {
    "empty": ("", None, ["is empty"]),
    "blank": ("\n \n\t\n", None, ["is empty"]),
    "only a header": ("t,f\n", None, ["line 1", "only a header", "at least 3"]),
    "only a header, no line end": ("t,f", None, ["line 1", "only a header"]),
    "two readings": ("t,f\n0,61.5\n1,61\n", None, ["2 readings", "at least 3"]),
    "all missed": ("t,f\n0,nan\n1,nan\n2,nan\n3,nan\n", None, ["0 readings and 4 missed"]),
    "text in a number column": ("t,f\n0,61.5\n0.5,6l.5\n1,61\n", None, ["line 3", "'6l.5'", "'f'", "decimal point"]),
    "text in all rows": ("t,f\nabc,def\n", None, ["line 2", "'abc'"]),
    "decimal comma among points": ("t;f\n0;61.5\n0.5;61,25\n1;61.1\n", None, ["line 3", "'61,25'", "decimal point"]),
    "decimal commas between commas": ("t,f\n0,61,5\n1,61,25\n2,60,75\n", None, ["line 2", "3 fields", "; or tab"]),
    "too few fields": ("t,f\n0,61.5\n0.5\n1,61\n", None, ["line 3", "'0.5'", "1 field,", "2 are expected"]),
    "too many fields": ("t,f\n0,61.5\n0.5,61,7\n1,61\n2,60\n", None, ["line 3", "3 fields"]),
    "second header": ("t,f [Hz]\n0,61\n1,61\n2,61\nt,f [rpm]\n3,60\n", None, ["line 5", "write one unit"]),
    "thousands separator": ("t;f [Hz]\n0;1.061\n1;1.061,2\n2;1.061,1\n", None, ["line 2", "'1.061'"]),
    "underscore": ("t,f\n0,61\n1,6_1\n2,60\n", None, ["line 3", "'6_1'"]),
    "two frequencies": ("t,f,rpm\n0,1,60\n1,1,60\n2,1,60\n", None, ["'f', 'rpm'", "`columns` = f=2 or f=3"]),
    "wrong name": (GOOD, {"f": "nu"}, ["no column 'nu'", "'t', 'f'"]),
    "wrong number": (GOOD, {"f": "3"}, ["no column '3'"]),
    "wrong quantity": (GOOD, {"speed": "f"}, ["cannot set 'speed'", "spin_frequency_hz"]),
    "one column twice": (GOOD, {"t": "t", "f": "1"}, ["'1' twice"]),
    "unknown titles": ("# x\na,c\nV,V\n\n0,1\n1,2\n2,3\n", None, ["line 2", "'a', 'c'", "`columns`"]),
    "speed without a unit": ("a,speed\n0,1\n1,2\n2,3\n", None, ["'speed'", "`columns`"]),
    "mHz or MHz": ("a,f_mhz\n0,1\n1,2\n2,3\n", None, ["'f_mhz'"]),
    "no header, many columns": ("0,1,2,3\n1,1,2,3\n2,1,2,3\n", None, ["line 1", "4 columns and no header"]),
    "one title, two columns": ("f [rpm]\n0,38.0\n1,37.0\n2,36.0\n", None, ["line 1", "no header", "t=1,f=2"]),
    "titles with blanks": ("t  f\n0,61\n1,61\n2,60\n", None, ["line 1", "no header", "t=1,f=2"]),
    "text in the middle": ("t,f\n0,61.5\nca. 1,61\n2,61\n3,60\n", None, ["line 3", "'ca. 1' stands in column 't'"]),
    "no times": ("RPM: 2403\nRPM: 2400\nRPM: 2397\nRPM: 2394\n", None, ["its times are needed"]),
    "prose in one line": ("one, two\n", None, ["begins no table of at least two columns"]),
    "prose": ("Dear all,\nsee you.\n", None, ["line 1", "Dear all"]),
    "contradicting units": ("t/s,f\nms,Hz\n0,61\n1,61\n2,60\n", None, ["'t/s'", "'ms'"]),
    "PNG": (b"\x89PNG\r\n\x1a\n\0\0", None, ["picture", "as CSV"]),
    "xlsx": (b"PK\x03\x04\x14\0", None, ["damaged ZIP or Excel file", "save it again"]),
    "zeros": (b"\0" * 100, None, ["binary", "export it as CSV"]),
    "one endless line": (b"1," * 50000, None, ["without end"]),
    "control characters in a field": (GOOD + "1.5,\x1b[31m6\n", None, ["line 5", "\N{REPLACEMENT CHARACTER}[31m6"]),
    "long text": (f"t,f\n0,61\n1,{'7x' * 250}\n2,60\n", None, ["line 3", "7x7…"]),
}


@BOTH_WAYS
@pytest.mark.parametrize("name", ERRORS)
def test_an_error_is_one_line_that_names_file_and_place(name, write):
    content, columns, words = ERRORS[name]
    path = write(content)
    with pytest.raises(DataError) as caught:
        read_table(path, columns=columns)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert message.isprintable()
    assert len(message) < len(str(path)) + 330
    assert all(word in message for word in words), message
    assert not ENGLISH.search(in_language(caught.value.message, "de"))
    if any(word.startswith("line ") for word in words):
        assert f"line {caught.value.line}" in words


def test_what_is_no_file_is_reported(tmp_path):
    for path, words in ((tmp_path / "none.csv", "no such file"), (tmp_path, "is a folder")):
        with pytest.raises(TableError, match=words):
            read_table(path)
    with pytest.raises(TableError, match="no such file"):
        read_table(tmp_path / "a\0b")


def test_a_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(TableError, match="device or a pipe"):
        read_table(tmp_path / "pipe")


@pytest.mark.parametrize("title", ["t [s];f [Hz];Bemerkung", "t [s];f [Hz]"])
def test_a_remark_beside_a_row_is_named(title, write):
    rows = [f"{t};{40 - t / 10}{';touched' * (t == 20)}" for t in range(0, 60, 10)]
    table = read_table(write("\n".join([title, *rows, ""])))
    assert list(table.columns[T]) == [0, 10, 20, 30, 40, 50]
    (said,) = [text for text in table.warnings if "touched" in text]
    assert said.endswith("line 4: the remark 'touched' is not read")


@pytest.mark.parametrize(
    ("error", "words"), [(PermissionError(13, "denied"), "may not be read"), (OSError(5, "I/O error"), "I/O error")]
)
def test_an_unreadable_file_is_reported(error, words, write, monkeypatch):
    path = write(GOOD)
    monkeypatch.setattr(Path, "open", Mock(side_effect=error))
    for read in (read_table, read_run_readings):
        with pytest.raises(TableError, match=words):
            read(path)


@BOTH_WAYS
@pytest.mark.parametrize(
    ("text", "columns", "says"),
    [
        (
            "t,period\n0,25\n1,26\n2,27\n",
            {},
            "column 2 'period' has the values 25 to 27 and no unit: ms (40 to 37 Hz)?",
        ),
        ("t;10 Umdrehungen\n0;0,25\n1;0,26\n2;0,27\n", {"f": "2"}, "no unit: s (40 to 37 Hz)?"),
        ("t,Periode\n0,25e3\n1,26e3\n2,27e3\n", {}, "and no unit: ms or s?"),
        ("t,T\n0,25\n1,26\n2,27\n", {}, "if T is the time of a turn say its unit, as T [ms]"),
        ("t,turns\n0,400\n1,390\n2,380\n", {}, "say in which time in the title, as in turns in 10 s"),
        ("t,Umdrehungen gezählt\n10,399\n20,785\n30,1156\n", {}, "turns since the start (38.6 to 37.1 Hz)"),
        ("t,turns\n10,399\n20,785\n30,1156\n", {}, 'say `columns` = "t=1,f=2 [turns]"'),
        ("t,T (°C)\n10,39\n20,38\n30,37\n", {"f": "2"}, "has the unit °C, which is none of frequency"),
        ("t,spin (ms)\n0,25\n1,26\n2,27\n", {}, "column 'spin (ms)' is in ms, which is no unit of frequency: correct"),
        ("t,spin (ms)\n0,25\n1,26\n2,27\n", {"f": "2"}, "times of a turn call the column period [ms]"),
        (
            "t,f / Hz\n0,25\n1,26\n2,27\n",
            {"x": "2"},
            "column 'f / Hz' is spin_frequency_hz by its title, and `columns`",
        ),
        ("t,f\n0,25\n1,26\n2,27\n", {"x": "2"}, "column 'f' is spin_frequency_hz by its title, and `columns` takes"),
        ("t [V],f\n0,25\n1,26\n2,27\n", {"t": "1"}, "V, which is none of time: say which unit it is, as NAME [s]"),
        (
            "t,f\n0,61.5?\n1,61.2\n2,ca. 61\n3,60\n4,59\n",
            {},
            "missed (also in 1 other line: 4); `skip_doubtful` leaves",
        ),
        ("t,f\n0,61\n" + "1,6l\n" * 7, {}, "line 3: '6l' stands in column 'f', a number"),
        ("t,f\n0,61\n" + "1,6l\n" * 7, {}, "(also in 6 other lines: 4, 5, 6, 7, 8, …)"),
        ("t,Acceleration x (m/s^2),y (m/s^2),z (m/s^2)\n0,1,2,9\n1,1,2,9\n2,1,2,9\n", {}, "is of the accelerometer"),
        ("t,f\n0:00,61.5\n0:99,61.2\n0:10,61\n", {}, "line 3: '0:99' stands in column 't'"),
        ("t,f\n12:59 PM,61.5\n13:00 PM,61.2\n1:01 PM,61\n", {}, "line 3: '13:00 PM' stands in column 't'"),
        ("t,Illuminance (lx)\n0,25\n1,26\n2,27\n", {}, "is of the light sensor, which shows no turns"),
        ("t,f\n0,0:10\n1,61.2\n2,61\n", {}, "'0:10' stands in column 'f'"),
    ],
)
def test_what_is_nearly_a_reading_is_reported_with_what_to_do(text, columns, says, write):
    with pytest.raises(TableError) as error:
        read_table(write(text), columns=columns, needed=[F])
    assert says in str(error.value)
    assert not ENGLISH.search(in_language(error.value.message, "de"))


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ({}, "no unit: turns in 10 s (40 to 38 Hz), rad/s (63.7 to 60.5 Hz), rpm or Hz?"),
        ({}, '`columns` = "t=1,f=2 [UNIT]"'),
        (
            {"t": "1", "f": "2 [foo]"},
            "krpm, s and ms of a turn, turns in 10 s, with two marks a turn 1/2s and 1/2min, turns",
        ),
    ],
)
def test_counts_between_readings_are_turns_in_that_time_if_so_told(columns, says, write):
    file = write("time,counts\n0,400\n10,391\n20,380\n")
    with pytest.raises(TableError) as error:
        read_table(file, columns=columns, quantities=("time_s", F), needed=[F])
    assert says in str(error.value)
    table = read_table(file, columns={"t": "1", "f": "2 [turns in 10 s]"}, quantities=("time_s", F), needed=[F])
    assert table.column(F).tolist() == [40.0, 39.1, 38.0]


@pytest.mark.parametrize(
    ("title", "values"),
    [
        ("T_A1 [ms]", (25.0, 20.0, 0.0, 40.0)),
        ("Periodendauer in ms", (25.0, 20.0, 0.0, 40.0)),
        ("Periodendauer T in ms", (25.0, 20.0, 0.0, 40.0)),
        ("Periodo [ms]", (25.0, 20.0, math.nan, 40.0)),
        ("Periode / s", (0.025, 0.02, math.nan, 0.04)),
        ("turns in 10 s", (400, 500, math.nan, 250)),
        ("Umdrehungen pro Minute", (2400, 3000, math.nan, 1500)),
        ("U/min", (2400, 3000, math.nan, 1500)),
        ("n (Umdr./min)", (2400, 3000, math.nan, 1500)),
        ("T [ms],f", (25.0, 20.0, math.nan, 40.0)),
    ],
)
def test_periods_and_turns_in_a_time_are_read_as_frequencies(title, values, write):
    both = title.endswith(",f")  # what is measured goes before what follows from it
    rows = "".join(f"{k},{v}{f',{hz}' if both else ''}\n" for k, (v, hz) in enumerate(zip(values, HZ, strict=True)))
    table = read_table(write(f"t,{title}\n{rows}"), needed=[F])
    assert table.column(F).tolist() == pytest.approx([1.0, 2.0, 4.0] if both else [40.0, 50.0, 25.0])
    assert "1 of 4 rows is left out" in table.warnings[0]
    assert list(table.frame) == [T, F]


HZ = (1.0, 2.0, math.nan, 4.0)


@pytest.mark.parametrize(("title", "unit", "turn"), [("Periode", "ms", 25.0), ("10 Umdrehungen", "s", 0.25)])
def test_the_unit_of_a_period_may_be_said_with_its_column(title, unit, turn, write):
    rows = f"t,{title},u\n0,{turn},{turn / 100}\n1,{turn},{turn / 100}\n2,{turn},{turn / 100}\n"
    table = read_table(write(rows), columns={"f": f"2 [{unit}]"}, needed=[F])
    assert table.column(F)[0] == pytest.approx(40)
    assert table.column(U)[0] == pytest.approx(0.4)


@pytest.mark.parametrize("period", ["T [ms]", "period (ms)"])
@pytest.mark.parametrize("title", ["u [ms]", "u", "u_T [ms]", "T_err [ms]", "u_T", "ΔT [ms]", "u(T) [ms]"])
def test_the_uncertainty_of_a_period_becomes_that_of_the_frequency(title, period, write):
    table = read_table(write(f"t,{period},{title}\n0,25,0.1\n1,20,0.1\n2,40,0.1\n"))
    assert table.column(U).tolist() == pytest.approx([1e-4 * f**2 for f in (40.0, 50.0, 25.0)])


@pytest.mark.parametrize(("header", "column", "u"), [
    ("t,u_t,T [ms]", "time_u_s", 0.1), ("T,u_T,f", "time_u_s", 0.1), ("z [m],u,B [mT]", "flux_density_u_t", 1e-4),
    ("z [m],Fehler [G],B [mT]", "flux_density_u_t", 1e-5), ("z [m],u [mm],B [mT]", "height_u_m", 1e-4),
    ("drive [Hz],u,precession [Hz]", "precession_frequency_u_hz", 0.1),
])  # fmt: skip
def test_an_uncertainty_is_that_of_what_stands_beside_it(header, column, u, write):
    table = read_table(write(f"{header}\n0,0.1,40\n1,0.1,50\n2,0.1,25\n"))
    assert (table.column(column).tolist(), table.warnings) == (pytest.approx([u] * 3), ())


def test_a_missing_column_is_reported_with_those_there_are(write):
    with pytest.raises(TableError, match=r"height_m; it has 't', 'f': say `columns` = z=NAME"):
        read_table(write(GOOD)).column("height_m")


def test_the_columns_option_is_read_and_its_mistakes_are_wrong_usage():
    assert parse_columns("") == {}
    assert parse_columns("time=Zeit t frequency=2") == {"t": "Zeit t", "f": "2"}
    assert parse_columns({"Time": "a", "rpm": 2}) == {"t": "a", "f": "2"}
    assert parse_columns("t=1,spin_frequency_hz=f = 2, s") == {"t": "1", F: "f = 2, s"}
    for text in ("t", "t=", "=1", "t=1,t=2", "t:1,f:2", "f=1,Frequency=2", "t=1,time_s=2"):
        with pytest.raises(ColumnsError, match="NAME=COLUMN"):
            parse_columns(text)
    with pytest.raises(UsageError, match="no quantity known"):
        parse_columns("colour=f")


def test_units_are_those_of_the_quantity_and_case_counts_where_it_must():
    assert unit_factor("mHz", "frequency") == 1e-3
    assert unit_factor("MHZ", "frequency") is None
    assert unit_factor("khz", "frequency") == 1e3
    assert unit_factor("rad s⁻¹", "frequency") == pytest.approx(0.15915494309189535, rel=1e-15)
    assert unit_factor("ms", "frequency") is None
    assert read_title("f(t)").unit == "t"
    assert read_title("u(f) / Hz").column == U


# --- our own run folders -----------------------------------------------------------------------------------------


@BOTH_WAYS
@pytest.mark.parametrize("text", ["", f"{T},{F}\n", f"{T},{F}"])
def test_a_run_without_readings_is_an_empty_table(text, write):
    table = read_run_readings(write(text))
    assert len(table.frame) == 0
    assert len(table.lines) == 0
    assert list(table.frame) == ([T, F] if text.endswith("\n") else [])
    assert len(table.warnings) == (text != "" and not text.endswith("\n"))


def test_a_channel_of_a_run_that_was_not_known_costs_no_row(write):
    """As of an oscilloscope's record without a frequency, which a resumed run would take again."""
    path = write(f"{T},record,tape_frequency_hz\n0,1,\n1,2,30.5\n2,3,\n")
    table = read_run_readings(path, (T, "record", "tape_frequency_hz"))
    assert table.column("record").tolist() == [1, 2, 3]
    assert np.isnan(table.column("tape_frequency_hz")).tolist() == [True, False, True]
    assert table.warnings == ()


@BOTH_WAYS
@pytest.mark.parametrize("last", ["1.5,60.5", "1.5,60.", "1.5", "1", "\0\0\0"])
def test_a_runs_last_line_without_end_is_torn_even_if_it_parses(last, write):
    table = read_run_readings(write(f"{T},{F}\n0,61.5\n0.5,61.25\n1,61\n{last}"))
    assert table.column(F).tolist() == PLAIN[F]
    assert "line 5" in table.warnings[0]


@BOTH_WAYS
def test_a_run_being_written_grows_reading_by_reading(tmp_path):
    path, text = tmp_path / "readings.csv", f"{T},{F}\n0.1,61.5\n0.2,61.25\n"
    seen = []
    for end in range(len(text) + 1):
        path.write_text(text[:end])
        seen.append(len(read_run_readings(path).frame))
    assert sorted(seen) == seen
    assert seen[-1] == 2


@BOTH_WAYS
def test_a_damaged_line_within_a_run_is_an_error(write):
    with pytest.raises(TableError, match="line 3"):
        read_run_readings(write(f"{T},{F}\n0,61.5\n0.\n1,61\n"))
    for header in ("a,b", f"{T},{F}\r"):
        with pytest.raises(TableError, match="is no header of a run"):
            read_run_readings(write(f"{header}\r\n0,61.5\n"))


# --- properties --------------------------------------------------------------------------------------------------

numbers = st.floats(min_value=-1e37, max_value=1e37, allow_subnormal=False)
tables = st.integers(2, 3).flatmap(lambda n: st.lists(st.tuples(*[numbers] * n), min_size=3, max_size=12))


@st.composite
def written_tables(draw):
    rows = draw(tables)
    separator, decimal = draw(st.sampled_from([",.", ";.", ";,", "\t.", "\t,", " .", " ,"]))
    newline = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"]))
    form = draw(st.sampled_from([repr, "{:.17g}".format, "{:+.16e}".format]))
    lines = [separator.join([T, F, U][: len(rows[0])])]
    if draw(st.booleans()):
        lines.append(separator.join(["s", "Hz", "Hz"][: len(rows[0])]))
    lines += [separator.join(form(x).replace(".", decimal) for x in row) for row in rows]
    for _ in range(draw(st.integers(0, 3))):
        lines.insert(draw(st.integers(0, len(lines))), draw(st.sampled_from(["# é, 1; 2\t3", "% 1,2,3", "//", ""])))
    end = draw(st.sampled_from([newline, "", separator + newline if separator != " " else newline]))
    return rows, (newline.join(lines) + end).encode(encoding)


FIVE = [(0.0, 0.0, 0.0)] * 5


@SLOW
@example((FIVE, b"time_s,spin_frequency_hz,spin_frequency_u_hz\ns,Hz,Hz\n" + b"0.0,0.0,0.0\n" * 5 + b",\n"))
@given(written_tables())
def test_any_table_in_any_dialect_reads_back_equal(tmp_path, written):
    rows, data = written
    path = tmp_path / "written.csv"
    path.write_bytes(data)
    frame = read_table(path).frame
    assert list(frame) == [T, F, U][: len(rows[0])]
    np.testing.assert_allclose(frame.to_numpy(), np.array(rows), rtol=1e-15, atol=0)


def reads_or_refuses(path):
    for read in (read_table, read_run_readings):
        try:
            table = read(path)
        except DataError as error:
            assert str(error).isprintable()  # noqa: PT017
        else:
            assert np.isfinite(table.frame.to_numpy()).all()
            assert len(table.lines) == len(table.frame)
            assert all(w.isprintable() for w in table.warnings)


words = [T, F, "Hz", "61.5", "7,5", "nan", "inf", "1e999", "9.91E37", "\n", "\n", "\r\n", "\u2028"]
pieces = st.sampled_from([*words, *'tfus012-éµ٣_(]/#%,,;\t \r"\0\x1a\x0b\x85'])
bodies = st.lists(pieces, max_size=40).map("".join)


@SLOW
@given(st.binary(max_size=300))
@example(codecs.BOM_UTF16_LE + b"t")
@example(codecs.BOM_UTF32_BE + b"t,f\n")
@example(b"\xef\xbb\xbf")
def test_any_bytes_are_read_or_refused(tmp_path, data):
    (tmp_path / "fuzz.csv").write_bytes(data)
    reads_or_refuses(tmp_path / "fuzz.csv")


@SLOW
@given(st.sampled_from(["", "t,f\n", "t;f;u\n", f"{T},{F}\n0,61\n1,61\n2,61\n", "t\tf\n0\t1\n1\t1\n2\t1\n"]), bodies)
def test_any_text_is_read_or_refused(tmp_path, head, body):
    (tmp_path / "fuzz.csv").write_bytes((head + body).encode())
    reads_or_refuses(tmp_path / "fuzz.csv")


@SLOW
@given(st.lists(st.text(alphabet='0123456789.,;eE+-_ "xna\t\r\0#', max_size=12), min_size=1, max_size=6))
@example(["True"])
@example(["false"])
@example(["TRUE", "FALSE"])
@example(["inf", "-Infinity", "1d3"])
def test_reading_at_once_and_line_by_line_agree(tmp_path, lines):
    """Whatever pandas takes for a number, the careful way must take for the same one."""
    path = tmp_path / "both.csv"
    text = "t,f\n" + "".join(f"1,{line}\n" for line in lines)
    path.write_text(text, newline="")
    layout = Layout("utf-8", Dialect(",", "."), ("t", "f"), 1, (), 2, 4, 2)
    columns = (Column(T, 0, "t", 1), Column(F, 1, "f", 1))
    fast = _read_at_once(Text(path), layout, columns, drop_unended=False)
    if fast is not None:
        slow = _read_lines(Text(path), layout, columns, drop_unended=False)
        assert fast.lines.tolist() == slow.lines.tolist()
        for a, b in zip(fast.values, slow.values, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-15)


def test_a_plain_file_is_read_at_once_as_pandas_would(write):
    rng = np.random.default_rng(3)
    frame = pd.DataFrame({T: np.arange(40000) * 0.1, F: 61 + rng.normal(0, 1e-3, 40000), U: rng.uniform(1, 2, 40000)})
    path = write(frame.to_csv(index=False))
    table = read_table(path)
    pd.testing.assert_frame_equal(table.frame, pd.read_csv(path), check_exact=True)
    assert table.lines[[0, -1]].tolist() == [2, 40001]
    assert table.warnings == ()


@BOTH_WAYS
def test_one_field_too_many_does_not_hide_one_that_is_missing(write):
    for text in ("0,61\n1,60,5\n2\n3,59\n", "0,61\n1\n2,60,5\n3,59\n"):
        with pytest.raises(TableError, match=r"line 3: .* 2 are expected"):
            read_table(write("t,f\n" + text))
    with pytest.raises(TableError, match=r"line 3: .* 3 are expected"):  # beside a column that is not used
        read_table(write("t,f,x\n0,61,1\n1,60,1,5\n2,59\n3,58,1\n"))


@BOTH_WAYS
def test_a_comment_with_as_many_separators_as_a_row_stays_a_comment(write):
    table = read_table(write("n,t,f\n1,0,61.5\n#2,.2,7\n3,0.5,61.25\n4,1,61\n"))
    assert table.column(T).tolist() == PLAIN[T]


def test_a_line_far_down_is_named(write):
    rows = "".join(f"{i},61.5\n" for i in range(8000))  # beyond 64 kB
    with pytest.raises(TableError, match="line 8003: '6x' stands in column 'f'"):
        read_table(write(f"t,f\n{rows}# pause\n8001,6x\n8002,61\n"))


@BOTH_WAYS
def test_columns_beside_the_wanted_ones_cost_no_reading(write):
    rows = "".join(f"{t},{60 - t},{'' if t % 5 else 0.07},ok\n" for t in range(20))
    path = write("time_s,spin_frequency_hz,height_m,drive\n" + rows)
    table = read_table(path, quantities=(T, F, U))
    assert list(table.frame) == [T, F]
    assert len(table.frame) == 20
    assert table.warnings == ()


@BOTH_WAYS
def test_uncertainties_with_gaps_are_not_used_rather_than_readings_lost(write):
    rows = "".join(f"{t},{60 - t},{'' if t % 2 else 0.03}\n" for t in range(20))
    table = read_table(write("t,f,u\n" + rows))
    assert list(table.frame) == [T, F]
    assert len(table.frame) == 20
    assert "empty in 10 of 20 rows" in table.warnings[0]


def test_a_unit_can_be_stated_with_the_column(write):
    path = write("Zeit;Drehzahl\n" + "".join(f"{t};{1800 - t}\n" for t in range(5)))
    table = read_table(path, columns={"t": "Zeit", "f": "Drehzahl [rpm]"})
    assert table.frame[F].iloc[0] == pytest.approx(30.0)
    with pytest.raises(TableError, match="no unit of frequency"):
        read_table(path, columns={"t": "Zeit", "f": "Drehzahl [ells]"})


@pytest.mark.parametrize(("text", "says"), [('{"schema": 1}\n', "JSON"), ("<!DOCTYPE html>\n<p>", "HTML")])
def test_what_is_another_kind_of_text_is_named(write, text, says):
    with pytest.raises(TableError, match=says):
        read_table(write(text))


@pytest.mark.parametrize(
    "title",
    [
        "f" + " " * 30_000 + "x",
        " " * 30_000 + "/" + " " * 30_000 + "q",
        "f" + "\u00a0" * 20_000 + "[H",
        "f" + "[(" * 10_000,
    ],
    ids=["blanks", "blanks about a stroke", "no-break blanks", "brackets"],
)
def test_a_title_of_many_blanks_or_brackets_is_read_at_once(tmp_path, title):
    """Forms that look at each pair of places of a title took minutes; the hang guard ends a test that does so again."""
    file = tmp_path / "odd.csv"
    file.write_text(f"time_s,{title}\n" + "".join(f"{k},{30 - k}\n" for k in range(5)), encoding="utf-8")
    with pytest.raises(DataError):
        read_table(file, needed=["spin_frequency_hz"])
    table = read_table(file, columns={"t": "1", "f": "2"})
    assert len(table.frame) == 5


def test_a_text_that_is_cut_is_as_long_as_it_may_be():
    assert [shorten("precession", most) for most in (5, 9, 10)] == ["prec…", "precessi…", "precession"]


@pytest.mark.parametrize(("most", "worked_out"), [(1000, 100), (60, 100 + 41 + 41)])
def test_passes_over_many_files_work_out_each_dialect_once(tmp_path, monkeypatch, most, worked_out):
    """Of more files than are kept, all but the last one kept are found again."""
    monkeypatch.setattr(dialect, "_DIALECTS_OF_ROWS", {})
    monkeypatch.setattr(dialect, "_MOST_DIALECTS", most)
    scored = []
    score = dialect._score
    monkeypatch.setattr(dialect, "_score", lambda lines, rank: (scored.append(rank), score(lines, rank))[1])
    files = [tmp_path / f"{k}.csv" for k in range(100)]
    for k, file in enumerate(files):
        file.write_text(f"t;f\n0;{k},5\n1;24,9\n2;24,8\n", encoding="utf-8")
    for _ in range(3):
        assert {sniff(Text(file)).dialect for file in files} == {Dialect(";", ",")}
    assert len(scored) == worked_out * len(DIALECTS)
    assert len(dialect._DIALECTS_OF_ROWS) == min(most, 100)


@pytest.mark.parametrize("title", ["Magnetfeld z", "magnetische Flussdichte z"])
def test_a_component_alone_is_that_of_a_hall_probe(title, write):
    table = read_table(write(f"z [mm],{title} [mT]\n1,2\n2,3\n3,4\n"), quantities=("height_m", "flux_density_t"))
    assert table.column("flux_density_t").tolist() == pytest.approx([2e-3, 3e-3, 4e-3])


@pytest.mark.parametrize(
    "title", [
        "Magnetic Field {} (µT)", "Magnetfeld {} in µT", "Magnetisches Feld {} (µT)", "Magnetische Flussdichte {} / µT",
        "Champ magnétique {} (µT)", "Campo magnético {} (µT)", "Magnetfält {} (µT)", "B{} [µT]", "b_{}/µT",
        "mag{} (uT)", "Magnetometer {} [µT]", "Magnétomètre {} (µT)",
    ]
)  # fmt: skip
def test_components_of_a_field_and_its_magnitude_are_read(title, write):
    names = [title.format(axis) for axis in "xyz"]
    text = "\n".join(",".join(row) for row in [("Time (s)", *names, "Absolute field (µT)")]) + "\n"
    table = read_table(write(text + "0,1,2,3,3.7\n0.01,1,2,3,3.7\n0.02,1,2,3,3.7\n"))
    found = {name: values[0] for name, values in table.columns.items() if name != "time_s"}
    if title.startswith(("B", "b")):  # alone it is that of a Hall probe on the axis
        found["flux_density_z_t"] = found.pop("flux_density_t")
    fields = {axis: k * 1e-6 for k, axis in enumerate("xyz", 1)} | {"abs": 3.7e-6}
    assert found == pytest.approx({f"flux_density_{axis}_t": value for axis, value in fields.items()})
