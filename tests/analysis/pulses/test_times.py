"""Spin frequency of lists of pulse times, clean and as real switches give them."""

import numpy as np
import pytest

from analysis.errors import NotFinite, TimesNotIncreasing
from analysis.pulses import spin_of_times
from analysis.pulses.errors import TooFewPulses
from analysis.pulses.synthetic import HARD, make


def pulse_times(frequency=30.3, chirp=-0.1, duration=10.0, phase=0.37):
    """Times at which phase + frequency t + chirp t²/2 is whole, by the closed form."""
    turn = np.arange(1, int((frequency + chirp * duration / 2) * duration))
    return (-frequency + np.sqrt(frequency**2 + 2 * chirp * (turn - phase))) / chirp


def names(found):
    return {note.name for note in found.notes}


def test_exact_times_give_the_exact_frequency_and_slope():
    found = spin_of_times(pulse_times())
    assert abs(found.frequency.value - (30.3 - 0.1 * found.reference_time)) < 1e-9  # times are rounded to 1e-15 s
    assert abs(found.chirp.value + 0.1) < 1e-9
    assert abs(found.phase.value - (0.37 + 30.3 * found.reference_time - 0.05 * found.reference_time**2) % 1) < 1e-8
    assert (found.pulses, found.missing, found.doubled, found.method) == (pulse_times().size, 0, 0, "edges")


def test_frequency_and_slope_are_independent_at_the_reference_time():
    random = np.random.default_rng(1)
    times = pulse_times()
    times = times[(times < 3) | (random.uniform(size=times.size) < 0.3)]  # many more pulses at the beginning
    found = [spin_of_times(times + 1e-5 * random.standard_normal(times.size)) for _ in range(300)]
    frequency = [f.frequency.value + 0.1 * f.reference_time for f in found]
    correlation = np.corrcoef(frequency, [f.chirp.value for f in found])[0, 1]
    assert abs(correlation) < 0.17  # 3 standard errors from 300 trials


def test_the_uncertainty_predicts_the_scatter():
    random, pulls = np.random.default_rng(2), []
    for _ in range(400):
        found = spin_of_times(pulse_times() + 1e-4 * random.standard_normal(pulse_times().size))
        pulls.append((found.frequency.value - 30.3 + 0.1 * found.reference_time) / found.frequency.u)
    assert np.std(pulls) == pytest.approx(1, abs=0.12)  # 3 standard errors of a standard deviation, and u's own scatter


@pytest.mark.parametrize(
    ("step", "jitter", "duration", "most"),
    [
        (1e-5, 2e-5, 2.0, 1.7),
        (1e-5, 2e-5, 10.0, 1.7),
        (1e-4, 1e-4, 10.0, 1.7),
        (1e-3, 1e-5, 5.0, 2.5),
        (1e-3, 1e-5, 10.0, 2.5),
    ],
)
def test_rounding_of_intervals_adds_up_in_the_uncertainty(step, jitter, duration, most):
    """Times that are sums of intervals wander; their residuals show a third to a tenth of it."""
    random, pulls = np.random.default_rng(7), []
    for _ in range(200):
        frequency = random.uniform(27, 33)
        times = pulse_times(frequency, duration=duration, phase=random.uniform())
        times += jitter * random.standard_normal(times.size)
        summed = np.cumsum(np.rint(np.diff(times) / step) * step)
        found = spin_of_times(summed, interval_step=step)
        truth = frequency - 0.1 * (found.reference_time + times[1] - summed[0])
        pulls.append((found.frequency.value - truth) / found.frequency.u)
    # 1.0 to 1.5; of whole milliseconds 2.3, as of turns that change by one of them many count as missed
    assert 0.85 < np.sqrt(np.mean(np.square(pulls))) < most


def test_intervals_that_are_differences_of_a_clock_do_not_add_up():
    random, uncertainties = np.random.default_rng(7), []
    for _ in range(40):
        times = pulse_times(random.uniform(27, 33), duration=5.0, phase=random.uniform())
        clock = 1e-3 * np.rint(times / 1e-3)
        uncertainties.append(spin_of_times(np.cumsum(np.diff(clock)), interval_step=1e-3).frequency.u)
    assert np.median(uncertainties) < 0.01  # rounded one by one they would leave 0.09 Hz


def test_equal_intervals_are_known_to_their_step():
    found = spin_of_times(0.033 * np.arange(1, 60), interval_step=1e-3)
    u = 1e-3 / 24**0.5 / 0.033**2  # any place in the step and any slope within it: |place| + |slope| < half a step
    assert found.frequency.u == pytest.approx(u, rel=0.2)  # 8 places and 9 slopes are tried: 0.92


