"""The sweep of the drive: on the virtual bench in full motion once, its decisions with a top that only spins."""

import re
from dataclasses import replace

import numpy as np
import pytest

from analysis.precession.gates import Swing
from instruments.clock import VirtualClock
from instruments.drivers.generator import Limits
from instruments.errors import NoAnswer
from levilab.acquisition.counting import prepare_counter
from levilab.acquisition.experiments.precession import PrecessionSettings, _time_left, calming_step
from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.session import ExperimentFailed
from levilab.acquisition.table import Configuration, with_settings
from levilab.interruption import Interrupted
from levilab.pipelines.precession.document import PRECESSION
from levilab.runs.run import Run
from levilab.world.bench import virtual_wiring
from levilab.world.spin_world import SpinScene, SpinWorld
from support.acquisitions import Impatient, Silent, asked, texts
from support.commands import command

QUICK = {"hold_s": 1.0, "counts": 3, "gate_s": 0.5, "interval_s": 1.0, "ramp_hz_per_s": 0.2}


class Wobbling(SpinWorld):
    """A top that only spins; the laser sees it as often as the lamp does."""

    def laser(self, start, step, n):
        return self.light(start, step, n)


def request(out, world, **settings):
    """A sweep of a top that is in this world, as on a real bench: without a seed."""
    chosen = {"drive_frequency_hz": 30.0, "frequencies_hz": (30.5, 31.0, 32.0)} | QUICK | settings
    config = with_settings(Configuration(), "precession", PrecessionSettings(**chosen))
    return AcquisitionRequest(
        "precession", config, lambda: virtual_wiring(world, config.limits), out=out, synthetic_how="a test"
    )


def kept(out):
    return Run.load(next(out.iterdir()))


def test_a_sweep_in_full_motion_finds_a_locked_top(tmp_path):
    usual = asked("precession", out=tmp_path, seed=1)
    quick = QUICK | {
        "hold_s": 5.0,
        "gate_s": 1.0,
        "interval_s": 2.0,
        "record_s": 5.0,
        "counts": 8,
        "ramp_hz_per_s": 0.1,
    }
    settings = PrecessionSettings(drive_frequency_hz=45.0, frequencies_hz=(45.0, 44.5, 44.0), **quick)
    show = Silent()
    run = acquire(replace(usual, config=with_settings(usual.config, "precession", settings)), show)
    assert run.status == "finished"
    assert run.record.synthetic
    readings = run.readings()
    assert list(readings.header) == [channel["name"] for channel in run.record.channels]
    np.testing.assert_array_equal(readings.column("drive_frequency_hz"), [45.0, 44.5, 44.0])
    for quantity in ("spin", "precession"):
        off = readings.column(f"{quantity}_frequency_hz") - readings.column("drive_frequency_hz")
        # eight gates of a top that swings about the drive by a tenth of a turn or more: four or five beyond the swing
        assert (np.abs(off) < 5 * readings.column(f"{quantity}_frequency_u_hz") + 0.005).all()
    assert run.record.instruments["generator"]["settings_end"]["output"] is False
    assert show.left == sorted(show.left, reverse=True)
    assert show.left[-1] == 0
    (found,) = PRECESSION.analyze([run.folder]).runs
    assert [one.point for one in found.coherences] == [0, 1, 2]
    # of this run's gates; their u is the line's, the first estimate of the value stands in the readings
    np.testing.assert_allclose(found.fit.column("precession"), readings.column("precession_frequency_hz"), rtol=1e-9)
    assert not np.allclose(found.fit.column("u"), readings.column("precession_frequency_u_hz"))
    assert texts(run, "calmed") == []  # a drive that yielded when it took hold leaves no swing to be calmed
    assert all(one.coherence.locked for one in found.coherences)


