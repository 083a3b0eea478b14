"""Tests of residuals against enumeration and definition."""

from itertools import combinations, groupby

import numpy as np
import pytest
from scipy.stats import t as student

from analysis.residuals import durbin_watson, gross_errors, runs_test_p, studentise
from analysis.uncertainty import curvature


def runs(signs):
    return len(list(groupby(signs)))


def orders(plus, minus):
    for places in combinations(range(plus + minus), plus):
        yield [1.0 if i in places else -1.0 for i in range(plus + minus)]


@pytest.mark.parametrize(("plus", "minus"), [(1, 1), (1, 6), (3, 3), (4, 5), (6, 3)])
def test_the_runs_test_agrees_with_counting_every_order(plus, minus):
    counts = np.array([runs(order) for order in orders(plus, minus)])
    for order in orders(plus, minus):
        seen = runs(order)
        tail = min((counts <= seen).mean(), (counts >= seen).mean())
        assert runs_test_p(np.array(order)) == pytest.approx(min(1.0, 2 * tail), rel=1e-12)


def test_the_runs_test_of_two_series_agrees_with_counting_all_pairs_of_orders():
    counts = np.array([runs(a) + runs(b) for a in orders(3, 3) for b in orders(2, 4)])
    first, second = [1, 1, 1, -1, -1, -1], [1, 1, -1, -1, -1, -1]
    expected = 2 * (counts <= 4).mean()
    assert runs_test_p(np.array(first), np.array(second)) == pytest.approx(expected, rel=1e-12)


def test_the_normal_runs_test_continues_the_exact_one(monkeypatch):
    series = [np.random.default_rng(i).permutation([1.0, -1.0] * 100) for i in range(20)]
    exact = [runs_test_p(e) for e in series]
    monkeypatch.setattr("analysis.residuals.EXACT_SIGNS", 0)
    assert [runs_test_p(e) for e in series] == pytest.approx(exact, abs=0.001)  # stated beside EXACT_SIGNS


def test_residuals_of_one_sign_or_of_zeros_leave_the_runs_test_undefined():
    assert runs_test_p(np.ones(5)) is None
    assert runs_test_p(np.zeros(5)) is None


def test_durbin_watson_is_two_for_noise_and_never_crosses_from_one_run_to_the_next():
    e = np.random.default_rng(0).normal(size=20000)
    assert durbin_watson(e) == pytest.approx(2, abs=0.06)  # 4 standard errors of 2/√n
    one = np.array([1.0, 1.0])
    assert durbin_watson(one, -one) == 0
    assert durbin_watson(np.zeros(3)) is None


def test_studentised_residuals_are_those_of_a_fit_without_the_reading():
    rng = np.random.default_rng(1)
    x = np.linspace(0, 1, 9)
    slopes = np.array([np.ones(9), x])
    y = 2 + 3 * x + rng.normal(0, 0.1, 9)

    def line(keep):
        return np.linalg.lstsq(slopes[:, keep].T, y[keep], rcond=None)[0]

    everything = np.ones(9, dtype=bool)
    residuals = y - line(everything) @ slopes
    t = studentise(residuals, curvature(slopes).leverage, 2, floor=0.0)
    for i in range(9):
        others = everything.copy()
        others[i] = False
        q = line(others)
        variance = ((y - q @ slopes)[others] ** 2).sum() / 6
        inverse = np.linalg.inv(slopes[:, others] @ slopes[:, others].T)
        spread = np.sqrt(variance * (1 + slopes[:, i] @ inverse @ slopes[:, i]))
        assert t[i] == pytest.approx((y[i] - q @ slopes[:, i]) / spread, rel=1e-10)


def test_noise_is_called_a_gross_error_as_rarely_as_promised():
    rng = np.random.default_rng(2)
    found = sum(gross_errors(rng.standard_t(16, size=20), 3).size > 0 for _ in range(20000))
    assert found <= 38  # 1e-3 of 20000 are 20; four standard deviations above


def test_a_gross_error_lies_beyond_both_tails_of_students_t_for_all_readings():
    # scipy.stats, two-sided, Bonferroni: 1e-3 of one run in all, so 1e-3/20/2 in each tail
    limit = float(student.isf(1e-3 / 20 / 2, 20 - 3 - 1))
    t = np.zeros(20)
    t[[4, 9, 15]] = [1.001 * limit, -1.002 * limit, 0.999 * limit]
    assert gross_errors(t, 3).tolist() == [9, 4]
