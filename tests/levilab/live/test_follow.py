"""A run folder read as it grows: torn lines, replaced files, and a memory that does not grow with it."""

import json
import os
import sys
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.spindown.tilt import Release
from levilab.live.envelope import GROUPS, LATEST, Envelope, by_columns
from levilab.live.follow import MOST_EVENTS, Followed
from levilab.live.tail import Tail
from levilab.pipelines.spindown.readings import release_of
from support.live_pages import GrowingRun, spin_down


def look(followed):
    followed.look()
    while followed.behind:
        followed.look()
    return followed


@given(st.lists(st.integers(1, 40), min_size=1, max_size=30), st.integers(2, 16))
def test_an_envelope_holds_the_lowest_the_highest_and_the_mean_of_all(blocks, half):
    rng = np.random.default_rng(sum(blocks))
    rows = rng.normal(size=(sum(blocks), 2))
    rows[rng.random(rows.shape) < 0.1] = np.nan
    envelope = Envelope(2, groups=2 * half)
    for block in np.split(rows, np.cumsum(blocks)[:-1]):
        envelope.add(block)
    found = envelope.groups()
    assert len(found) <= 2 * half + 1
    for k in range(len(found)):
        group = rows[k * found.size : (k + 1) * found.size]
        for channel in range(2):
            known = group[:, channel][~np.isnan(group[:, channel])]
            seen = found.low[channel, k], found.high[channel, k], found.mean[channel, k]
            wanted = (known.min(), known.max(), known.mean()) if len(known) else (np.nan,) * 3
            assert seen == pytest.approx(wanted, rel=1e-12, abs=1e-12, nan_ok=True)
    assert envelope.count == len(rows)


def test_a_million_readings_take_no_more_memory_than_ten_thousand(tmp_path):
    run = GrowingRun(tmp_path)
    run.add("".join(f"{0.04 * k:.2f},{30 + k % 7:.4f},0.03\n" for k in range(100_000)))
    followed = look(Followed(run.folder))
    envelope = followed.readings
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    block = np.zeros((10_000, 3))
    for _ in range(90):
        envelope.add(block)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert envelope.count == 1_000_000
    assert len(envelope.groups()) <= GROUPS + 1
    assert len(envelope.latest()) == LATEST
    assert grown < 1e6
    assert envelope.groups().high[1].max() == 36


def test_a_torn_last_line_waits_for_its_end(tmp_path):
    run = GrowingRun(tmp_path)
    followed = Followed(run.folder)
    run.add("0.5,39.8")
    assert look(followed).readings.count == 0
    run.add("7,0.03\n10.5,38")
    assert look(followed).readings.latest().mean.T.tolist() == [[0.5, 39.87, 0.03]]


def test_missing_values_and_damaged_lines_do_no_harm(tmp_path):
    run = GrowingRun(tmp_path)
    run.add("0.5,,0.03\n\0\0\n1.5,9.91e37,0.03\nx,y,z\n2.5,37.0,0.03,9\n3.5,36.5,0.03\n")
    found = look(Followed(run.folder)).readings.latest().mean
    assert found[0].tolist() == [0.5, 1.5, 3.5]
    assert np.isnan(found[1, :2]).all()


def test_a_file_that_is_replaced_is_read_anew(tmp_path):
    run = GrowingRun(tmp_path)
    run.readings(spin_down(5))
    followed = look(Followed(run.folder))
    version = followed.version
    other = tmp_path / "other.csv"
    other.write_text("time_s,height_m\n1,0.05\n", encoding="utf-8")
    other.replace(run.folder / "readings.csv")
    look(followed)
    assert (followed.columns, followed.readings.count) == (("time_s", "height_m"), 1)
    assert followed.version > version


def test_events_are_kept_up_to_a_number_and_damaged_ones_named(tmp_path):
    run = GrowingRun(tmp_path)
    for k in range(MOST_EVENTS + 50):
        run.event(f"event {k}", time_s=float(k))
    with (run.folder / "events.jsonl").open("a") as file:
        file.write('{"time_s": "never"}\n' + "x" * 3_000_000 + "\n")
        file.write(f'{{"time_s": 1{400 * "0"}, "kind": "said", "text": "a time beyond all floats"}}\n')
    run.event("y" * 5000, kind="drive on", frequency_hz=29.4)
    followed = look(Followed(run.folder))
    assert len(followed.events) == MOST_EVENTS
    texts = followed.texts_after(followed.event_count - 3)
    assert [event["kind"] for event in texts] == ["damaged", "damaged", "drive on"]
    assert (len(texts[-1]["text"]), texts[-1]["frequency_hz"]) == (600, 29.4)


def test_the_running_fit_knows_the_release_of_a_run_as_its_analysis_does(tmp_path):
    run = GrowingRun(tmp_path)
    run.event("drive on", kind="drive on", frequency_hz=30)
    run.event("drive off", kind="drive off", driven_s=240.0)
    followed = look(Followed(run.folder))
    lines = (run.folder / "events.jsonl").read_text("utf-8").splitlines()
    assert release_of(followed.events) == release_of(map(json.loads, lines)) == Release(30.0, 240.0)


def test_a_run_whose_process_is_gone_is_interrupted(tmp_path):
    run = GrowingRun(tmp_path)
    with run.running():
        assert look(Followed(run.folder)).status == "running"
    assert look(Followed(run.folder)).status == "interrupted"


def test_a_record_that_cannot_be_read_is_said_and_waited_for(tmp_path):
    run = GrowingRun(tmp_path)
    (run.folder / "run.json").write_text("{", encoding="utf-8")
    followed = look(Followed(run.folder))
    assert (followed.status, "run.json" in followed.problem) == ("missing", True)
    run.say()
    assert (look(followed).status, followed.problem) == ("finished", "")


@pytest.mark.skipif(sys.platform == "win32", reason="no pipes in folders")
def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "readings.csv")
    assert Tail(tmp_path / "readings.csv").lines() == []


def test_columns_of_a_picture_hold_the_extremes():
    x = np.arange(10_000.0)
    y = np.sin(x)
    middle, low, high = by_columns(x, y, y, 100)
    assert (len(middle), low.min(), high.max()) == (100, y.min(), y.max())
