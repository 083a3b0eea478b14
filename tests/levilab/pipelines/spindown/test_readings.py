"""What a spin-down's table must fulfil, and the error if it does not."""

import re

import numpy as np
import pytest

import levilab
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import fit_spin_down
from analysis.spindown.tilt import count_of
from levilab.errors import DataError, UsageError
from levilab.formats.columns import TableError
from levilab.formats.table import read_table
from levilab.pipelines.options import SpinDownOptions, read_options
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.spindown.readings import read_spin_file, spin_readings
from levilab.pipelines.spindown.words import TILT_ALLOWED, is_seen
from levilab.texts.note import is_doubt
from support.spin_downs import spin_down_csv

HEADER = "time_s,spin_frequency_hz,spin_frequency_u_hz\n"


def table_of(tmp_path, text):
    path = tmp_path / "data.csv"
    path.write_text(text)
    return read_table(path)


def test_readings_are_arrays_with_the_tables_warnings(tmp_path):
    readings = spin_readings(table_of(tmp_path, HEADER + "0,61,.1\n1,60,.1\n2,nan,.1\n3,59,.2\n"))
    np.testing.assert_array_equal(readings.time, [0, 1, 3])
    np.testing.assert_array_equal(readings.frequency, [61, 60, 59])
    np.testing.assert_array_equal(readings.u, [0.1, 0.1, 0.2])
    assert "line 4" in readings.warnings[0]


@pytest.mark.parametrize(
    ("rows", "line", "words"),
    [
        ("0,61,.1\n1,60,.1\n\n1,59,.1\n", 5, ["the time 1 s is repeated", "in line 3"]),
        ("0,61,.1\n2,60,.1\n# x\n1,59,.1\n", 5, ["the time 1 s comes after 2 s in line 3"]),
        ("0,61,.1\n1,60,.1\n2,59,.1\n" * 2, 5, ["a second run seems to begin here: repeat the titles above it"]),
        ("9,61,.1\n10,60,.1\n11,59,.1\n0,64,.1\n1,63,.1\n2,62,.1\n", 5, ["sort the readings"]),
        ("0,61,.1\n1,0,.1\n2,59,.1\n", 3, ["the frequency is 0 Hz", "delete such rows"]),
        ("0,61,.1\n1,60,.1\n2,-59,.1\n", 4, ["the frequency is -59 Hz", "magnitude"]),
        ("2,59,.1\n1,60,.1\n0,61,.1\n", 3, ["the time 1 s comes after 2 s in line 2", "sort the rows by time"]),
        ("1.8e12,61,.1\n1.8e12,60,.1\n2e12,59,.1\n", 2, ["a time of 1.8e+12 is no measurement", "t=NAME [ms]"]),
        ("0,61,.1\n1,60,0\n2,59,.1\n", 3, ["the uncertainty is 0 Hz"]),
        ("0,61,.1\n1,60,.1\n2,59,-.1\n", 4, ["the uncertainty is -0.1 Hz"]),
    ],
)
def test_what_cannot_be_a_spin_down_is_reported_with_its_line(rows, line, words, tmp_path):
    with pytest.raises(TableError) as caught:
        spin_readings(table_of(tmp_path, HEADER + rows))
    assert caught.value.line == line
    assert f"data.csv, line {line}: " in str(caught.value)
    assert str(caught.value).isprintable()
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_table_titled_seconds_and_upm_is_no_capture_of_a_logic_analyser(tmp_path):
    path = tmp_path / "data.csv"
    path.write_text("seconds,n (UPM)\n" + "".join(f"{10 * k},{2400 - 60 * k}\n" for k in range(9)))
    readings = read_spin_file(path, SpinDownOptions())
    np.testing.assert_allclose(readings.frequency, 40 - np.arange(9), rtol=1e-12)


def test_rows_of_0_hz_after_the_fall_are_left_out_with_a_note(tmp_path):
    readings = spin_readings(table_of(tmp_path, HEADER + "0,61,.1\n1,60,.1\n2,59,.1\n3,0,0\n4,0,0\n"))
    np.testing.assert_array_equal(readings.frequency, [61, 60, 59])
    assert readings.warnings == ("data.csv: the last 2 rows of 0 Hz, after the top fell, are left out",)


