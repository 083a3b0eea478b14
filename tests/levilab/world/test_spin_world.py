"""The virtual world: the top under its drive, its fall, and the light that it makes."""

import math
import sys
import tracemalloc
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.clock import VirtualClock
from instruments.virtual.core.signal import crossings
from instruments.virtual.counter.edges import Thresholds
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.generator.channel import Burst, Output
from instruments.virtual.generator.voltage import fundamental, voltage
from levilab.simulator.equilibrium import axial_field
from levilab.simulator.scene import preset
from levilab.simulator.spin import DECAYS
from levilab.world import bench as virtual_bench
from levilab.world.light import Tape
from levilab.world.spin_world import KEPT_S, Phase, SpinScene, SpinWorld, random_scene
from support.wire import ask, received, send

TURN = 2 * math.pi
#: Field of the drive at the top [T]: what 10 Vpp make on the virtual bench.
FIELD = 0.4e-3
#: No noise, no jitter: what is left is the motion.
QUIET = SpinScene(tape=Tape(noise=0.0), jitter=0.0)
#: Greatest acceleration of the drive [rad/s²], and the capture range of a pendulum, 2√α, as a frequency [Hz].
HOLD = QUIET.lock_torque * FIELD
CAPTURE = 2 * math.sqrt(HOLD) / TURN


def world(scene=QUIET):
    return SpinWorld(scene, VirtualClock())


def spin_hz(top, time):
    return float(top.motion(np.array([float(time)]))[0][0]) / TURN


def angle(top, time):
    return float(top.motion(np.array([float(time)]))[1][0])


def drive(top, time, waveform, frequency, field, **rest):
    """Put this field on the coil, amplitude and offset in T."""
    top.drive(time, Output(waveform, frequency, field, **{"offset": 0.0} | rest))


def off(top, time):
    drive(top, time, "SIN", 40.0, 0.0)


# --- the drive ---


def test_the_capture_range_is_that_of_the_thesiss_drive():
    # half a hertz at 0.4 mT: what the ramp of the spin-down is made for
    assert pytest.approx(0.50, abs=0.01) == CAPTURE


def test_a_ramp_in_steps_of_a_fifth_of_a_hertz_is_followed():
    top = world()
    drive(top, 1.0, "SIN", spin_hz(top, 1.0), FIELD)
    start = spin_hz(top, 1.0)
    for k in range(51):
        drive(top, 2.0 + k, "SIN", start + 0.2 * k, FIELD)
        # a step of 1.26 rad/s takes 0.7 to 0.8 s: α is 2.5 rad/s², of which drag takes 0.6 to 0.9
        assert spin_hz(top, 2.95 + k) == pytest.approx(start + 0.2 * k, rel=1e-12)


@pytest.mark.parametrize("step", [0.3, -0.3])
def test_drag_holds_back_a_drive_that_pulls_up_and_helps_one_that_pulls_down(step):
    top = world()
    drive(top, 0.0, "SIN", 30.0, FIELD)
    drive(top, 1.0, "SIN", 30.0 + step, FIELD)
    drag = 2.34e-4 * (TURN * 30.0) ** 1.5  # 0.61 rad/s², a quarter of the hold
    lasts = TURN * step / (math.copysign(HOLD, step) - drag)
    # a constant acceleration, by the drag at 30 Hz, which a time step of 1 ms tells to 1e-4
    assert spin_hz(top, 1.0 + 0.9 * lasts) == pytest.approx(30.0 + 0.9 * step, abs=1e-3 * abs(step))
    assert spin_hz(top, 1.0 + 1.01 * lasts) == 30.0 + step


def test_a_top_out_of_the_drives_reach_spins_down_as_if_there_were_none():
    driven, free = world(), world()
    drive(driven, 0.0, "SIN", 35.0, FIELD)
    times = np.linspace(0.0, 50.0, 11)
    np.testing.assert_array_equal(driven.motion(times), free.motion(times))


