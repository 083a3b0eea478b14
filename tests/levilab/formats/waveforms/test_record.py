"""Samples out of files: every vendor's header, their traps, what is refused and how, and memory that does not grow."""

import codecs
import json
import re
import struct
import sys
import types
import uuid
import wave
import zipfile

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from levilab.errors import DataError, DoesNotSuit, UsageError
from levilab.formats.columns import TableError
from levilab.formats.waveforms.header import NoWaveform
from levilab.formats.waveforms.record import read_record
from levilab.formats.waveforms.waveform import PulseTimes, Waveform
from levilab.texts.text import in_language

FEW = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
#: Of the sample files, which sample_data/make.py writes from one signal.
STEP, COUNT, START = 2.5e-4, 2000, -0.25


def waveform(path, **given):
    record = read_record(path, **given)
    assert isinstance(record, Waveform)
    return record


#: Sample file → what is said of its origin, start, and the name and unit of its first channel.
SCOPE_FILES = {
    "rigol-ds1000z.csv": ("Rigol CSV", START, "CH1", "V"),
    "rigol-ds1000z-screen.csv": ("Rigol CSV of the screen", START, "CH1", "V"),
    "keysight-dsox.csv": ("Keysight CSV", START, "CH1", "V"),
    "siglent-sds1202x-e.csv": ("Siglent CSV", START, "CH1", "V"),
    "siglent-sds1104x-e.csv": ("Siglent CSV", START, "CH1", "V"),
    "tektronix-tds2000c.csv": ("Tektronix TDS CSV", START, "CH1", "V"),
    "tektronix-mdo3000.csv": ("Tektronix CSV", START, "CH1", "V"),
    "two-columns-german.csv": ("CSV", START, "Spannung", "V"),
    "picoscope.csv": ("CSV", START, "Channel A", "V"),
    "waveforms-analog-discovery.csv": ("CSV", START, "Channel 1", "V"),
    "owon-hds242.csv": ("OWON CSV", 0.0, "CH1", "V"),
    "hantek-dso5102p.csv": ("Hantek CSV", 0.0, "CH1", "V"),
    "rigol-mso5000.csv": ("Rigol CSV", START, "CH1", "V"),
    "pulseview.csv": ("sigrok CSV", 0.0, "A0", "V"),
    "dsview-dscope.csv": ("sigrok CSV", 0.0, "CH0", "V"),
    "samples-4000hz.npy": ("NumPy array", 0.0, "CH1", "V"),
    "recording.wav": ("WAV", 0.0, "mono", "full scale"),
}


@pytest.mark.parametrize("name", SCOPE_FILES)
def test_a_record_reads_the_same_from_every_makers_scope(name, sample_data):
    written = np.load(sample_data / "scope-files" / "samples-4000hz.npy").astype(np.float64)
    record = waveform(sample_data / "scope-files" / name, rate=4000.0 if name.endswith(".npy") else None)
    origin, start, channel, unit = SCOPE_FILES[name]
    assert (record.format, record.count, record.warnings) == (origin, COUNT, ())
    assert (record.signals[0].name, record.signals[0].unit) == (channel, unit)
    assert record.step == pytest.approx(STEP, rel=1e-12)
    assert record.start == pytest.approx(start, abs=1e-12)
    scale = 2.0 if unit == "full scale" else 1.0
    step = 2 / 32768 if unit == "full scale" else 1e-6  # of a 16-bit WAV, and of single precision
    np.testing.assert_allclose(scale * record.samples(), written, atol=step, rtol=0)


def test_samples_beyond_the_range_are_clipped_at_the_ends_of_the_others(sample_data, tmp_path):
    """PicoScope writes ∞ and -∞ for them, here also in the first rows, and in all rows of another channel."""
    path, written = tmp_path / "pico.csv", sample_data / "scope-files" / "picoscope.csv"
    lines = [line.split(",") for line in written.read_text("utf-8").splitlines()]
    values = np.array([float(row[1]) for row in lines[3:]])
    values[:2] = 1.0, 0.0
    cells = [f"{v}" if 0.055 < v < 0.795 else "∞" if v > 0.5 else "-∞" for v in values]
    rows = [f"{t},{cell},∞\r\n" for (t, _), cell in zip(lines[3:], cells, strict=True)]
    path.write_text("Time,Channel A,Channel B\r\n(ms),(V),(V)\r\n\r\n" + "".join(rows), "utf-8", newline="")
    record = waveform(path)
    np.testing.assert_allclose(record.samples(), values.clip(0.06, 0.79), atol=1e-12)
    assert not record.samples("Channel B").any()
    (note,) = record.warnings
    beyond = sum("∞" in cell for cell in cells) + COUNT
    assert f"pico.csv: {beyond} samples lie beyond the range of the input (∞): they are taken at the ends" in note
    path.write_text(path.read_text("utf-8").replace("-249.75000000,", "∞,"), "utf-8")
    with pytest.raises(TableError, match="line 5: a time is ∞"):
        read_record(path)


