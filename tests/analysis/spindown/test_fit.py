"""Spin-down fits: exact on exact data, unbiased on noise, honest where the readings say little."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.stats import chi2, linregress

from analysis.errors import AnalysisError, NotFinite, NotPositive, ShapesDiffer, TimesNotIncreasing, TooFewReadings
from analysis.spindown import fit as spin_down_fit
from analysis.spindown.drag import LAWS, spin
from analysis.spindown.fit import UnknownName
from analysis.spindown.readings import NoSpinDown

# of a top that only spins; test_tilt.py has others
fit_spin_down = functools.partial(spin_down_fit.fit_spin_down, tilt=False)

T = np.arange(0, 200, 10.0)
SIGMA = 0.03  # [Hz], the noise of PHYSICS.md §5
CONSTANTS = {"stokes": (3.18e-3,), "newton": (1.73e-5,), "disc": (2.34e-4,), "mixed": (1.5e-3, 8e-6)}
CONSTANTS["power"] = (2.34e-4, 1.5)


def readings(law="disc", sigma=SIGMA, seed=1, time=T):
    noise = np.random.default_rng(seed).normal(0, sigma, len(time)) if sigma else 0
    return spin(law, time, 40.0, *CONSTANTS[law]) + noise


def values(fit):
    return np.array([fit.parameters[name].value for name in LAWS[fit.name].parameters])


def uncertainties(fit):
    return np.array([fit.parameters[name].u for name in LAWS[fit.name].parameters])


def assert_finite(thing):
    """Nowhere in a result is there a NaN or an infinity."""
    if dataclasses.is_dataclass(thing):
        assert_finite([getattr(thing, field.name) for field in dataclasses.fields(thing)])
    elif isinstance(thing, dict):
        assert_finite(list(thing.values()))
    elif isinstance(thing, (list, tuple)):
        for part in thing:
            assert_finite(part)
    elif isinstance(thing, (float, np.ndarray)):
        assert np.isfinite(thing).all()


# ---------------------------------------------------------------------------------------------- the numbers are right


@pytest.mark.parametrize("u", [SIGMA, None])
@pytest.mark.parametrize("law", LAWS)
def test_readings_without_noise_give_their_constants_back(law, u):
    fit = fit_spin_down(T, readings(law, sigma=0), u).fit(law)
    assert values(fit) == pytest.approx([40.0, *CONSTANTS[law]], rel=1e-9)
    assert fit.statistics.rms_residual < 1e-12


def test_the_uncertainty_of_the_curve_is_its_scatter_over_repetitions():
    fits = [fit_spin_down(T, readings(seed=seed), SIGMA, laws=["power"]).fit("power") for seed in range(50)]
    at = T[[0, 10, -1]]
    scatter = np.std([fit.spin_frequency(at) for fit in fits], axis=0)
    stated = np.mean([fit.u_spin_frequency(at) for fit in fits], axis=0)
    # a correlation that 20 readings cannot rule out is in u, the more the more readings a value is a mean of;
    # 0.3: three standard errors of a standard deviation from 50
    assert (scatter < 1.3 * stated).all()
    assert (scatter > 0.75 * 0.7 * stated).all()


def test_the_curve_has_no_uncertainty_where_its_parameters_have_none():
    fit = fit_spin_down(T[:3], readings()[:3], None).fit("power")
    assert fit.covariance is None
    assert fit.u_spin_frequency(T[:3]) is None


def noises(sets=2):
    """Noise vectors of 20 readings, shape (40·sets, 20).

    Each set is an orthogonal basis and its opposite, with lengths from the middle of each 20th of their distribution.
    So mean and mean square of whatever depends linearly on the noise are exact, and the rest is due to the fits.
    """
    rng = np.random.default_rng(11)
    lengths = np.sqrt(chi2.ppf((np.arange(20) + 0.5) / 20, 20))
    bases = [np.linalg.qr(rng.normal(size=(20, 20)))[0].T * rng.permutation(lengths)[:, None] for _ in range(sets)]
    return SIGMA * np.concatenate([sign * basis for basis in bases for sign in (1, -1)])


@pytest.fixture(scope="module")
def fitted():
    """Law, stated u → the runs fitted to that law's readings with each of the noises; no top has a tilt."""

    @functools.cache
    def runs(law, u):
        truth = readings(law, sigma=0)
        return [fit_spin_down(T, truth + noise, u, laws=[law]) for noise in noises()]

    return runs


