"""What a session offers to every experiment, shown by one that is no spin-down: a scan with a person at the bench."""

import dataclasses
import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import Field, create_model

from instruments.clock import VirtualClock
from levilab.acquisition.experiment import Experiment, ExperimentSettings
from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.onlooker import state_of
from levilab.acquisition.request import AcquisitionOptions, CannotResume, request_for
from levilab.acquisition.session import ExperimentFailed, Session
from levilab.acquisition.table import EXPERIMENTS
from levilab.bench.config import BenchConfig
from levilab.bench.person import PlaceProbe
from levilab.errors import DataError
from levilab.runs.channel import Channel
from levilab.runs.run import Run
from levilab.world.base import Base
from levilab.world.bench import virtual_wiring
from levilab.world.spin_world import SpinScene, SpinWorld
from support.acquisitions import Silent, acquired, cut


class ScanSettings(ExperimentSettings):
    """Heights at which the field is measured [m]."""

    heights_m: tuple[float, ...] = (0.05, 0.06, 0.07)


CHANNELS = (
    Channel("time_s", "s", "bench clock"),
    Channel("height_m", "m", "as the person at the bench says"),
    Channel("flux_density_t", "T", "gaussmeter on the axis"),
    Channel("light_v", "V", "mean of an oscilloscope's record"),
)


def scan(session):
    """At each height: the person moves the probe, then a field, a record, and a reading of both."""
    bench = session.bench
    bench.magnetometer.prepare(range_t=None)
    bench.oscilloscope.prepare(duration_s=0.1, points=1000, volts_per_division=0.5, trigger_level_v=0.6, sweep="auto")
    session.begin(lambda: session.progress("probe in its chamber", 1.0))
    for k, height in enumerate(session.settings.heights_m):
        session.ask(PlaceProbe(f"Move the probe to {100 * height:g} cm.", height))
        flux_density = bench.magnetometer.flux_density()
        assert flux_density is not None
        bench.oscilloscope.acquire(timeout_s=5.0)
        record = session.keep_trace(1, "phototransistor", session.now())
        row = {"time_s": session.now(), "height_m": height, "flux_density_t": flux_density}
        row["light_v"] = float(np.nanmean(record.volts))
        session.keep(row, time_left_s=2.0 * (len(session.settings.heights_m) - k - 1))


SCAN = Experiment(
    name="scan",
    about="flux density against height",
    instruments=("magnetometer", "oscilloscope"),
    settings=ScanSettings,
    channels=lambda _: CHANNELS,
    run=scan,
)
SCAN_TABLES = create_model("ScanTables", __base__=BenchConfig, scan=(ScanSettings, Field(default_factory=ScanSettings)))


@pytest.fixture
def request_of_a_scan(tmp_path, monkeypatch):
    monkeypatch.setitem(EXPERIMENTS, "scan", SCAN)
    world = SpinWorld(SpinScene(), VirtualClock())
    return AcquisitionRequest(
        "scan", SCAN_TABLES(), lambda: virtual_wiring(world), out=tmp_path, synthetic_how="a test"
    )


def with_person(request, person):
    """The same with this person at the bench."""
    wiring = dataclasses.replace(request.wiring(), person=person)
    return dataclasses.replace(request, wiring=lambda: wiring)


def test_an_experiment_of_another_shape_writes_what_it_declares(request_of_a_scan):
    run = acquire(request_of_a_scan, Silent())
    assert run.status == "finished"
    assert sorted(run.record.instruments) == ["magnetometer", "oscilloscope"]
    frame = run.readings().frame
    assert list(frame) == [channel.name for channel in CHANNELS]  # light_v is a name of this experiment alone
    assert frame["height_m"].tolist() == [0.05, 0.06, 0.07]
    field = [Base().flux_density(height) for height in (0.05, 0.06, 0.07)]  # the person has moved the probe
    assert frame["flux_density_t"].to_numpy() == pytest.approx(field, rel=1e-3)
    assert frame["light_v"].between(0.0, 1.3).all()


def test_a_reading_is_shown_with_its_units_and_the_time_left(request_of_a_scan):
    show = Silent()
    acquire(request_of_a_scan, show)
    assert show.left == [4.0, 2.0, 0.0]
    assert [text.split()[3::2] for text in show.readings] == [["m", "T", "V"]] * 3


def test_what_is_left_at_least_and_at_most_is_kept_shown_and_seen_as_a_pair(request_of_a_scan, monkeypatch):
    class Watching(Silent):
        def reading(self, text, elapsed, remaining):
            shown.append(remaining)

    def uncertain(session):
        session.begin(lambda: None)
        session.keep(dict.fromkeys([channel.name for channel in CHANNELS], session.now()), (10.0, 30.0))
        state = state_of(session, virtual=True)
        seen.append((state.least_left_s, state.time_left_s))

    shown = []
    seen = []
    monkeypatch.setitem(EXPERIMENTS, "scan", dataclasses.replace(SCAN, run=uncertain))
    assert acquire(request_of_a_scan, Watching()).status == "finished"
    assert shown == [(10.0, 30.0)]
    assert seen == [(pytest.approx(10.0), pytest.approx(30.0))]


def test_the_points_of_a_scans_values_stand_below_each_other(tmp_path):
    show = Silent()
    acquired("field", show, out=tmp_path, seed=1, settings=("field.lowest_m=0.06",))
    assert len(show.readings) > 5
    assert len({tuple(k for k, c in enumerate(text) if c == ".") for text in show.readings}) == 1


