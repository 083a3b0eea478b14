"""A world in full motion: what it shows is the simulator's motion, however and in whatever order one looks at it."""

import gc
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.virtual.core.signal import crossings
from instruments.virtual.counter.edges import Thresholds
from instruments.virtual.generator.channel import Burst, Output, Triggered
from instruments.virtual.generator.voltage import fundamental
from levilab.acquisition.triggering import response
from levilab.errors import LeftRange, SimulationError
from levilab.simulator import SceneError, preset, simulate
from levilab.simulator.field import flux_density
from levilab.simulator.kernels.motion import L, N, R
from levilab.simulator.model import base_field
from levilab.simulator.parts import Top
from levilab.simulator.scene import presets
from levilab.simulator.start import start_of
from levilab.world.base import Base, Stand
from levilab.world.bursts import TriggerWire, mean_pull
from levilab.world.flight import RATE, Flight, _cubic
from levilab.world.light import Tape
from levilab.world.motion_world import MotionWorld

TURN = 2 * math.pi
TILTED = preset("tilted")
#: Falls after 0.4 s.
FALLING = preset("undriven").changed({"start.spin_hz": 15.0})
OFF = {"waveform": "off"}
SINE = {"waveform": "sine", "amplitude_t": 4e-4, "frequency_hz": 30.0, "phase_rad": 0.3}
#: A tape's place is interpolated to 1e-4 of a turn, and both ways have errors of 1e-7 rad at the end of a piece.
CLOSE = 2e-4


def apart(turns, others):
    """How far turns are from each other, whole turns not counted."""
    return np.abs((turns - others + 0.5) % 1.0 - 0.5)


def turns_of(flight, times):
    """Turns of the tape, and whether a top is up."""
    turns, rate, _ = flight.tape(times)
    return turns, rate != 0


def expected_turns(motion):
    """The tape's place from the motion, by another formula: the spot's direction in the top's frame."""
    to_spot = np.array([motion.scene.top.magnet_radius_m, 0.0]) - motion.position[:, :2]
    x, y = motion.states[:, 12], motion.states[:, 13]
    along = x * to_spot[:, 0] + y * to_spot[:, 1]
    across = to_spot[:, 0] * y - to_spot[:, 1] * x
    return np.angle(along + 1j * across) / TURN


#: Kernels are read from the disk where they lie there: how many the installer made, and those made beyond them.
INSTALLED_AND_USED = """
import gc
from numba.core.registry import CPUDispatcher
from instruments.clock import VirtualClock
from levilab.simulator import preset, simulate
from levilab.world.__main__ import compile_kernels
from levilab.world.motion_world import MotionWorld

def kernels():
    found = (one for one in gc.get_objects() if type(one) is CPUDispatcher)
    return {(one.py_func.__qualname__, types) for one in found for types in one.signatures}

compile_kernels(["undriven"])
installed = kernels()
simulate(preset("undriven"), 0.05)
MotionWorld(preset("undriven"), VirtualClock()).light(0.0, 1e-3, 10)
print(len(installed), kernels() - installed)
"""


def test_an_installer_compiles_the_kernels_that_the_bench_and_simulations_need():
    run = subprocess.run([sys.executable, "-c", INSTALLED_AND_USED], capture_output=True, text=True, check=True)
    count, missing = run.stdout.split(maxsplit=1)
    assert (int(count) > 3, missing.strip()) == (True, "set()")


def test_the_top_of_each_scene_flies_on_the_bench():
    for scene in map(preset, presets()):
        world = MotionWorld(scene.changed({"observed": "motion"}), VirtualClock())
        assert world.light(0.0, 1e-3, 10).size == 10


# --- the flight ---


def test_between_the_states_a_cubic_motion_is_itself():
    cubic = np.polynomial.Polynomial([1.0, -2.0, 3.0, -0.5])
    nodes, times = np.array([0.0, 0.5, 1.25, 3.0]), np.linspace(-0.2, 3.2, 69)
    values, rates = (each(nodes).astype(np.float32) for each in (cubic, cubic.deriv()))
    np.testing.assert_allclose(_cubic(times, nodes, values, rates), cubic(times), atol=1e-5)  # of numbers of 32 bits
    assert list(_cubic(times[:2], nodes[:1], values[:1], rates[:1])) == [1.0, 1.0]


