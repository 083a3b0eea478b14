"""Whether several groups agree, and how far each lies from the others."""

import math
import tracemalloc

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from analysis.comparison import compare, gross_errors


def test_p_is_that_of_a_weighted_fit_of_a_constant():
    x, u = np.array([2.1, 2.2, 2.0]), np.array([0.1, 0.2, 0.15])
    (mean,) = np.polyfit(np.arange(3), x, 0, w=1 / u)
    found = compare(x, u)
    assert found.between == 0
    assert found.scatter == pytest.approx(stats.tstd(x), rel=1e-12)
    assert found.p == pytest.approx(stats.chi2.sf((((x - mean) / u) ** 2).sum(), 2), rel=1e-12)


def test_a_distance_is_that_of_a_normal_number_as_improbable_over_all_scatters():
    x, u = np.array([2.1, 2.25, 2.05, 2.9]), np.array([0.1, 0.2, 0.15, 0.3])
    others, of = x[:3], u[:3]

    def posterior(tau):
        scales = np.hypot(of, tau)
        of_mean = quad(
            lambda m: stats.norm.pdf(others, m, scales).prod(), 2.1 - 9 * scales.min(), 2.1 + 9 * scales.min()
        )
        return of_mean[0] / (np.mean(of**-2.0) ** -0.5 + tau)

    def beyond(tau):
        weights = 1 / (of**2 + tau**2)
        scale = math.sqrt(u[3] ** 2 + tau**2 + 1 / weights.sum())
        return posterior(tau) * stats.norm.sf(x[3], np.average(others, weights=weights), scale)

    p = quad(beyond, 0, 50, points=[0.1, 1], epsrel=1e-4)[0] / quad(posterior, 0, 50, points=[0.1, 1], epsrel=1e-4)[0]
    assert compare(x, u).distances[3] == pytest.approx(stats.norm.isf(p), abs=2e-3)


@pytest.mark.parametrize("far", [3.0, 1e5])
def test_a_distance_of_values_without_an_error_of_their_own_is_students(far):
    x = np.array([far, 1.0, 2.0, 1.5])
    t = (x[0] - x[1:].mean()) / (x[1:].std(ddof=1) * math.sqrt(4 / 3))
    assert compare(x, np.full(4, 1e-6)).distances[0] == pytest.approx(stats.norm.isf(stats.t.sf(t, 2)), abs=1e-3)


def test_distances_of_groups_that_differ_by_chance_alone_scatter_by_one():
    random = np.random.default_rng(24)
    u = random.uniform(0.5, 3.0, 20)
    pulls = np.array([compare(u * random.standard_normal(20), u).distances for _ in range(400)])
    # that tops may differ, too, makes distances smaller, most those of the best values
    assert pulls.std() == pytest.approx(0.91, abs=0.04)
    assert pulls.std(axis=0).max() < 1.14  # four standard errors of a standard deviation from 400


def test_one_group_has_nothing_to_be_compared_with():
    found = compare([2.0], [0.1])
    assert (found.scatter, found.distances) == (None, (None,))


def test_values_of_any_size_are_compared_alike():
    x, u = np.array([1.0, 1.2, 0.9]), np.full(3, 0.02)
    large, small = compare(x, u), compare(1e-15 * x, 1e-15 * u)
    assert small.between == pytest.approx(1e-15 * large.between, rel=1e-9)
    assert small.distances == pytest.approx(large.distances, rel=1e-9)


def test_a_value_that_holds_the_whole_mean_is_compared_with_the_others():
    distances = compare([1.0, 1001.0], [1e-9, 1e3]).distances  # of which tops differ by 10⁻⁴ u
    assert distances == pytest.approx((-1.0, 1.0), rel=1e-4)


def test_tops_that_differ_are_in_the_distances():
    """Forty classes of twelve tops that differ by 2 %, measured to 0.1 to 0.3 %."""
    random = np.random.default_rng(25)
    u = random.uniform(0.1, 0.3, 12)
    found = [compare(100 + 2 * random.standard_normal(12) + u * random.standard_normal(12), u) for _ in range(40)]
    assert np.mean([one.between for one in found]) == pytest.approx(2, rel=0.1)
    assert np.array([one.distances for one in found]).std() == pytest.approx(1, abs=0.1)


def test_a_group_far_off_does_not_hide_itself():
    *near, far = compare([10, 10.1, 9.9, 10.05, 14.0], [0.1] * 5).distances
    assert far > 4  # 30 u from the four others, whose scatter is not known better: p = 2 × 10⁻⁵
    assert all(abs(one) < 1.5 for one in near)


