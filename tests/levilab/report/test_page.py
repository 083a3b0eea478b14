"""The report: self-contained, complete, and safe against what a user typed."""

import base64
import hashlib
import json
import shutil
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from levilab.errors import DataError, LevilabError
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.spindown.report import spindown_part
from levilab.pipelines.suits import save
from levilab.present.document.blocks import Tabular
from levilab.report.html.page import script
from levilab.report.inputs import _drive
from levilab.report.page import render as render_found
from levilab.report.page import write_report
from levilab.runs.run import RunRecord
from support.figures import with_drawing, without_figures
from support.pages import Page
from support.paths import SAMPLE_DATA
from support.spin_downs import spin_down_csv


def render(found):
    return render_found([(ANALYSES["spindown"], found)])


@pytest.fixture(scope="module")
def found():
    return SPINDOWN.analyze([SAMPLE_DATA])


@pytest.fixture(scope="module")
def page(found):
    with with_drawing():
        return Page(render(found))


def column(found, name, head):
    """Return a column of a table of the report, by the first cell of each row."""
    part = spindown_part(found)
    (shown,) = (
        block.table
        for block in (*part.result, *part.compared, *part.runs)
        if isinstance(block, Tabular) and block.name == name
    )
    k = shown.heads.index(head)
    return {row.cells[0]: row.cells[k] for row in shown.rows}


def test_the_result_comes_first_then_the_figure_and_then_how_well_the_laws_fit(page):
    parts = ("Result", "What it means", "Drag laws", "Figure", "Notes", "The laws compared", "How well they fit")
    places = [page.text.rindex(part) for part in parts]
    assert places == sorted(places)


def test_nothing_is_fetched_when_the_report_is_opened(page):
    addresses = [
        value for tag, given in page.tags for name, value in given.items() if name in {"src", "href", "xlink:href"}
    ]
    assert addresses
    assert all(address and address.startswith(("data:", "#")) for address in addresses)
    assert not {"link", "iframe", "object", "embed", "base", "form"} & page.names()
    kinds = [given.get("type") for tag, given in page.tags if tag == "script"]
    assert kinds == ["application/json", None]
    ids = [given["id"] for _, given in page.tags if "id" in given]
    assert len(ids) == len(set(ids))
    assert {address[1:] for address in addresses if address and address[0] == "#"} <= {*ids}