def test_an_interrupted_sweep_goes_on_at_the_next_point_on_another_day_too(tmp_path):
    """The time that it may take does not run while it lies still."""
    first = request(tmp_path, Wobbling(SpinScene(), VirtualClock()))
    run = acquire(first, Impatient(1))
    assert (run.status, run.count()) == ("interrupted", 1)
    assert run.record.instruments["generator"]["settings_end"]["output"] is False
    file = run.folder / "run.json"
    text = file.read_text(encoding="utf-8")
    file.write_text(re.sub(r'("time_zero_utc": )"[^"]*"', r'\1"2026-01-01T00:00:00Z"', text), encoding="utf-8")
    again = acquire(replace(first, resume=Run.load(run.folder), synthetic_how=None), Silent())
    assert again.status == "finished"
    readings = again.readings()
    np.testing.assert_array_equal(readings.column("drive_frequency_hz"), [30.5, 31.0, 32.0])
    assert (np.diff(readings.column("time_s")) > 0).all()
    np.testing.assert_allclose(readings.column("precession_frequency_hz"), [30.5, 31.0, 32.0], atol=0.2)


def test_a_point_whose_record_is_broken_off_is_kept(tmp_path, monkeypatch):
    def interrupt(*_):
        assert kept(tmp_path).count() == 1  # on the disk, before a record that may be a minute on its way
        raise Interrupted("SIGINT")

    monkeypatch.setattr("levilab.acquisition.experiments.precession._record", interrupt)
    run = acquire(request(tmp_path, Wobbling(SpinScene(), VirtualClock()), record_s=6.0), Silent())
    assert (run.status, run.count()) == ("interrupted", 1)


def test_a_swing_is_taken_off_within_the_limits_of_the_drive():
    """Its crest is at 3 s, half a swing lasts 2 s: it goes forward at 11 s or, at its upper limit, back at 13 s."""
    swing = Swing(frequency=0.25, size=0.3, crest=3.0)
    at_11, at_13 = (10.85, 41.0), (12.85, 39.0)
    assert calming_step(swing, 40.0, 10.0, Limits(drive_frequency_hz=100.0)) == pytest.approx(at_11)
    assert calming_step(swing, 40.0, 10.0, Limits(drive_frequency_hz=40.5)) == pytest.approx(at_13)
    assert calming_step(swing, 40.0, 10.0, Limits(drive_frequency_hz=40.5, drive_lowest_hz=39.5)) is None


def test_a_top_that_swings_is_calmed_at_each_point(tmp_path, monkeypatch):
    swing = Swing(frequency=0.25, size=0.3, crest=3.0)
    monkeypatch.setattr("levilab.acquisition.experiments.precession.swing_of", lambda _: swing)
    run = acquire(request(tmp_path, Wobbling(SpinScene(), VirtualClock())), Silent())
    assert texts(run, "calmed") == 3 * ["the top swung 0.30 turns about the drive: the drive was moved by this angle"]
    np.testing.assert_allclose(run.readings().column("spin_frequency_hz"), [30.5, 31.0, 32.0], atol=0.2)


def test_a_counter_that_fails_between_laser_and_tape_is_reached_again(tmp_path, monkeypatch):
    calls = []

    def prepare(session, gate_s=None):
        calls.append(len(calls))
        if len(calls) == 3:  # the first two are for the drive to take hold, and after that
            raise NoAnswer(session.bench.address("counter"), "*OPC?", 1.0)
        prepare_counter(session, gate_s)

    monkeypatch.setattr("levilab.acquisition.counting.prepare_counter", prepare)
    run = acquire(request(tmp_path, Wobbling(SpinScene(), VirtualClock())), Silent())
    assert run.count() == 3
    assert len(texts(run, "found again")) == 1


def test_a_sweep_whose_time_is_over_says_so_once(tmp_path):
    run = acquire(request(tmp_path, Wobbling(SpinScene(), VirtualClock()), longest_s=20.0), Silent())
    assert 0 < run.count() < 3
    assert len(texts(run, "longest")) == 1