def test_the_tape_turns_as_the_simulated_top_does():
    motion = simulate(TILTED, 3.3, tolerance=1e-9, rate=317.0)
    turns, up = turns_of(Flight(TILTED), motion.time)
    assert up.all()
    assert apart(turns, expected_turns(motion)).max() < CLOSE


def test_an_aligned_top_has_a_tape_too():
    scene = preset("friction")
    times = np.linspace(0.0, 2.0, 1000)
    turns = np.unwrap(turns_of(Flight(scene), times)[0], period=1.0)
    spin = simulate(scene, 2.0, rate=100.0)
    turned = np.trapezoid(spin.spin_hz, spin.time)
    # beside the spin: the wobble, three hundredths of a turn
    assert turns[-1] - turns[0] == pytest.approx(turned, abs=0.04)


def test_a_drive_that_goes_off_is_the_simulators_drive_that_goes_off():
    scene = preset("driven")
    flight = Flight(scene)
    drive = scene.drive
    flight.change(
        0.0,
        {
            "waveform": "sine",
            "amplitude_t": drive.amplitude_t,
            "frequency_hz": drive.frequency_hz,
            "phase_rad": drive.phase_rad,
        },
    )
    turns_of(flight, np.array([2.6]))  # an instrument has looked farther already
    flight.change(1.37, OFF)
    motion = simulate(scene.changed({"drive.off_s": 1.37}), 3.0, tolerance=1e-9, rate=311.0)
    turns, up = turns_of(flight, motion.time)
    assert up.all()
    assert apart(turns, expected_turns(motion)).max() < CLOSE
    undisturbed, _ = turns_of(Flight(scene), motion.time)
    assert apart(undisturbed, expected_turns(motion)).max() > 100 * CLOSE  # the drive was felt


@pytest.mark.parametrize("looks", [[], [0.2], [1.9, 0.4, 5.0], [1.0, 1.0]])
def test_what_is_seen_does_not_depend_on_who_has_looked_before(looks):
    times = np.linspace(0.0, 4.0, 1000)
    flight, other = Flight(TILTED), Flight(TILTED)
    for time in looks:
        turns_of(flight, np.array([time]))
    for one in (flight, other):
        one.change(1.0, SINE)
        one.change(2.5, SINE | {"frequency_hz": 30.2})
        one.change(2.5, OFF)
    np.testing.assert_array_equal(turns_of(flight, times)[0], turns_of(other, times)[0])


def test_a_top_that_falls_is_gone_at_the_moment_of_its_fall():
    fell = simulate(FALLING, 5.0).fell
    flight = Flight(FALLING)
    times = fell.time + np.array([-1e-5, 1e-5, 1.0, 1e6])
    assert turns_of(flight, times)[1].tolist() == [True, False, False, False]
    flight.change(fell.time + 5.0, SINE)  # no drive raises it
    assert not turns_of(flight, times + 10.0)[1].any()


def test_a_top_that_is_put_back_begins_anew_whatever_the_drive_does_meanwhile():
    fell = simulate(FALLING, 5.0).fell.time
    flight = Flight(FALLING, put_back_after_s=2.0)
    flight.change(fell + 1.0, SINE)
    flight.change(fell + 1.5, OFF)
    begins = fell + 2.0
    assert turns_of(flight, np.array([begins - 1e-5, begins + 1e-5]))[1].tolist() == [False, True]
    again = np.linspace(0.0, 0.9 * fell, 50)
    assert apart(turns_of(flight, begins + again)[0], turns_of(flight, again)[0]).max() < CLOSE
    # and again, as often as it falls
    assert turns_of(flight, np.array([3 * begins + 0.1, 50 * begins + 0.1]))[1].all()


def test_a_scene_without_motion_is_refused():
    with pytest.raises(SceneError, match="observed = spin"):
        Flight(preset("friction").changed({"observed": "spin"}))