@pytest.mark.parametrize("law", LAWS)
def test_constants_are_unbiased_and_their_uncertainties_true(law, fitted):
    truth, fits = np.array([40.0, *CONSTANTS[law]]), [run.fits[0] for run in fitted(law, SIGMA)]
    found, u = np.array([values(fit) for fit in fits]), np.array([uncertainties(fit) for fit in fits])
    # c of the power law is skew, by half of u(ln c) = 0.08; of the others nothing but rounding
    assert np.abs((found.mean(axis=0) - truth) / found.std(axis=0)).max() < 0.1
    # u allows for a correlation that 20 readings cannot rule out: 1.15 to 1.25 times as large as without.  0.14 is two
    # standard errors of 40 pairs
    assert (np.abs(found - truth) < u).mean(axis=0) == pytest.approx(0.77, abs=0.14)
    assert found.std(axis=0) / np.median(u, axis=0) == pytest.approx(0.87, abs=0.14)


@pytest.mark.parametrize("law", ["disc", "power"])  # of two and of three parameters
def test_without_stated_uncertainties_the_intervals_cover_as_students_t(law, fitted):
    truth = np.array([40.0, *CONSTANTS[law]])
    fits = [run.fits[0] for run in fitted(law, None)]
    covered = np.array([np.abs(values(fit) - truth) < uncertainties(fit) for fit in fits]).mean(axis=0)
    # more than Student's 0.67, since independent noise is not known to be that; 0.14: two standard errors of 40 pairs
    assert covered == pytest.approx(0.82, abs=0.14)


def likelihood(fit, u):
    """Return −2 ln of the greatest likelihood of a law: dense matrices, s at its mode, Cox and Reid's mean over τ."""
    p, (frequency, _) = len(fit.law.parameters), fit.reference
    scale = np.ones(T.size) if u is None else np.full(T.size, u)
    slopes = np.array([
        (spin(fit.name, T, *(values(fit) + step)) - spin(fit.name, T, *(values(fit) - step))) / 2e-4
        for step in np.diag(values(fit)) * 1e-4
    ]) / scale  # fmt: skip
    own, freedom = fit.residuals / scale, 0 if u is None else 8
    chances, known = [], []
    for tau in 10 ** np.linspace(-1, 1, 9):
        r = np.exp(-np.abs(np.subtract.outer(T, T)) / (10 * tau))
        w = np.linalg.inv(r)
        e = own - slopes.T @ np.linalg.solve(slopes @ w @ slopes.T, slopes @ w @ own)
        s2 = (freedom + e @ w @ e) / (T.size + freedom)
        total = T.size + freedom
        at_mode = (freedom + e @ w @ e) / (T.size - p + freedom)
        known.append(np.linalg.slogdet(slopes @ w @ slopes.T / at_mode)[1])
        chances.append(np.exp(-(total * np.log(s2) + total + np.linalg.slogdet(r)[1] + known[-1] - known[0]) / 2))
    assert frequency > 0
    assert p == len(slopes)
    return -2 * np.log(np.mean(chances))


@pytest.mark.parametrize("u", [SIGMA, None])
def test_criteria_are_the_textbooks_with_the_noise_averaged_over(u):
    known = fit_spin_down(T, readings(), u).fit("power").statistics
    n, k = 20, 4
    misfit = likelihood(fit_spin_down(T, readings(), u).fit("power"), u)
    assert known.misfit == pytest.approx(misfit, abs=2e-2)  # its slopes are differences
    assert known.aicc == pytest.approx(known.misfit + 2 * k + 2 * k * (k + 1) / (n - k - 1))
    assert known.bic == pytest.approx(known.misfit + k * np.log(n))
    assert (known.reduced_chi_square is None) == (u is None)


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_u_grows_with_the_noise_without_a_step(rho):
    """Walked through all sizes of noise, from half the stated u to four times of it."""
    rng = np.random.default_rng(3)
    noise = np.linalg.cholesky(rho ** np.abs(np.subtract.outer(range(20), range(20)))) @ rng.normal(size=20)
    sizes = np.geomspace(0.5, 4.0, 60)
    u = np.array([
        fit_spin_down(T, readings(sigma=0) + SIGMA * size * noise, SIGMA, laws=["disc"]).fits[0].parameters["c32"].u
        for size in sizes
    ])  # fmt: skip
    # the scatter grows by 3.6 % from one size to the next, u by no more and never by a step
    assert np.abs(np.diff(np.log(u))).max() < 0.04
    assert u[-1] > 2 * u[0]