def test_a_counter_with_one_input_has_its_cable_changed_at_each_point(tmp_path):
    run = acquire(request(tmp_path, Wobbling(SpinScene(), VirtualClock()), laser_input=1), Silent())
    assert run.count() == 3
    there, back = "in place of the tape's", "the tape's phototransistor"
    tasks = texts(run, "asked the person")
    assert [next(words for words in (there, back) if words in text) for text in tasks] == 3 * [there, back]


def test_a_beam_that_is_never_cut_ends_the_sweep_in_one_line(tmp_path):
    with pytest.raises(ExperimentFailed, match=r"no laser pulses at 0.65 V, input 2: .*laser_trigger_level_v"):
        acquire(request(tmp_path, SpinWorld(SpinScene(), VirtualClock())), Silent())
    run = kept(tmp_path)
    assert run.status == "failed"
    assert run.record.instruments["generator"]["settings_end"]["output"] is False


def test_a_sweep_that_holds_the_top_nowhere_has_failed(tmp_path):
    below = (18.0, 18.5, 19.0)  # the top of this world falls at 21.65 Hz
    with pytest.raises(ExperimentFailed, match=r"held at no point of the sweep: choose points at which it floats"):
        acquire(request(tmp_path, Wobbling(SpinScene(), VirtualClock()), frequencies_hz=below), Silent())
    run = kept(tmp_path)
    assert run.status == "failed"
    assert len(texts(run, "left out")) == 3


class MissedAt31(Wobbling):
    """The stem misses the beam where the drive is at 31 Hz."""

    def laser(self, start, step, n):
        spin, _ = self.motion(np.array([start]))
        seen = super().laser(start, step, n)
        return np.zeros_like(seen) if abs(spin[0] / (2 * np.pi) - 31) < 0.2 else seen


def test_a_point_at_which_the_beam_is_hardly_cut_is_left_out(tmp_path):
    show = Silent()
    run = acquire(request(tmp_path, MissedAt31(SpinScene(), VirtualClock())), show)
    assert run.status == "finished"
    assert run.readings().column("drive_frequency_hz").tolist() == [30.5, 32.0]
    (said,) = texts(run, "left out")
    assert said in show.messages
    assert re.search(r"31 Hz is left out: the laser was counted in 0 of 3 gates .*, 3 are needed: move the beam", said)
    assert not texts(run, "lock lost")
    assert len(texts(run, "drive on")) == 1


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("frequencies_hz = [30, 31]", "at least three drive frequencies"),
        ("step_hz = 0.001", "a sweep of 16001 points is more than 1000"),
        ("step_hz = 20", "at least three drive frequencies"),
        ("frequencies_hz = [30, 31, 200]", "precession.frequencies_hz = 200 is more than this bench allows"),
        ("counts = 2", "counts"),
        ("laser_input = 1", "no person who could change the counter's cable"),
        ("laser_input = 3", "laser_input"),
    ],
)
def test_what_is_no_sweep_costs_one_line(tmp_path, table, said):
    (tmp_path / "bench.toml").write_text(f"[precession]\n{table}\n", encoding="utf-8")
    ended = command("acquire", "precession", "--mock", "--bench", "bench.toml", cwd=tmp_path)
    assert ended.status == 1
    (line,) = [line for line in ended.err.splitlines() if not line.startswith(("compiling", "compiled"))]
    assert said in line


def test_the_time_left_of_a_sweep_is_that_of_its_way_and_of_its_holds():
    settings = PrecessionSettings(first_hz=34.0, last_hz=30.0, step_hz=2.0, ramp_hz_per_s=0.2)
    faster = settings.model_copy(update={"ramp_hz_per_s": 0.4})
    assert _time_left(settings, 0) - _time_left(faster, 0) == pytest.approx((34.0 - 30.0) / 0.2 / 2)
    assert _time_left(settings, 3) == 0.0