@pytest.mark.parametrize(("start", "kept"), [((25, 31, 35, 37.4), 6), ((37.9, 37.95), 8), ((38.2, 30), 8)])
def test_rows_in_which_the_top_speeds_up_are_left_out_with_a_note(start, kept, tmp_path):
    frequency = [*start, 38, 37, 36.1, 35.2, 34.4, 33.6]
    rows = "".join(f"{10 * k},{f}\n" for k, f in enumerate(frequency))
    readings = spin_readings(table_of(tmp_path, f"t [s],f [Hz]\n{rows}"))
    assert readings.frequency.tolist() == frequency[-kept:]
    assert any("coasts from 40.0 s to 90.0 s" in one for one in readings.warnings) == (kept == 6)


def test_readings_closer_than_a_turn_are_doubted(tmp_path):
    rows = "0,40\n10,39\n20,38.1\n30,37.2\n"
    said = {u: spin_readings(table_of(tmp_path, f"T [{u}],f [Hz]\n{rows}")).warnings for u in ("ms", "s", "h")}
    assert ": the readings lie 10 ms apart, the top needs 25.9 ms for a turn;" in said["ms"][0]
    assert said["s"] == ()
    assert (
        ' from 40 to 37.2 Hz in 30 h, in air it takes minutes; say the unit: `columns` = "t=1 [s]" (30 s)'
        in said["h"][0]
    )


def test_days_of_a_spreadsheet_are_a_unit_and_thousands_of_ms_are_named(tmp_path):
    days = read_table(table_of(tmp_path, "t [d],f [Hz]\n0,40\n0.000116,39\n0.000232,38.1\n").path)
    assert days.column("time_s").round(1).tolist() == [0, 10, 20]
    thousands = spin_readings(table_of(tmp_path, "t [ms];f [Hz]\n0.000;40\n6.000;39.4\n12.000;38.8\n"))
    assert thousands.warnings[0].endswith("if their point stands behind the thousands, write them without it")


@pytest.mark.parametrize("title", ["", "t,f,u\n"])
def test_decimals_behind_a_comma_are_no_uncertainties(title, tmp_path):
    with pytest.raises(TableError, match="40 and 1 are taken for a spin and its uncertainty; if they are one number"):
        spin_readings(table_of(tmp_path, f"{title}0,40,01\n10,38,58\n20,37,20\n30,35,00\n"))
    warnings = [
        spin_readings(table_of(tmp_path, f"{title}0,40,{first}\n10,38,5\n20,37,4\n30,35,4\n")).warnings
        for first in (1, 3)
    ]
    assert ["40 and 1 are taken for a spin" in " ".join(one) for one in warnings] == [True, False]


def test_points_behind_thousands_are_named_where_they_pass_for_decimals(tmp_path):
    rows = "t [s];n [U/min]\n0;2.280\n10;2.206\n20;2.133\n30;2.061\n"
    (warning,) = spin_readings(table_of(tmp_path, rows)).warnings
    assert warning.endswith("if its point stands behind the thousands, write the numbers without it")


@pytest.mark.parametrize(
    ("first", "last", "asks"),
    [(76, 44, True), (76, 49.8, True), (76, 60, False), (50, 44, False), (76, 42, True), (66, 41, False)],
)
def test_a_count_that_ends_at_twice_the_lower_limit_is_doubted(first, last, asks, tmp_path):
    readings = spin_readings(table_of(tmp_path, f"t,f\n0,{first}\n90,{(first + last) / 2}\n180,{last}\n"))
    assert (readings.doubtful, '"f=2 [1/2s]"' in " ".join(readings.warnings)) == (asks, asks)
    halved = read_table(tmp_path / "data.csv", columns={"f": "f [1/2s]"})
    assert halved.column("spin_frequency_hz")[-1] == last / 2


