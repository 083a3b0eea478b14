"""The tape of a held top beside its drive, and how a drive loses a top."""

import math

import numpy as np
import pytest

from analysis.errors import TooFewReadings
from analysis.locked import Cause, cause_of_loss, lag_before_loss, slip_of


def test_a_tape_that_turns_with_the_drive_is_not_warned_of():
    """One false alarm in 10 000 is expected of four standard uncertainties; 300 draws have none, of any swing."""
    random = np.random.default_rng(2)
    for _ in range(300):
        swing = 0.3 * np.sin(2 * np.pi * (0.3 * np.arange(20) + random.uniform()))
        counts = 30 + random.uniform(0, 1) * swing + 0.03 * random.standard_normal(20)
        assert not slip_of(counts.tolist(), 30.0).significant


def test_a_tape_that_lags_or_leads_differs_from_the_drive():
    noise = 0.05 * np.random.default_rng(3).standard_normal(20)
    slow = slip_of((30 - 0.17 + noise).tolist(), 30.0)
    assert slow.difference == pytest.approx(-0.17, abs=4 * slow.u)
    fast = slip_of((30 + 0.17 + noise).tolist(), 30.0)
    assert slow.significant
    assert fast.significant


def test_the_drive_may_creep_meanwhile():
    drives = np.linspace(40, 42, 20)
    assert slip_of((drives - 0.2).tolist(), drives.tolist()).difference == pytest.approx(-0.2)
    with pytest.raises(TooFewReadings):
        slip_of([30.0], 30.0)


def counts_of_a_pendulum(load, swing_hz, random):
    """Return ends of gates [s] and counts less the drive [Hz] of a moment under a pull of 2.5 rad/s²; to 1 Hz behind.

    load: of drag, as a part of the pull at the end; it grows by 0.2 % a second.
    """
    step, gate, pull = 0.01, 0.5, 2.5
    lag, rate, ends, offs = math.asin(min(load - 0.1, 0.99)), 2 * np.pi * swing_hz * random.choice([-1, 1]), [], []
    for k in range(1, round(60 / gate) + 1):
        before = lag
        for j in range(round(gate / step)):
            part = min(load - 0.1 + 0.002 * ((k - 1) * gate + j * step), load)
            rate += step * pull * (part - math.sin(lag))
            lag += step * rate
        ends.append(k * gate)
        offs.append(-(lag - before) / (2 * np.pi * gate) + 0.06 * random.standard_normal())
        if offs[-1] < -1:
            break
    return ends, offs


def test_the_lag_before_a_loss_tells_a_lost_lock_from_one_that_held():
    """A phototransistor that scatters by 0.03 turns a count, and a swing of up to 0.15 Hz about the drive."""
    random = np.random.default_rng(5)
    for fell, load, cause in ((True, 0.7, Cause.OUT_OF_WINDOW), (False, 1.08, Cause.LEFT_BEHIND)):
        found = []
        for _ in range(100):
            ends, offs = counts_of_a_pendulum(load, random.uniform(0, 0.15), random)
            assert (offs[-1] < -1) is not fell  # the pendulum itself knows which it was
            lag = lag_before_loss(ends, (60 + np.array(offs)).tolist(), [60.0] * len(ends))
            found.append(cause_of_loss(lag, fell=fell))
        assert found.count(cause) >= 99, cause


def test_a_tape_that_slips_all_the_time_is_not_left_behind():
    ends = np.arange(0.5, 40.0, 0.5)
    spins = 60.0 - 0.25 + 0.03 * np.random.default_rng(6).standard_normal(ends.size)
    assert lag_before_loss(ends.tolist(), spins.tolist(), [60.0] * ends.size) < 0.3  # it slips by 2.5 turns in 10 s


def test_a_lead_before_is_not_taken_off_the_lag():
    ends, spins = np.arange(0.5, 40.5, 0.5), np.full(80, 60.0)
    spins[-20:-10] += 0.2  # a turn ahead in 5 s, then a turn behind
    spins[-10:] -= 0.2
    assert lag_before_loss(ends.tolist(), spins.tolist(), [60.0] * 80) == pytest.approx(1.0)


def test_of_a_time_without_counts_no_lag_is_known():
    ends = [0.5, 1.0, 1.5, 2.0, 9.0, 9.5]
    assert math.isnan(lag_before_loss(ends, [60.0] * 6, [60.0] * 6))
    assert cause_of_loss(math.nan, fell=True) is Cause.NOT_KNOWN
    assert math.isnan(lag_before_loss([0.5], [60.0], [60.0]))
