"""The virtual world: the top under its drive, its fall, and the light that it makes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from wire import received, send

from instruments.virtual.counter import Virtual53230A
from levilab.clock import VirtualClock
from levilab.simulator.spin import DECAYS
from levilab.simulator.world import SpinScene, SpinWorld, drawn

TURN = 2 * math.pi
#: Field of the drive at the top [T]: what 10 Vpp make on the virtual bench.
FIELD = 0.4e-3
#: No noise, no jitter: what is left is the motion.
QUIET = SpinScene(noise=0.0, jitter=0.0)
#: Greatest acceleration of the drive [rad/s²], and the capture range of a pendulum, 2√α, as a frequency [Hz].
HOLD = QUIET.lock_torque * FIELD
CAPTURE = 2 * math.sqrt(HOLD) / TURN


def world(scene=QUIET):
    return SpinWorld(scene, VirtualClock())


def spin_hz(top, time):
    return float(top.motion(np.array([float(time)]))[0][0]) / TURN


def angle(top, time):
    return float(top.motion(np.array([float(time)]))[1][0])


def off(top, time):
    top.drive(time, "SIN", 40.0, 0.0)


# --- the drive ---


def test_the_capture_range_is_that_of_the_thesiss_drive():
    # half a hertz at 0.4 mT: what the ramp of the spin-down is made for
    assert pytest.approx(0.50, abs=0.01) == CAPTURE


def test_a_ramp_in_steps_of_a_fifth_of_a_hertz_is_followed():
    top = world()
    top.drive(1.0, "SIN", spin_hz(top, 1.0), FIELD)
    start = spin_hz(top, 1.0)
    for k in range(51):
        top.drive(2.0 + k, "SIN", start + 0.2 * k, FIELD)
        # a step of 1.26 rad/s takes 0.7 to 0.8 s: α is 2.5 rad/s², of which drag takes 0.6 to 0.9
        assert spin_hz(top, 2.95 + k) == pytest.approx(start + 0.2 * k, rel=1e-12)


@pytest.mark.parametrize(("step", "followed"), [(0.95, True), (1.05, False), (-0.95, True), (-1.05, False)])
def test_a_jump_is_followed_within_the_capture_range_only(step, followed):
    top = world()
    top.drive(0.0, "SIN", 30.0, FIELD)
    top.drive(1.0, "SIN", 30.0 + step * CAPTURE, FIELD)
    reached = spin_hz(top, 10.0) == pytest.approx(30.0 + step * CAPTURE, abs=1e-9)
    assert reached is followed


def test_a_top_out_of_the_drives_reach_spins_down_as_if_there_were_none():
    driven, free = world(), world()
    driven.drive(0.0, "SIN", 35.0, FIELD)
    times = np.linspace(0.0, 50.0, 11)
    np.testing.assert_array_equal(driven.motion(times), free.motion(times))


def test_a_drive_that_is_weaker_than_drag_holds_nothing():
    # drag at 30 Hz: C ω^1.5 = 0.61 rad/s², a quarter of the hold at 0.4 mT
    strong, weak = world(), world()
    strong.drive(0.0, "SIN", 30.0, 0.3 * FIELD)
    weak.drive(0.0, "SIN", 30.0, 0.2 * FIELD)
    assert spin_hz(strong, 20.0) == pytest.approx(30.0, rel=1e-15)
    assert spin_hz(weak, 20.0) < 29.0


@pytest.mark.parametrize(("waveform", "fundamental"), [("SIN", 1.0), ("SQU", 4 / math.pi), ("TRI", 8 / math.pi**2)])
def test_a_waveform_holds_with_its_first_harmonic(waveform, fundamental):
    def half_period(phase):
        return {"SIN": np.sin(phase), "SQU": np.ones_like(phase), "TRI": 1 - np.abs(1 - 2 * phase / math.pi)}[waveform]

    # the Fourier coefficient, summed: 2/π ∫ f sin over half a period
    phase = (np.arange(10_000) + 0.5) * math.pi / 10_000
    assert fundamental == pytest.approx(2 * np.mean(half_period(phase) * np.sin(phase)), rel=1e-6)
    reach = 2 * math.sqrt(fundamental * HOLD) / TURN
    for step, followed in ((0.99, True), (1.01, False)):
        top = world()
        top.drive(0.0, waveform, 30.0, FIELD)
        top.drive(1.0, waveform, 30.0 + step * reach, FIELD)
        assert (abs(spin_hz(top, 10.0) - 30.0 - step * reach) < 1e-9) is followed


def test_a_top_let_go_while_it_is_pulled_spins_down_from_there():
    top = world()
    top.drive(0.0, "SIN", 30.0, FIELD)
    top.drive(1.0, "SIN", 30.4, FIELD)
    off(top, 1.5)
    let_go = spin_hz(top, 1.5)
    assert 30.05 < let_go < 30.35
    expected = float(DECAYS["disc"].after(TURN * let_go, 10.0, 2.34e-4)) / TURN
    assert spin_hz(top, 11.5) == pytest.approx(expected, rel=1e-14)


def test_after_the_drive_is_off_the_top_follows_its_law_of_drag():
    top = world()
    top.drive(0.0, "SIN", 30.0, FIELD)
    off(top, 25.0)
    times = np.linspace(25.0, 80.0, 12)
    exact = solve_ivp(
        lambda _, y: [-2.34e-4 * y[0] ** 1.5, y[0]],
        (25.0, 80.0),
        [TURN * 30.0, TURN * 30.0 * 25.0],
        method="DOP853",
        t_eval=times,
        rtol=1e-12,
        atol=1e-12,
    )
    spin, turned = top.motion(times)
    # the integrator's tolerance a step, times some hundred steps
    np.testing.assert_allclose(spin, exact.y[0], rtol=2e-10)
    np.testing.assert_allclose(turned, exact.y[1], rtol=2e-10)


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


@settings(deadline=None, max_examples=60)
@given(changes=CHANGES, drag=st.sampled_from([("disc", (2.34e-4,)), ("stokes", (3.2e-3,)), ("mixed", (1e-3, 1e-5))]))
def test_angle_and_spin_are_continuous_whatever_the_drive_does(changes, drag):
    top = world(replace(QUIET, drag=drag[0], constants=drag[1]))
    now = 0.0
    for wait, waveform, away, amplitude in changes:
        now += wait
        # near the spin that it has, so that it is caught now and then
        top.drive(now, waveform, max(1.0, (spin_hz(top, now) or 30.0) + away), amplitude * FIELD)
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
    top.drive(0.0, "SIN", 30.0, FIELD)
    off(top, 5.0)
    time = 5.0 + float(DECAYS["disc"].elapsed(TURN * 30.0, TURN * QUIET.fall_hz, 2.34e-4))
    assert spin_hz(top, time - 1e-6) == pytest.approx(QUIET.fall_hz, abs=1e-6)
    assert spin_hz(top, time + 1e-6) == 0.0
    # 137 rad/s for two microseconds, and the rounding of an angle of 2e4 rad
    assert angle(top, time + 1e-6) == pytest.approx(angle(top, time - 1e-6), abs=3e-4)
    before, after = top.light(time - 1.0, 1e-4, 9_000), top.light(time + 1e-6, 1e-4, 100_000)
    assert before.max() == pytest.approx(QUIET.bright, abs=0.01)
    assert np.all(after == QUIET.dark)


def test_no_drive_raises_a_top_that_has_fallen():
    top = world()
    for k in range(5):
        top.drive(200.0 + k, "SIN", 30.0 + k, FIELD)
    assert spin_hz(top, 210.0) == 0.0
    assert angle(top, 210.0) == angle(top, 200.0)
    assert np.all(top.light(210.0, 1e-4, 10_000) == QUIET.dark)


def test_a_held_top_does_not_fall():
    top = world()
    top.drive(0.0, "SIN", 30.0, FIELD)
    assert spin_hz(top, 10_000.0) == pytest.approx(30.0, rel=1e-15)


def test_a_top_that_was_never_spun_up_is_dark_from_the_start():
    top = world(replace(QUIET, start_hz=20.0))
    assert np.all(top.light(0.0, 1e-4, 10_000) == QUIET.dark)


# --- the light ---


def test_light_is_one_pulse_a_turn_of_the_width_that_was_asked_for():
    top = world(replace(QUIET, fall_hz=1.0))
    top.drive(0.0, "SIN", 30.0, FIELD)
    step = 1e-6
    light = top.light(0.0, step, 1_000_000)
    half = (QUIET.dark + QUIET.bright) / 2
    rises = np.flatnonzero((light[1:] >= half) & (light[:-1] < half))
    falls = np.flatnonzero((light[1:] < half) & (light[:-1] >= half))
    assert rises.size == falls.size == 30
    # both edges lie on the grid of samples: each to one step
    np.testing.assert_allclose((falls - rises) * step, QUIET.pulse_duty / 30.0, atol=2 * step)
    np.testing.assert_allclose(np.diff(rises) * step, 1 / 30.0, atol=2 * step)


def test_light_depends_on_what_is_asked_and_on_nothing_else():
    top = world(SpinScene(seed=3))
    first = top.light(5.0, 5e-5, 2_000)
    top.light(1.0, 1e-3, 100)
    top.motion(np.array([100.0]))
    np.testing.assert_array_equal(top.light(5.0, 5e-5, 2_000), first)
    # a shorter look is the beginning of a longer one
    np.testing.assert_array_equal(top.light(5.0, 5e-5, 500), first[:500])


def test_the_same_seed_makes_the_same_light_and_another_seed_another():
    lights = [world(drawn(seed)).light(5.0, 5e-5, 2_000) for seed in (7, 7, 8)]
    np.testing.assert_array_equal(lights[0], lights[1])
    assert np.any(lights[0] != lights[2])


def test_the_past_is_not_changed_by_what_the_drive_does_now():
    top = world()
    times = np.linspace(0.0, 9.9, 100)
    before = top.motion(times)
    top.drive(10.0, "SIN", 27.0, FIELD)
    off(top, 12.0)
    np.testing.assert_array_equal(top.motion(times), before)


def test_the_noise_of_the_light_is_as_large_as_asked_for():
    top = world(replace(QUIET, start_hz=20.0, noise=0.01))
    light = top.light(0.0, 5e-5, 40_000)
    # standard errors of mean and standard deviation: 1/√40 000 and 1/√80 000 of 0.01 V; four of them
    assert light.mean() == pytest.approx(QUIET.dark, abs=4 * 0.01 / 200)
    assert light.std() == pytest.approx(0.01, rel=4 / 283)


# --- what is drawn by the seed ---


def test_runs_scatter_as_the_published_ones_do():
    scenes = [drawn(seed) for seed in range(2000)]
    constants = np.array([scene.constants[0] for scene in scenes]) / SpinScene().constants[0] - 1
    falls = np.array([scene.fall_hz for scene in scenes]) - SpinScene().fall_hz
    for scatter, size in ((constants, 0.02), (falls, 0.25)):
        # standard errors of a mean and of a standard deviation from 2000: 2.2 % and 1.6 %; four of them
        assert scatter.mean() == pytest.approx(0.0, abs=4 * size / math.sqrt(2000))
        assert scatter.std() == pytest.approx(size, rel=4 / math.sqrt(4000))
    assert abs(np.corrcoef(constants, falls)[0, 1]) < 4 / math.sqrt(2000)


def test_what_is_drawn_leaves_the_rest_of_the_scene_as_it_was():
    scene = SpinScene(drag="mixed", constants=(1e-3, 1e-5), start_hz=33.0)
    once = drawn(5, scene)
    assert (once.start_hz, once.drag, once.seed) == (33.0, "mixed", 5)
    assert once.constants[0] / 1e-3 == pytest.approx(once.constants[1] / 1e-5, rel=1e-14)
    assert once == drawn(5, scene)


# --- through the counter ---


def test_readings_over_a_second_scatter_as_the_thesiss_do_and_are_unbiased():
    # 30.5 Hz: no edge falls on the end of the gate, where the counter would choose between two of them
    top = world(SpinScene(start_hz=30.5, fall_hz=1.0, seed=1))
    top.drive(0.0, "SIN", 30.5, FIELD)
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
    top.drive(1.0, "SIN", 2.0, 4e-4)
    top.drive(1.3, "SIN", 5.0, 4e-4)
    top.drive(2.0, "SQU", 1.0, 0.0)
    t = 0.01 * np.arange(300)
    seen = top.coil_field(0.0, 0.01, 300)
    phase = np.where(t < 1.3, 2.0 * (t - 1.0), 0.6 + 5.0 * (t - 1.3))
    expected = np.where((t >= 1.0) & (t < 2.0), 4e-4 * np.sin(2 * np.pi * phase), 0.0)
    assert seen == pytest.approx(expected, abs=1e-15)


def test_the_magnetometer_sees_the_base_as_the_simulator_has_it():
    from levilab.simulator.floating import axial_field
    from levilab.simulator.scene import preset

    there = axial_field(preset("undriven"))(np.array([0.072]))[0, 0]
    assert world(SpinScene()).flux_density(3.0) == pytest.approx(there, rel=1e-8)


def test_a_top_that_falls_is_put_back_where_somebody_does_so():
    top = world(SpinScene(again_s=10.0))
    fallen = next(s.start for s in top._stretches if s.rule == "fallen")
    spin, angle = top.motion(np.array([fallen - 1, fallen + 9, fallen + 10.001, fallen + 11 + fallen]))
    assert spin[0] > 0
    assert spin[1] == 0
    assert spin[2] == pytest.approx(2 * np.pi * 30, rel=1e-4)
    assert spin[3] == 0
    assert np.all(np.diff(angle) >= 0)
    top.drive(fallen + 12.0, "SIN", 30.0, FIELD)
    assert top.motion(np.array([fallen + 500.0]))[0] == pytest.approx(2 * np.pi * 30)


def test_else_it_lies_there():
    assert world(SpinScene()).motion(np.array([1e5]))[0] == 0