def test_what_moves_pulses_to_and_fro_averages_out_in_the_uncertainty():
    """Hum that is left in a trace at 30 Hz shifts pulses with a period of three turns."""
    random, pulls, swings = np.random.default_rng(7), [], []
    times = pulse_times()
    for _ in range(150):
        swing = 1e-4 * np.sin(2 * np.pi * (50 * times + random.uniform()))
        found = spin_of_times(times + swing + 5e-5 * random.standard_normal(times.size))
        pulls.append((found.frequency.value - 30.3 + 0.1 * found.reference_time) / found.frequency.u)
        swings += [note.name for note in found.notes]
    assert np.std(pulls) == pytest.approx(1, abs=0.2)  # 3 standard errors from 150; without the blocks it is 0.6
    assert swings.count("correlated") > 100


def test_few_pulses_widen_the_uncertainty_to_68_per_cent():
    random, times = np.random.default_rng(3), np.arange(6) / 30
    found = [spin_of_times(times + 1e-4 * random.standard_normal(6)) for _ in range(500)]
    covered = np.mean([abs(f.frequency.value - 30) < f.frequency.u for f in found])
    assert covered == pytest.approx(0.683, abs=0.063)  # 3 standard errors; without Student's t it would be 0.61


@pytest.mark.parametrize("jitter", [2e-6, 2e-5, 2e-4])
def test_tops_that_swing_have_the_bend_in_value_and_uncertainty(jitter):
    """Of half of the tops 61 pulses show no bend, of the others one of 1e-3 to 2 Hz/s², each decade as often."""
    random, pulls = np.random.default_rng(3), []
    turns = np.arange(-30.0, 31.0)
    for i in range(300):
        bend = 10 ** random.uniform(-3, 0.3) * (i % 2)
        times = turns / 30
        for _ in range(5):
            times = times - (30 * times + bend * times**3 / 6 - turns) / (30 + bend * times**2 / 2)
        found = spin_of_times(times + jitter * random.standard_normal(times.size))
        pulls.append((found.frequency.value - 30 - bend * found.reference_time**2 / 2) / found.frequency.u)
    assert np.std(pulls) == pytest.approx(1, abs=0.25)  # 0.12 are 3 standard errors; the sum of normals has long tails
    assert np.mean(np.abs(pulls) < 1) == pytest.approx(0.68, abs=0.09)
    assert np.mean(np.abs(pulls) < 3) > 0.96


def test_uncertainties_have_no_step_as_the_noise_grows():
    """One pattern of noise, scaled: a bend of 0.3 Hz/s² goes from certain to unseen, and u is smooth all the way."""
    turns = np.arange(-30.0, 31.0)
    times = turns / 30 - 0.3 * (turns / 30) ** 3 / 180
    pattern = np.random.default_rng(5).standard_normal(times.size)
    scales = np.geomspace(1e-6, 2e-4, 115)
    found = [spin_of_times(times + scale * pattern) for scale in scales]
    u = np.array([each.frequency.u for each in found])
    assert np.abs(np.diff(np.log(u))).max() < 0.1  # the noise grows by 4.7 % from one to the next


def test_missing_doubled_and_wrong_pulses_are_counted():
    random, times = np.random.default_rng(4), pulse_times()
    kept = np.delete(times, random.choice(np.arange(1, times.size - 1), 100, replace=False))
    found = spin_of_times(np.sort(np.concatenate([kept, random.uniform(0.1, 9.9, 20)])))
    assert abs(found.frequency.value - (30.3 - 0.1 * found.reference_time)) < 1e-6
    assert found.missing == pytest.approx(100, abs=2)  # a random time may lie where a pulse is missing
    assert found.doubled == pytest.approx(20, abs=2)
    assert {"missing", "doubled"} <= names(found)


def test_a_switch_that_spoils_half_of_the_turns_is_stood():
    random, pulls, wrong = np.random.default_rng(5), [], []
    for _ in range(40):
        trace = make(HARD["a switch that bounces, times"], random)
        found = spin_of_times(trace.samples)
        pulls.append((found.frequency.value - trace.truth(found.reference_time)) / found.frequency.u)
        wrong.append(np.mean(np.abs(np.diff(trace.samples) * found.frequency.value - 1) > 0.2))
    assert np.mean(wrong) > 0.5  # of the recorded turns
    assert np.abs(pulls).max() < 5
    assert np.std(pulls) == pytest.approx(1, abs=0.34)  # 3 standard errors from 40