def test_a_drive_that_is_weaker_than_drag_holds_nothing():
    # drag at 30 Hz: C ω^1.5 = 0.61 rad/s², a quarter of the hold at 0.4 mT
    strong, weak = world(), world()
    drive(strong, 0.0, "SIN", 30.0, 0.3 * FIELD)
    drive(weak, 0.0, "SIN", 30.0, 0.2 * FIELD)
    assert spin_hz(strong, 20.0) == pytest.approx(30.0, rel=1e-15)
    assert spin_hz(weak, 20.0) < 29.0


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("waveform", "harmonic"), [("SIN", 1.0), ("SQU", 4 / math.pi), ("TRI", 8 / math.pi**2)])
def test_a_jump_is_followed_within_the_reach_of_the_first_harmonic_only(waveform, harmonic, sign):
    reach = sign * 2 * math.sqrt(harmonic * HOLD) / TURN
    for step, followed in ((0.99, True), (1.01, False)):
        top = world()
        drive(top, 0.0, waveform, 30.0, FIELD)
        drive(top, 1.0, waveform, 30.0 + step * reach, FIELD)
        assert (abs(spin_hz(top, 10.0) - 30.0 - step * reach) < 1e-9) is followed


#: Seconds since the last change, waveform, how far from 30 Hz, amplitude as a part of the usual one.
CHANGES = st.lists(
    st.tuples(
        st.one_of(st.just(0.0), st.floats(1e-3, 1.0), st.floats(1.0, 20.0)),
        st.sampled_from(["SIN", "SQU", "TRI", "RAMP"]),
        st.one_of(st.floats(-0.6, 0.6), st.floats(-12.0, 12.0)),
        st.sampled_from([0.0, 0.2, 1.0, 1.0, 2.0]),
    ),
    max_size=8,
)


@given(changes=CHANGES, drag=st.sampled_from([("disc", (2.34e-4,)), ("stokes", (3.2e-3,)), ("mixed", (1e-3, 1e-5))]))
def test_angle_and_spin_are_continuous_whatever_the_drive_does(changes, drag):
    top = world(replace(QUIET, drag=drag[0], constants=drag[1]))
    now = 0.0
    for wait, waveform, away, amplitude in changes:
        now += wait
        # near the spin that it has, so that it is caught now and then
        drive(top, now, waveform, max(1.0, (spin_hz(top, now) or 30.0) + away), amplitude * FIELD)
    step = 1e-3
    times = np.arange(0.0, now + 20.0, step)
    spin, turned = top.motion(times)
    spinning = spin > 0
    assert np.all(spinning[:-1] >= spinning[1:])  # what has fallen stays where it is
    # Twice 2.5 rad/s², times 4/π for a square, and drag: no faster does a spin change.
    assert np.all(np.abs(np.diff(spin[spinning])) <= 8.0 * step)
    # The angle is the integral of the spin: by trapezoids, but for kinks of at most 8 rad/s², to 8·step²;
    # below that the rounding of an angle of 1e4 rad.
    by_trapezoids = (spin[1:] + spin[:-1]) / 2 * step
    error = np.abs(np.diff(turned) - by_trapezoids)[: max(0, spinning.sum() - 1)]
    assert np.all(error <= 8.0 * step**2 + 1e-10)
    # a fall between two samples included, where the spin may also be a little more than at both of them
    assert np.all((np.diff(turned) >= 0) & (np.diff(turned) <= (np.max(spin) + 8.0 * step) * step + 1e-10))
    assert np.all(turned[~spinning] == turned[~spinning][:1])


# --- the fall ---


def test_the_top_falls_at_its_lower_limit_and_stays_dark():
    top = world()
    drive(top, 0.0, "SIN", 30.0, FIELD)
    off(top, 5.0)
    time = 5.0 + float(DECAYS["disc"].elapsed(TURN * 30.0, TURN * QUIET.fall_hz, 2.34e-4))
    assert spin_hz(top, time - 1e-6) == pytest.approx(QUIET.fall_hz, abs=1e-6)
    assert spin_hz(top, time + 1e-6) == 0.0
    # 137 rad/s for two microseconds, and the rounding of an angle of 2e4 rad
    assert angle(top, time + 1e-6) == pytest.approx(angle(top, time - 1e-6), abs=3e-4)
    before, after = top.light(time - 1.0, 1e-4, 9_000), top.light(time + 1e-6, 1e-4, 100_000)
    assert before.max() == pytest.approx(QUIET.tape.bright, abs=0.01)
    assert np.all(after == QUIET.tape.dark)