def test_times_that_fall_are_refused_with_the_rate_that_they_have(sample_data):
    path = sample_data / "scope-files" / "red-pitaya.csv"
    with pytest.raises(
        TableError, match=r"from 0.25 s to -0.249512 s: sort the rows, or say `rate` = 2048, if the rows"
    ):
        read_record(path)
    record = waveform(path, rate=2048.0)
    assert (record.count, record.signals[0].name, record.samples()[:3].tolist()) == (1024, "IN1", [0.13, 0.11, 0.08])


def test_times_that_lost_digits_give_the_step_by_a_line_and_say_so(sample_data):
    record = waveform(sample_data / "scope-files" / "rigol-ds1000e.csv")
    assert record.step == pytest.approx(STEP, rel=9e-5)  # what the warning says
    assert "is known to 9×10⁻⁵ of it" in record.warnings[0]
    ends = (0.25 - -0.25) / (COUNT - 1)
    assert abs(record.step - STEP) < abs(ends - STEP) / 5  # first and last time alone are far off


def test_samples_in_an_archive_and_in_cells_are_those_of_the_csv(sample_data, tmp_path, write):
    path = sample_data / "scope-files" / "picoscope.csv"
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.write(path, "b.csv")
    t, volts = np.loadtxt(path, delimiter=",", skiprows=3).T
    for one in (tmp_path / "a.zip", write(json.dumps({"t [ms]": t.tolist(), "U [V]": volts.tolist()}), "a.json")):
        record = waveform(one)
        assert (record.start, record.step) == (START, pytest.approx(STEP, rel=1e-12))  # of the times in ms
        np.testing.assert_array_equal(record.samples(record.signals[0].name), volts)


def rows(n=20, first=0):
    return "".join(f"{k},{k % 5}.5,\n" for k in range(first, first + n))


