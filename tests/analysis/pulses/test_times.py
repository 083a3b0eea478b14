"""Spin frequency of lists of pulse times, clean and as real switches give them."""

import numpy as np
import pytest

from analysis.errors import NotFinite, TimesNotIncreasing, TooFewPulses
from analysis.pulses import spin_of_times
from levilab.benchmark.estimators.traces import HARD, make


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


def test_what_moves_pulses_to_and_fro_averages_out_in_the_uncertainty():
    """Hum that is left in a trace at 30 Hz shifts pulses with a period of three turns."""
    random, pulls, swings = np.random.default_rng(7), [], []
    times = pulse_times()
    for _ in range(150):
        swing = 1e-4 * np.sin(2 * np.pi * (50 * times + random.uniform()))
        found = spin_of_times(times + swing + 5e-5 * random.standard_normal(times.size))
        pulls.append((found.frequency.value - 30.3 + 0.1 * found.reference_time) / found.frequency.u)
        swings += [note.text for note in found.notes if note.name == "correlated"]
    assert np.std(pulls) == pytest.approx(1, abs=0.2)  # 3 standard errors from 150; without the blocks it is 0.6
    assert "neighbouring pulses differ from each other, which averages out: variance x 0.3" in swings[0]


def test_few_pulses_widen_the_uncertainty_to_68_per_cent():
    random, times = np.random.default_rng(3), np.arange(6) / 30
    found = [spin_of_times(times + 1e-4 * random.standard_normal(6)) for _ in range(500)]
    covered = np.mean([abs(f.frequency.value - 30) < f.frequency.u for f in found])
    assert covered == pytest.approx(0.683, abs=0.063)  # 3 standard errors; without Student's t it would be 0.61


def test_a_bend_that_is_too_small_to_be_fitted_is_in_the_uncertainty():
    """Of a top that swings about its drive: 19 pulses show a bend of five standard uncertainties, or nearly."""
    random, pulls, fitted = np.random.default_rng(3), [], 0
    turns = np.arange(-9.0, 10.0)
    times = turns / 30
    bend = 5 * 6 * 30 * 1e-4 * np.sqrt(np.linalg.inv((a := np.vander(times, 4, increasing=True)).T @ a)[3, 3])
    for _ in range(5):
        times = times - (30 * times + bend * times**3 / 6 - turns) / (30 + bend * times**2 / 2)
    for _ in range(150):
        found = spin_of_times(times + 1e-4 * random.standard_normal(19)).under_drag()
        pulls.append((found.frequency.value - 30 - bend * found.reference_time**2 / 2) / found.frequency.u)
        fitted += found.bend is not None
    assert 30 < fitted < 90  # the others have a parabola, off by 11 times what its residuals show
    assert np.std(pulls) < 2.1  # without the part of the bend 4.2
    assert np.mean(np.abs(pulls) < 2) > 0.7  # without it 0.36


def test_a_bend_that_is_none_widens_the_uncertainty_by_little():
    random, times, pulls = np.random.default_rng(3), np.arange(19) / 30, []
    for _ in range(300):
        plain = spin_of_times(times + 1e-4 * random.standard_normal(19))
        found = plain.under_drag()
        pulls.append((found.frequency.value - 30) / found.frequency.u)
    assert np.std(pulls) == pytest.approx(1.04, abs=0.15)  # Student's t of 16; 3 standard errors


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


def test_a_slope_that_changes_is_fitted_with_a_third_degree():
    grid = np.linspace(0, 20, 200001)
    phase = 30 * (1 - np.exp(-0.004 * grid)) / 0.004
    times = np.interp(np.arange(1, int(phase[-1])), phase, grid)
    found = spin_of_times(times + 1e-6 * np.random.default_rng(6).standard_normal(times.size))
    assert "curved" in names(found)
    truth = 30 * np.exp(-0.004 * found.reference_time)
    assert abs(found.frequency.value / truth - 1) < 3e-6  # what the fourth degree leaves
    assert abs(spin_of_times(times, degree=2).frequency.value / truth - 1) > 5e-5


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
    for time in (0.0, 4.0, found.reference_time, 15.0, 25.0):
        along = np.array([3 * (time - 9.0) ** 2, 2 * (time - 9.0), 1.0, 0.0])
        at = found.at(time)
        assert at.value == pytest.approx(along @ coefficients, rel=1e-9)
        assert at.u == pytest.approx(np.sqrt(along @ covariance @ along), rel=0.02)  # Student's factor of 200 and more


def test_wrong_lists_are_refused_with_the_reason():
    with pytest.raises(TooFewPulses, match=r"3 pulses in 0\.2 s, at least 4 are needed"):
        spin_of_times([0.0, 0.1, 0.2])
    with pytest.raises(NotFinite, match="pulse time number 2"):
        spin_of_times([0.0, np.nan, 0.2, 0.3, 0.4])
    with pytest.raises(TimesNotIncreasing):
        spin_of_times([0.0, 0.2, 0.1, 0.3, 0.4])


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0])
def test_a_slope_that_changes_as_under_drag_is_allowed_for(power):
    """ν′ = −0.1 Hz/s (ν/30 Hz)^n over 4 s, to the third order of time; the parabola alone is off by ν″T²/40."""
    slope, spin = -0.1, 30.0
    change = power * slope**2 / spin
    t = np.linspace(-2.0, 2.0, 4001)
    turns = spin * t + slope * t**2 / 2 + change * t**3 / 6
    whole = np.arange(np.ceil(turns[0]), np.floor(turns[-1]) + 1)
    times = np.interp(whole, turns, t) + np.random.default_rng(1).normal(0, 1e-7, whole.size)
    plain = spin_of_times(times, degree=2)
    found = plain.under_drag()
    truth = spin + slope * found.reference_time
    assert found.frequency.u == pytest.approx(0.5 * slope**2 / spin * 16 / 40, rel=0.05)  # 0.5 ν′²/ν T²/40
    assert abs(found.frequency.value - truth) < 2 * found.frequency.u
    assert abs(plain.frequency.value - truth) == pytest.approx(change * 16 / 40, abs=2e-6)


@pytest.mark.parametrize(("power", "degree"), [(1.25, 2), (1.25, 3), (1.5, 2), (1.5, 3), (1.75, 3)])
def test_the_chirp_under_drag_allows_for_how_the_bend_changes(power, degree):
    """Pulses under ν′ = −cνⁿ in closed form: dφ/dν = −ν^(1 − n)/c.  A fit alone gives the slope ν‴T²/56 too high."""
    first, slope = 30.0, -0.3
    c = -slope / first**power
    turns = np.arange(300)
    spins = (first ** (2 - power) - c * (2 - power) * turns) ** (1 / (2 - power))
    times = (spins ** (1 - power) - first ** (1 - power)) / (c * (power - 1))
    plain = spin_of_times(times + np.random.default_rng(2).normal(0, 1e-8, times.size), degree=degree)
    found = plain.under_drag()
    spin = (first ** (1 - power) + c * (power - 1) * found.reference_time) ** (1 / (1 - power))
    truth = -c * spin**power
    bias = power * (2 * power - 1) * truth**3 / spin**2 * times[-1] ** 2 / 56
    if degree == 3:  # with a parabola the bend, too, moves the slope a little, as the pulses are not even in time
        assert plain.chirp.value - truth == pytest.approx(bias, rel=0.1)
        assert found.chirp.value == pytest.approx(truth, abs=0.1 * abs(bias))
    assert abs(found.chirp.value - truth) < 3 * found.chirp.u