def test_each_piece_is_simulated_once_at_the_step_that_its_drive_needs(monkeypatch):
    steps = []

    def count(*scene, **options):
        motion = simulate(*scene, **options)
        steps.append(motion.accuracy.step)
        return motion

    flight = Flight(TILTED)
    monkeypatch.setattr("levilab.world.flight.simulate", count)
    for begins, drive in ((0.0, OFF), (2.0, SINE | {"frequency_hz": 900.0}), (4.0, OFF)):
        flight.change(begins, drive)
        flight.simulate_until(begins + 1.5)
    assert len(steps) == 9  # two pieces of each drive, and the one that its change cuts off
    usual, fast, again = steps[2::3]
    assert fast < usual / 2
    assert again == pytest.approx(usual, rel=0.3)


# --- the drive of the bench ---


def world(scene=TILTED, **rest):
    return MotionWorld(scene, VirtualClock(), **rest)


def field_of(drive, times):
    """The field that the scene's drive makes, written down from its definition."""
    turns = drive["frequency_hz"] * times + drive["phase_rad"] / TURN
    shapes = {
        "sine": lambda: np.sin(TURN * turns),
        "square": lambda: np.where(turns % 1.0 < 0.5, 1.0, -1.0),
        "triangle": lambda: 2 / np.pi * np.arcsin(np.sin(TURN * turns)),
    }
    return drive["amplitude_t"] * shapes[drive["waveform"]]()


@pytest.mark.parametrize(
    "output",
    [
        Output("SIN", 30.0, 4e-4, 0.0),
        Output("SIN", 30.0, 4e-4, 0.0, phase=70.0),
        Output("SIN", 30.0, 4e-4, 0.0, inverted=True),
        Output("SQU", 30.0, 4e-4, 0.0),
        Output("SQU", 30.0, 4e-4, 0.0, phase=-20.0, inverted=True),
        Output("TRI", 30.0, 4e-4, 0.0),
        Output("RAMP", 30.0, 4e-4, 0.0, symmetry=0.5),
    ],
    ids=lambda output: f"{output.waveform} {output.phase:g}{' inverted' * output.inverted}",
)
def test_the_top_feels_the_field_that_the_scope_shows(output):
    top = world()
    felt = []
    top._flight.change = lambda time, drive: felt.append((time, drive))
    top.drive(1.234, output)
    top.drive(2.345, replace(output, frequency=31.7))
    for (start, drive), end in zip(felt, [2.345, 3.5], strict=True):
        times = np.linspace(start, end, 999)[1:-1]
        shown = np.array([top.coil_field(float(time), 0.0, 1)[0] for time in times])
        off = np.abs(shown - field_of(drive, times)) > 1e-9
        assert off.mean() < 0.005  # where a square wave jumps, rounding chooses the side


@pytest.mark.parametrize(
    "output",
    [
        Output("RAMP", 30.0, 4e-4, 0.0),
        Output("SQU", 30.0, 4e-4, 0.0, duty=0.2),
        Output("SIN", 30.0, 4e-4, 0.0, burst=Burst(1, 0.1)),
    ],
    ids=["ramp", "pulse", "burst"],
)
def test_of_other_waveforms_the_top_feels_the_first_harmonic(output):
    drive = world()._drive_keys(0.0, output)
    assert (drive["waveform"], drive["frequency_hz"]) == ("sine", 30.0)
    assert drive["amplitude_t"] == pytest.approx(fundamental(output))


@pytest.mark.parametrize(
    "output",
    [
        Output("SIN", 30.0, 0.0, 0.0),
        Output("DC", 0.0, 0.0, 2e-4),
        Output("NOIS", 30.0, 4e-4, 0.0),
        Output("SIN", 2e6, 4e-4, 0.0),
    ],
    ids=["off", "constant", "noise", "too fast"],
)
def test_what_cannot_turn_a_top_is_no_drive(output):
    top = world()
    top.drive(0.5, output)
    np.testing.assert_array_equal(top.light(0.0, 1e-3, 2000), world().light(0.0, 1e-3, 2000))