@pytest.mark.parametrize(
    ("text", "start", "step", "channels"),
    [
        ("X,CH1,Start,Increment,\nSequence,Volt,-1.4e-03,2e-06,\n" + rows(first=22), -1.356e-3, 2e-6, "CH1 V"),
        ("X,CH1,CH2,START,INCREMENT\nSequence,mV,Volt,0,1e-3\n" + rows(), 0.0, 1e-3, "CH1 V"),  # CH2 was off
        ("CH1,CH2,Start,Increment,\nVolt,Volt,-6e-02,1e-04\n" + "0.5,1.5,\n" * 20, -0.06, 1e-4, "CH1 V, CH2 V"),
        ("Source,CH3\nSecond,Volt\n" + "".join(f"{k / 1000:.11f},1\n" for k in range(20)), 0.0, 1e-3, "CH3 V"),
        ('"Record Length",20,"Points",0.0,1\n"Sample Interval",1.1e-3,s,0.001,2\n'
         + "".join(f",,,{k / 1000},1\n" for k in range(2, 20)), 0.0, 1.1e-3, "CH1 V"),
        ("#Model,MDO3014\n#Sample Interval,4e-09\n#Record Length,20\n#TIME,D1,D0\n"
         + "".join(f"{k * 4e-9:.7e},1,0\n" for k in range(20)), 0.0, 4e-9, "D1 V, D0 V"),
        ("x-axis,1,2\nsecond,Volt,Ampere\n" + "".join(f"{k}.0E-03,1,2\n" for k in range(20)),
         0.0, 1e-3, "CH1 V, CH2 A"),
        ("t,CH1\n" + "".join(f"{k / 1000},1\n" for k in range(20)), 0.0, 1e-3, "CH1 V"),
        ("t CH1\n\n" + "".join(f"{k / 1000} 1\n" for k in range(20)), 0.0, 1e-3, "CH1 V"),
        ("X(CH1),CH1\nSecond,Volt\n" + "".join(f"{k / 1000},1\n" for k in range(20)), 0.0, 1e-3, "CH1 V"),
        ("X(CH1),Y(CH1),X(CH2),Y(CH2)\nSecond,Volt,Second,Ampere\n"
         + "".join(f"{k / 1000},1,{k / 1000},2\n" for k in range(20)), 0.0, 1e-3, "CH1 V, CH2 A"),
        ("Time(CH1),Volt(CH1)\n" + "".join(f"{k / 1000},1\n" for k in range(20)), 0.0, 1e-3, "CH1 V"),
        ("x-axis,1,1,1\nsecond,Volt,Volt,Volt\n" + "".join(f"{k}.0E-03,1,2,3\n" for k in range(20)),
         0.0, 1e-3, "CH1 V, CH1 (2) V, CH1 (3) V"),
        ("x-axis,1,2\nsecond,Volt,Volt\n-1.0E-03,,5\n" + "".join(f"{k}.0E-03,1,2\n" for k in range(20)) + ",,\n",
         0.0, 1e-3, "CH1 V, CH2 V"),
        ("Source,CH1,CH2\nSample Interval,1e-3\nSecond,Volt,Ampere\n" + "".join(f"{k / 1000},1,2\n" for k in range(20)),
         0.0, 1e-3, "CH1 V, CH2 A"),
        ("Channel\t\t :,CH1\nFrequency :,F=1.498kHz\nTime interval\t :,100.00uS\n\nindex,CH1_Voltage(mV)\n"
         + "".join(f"{k},{k % 5}.00\n" for k in range(20)), 0.0, 1e-4, "CH1 V"),
        ("#CHANNEL:CH2\n#CLOCK=50.0uS\n#SIZE=20\n#UNITS:mV\n" + "1.5,\n2.5,\n" * 10, 0.0, 5e-5, "CH2 V"),
        ("Channel\t:\tCH1\tCH2\nTime interval\t:\t0.20uS\t0.20uS\n\nindex\tCH1_Voltage(mV)\tCH2_Voltage(mV)\n"
         + "".join(f"{k}\t{k % 5}.00\t3.00\n" for k in range(20)), 0.0, 2e-7, "CH1 V, CH2 V"),
        ("Source,CH2\nSampling Period,1e-4\nTime,23-Nov-26 14:05\nData,\n" + "5,\n7,\n" * 10, 0.0, 1e-4, "CH2 V"),
        ("XInc:,1.0E-04\nYUnits:,mV\nData:\n" + "5.5\n" * 20, 0.0, 1e-4, "CH1 V"),
        ("Increment:,1e-4\n" + "0.5\n" * 20, 0.0, 1e-4, "CH1 V"),
        ("#timebase=4000(ps)\n,#voltbase=10(uV)\n" + "".join(f"{k}e-3,1.5\n" for k in range(20)), 0.0, 1e-3, "CH1 V"),
        ("in s,C1 in V\n" + "".join(f"{k}E-03,1\n" for k in range(20)), 0.0, 1e-3, "C1 V"),
        ("CH1V,CH4V,t0 =-1.0ms, tInc = 1e-6\n" + "0.5,1.5\n" * 20, -1e-3, 1e-6, "CH1 V, CH4 V"),
        ("Time(s),CH1V,CH2V\n" + "".join(f"{k / 1000},1,2\n" for k in range(20)), 0.0, 1e-3, "CH1 V, CH2 V"),
        ("Zeit;Kanal A;Kanal B\n(ms);(V);(mV)\n\n" + "".join(f"{k},5;1,5;2,5\n" for k in range(20)),
         5e-4, 1e-3, "Kanal A V, Kanal B V"),
        ("Time(ms),IN1(V),IN2(V)\n" + "".join(f"{k},1,2\n" for k in range(20)), 0.0, 1e-3, "IN1 V, IN2 V"),
        ("nr,time,ch1,ch2\n" + "".join(f"{k},{k / 1000},1,2\n" for k in range(20)), 0.0, 1e-3, "ch1 V, ch2 V"),
        ("; CSV, generated by libsigrok 0.4.0 on Wed\n; Channels (2/8): P8_45, P8_46\n; Samplerate: 10 MHz\n"
         + "0,1\n1,0\n" * 10, 0.0, 1e-7, "P8_45 logic, P8_46 logic"),
        ("; CSV generated by libsigrok 0.5.2\n; Channels (2/2): D0, A0\n; Samplerate: 1 kHz\nlogic,V DC\n"
         + "0,1.5\n" * 20, 0.0, 1e-3, "D0 logic, A0 V"),
        ("; generated by sigrok\n; Channels (1/8): D2\n; Samplerate: 4 kHz\n" + "0\n" * 20, 0.0, 2.5e-4, "D2 logic"),
        ("microseconds,logic,logic\n" + "".join(f"{100 * k},{k % 2},0\n" for k in range(20)),
         0.0, 1e-4, "CH1 logic, CH2 logic"),
        ("".join(f"{k / 1000},1\n" for k in range(20)), 0.0, 1e-3, "CH1 V"),
        ("t/us\tu/mV\n" + "".join(f"{k}\t1\n" for k in range(20)), 0.0, 1e-6, "u V"),
    ],
)  # fmt: skip
def test_headers_with_their_variants(tmp_path, text, start, step, channels):
    path = tmp_path / "data.csv"
    path.write_text(text, encoding="utf-8")
    record = waveform(path)
    assert (record.start, record.step) == (pytest.approx(start, abs=1e-15), pytest.approx(step, rel=1e-9))
    assert ", ".join(f"{signal.name} {signal.unit}" for signal in record.signals) == channels
    assert record.count == 20


