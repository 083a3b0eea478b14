"""The bootstrap: which errors are drawn."""

import numpy as np
import pytest

from analysis.uncertainty import bootstrap


def test_the_bootstrap_draws_errors_of_the_size_that_the_residuals_stem_from():
    # of a straight line through 4 readings: residuals have the variance σ²(1 − h), errors σ²
    x = np.array([-3.0, -1.0, 1.0, 3.0])
    hat = 1 / 4 + np.outer(x, x) / (x @ x)
    leverage = np.diagonal(hat)
    noise = np.random.default_rng(0).normal(0, 1, (2000, 4))
    drawn = []

    def refit(errors):
        drawn.append(errors)
        return errors[:1]

    for each in noise:
        bootstrap(refit, each - hat @ each, leverage, samples=1, seed=len(drawn))
    # a mean of 4 taken off leaves 3/4 but for the correlation of the residuals, which is small; 1/(1 − h) makes 2.1
    assert np.var(drawn) == pytest.approx(1.0, abs=0.06)


def test_a_mean_of_the_residuals_is_no_scatter():
    (interval,) = bootstrap(lambda errors: errors[:1], np.full(5, 0.3), np.full(5, 0.4), samples=10, seed=1)
    assert interval == pytest.approx((0.0, 0.0), abs=1e-15)