def test_a_drive_from_before_the_beginning_is_one_from_the_beginning():
    early, other = world(), world()
    early.drive(-1.0, Output("SIN", 30.0, 4e-4, 0.0))
    other.drive(0.0, Output("SIN", 30.0, 4e-4, 0.0))
    np.testing.assert_array_equal(early.light(0.0, 1e-3, 2000), other.light(0.0, 1e-3, 2000))


def test_the_drive_takes_hold_of_the_top():
    # a tenth of a hertz beside the spin: held, it turns with the drive, else it would lag by two turns
    top = world(preset("driven").changed({"start.spin_hz": 29.9}), tape=Tape(noise=0.0))
    top.drive(0.0, Output("SIN", 30.0, 4e-4, 0.0, phase=90.0))
    bright = top.light(0.0, 2e-4, 100_000) > 0.65
    assert int(np.sum(bright[1:] > bright[:-1])) == 600


# --- what is seen ---


def test_the_light_is_one_pulse_a_turn_and_dark_without_a_top():
    top = world(tape=Tape(noise=0.0, view_m=1.0))  # a view so wide that every pulse has its whole height
    light = top.light(0.0, 1e-5, 100_000)
    assert (light.min(), light.max()) == pytest.approx((0.1, 1.2), abs=0.01)
    rises, falls = (np.flatnonzero(np.diff((light > 0.65).astype(int)) == sign) for sign in (1, -1))
    assert len(rises) == 30
    # 3 % of a turn; the wobble makes it 4 % longer or shorter
    np.testing.assert_allclose((falls[1:-1] - rises[1:-1]) * 1e-5, 0.03 / 30.0, rtol=0.06)
    assert np.all(top.light(-1.0, 1e-4, 1000) == 0.1)


def test_a_top_that_spins_backwards_gives_the_pulses_of_its_mirror_image():
    # mirrored at the x–z plane, in which it starts: moments and spins across it change their sign
    upright = preset("undriven").changed({"start.tilt_rad": 0.0})
    there, back = (upright.changed({"start.spin_hz": spin}) for spin in (30.0, -30.0))
    forwards, backwards = (MotionWorld(scene, VirtualClock(), tape=Tape(noise=0.0)) for scene in (there, back))
    light = backwards.light(0.0, 1e-4, 10_000)
    assert np.count_nonzero((light[1:] > 0.6) & (light[:-1] <= 0.6)) == 30
    assert light == pytest.approx(forwards.light(0.0, 1e-4, 10_000), abs=1e-3)  # the tape's place is interpolated
    seen = [world.crossings(0.0, 1.0, Thresholds(0.6, 0.5, 1)) for world in (forwards, backwards)]
    assert seen[1] == pytest.approx(seen[0], abs=1e-6)
    assert seen[1].size == 30


def test_a_pulse_is_lower_while_the_tape_bobs_out_of_the_lenss_view():
    light = world(tape=Tape(noise=0.0, view_m=0.005)).light(0.0, 2e-5, 100_000)
    starts = np.flatnonzero((light[1:] > 0.3) & (light[:-1] <= 0.3))
    tops = np.array([k + np.argmax(light[k : k + 100]) for k in starts])
    motion = simulate(TILTED, 2.0, rate=2000.0)
    rim = motion.position[:, 2] - TILTED.top.magnet_radius_m * motion.axis[:, 0]
    height = np.exp(-2 * ((np.interp(2e-5 * tops, motion.time, rim) - rim[motion.time < 1.0].mean()) / 0.005) ** 2)
    # the pole takes (τ/σ)²/2 = 7e-4 of a pulse; states are 2.5 ms apart: 2.8 % of the rim's 0.4 mm at 30 Hz
    np.testing.assert_allclose(light[tops], 0.1 + 1.1 * height, atol=0.01)
    assert np.ptp(light[tops]) > 0.2  # IC1 bobs by 2 mm


