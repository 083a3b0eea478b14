"""The line: against numpy's fits, against fits without a point, against York's published numbers."""

import numpy as np
import pytest
from scipy import stats

from analysis.errors import TooFewReadings
from analysis.precession.line import NoRange, fit_line, fit_orthogonal, influence

RANDOM = np.random.default_rng(7)
X = np.array([26.0, 28.0, 30.0, 31.0, 34.0, 36.0, 38.0, 40.0])
U = np.array([0.02, 0.05, 0.02, 0.03, 0.04, 0.02, 0.06, 0.03])
Y = 0.3 + 0.99 * X + U * RANDOM.standard_normal(X.size)


def believed(line, u):
    """The factor of u by its prior: as of 8 degrees of freedom, and less where χ² contradicts it."""
    if u is None:
        return 1.0, line.n - 2
    prior = 8 / max(line.chi_square / (line.n - 2), 1)
    return ((line.chi_square + prior) / (line.n - 2 + prior)) ** 0.5, line.n - 2 + prior


def numpys(x, y, u, cov):
    """numpy's weighted fit: slope and intercept, and their covariance."""
    return np.polyfit(x, y, 1, w=1 / u, cov=cov)


@pytest.mark.parametrize("known", [True, False])
def test_the_line_and_its_covariance_are_numpys(known):
    line = fit_line(X, Y, U if known else None)
    scale, freedom = believed(line, U if known else None)
    expected, covariance = numpys(X, Y, U, "unscaled") if known else numpys(X, Y, np.ones_like(X), True)
    covariance *= scale**2
    np.testing.assert_allclose([line.slope, line.intercept], expected, rtol=1e-10)
    np.testing.assert_allclose([line.u_slope**2, line.u_intercept**2], np.diag(covariance), rtol=1e-9)
    assert line.correlation * line.u_slope * line.u_intercept == pytest.approx(covariance[0, 1], rel=1e-9)
    at = np.array([20.0, 33.0, 50.0])
    design = np.stack((at, np.ones(3)))
    half = stats.t(freedom).ppf(0.975) * np.sqrt(np.einsum("ik,ij,jk->k", design, covariance, design))
    np.testing.assert_allclose(line.confidence_band(at), half, rtol=1e-9)
    np.testing.assert_allclose(line.prediction_band(at, 0.0), half, rtol=1e-9)


def test_u_grows_smoothly_with_a_scatter_beyond_that_of_the_points():
    shares = np.geomspace(0.05, 20, 200)
    lines = [fit_line(X, Y, U * share) for share in shares]
    _, covariance = numpys(X, Y, U, True)
    assert lines[0].p_fit < 1e-3
    assert lines[0].u_slope == pytest.approx(covariance[0, 0] ** 0.5, rel=0.01)  # the points' own u counts for nothing
    assert np.abs(np.diff(np.log([line.u_slope for line in lines]))).max() < 0.05  # u grows by 3 % from one to the next


@pytest.mark.parametrize("known", [True, False])
def test_the_joint_test_compares_two_sums_of_squares(known):
    weight = U**-2.0 if known else np.ones_like(X)
    line = fit_line(X, Y, U if known else None)
    left = np.sum(weight * (Y - line.at(X)) ** 2)
    more = np.sum(weight * (Y - X) ** 2) - left
    dof = X.size - 2
    scale, freedom = believed(line, U if known else None)
    expected = stats.f(2, freedom).sf(more / 2 / (scale**2 if known else left / dof))
    assert line.p_against() == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("known", [True, False])
def test_each_points_influence_is_what_a_fit_without_it_shows(known):
    u = U if known else np.ones_like(X)
    line = fit_line(X, Y, U if known else None)
    effects = influence(X, Y, line, u**-2.0)
    for i in range(X.size):
        others = np.arange(X.size) != i
        (slope, intercept), _ = numpys(X[others], Y[others], u[others], True)
        assert effects.slope_change[i] == pytest.approx(slope - line.slope, rel=1e-6)
        assert effects.intercept_change[i] == pytest.approx(intercept - line.intercept, rel=1e-6)
        # the point against the prediction of the others, in units of that difference's own standard deviation
        row, (_, freedom) = np.array([X[i], 1.0]), believed(line, u if known else None)
        left = np.sum(((Y - slope * X - intercept) / u)[others] ** 2)
        prior = freedom - X.size + 2 if known else 0.0
        scatter = (left + prior) / (X.size - 3 + prior)
        _, unit = numpys(X[others], Y[others], u[others], "unscaled")
        deviation = np.sqrt(scatter * (row @ unit @ row + u[i] ** 2))
        assert effects.studentised[i] == pytest.approx((Y[i] - slope * X[i] - intercept) / deviation, rel=1e-6)
    assert effects.leverage.sum() == pytest.approx(2)  # the trace of the hat matrix


def test_pearsons_data_with_yorks_weights_give_the_published_line():
    # York et al., Am. J. Phys. 72, 367 (2004), Table II
    x = np.array([0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4])
    y = np.array([5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5])
    w_x = np.array([1000, 1000, 500, 800, 200, 80, 60, 20, 1.8, 1.0])
    w_y = np.array([1, 1.8, 4, 8, 20, 20, 70, 70, 100, 500.0])
    line = fit_orthogonal(x, y, w_x**-0.5, w_y**-0.5)
    assert (line.slope, line.intercept) == (pytest.approx(-0.480533407, abs=1e-9), pytest.approx(5.47991022, abs=1e-8))
    u = line.u_slope / line.scale, line.u_intercept / line.scale
    assert u == (pytest.approx(0.0579850, abs=1e-7), pytest.approx(0.294971, abs=1e-6))


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_the_units_of_the_two_axes_do_not_matter(factor):
    wide = 20 * U[::-1]  # so that the slope takes several rounds
    line, other = fit_orthogonal(X, Y, wide, U), fit_orthogonal(X, factor * Y, wide, factor * U)
    assert other.slope == pytest.approx(factor * line.slope, rel=1e-12, abs=0)
    assert other.chi_square == pytest.approx(line.chi_square, rel=1e-9)


def test_an_exact_drive_makes_the_orthogonal_line_the_weighted_one():
    weighted, both = fit_line(X, Y, U), fit_orthogonal(X, Y, np.full_like(X, 1e-9), U)
    for name in ("slope", "intercept", "u_slope", "u_intercept", "chi_square"):
        assert getattr(both, name) == pytest.approx(getattr(weighted, name), rel=1e-6)


def test_slope_and_joint_test_are_right_as_often_as_they_say():
    pulls, p = [], []
    for _ in range(400):
        true = np.linspace(26, 40, 8)
        x = true + 0.05 * RANDOM.standard_normal(8)
        y = true + 0.05 * RANDOM.standard_normal(8)
        line = fit_orthogonal(x, y, np.full(8, 0.05), np.full(8, 0.05))
        pulls.append((line.slope - 1) / line.u_slope)
        p.append(line.p_against())
    assert np.std(pulls) == pytest.approx(1, abs=0.12)  # 3 standard errors of a standard deviation from 400
    assert np.mean(np.array(p) < 0.1) == pytest.approx(0.1, abs=0.045)  # 3 standard errors of a share from 400


def test_what_no_line_goes_through_is_refused():
    with pytest.raises(TooFewReadings):
        fit_line(X[:2], Y[:2])
    with pytest.raises(NoRange, match="all 3 points are at a drive frequency of 30 Hz"):
        fit_line(np.full(3, 30.0), Y[:3])
    exact = fit_line(X, X)
    assert exact.slope == pytest.approx(1)
    assert exact.p_against() is None  # no scatter, no u: nothing to test by
