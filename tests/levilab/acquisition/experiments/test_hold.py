"""A held spin on the virtual bench: its scatter, and the drag that the amplitude balances."""

import math
from dataclasses import replace

import numpy as np
import pytest

from instruments.clock import VirtualClock
from levilab.acquisition.driving import drive_off
from levilab.acquisition.experiments import hold
from levilab.acquisition.loop import acquire
from levilab.acquisition.session import DidNotFollow, NotHeld
from levilab.acquisition.triggering import Motor
from levilab.errors import UsageError
from levilab.runs.run import Run
from levilab.world.spin_world import SpinWorld, random_scene
from support.acquisitions import Impatient, Meanwhile, Silent, acquired, asked, events, in_world, texts


def held(out, seed, *settings, **more):
    return acquired("hold", out=out, seed=seed, settings=settings, **more)


def drag_at(seed, spin):
    """The deceleration of the top of this seed by the disc law [Hz/s]."""
    (c,) = random_scene(seed).constants
    return c * (2 * math.pi * spin) ** 1.5 / (2 * math.pi)


def test_a_spin_is_held_and_its_amplitude_gives_the_drag(tmp_path):
    pulls = []
    for seed in range(2):
        run = held(tmp_path, seed, "hold.longest_s=200")
        spins = run.readings().column("spin_frequency_hz")
        assert spins.size >= 15
        assert np.abs(spins - 45.0).max() < 0.06  # 0.01 Hz is the scatter of a reading
        assert np.median(run.readings().column("spin_frequency_u_hz")) < 0.015  # 0.03 Hz of a count, ten counts
        (text,) = events(run, "held")
        assert text["scatter_hz"] == pytest.approx(spins.std(ddof=1))
        assert text["drag_u_hz_per_s"] < 0.006
        pulls.append((text["drag_hz_per_s"] - drag_at(seed, 45.0)) / text["drag_u_hz_per_s"])
        assert run.record.instruments["generator"]["settings_end"]["output"] is False
    assert abs(np.mean(pulls)) < 2.0
    assert np.abs(pulls).max() < 5.0


def test_an_interrupted_hold_goes_on(tmp_path):
    first = held(tmp_path, 3, "hold.longest_s=120", show=Impatient(3))
    assert (first.status, first.count()) == ("interrupted", 3)
    assert first.record.instruments["generator"]["settings_end"]["output"] is False
    whole = held(tmp_path, None, resume=first.folder)
    assert whole.status == "finished"
    assert np.all(np.diff(whole.readings().column("time_s")) > 0)
    assert whole.readings().column("spin_frequency_hz")[-1] == pytest.approx(45.0, abs=0.1)


class Unplugged(SpinWorld):
    """The cable to the trigger input is off from a time on, for a while; the generator's outputs are kept."""

    off = (math.inf, math.inf)

    def drive(self, time, output):
        self.last = output
        super().drive(time, output)

    def _triggered_acceleration(self, spin):
        begin, end = self.off
        plugged = not begin <= self._stretches.last.start < end
        return (
            super()._triggered_acceleration(spin)
            if plugged
            else -spin * float(self._decay.damping(spin, *self.scene.constants))
        )


def unplugged(out, lasts):
    world = Unplugged(replace(random_scene(3), start_hz=40.0), VirtualClock())

    def pull_out():
        world.off = (world.clock.now(), world.clock.now() + lasts)

    request = asked("hold", out=out, settings=("hold.longest_s=150",))
    return in_world(request, world), Meanwhile(3, pull_out), world


@pytest.mark.parametrize(("lasts", "dips"), [(1.0, 0.0), (5.0, 0.2)])
def test_pulses_that_do_not_come_for_seconds_cost_some_spin_alone(tmp_path, lasts, dips):
    request, show, world = unplugged(tmp_path, lasts)
    run = acquire(request, show)
    assert run.status == "finished"
    spins = run.readings().column("spin_frequency_hz")
    assert spins[2:5].min() < 45.0 - dips  # mean over 10 s of a spin that falls by 0.18 Hz/s in between
    assert spins[-1] == pytest.approx(45.0, abs=0.05)
    assert not events(run, "not held")
    assert not world.last.triggered


