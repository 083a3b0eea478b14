"""Gates of a counter: the rate of a top that swings, its uncertainty, and gates that miscounted."""

import numpy as np
import pytest

from analysis.precession.gates import Gates, rates_at_point, shared_scatter, swing_of, whole_counts

SWING_HZ, SIZE = 0.3, 0.25


def counted(random, rate, *, jitter=0.05, count=10, size=SIZE):
    """Gates of about a second of a top that swings; the pulses at both ends scatter by jitter [turns]."""
    length, pause = random.uniform(0.75, 1.25, count), random.uniform(0.05, 0.15, count)
    begin = np.cumsum(length + pause) - length
    end, crest = begin + length, random.uniform(0, 1 / SWING_HZ)
    swing = [size * np.cos(2 * np.pi * SWING_HZ * (times - crest)) for times in (begin, end)]
    periods = rate * length + swing[1] - swing[0] + jitter * random.standard_normal((2, count)).sum(axis=0)
    return Gates(begin, end, periods / length)


def sweep(seed):
    random = np.random.default_rng(seed)
    drive = np.arange(44.0, 27.0, -2.0)
    rates = [rates_at_point(counted(random, f, jitter=0.005), counted(random, f))[1] for f in drive]
    return drive, rates


def test_the_uncertainty_of_a_swinging_tops_rate_predicts_its_scatter():
    pulls, naive = [], []
    for seed in range(20):
        drive, rates = sweep(seed)
        off = np.array([rate.value for rate in rates]) - drive
        pulls += (off / (shared_scatter(rates, drive) * [rate.per_scatter for rate in rates])).tolist()
        naive.append(np.std(off))
    # three standard errors of a standard deviation, and of a mean, from 180
    assert np.std(pulls) == pytest.approx(1, abs=0.16)
    assert abs(np.mean(pulls)) < 0.23
    # the swing by itself moves the periods in a gate by ±0.4, which over √10 would be 0.1 Hz
    assert np.median(naive) < 0.035


def test_a_swing_is_known_by_its_phase_and_is_none_where_there_is_none():
    random = np.random.default_rng(3)
    gates = counted(random, 38.0, jitter=0.005)
    swing = swing_of(gates)
    assert swing.frequency == pytest.approx(SWING_HZ, abs=0.02)
    assert swing.size == pytest.approx(SIZE, abs=0.03)
    model = [swing.size * np.cos(2 * np.pi * swing.frequency * (t - swing.crest)) for t in (gates.begin, gates.end)]
    np.testing.assert_allclose(model[1] - model[0], gates.periods - 38.0 * gates.length, atol=0.05)
    assert swing_of(counted(random, 38.0, jitter=0.05, size=0.0)) is None
    assert swing_of(counted(random, 38.0, count=5)) is None


def test_a_gate_that_lost_a_pulse_is_left_out_and_one_that_scatters_stays():
    random = np.random.default_rng(5)
    spin, laser = counted(random, 38.0, jitter=0.005), counted(random, 38.0)
    wrong = laser.frequency.copy()
    wrong[3] -= 1 / laser.length[3]
    wrong[7] = np.nan
    found = rates_at_point(spin, Gates(laser.begin, laser.end, wrong))[1]
    assert found.wrong == ((3, -1),)
    assert found.missing == 1
    assert found.value == pytest.approx(38.0, abs=4 * found.u)
    assert rates_at_point(spin, laser)[1].wrong == ()
    few = Gates(laser.begin[:3], laser.end[:3], laser.frequency[:3])
    assert rates_at_point(few, few)[1].freedom == 2


def test_whole_counts_are_distinguished_from_another_rate_by_gates_of_different_length():
    laser = counted(np.random.default_rng(6), 38.0, size=0.0)
    missed = Gates(laser.begin, laser.end, laser.frequency - 1 / laser.length)
    assert whole_counts(missed, 38.0) == -1
    assert whole_counts(laser, 39.0) == 0  # a rate that is 1 Hz off is no miscount
    assert whole_counts(laser, 38.0) == 0
