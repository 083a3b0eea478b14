"""What the pulse analyses are made of, each part by itself."""

import numpy as np
import pytest

from analysis.pulses.edges import place_edges
from analysis.pulses.likelihood import search
from analysis.pulses.matched import COARSE, window_of
from analysis.pulses.regression import Fit, Scatter, fit_turns, median


def test_the_median_is_numpys():
    random = np.random.default_rng(1)
    for size in (1, 3, 59, 501, 2001):
        values = random.standard_normal(size)
        assert median(values) == np.median(values)


def test_at_the_end_of_a_record_frequency_slope_and_bend_are_correlated():
    """Independent coefficients of variance 1: c₁ + 2 c₂ + 3 c₃, 2 c₂ + 6 c₃ and 6 c₃ at u = 1, by hand."""

    def of(third, variance):
        covariance = variance * np.diag([1.0, 1.0, 1.0, third])
        return Fit(
            np.array([0.3, 60.0, -0.5, 0.1]), covariance, 1.0, 2.0, np.zeros(9), Scatter(1.0, 1.0, 9.0, 1.0), np.eye(3)
        ).correlations(3.0)

    assert of(1.0, 0.01) == pytest.approx((22 / 560**0.5, 18 / 504**0.5, 36 / 1440**0.5))
    assert of(0.0, 0.01) == pytest.approx((4 / 20**0.5, 0, 0))
    assert of(1.0, 0.0) == (0, 0, 0)  # without noise


def test_a_flat_trace_stands_out_nowhere_however_few_samples_a_part_of_the_turn_has():
    phase = (np.arange(COARSE + 40) % COARSE + 0.5) / COARSE  # one, or two
    assert window_of(np.full(phase.size, 2.0), phase) is None


@pytest.mark.parametrize("offset", [0.0, 50.0])
def test_a_turn_without_a_pulse_is_seen_whatever_the_offset(offset):
    rate, times = 10e3, (np.arange(40) + 0.5) / 20.0
    seen = np.delete(times, 17)
    at = np.arange(20_000)[:, None] / rate - seen
    trace = offset + np.exp(-0.5 * (at / 1e-3) ** 2).sum(axis=1)
    edges = place_edges(trace, rate, fit_turns(times, np.arange(40.0)), width=2.35e-3, sign=1)
    assert edges.missing == 1
    assert edges.height == pytest.approx(39 / 40, abs=1e-3)


@pytest.mark.parametrize("slope", [-0.3, 0.2])
def test_the_greatest_likelihood_is_that_of_the_true_frequency_and_slope(slope):
    rate, duration, frequency = 1000.0, 10.0, 31.4
    time = (np.arange(int(rate * duration)) + 0.5) / rate - duration / 2
    turns = frequency * time + 0.5 * slope * time**2
    found = search(np.exp(-0.5 * ((turns - np.rint(turns)) / 0.03) ** 2), rate)
    # the last grid has 8 harmonics: steps of 0.25/T/8 and 1/T²/8
    assert float(found.frequency(np.array([duration / 2]))[0]) == pytest.approx(frequency, abs=0.25 / duration / 8)
    assert 2 * found.coefficients[2] / found.half**2 == pytest.approx(slope, abs=1 / duration**2 / 8)