@pytest.mark.parametrize(
    "head",
    [
        "Time [s],Channel 0,Channel 1\n",
        "; CSV, generated by libsigrok4DSL 0.2.0\n; Channels (2/16)\n; Sample rate: 1 MHz\nTime(s), Channel 0, D1\n",
    ],
    ids=["Saleae", "DSView"],
)
def test_a_table_of_changes_gives_the_rising_edges(head, write):
    edges = [0.0123 + k / 30 for k in range(8)]
    rows = [f"{t + late:.9f},{level},0\n" for t in edges for late, level in ((0, 1), (0.001, 0))]
    record = read_record(write(head + "0.0,0,0\n" + "".join(rows)))
    assert record.times == pytest.approx(edges, abs=1e-9)
    assert record.warnings == ("data.csv: each row is a change: the rising edges of Channel 0 are the pulses",)


def test_times_in_single_precision_are_even_enough(write):
    """As a DS1102E prints them: -5.9999997e-04, -5.9800001e-04."""
    times = (np.arange(300) * 2e-6 - 6e-4).astype(np.float32)
    text = "X,CH1,\nSecond,Volt,\n" + "".join(f"{t:.7e},1.0,\n" for t in times.tolist())
    record = waveform(write(text))
    assert record.step == pytest.approx(2e-6, rel=1e-6)
    assert record.warnings == ()


SIGLENT = "Record Length,Analog:{n}\nSample Interval,Analog:{step}\nHorizontal Units,{unit}\nSource,CH1\nSecond,Volt\n"


def siglent(step, printed, *, unit="s", digits=11, count=20):
    above = SIGLENT.format(n=count, step=step, unit=unit)
    return above + "".join(f"{k * printed:.{digits}f},{k % 5}\n" for k in range(20))


def test_the_step_comes_from_the_header_where_times_lost_digits(write):
    record = waveform(write(siglent("0.000012340000", 1.234e-5, digits=4)))
    assert record.step == 1.234e-5
    assert record.warnings == ()


def test_uneven_times_are_taken_as_they_are_printed(write):
    text = "ms;V\n" + "".join(f"{k + k % 3 / 10};{k % 5}\n" for k in range(30) if k != 12)
    record = waveform(write(text), columns={"t": "ms"})
    assert record.warnings == (
        "data.csv: its times are 0.0008 to 0.0019 s apart (line 14), mostly 0.0011 s: they are used as printed",
    )
    assert record.times == pytest.approx([(k + k % 3 / 10) / 1000 for k in range(30) if k != 12])
    assert (record.step, record.duration) == (pytest.approx(0.0011), pytest.approx(0.0292))
    assert record.numbers_at(0.0105, 0.0141) == (11, 13)
    assert record.times_of(11, 13) == pytest.approx([0.0112, 0.0131])
    assert waveform(write(text), columns={"t": "ms"}, rate=1000.0).times is None


