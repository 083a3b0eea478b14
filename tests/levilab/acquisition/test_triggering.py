"""A drive that the top triggers, on the virtual bench: to a spin from any other, and every way out."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.errors import NoAnswer
from instruments.virtual.generator.channel import Output, Triggered
from levilab.acquisition import triggering
from levilab.acquisition.experiments.spin import SpinSettings
from levilab.acquisition.loop import acquire
from levilab.acquisition.session import DidNotFollow, NotHeld
from levilab.acquisition.triggering import CYCLE, Motor, response, slope_of
from levilab.bench.bench import open_bench
from levilab.bench.config import BenchConfig, ConfigError, InstrumentSettings
from levilab.errors import UsageError
from levilab.runs.run import Run
from levilab.world.bench import virtual_wiring
from levilab.world.bursts import TriggerWire, mean_pull
from levilab.world.spin_world import SpinScene, SpinWorld, random_scene
from support.acquisitions import Impatient, Silent, acquired, asked, events, of_scene

TRIGGERED = SpinSettings(drive="triggered", drive_frequency_hz=34.0, hold_s=10.0, longest_s=60.0)
SCENE = SpinScene(moment_turns=0.3)


class Watched(SpinWorld):
    """Keeps what the generator has put out."""

    def drive(self, time, output):
        self.outputs = [*getattr(self, "outputs", []), output]
        super().drive(time, output)

    @property
    def is_off(self):
        return not (self.outputs[-1].triggered or self.outputs[-1].amplitude)


def at(out, scene=SCENE, settings=TRIGGERED):
    """The request for a spin-down after a triggered drive, and its world."""
    world = Watched(scene, VirtualClock())
    request = of_scene(out, scene, settings)
    return replace(request, wiring=lambda: virtual_wiring(world, request.config.limits)), world


def best_phase(scene, spin):
    """The start phase with the greatest pull [°]."""
    place = scene.moment_turns + scene.tape.offset(scene.trigger.thresholds(rising=True), spin)
    bursts = Triggered(1.0, 1, rising=True, delay=0.0, jitter=0.0)
    pulls = [
        mean_pull(Output("SIN", CYCLE * spin, 0.0, 0.0, phase=phase, triggered=bursts), spin, place)
        for phase in range(360)
    ]
    return int(np.argmax(pulls))


@pytest.mark.parametrize("turns", [0.0, 0.3, 0.8])
def test_the_top_is_driven_up_wherever_the_tape_is_and_spins_down_freely(tmp_path, turns):
    scene = replace(SCENE, moment_turns=turns)
    request, world = at(tmp_path, scene)
    run = acquire(request, Silent())
    assert run.status == "finished"
    (found,) = events(run, "phase found")
    off = (found["phase_deg"] - best_phase(scene, 30.0) + 180) % 360 - 180
    assert abs(off) < 20.0  # 5° is its u, and the spin curves within a trial
    assert events(run, "locked")[0]["frequency_hz"] == pytest.approx(34.0, abs=1.5)
    spins = run.readings().column("spin_frequency_hz")
    assert spins[0] == pytest.approx(34.0, abs=0.3)  # let go after 10 s of hold
    assert np.all(np.diff(spins) < 0)
    assert run.record.configuration["spin"]["drive"] == "triggered"
    assert run.record.configuration["spin"]["drive_frequency_hz"] == 34.0
    assert run.record.instruments["generator"]["settings_end"]["output"] is False
    assert world.is_off


@pytest.mark.parametrize("changed", [{"start_hz": 25.5}, {"jitter": 0.1}])  # 0.28 Hz a count of 0.5 s: 1 s is needed
def test_a_slow_top_and_one_that_scatters_survive_the_search(tmp_path, changed):
    request, _ = at(tmp_path, replace(SCENE, **changed))
    assert acquire(request, Silent()).status == "finished"


def test_pulses_that_are_lost_cost_pull_and_nothing_else(tmp_path):
    request, _ = at(tmp_path, replace(SCENE, trigger=TriggerWire(lost=0.2)))
    run = acquire(request, Silent())
    assert run.readings().column("spin_frequency_hz")[0] == pytest.approx(34.0, abs=0.3)
    assert events(run, "phase found")[0]["pull_hz_per_s"] == pytest.approx(0.8 * 0.36, abs=0.12)


@pytest.mark.parametrize(
    ("scene", "settings", "says"),
    [
        (replace(SCENE, trigger=None), {}, "the bursts do not turn the top.*cable"),
        (replace(SCENE, trigger=TriggerWire(level_v=2.5)), {}, "the bursts do not turn the top.*TTL"),
        (replace(SCENE, jitter=0.2), {}, r"scatter by \d\.\d\d Hz, which hides a pull.*another counter"),
        (SCENE, {"drive_frequency_hz": 60.0, "drive_amplitude_vpp": 5.0}, "gets no faster: pull and drag are equal"),
        (random_scene(3), {"drive_frequency_hz": 80.0}, r"spins at (69|70)\.\d\d Hz and gets no faster"),
    ],
    ids=["cable off", "no edges", "too noisy", "too weak", "at its greatest spin"],
)
def test_a_drive_that_cannot_says_why_with_the_output_off_and_the_run_kept(tmp_path, scene, settings, says):
    request, world = at(tmp_path, scene, TRIGGERED.model_copy(update=settings))
    with pytest.raises(DidNotFollow, match=says):
        acquire(request, Silent())
    assert world.is_off
    (folder,) = tmp_path.iterdir()
    assert Run.load(folder).status == "failed"


def test_a_top_taken_away_is_noticed_and_the_output_goes_off(tmp_path):
    request, world = at(tmp_path)
    world.scene = replace(world.scene, fall_hz=31.0)  # on the way
    with pytest.raises(DidNotFollow, match="no top seen under a drive"):
        acquire(request, Silent())
    assert world.is_off


def test_a_generator_that_fails_under_the_drive_is_reached_again(tmp_path, monkeypatch):
    lost = []

    def fail(motor, share, before=Motor._set_share):
        if not lost:
            lost.append(share)
            raise NoAnswer(motor.session.bench.address("generator"), "VOLT 5", 1.0)
        before(motor, share)

    monkeypatch.setattr(Motor, "_set_share", fail)
    request, world = at(tmp_path)
    run = acquire(request, Silent())
    assert len(events(run, "found again")) == 1
    assert run.readings().column("spin_frequency_hz")[0] == pytest.approx(34.0, abs=0.5)
    assert world.is_off


def test_bursts_that_a_killed_program_left_on_are_ended_by_the_next_one():
    world = Watched(SCENE, VirtualClock())
    wiring = virtual_wiring(world)
    with open_bench(wiring, ("generator",)) as bench:
        bench.generator.prepare_triggered(waveform="SIN", frequency_hz=33.0, amplitude_vpp=10.0, phase_deg=0.0)
        bench.generator.output = True
        assert bench.trigger == "rising"
        bench.outputs_off = lambda: None  # killed
    assert not world.is_off
    with open_bench(wiring, ("generator",)):
        assert world.is_off


# --- the parts ---


def test_the_answer_to_three_phases_is_a_cosine():
    rng = np.random.default_rng(1)
    truth, pull, drag, u = 77.0, 0.36, 0.1, 0.03
    phases = np.radians([0.0, 120.0, 240.0])
    found = [
        response(pull * np.cos(phases - math.radians(truth)) - drag + u * rng.standard_normal(3), u) for _ in range(400)
    ]
    # 3 standard errors of a standard deviation from 400
    assert np.std([(one.pull - pull) / one.u for one in found]) == pytest.approx(1.0, abs=0.12)
    assert np.mean([one.phase for one in found]) == pytest.approx(truth, abs=1.0)
    assert np.mean([one.drag for one in found]) == pytest.approx(drag, abs=0.005)


def test_a_slope_has_the_scatter_about_its_line():
    assert slope_of([0.0, 1.0, 2.0, 3.0], [1.0, 3.0, 5.0, 7.0]) == pytest.approx((2.0, 0.0, math.sqrt(5)), abs=1e-9)
    assert slope_of([0.0, 1.0, 2.0, 3.0], [0.1, -0.1, -0.1, 0.1])[1] == pytest.approx(0.1 * math.sqrt(2))


def counted(monkeypatch, *counts):
    """A motor at 30 Hz whose counter counts this, and the frequencies of its cycles."""
    set_to = []

    class Generator:
        def __setattr__(self, name, value):
            set_to.append((name, value))

    left = iter(counts)
    monkeypatch.setattr(triggering, "spin_now", lambda *_: next(left))
    session = SimpleNamespace(
        stop=SimpleNamespace(check=lambda: None),
        bench=SimpleNamespace(generator=Generator()),
        settings=SimpleNamespace(gate_s=1.0),
    )
    return Motor(session, 30.0, phase=0.0, pull=0.36), set_to


def test_a_doubled_count_does_not_move_the_cycle_and_three_end_it(monkeypatch):
    motor, set_to = counted(monkeypatch, 60.1, None, 30.2, 15.1, 30.4, 60.0, 60.0, 60.0)
    assert [motor.count() for _ in range(7)] == [30.0, 30.0, 30.2, 30.2, 30.4, 30.4, 30.4]
    assert set_to == [("frequency", pytest.approx(CYCLE * spin)) for spin in (30.2, 30.4)]
    with pytest.raises(NotHeld, match=r"a spin of 60\.00 Hz"):
        motor.count()


def noiseless(monkeypatch, spin, resonance=0.0):
    """A motor whose top has neither noise nor wobble: a count is the mean over its gate, of 1 s."""
    session = counted(monkeypatch)[0].session
    top = session.bench.generator = SimpleNamespace(spin=spin, time=0.0, amplitude=10.0, before=10.0, burst_phase=0.0)
    session.event = lambda *_, **__: None
    session.now, session.progress, session.settings.drive_amplitude_vpp = lambda: top.time, lambda *_: None, 10.0

    def count(*_):
        amplitude, top.before = (top.before + top.amplitude) / 2, top.amplitude  # it changes in the middle of a gate
        pull = 0.036 * amplitude / (1 - (resonance / top.spin) ** 2)
        rate = pull * math.cos(math.radians(top.burst_phase)) - 0.184 * (top.spin / 45) ** 1.5
        top.spin, top.time = top.spin + rate, top.time + 1
        return top.spin - rate / 2

    monkeypatch.setattr(triggering, "spin_now", count)
    return Motor(session, spin, phase=0.0, pull=0.36)


@pytest.mark.parametrize("start", [41.0, 49.0])
def test_a_top_comes_to_its_spin_and_its_gain_is_that_there(monkeypatch, start):
    motor = noiseless(monkeypatch, start)
    motor.go_to(45.0)
    motor.hold(45.0, 60.0)
    assert np.abs(np.array(motor.counts[20:]) - 45.0).max() < 0.2  # 0.33 from a guess of the share
    motor.measure_gain(45.0)
    ((times, spins),) = motor.gains
    assert slope_of(times, spins)[0] == pytest.approx(0.36 - 0.184, rel=0.01)  # 3 % less at 46 Hz


@pytest.mark.parametrize(("start", "target"), [(30.0, 45.0), (30.0, 60.0), (45.0, 33.0)])
def test_the_loop_learns_how_the_pull_of_a_top_that_leans_changes(monkeypatch, start, target):
    motor = noiseless(monkeypatch, start, resonance=21.56)
    monkeypatch.setattr(triggering, "prepare_counter_again", lambda *_: None)
    motor.session.event = lambda *_, **__: None
    motor.find_phase()
    motor.go_to(target)
    motor.hold(target, 40.0)
    # from 30 to 45 Hz it falls by 37 %; the loss by the mean of trials of 3 s is that good
    assert motor.pull == pytest.approx(0.36 / (1 - (21.56 / target) ** 2), rel=0.15)
    assert np.abs(np.array(motor.counts[20:]) - target).max() < 0.1  # 0.2 to 0.35 with the pull at the start
    motor.measure_gain(target)
    assert motor.pull == pytest.approx(0.36 / (1 - (21.56 / target) ** 2), rel=0.05)


def test_a_top_that_is_held_by_nearly_all_of_the_amplitude_shows_no_gain(monkeypatch):
    motor = noiseless(monkeypatch, 45.0)
    motor.share = 0.95
    motor.measure_gain(45.0)
    assert (motor.gains, motor.session.now()) == ([], 0.0)


def test_the_cycle_is_set_for_the_spin_in_the_middle_of_the_next_count(monkeypatch):
    motor, set_to = counted(monkeypatch, 30.2)
    motor._trend = 0.4
    motor.count()
    assert set_to == [("frequency", pytest.approx(CYCLE * (30.2 + 0.4)))]


def test_a_trial_that_brakes_ends_before_the_top_falls(monkeypatch):
    motor, least = noiseless(monkeypatch, 30.0), []
    monkeypatch.setattr(triggering, "prepare_counter_again", lambda *_: None)
    motor.session.event = lambda *_, **__: None
    motor.pull, motor.session.progress = 0.36, lambda *_: least.append(motor.session.bench.generator.spin)
    motor.session.bench.generator.amplitude = motor.session.bench.generator.before = 30.0  # 1 Hz/s
    motor.find_phase()
    assert math.cos(math.radians(motor.phase)) == pytest.approx(1.0, abs=1e-3)
    assert least[1] - motor.spin < 5.0  # two trials that brake by 0.67 Hz/s: three counts each; 8 Hz with six


@pytest.mark.parametrize("edge", ["rising", "falling"])
def test_the_bursts_start_at_the_edge_and_the_phase_that_were_stated(tmp_path, edge):
    phase = float(best_phase(SCENE, 30.0))
    request, world = at(tmp_path, SCENE, TRIGGERED.model_copy(update={"drive_phase_deg": phase, "hold_s": 0.0}))
    wiring = request.wiring()
    generator = wiring.instruments["generator"].model_copy(update={"trigger": edge})
    wired = replace(wiring, instruments=wiring.instruments | {"generator": generator})
    run = acquire(replace(request, wiring=lambda: wired), Impatient(1))
    first = next(output for output in world.outputs if output.triggered)
    assert (first.phase, first.triggered.rising) == (phase, edge == "rising")
    assert not events(run, "phase found")


# --- what a bench allows ---


def test_a_bench_without_the_wire_has_no_triggered_drive():
    generator = InstrumentSettings(model="33500B", address="TCPIP::1::INSTR")
    with pytest.raises(ConfigError, match=r"wire.*trigger input.*generator\.trigger = \"rising\""):
        TRIGGERED.for_bench(BenchConfig(generator=generator), lambda _: None)
    wired = BenchConfig(generator=generator.model_copy(update={"trigger": "falling"}))
    assert TRIGGERED.for_bench(wired, lambda _: None) == TRIGGERED


@pytest.mark.parametrize(
    ("experiment", "settings", "says"),
    [
        ("spin", ("spin.drive_frequency_hz=95",), r"1\.1 times as fast.*limits\.drive_frequency_hz = 100"),
        ("spin", ("spin.drive_waveform=NONE",), "a triggered drive has cycles"),
        ("precession", (), "ramp is expected"),
    ],
)
def test_what_a_triggered_drive_cannot_do_is_refused_at_once(tmp_path, experiment, settings, says):
    with pytest.raises(UsageError, match=says):
        asked(experiment, out=tmp_path, settings=(f"{experiment}.drive=triggered", *settings))


def test_a_top_in_full_motion_triggers_its_drive_too(tmp_path):
    settings = ("drive=triggered", "drive_frequency_hz=32", "hold_s=30", "longest_s=20")
    run = acquired("spin", out=tmp_path, scene="spindown", seed=3, settings=settings)
    assert run.status == "finished"
    assert run.readings().column("spin_frequency_hz")[0] == pytest.approx(32.0, abs=0.4)  # 0.14 too fast still
    assert events(run, "phase found")[0]["pull_hz_per_s"] == pytest.approx(0.71, abs=0.12)  # 4 u; 0.34 of a fixed axis