def test_no_script_runs_but_ours_which_the_policy_names_by_its_hash(page):
    policy = next(given["content"] for tag, given in page.tags if given.get("http-equiv") == "Content-Security-Policy")
    assert policy.startswith(
        "default-src 'none'; base-uri 'none'; form-action 'none'; img-src data:; script-src 'sha256-"
    )
    assert "unsafe" not in policy.partition("style-src")[0]
    digest = base64.b64encode(hashlib.sha256(script().encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}';" in policy


def test_each_run_has_its_own_constants_and_the_scatter_stands_beside_the_mean(found):
    stokes = column(found, "spindown-runs", "ln ω against t\nC₁ [s⁻¹]")
    assert stokes["spin-down-1"].startswith("3.199(")
    assert (stokes["mean"], stokes["scatter s"]) == ("3.182(31)×10⁻³", "6.1(2.5)×10⁻⁵")  # u: s/√4, and s/√6 of s
    assert column(found, "spindown-runs", "1/ω against t\nC₂ [rad⁻¹]")["spin-down-1"].startswith("1.760(")
    fits = column(found, "spindown-runs", "disc fit\nC₃/₂ [(rad/s)^−½/s]")
    assert [fits[f"spin-down-{k}"] for k in (1, 2, 3, 4)] == [
        "2.369(4)×10⁻⁴", "2.3077(28)×10⁻⁴", "2.2829(31)×10⁻⁴", "2.3972(35)×10⁻⁴",
    ]  # fmt: skip
    assert column(found, "spindown-models-compared", "order test p")["stokes"] == "2×10⁻¹¹"


def changed(run, **entries):
    """The run with other entries in run.json."""
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    (run / "run.json").write_text(json.dumps(record | entries), encoding="utf-8")
    return run


def text_of(*paths, options=None):
    with without_figures():
        return Page(render(SPINDOWN.analyze(paths, options or SpinDownOptions()))).text


@pytest.fixture
def run(tmp_path, sample_data):
    return Path(shutil.copytree(sample_data / "spin-down-1", tmp_path / "20261121T005200Z-spin-c893"))


INSTRUMENTS = {
    "counter": {
        "identity": "Keysight Technologies,53230A,1,3.09",
        "address": "TCPIP0::10.0.0.5::INSTR",
        "driver": "Keysight53230A",
        "settings_start": {"gate_s": 0.1, "coupling": "AC"},
        "settings_end": {"automatic_level": False, "gate_s": 1.0, "impedance_ohm": 1e6, "coupling": "DC"},
    },
    "generator": {
        "address": "TCPIP0::10.0.0.6::INSTR",
        "settings_end": {
            "output": False, "frequency_hz": 40.0, "amplitude_vpp": 10.0, "waveform": "SIN", "load_ohm": 9.9e37,
        },
    },
}  # fmt: skip


def test_what_a_user_typed_is_escaped_wherever_it_stands(tmp_path, run):
    evil = '<script>alert("x")</script>&<img src=x onerror=alert(1)>'
    settings = {evil: evil, "waveform": evil, "output": evil}
    changed(
        run.rename(tmp_path / "run <b>bold"),
        note=evil,
        synthetic_how=evil,
        command_line=[evil],
        started_utc=evil,
        configuration={"spin": {"drive_waveform": evil, "ramp_hz_per_s": evil}, "limits": {evil: evil}},
        channels=[{"name": "spin_frequency_u_hz", "source": evil}],
        instruments={evil: {"identity": evil, "address": evil, "settings_end": settings}},
    )
    event = json.dumps({"time_s": 1.0, "kind": "fell", "text": evil}) + "\n"
    (tmp_path / "run <b>bold" / "events.jsonl").write_text(event, encoding="utf-8")
    file = spin_down_csv(tmp_path / "<i>my.csv")
    parsed = Page(render(SPINDOWN.analyze([tmp_path / "run <b>bold", file], SpinDownOptions(tilt="none"))))
    assert parsed.text.count(evil) >= 14
    assert "run <b>bold" in parsed.text
    assert "<i>my.csv" in parsed.text
    assert not {"b", "i"} & parsed.names()
    assert [given.get("type") for tag, given in parsed.tags if tag == "script"] == ["application/json", None]
    assert all("onerror" not in attributes for _, attributes in parsed.tags)


def test_settings_read_like_a_lab_book_and_are_those_of_the_measurement(run):
    text = text_of(changed(run, instruments=INSTRUMENTS))
    assert "automatic level off, gate 1 s, impedance 1 MΩ, coupling DC" in text
    assert "output off; last drive 40 Hz, 10 Vpp, SIN; load high impedance" in text
    assert "at the start at the end Counter gate 0.1 s 1 s coupling AC DC" in text
    assert "did not answer at TCPIP0::10.0.0.6::INSTR" in text


def test_the_drive_its_limits_and_the_origin_of_u_are_told(run):
    spin = {"drive_waveform": "SIN", "drive_frequency_hz": 40.0, "drive_amplitude_vpp": 10.0, "ramp_hz_per_s": 0.2}
    text = text_of(changed(run, configuration={"spin": spin, "limits": {"drive_amplitude_vpp": 12.0}}))
    assert "SIN, 40 Hz, 10 Vpp, raised by 0.2 Hz/s" in text
    assert "limits of the bench: drive amplitude 12 Vpp" in text
    assert "u of a reading: 0.03 Hz, standard deviation of the noise" in text


def test_the_drive_is_that_of_the_run_s_own_experiment():
    tables = {"spin": {"drive_frequency_hz": 40.0}, "tilt": {"drive_frequency_hz": 30.0}, "scan": {"step_m": 0.01}}
    assert _drive(RunRecord(experiment="tilt", status="finished", started_utc=None, configuration=tables)) == ("30 Hz",)
    assert _drive(RunRecord(experiment="scan", status="finished", started_utc=None, configuration=tables)) == ()


def test_times_are_to_the_second_and_what_is_not_known_is_left_out(run):
    assert "not known" not in text_of(run).rpartition("What was measured, and with what")[2]
    started, ended = "2026-11-21T00:52:00.123456Z", "2026-11-21T00:55:10.5Z"
    text = text_of(changed(run, started_utc=started, ended_utc=ended))
    assert "2026-11-21 00:52:00 UTC to 2026-11-21 00:55:10 UTC" in text
    zero = "2026-11-21T00:52:00Z"
    changed(run, started_utc=started, time_zero_utc=zero)
    assert "time zero at" not in text_of(run), "the clock of a simulation is no clock time"
    parsed = text_of(changed(run, synthetic=False))
    here = datetime.fromisoformat(zero).astimezone()
    assert f"time zero at {here:%Y-%m-%d %H:%M:%S} " in parsed
    assert f"{here + timedelta(seconds=190):%H:%M:%S} 190.000 21.75" in parsed  # the last reading


def test_what_happened_tells_the_fall(run):
    events = [
        {"utc": "2026-11-21T00:51:00Z", "time_s": None, "kind": "drive on", "text": "drive on at 30 Hz"},
        {"utc": "2026-11-21T00:55:00Z", "time_s": 200.0, "kind": "fell", "text": "fell between 190.0 s and 200.0 s"},
    ]
    (run / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events), encoding="utf-8")
    text = text_of(changed(run, time_zero_utc="2026-11-21T00:52:00Z"))
    assert "before: drive on at 30 Hz" in text
    assert "The last reading that was fitted is 21.75 Hz at 190.0 s; fell between 190.0 s and 200.0 s." in text