def test_times_in_microseconds_below_a_header_in_seconds_are_warned_of(write):
    record = waveform(write(siglent("2e-6", 2.0, unit="us")))
    assert record.step == 2e-6
    assert "are taken to be in units of 1e-06 s" in record.warnings[0]


def test_a_header_that_its_times_contradict_is_refused_with_both(write):
    path = write(siglent("2e-5", 4e-5))
    with pytest.raises(TableError, match=r"interval of 2e-05 s.*4e-05 s.*`rate` = 50000 or 25000"):
        read_record(path)
    assert waveform(path, rate=25000.0).step == 4e-5


def test_a_record_shorter_than_announced_is_reported(write):
    assert waveform(write(siglent("1e-3", 1e-3, count=99))).warnings == (
        "data.csv: its header announces 99 samples, it holds 20",
    )


PLAIN = "t [s];u [mV]\n" + "".join(f"{k / 1000:.4f};{100 * k}\n".replace(".", ",") for k in range(20))


@pytest.mark.parametrize(
    "content",
    [
        PLAIN.replace("\n", "\r\n").encode(),
        PLAIN.replace("\n", ";;\n").encode(),
        PLAIN.encode() + b"\0" * 5000,
        codecs.BOM_UTF16_LE + PLAIN.encode("utf-16-le"),
        PLAIN.encode("utf-16-le"),
        PLAIN.encode("utf-16-be"),
        ("\ufeff" + PLAIN).encode(),
        PLAIN.replace("u [mV]", "Höhe U [mV]").encode("latin-1"),
        PLAIN.replace("\n", "\n\n").encode(),
    ],
    ids=["CRLF", "trailing", "NUL", "UTF-16", "UTF-16 LE bare", "UTF-16 BE bare", "BOM", "Latin-1", "blank lines"],
)
def test_the_way_a_file_is_written_does_not_matter(content, write):
    record = waveform(write(content))
    np.testing.assert_allclose(record.samples(), 0.1 * np.arange(20), rtol=1e-12)
    assert (record.step, record.signals[0].unit) == (pytest.approx(1e-3), "V")


def test_a_torn_last_line_is_left_out_with_a_warning(write):
    record = waveform(write(PLAIN + "0,02"))
    assert record.count == 20
    assert "line 22: '0,02' was cut off" in record.warnings[0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (PLAIN.replace("0,0100;1000", "0,0070;1000"), "line 12: its time goes back by 0.002 s"),
        (PLAIN.replace("0,0100;1000", "0,010;9,91E37"), "line 12: '9,91E37' is a missing sample"),
        (PLAIN.replace("0,0100;1000", "0,010;high"), "line 12: 'high' stands where a number with decimal comma"),
        ("X,CH1,Start,Increment\nSequence,Volt,x,y\n" + rows(), "no numbers below Start and Increment"),
        ("X,CH1,Start,Increment\nSequence,Volt,0,1e-3\n" + rows(20) + rows(20, 30), "1 is expected"),
        ("Time interval :,1mS\nindex,CH1\n" + "".join(f"{2 * k},1.5\n" for k in range(20)), "1 is expected"),
        ("X,CH1,Start,Increment\nSequence,Volt,0,1e-3\n" + rows(5), "holds 5 samples, at least 16"),
    ],
)
def test_a_damaged_record_is_refused_with_its_line(text, says, write):
    with pytest.raises(TableError) as caught:
        read_record(write(text))
    assert says in str(caught.value)
    assert not isinstance(caught.value, DoesNotSuit)
    assert not re.search(r"\b(the|of|is|are|and|to|with|not|it|or|at|holds)\b", in_language(caught.value.message, "de"))


@pytest.mark.parametrize(
    "text", ["t,f\n0,40\n10,39\n20,38\n", "0,40\n10,39\n20,38\n", "t;CH1\n0;40\n10;39\n20;38\n", "hello\n"]
)
def test_readings_are_no_samples(text, write):
    with pytest.raises(NoWaveform):
        read_record(write(text))


def test_a_channel_is_chosen_by_name_or_number(sample_data):
    record = waveform(sample_data / "scope-files" / "rigol-ds1000z.csv")
    assert [record.signal(wanted) for wanted in (None, "ch2", "2", "CH1")] == [0, 1, 1, 0]
    assert record.samples("CH2").max() == 0.02
    with pytest.raises(UsageError, match="has 'CH1', 'CH2'"):
        record.samples("CH3")