def test_the_times_of_the_pulses_are_those_that_the_light_shows():
    top = world(
        FALLING.changed({"start.spin_hz": 21.0}), put_back_after_s=1.0, seed=5, tape=Tape(noise=0.0, view_m=1.0)
    )
    top.drive(0.7, Output("SIN", 21.0, 4e-4, 0.0))
    seen = 5e-5 * crossings(top.light(0.0, 5e-5, 80_000), 0.6, 0.04)
    said = np.concatenate([top.crossings(a, a + 0.37, Thresholds(0.6, 0.56)) for a in 0.37 * np.arange(11)])
    assert said.size > 20
    np.testing.assert_allclose(said[said < 4.0], seen, atol=2e-6)  # straight between samples
    narrow = world(tape=Tape(view_m=0.003))
    assert narrow.crossings(0.0, 1.0, Thresholds(0.6, 0.56)) is None  # IC1 bobs half out of the lens's view


def test_the_seed_chooses_where_on_the_rim_the_tape_is():
    places = {int(np.argmax(world(seed=seed, tape=Tape(noise=0.0)).light(0.0, 1e-5, 3333))) for seed in (0, 1, 2)}
    assert len(places) == 3


def test_the_probe_sees_the_field_of_the_scenes_base_where_it_is_put_to_a_fifth_of_a_millimetre():
    missed = {height: Stand(scatter_m=2e-4).at(height).height_m for height in (0.072, 0.05)}
    assert Base().flux_density(0.072) == pytest.approx(0.0190937938, rel=1e-8)
    assert all(0 < abs(place - height) < 1e-3 for height, place in missed.items())
    assert world().flux_density(0.0) == pytest.approx(Base().flux_density(missed[0.072]), rel=1e-8)
    twice = world(TILTED.changed({"base.strength_t_m": 2 * TILTED.base.strength_t_m}))
    assert twice.flux_density(5.0) == pytest.approx(2 * Base().flux_density(missed[0.072]), rel=1e-8)
    twice.place_probe(0.05)
    assert twice.flux_density(5.0) == pytest.approx(2 * Base().flux_density(missed[0.05]), rel=1e-12)
    twice.place_probe(None)
    assert twice.flux_density(5.0) == 0.0


@pytest.mark.parametrize(
    "look", [lambda top: top.light(top.clock.now(), 1e-3, 10), lambda top: top.catch_up()], ids=["light", "keep up"]
)
def test_a_bench_that_runs_for_hours_drops_old_history(look, monkeypatch):
    monkeypatch.setattr("levilab.world.timeline._AT_ONCE", 10)
    monkeypatch.setattr("levilab.world.motion_world.KEPT_S", 1500.0)
    top = world(FALLING, put_back_after_s=60.0)
    for _ in range(7):
        top.clock.sleep(360.0)
        look(top)
    # a life and a fall each minute, of which there were 84, and ten that are not let go yet
    assert len(top._flight._pieces) < 2 * 1500 / 60 + 20


def test_a_bench_that_runs_for_hours_keeps_the_samples_of_the_last_minutes_alone(monkeypatch):
    monkeypatch.setattr("levilab.world.flight.SAMPLED", 200)
    top = world(TILTED)
    top.clock.sleep(20.0)
    before = top.light(5.0, 1e-4, 10_000), top.laser(5.0, 1e-4, 10_000)
    tables = sum(type(one) is Top for one in gc.get_objects())
    for k in range(4):
        top.drive(top.clock.now(), Output("SIN", 30.0 + 0.01 * k, amplitude=1e-6, offset=0.0))
        top.clock.sleep(100.0)
        top.catch_up()
    assert len(top._flight._pieces) > 400
    assert len(top._flight._samples) == 200
    assert sum(type(one) is Top for one in gc.get_objects()) <= tables + 1  # however often the drive was changed
    again = top.light(5.0, 1e-4, 10_000), top.laser(5.0, 1e-4, 10_000)
    assert np.array_equal(before, again)  # simulated once more, to the bit


def test_a_top_that_cannot_be_simulated_is_an_error_and_no_fall(monkeypatch):
    def too_many_steps(*_, **__):
        raise SimulationError("1e+12 steps would be needed")

    flight = Flight(TILTED)
    monkeypatch.setattr("levilab.world.flight.simulate", too_many_steps)
    with pytest.raises(SimulationError, match="steps"):
        turns_of(flight, np.array([0.5]))