def test_a_cable_that_comes_off_ends_a_hold_with_its_reason(tmp_path):
    request, show, world = unplugged(tmp_path, 1e4)
    with pytest.raises(DidNotFollow, match=r"the bursts do not turn the top.*cable"):
        acquire(request, show)
    (run,) = (Run.load(folder) for folder in tmp_path.iterdir())
    assert (run.status, world.last.triggered, world.last.amplitude) == ("failed", None, 0.0)
    spins = run.readings().column("spin_frequency_hz")
    assert spins.size >= 3
    assert np.abs(spins - 45.0).max() < 1.0  # none of a top that is held no more
    assert texts(run, "not held")[0].startswith("the top was lost")


def test_a_top_lost_while_the_loop_settles_is_brought_up_again(tmp_path, monkeypatch):
    lost = []

    def lose(motor, target, before=Motor.measure_gain):
        if not lost:
            lost.append(target)
            raise NotHeld(None, target)
        before(motor, target)

    off = []
    monkeypatch.setattr(Motor, "measure_gain", lose)
    monkeypatch.setattr(hold, "drive_off", lambda session: (off.append(session), drive_off(session)))
    run = held(tmp_path, 3, "hold.longest_s=60")
    assert (run.status, len(lost)) == ("finished", 1)
    assert len(off) == 2  # after the loss, and at the end
    off = [event["kind"] for event in run.events()].index("not held")
    assert "drive on" in [event["kind"] for event in run.events()][off:]


def test_the_gain_of_a_hard_drive_is_seen_near_the_held_spin(tmp_path):
    scene = random_scene(3)
    world = SpinWorld(replace(scene, lock_torque=3 * scene.lock_torque), VirtualClock())
    settings = ("hold.longest_s=40", "hold.drive_frequency_hz=28")
    run = acquire(in_world(asked("hold", out=tmp_path, settings=settings), world), Silent())
    gains = [np.array(event["spins_hz"]) for event in events(run, "gain measured")]
    assert len(gains) == 2
    assert all(np.ptp(spins) < 4.5 for spins in gains)  # 3 Hz, and a count of 1 Hz/s at the ends; ten would be 9 Hz
    assert all(abs(spins.mean() - 28.0) < 0.6 for spins in gains)


def test_two_readings_show_neither_a_scatter_nor_a_drag(tmp_path):
    run = held(tmp_path, 3, "hold.longest_s=15")
    assert (run.status, run.count()) == ("finished", 2)
    assert not events(run, "held")
    (ended,) = texts(run, "ended")
    assert ended.endswith("3 are needed: hold the spin longer (hold.longest_s)")


def test_a_long_hold_does_not_drift(tmp_path):
    run = held(tmp_path, 3, "hold.longest_s=600", "hold.interval_s=60")
    spins, volts = run.readings().column("spin_frequency_hz"), run.readings().column("drive_amplitude_v")
    # the sum of the errors is bounded: 0.03 Hz of a count, 10 s of the loop; in five minutes 1 mHz
    assert spins[5:].mean() == pytest.approx(45.0, abs=3e-3)
    assert volts[5:].mean() == pytest.approx(volts[:5].mean(), rel=0.015)


def test_a_faster_top_is_braked_to_its_spin_and_held(tmp_path):
    world = SpinWorld(replace(random_scene(3), start_hz=40.0), VirtualClock())
    settings = ("hold.longest_s=60", "hold.drive_frequency_hz=35")
    request = asked("hold", out=tmp_path, settings=settings)
    run = acquire(in_world(request, world), Silent())
    assert run.readings().column("spin_frequency_hz") == pytest.approx(35.0, abs=0.1)


def test_a_hold_is_triggered_and_nothing_else(tmp_path):
    with pytest.raises(UsageError, match="triggered is expected"):
        held(tmp_path, 1, "hold.drive=ramp")