@pytest.mark.parametrize(
    "text",
    [
        "0.1\n0.2\n0.35\n0.4\n",
        "t [ms]\n100\n200\n350\n400\n",
        "0,1\r\n0,2\r\n0,35\r\n0,4\r\n0,0\n".replace("0,0\n", "1,05\n"),
    ],
)
def test_a_column_of_times_is_a_list_of_pulses(text, write):
    record = read_record(write(text, "pulses.txt"))
    np.testing.assert_allclose(record.times[:4], [0.1, 0.2, 0.35, 0.4], rtol=1e-12)


def test_pulse_times_in_microseconds_without_a_unit_are_asked_for_it(write):
    times = "".join(f"{25_000 * k}\n" for k in range(300))
    with pytest.raises(TableError, match="25000 s apart"):
        read_record(write(times))
    assert read_record(write(f"t [us]\n{times}")).times[1] == pytest.approx(0.025, rel=1e-12)


def test_a_counter_of_32_bits_that_begins_again_at_0_goes_on(write):
    times = 2**32 - 500_000 + 25_000 * np.arange(60)
    record = read_record(write("micros\n" + "".join(f"{k % 2**32}\n" for k in times)))
    np.testing.assert_allclose(record.times, times * 1e-6, rtol=1e-12)


@pytest.mark.parametrize(
    ("title", "unit"), [("dt [ms]", 1e-3), ("dt", 1e-6), ("Periode in ms", 1e-3), ("T us", 1e-6), ("Δt", 1e-3)]
)
def test_times_from_pulse_to_pulse_are_added(title, unit, write):
    """A micro-controller prints them, and those of a top that slows increase as well."""
    turns = 25e-3 + 2.3e-6 * np.arange(60)
    turns[[7, 30]] *= 2  # pulses that were missed
    record = read_record(write(f"{title}\n" + "".join(f"{turn / unit:.4f}\n" for turn in turns)))
    np.testing.assert_allclose(record.times, np.cumsum(turns), rtol=1e-7)
    assert "are times from pulse to pulse, of 19.94 to 40 Hz" in record.warnings[0]
    assert record.interval_step == pytest.approx(1e-7)  # the last digit that is not 0 in all


@pytest.mark.parametrize("title", ["", "T\n", "pulse times\n"])
def test_the_unit_of_one_column_may_be_stated(title, write):
    path = write(title + "".join(f"{25_000 + 2 * k}\n" for k in range(60)))
    assert read_record(path, columns={"f": "1 [us]"}).times[1] == pytest.approx(50.002e-3)
    with pytest.raises(NoWaveform, match="its columns are named"):
        read_record(path, columns={"f": "1 [rpm]"})
    times = write(title + "".join(f"{25_000 * k}\n" for k in range(60)))
    assert read_record(times, columns={"t": "1 [us]"}).times[1] == pytest.approx(25e-3)


@pytest.mark.parametrize("turn", ["0", "-4294"])
def test_a_time_from_pulse_to_pulse_below_0_is_named_with_its_line(turn, write):
    lines = ["25", "25.01", turn, *(f"{25 + k / 100}" for k in range(20))]
    with pytest.raises(TableError, match=r"line 4: a time from pulse to pulse of .* s, above 0 is expected"):
        read_record(write("dt [ms]\n" + "\n".join(lines) + "\n"))


@pytest.mark.parametrize(
    ("numbers", "unit"),
    [
        (25_000 + 2.3 * np.arange(300), "us"),
        ([21.52, 21.74, 21.61, 22.03, 21.9, 21.77, 21.85, 22.1, 21.99, 22.0], "ms"),  # lower limits
        (20_000 + 100 * np.sin(np.arange(3000)) + 30_000 * (np.arange(3000) % 150 == 0), "us"),  # light, of 16 bits
    ],
)
def test_numbers_without_a_unit_that_may_be_turns_are_not_guessed(numbers, unit, write):
    with pytest.raises(TableError, match=rf'pulse to pulse say `columns` = "f=1 \[{unit}\]", of samples'):
        read_record(write("".join(f"{number:.2f}\n" for number in numbers)))