def test_the_bend_of_a_long_record_is_found():
    grid = np.linspace(0, 20, 200001)
    phase = 30 * (1 - np.exp(-0.004 * grid)) / 0.004
    times = np.interp(np.arange(1, int(phase[-1])), phase, grid)
    found = spin_of_times(times + 1e-6 * np.random.default_rng(6).standard_normal(times.size))
    truth = 30 * np.exp(-0.004 * found.reference_time)
    assert abs(found.frequency.value / truth - 1) < 3e-6  # the part of the fourth degree
    assert found.bend.value == pytest.approx(0.004**2 * truth, rel=0.01)
    assert abs(spin_of_times(times, degree=2).frequency.value / truth - 1) > 5e-5


@pytest.mark.parametrize("power", [0.0, 1.0, 1.5, 2.0])
def test_pulses_that_know_the_bend_better_than_a_drag_does_decide_it(power):
    """ν′ = −0.1 Hz/s (ν/30 Hz)^n over 11.5 s; n = 0, an even ramp, is three standard uncertainties from any drag."""
    pulls, random = [], np.random.default_rng(4)
    turns = np.arange(345.0)
    rates = np.linspace(31.0, 28.0, 20001)
    passed = np.concatenate(
        [[0], np.cumsum(np.diff(rates) * -0.5 * ((r := rates / (0.1 * (rates / 30) ** power))[1:] + r[:-1]))]
    )
    clock = np.concatenate(
        [[0], np.cumsum(np.diff(rates) * -0.5 * ((r := 1 / (0.1 * (rates / 30) ** power))[1:] + r[:-1]))]
    )
    times = np.interp(turns, passed, clock)
    for _ in range(60):
        found = spin_of_times(times + 1e-5 * random.standard_normal(times.size))
        truth = np.interp(found.reference_time, clock, rates)
        pulls.append((found.frequency.value - truth) / found.frequency.u)
        assert found.frequency.u < 1e-4
    assert np.mean(pulls) == pytest.approx(0, abs=0.6)  # 0.39 are 3 standard errors; the prior moves n = 0 by the rest
    assert np.std(pulls) == pytest.approx(1, abs=0.28)


@pytest.mark.parametrize("missing", [0, 100])
def test_the_frequency_at_another_time_follows_the_whole_polynomial(missing):
    """Its value and its u, by numpy's fit of a polynomial to the turns; missed pulses make the middle no middle."""
    grid = np.linspace(0, 20, 200001)
    turns = np.arange(1, 500)
    times = np.interp(turns, 30 * grid - 0.06 * grid**2 + 1e-3 * grid**3, grid)
    times += 1e-5 * np.random.default_rng(6).standard_normal(times.size)
    turns, times = (np.delete(column, slice(300, 300 + missing)) for column in (turns, times))
    found = spin_of_times(times)
    coefficients, covariance = np.polyfit(times - 9.0, turns, 3, cov=True)
    ratios = []
    for time in (0.0, 4.0, found.reference_time, 15.0, 25.0):
        along = np.array([3 * (time - 9.0) ** 2, 2 * (time - 9.0), 1.0, 0.0])
        at = found.at(time)
        assert at.value == pytest.approx(along @ coefficients, rel=1e-7)
        ratios.append(at.u / np.sqrt(along @ covariance @ along))
    assert ratios == pytest.approx(5 * [ratios[0]], rel=0.02)  # the prior of the bend
    assert ratios[0] == pytest.approx(1, abs=0.3)  # of the scatter over long times, by 45 blocks: 3 standard errors


def sound_lists(random):
    """Lists without a jump: swings about a drive, coloured jitter, rounded times, a drive that is switched."""
    time = np.linspace(0, (length := random.choice([0.6, 2.0, 12.0])), round(2000 * length) + 1)
    spin, start, jitter = random.uniform(22, 45), random.uniform(), 10 ** random.uniform(-6, -3)

    def passes(turns, noise=jitter):
        number = np.arange(np.ceil(turns[0] + start), np.floor(turns[-1] + start))
        return np.interp(number, turns + start, time) + noise * random.standard_normal(number.size)

    coasting = spin * time - random.uniform(0.03, 0.2) * time**2 / 2
    swing = 10 ** random.uniform(-3, -0.5) * np.sin(2 * np.pi * 0.33 * time + random.uniform(0, 6))
    switched = random.uniform(0.1, 0.9) * length
    yield passes(coasting)
    yield passes(spin * time + swing)
    walk = np.cumsum(1e-5 * random.standard_normal((times := passes(coasting)).size))
    yield times + walk
    yield np.round(passes(coasting, 0.0) / 1e-4) * 1e-4
    yield passes(spin * time - 0.05 * np.maximum(time - switched, 0) ** 2)
    yield passes(spin * time - 0.1 * np.maximum(switched - time, 0) ** 2)