def test_a_top_whose_numbers_leave_their_range_has_hit_the_base(monkeypatch):
    def hits(*_, **__):
        raise LeftRange("the motion cannot be followed beyond 0.1 s")

    flight = Flight(TILTED)
    monkeypatch.setattr("levilab.world.flight.simulate", hits)
    _, up = turns_of(flight, np.array([0.5]))
    assert not up.any()


def test_a_top_that_fell_is_put_back_to_where_its_scene_starts():
    clock = VirtualClock()
    world = MotionWorld(FALLING, clock)
    clock.sleep(1.0)
    assert world.light(1.0, 1e-3, 1000).max() < 0.15  # dark: 0.1 V, and noise of 10 mV
    world.float_top(1)
    again = world.light(1.0, 1e-3, 300)
    first = MotionWorld(FALLING, VirtualClock()).light(0.0, 1e-3, 300)
    assert again.max() > 0.2  # dark it has 0.1 V and noise of 0.01 V
    assert np.allclose(again, first, atol=0.1)  # but for the noise of the light, of 10 mV


def test_the_tape_is_on_the_washers_where_they_are_loose():
    scene = preset("loose-washers")
    times = np.arange(0.0, 4.0, 1 / RATE)
    turns = np.unwrap(turns_of(Flight(scene), times)[0], period=1.0)
    motion = simulate(scene.changed({"drive.waveform": "off"}), 4.0, rate=RATE)
    washers = np.trapezoid(motion.washer_spin_hz, motion.time)
    top = np.trapezoid(motion.spin_hz, motion.time)
    # beside the spin: the wobble, a few hundredths of a turn
    assert turns[-1] - turns[0] == pytest.approx(washers, abs=0.15)
    assert top - washers > 0.3


# --- the laser ---


def test_the_stem_is_where_the_simulated_top_has_it():
    motion = simulate(TILTED, 2.7, tolerance=1e-9, rate=317.0)
    place, up = Flight(TILTED, stem_height_m=0.02).stem(motion.time)
    assert up.all()
    # 6e-4 of the nutation's 0.4 mm, and 1e-7 m where a piece ends
    np.testing.assert_allclose(place, motion.position[:, 0] + 0.02 * motion.axis[:, 0], atol=6e-7)


def test_the_laser_is_cut_once_a_turn_of_the_thesiss_driven_top():
    top = world(preset("driven"))
    top.drive(0.0, Output("SIN", 30.0, 4e-4, 0.0, phase=90.0))
    cuts = crossings(top.laser(1.0, 5e-5, 200_000), 0.6, 0.04)
    # at the drive's 30 Hz, but for an edge at either end; the spin swings by 0.4 Hz about it
    assert cuts.size == pytest.approx(300, abs=1)


def test_without_a_top_the_beam_is_steady():
    fallen = world(FALLING)
    voltage = fallen.laser(10.0, 1e-4, 10_000)
    assert np.ptp(voltage) < 0.06  # twelve standard deviations of the noise


def test_a_top_in_full_motion_triggers_its_bursts():
    def spin_after(phase):
        world = MotionWorld(preset("spindown").changed({"start.spin_hz": 30.0}), VirtualClock())
        bursts = Triggered(4e-4, 1, rising=True, delay=5e-7, jitter=0.0)
        world.drive(0.0, Output("SIN", 33.0, 0.0, 0.0, phase=phase, triggered=bursts))
        edges = world.crossings(4.0, 5.0, TriggerWire().thresholds(rising=True))
        field = world.coil_field(4.0, 1e-4, 10_000)
        assert np.mean(field != 0.0) == pytest.approx(edges.size / 33, abs=0.06)  # two bursts are cut at the ends
        return 1 / float(np.mean(np.diff(edges)))

    spins = [spin_after(phase) for phase in (0.0, 90.0, 180.0, 270.0)]
    # four phases of one cosine about the spin of a free top, which loses 0.4 Hz; the wobble moves the edges.  0.71 Hz/s
    # in 4.5 s, see below
    assert spins[0] + spins[2] == pytest.approx(spins[1] + spins[3], abs=1.2)
    assert math.hypot(spins[0] - spins[2], spins[1] - spins[3]) / 2 == pytest.approx(3.2, abs=0.5)