def test_times_of_pulses_are_not_added_though_they_could_be_turns(write):
    times = 20 + np.arange(1000) / 30  # as ms they would be turns of 50 to 19 Hz
    record = read_record(write("".join(f"{time:.5f}\n" for time in times)))
    np.testing.assert_allclose(record.times, times, atol=1e-5)


@pytest.mark.parametrize("title", ['""', "Tom S", "pulse no. h"])
def test_the_last_word_of_another_title_is_no_unit(title, write):
    record = read_record(write(f"{title}\n" + "".join(f"{k / 40:.5f}\n" for k in range(300))))
    assert record.times[1] == pytest.approx(0.025, rel=1e-12)


def test_times_too_near_are_no_times_of_pulses(write):
    with pytest.raises(TableError, match=r"2\.3e-06 s apart, and no top turns so fast: for times from"):
        read_record(write("dt [ms]\n" + "".join(f"{2.5 + 0.0023 * k:.4f}\n" for k in range(300))))


@pytest.mark.parametrize("title", ["Pulse time us", "t us"])
def test_the_last_word_of_a_title_is_the_unit(title, write):
    record = read_record(write(f"{title}\n" + "".join(f"{25_000 * k}\n" for k in range(300))))
    assert record.times[1] == pytest.approx(0.025, rel=1e-12)


@pytest.mark.parametrize("title", ["f [Hz]", "rpm", "signal [V]", "height"])
def test_a_column_of_another_quantity_is_no_list_of_pulses(title, write):
    """The numbers increase, as times do."""
    seen = re.escape(title.replace(" ", ""))
    with pytest.raises(NoWaveform, match=f"one column, '{seen}', which is no time"):
        read_record(write(f"{title}\n" + "".join(f"{20 + k / 25}\n" for k in range(40))))


def test_arrays_need_a_rate_unless_they_hold_pulse_times(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, np.sin(np.arange(40.0)).reshape(2, 20))
    with pytest.raises(TableError, match="say `rate` in Hz"):
        read_record(path)
    np.save(path, np.arange(5.0))
    assert isinstance(read_record(path), PulseTimes)
    np.save(path, np.array([{}]), allow_pickle=True)
    with pytest.raises(TableError, match="save it again"):
        read_record(path)
    with pytest.raises(UsageError, match="rate"):
        read_record(path, rate=-1.0)


def test_a_given_rate_goes_before_that_of_a_wav(sample_data, write):
    assert waveform(write("CH1,CH2\n" + "0.5,1.5\n" * 20), rate=4000.0).step == 1 / 4000  # no times in it
    record = waveform(sample_data / "scope-files" / "recording.wav", rate=8000.0)
    assert record.step == 1 / 8000
    assert "8000 Hz takes the place of 4000 Hz" in record.warnings[0]
    with pytest.raises(TableError, match="holds 4000 samples a second, 1 are asked for: give `rate` in Hz, or leave"):
        read_record(sample_data / "scope-files" / "recording.wav", rate=1.0)


def test_a_recording_that_is_cut_off_says_so(sample_data, tmp_path):
    whole = (sample_data / "scope-files" / "recording.wav").read_bytes()
    (path := tmp_path / "cut.wav").write_bytes(whole[:1000])
    with pytest.raises(TableError, match=f"is cut off: it holds 1000 of {len(whole)} bytes; copy it again"):
        read_record(path)