def test_one_uncertainty_each_weighs_the_readings():
    y, u = readings(), np.full(T.size, SIGMA)
    assert values(fit_spin_down(T, y, u).fit("disc")) == pytest.approx(values(fit_spin_down(T, y, SIGMA).fit("disc")))
    y[3] += 0.5
    u[3] = 1e6  # such a reading says nothing: the fit is that of the others
    others = fit_spin_down(np.delete(T, 3), np.delete(y, 3), SIGMA).fit("disc")
    # but for its part in the correlation of the noise, whose correlation is not known: a sixth of their u
    assert (np.abs(values(fit_spin_down(T, y, u).fit("disc")) - values(others)) < uncertainties(others) / 6).all()


@pytest.mark.parametrize(
    ("law", "straighten", "factor"),
    [("stokes", np.log, -1.0), ("newton", lambda w: 1 / w, 1.0), ("disc", lambda w: w**-0.5, 2.0)],
)
def test_linearised_constants_are_slopes_of_unweighted_straight_lines(law, straighten, factor):
    y = readings()
    (estimate,) = fit_spin_down(T, y, SIGMA).fit(law).linearised.values()
    line = linregress(T, straighten(2 * np.pi * y))
    assert estimate.value == pytest.approx(factor * line.slope, rel=1e-12)
    assert estimate.u == pytest.approx(abs(factor) * line.stderr, rel=1e-9)


def test_the_fitted_curve_goes_through_the_readings_on_their_own_clock():
    y = readings()
    run = fit_spin_down(T + 1000, y, SIGMA)
    for fit in run.fits:
        assert y - fit.spin_frequency(T + 1000) == pytest.approx(fit.residuals, abs=1e-12)
        assert fit.spin_frequency(1000.0) == pytest.approx(fit.parameters["start_frequency"].value, rel=1e-12)


# -------------------------------------------------------------------------------------------------- statistics, verdict


@pytest.mark.parametrize("u", [SIGMA, None])
def test_precise_readings_of_a_disc_exclude_stokes_and_newton(u):
    verdict = fit_spin_down(T, readings(), u).verdict
    assert set(verdict.excluded) == {"stokes", "newton"}
    assert "disc" in verdict.indistinguishable
    assert verdict.decided


def test_readings_on_a_law_to_rounding_are_called_too_good_to_be_measured():
    time = np.arange(0, 80, 10.0)
    run = fit_spin_down(time, 40 - 0.1 * time)  # a power law with n = 0
    assert run.best == "power"
    assert "calculated" in kinds(run)
    rounded = np.round(spin("disc", T, 40.0, 2.34e-4), 6)
    assert "calculated" not in kinds(fit_spin_down(T, rounded))


def kinds(thing):
    return [remark.kind for remark in thing.remarks]


def test_a_fall_by_one_per_cent_cannot_tell_the_laws_apart():
    time = np.linspace(0, 3, 20)
    run = fit_spin_down(time, readings(time=time), SIGMA)
    assert run.verdict.excluded == ()
    assert not run.verdict.decided
    assert run.fit("power").parameters["exponent"].u > 10
    assert_finite(run)


def test_understated_uncertainties_are_enlarged_and_exclude_nothing_falsely():
    y = readings(sigma=0.3)
    run, honest = fit_spin_down(T, y, 0.003), fit_spin_down(T, y)
    # a stated u counts as 8 readings beside 18, so u is smaller by √(18/26), and the correlation seems better known
    ratio = uncertainties(run.fit("disc")) / uncertainties(honest.fit("disc"))
    assert (0.8 * np.sqrt(18 / 26) < ratio).all()
    assert (ratio < 1).all()
    assert "understated" in kinds(run)
    assert run.fit("newton").statistics.difference < 100  # it would be 1e4 if 0.003 Hz were believed