def test_a_hand_takes_a_top_that_floats_and_spins_it_anew():
    clock = VirtualClock()
    top = SpinWorld(QUIET, clock)
    clock.sleep(50.0)
    top.take_top()
    assert spin_hz(top, 51.0) == 0.0
    top.float_top(1)
    assert spin_hz(top, 49.0) < QUIET.start_hz - 1.0
    assert spin_hz(top, 50.0) == pytest.approx(QUIET.start_hz)


# --- the light ---


def test_light_is_one_pulse_a_turn_of_the_width_that_was_asked_for():
    top = world(replace(QUIET, fall_hz=1.0))
    drive(top, 0.0, "SIN", 30.0, FIELD)
    step = 1e-6
    light = top.light(0.0, step, 1_000_000)
    half = (QUIET.tape.dark + QUIET.tape.bright) / 2
    rises = np.flatnonzero((light[1:] >= half) & (light[:-1] < half))
    falls = np.flatnonzero((light[1:] < half) & (light[:-1] >= half))
    assert rises.size == falls.size == 30
    # both edges lie on the grid of samples: each to one step
    np.testing.assert_allclose((falls - rises) * step, QUIET.tape.width / 30.0, atol=2 * step)
    np.testing.assert_allclose(np.diff(rises) * step, 1 / 30.0, atol=2 * step)


def test_light_depends_on_what_is_asked_and_on_nothing_else():
    top = world(SpinScene(seed=3))
    first = top.light(5.0, 5e-5, 2_000)
    top.light(1.0, 1e-3, 100)
    top.motion(np.array([100.0]))
    np.testing.assert_array_equal(top.light(5.0, 5e-5, 2_000), first)
    # a shorter look is the beginning of a longer one
    np.testing.assert_array_equal(top.light(5.0, 5e-5, 500), first[:500])


@pytest.mark.parametrize(("tape", "close"), [(Tape(noise=0.0), 2e-6), (Tape(), 6e-5)], ids=["quiet", "noisy"])
@pytest.mark.parametrize("triggers", [Thresholds(0.6, 0.56), Thresholds(0.3, 0.34, -1.0)], ids=["rising", "falling"])
def test_the_times_of_the_pulses_are_those_that_the_light_shows(tape, close, triggers):
    top = world(replace(random_scene(3), tape=tape, put_back_after_s=5.0))
    drive(top, 10.0, "SIN", 30.5, FIELD)  # coasts, is pulled and held, and coasts again
    off(top, 12.0)
    fall = next(t for t in np.arange(12.0, 300.0, 0.5) if spin_hz(top, t) == 0.0)
    for start, length in ((9.0, 4.0), (fall - 2.0, 8.0)):
        sign = triggers.sign
        voltage = top.light(start, 5e-5, round(length / 5e-5))
        seen = start + 5e-5 * crossings(sign * voltage, sign * triggers.fire, 0.04)
        said = top.crossings(start, start + length, triggers)
        # straight between samples: 1 µs; noise: four times 10 mV over the slope of 0.7 V in 1 ms
        np.testing.assert_allclose(said, seen, atol=close)
        parts = [top.crossings(start + k * length / 7, start + (k + 1) * length / 7, triggers) for k in range(7)]
        np.testing.assert_allclose(np.concatenate(parts), said, atol=1e-9)


def test_the_same_seed_makes_the_same_light_and_another_seed_another():
    lights = [world(random_scene(seed)).light(5.0, 5e-5, 2_000) for seed in (7, 7, 8)]
    np.testing.assert_array_equal(lights[0], lights[1])
    assert np.any(lights[0] != lights[2])