BURSTS = {"waveform": "triggered", "amplitude_t": 4e-4, "light_rad": 0.0, "latency_s": 5e-7, "cycle_turns": 0.0}


def spin_of(scene, state):
    return float(state[L] @ state[N]) / scene.top.inertia_axial_kg_m2 / (2 * math.pi)


@pytest.mark.parametrize("every", [1.0, 0.1, 0.01])
def test_a_burst_runs_on_across_steps_and_settings(every):
    scene, drive = preset("spindown"), BURSTS | {"frequency_hz": 33.0, "phase_rad": 4.45}
    flight = Flight(scene)
    for k in range(round(2 / every) + 1):
        flight.change(k * every, drive)
    whole = simulate(scene.changed({f"drive.{key}": value for key, value in drive.items()}), 2.0, tolerance=1e-9)
    # two hundred pieces, each to 1e-7; where bursts ended with the pieces, 0.07 with two of them, and 2 Hz with many
    assert flight._state[N] == pytest.approx(whole.axis[-1], abs=3e-5)
    assert spin_of(scene, flight._state) == pytest.approx(whole.spin_hz[-1], abs=3e-5)


@pytest.mark.parametrize("spin", [28.0, 30.0, 40.0, 60.0])
def test_the_pull_of_bursts_is_that_of_a_moment_that_leans_with_the_top(spin):
    scene = preset("spindown").changed({"start.spin_hz": spin, "drag.law": "none", "start.tilt_rad": 1e-3})
    top = scene.top
    gained = []
    for phase in (0.0, 120.0, 240.0):
        flight = Flight(scene)
        flight.change(0.0, BURSTS | {"frequency_hz": 1.1 * spin, "phase_rad": math.radians(phase)})
        flight.change(1.0, OFF)
        gained.append(spin_of(scene, flight._state) - spin)
    bursts = Triggered(4e-4, 1, rising=True, delay=5e-7, jitter=0.0)
    output = Output("SIN", 1.1 * spin, 0.0, 0.0, triggered=bursts)
    pulls = [mean_pull(replace(output, phase=phase), spin, 0.25) for phase in (0.0, 120.0, 240.0)]
    across = abs(top.moment_a_m2) * top.moment_tilt[0]
    fixed = across / top.inertia_axial_kg_m2 / 2 / (2 * math.pi) * response(pulls, 0).pull
    # the synchronous tilt, PHYSICS 4, resonant at ν_r² = μB/(I₁ − I₃)
    place = start_of(scene)[R][None]
    torque = top.moment_a_m2 * top.moment_tilt[1] * flux_density(base_field(scene), place)[0, 2]
    resonance = math.sqrt(torque / (top.inertia_transverse_kg_m2 - top.inertia_axial_kg_m2)) / (2 * math.pi)
    assert response(gained, 0).pull == pytest.approx(fixed / (1 - (resonance / spin) ** 2), rel=0.015)
    # 1 %: the spin moves within the second, the more the nearer the resonance


def test_before_time_zero_there_is_no_top():
    turns, up = turns_of(Flight(TILTED), np.array([-1.0, -1e-9, 0.0]))
    assert up.tolist() == [False, False, True]
    assert turns[0] == 0.0


def test_the_noise_is_as_large_as_asked_for_and_another_with_another_seed():
    fallen = world(FALLING, tape=Tape(noise=0.02), seed=1)
    light = fallen.light(10.0, 1e-4, 40_000)
    assert light.std() == pytest.approx(0.02, rel=4 / math.sqrt(2 * 40_000))
    other = world(FALLING, tape=Tape(noise=0.02), seed=2).light(10.0, 1e-4, 40_000)
    assert abs(np.corrcoef(light, other)[0, 1]) < 4 / math.sqrt(40_000)
