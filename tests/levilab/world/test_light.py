"""What the phototransistors see, against closed forms and other libraries."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from instruments.virtual.core.signal import crossings
from instruments.virtual.counter.edges import Thresholds
from levilab.world.light import Laser, Tape, error_function, low_pass, noise

TURN = 2 * np.pi


# --- the phototransistor's pole ---


def test_a_pole_answers_a_sine_as_the_textbook_says():
    # H = 1/(1 + i f/f₀); the sine is taken as straight between samples: (2π f step)²/12 of it
    step, corner, frequency = 1e-5, 400.0, 300.0
    times = step * np.arange(20_000)
    answer = low_pass(np.sin(TURN * frequency * times), step, corner)
    gain = 1 / (1 + 1j * frequency / corner)
    expected = np.imag(gain * np.exp(1j * TURN * frequency * times))
    settled = times > 15 / (TURN * corner)
    np.testing.assert_allclose(answer[settled], expected[settled], atol=(TURN * frequency * step) ** 2 / 12)


def test_a_pole_answers_a_step_exponentially_however_coarse_the_samples():
    step, corner = 2.5e-4, 1e3
    signal = np.concatenate((np.zeros(3), np.ones(10)))  # straight between: a ramp of one step
    tau = 1 / (TURN * corner)
    times = step * np.arange(1, 11)
    expected = 1 - tau / step * np.exp(-(times - step) / tau) * -np.expm1(-step / tau)
    np.testing.assert_allclose(low_pass(signal, step, corner)[3:], expected, rtol=1e-12)


# --- the tape ---


@pytest.mark.parametrize("bandwidth", [10e3, 400.0, 15.0])
def test_a_pulse_behind_the_phototransistor_is_the_convolution(bandwidth):
    tape, hertz = Tape(bandwidth_hz=bandwidth), 30.0
    tau = 1 / (TURN * bandwidth)
    turns = np.linspace(-0.5, 0.499, 60)

    def behind(turn):
        late = lambda s: np.exp(-0.5 * ((((turn - hertz * s) % 1) - 0.5) / tape.sigma) ** 2) * np.exp(-s / tau) / tau  # noqa: E731
        stops = [s for k in range(-1, 5) if (s := (turn - 0.5 + k) / hertz) > 0]
        reach = 14 * tau
        return quad(late, 0, reach, points=[s for s in stops if s < reach] or None, limit=200, epsabs=1e-9)[0]

    expected = [behind(turn) for turn in turns]
    # the error function's 1.2e-7, times q; and what a fourteenth part of 15 Hz leaves behind, e^-14
    np.testing.assert_allclose(tape.pulse(turns, np.full(60, hertz)), expected, atol=3e-6)


def test_a_pulse_is_as_long_as_the_tape_is_wide_and_comes_late_by_the_pole():
    tape = Tape(width=0.05)
    turns = np.linspace(0, 1, 1_000_001)
    bright = np.flatnonzero(tape.pulse(turns, np.full(turns.shape, 40.0)) > 0.5)
    # late by τ; the pole makes it longer by (τ/σ)²/2, 4e-4
    assert np.ptp(bright) * 1e-6 == pytest.approx(0.05, rel=1e-3)
    assert bright.mean() * 1e-6 == pytest.approx(0.5 + 40.0 * tape.delay, abs=2e-6)


def test_the_voltage_saturates_and_has_the_lamps_ripple():
    turns = np.full(2001, 0.5)
    times = np.linspace(0.0, 0.1, 2001)
    at_rest = {"bandwidth_hz": 1e9, "noise": 0.0}
    bright = Tape(saturation=1.0, **at_rest).mean_voltage(turns, np.ones(2001), times)
    np.testing.assert_allclose(bright, 1.0)
    rippled = Tape(ripple=0.2, **at_rest).mean_voltage(turns, np.ones(2001), times)
    np.testing.assert_allclose(rippled, 1.2 * (1 + 0.2 * np.sin(TURN * 100.0 * times)), rtol=1e-6)


@pytest.mark.parametrize(
    ("tape", "fire"),
    [(Tape(), 0.12), (Tape(), 1.17), (Tape(noise=0.02), 0.6), (Tape(ripple=0.1), 0.6), (Tape(bandwidth_hz=50.0), 0.6)],
    ids=["in the noise", "at the top", "much noise", "ripple", "slow"],
)
def test_where_a_trigger_fires_is_not_said_where_only_the_trace_can(tape, fire):
    assert tape.offset(Thresholds(fire, fire - 0.04), 30.0) is None
    assert Tape().offset(Thresholds(0.6, 0.56), 30.0) is not None


# --- noise ---


def test_noise_is_the_same_however_a_record_is_cut():
    times = 123.4567891 + 3.7e-6 * np.arange(20_000)
    whole = noise(times, (3, 1))
    np.testing.assert_array_equal(noise(times[7_000:], (3, 1)), whole[7_000:])
    # rounding of a time moves it by 1e-14 s of the 5 µs for which noise is drawn
    np.testing.assert_allclose(noise(times[7_000] + 3.7e-6 * np.arange(13_000), (3, 1)), whole[7_000:], atol=1e-6)


@pytest.mark.parametrize("step", [50e-6, 3.3e-5])
def test_noise_is_white_and_another_with_another_seed(step):
    n = 100_000
    one, other = (noise(-1.0 + step * np.arange(n), (seed, 1)) for seed in (1, 2))
    # standard errors 1/√n, 1/√(2n); four of them
    assert one.mean() == pytest.approx(0.0, abs=4 / np.sqrt(n))
    assert one.std() == pytest.approx(1.0, abs=4 / np.sqrt(2 * n))
    for later in (one[1:], one[2:], other):
        assert abs(np.corrcoef(one[: later.size], later)[0, 1]) < 4 / np.sqrt(n)


# --- the laser ---


def test_the_error_function_is_that_of_another_library():
    x = np.linspace(-6, 6, 1001)
    np.testing.assert_allclose(error_function(x), erf(x), atol=1.2e-7)  # its error in the book


def test_the_stem_blocks_what_a_gaussian_beam_has_there():
    laser = Laser(offset_m=0.006, waist_m=0.010, stem_radius_m=0.003)
    profile = lambda x: np.sqrt(2 / np.pi) / 0.010 * np.exp(-2 * (x / 0.010) ** 2)  # noqa: E731
    for place in (-0.02, 0.0, 0.004, 0.006, 0.012):
        blocked, _ = quad(profile, place - 0.006 - 0.003, place - 0.006 + 0.003)
        assert laser.light(np.array([place]))[0] == pytest.approx(1 - blocked, abs=2e-7)


def pulses_a_turn(laser, radius, hertz=30.0):
    """Cuts of a stem that goes round in a circle of this radius [m]."""
    times = 1.0 + 5e-5 * np.arange(40_000)
    circle = lambda t: (radius * np.cos(TURN * hertz * t), np.ones(t.shape, bool))  # noqa: E731
    voltage = laser.voltage(times, circle, seed=1)
    return crossings(-voltage, -(laser.dark + laser.bright) / 2, 0.04).size / (2.0 * hertz)


@pytest.mark.parametrize(("radius", "expected"), [(0.5e-3, 0.0), (2e-3, 1.0), (6e-3, 2.0)])
def test_a_narrow_beam_is_missed_cut_once_or_cut_twice(radius, expected):
    # the stem fills the beam between 1 mm and 3 mm, and has passed it beyond
    narrow = Laser(offset_m=2e-3, waist_m=2e-4, stem_radius_m=1e-3, coupling_hz=None, gain=1.1)
    assert pulses_a_turn(narrow, radius) == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("radius", [0.2e-3, 0.6e-3, 3e-3])
def test_the_beam_as_it_is_set_up_is_cut_once_a_turn(radius):
    assert pulses_a_turn(Laser(), radius) == pytest.approx(1.0, abs=0.02)


def test_without_a_capacitor_the_voltage_is_that_of_the_light():
    laser = Laser(coupling_hz=None, gain=1.0, noise=0.0)
    times = 5e-5 * np.arange(1000)
    slow = lambda t: (1e-3 * np.cos(TURN * t), t < 0.03)  # noqa: E731
    there = times < 0.029
    expected = 0.1 + laser.light(slow(times)[0])
    np.testing.assert_allclose(laser.voltage(times, slow, 0)[there], expected[there], atol=2e-5)  # 16 µs late
    assert laser.voltage(times, slow, 0)[-1] == pytest.approx(1.1)  # no top: the whole beam


def test_the_laser_depends_on_time_and_on_nothing_else():
    wobble = lambda t: (1e-3 * np.cos(200 * t) + 2e-3 * np.cos(5 * t), np.ones(t.shape, bool))  # noqa: E731
    whole = Laser().voltage(0.3 + 5e-5 * np.arange(8000), wobble, 7)
    part = Laser().voltage(0.3 + 5e-5 * np.arange(3000, 8000), wobble, 7)
    np.testing.assert_allclose(part, whole[3000:], atol=1e-7)