@pytest.mark.parametrize(("first", "last", "marks"), [(114, 66, 3), (114, 80, 2), (95, 70, 3)])
def test_the_marks_on_a_rim_are_those_with_which_the_count_ends_at_the_lower_limit(first, last, marks, tmp_path):
    (doubt,) = spin_readings(table_of(tmp_path, f"t,f\n0,{first}\n90,{(first + last) / 2}\n180,{last}\n")).warnings
    assert f'"f=2 [1/{marks}s]" divides the numbers by {marks}' in doubt


def test_the_beginning_of_a_fall_from_the_fastest_drive_is_no_count_of_three_marks(tmp_path):
    assert spin_readings(table_of(tmp_path, "t,f\n0,65.5\n5,64\n10,62.6\n")).warnings == ()


def test_a_part_by_time_of_a_top_that_was_spun_again_must_fall_and_no_more(tmp_path):
    spins = [38, 36, 34, 32, 30, 44, 42, 40, 38, 36]
    path = tmp_path / "data.csv"
    path.write_text("t [s],f [Hz]\n" + "".join(f"{10 * k},{spin}\n" for k, spin in enumerate(spins)), "utf-8")
    with pytest.raises(TableError, match="`start` and `stop` choose a part"):
        read_spin_file(path, SpinDownOptions())
    assert read_spin_file(path, SpinDownOptions(start_s=45)).frequency.tolist() == spins[5:]
    assert read_spin_file(path, SpinDownOptions(stop_s=45)).frequency.tolist() == spins[:5]
    with pytest.raises(DataError, match="0 of 10 readings from 300 s on are too few"):
        read_spin_file(path, SpinDownOptions(start_s=300))


@pytest.mark.parametrize(
    ("unit", "factor"), [("Hz", 1), ("rpm", 60), ("1/min", 60), ("rad/s", 2 * np.pi), ("kHz", 1e-3)]
)
def test_half_of_a_unit_is_named_as_the_column_has_it(unit, factor, tmp_path):
    rows = f"t [s],f [{unit}]\n0,{76 * factor}\n90,{60 * factor}\n180,{44 * factor}\n"
    (doubt,) = spin_readings(table_of(tmp_path, rows)).warnings
    said = re.search(r'`columns` = "f=2 (\[1/.+\])" divides the numbers by 2', doubt)
    assert said
    halved = read_table(tmp_path / "data.csv", columns={"f": f"f {said[1]}"})
    assert halved.column("spin_frequency_hz").round(3).tolist() == [38, 30, 22]