@pytest.mark.parametrize("n", [3, 4, 6, 12])
@pytest.mark.parametrize("between", [0.5, 2.0, 10.0])
def test_groups_are_seldom_far_off_by_chance(n, between):
    """Few groups may agree by chance, and the next one is not far off for that: 0.27 % of normal numbers are."""
    random = np.random.default_rng(26)
    tops, u = between * random.standard_normal((2400 // n, n)), random.uniform(0.5, 2, (2400 // n, n))
    found = [compare(x + of * random.standard_normal(n), of).distances for x, of in zip(tops, u, strict=True)]
    share = np.mean(np.abs(np.array(found)) > 3)
    assert share < 0.0027 + 4 * math.sqrt(0.0027 / 2400)  # four standard errors of 2400


@pytest.mark.parametrize("between", [0.0, 0.02, 0.05])
def test_two_groups_are_seldom_far_apart_as_tops_differ_and_a_factor_is_seen(between):
    random = np.random.default_rng(28)
    values, u = 1 + between * random.standard_normal((600, 2)), random.uniform(0.001, 0.02, (600, 2))
    values += u * random.standard_normal(u.shape)
    found = [compare(*one).distances for one in zip(values, u, strict=True)]
    assert np.mean(np.abs(np.array(found)) > 3) < 0.0027 + 4 * math.sqrt(0.0027 / 600)  # four standard errors of 600
    assert min(np.abs(compare([1, 3], [0.005, 0.015]).distances)) > 3


def test_the_probability_of_a_gross_error_is_that_of_its_mixture_over_all_means_and_scatters():
    """By a sum over a fine grid of even steps."""
    x, u = np.array([1.0, 1.1, 0.6]), np.array([0.05, 0.1, 0.08])
    mean, tau = np.arange(-4, 6, 0.01)[:, None, None], np.exp(np.arange(-9, 5, 0.1))[:, None]
    size, typical, width = abs(mean), np.mean(u**-2.0) ** -0.5, np.hypot(u, tau)
    wrong = 0.05 * stats.cauchy.pdf(x, mean, size + 3 * u)
    other = 0.1 * stats.norm.pdf(x, mean, np.hypot(width, 0.15 * size + 3 * u))
    each = wrong + other + 0.85 * stats.norm.pdf(x, mean, width)
    prior = stats.t.pdf(math.sqrt(2) * tau / (0.05 * size + typical), 2) / (0.05 * size + typical) * tau
    p = prior / (size + 3 * typical) * each.prod(axis=2, keepdims=True)
    assert gross_errors(x, u) == pytest.approx((p * wrong / each).sum(axis=(0, 1)) / p.sum(), abs=2e-3)


@pytest.mark.parametrize("n", [3, 6, 30])
@pytest.mark.parametrize("between", [0.0, 0.02, 0.05])
def test_no_sound_group_is_grossly_wrong_and_two_that_are_hide_neither(n, between):
    random = np.random.default_rng(27)
    tops, u = 1 + between * random.standard_normal((600 // n, n)), random.uniform(0.001, 0.02, (600 // n, n))
    values = tops + u * random.standard_normal(u.shape)
    assert max(gross_errors(*one).max() for one in zip(values, u, strict=True)) < 0.2
    if n > 3:
        values, u = values * [0.1, 10, *[1] * (n - 2)], u * [0.1, 10, *[1] * (n - 2)]
        found = np.array([gross_errors(*one) for one in zip(values, u, strict=True)])
        assert np.mean(found[:, :2] > 0.95) > 0.98
        assert found[:, 2:].max() < 0.2


def test_of_many_groups_the_wrong_ones_are_found_in_little_memory():
    values, u = 1 + 0.02 * np.random.default_rng(4).standard_normal(400), np.full(400, 0.01)
    values[[7, 300]] *= 0.1, 10
    tracemalloc.start()
    found = gross_errors(values, u)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 6e7  # arrays of 400 values and 1000 means have 3e6, those of each scatter, too, 1e8
    assert np.flatnonzero(found > 0.95).tolist() == [7, 300]
    assert np.delete(found, [7, 300]).max() < 0.2


def test_of_two_values_nothing_says_which_is_wrong():
    assert gross_errors([1.0, 10.0], [0.1, 0.1]).tolist() == [0, 0]
    assert gross_errors([1.0, 1.02, 10.0], [0.01] * 3)[2] > 0.95
