"""A sweep of the drive, by a plain experiment: a point that fails is recorded, and the sweep goes on."""

import math
import signal
from dataclasses import replace
from types import SimpleNamespace

import pytest

from analysis.locked import Slip
from instruments.clock import VirtualClock
from instruments.errors import NoAnswer
from levilab.acquisition.counting import prepare_counter
from levilab.acquisition.driving import (
    DriveSettings,
    _hold,
    _ramp_end,
    has_drifted,
    held_spin,
    slip_as_text,
    sweep_drive,
)
from levilab.acquisition.experiment import Experiment
from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.session import NotHeld
from levilab.acquisition.table import EXPERIMENTS, Configuration, with_settings
from levilab.interruption import Interrupted, Stop
from levilab.runs.channel import Channel
from levilab.world.bench import virtual_wiring
from levilab.world.spin_world import Phase, SpinScene, SpinWorld
from support.acquisitions import Silent, events, texts

CHANNELS = (Channel("time_s", "s", "bench clock"), Channel("drive_frequency_hz", "Hz", "generator"))
#: Up to 30 Hz, where the top of a SpinScene begins, and on in quick steps; a top that has lost its lock is soon down.
SETTINGS = DriveSettings(drive_frequency_hz=30.0, ramp_hz_per_s=0.25, hold_s=0.0, gate_s=0.5, longest_s=20_000.0)
SCENE = SpinScene(fall_hz=24.0)


def swept(out, monkeypatch, points, at_point=lambda _, __: None):
    """A sweep that keeps a row a point, in the place of the experiment `precession`."""

    def run(session):
        def measure(drive):
            at_point(session, drive)
            held_spin(session, drive)
            session.keep({"time_s": session.now(), "drive_frequency_hz": drive}, 0.0)

        prepare_counter(session)
        session.begin(lambda: None)
        sweep_drive(session, points, measure)

    row = Experiment("precession", "a sweep", ("counter", "generator"), DriveSettings, lambda _: CHANNELS, run)
    monkeypatch.setitem(EXPERIMENTS, "precession", row)
    config = with_settings(Configuration(), "precession", SETTINGS)
    world = SpinWorld(SCENE, VirtualClock())
    wiring = virtual_wiring(world, config.limits)
    request = AcquisitionRequest("precession", config, lambda: wiring, out=out, synthetic_how="a test")
    return acquire(request, Silent())


def measured(run):
    return run.readings().column("drive_frequency_hz").tolist()


@pytest.mark.parametrize(("speed", "says"), [(1.0, ", 40.00 Hz in 3:20 min"), (math.inf, "")])
def test_a_ramp_that_a_person_waits_for_says_when_it_ends(speed, says):
    session = SimpleNamespace(bench=SimpleNamespace(clock=SimpleNamespace(speed=speed)))
    assert _ramp_end(session, 40.0, 200.0) == says
    assert _ramp_end(session, 40.0, 0.0) == ""


def test_a_point_that_fails_is_recorded_and_the_sweep_goes_on(tmp_path, monkeypatch):
    """The drive comes back to 31 Hz, which held the top last, not to 30 Hz, where it began."""

    def lose(_, drive):
        if drive == 32.0:
            raise NotHeld(31.2, drive)

    run = swept(tmp_path, monkeypatch, [31.0, 32.0, 33.0], lose)
    assert (run.status, measured(run)) == ("finished", [31.0, 33.0])
    assert "try 2 of 2" in texts(run, "lock lost")[1]
    (left_out,) = texts(run, "left out")
    assert left_out == "the point of 32 Hz is left out: a spin of 31.20 Hz under a drive of 32.00 Hz"
    locked = [event["frequency_hz"] for event in events(run, "locked")]
    assert locked == pytest.approx([30.0, 31.0, 31.0], abs=0.2)  # 0.06 Hz of noise
    at = "the top follows the drive at "  # where the drive is, and what was counted
    assert [text.split(":")[0] for text in texts(run, "locked")] == [f"{at}{hz}.00 Hz" for hz in (30, 31, 31)]
    assert run.record.instruments["generator"]["settings_end"]["output"] is False


def test_a_top_that_falls_is_asked_for_and_the_sweep_goes_on(tmp_path, monkeypatch):
    """At the first try of 31.5 Hz the drive is too weak, and the top falls while it is tried to take it up again."""
    weak = []

    def weaken(session, drive):
        if drive == 31.5 and not weak:
            weak.append(drive)
            session.bench.outputs_off()
            session.wait(120.0)  # from 31.5 to below 24 Hz takes 90 s

    run = swept(tmp_path, monkeypatch, [31.0, 31.5, 32.0], weaken)
    assert (run.status, measured(run), texts(run, "left out")) == ("finished", [31.0, 31.5, 32.0], [])
    assert len(texts(run, "asked the person")) == 1
    assert "no top seen under a drive of 31.50 Hz; try 1 of 2" in texts(run, "lock lost")[0]