def test_a_law_that_was_asked_for_and_does_not_fit_is_no_change_of_the_top():
    found = fit_spin_down(T, readings(), SIGMA, laws=["stokes"])
    assert found.fit("stokes").statistics.reduced_chi_square > 9
    assert found.verdict.describes


def test_readings_without_uncertainty_are_warned_of():
    assert kinds(fit_spin_down(T, readings())) == ["no u"]
    assert kinds(fit_spin_down(T, readings(), SIGMA)) == []


def test_a_constant_well_below_zero_is_called_unphysical():
    falls_evenly = 40 - T / 10  # exponent 0: c2 must undo c1's curvature
    (remark,) = fit_spin_down(T, falls_evenly, SIGMA).fit("mixed").remarks
    assert (remark.kind, remark.name) == ("negative", "c2")
    for seed in range(20):  # and not on account of noise
        fit = fit_spin_down(T, readings("newton", seed=seed), SIGMA, laws=["mixed"]).fit("mixed")
        c1 = fit.parameters["c1"]
        assert (fit.remarks != ()) == (c1.value < -2 * c1.u)


# ----------------------------------------------------------------------------------------------------------- outliers


def test_outliers_are_kept_on_request_and_still_named():
    y = readings()
    y[7] *= 2
    run = fit_spin_down(T, y, SIGMA, keep_outliers=True)
    assert (run.outliers, run.time.size) == ((7,), 20)
    *_, kept, _ = run.remarks[0].values
    assert kept


def test_an_outlier_is_so_far_away_as_the_warning_says():
    y = readings()
    y[19] += 1.5
    run = fit_spin_down(T, y, SIGMA, laws=["disc"])
    off = y[19] - run.fit("disc").spin_frequency(T[19])
    _, _, distance, times, stated, _, falling = run.remarks[0].values
    assert (distance, times) == pytest.approx((off, off / SIGMA))
    assert stated
    assert falling
    unknown = fit_spin_down(T, y, laws=["disc"])
    rms = unknown.fit("disc").statistics.rms_residual
    assert unknown.remarks[0].values[3] == pytest.approx(unknown.remarks[0].values[2] / rms)
    y[19], y[7] = readings()[19], 2 * y[7]
    assert not fit_spin_down(T, y, SIGMA, laws=["disc"]).remarks[0].values[-1]


@pytest.mark.parametrize("u", [SIGMA, None])
@pytest.mark.parametrize("first", [2, 0.5])
@pytest.mark.parametrize("where", [[0], [1], [7], [18], [19], [3, 4], [0, 1], [18, 19], [3, 8, 14], [2, 3, 11, 12]])
def test_miscounts_are_found_and_left_out_however_many_hide_one_another(where, first, u):
    y = readings()
    y[where] *= np.resize([first, 1 / first, 1.5], len(where))
    run = fit_spin_down(T, y, u, laws=["disc"])
    assert run.outliers == tuple(where)
    assert [remark.values[:2] for remark in run.remarks[: len(where)]] == [(T[k], y[k]) for k in where]
    assert run.time.size == run.fit("disc").residuals.size == 20 - len(where)
    clean = fit_spin_down(np.delete(T, where), np.delete(y, where), u, laws=["disc"])
    constant = [fitted.fit("disc").parameters["c32"].value for fitted in (run, clean)]
    assert constant[0] == pytest.approx(constant[1], rel=1e-9)


def test_where_no_law_fits_no_reading_is_left_out():
    y = readings() * np.where(np.arange(20) % 2, 0.5, 1.0)  # a counter that counts every other reading by halves
    assert fit_spin_down(T, y, SIGMA).outliers == ()


def test_honest_noise_loses_no_reading(fitted):
    assert sum(len(run.outliers) for run in fitted("disc", None)) <= 2  # 1e-3 a run, and its opposite


# ------------------------------------------------------------------------------------------- little, much and odd data