@pytest.mark.parametrize("bits", [8, 16, 24, 32])
def test_wav_of_every_width(bits, tmp_path):
    samples = np.array([0.0, 0.5, -0.5, 0.25] * 8)
    codes = np.round(samples * 2 ** (bits - 1)).astype(np.int64) + (128 if bits == 8 else 0)
    both = np.repeat(codes, 2)  # two channels
    with wave.open(str(tmp_path / "a.wav"), "wb") as stream:
        stream.setparams((2, bits // 8, 1000, 32, "NONE", ""))
        stream.writeframes(b"".join(int(c).to_bytes(bits // 8, "little", signed=bits > 8) for c in both))
    plain = (tmp_path / "a.wav").read_bytes()
    pcm = uuid.UUID("00000001-0000-0010-8000-00aa00389b71").bytes_le  # of Windows' ksmedia.h
    extended = struct.pack("<I2s14sHHI", 40, b"\xfe\xff", plain[22:36], 22, bits, 0) + pcm
    (tmp_path / "b.wav").write_bytes(plain[:16] + extended + plain[36:])
    for record in (waveform(tmp_path / "a.wav"), waveform(tmp_path / "b.wav")):
        assert [signal.name for signal in record.signals] == ["left", "right"]
        np.testing.assert_array_equal(record.samples("right"), samples)


def read_or_refused(path, rate):
    """What is read, or None for a known failure of one line that names the file."""
    message = ""
    try:
        return read_record(path, rate=rate)
    except DataError as error:
        message = str(error)
    assert "\n" not in message
    assert message.startswith(str(path))
    return None


@FEW
@given(st.text(alphabet=st.sampled_from("0123456789.,;-+eE\t\n\r \"'#%xXtuV:[]\0é"), max_size=400))
@example("X,CH1,Start,Increment\n")
@example("Record Length,1,,1,1\n")
@example("Second,Volt\n1,1\n")
@example("#TIME,CH1\n#Source,1\n")
@example("x-axis,1\nsecond,Volt\n1\n")
@example("Source,CH1\nSecond,Volt\n" + "1,1\n" * 20)
@example("0\n" * 20)
def test_any_text_is_read_or_refused_in_one_line(write, text):
    path = write(text)
    for rate in (None, 1000.0):
        record = read_or_refused(path, rate)
        if record is not None:
            length = record.count if isinstance(record, Waveform) else len(record.times)
            read = record.samples() if isinstance(record, Waveform) else record.times
            assert len(read) == length
            assert np.isfinite(read).all()


@FEW
@given(
    st.binary(max_size=120), st.sampled_from([b"", b"RIFF\x24\0\0\0WAVEfmt ", b"\x93NUMPY\x01\0", b"RF64\0\0\0\0WAVE"])
)
def test_any_bytes_are_read_or_refused_in_one_line(write, content, magic):
    read_or_refused(write(magic + content, "a.dat" if magic else "a.bin"), 1000.0)


@FEW
@given(
    name=st.sampled_from([name for name in SCOPE_FILES if not name.startswith("two")]),
    edits=st.lists(st.tuples(st.integers(0, 400), st.sampled_from(list(b'0.,;-e \n"#x\0'))), min_size=1, max_size=4),
)
@example(name="samples-4000hz.npy", edits=[(60, ord("("))])
def test_a_damaged_header_is_read_or_refused_in_one_line(write, sample_data, name, edits):
    content = bytearray((sample_data / "scope-files" / name).read_bytes()[:2000])
    for place, byte in edits:
        content[place] = byte
    read_or_refused(write(bytes(content), name), None)


def test_binary_files_need_the_extra(write, monkeypatch):
    monkeypatch.setitem(sys.modules, "RigolWFM.wfm", None)
    with pytest.raises(TableError, match=r'pip install "\.\[scope\]"'):
        read_record(write(b"\xa5\xa5\0\0", "a.wfm"))


class FakeChannel:
    """What RigolWFM gives of a channel (1.6.0, channel.py)."""

    def __init__(self, number, volts):
        self.channel_number, self.volts, self.seconds_per_point = number, volts, 1e-3
        self.times = np.arange(20) * 1e-3 - 0.01


class FakeRecord:
    """What RigolWFM gives of a file."""

    parser_name, header_name = "wfm1000z", "DS1054Z"

    def __init__(self, channels):
        self.channels = channels

    @classmethod
    def from_file(cls, name):
        if "broken" in name:
            raise KeyError(name)
        sys.stdout.write("reading")
        return cls([FakeChannel(1, np.linspace(0, 1, 20)), FakeChannel(2, None)])


def test_binary_files_are_read_by_rigolwfm(write, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "RigolWFM", types.ModuleType("RigolWFM"))
    monkeypatch.setitem(sys.modules, "RigolWFM.wfm", types.SimpleNamespace(Wfm=FakeRecord))
    record = waveform(write(b"\xa5\xa5\0\0", "a.wfm"))
    assert (record.start, record.step, record.count, len(record.signals)) == (-0.01, 1e-3, 20, 1)
    assert "volts of a DS1000Z are wrong" in record.warnings[0]
    assert capsys.readouterr().out == ""
    with pytest.raises(TableError, match="export it as CSV"):
        read_record(write(b"", "broken.bin"))