@pytest.mark.parametrize(
    ("step", "unit", "asks"), [(0.30, "min", True), (0.10, "min", True), (0.25, "min", False), (0.30, "s", False)]
)
def test_decimals_of_minutes_that_may_be_seconds_are_a_doubt(step, unit, asks, tmp_path):
    hundredths = [100 * (k * round(100 * step) // 60) + k * round(100 * step) % 60 for k in range(20)]
    times = hundredths if asks else [100 * k * step for k in range(20)]
    rows = "".join(f"{t / 100:.2f};{38 - 0.5 * k}\n" for k, t in enumerate(times))
    doubts = spin_readings(table_of(tmp_path, f"t [{unit}];f [Hz]\n{rows}")).warnings
    assert any("decimals above .59" in one for one in doubts) == asks


def test_steps_from_reading_to_reading_are_no_uncertainties(tmp_path):
    spins = [38.0, 36.7, 35.5, 34.2, 33.1]
    steps = np.abs(np.diff(spins, prepend=spins[0] + 1.2)).round(2)
    rows = "".join(f"{10 * k},{spin},{step}\n" for k, (spin, step) in enumerate(zip(spins, steps, strict=True)))
    readings = spin_readings(table_of(tmp_path, HEADER + rows))
    assert readings.doubtful
    assert "steps from reading to reading" in readings.warnings[0]


@pytest.mark.parametrize(("title", "doubtful"), [("t", True), ("Uhrzeit", False), ("t [mm:ss]", False)])
def test_times_that_may_be_of_a_clock_keep_a_run_out_of_means(title, doubtful, tmp_path):
    readings = spin_readings(table_of(tmp_path, f"{title},f\n14:05,38\n14:06,35.5\n14:07,33.2\n"))
    assert (readings.doubtful, any(map(is_doubt, readings.warnings))) == (doubtful, doubtful)


def test_times_since_1970_count_from_the_first_reading(tmp_path):
    rows = "".join(f"{1764000000 + k:.1f},{38 - k / 10}\n" for k in range(0, 60, 20))
    assert spin_readings(table_of(tmp_path, f"t,f\n{rows}")).time.tolist() == [0, 20, 40]


def test_spins_with_which_no_top_floats_are_doubted(tmp_path):
    readings = spin_readings(table_of(tmp_path, "t,f\n0,19\n90,13.5\n180,10.5\n"))  # each second turn was counted
    assert readings.doubtful
    assert "the spin is about 13.5 Hz, a Levitron spins at 20 to 60 Hz" in readings.warnings[0]


@pytest.mark.parametrize(("slowest", "doubted"), [(10.7, True), (21.4, False)])
def test_a_spin_below_which_no_levitron_floats_asks_whether_turns_were_left_out(slowest, doubted, tmp_path):
    falls = np.linspace(25, slowest, 20) if doubted else np.append(np.linspace(50, slowest, 20), [9.0, 4.0, 3.0])
    rows = "".join(f"{10 * k},{spin:.3f},.01\n" for k, spin in enumerate(falls))
    said = [text for text in spin_readings(table_of(tmp_path, HEADER + rows)).warnings if "below 15 Hz" in text]
    assert bool(said) is doubted  # of a fall some readings are lower
    assert all("f=NAME [1/0.5s]" in text for text in said)


def test_readings_between_two_spins_are_fitted_and_the_result_says_so(tmp_path):
    path = spin_down_csv(tmp_path / "a.csv")
    whole = SPINDOWN.analyze([path], SpinDownOptions(tilt="none"))
    part = SPINDOWN.analyze([path], SpinDownOptions(tilt="none", **read_options({"between": "30:24"})))
    (run,), (all_of_it,) = part.runs, whole.runs
    inside = (all_of_it.frequency >= 24) & (all_of_it.frequency <= 30)
    np.testing.assert_array_equal(run.frequency, all_of_it.frequency[inside])
    assert run.time[0] > all_of_it.time[0]
    count = f"only the {inside.sum()} of {inside.size} readings between 24 Hz and 30 Hz are fitted"
    assert any(count in text for text in part.all_warnings)
    with pytest.raises(DataError, match="choose `between` in it"):
        SPINDOWN.analyze([path], SpinDownOptions(between=(2.0, 3.0)))
    for wrong in ("30", "a:b", "30:30", (24.0, 30.0, 31.0)):
        with pytest.raises(UsageError):
            read_options({"between": wrong})


def test_readings_between_two_times_are_fitted_as_of_a_top_that_was_spun_again(tmp_path):
    path = spin_down_csv(tmp_path / "a.csv")
    (whole,) = SPINDOWN.analyze([path], SpinDownOptions(tilt="none")).runs
    start, stop = whole.time[3], whole.time[-2]
    part = SPINDOWN.analyze([path], SpinDownOptions(tilt="none", **read_options({"start_s": start, "stop_s": stop})))
    np.testing.assert_array_equal(part.runs[0].time, whole.time[3:-1])
    (note,) = (text for text in part.all_warnings if f"between {start:g} s and {stop:g} s are fitted" in text)
    assert note.weight == "warning"  # a class names it
    with pytest.raises(DataError, match="choose `start`, `stop` in it"):
        SPINDOWN.analyze([path], SpinDownOptions(start_s=1e4))


def test_a_part_that_is_all_of_a_run_leaves_nothing_out_and_one_beyond_it_says_so(tmp_path):
    path = spin_down_csv(tmp_path / "a.csv")
    assert "as asked" not in " ".join(read_spin_file(path, SpinDownOptions(start_s=0.0)).warnings)
    with pytest.raises(DataError, match=r"0 of 20 readings from 200 s on are too few, .* from 0 s to 190 s"):
        read_spin_file(path, SpinDownOptions(start_s=200.0))


def test_times_of_a_clock_count_from_the_first_reading(tmp_path):
    rows = "".join(f"14:{58 + k // 6}:{k % 6}0,{38 - k / 10}\n" for k in range(9))
    (path := tmp_path / "clock.csv").write_text(f"Uhrzeit,f [Hz]\n{rows}", "utf-8")
    assert read_spin_file(path, SpinDownOptions(start_s=20.0)).time.tolist() == [20, 30, 40, 50, 60, 70, 80]


def test_a_record_of_a_top_that_was_spun_again_has_two_falls_to_choose_from(tmp_path):
    t = np.linspace(0, 32, 32_001)
    turns = 38 * t - 0.15 * t**2
    times = np.interp(np.arange(1, int(turns[-1])), turns, t)
    path = tmp_path / "pulses.csv"
    path.write_text("pulse time [s]\n" + "".join(f"{x:.7f}\n" for x in [*times, *(times + 40)]), "utf-8")
    begins = {}
    for start in (None, 5.0, 45.0):
        readings = read_spin_file(path, SpinDownOptions(start_s=start))
        begins[start] = readings.time[0]
        assert ("too: `start` and `stop` choose" in " ".join(readings.warnings)) == (start != 45)
    assert begins[None] < 5 < begins[5.0] < 8
    assert 45 < begins[45.0] < 48


def test_a_part_with_too_little_of_a_fall_has_no_readings_under_the_drive(tmp_path):
    t = np.linspace(0, 60, 60_001)
    turns = 38 * t - 0.15 * np.maximum(t - 20, 0) ** 2
    times = np.interp(np.arange(1, int(turns[-1])), turns, t)
    (path := tmp_path / "p.csv").write_text("pulse time [s]\n" + "".join(f"{x:.7f}\n" for x in times), "utf-8")
    with pytest.raises(DataError, match=r"2 of 21 readings between 10 s and 22 s are too few, .* go from 19"):
        read_spin_file(path, SpinDownOptions(start_s=10.0, stop_s=22.0))


def test_the_laws_that_are_asked_for_are_fitted_and_the_others_have_no_numbers(tmp_path):
    path = spin_down_csv(tmp_path / "a.csv")
    found = SPINDOWN.analyze(
        [path], SpinDownOptions(tilt="none", correlation="none", **read_options({"laws": "disc,stokes"}))
    )
    assert [fit.name for fit in found.combined.fits] == ["stokes", "disc"]
    assert (
        "drag laws other than Stokes and disc are left out, as asked: another one may fit better" in found.all_warnings
    )
    assert any("taken to be white" in note for note in found.all_warnings)
    assert found.runs[0].correlation is None
    part = SPINDOWN.document(found, tmp_path)["runs"][0]
    values = {column.name: column.read(part) for column in SPINDOWN.row}
    assert values["disc_c32_per_sqrt_rad_s"] == pytest.approx(2.34e-4, rel=0.01)  # 0.15 % by 0.03 Hz
    assert values["newton_c2_per_rad"] is None
    with pytest.raises(UsageError):
        read_options({"laws": "disk"})


def test_a_result_says_that_a_tilt_was_allowed_for_and_what_leaves_it_out(tmp_path):
    path = spin_down_csv(tmp_path / "a.csv")
    said = {
        tilt: TILT_ALLOWED in SPINDOWN.analyze([path], SpinDownOptions(tilt=tilt)).all_warnings
        for tilt in ("auto", "none")
    }
    assert said == {"auto": True, "none": False}
    assert len(TILT_ALLOWED.split()) <= 25


def test_a_wobble_is_seen_where_there_is_one_and_not_in_noise():
    """Noise brings the tilt of an upright top beyond three of its u in two of five such runs, since it is a root."""
    time, rng = np.arange(30) * 10.0, np.random.default_rng(77)
    seen = {}
    for tilt2, drag, runs in ((0.0, 0.39, 8), (0.03**2, 0.5, 2)):
        counts = 40 * count_of(LAWS["stokes"], time / time[-1], np.array([1.0, drag, tilt2, 0.55, 0.0]))
        fits = [
            fit_spin_down(time, counts + rng.normal(0, 1e-4, 30), 1e-4, laws=["stokes"]).fits[0] for _ in range(runs)
        ]
        seen[tilt2] = [is_seen(fit.parameters["moment_tilt"]) for fit in fits]
    assert not any(seen[0.0])
    assert all(seen[0.03**2])


def test_u_from_turns_since_the_start_is_too_large_by_what_its_note_says(tmp_path):
    """Of 24 such runs the scatter was 0.26 u; that of 8 is known to 25 %."""
    noise, t, c1 = np.random.default_rng(1), np.arange(31) * 10.0, 1.25e-3
    found = []
    for start in noise.random(8):
        turns = np.floor(38.0 / c1 * -np.expm1(-c1 * t) + start)
        np.savetxt(tmp_path / "n.csv", np.c_[t, turns], delimiter=",", header="t [s],n [turns]", comments="")
        found.append(levilab.analyze(tmp_path / "n.csv", laws="stokes", tilt="none").models["stokes"].params["c1"])
    scatter, u = np.std([one.value for one in found], ddof=1), np.mean([one.u for one in found])
    assert 2 < u / scatter < 8
    assert np.mean([one.value for one in found]) == pytest.approx(c1, abs=u)


@pytest.mark.parametrize(
    ("stands", "places", "asks"),
    [((6, 7, 8), 2, True), ((0, 1, 2), 2, True), ((6, 7), 2, False), ((6, 7, 8), 0, False)],
)
def test_three_equal_readings_in_a_row_are_a_doubt_where_the_spin_falls_by_much_more(stands, places, asks, tmp_path):
    time = np.arange(0.0, 171.0, 10.0)
    frequency = 38 / (1 + 0.00178 * time) ** 2 + np.random.default_rng(1).normal(0, 0.03, time.size)
    frequency[list(stands)] = frequency[stands[0]]
    rows = "".join(f"{t},{f:.{places}f}\n" for t, f in zip(time, frequency, strict=True))
    readings = spin_readings(table_of(tmp_path, f"t [s],f [Hz]\n{rows}"))
    assert ["readings from" in one for one in readings.warnings if is_doubt(one)] == [True] * asks
    assert not readings.doubtful  # the unit is known


@pytest.mark.parametrize(("first", "last", "warns"), [(56, 44.4, True), (56, 52, False), (49, 44.4, False)])
def test_a_count_that_ends_at_twice_the_lower_limit_may_be_of_two_marks(first, last, warns, tmp_path):
    readings = spin_readings(table_of(tmp_path, f"t [s],f [Hz]\n0,{first}\n40,{(first + last) / 2}\n80,{last}\n"))
    said = ["if there are 2 marks a turn, it goes from 28 to 22.2 Hz; `columns` = " in one for one in readings.warnings]
    assert (said, readings.doubtful) == ([True] * warns, False)


@pytest.mark.parametrize(
    ("frequency", "says"),
    [
        ([30, 30, 30, 30, 30, 30], "Is the drive still on?"),
        ([30, 31, 32, 33, 34, 35], "were the rows sorted by the spin, or is the drive still on?"),
        ([30, 29, 28, 38, 37, 36], "It rises by 10 Hz from 2 s to 3 s, in lines 4 and 5: was the top spun again?"),
    ],
)
def test_a_spin_that_does_not_fall_has_the_cause_that_fits_it(frequency, says, tmp_path):
    rows = "".join(f"{t},{f}\n" for t, f in enumerate(frequency))
    with pytest.raises(TableError, match=re.escape(says)):
        spin_readings(table_of(tmp_path, f"t [s],f [Hz]\n{rows}"))