def test_a_top_that_no_drive_takes_up_again_ends_the_sweep_with_what_was_measured(tmp_path, monkeypatch):
    """DidNotFollow costs tries of points, as a lost lock does."""

    def forbid(session, drive):
        if drive > 31.0:
            session.bench.generator.off()
            monkeypatch.setattr(
                SpinWorld, "_lock", lambda world, now, *_: world._append(replace(now, phase=Phase.COASTING))
            )
            session.wait(20.0)  # 2 Hz

    run = swept(tmp_path, monkeypatch, [31.0, 31.5, 32.0, 32.5, 33.0], forbid)
    assert (run.status, measured(run)) == ("finished", [31.0])
    left_out = events(run, "left out")
    assert [event["drive_frequency_hz"] for event in left_out] == [31.5, 32.0, 32.5]
    assert all("did not follow the drive to 31 Hz" in event["text"] for event in left_out)
    assert texts(run, "ended")[0].endswith("the sweep ends here; not tried: 33 Hz")


def test_a_generator_that_fails_on_the_way_costs_no_point(tmp_path, monkeypatch):
    lost = []

    def fail(session, drive):
        if drive == 31.5 and not lost:
            lost.append(drive)
            raise NoAnswer(session.bench.address("generator"), "OUTP1?", 1.0)

    run = swept(tmp_path, monkeypatch, [31.0, 31.5], fail)
    assert (measured(run), texts(run, "left out")) == ([31.0, 31.5], [])
    assert len(texts(run, "found again")) == 1
    assert texts(run, "lock lost") == []


@pytest.mark.parametrize(
    ("counts", "drifts"),
    [
        ([30.0 + 0.03 * (-1) ** k for k in range(20)], False),
        ([29.83 + 0.03 * (-1) ** k for k in range(20)], False),  # a tape that slips does so from the first count on
        ([30.0 + 0.3 * math.sin(2 * math.pi * 0.21 * k) for k in range(20)], False),  # swings about the drive
        ([30.0 - 0.1 * max(k - 11, 0) for k in range(20)], True),  # lost after 11 s: the air takes 0.1 Hz/s
        ([30.0, 29.0], False),
        ([30.0, 30.0, 29.8, 29.8], False),  # two in a half tell too little of their scatter
        ([30.0, 30.0, 30.0, 29.8, 29.8, 29.8], True),
    ],
)
def test_counts_of_a_top_that_was_lost_drift_off(counts, drifts):
    assert has_drifted(counts) is drifts


def test_a_top_lost_while_it_is_held_is_not_compared_with_its_drive(monkeypatch):
    """It is within 1 Hz of the drive to the end of the hold, as a tape that slips is."""
    said = []
    counts = iter([30.0 - 0.1 * max(k - 11, 0) for k in range(20)])
    monkeypatch.setattr("levilab.acquisition.driving.held_spin", lambda *_: next(counts))
    session = SimpleNamespace(
        settings=DriveSettings(hold_s=20.0, gate_s=1.0),
        progress=lambda *_: None,
        event=lambda *texts, **_: said.append(texts[1]),
        warn=said.append,
        stop=Stop(),
    )
    with pytest.raises(NotHeld, match=r"a spin of 29.20 Hz under a drive of 30.00 Hz"):
        _hold(session, 30.0)
    assert said == []


@pytest.mark.parametrize(("second", "slips"), [(30.0, False), (29.95, True)])
def test_a_top_that_turns_over_once_against_the_drive_has_no_loose_washers(monkeypatch, second, slips):
    """One turn behind in 20 s is 0.05 Hz; a tape that slips is as far behind in the next 20 s."""
    warned = []
    counts = iter([spin + 0.03 * (-1) ** k for spin in (29.95, second) for k in range(20)])
    monkeypatch.setattr("levilab.acquisition.driving.held_spin", lambda *_: next(counts))
    settings = DriveSettings(hold_s=20.0, gate_s=1.0)
    session = SimpleNamespace(
        settings=settings, progress=lambda *_: None, event=lambda *_, **__: None, warn=warned.append, stop=Stop()
    )
    _hold(session, 30.0)
    assert bool(warned) is slips
    assert next(counts, None) is None


def test_ctrl_c_ends_a_hold_after_the_count_under_way(monkeypatch):
    """Not after all of its counts, 20 s later, with the drive on."""
    stop, counts = Stop(), []

    def count(*_):
        counts.append(30.0)
        stop(signal.SIGINT, None)
        return 30.0

    monkeypatch.setattr("levilab.acquisition.driving.held_spin", count)
    session = SimpleNamespace(settings=DriveSettings(hold_s=20.0), progress=lambda *_: None, stop=stop)
    with pytest.raises(Interrupted):
        _hold(session, 30.0)
    assert len(counts) == 1


def test_a_tape_that_leads_its_drive_is_no_loose_washer():
    behind, ahead = (slip_as_text(Slip(spin, 30.0, u=0.02, least=0.02)) for spin in (29.83, 30.17))
    assert "the counter sees 29.83(2) Hz: LOOSE WASHERS, the tape slips by 0.17 Hz" in behind
    assert "no tape overtakes the drive" in ahead
    assert "LOOSE" not in ahead
