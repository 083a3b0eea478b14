"""Sweeps from files and runs to results, pages and figures."""

import re

import numpy as np
import pytest

from analysis.precession.gates import Gates, rates_at_point
from instruments.drivers.oscilloscope import Trace
from levilab.computer import utc_now
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import PrecessionOptions
from levilab.pipelines.precession.document import PRECESSION
from levilab.pipelines.precession.figure import precession_figure
from levilab.pipelines.result import save
from levilab.pipelines.suits import analyze_suiting
from levilab.report.page import render
from levilab.runs.events import RunEvent
from levilab.runs.gates import gates_event
from levilab.runs.run import RunRecord
from levilab.runs.writer import RunWriter
from support.commands import command
from support.figures import faults

DRIVE = np.arange(28.0, 46.0, 2.0)
U = 0.03


def sweep_csv(path, *, slope=1.0, u=True, seed=1, half=None):
    """A file of a user's own: German titles, a comma for the point."""
    counted = slope * DRIVE + U * np.random.default_rng(seed).standard_normal(DRIVE.size)
    if half is not None:
        counted[half] /= 2
    rows = [f"{d:.1f};{c:.4f}" + (f";{U}" if u else "") for d, c in zip(DRIVE, counted, strict=True)]
    header = "Antriebsfrequenz [Hz];Präzession [Hz]" + (";u(ν_p)" if u else "")
    path.write_text("\n".join([header, *(row.replace(".", ",") for row in rows), ""]), encoding="utf-8")
    return path


def test_a_file_of_ones_own_is_analyzed_without_naming_its_columns(tmp_path):
    file = sweep_csv(tmp_path / "mine.csv", half=3)
    ((row, found),) = analyze_suiting([file], {})
    assert row.name == "precession"
    document = ANALYSES["precession"].document(found, tmp_path)
    values = document["values"]
    assert values["slope"]["value"] == pytest.approx(1, abs=3 * values["slope"]["u"])
    assert values["intercept"]["unit"] == "Hz"
    assert 0.01 < values["p_locked"]["value"] <= 1
    assert values["power"]["value"] > 0.99
    assert "A slope of 1.05 would have shown with a probability of more than 0.999." in found.text
    assert "half the frequency was counted, left out of the line" in document["warnings"][0]
    weighted, robust = document["models"]
    (a, b), (_, c) = weighted["covariance"]
    assert (a, c) == (pytest.approx(values["slope"]["u"] ** 2), pytest.approx(values["intercept"]["u"] ** 2))
    assert b < 0
    assert weighted["centred"]["covariance"][0][1] == 0
    assert (weighted["statistics"]["n"], robust["statistics"]["n"]) == (8, 9)


def test_the_options_reach_the_fit(tmp_path):
    file = sweep_csv(tmp_path / "mine.csv", half=3)
    kept = PRECESSION.analyze([file], PrecessionOptions(keep_outliers=True, orthogonal=True, reading_u=0.1)).combined
    assert (kept.line.n, kept.line.orthogonal, kept.points[0].u) == (9, True, 0.1)


@pytest.mark.parametrize("titles", ["ν_d [Hz];ν_p [Hz]", "Antrieb (Hz);Präzession (Hz)", "drive_freq;precession_freq"])
def test_titles_of_reports_and_of_people_are_known(tmp_path, titles):
    file = tmp_path / "own.csv"
    _, _, rows = sweep_csv(file, u=False).read_text(encoding="utf-8").partition("\n")
    file.write_text(f"{titles}\n{rows}", encoding="utf-8")
    assert PRECESSION.analyze([file]).combined.line.n == 9


def test_several_sweeps_share_a_line(tmp_path):
    files = [sweep_csv(tmp_path / f"{k}.csv", seed=k) for k in (1, 2)]
    found = PRECESSION.analyze(files)
    assert found.combined.line.n == 18
    both, one = found.combined.line, found.runs[0].fit.line
    assert both.u_slope / both.scale == pytest.approx(one.u_slope / one.scale / 2**0.5)
    other = sweep_csv(tmp_path / "3.csv", slope=1.05, seed=3)
    together = PRECESSION.analyze([*files, other])
    assert any("slopes of the 3 runs differ" in text for text in together.all_warnings)
    assert "are excluded" in together.text


def test_other_options_than_those_of_the_result_fit_again_with_the_rest_as_before(tmp_path):
    files = [sweep_csv(tmp_path / f"{k}.csv", seed=k, half=k) for k in (1, 2)]
    found = PRECESSION.analyze(files[:1], PrecessionOptions(orthogonal=True))
    save(PRECESSION.result_of(found, found.place), found.place, b"", first=False)
    other_options = ANALYSES["precession"].recall(files[:1], PrecessionOptions(keep_outliers=True))
    assert other_options.origins[0].text.startswith("analyzed for this page: other options")
    assert other_options.combined.line.orthogonal  # what is not given is as it was


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("nu_d,nu_x\n1,2\n3,4\n5,6\n", "no column is known to be precession_frequency_hz"),
        ("f_d,f_p\n30,30\n31,31\n", "at least 3 readings are needed"),
        ("f_d,f_p\n30,30\n30,31\n30,29\n", "all 3 points are at a drive frequency of 30 Hz: sweep the drive"),
        ("f_d,f_p\n30,30\n31,-31\n32,32\n", "line 3: the precession frequency is -31 Hz"),
        ("f_d,f_p,u_f_p\n30,30,0\n31,31,1\n32,32,1\n", "line 2: the uncertainty of the precession frequency is 0 Hz"),
        ("f_d,f_p\n30,30\n31,thirty\n32,32\n", "line 3"),
    ],
)
def test_what_is_no_sweep_costs_one_line(tmp_path, content, said):
    (tmp_path / "bad.csv").write_text(content.replace("nu_d", "f_d"), encoding="utf-8")
    ended = command("analyze", "precession", "bad.csv", cwd=tmp_path)
    assert ended.status == 1
    assert said in ended.err
    assert len(ended.err.strip().splitlines()) == 1
    assert not ended.out