def test_three_readings_of_unknown_uncertainty_leave_three_parameters_without_one():
    run = fit_spin_down([0, 100, 190], [40.0, 29.4, 21.9])
    power = run.fit("power")
    assert all(estimate.u is None for estimate in power.parameters.values())
    assert power.remarks[0].kind == "no freedom"
    assert run.fit("disc").parameters["c32"].u > 0
    assert run.best in {"stokes", "newton", "disc"}
    assert run.verdict.excluded == ()
    assert run.remarks[-1].kind == "few readings"
    assert_finite(run)


def test_one_decade_of_time_and_spin():
    time = np.linspace(0, 5000, 50)
    run = fit_spin_down(time, readings(time=time), SIGMA)
    exponent = run.fit("power").parameters["exponent"]
    assert abs(exponent.value - 1.5) < 3 * exponent.u < 0.01
    assert {"stokes", "newton", "mixed"} <= set(run.verdict.excluded)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_the_unit_of_time_does_not_matter(scale):
    y = readings()
    fast, usual = fit_spin_down(T * scale, y, SIGMA), fit_spin_down(T, y, SIGMA)
    for name in LAWS:
        start = [run.fit(name).parameters["start_frequency"].value for run in (fast, usual)]
        assert start[0] == pytest.approx(start[1], rel=1e-9)
    assert fast.fit("disc").parameters["c32"].value * scale == pytest.approx(
        usual.fit("disc").parameters["c32"].value, rel=1e-9
    )


def test_a_c_that_is_known_only_to_a_factor_is_called_so():
    time = np.linspace(0, 60, 12)
    fit = fit_spin_down(time, readings(time=time), SIGMA, laws=["power"]).fits[0]
    c = fit.parameters["c"]
    assert c.u > 0.5 * c.value
    assert fit.remarks[0].kind == "factor"


def test_a_c_beyond_all_floats_is_none_with_a_warning():
    fit = fit_spin_down([0, 100, 190], [40.0, 21.91, 21.9], SIGMA, laws=["power"]).fits[0]
    assert fit.parameters["c"].value is None
    assert "out of range" in kinds(fit)
    assert_finite(fit)


def test_many_thousand_readings_are_as_easy_as_twenty():
    time = np.linspace(0, 190, 30_000)  # a matrix of all with all of them would be 7 GB
    y = readings(time=time)
    y[1500] *= 2
    run = fit_spin_down(time, y, SIGMA)
    assert run.outliers == (1500,)
    c32 = run.fit("disc").parameters["c32"]
    assert abs(c32.value - 2.34e-4) < 4 * c32.u < 4e-8


@settings(deadline=None, max_examples=30)
@example(law="power", n=12, start=1.0, loss=3.0, noise=0.0625, seed=146, known=False)  # a top that stops
@given(
    law=st.sampled_from(sorted(LAWS)),
    n=st.integers(3, 40),
    start=st.floats(1e-2, 1e4),
    loss=st.floats(1e-3, 20.0),
    noise=st.floats(0.0, 0.1),
    seed=st.integers(0, 2**32 - 1),
    known=st.booleans(),
)
def test_no_falling_spin_gives_a_nan_an_infinity_or_a_warning_of_numpys(*, law, n, start, loss, noise, seed, known):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.1, 10, n))
    rates = {"mixed": [loss / 2, loss / 2], "power": [loss, rng.uniform(-0.5, 2)]}.get(law, [loss])
    x = LAWS[law].spin((time - time[0]) / np.ptp(time), np.array([1.0, *rates]))
    y = start * np.abs(x + rng.normal(0, noise, n) + 1e-9)
    try:
        run = fit_spin_down(time, y, start * (noise + 1e-3) if known else None)
    except NoSpinDown:
        return
    assert_finite(run)
    assert run.best in {fit.name for fit in run.fits}


# -------------------------------------------------------------------------------------------------- errors that teach

Y = readings()