def test_one_synthetic_run_says_once_how_it_was_made(run):
    text = text_of(run)
    assert text.count("39.9366 Hz") == 1
    assert "SYNTHETIC. This run did not come from a real bench." in text


def test_a_file_whose_first_line_says_that_it_is_synthetic_has_the_mark(tmp_path, sample_data):
    file = tmp_path / "marked.csv"
    file.write_bytes(b"# SYNTHETIC, by hand\n" + spin_down_csv(tmp_path / "plain.csv").read_bytes())
    assert "SYNTHETIC. This file did not come from a real bench: its first line says so." in text_of(file)
    both = text_of(sample_data / "spin-down-1", file)
    assert "1 run and 1 data file: none came from a real bench. How each was made stands in its run.json." in both
    real = changed(shutil.copytree(sample_data / "spin-down-1", tmp_path / "real"), synthetic=False)
    assert "How each was made" not in text_of(real, file)


def test_a_mixture_of_real_and_synthetic_runs_is_no_measurement_and_says_so(tmp_path, sample_data):
    text = text_of(sample_data / "spin-down-1", spin_down_csv(tmp_path / "real.csv"))
    assert "REAL AND SYNTHETIC RUNS MIXED. 1 of 2 runs did not come from a real bench (spin-down-1)." in text
    assert "MIXED, and so no measurement (1 of 2 inputs are SYNTHETIC): " in text, "the verdict is read alone"


@pytest.mark.usefixtures("undrawn_figures")
@pytest.mark.parametrize("readings", [3, 20])
def test_a_law_is_marked_best_only_where_the_readings_decide(tmp_path, readings):
    analysis = SPINDOWN.analyze([spin_down_csv(tmp_path / "a.csv", n=readings)], SpinDownOptions(tilt="none"))
    parsed = Page(render(analysis))
    marked = [attributes for tag, attributes in parsed.tags if tag == "tr" and attributes.get("class") == "best"]
    assert bool(marked) == analysis.combined.verdict.decided
    assert ("(best)" in parsed.text) == analysis.combined.verdict.decided


def reported(*paths, output, tell=None, **options):
    with without_figures():
        page = write_report(paths, output, options, tell).read_text(encoding="utf-8")
    return Page(page).text


@pytest.mark.usefixtures("undrawn_figures")
def test_the_report_does_not_fit_what_has_a_result(run, tmp_path, monkeypatch):
    analysis = SPINDOWN.analyze([run], SpinDownOptions(tilt="none"))
    save(ANALYSES["spindown"], analysis)
    monkeypatch.setattr("levilab.pipelines.spindown.analysis.fit_spin_down", pytest.fail)
    recalled = render(ANALYSES["spindown"].recall([run], SpinDownOptions(tilt="none")))
    again = render(analysis)
    differ = [pair for pair in zip(recalled.split("\n"), again.split("\n"), strict=True) if pair[0] != pair[1]]
    assert all("Analysis" in here for here, _ in differ)


@pytest.mark.usefixtures("undrawn_figures")
def test_the_report_says_what_it_had_to_analyze(run, tmp_path):
    before = sorted(run.rglob("*"))
    assert "analyzed for this page: there was no result yet" in reported(run, output=tmp_path / "report.html")
    assert sorted(run.rglob("*")) == before
    save(ANALYSES["spindown"], SPINDOWN.analyze([run]))
    text = reported(run, output=tmp_path / "report.html", reading_u=0.05)
    assert f"analyzed for this page: other options than those of {run / 'result.json'}" in text
    assert "u of a reading: 0.05 Hz, as given to the analysis" in text
    (run / "readings.csv").write_text(spin_down_csv(tmp_path / "other.csv").read_text("utf-8"), encoding="utf-8")
    text = reported(run, output=tmp_path / "report.html")
    assert f"analyzed for this page: the readings are others than in {run / 'result.json'}" in text