def test_the_past_is_not_changed_by_what_the_drive_does_now():
    top = world()
    times = np.linspace(0.0, 9.9, 100)
    before = top.motion(times)
    drive(top, 10.0, "SIN", 27.0, FIELD)
    off(top, 12.0)
    np.testing.assert_array_equal(top.motion(times), before)


def test_the_noise_of_the_light_is_as_large_as_asked_for():
    top = world(replace(QUIET, start_hz=20.0, tape=Tape()))
    light = top.light(0.0, 5e-5, 40_000)
    # standard errors of mean and standard deviation: 1/√40 000 and 1/√80 000 of 0.01 V; four of them
    assert light.mean() == pytest.approx(QUIET.tape.dark, abs=4 * 0.01 / 200)
    assert light.std() == pytest.approx(0.01, rel=4 / 283)


# --- what is drawn by the seed ---


def test_runs_scatter_as_the_published_ones_do():
    scenes = [random_scene(seed) for seed in range(2000)]
    constants = np.array([scene.constants[0] for scene in scenes]) / SpinScene().constants[0] - 1
    falls = np.array([scene.fall_hz for scene in scenes]) - SpinScene().fall_hz
    for scatter, size in ((constants, 0.02), (falls, 0.25)):
        # standard errors of a mean and of a standard deviation from 2000: 2.2 % and 1.6 %; four of them
        assert scatter.mean() == pytest.approx(0.0, abs=4 * size / math.sqrt(2000))
        assert scatter.std() == pytest.approx(size, rel=4 / math.sqrt(4000))
    assert abs(np.corrcoef(constants, falls)[0, 1]) < 4 / math.sqrt(2000)


def test_what_is_drawn_leaves_the_rest_of_the_scene_as_it_was():
    scene = SpinScene(drag="mixed", constants=(1e-3, 1e-5), start_hz=33.0)
    once = random_scene(5, scene)
    assert (once.start_hz, once.drag, once.seed) == (33.0, "mixed", 5)
    assert once.constants[0] / 1e-3 == pytest.approx(once.constants[1] / 1e-5, rel=1e-14)
    assert once == random_scene(5, scene)


# --- through the counter ---


def test_readings_over_a_second_scatter_as_the_thesiss_do_and_are_unbiased():
    # 30.5 Hz: no edge falls on the end of the gate, where the counter would choose between two of them
    top = world(SpinScene(start_hz=30.5, fall_hz=1.0, seed=1))
    drive(top, 0.0, "SIN", 30.5, FIELD)
    device = Virtual53230A(top.clock, signal=top.light)
    send(device, b"INP1:COUP DC;LEV:AUTO OFF;:INP1:LEV1 0.6;:SENS:FREQ:GATE:TIME 1;:SYST:TIM 1.2\n")
    readings = []
    for _ in range(400):
        send(device, b"READ?\n")
        readings.append(float(received(device, 5.0)))
    # standard error of a standard deviation from 400: 3.5 %; about three of them
    assert np.std(readings) == pytest.approx(0.03, rel=0.10)
    # and of their mean: 0.03/√400; three of them
    assert np.mean(readings) == pytest.approx(30.5, abs=3 * 0.0015)


# --- the coil and the base, as instruments see them ---


def test_the_coils_field_is_what_the_generator_last_put_there_and_its_phase_runs_on():
    top = world(SpinScene())
    drive(top, 1.0, "SIN", 2.0, 4e-4)
    drive(top, 1.3, "SIN", 5.0, 4e-4)
    drive(top, 2.0, "SQU", 1.0, 0.0)
    t = 0.01 * np.arange(300)
    seen = top.coil_field(0.0, 0.01, 300)
    phase = np.where(t < 1.3, 2.0 * (t - 1.0), 0.6 + 5.0 * (t - 1.3))
    expected = np.where((t >= 1.0) & (t < 2.0), 4e-4 * np.sin(2 * np.pi * phase), 0.0)
    assert seen == pytest.approx(expected, abs=1e-15)


def coil_at(top, times):
    """The field at times in steps of 10 ms [T]."""
    steps = np.rint(np.asarray(times) / 0.01).astype(int)
    return top.coil_field(0.005, 0.01, int(steps.max()) + 1)[steps]  # between the steps, where nothing jumps