@pytest.mark.parametrize(
    ("error", "text", "arguments"),
    [
        (TooFewReadings, "2 usable readings", (T[:2], Y[:2])),
        (ShapesDiffer, "spin frequency has shape", (T, Y[:5])),
        (ShapesDiffer, "time has shape", (T.reshape(4, 5), Y)),
        (ShapesDiffer, "standard uncertainty has shape", (T, Y, [0.1, 0.2])),
        (NotFinite, "spin frequency number 3 is nan", (T[:4], [4, 3, np.nan, 1])),
        (NotFinite, "standard uncertainty number 1 is inf", (T, Y, np.inf)),
        (TimesNotIncreasing, "time number 3 is 10 s and follows 10 s", ([0, 10, 10, 20], Y[:4])),
        (NotPositive, "spin frequency number 4 is 0 Hz", (T[:4], [4, 3, 2, 0])),
        (NotPositive, "standard uncertainty number 1 is -0.1 Hz", (T, Y, -0.1)),
        (NoSpinDown, r"of the first and last third of the readings\), a falling spin", (T, np.full(20, 30.0))),
        (NoSpinDown, "a falling spin was expected", (T, Y[::-1])),
    ],
)
def test_readings_that_cannot_be_used_are_refused_in_one_sentence(error, text, arguments):
    with pytest.raises(error, match=text) as caught:
        fit_spin_down(*arguments)
    assert isinstance(caught.value, AnalysisError)
    assert "\n" not in str(caught.value)


def test_unknown_names_are_refused_with_the_known_ones():
    with pytest.raises(UnknownName, match="stokes, newton, disc, mixed, power"):
        fit_spin_down(T, Y, laws=["storks"])


def test_results_do_not_change_with_the_callers_arrays():
    time, y = T.copy(), Y.copy()
    run = fit_spin_down(time, y)
    time[:] = y[:] = 0
    assert run.frequency == pytest.approx(Y)
    with pytest.raises(ValueError, match="read-only"):
        run.frequency[0] = 0


def test_every_law_converges_and_stands_in_exactly_one_list():
    sizes = tuple(zip((3, 4, 5, 6, 8, 20, 60), itertools.cycle(LAWS)))
    for k, ((n, law), sigma) in enumerate(itertools.product(sizes, (1e-4, SIGMA, 0.1))):
        time, known = np.linspace(0, 190, n), k % 2
        run = spin_down_fit.fit_spin_down(time, readings(law, sigma, time=time), sigma if known else None)
        verdict = run.verdict
        assert n == 3 or not any("not converged" in kinds(fit) for fit in run.fits)
        listed = [*verdict.indistinguishable, *verdict.needless, *verdict.weak, *verdict.excluded]
        assert sorted(listed) == sorted(LAWS)


def test_an_uncertainty_stated_far_too_small_or_too_large_is_reported_and_changes_no_order():
    """The order of the laws is that of their misfit, in whatever unit the readings' u was written down."""
    y = readings()
    true, small, large = (fit_spin_down(T, y, u) for u in (SIGMA, 1e-11, 1.0))
    assert small.best == true.best
    assert set(small.verdict.excluded) == {"stokes", "newton"}
    assert "understated" in kinds(small)
    assert "overstated" in kinds(large)
    assert "correlated" not in kinds(large)  # small residuals beside a large u look like it


@pytest.mark.parametrize(("n", "largest"), [(4, 39), (5, 14.8), (6, 9.6), (7, 7.5)])
def test_u_of_few_readings_with_a_tilt_is_no_smaller_than_their_noise(n, largest):
    # largest: of 15 pulls by Student's t with n − 2 degrees of freedom, exceeded with a probability of 1 %
    rng, time = np.random.default_rng(1), 10.0 * np.arange(n)
    for _ in range(15):
        noisy = spin("disc", time, 40.0, 2.34e-4) + rng.normal(0, SIGMA, n)
        start = spin_down_fit.fit_spin_down(time, noisy, laws=["disc"]).fit("disc").parameters["start_frequency"]
        assert abs(start.value - 40.0) < largest * start.u


def test_a_law_is_never_excluded_for_the_number_of_its_constants():
    """Six readings: AICc charges a third constant 15; power fits as well as the disc that it contains."""
    time = np.linspace(0, 190, 6)
    for seed in range(5):
        assert "power" not in fit_spin_down(time, readings(time=time, seed=seed)).verdict.excluded