@pytest.mark.usefixtures("undrawn_figures")
def test_a_report_of_a_data_file_knows_no_instrument_and_says_so(tmp_path):
    parsed = Page(render(SPINDOWN.analyze([spin_down_csv(tmp_path / "my.csv")], SpinDownOptions(tilt="none"))))
    assert "my.csv" in parsed.text
    assert "The moment of the top is taken to lie along its axis" in parsed.text
    assert "no instruments recorded" in parsed.text
    assert "SYNTHETIC" not in parsed.text


@pytest.mark.usefixtures("drawn_figures")
def test_many_readings_are_cut_in_the_page_and_the_figure_stays_small(tmp_path):
    t = np.arange(4000) * 0.05
    nu = 40 * (1 + 2.34e-4 * np.sqrt(2 * np.pi * 40) * t / 2) ** -2 + np.random.default_rng(0).normal(0, 0.03, t.size)
    path = tmp_path / "long.csv"
    np.savetxt(path, np.c_[t, nu], delimiter=",", header="time_s,spin_frequency_hz", comments="")
    html = render(SPINDOWN.analyze([path], SpinDownOptions(reading_u=0.03, tilt="none")))
    assert "The first 200 of 4000" in Page(html).text
    assert len(html) < 3e6


def read(page):
    return Page(page.read_text(encoding="utf-8"))


@pytest.mark.usefixtures("undrawn_figures")
def test_all_analyses_of_a_folder_are_on_the_page_in_their_order(tmp_path, sample_data):
    for name in ("upper-limits", "spin-down-1"):
        shutil.copytree(sample_data / name, tmp_path / "runs" / name)
    messages = []
    page = read(write_report([tmp_path / "runs"], tmp_path / "page.html", tell=messages.append))
    assert page.of_level(1) == ["Report of 2 runs"]
    assert page.of_level(2) == [
        "Spin-down of a levitated top",
        "Limits of the spin of a levitated top",
        "What was measured, and with what",
        "How to reproduce this",
    ]
    assert page.text.count(f"levilab report {tmp_path / 'runs'} --no-crosscheck -o page.html") == 1
    assert messages == []  # no run is passed over by all analyses
    assert "analyzed for this page: there was no result yet" in page.text


@pytest.mark.usefixtures("undrawn_figures")
def test_a_run_that_has_two_results_is_described_once(tmp_path, sample_data):
    run = shutil.copytree(sample_data / "precession-sweep", tmp_path / "sweep")
    options = {"reading_u": 0.1, "channel": "laser"}
    for name in ("precession", "spin"):
        analysis = ANALYSES[name]
        page = read(write_report([run], tmp_path / "page.html", options))
        assert page.of_level(2)[:1] != ["Spin frequency of a top"]  # whose analysis is for other experiments
        save(analysis, analysis.analyze([run], analysis.options_from(options)))
    page = read(write_report([run], tmp_path / "page.html", options))
    assert page.of_level(2)[:2] == ["Spin frequency of a top", "Precession of a driven top"]
    assert page.of_level(3).count("sweep") == 1
    assert page.text.count("as levilab analyze found it") == 2


@pytest.mark.usefixtures("undrawn_figures")
def test_a_result_that_lies_elsewhere_is_found_by_its_own_path(tmp_path, run):
    elsewhere = tmp_path / "elsewhere"
    spindown = ANALYSES["spindown"]
    save(spindown, SPINDOWN.analyze([run], SpinDownOptions(reading_u=0.07)), elsewhere)
    assert "as levilab analyze found it" not in reported(run, output=tmp_path / "page.html", tell=pytest.fail)
    for path in (elsewhere, elsewhere / "result.json"):
        text = reported(path, output=tmp_path / "page.html", tell=pytest.fail)
        assert f"as levilab analyze found it: {elsewhere / 'result.json'}" in text
        assert "u of a reading: 0.07 Hz" in text
    run.rename(tmp_path / "renamed")
    with pytest.raises(DataError, match=r"elsewhere.result\.json: is of .*spin-c893, which is not there"):
        reported(elsewhere, output=tmp_path / "page.html")


def test_a_report_that_cannot_be_written_is_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    (tmp_path / "folder.html").mkdir()
    for output in (tmp_path / "file" / "report.html", tmp_path / "folder.html"):
        with pytest.raises(LevilabError, match="`out`"):
            write_report([tmp_path / "no run, which would be said first"], output)