SAMPLES = np.array([1.0, -0.5, 0.0, 0.25])


@pytest.mark.parametrize(
    ("output", "times", "seen"),
    [
        (Output("DC", 1.0, 0.0, 3.0), [0.1, 0.9, 7.3], [3, 3, 3]),
        (Output("SIN", 1.0, 2.0, 0.5, phase=90.0), [0.0, 0.25, 0.5], [2.5, 0.5, -1.5]),
        (Output("SIN", 1.0, 2.0, 0.5, phase=90.0, inverted=True), [0.0, 0.25, 0.5], [-1.5, 0.5, 2.5]),
        (Output("SQU", 1.0, 2.0, -0.5, duty=0.2), [0.1, 0.3, 0.9, 1.1], [1.5, -2.5, -2.5, 1.5]),
        (Output("PULS", 1.0, 2.0, 0.0, duty=0.2, inverted=True), [0.1, 0.3, 0.9, 1.1], [-2, 2, 2, -2]),
        (Output("RAMP", 1.0, 1.0, 0.0, symmetry=1.0), [0.0, 0.25, 0.49, 0.51, 0.75], [0, 0.5, 0.98, -0.98, -0.5]),
        (Output("RAMP", 1.0, 1.0, 0.0, symmetry=0.0), [0.01, 0.25, 0.5, 0.99], [0.98, 0.5, 0, -0.98]),
        (Output("RAMP", 1.0, 1.0, 0.0, symmetry=0.2), [0.0, 0.1, 0.5, 0.9], [0, 1, 0, -1]),
        (Output("TRI", 1.0, 1.0, 1.0), [0.0, 0.25, 0.5, 0.75], [1, 2, 1, 0]),
        (Output("ARB", 0.5, 2.0, 1.0, samples=SAMPLES), [0.1, 0.6, 1.1, 1.9, 2.1], [3, 0, 1, 1.5, 3]),
        (Output("USER", 1.0, 2.0, 0.0, samples=np.array([1.0, -1.0])), [0.1, 0.6], [2, -2]),
        # two cycles of half a second at the beginning of every three seconds
        (Output("SQU", 2.0, 1.0, 0.5, burst=Burst(2, 3.0)), [0.1, 0.3, 1.1, 2.9, 3.1], [1.5, -0.5, 0.5, 0.5, 1.5]),
        (Output("SQU", 2.0, 1.0, 0.5, burst=Burst(math.inf, None)), [0.1, 0.3, 1.1, 2.9], [1.5, -0.5, 1.5, -0.5]),
    ],
)  # fmt: skip
def test_the_coils_field_is_the_generators_voltage_in_time(output, times, seen):
    top = world()
    top.drive(0.005, output.times(1e-4))
    assert coil_at(top, times) == pytest.approx(1e-4 * np.array(seen), abs=1e-4 * 1e-9)


def test_bursts_keep_their_rhythm_when_their_size_changes_and_restart_with_another():
    top = world()
    drive(top, 0.005, "SQU", 2.0, 1.0, burst=Burst(1, 2.0))
    drive(top, 3.005, "SQU", 2.0, 2.0, burst=Burst(1, 2.0))
    drive(top, 7.105, "SQU", 2.0, 2.0, burst=Burst(1, 1.0))
    seen = coil_at(top, [0.1, 0.3, 1.0, 2.1, 4.1, 4.3, 5.0, 6.1, 7.0, 7.2, 7.4, 7.7, 8.2])
    assert seen.tolist() == [1, -1, 0, 1, 2, -2, 0, 2, 0, 2, -2, 0, 2]