def run_with_records(folder, drift, kept_s=26.0):
    """A run of three points; the laser is recorded at the second one, at 20 s, and drifts beside the drive [Hz]."""
    names = ("time_s", "drive_frequency_hz", "precession_frequency_hz", "precession_frequency_u_hz")
    record = RunRecord(
        experiment="precession",
        status="running",
        started_utc=utc_now(),
        channels=[{"name": name, "unit": "s" if name == "time_s" else "Hz", "source": "made up"} for name in names],
        configuration={"precession": {"gate_s": 1.0}},
    )
    t = 1e-3 * np.arange(5000)
    with RunWriter.create(folder, record) as writer:
        for k, drive in enumerate((44.0, 40.0, 36.0)):
            writer.reading(dict(zip(names, (10.0 * (k + 1), drive, drive, 0.02), strict=True)))
            if k == 1:
                cut = np.cos(2 * np.pi * (drive + drift) * t) > 0.8
                for channel, volts in (("laser", 1.0 - cut), ("drive", np.sin(2 * np.pi * drive * t))):
                    codes = np.rint(100 + 100 * volts).astype(np.uint8)
                    writer.trace(kept_s, Trace(codes, 1e-3, -2.5, 0.01, -1.0, 1), channel)
        writer.finish("finished")
        return writer.folder


def test_a_record_says_whether_the_pulses_keep_to_the_drives_phase(tmp_path):
    found = PRECESSION.analyze([run_with_records(tmp_path / "locked", 0.0, kept_s=20.0)])
    ((point, coherence),) = [(one.point, one.coherence) for one in found.runs[0].coherences]
    assert point == 1
    assert coherence.length > 0.99
    assert coherence.phase_rad == pytest.approx(-np.pi / 2, abs=0.15)  # a cosine's maxima on a sine's phase, ±½ ms
    drifting = PRECESSION.analyze([run_with_records(tmp_path / "drifting", 0.6)])
    assert drifting.runs[0].coherences[0].coherence.drift_hz == pytest.approx(0.6, abs=0.01)
    assert any("do not keep to the drive's phase at point 2" in text for text in drifting.all_warnings)


def test_figure_and_page_show_what_was_found(tmp_path):
    analysis = ANALYSES["precession"]
    found = analysis.analyze([sweep_csv(tmp_path / "mine.csv", half=3), run_with_records(tmp_path / "runs", 0.0)])
    page = render([(analysis, found)])
    assert found.text.split(". ")[0].replace("−", "-") in page.replace("−", "-")
    meaning = next(
        block.text for block in PRECESSION.part(found).result if getattr(block, "lead", "") == "What it means."
    )
    assert "(p = " not in meaning, "the text above says it"
    assert "mean vector" in page
    assert "half the frequency was counted" in page
    assert "left out" in page
    figure = precession_figure(found)
    leverage = figure.axes[2]
    assert re.fullmatch(r"The precession follows the drive one to one \(p =\s0\.\d+\)", figure.texts[0].get_text())
    assert faults(figure) == []
    assert leverage.get_title("left") == "Leverage; dotted: the mean, 0.67"  # of the shortest sweep, 2 of 3 points


def test_a_reading_that_is_not_that_of_its_gates_is_believed_itself(tmp_path):
    """Where readings.csv was corrected by hand, the gates in events.jsonl are of something else."""
    random = np.random.default_rng(2)
    begin = 1.3 * np.arange(10)
    names = ("time_s", "drive_frequency_hz", "precession_frequency_hz", "precession_frequency_u_hz")
    channels = [{"name": name, "unit": "s" if name == "time_s" else "Hz", "source": "made up"} for name in names]
    for change in (0.0, 0.01):
        started = {"experiment": "precession", "status": "running", "started_utc": utc_now()}
        record = RunRecord(**started, channels=channels, configuration={"precession": {}})
        with RunWriter.create(tmp_path / f"{change}", record) as writer:
            for k, drive in enumerate((44.0, 40.0, 36.0)):
                length = random.uniform(0.75, 1.25, 10)
                spin, laser = (Gates(begin, begin + length, drive + 0.02 * random.standard_normal(10)) for _ in "ab")
                writer.event(
                    20.0 * k + 19, RunEvent.COUNTED, "counted", drive_frequency_hz=drive, **gates_event(spin, laser)
                )
                counted = rates_at_point(spin, laser)[1].value + change
                writer.reading(dict(zip(names, (20.0 * (k + 1), drive, counted, 0.5), strict=True)))
            writer.finish("finished")
        (run,) = PRECESSION.analyze([writer.folder]).runs
        assert (run.fit.points[0].u == 0.5) == bool(change)
        assert (run.fit.points[0].spin is None) == bool(change)
    assert PRECESSION.analyze([writer.folder]).all_warnings[0].endswith("the gates are not used")
