"""A search for the least squares, and what it says of its end."""

import numpy as np
import pytest

from analysis.least_squares import solve

X = np.linspace(0.0, 1.0, 20)


def residual(q):
    """Of an exponential function; no number where its rate is small."""
    return np.where(q[0] > 0.5, q[1] * np.exp(q[0] * X) - np.exp(1.5 * X), np.nan)


def gradient(q):
    return np.array([q[1] * X * np.exp(q[0] * X), np.exp(q[0] * X)])


@pytest.mark.parametrize("begin", [0.6, 9.0])
def test_a_search_comes_back_from_where_residuals_are_no_numbers(begin):
    found, ended = solve(residual, gradient, np.array([begin, 1.0]))
    assert ended
    np.testing.assert_allclose(found, [1.5, 1.0], rtol=1e-9)


def test_a_search_that_begins_there_or_is_cut_short_has_not_ended():
    assert not solve(residual, gradient, np.array([0.1, 1.0]))[1]
    assert not solve(residual, gradient, np.array([9.0, 1.0]), most=2)[1]