@pytest.mark.parametrize("waveform", ["NOIS", "PRBS"])
def test_what_is_random_is_the_same_for_every_instrument(waveform):
    top, other = world(), world()
    for one in (top, other):
        drive(one, 0.0, waveform, 1e3, 2.0, offset=0.5)
    seen = top.coil_field(1.0, 1e-4, 20_000)
    assert np.array_equal(other.coil_field(1.0 + 1e-4 * 5_000, 1e-4, 100), seen[5_000:5_100])
    assert (seen.min(), seen.max()) == (-1.5, 2.5)
    # four standard errors; the r.m.s. of noise is a third of its peak, of bits all of it
    assert seen.mean() == pytest.approx(0.5, abs=4 * 2.0 / math.sqrt(2_000))
    assert np.std(seen) == pytest.approx({"NOIS": 2.0 / 3.3, "PRBS": 2.0}[waveform], rel=0.05)
    drive(top, 4.0, waveform, 30.0, FIELD)
    assert spin_hz(top, 20.0) < 29.0  # and nothing that a top could follow


def test_random_bits_are_all_states_of_their_register():
    top = world()
    drive(top, 0.0, "PRBS", 1.0, 1.0)
    bits = (top.coil_field(0.5, 1.0, 254) > 0).astype(int)
    assert np.array_equal(bits[:127], bits[127:])
    assert len({tuple(bits[k : k + 7]) for k in range(127)}) == 127  # PN7: each but seven zeros


@pytest.mark.parametrize(
    "output",
    [
        *(Output("SQU", 1.0, 2.0, 0.7, duty=duty) for duty in (0.01, 0.3, 0.5, 0.9)),
        *(Output("RAMP", 1.0, 2.0, 0.7, symmetry=symmetry) for symmetry in (0.0, 0.1, 0.5, 0.95, 1.0)),
        *(Output(waveform, 1.0, 2.0, 0.7, inverted=True) for waveform in ("SIN", "TRI", "NOIS")),
        Output("PULS", 1.0, 2.0, 0.7, duty=0.1),
        Output("ARB", 1.0, 2.0, 0.7, samples=np.array([0.1, 1.0, -0.3, -1.0, 0.5])),
        Output("DC", 1.0, 0.0, 0.7),
    ],
    ids=repr,
)
def test_the_first_harmonic_is_that_of_the_voltage(output):
    turns = (np.arange(200_000) + 0.5) / 200_000
    volts = voltage(output, turns, 1e3 * turns)
    summed = 2 * abs(np.mean(volts * np.exp(-2j * np.pi * turns)))
    assert fundamental(output) == pytest.approx(summed, abs=5e-3 if output.waveform == "NOIS" else 1e-4)


def test_an_offset_holds_no_top_and_does_not_disturb_one_that_is_held():
    with_offset, without, dc = world(), world(), world()
    drive(with_offset, 0.0, "SIN", 30.0, FIELD, offset=5 * FIELD)
    drive(without, 0.0, "SIN", 30.0, FIELD)
    drive(dc, 0.0, "DC", 30.0, 0.0, offset=5 * FIELD)
    times = np.linspace(0.0, 50.0, 11)
    np.testing.assert_array_equal(with_offset.motion(times), without.motion(times))
    np.testing.assert_array_equal(dc.motion(times), world().motion(times))


def test_a_drive_with_pauses_holds_less():
    # drag takes a quarter of the hold: half of the time is enough, a fifth is not
    busy, idle = world(), world()
    drive(busy, 0.0, "SIN", 30.0, FIELD, burst=Burst(15, 1.0))
    drive(idle, 0.0, "SIN", 30.0, FIELD, burst=Burst(6, 1.0))
    assert spin_hz(busy, 20.0) == pytest.approx(30.0)
    assert spin_hz(idle, 20.0) < 29.0


# --- from the generator's commands to the oscilloscope's second channel ---


SQUARE = "FUNC SQU;FREQ 1;VOLT 4;"


def second_channel(top, at):
    """Volts at times [s] after now, where nothing jumps."""
    now = top.clock.now()
    look = virtual_bench.scope_signals(top)[2]
    return [float(look(now + t, 1e-3, 1)[0]) for t in at]