def test_sound_lists_have_no_jump():
    jumps = 0
    for seed in range(100):
        for times in sound_lists(np.random.default_rng([seed, 9])):
            jumps += "jump" in names(spin_of_times(np.unique(times)))
    assert jumps <= 3  # of 600; 7 of 10 600 in a longer study, most where a drive is switched


@pytest.mark.parametrize("lost", [2e-4, 5e-4, -2e-4])
def test_what_is_left_of_a_lost_buffer_beside_whole_turns_is_a_jump(lost):
    """With none below 1 ms, u was a quarter and less of the error of 0.2 and 0.5 ms."""
    pulls = []
    for seed in range(8):
        times = pulse_times()
        times = times + 1e-5 * np.random.default_rng(seed).standard_normal(times.size)
        found = spin_of_times(np.where(times > 4.0, times - lost, times))
        assert "jump" in names(found)
        pulls.append((found.frequency.value - 30.3 + 0.1 * found.reference_time) / found.frequency.u)
    assert np.abs(pulls).max() < 4


def test_a_jump_takes_turns_that_were_lost_with_it():
    """46 ms, a buffer of 2048 samples, are 1.4 turns: a slope of -0.3 Hz/s shows the whole one."""
    times = pulse_times(chirp=-0.3) + 1e-5 * np.random.default_rng(1).standard_normal(pulse_times(chirp=-0.3).size)
    late = times > 4.0 + 0.046
    found = spin_of_times(np.concatenate([times[times <= 4.0], times[late] - 0.046]))
    assert "jump" in names(found)
    assert found.missing in {1, 2}
    assert abs(found.frequency.value - 30.3 + 0.3 * found.reference_time) < 4 * found.frequency.u


def test_wrong_lists_are_refused_with_the_reason():
    with pytest.raises(TooFewPulses, match=r"3 pulses in 0\.2 s, at least 4 are needed"):
        spin_of_times([0.0, 0.1, 0.2])
    with pytest.raises(NotFinite, match="pulse time number 2"):
        spin_of_times([0.0, np.nan, 0.2, 0.3, 0.4])
    with pytest.raises(TimesNotIncreasing):
        spin_of_times([0.0, 0.2, 0.1, 0.3, 0.4])


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0])
def test_few_noisy_pulses_leave_the_bend_to_the_drag(power):
    """ν′ = −1 Hz/s (ν/30 Hz)^n over 2 s; the parabola alone is off by ν″T²/40."""
    slope, spin, random, pulls = -1.0, 30.0, np.random.default_rng(1), []
    change = power * slope**2 / spin
    t = np.linspace(-1.0, 1.0, 4001)
    turns = spin * t + slope * t**2 / 2 + change * t**3 / 6
    whole = np.arange(np.ceil(turns[0]), np.floor(turns[-1]) + 1)
    times = np.interp(whole, turns, t)
    parabola = spin_of_times(times, degree=2)
    assert parabola.frequency.value - spin - slope * parabola.reference_time == pytest.approx(change * 4 / 40, rel=0.1)
    for _ in range(100):
        found = spin_of_times(times + 3e-4 * random.standard_normal(times.size))
        pulls.append((found.frequency.value - spin - slope * found.reference_time) / found.frequency.u)
    # drags of 1 and 2 are one standard uncertainty of the prior from 1.5; the parabola's pull is 1.5 to 3
    assert np.mean(pulls) == pytest.approx(0, abs=0.3 if power == 1.5 else 0.9)
    assert np.std(pulls) == pytest.approx(0.9, abs=0.25)


@pytest.mark.parametrize("power", [1.25, 1.5, 1.75])
def test_the_slope_allows_for_how_the_bend_changes(power):
    """Pulses under ν′ = −cνⁿ in closed form: dφ/dν = −ν^(1 − n)/c.  A fit alone gives the slope ν‴T²/56 too high."""
    first, slope = 30.0, -0.3
    c = -slope / first**power
    turns = np.arange(300)
    spins = (first ** (2 - power) - c * (2 - power) * turns) ** (1 / (2 - power))
    times = (spins ** (1 - power) - first ** (1 - power)) / (c * (power - 1))
    times += np.random.default_rng(2).normal(0, 1e-8, times.size)
    plain, found = spin_of_times(times, degree=3), spin_of_times(times)
    spin = (first ** (1 - power) + c * (power - 1) * found.reference_time) ** (1 / (1 - power))
    truth = -c * spin**power
    bias = power * (2 * power - 1) * truth**3 / spin**2 * times[-1] ** 2 / 56
    assert plain.chirp.value - truth == pytest.approx(bias, rel=0.1)
    assert found.chirp.value == pytest.approx(truth, abs=0.1 * abs(bias))