def test_records_are_kept_raw_and_come_back_in_volts(request_of_a_scan):
    run = acquire(request_of_a_scan, Silent())
    stored = run.traces()
    assert [one.number for one in stored] == [1, 2, 3]
    assert {one.channel for one in stored} == {"phototransistor"}
    light = run.readings().column("light_v")
    for one, mean in zip(stored, light, strict=True):
        assert one.trace.codes.dtype == np.uint8
        assert np.nanmean(one.trace.volts) == pytest.approx(mean, rel=1e-12)
    package = (run.folder / "datapackage.json").read_text(encoding="utf-8")
    assert "traces/000003.npy" in package
    assert "traces.jsonl" in package


def test_codes_that_were_changed_afterwards_are_refused(request_of_a_scan):
    run = acquire(request_of_a_scan, Silent())
    codes = run.folder / "traces/000002.npy"
    codes.write_bytes(codes.read_bytes()[:-1] + b"\x00")
    with pytest.raises(DataError, match=r"000002\.npy: is not what was recorded"):
        run.traces()


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("{", "a line of it is damaged"),
        ("[" * 5000 + "]" * 5000, "nested"),
        ('{"number": 1}', "describes no record: time_s: is missing"),
        ('{"path": "../../elsewhere.npy"}', "describes no record"),
    ],
)
def test_an_index_that_is_damaged_is_refused_in_a_line(request_of_a_scan, line, says):
    run = acquire(request_of_a_scan, Silent())
    (run.folder / "traces.jsonl").write_text(line + "\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"traces\.jsonl: a line") as caught:
        run.traces()
    assert says in str(caught.value)


def test_the_person_is_asked_and_the_answer_is_kept(request_of_a_scan):
    answers = iter(["", " at 6.1 cm, the stand slips ", ""])
    asked = []

    def person(task):
        asked.append(task.text)
        return next(answers)

    show = Silent()
    run = acquire(with_person(request_of_a_scan, person), show)
    assert asked[0] == "Move the probe to 5 cm."
    assert not any("Move the probe" in text for text in show.messages)  # the one who asks has shown it
    happened = [(event["kind"], event["text"]) for event in run.events()]
    assert happened.count(("asked the person", "Move the probe to 6 cm.")) == 1
    assert ("answered", "at 6.1 cm, the stand slips") in happened


def test_the_first_ctrl_c_ends_a_question(request_of_a_scan):
    def leaves(_):
        signal.raise_signal(signal.SIGINT)
        pytest.fail("the signal did not break through")

    run = acquire(with_person(request_of_a_scan, leaves), Silent())
    assert run.status == "interrupted"


def test_a_clock_that_goes_back_is_no_reading(request_of_a_scan, monkeypatch):
    times = iter([5.0, 5.0, 5.0, 4.0, 4.0, 4.0])
    monkeypatch.setattr(Session, "now", lambda _: next(times, 4.0))
    with pytest.raises(ExperimentFailed, match="the clock went back"):
        acquire(request_of_a_scan, Silent())


# --- readings at an interval ---


@pytest.mark.parametrize(
    ("longest", "second_takes", "lost", "expected"),
    [
        (35.0, 1.0, False, [0.0, 10.0, 20.0, 30.0, 40.0]),
        (60.0, 25.0, True, [0.0, 10.0, 40.0, 50.0, 60.0]),  # what was missed while lost is not caught up with
        (45.0, 25.0, False, [0.0, 10.0, 35.0, 36.0, 40.0, 50.0]),  # one that takes too long is followed at once
    ],
)
def test_readings_come_at_whole_multiples_of_the_interval(longest, second_takes, lost, expected):
    class Jumping(Session[Any]):
        clock = 0.0

        def now(self):
            return self.clock

        def wait(self, duration):
            self.clock += max(duration, 0.0)

        def event(self, kind, text, **data): ...

    session = Jumping.__new__(Jumping)
    session.rows, session._lost, session.zero = [], False, 0.0
    session.writer = SimpleNamespace(record=SimpleNamespace(experiment="scan"))
    seen = []
    for time in session.readings_every(10.0, longest):
        seen.append(time)
        session._lost = lost and time == 10.0
        session.clock += second_takes if time == 10.0 else 1.0
    assert seen == expected


def test_a_run_whose_time_zero_is_not_known_is_not_called_empty(sample_data, tmp_path):
    run = Run.load(sample_data / "spin-down-1")
    assert run.record.time_zero_utc is None
    with pytest.raises(CannotResume, match=r"has no time_zero_utc.* they are kept and can be analyzed"):
        request_for("spin", AcquisitionOptions(resume=cut(run, tmp_path / "run", run.count())))


def test_a_run_that_is_not_there_is_looked_for_in_words(tmp_path):
    def refused(name):
        with pytest.raises(DataError) as caught:
            request_for("spin", AcquisitionOptions(resume=Path(name), out=tmp_path / "runs"))
        return str(caught.value)

    assert "go to the folder that holds" in refused("spin-567a")
    for day in (1, 2):
        (tmp_path / f"runs/2026110{day}T101500Z-spin-12ab").mkdir(parents=True)
    assert refused("spin-567a").endswith("levilab runs lists those that are there")
    assert "is called spin-12ab: say its whole name" in refused("spin-12ab")
    assert "there is no such run" in refused("elsewhere/spin-567a")