@pytest.mark.parametrize("model", ["33500B", "33220A"])
@pytest.mark.parametrize(
    ("commands", "at", "volts"),
    [
        (SQUARE + "VOLT:OFFS 1;:OUTP ON", [0.1, 0.6], [3, -1]),
        (SQUARE + "VOLT:OFFS 1;:OUTP:POL INV;:OUTP ON", [0.1, 0.6], [-1, 3]),
        ("FUNC SQU;FREQ 1;FUNC:SQU:DCYC 20;:VOLT 4;:OUTP ON", [0.1, 0.3, 0.9], [2, -2, -2]),
        ("FUNC DC;VOLT:OFFS -2.5;:OUTP ON", [0.1, 10.6], [-2.5, -2.5]),
        ("FUNC DC;VOLT:OFFS -2.5;:OUTP ON;:OUTP OFF", [0.1, 10.6], [0, 0]),
        (SQUARE + ":OUTP:LOAD 50;:VOLT 4;:OUTP ON", [0.1, 0.6], [4, -4]),
        ("FUNC RAMP;FUNC:RAMP:SYMM 0;:FREQ 1;VOLT 4;:OUTP ON", [0.01, 0.25, 0.99], [1.96, 1, -1.96]),
        ("FUNC PULS;FREQ 1;FUNC:PULS:WIDT 0.1;:VOLT 4;:OUTP ON", [0.05, 0.15, 1.05], [2, -2, 2]),
        (SQUARE + "BURS:NCYC 2;INT:PER 5;:BURS:STAT ON;:OUTP ON", [0.1, 0.6, 1.1, 2.5, 5.1], [2, -2, 2, 0, 2]),
        (SQUARE + "TRIG:SOUR BUS;:BURS:NCYC 2;STAT ON;:OUTP ON", [0.1, 0.6], [0, 0]),
        (SQUARE + "TRIG:SOUR BUS;:BURS:NCYC 2;STAT ON;:OUTP ON;*TRG", [0.1, 0.6, 1.1, 2.1], [2, -2, 2, 0]),
        ("FUNC SIN;FREQ 1;VOLT 4;TRIG:SOUR BUS;:BURS:NCYC 2;PHAS 90;STAT ON;:OUTP ON;*TRG", [0.0, 0.5], [2, -2]),
        # the tape's pulse opens the gate for whole cycles
        (SQUARE + "BURS:MODE GAT;STAT ON;:OUTP ON", [0.1, 0.6], [2, -2]),
        (SQUARE + "BURS:MODE GAT;GATE:POL INV;:BURS:STAT ON;:OUTP ON", [0.1, 0.6], [2, -2]),
    ],
)  # fmt: skip
def test_the_oscilloscope_sees_what_the_generator_was_reported(model, commands, at, volts):
    top = world()
    device = virtual_bench.VIRTUAL_MODELS["generator"][model](top)
    send(device, f"OUTP:LOAD INF;:{commands}\n".encode())
    assert list(iter(lambda: ask(device, "SYST:ERR?"), device.no_error)) == []
    # a message takes a little time, and so the signal began a little before now
    assert second_channel(top, at) == pytest.approx(volts, abs=0.1)


def test_it_sees_an_arbitrary_waveform_too():
    top = world()
    device = virtual_bench.VIRTUAL_MODELS["generator"]["33500B"](top)
    load = "DATA:ARB:DAC steps,32767,0,-32767,0,0,0,16384,16384;:FUNC:ARB steps;:FUNC ARB;:FUNC:ARB:SRAT 8"
    send(device, f"OUTP:LOAD INF;:{load};:VOLT 4;VOLT:OFFS 1;:OUTP ON\n".encode())
    at = (np.arange(8) + 0.5) / 8
    assert second_channel(top, at) == pytest.approx([3, 1, -1, 1, 1, 1, 2, 2], abs=1e-3)


# --- many changes ---


@cache
def changed_every_second(changes):
    top = world()
    drive(top, 0.0, "SIN", 30.0, FIELD)
    for k in range(changes):
        top.clock.sleep(1.0)
        drive(top, top.clock.now(), "SIN", 30.0 + 0.1 * (k % 2), FIELD)
    return top


