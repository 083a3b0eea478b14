"""Whether several groups agree, and how far each lies from the others."""

import math

import numpy as np
import pytest
from scipy import stats

from analysis.comparison import compare


def test_p_is_that_of_a_weighted_fit_of_a_constant():
    x, u = np.array([2.1, 2.2, 2.0]), np.array([0.1, 0.2, 0.15])
    (mean,) = np.polyfit(np.arange(3), x, 0, w=1 / u)
    found = compare(x, u)
    assert found.between == 0
    assert found.scatter == pytest.approx(stats.tstd(x), rel=1e-12)
    assert found.p == pytest.approx(stats.chi2.sf((((x - mean) / u) ** 2).sum(), 2), rel=1e-12)


def test_a_distance_is_that_from_the_mean_of_the_others():
    x, u = np.array([2.1, 2.25, 2.05, 2.2]), np.array([0.1, 0.2, 0.15, 0.3])
    for k, distance in enumerate(compare(x, u).distances):
        others, weights = np.delete(x, k), 1 / np.delete(u, k) ** 2
        expected = (x[k] - np.average(others, weights=weights)) / math.sqrt(u[k] ** 2 + 1 / weights.sum())
        assert distance == pytest.approx(expected, rel=1e-12)


def test_distances_of_groups_that_differ_by_chance_alone_scatter_by_one():
    random = np.random.default_rng(24)
    u = random.uniform(0.5, 3.0, 20)
    pulls = np.array([compare(u * random.standard_normal(20), u).distances for _ in range(400)])
    # classes that scatter more than u by chance get some τ, which makes distances smaller: by 7 % over all of them
    assert pulls.std(axis=0) == pytest.approx(0.95, abs=0.14)  # four standard errors of a standard deviation from 400


def test_one_group_has_nothing_to_be_compared_with():
    found = compare([2.0], [0.1])
    assert (found.scatter, found.distances) == (None, (None,))


def test_values_of_any_size_are_compared_alike():
    x, u = np.array([1.0, 1.2, 0.9]), np.full(3, 0.02)
    large, small = compare(x, u), compare(1e-15 * x, 1e-15 * u)
    assert small.between == pytest.approx(1e-15 * large.between, rel=1e-9)
    assert small.distances == pytest.approx(large.distances, rel=1e-9)


def test_a_value_that_holds_the_whole_mean_is_compared_with_the_others():
    distances = compare([1.0, 1.001], [1e-12, 1e-3]).distances
    assert distances == pytest.approx((-1.0, 1.0), rel=1e-9)


def test_tops_that_differ_are_in_the_distances():
    """Forty classes of twelve tops that differ by 2 %, measured to 0.1 to 0.3 %."""
    random = np.random.default_rng(25)
    u = random.uniform(0.1, 0.3, 12)
    found = [compare(100 + 2 * random.standard_normal(12) + u * random.standard_normal(12), u) for _ in range(40)]
    assert np.mean([one.between for one in found]) == pytest.approx(2, rel=0.1)
    assert np.array([one.distances for one in found]).std() == pytest.approx(1, abs=0.1)


def test_a_group_far_off_does_not_hide_itself():
    *near, far = compare([10, 10.1, 9.9, 10.05, 14.0], [0.1] * 5).distances
    assert far > 10
    assert all(abs(one) < 1.5 for one in near)


@pytest.mark.parametrize(("n", "expected"), [(3, 0.12), (4, 0.07), (6, 0.046)])
def test_distances_of_few_tops_that_differ_are_as_improbable_as_they_say(n, expected):
    """4.6 % of normal numbers are beyond 2; more of three or four tops, two of which may be alike by chance."""
    random = np.random.default_rng(26)
    found = [compare(100 + 2 * random.standard_normal(n), np.full(n, 0.2)).distances for _ in range(1200 // n)]
    share = np.mean(np.abs(np.array(found)) > 2)
    assert share == pytest.approx(expected, abs=0.03)  # 1200 distances; the n of a class are not independent
