"""The weighted mean of several groups, whether they agree, and how far each lies from the others."""

import math

import numpy as np
import pytest
from scipy import stats

from analysis.comparison import compare


def test_mean_and_u_are_those_of_a_weighted_fit_of_a_constant():
    x, u = np.array([2.1, 2.4, 1.9]), np.array([0.1, 0.2, 0.05])
    (mean,), ((variance,),) = np.polyfit(np.arange(3), x, 0, w=1 / u, cov="unscaled")
    found = compare(x, u)
    assert (found.mean, found.u) == pytest.approx((mean, math.sqrt(variance)), rel=1e-12)
    assert found.scatter == pytest.approx(stats.tstd(x), rel=1e-12)
    assert found.p == pytest.approx(stats.chi2.sf((((x - mean) / u) ** 2).sum(), 2), rel=1e-12)


def test_a_distance_is_that_from_the_mean_of_the_others():
    x, u = [2.1, 2.4, 1.9, 2.2], [0.1, 0.2, 0.05, 0.3]
    for k, distance in enumerate(compare(x, u).distances):
        others = compare(x[:k] + x[k + 1 :], u[:k] + u[k + 1 :])
        assert distance == pytest.approx((x[k] - others.mean) / math.hypot(u[k], others.u), rel=1e-12)


def test_distances_of_groups_that_differ_by_chance_alone_scatter_by_one():
    random = np.random.default_rng(24)
    u = random.uniform(0.5, 3.0, 20)
    pulls = np.array([compare(u * random.standard_normal(20), u).distances for _ in range(400)])
    assert pulls.std(axis=0) == pytest.approx(1, abs=0.14)  # four standard errors of a standard deviation from 400


def test_one_group_has_nothing_to_be_compared_with():
    found = compare([2.0], [0.1])
    assert (found.mean, found.u, found.scatter, found.distances) == (2.0, pytest.approx(0.1), None, (None,))