def test_changes_that_are_long_past_are_forgotten():
    top = changed_every_second(20_000)
    now = top.clock.now()
    kept = len(top._stretches), len(top._coil.history)
    assert kept[0] <= 2 * (KEPT_S + 1001)  # pulled and locked, and a thousand that are not let go yet
    assert kept[1] <= KEPT_S + 1001
    assert spin_hz(top, now - KEPT_S + 1.9) == pytest.approx(spin_hz(top, now - KEPT_S + 3.9), rel=1e-12)


def cost_of_a_look(top, age):
    """Lines of Python and bytes for a look at the top as it was some time ago [s]."""
    lines = 0

    def count(frame, event, _):
        nonlocal lines
        lines += event == "line"
        return count

    def look():
        top.motion(np.array([top.clock.now() - age]))
        top.coil_field(top.clock.now() - age, 1e-3, 2)

    look()
    tracemalloc.start()
    look()
    memory = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    before = sys.gettrace()
    sys.settrace(count)
    try:
        look()
    finally:
        sys.settrace(before)
    return lines, memory


@pytest.mark.parametrize("age", [0.5, 5.5])
def test_a_look_costs_the_same_after_twenty_thousand_changes(age):
    few, many = (cost_of_a_look(changed_every_second(changes), age) for changes in (20, 20_000))
    assert 0 < many[0] <= 1.2 * few[0]
    assert many[1] <= 2 * few[1] + 4096  # each look through all of them would take a hundred thousand bytes


def test_settings_at_one_time_and_of_an_output_that_is_off_leave_no_trace():
    top = world()
    for k in range(1000):
        drive(top, 5.0, "SIN", 30.0 + k, FIELD)  # at one and the same time
    for k in range(1000):
        drive(top, 6.0 + k / 1000, "SIN", 30.0, 0.0)  # off, again and again
    assert len(top._stretches) <= 4
    assert len(top._coil.history) == 3


def test_a_change_at_the_time_of_a_fall_or_of_a_burst_that_was_to_end_changes_nothing_before():
    top = world()
    fallen = next(s.start for s in top._stretches if s.phase is Phase.FALLEN)
    drive(top, fallen, "SIN", 30.0, FIELD)
    assert spin_hz(top, fallen - 0.1) > 21.8
    assert spin_hz(top, fallen + 10.0) == 0
    top = world()
    drive(top, 1.0, "SIN", 30.0, FIELD)
    drive(top, 60.0, "SIN", 30.0, 0.0)  # the end of a burst, known beforehand
    drive(top, 2.0, "SIN", 30.0, 0.0)  # but it is switched off
    assert spin_hz(top, 50.0) < 27.0
    assert coil_at(top, [1.5, 3.0, 59.0]).tolist() == [pytest.approx(0, abs=1), 0, 0]


def test_the_magnetometer_sees_the_base_as_the_simulator_has_it():
    there = axial_field(preset("undriven"))(np.array([0.072]))[0, 0]
    assert world(SpinScene()).flux_density(3.0) == pytest.approx(there, rel=1e-8)


def test_a_top_that_falls_is_put_back_if_the_scene_says_so():
    top = world(SpinScene(put_back_after_s=10.0))
    fallen = next(s.start for s in top._stretches if s.phase is Phase.FALLEN)
    spin, angle = top.motion(np.array([fallen - 1, fallen + 9, fallen + 10.001, fallen + 11 + fallen]))
    assert spin[0] > 0
    assert spin[1] == 0
    assert spin[2] == pytest.approx(2 * np.pi * 30, rel=1e-4)
    assert spin[3] == 0
    assert np.all(np.diff(angle) >= 0)
    drive(top, fallen + 12.0, "SIN", 30.0, FIELD)
    assert top.motion(np.array([fallen + 500.0]))[0] == pytest.approx(2 * np.pi * 30)


# --- the laser ---


def test_a_top_that_only_spins_does_not_cut_the_laser():
    top = world(SpinScene(seed=3))
    voltage = top.laser(5.0, 5e-5, 20_000)
    assert voltage.mean() == pytest.approx(0.65, abs=1e-3)
    assert crossings(voltage, 0.6, 0.04).size == crossings(voltage, 0.65, 0.04).size == 0
    np.testing.assert_array_equal(top.laser(5.0, 5e-5, 500), voltage[:500])
