"""Limits: the published numbers, a fall's uncertainty against many drawn falls, Grubbs's own table."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.errors import NotPositive, TooFewReadings
from analysis.limits import compare, outliers_of, spin_at_fall, summarize

THESIS = np.array([21.7, 21.4, 21.7, 21.9, 21.8, 22.3, 21.8, 22.0, 22.1, 21.9])


def test_the_published_limits_have_the_published_statistics() -> None:
    found = summarize(THESIS)
    assert found.scatter
    assert found.scatter.value == pytest.approx(0.25, abs=0.005)
    assert (found.mean.value, found.mean.u) == pytest.approx((21.86, 0.08), abs=0.005)
    assert found.outliers == ()
    assert not found.drifts


def test_the_uncertainty_of_a_fall_is_its_scatter() -> None:
    """400 tops slowed by the disc law, read each 2 s with 0.06 Hz of noise, falling at any moment between two looks."""
    random, pulls = np.random.default_rng(1), []
    start, c = 2 * math.pi * 24.0, 2.34e-4
    for _ in range(400):
        fall_hz = 21.86 + 0.25 * random.standard_normal()
        falls = 2 / c * ((2 * math.pi * fall_hz) ** -0.5 - start**-0.5)
        times = np.arange(random.uniform(0, 2), falls, 2.0)
        spins = (start**-0.5 + c * times / 2) ** -2 / (2 * math.pi) + 0.06 * random.standard_normal(times.size)
        found = spin_at_fall(times, spins, 0.06, (float(times[-1]), float(times[-1]) + 2.0))
        assert found.value is not None
        assert found.u is not None
        pulls.append((found.value - fall_hz) / found.u)
    assert np.mean(pulls) == pytest.approx(0, abs=0.15)  # 3 standard errors of the mean of 400
    assert np.std(pulls) == pytest.approx(1, abs=0.12)  # 3 of a standard deviation


@pytest.mark.parametrize(("n", "critical"), [(5, 1.764), (10, 2.482), (20, 3.001)])
def test_outliers_are_those_of_grubbs_table(n: int, critical: float) -> None:
    """Two-sided, 1 %: the printed critical value, a hundredth less and a hundredth more."""

    def with_deviation(wanted: float) -> np.ndarray:
        rest = np.linspace(-1, 1, n - 1)
        low, high = 1.0, 1e6
        for _ in range(200):
            middle = math.sqrt(low * high)
            values = np.append(rest, middle)
            deviation = (values[-1] - values.mean()) / values.std(ddof=1)
            low, high = (middle, high) if deviation < wanted else (low, middle)
        return np.append(rest, high) + 100

    assert outliers_of(with_deviation(critical - 0.01)) == ()
    assert outliers_of(with_deviation(critical + 0.01)) == (n - 1,)


def test_limits_that_go_down_top_by_top_drift() -> None:
    limits = 22.0 - 0.1 * np.arange(8) + np.array([0.01, -0.02, 0.02, 0.0, -0.01, 0.01, -0.02, 0.01])
    found = summarize(limits)
    assert found.drifts
    assert found.trend
    assert found.trend.value == pytest.approx(-0.1, abs=0.01)


def test_a_mean_two_standard_errors_off_of_ten_is_no_chance_by_students_t() -> None:
    """Student's table: of 9 degrees of freedom 2.262 has 5 %."""
    found = summarize(THESIS)
    assert found.mean.value
    assert found.mean.u
    at = compare(found, "theory", found.mean.value - 2.262 * found.mean.u)
    assert at.p == pytest.approx(0.05, abs=2e-4)
    assert compare(found, "theory", found.mean.value + 2.2 * found.mean.u).agrees
    assert not compare(found, "theory", found.mean.value + 2.3 * found.mean.u).agrees


def test_one_limit_has_no_scatter_and_none_is_no_statistic() -> None:
    single = summarize(np.array([21.9]), np.array([0.05]))
    assert (single.mean.u, single.scatter) == (0.05, None)
    assert compare(single, "theory", 21.0).agrees is None
    with pytest.raises(TooFewReadings):
        summarize(np.array([]))
    with pytest.raises(NotPositive):
        summarize(np.array([21.9, -1.0]))
    with pytest.raises(TooFewReadings):
        spin_at_fall(np.arange(2.0), np.array([23.0, 22.9]), 0.03, (1.0, 2.0))
