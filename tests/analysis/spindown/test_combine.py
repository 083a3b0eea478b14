"""Several runs together."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from analysis.errors import NothingToCombine
from analysis.residuals import durbin_watson, runs_test_p
from analysis.spindown.combine import combine, mean
from analysis.spindown.drag import LAWS, spin
from analysis.spindown.fit import Estimate, fit_spin_down

T = np.arange(0, 200, 10.0)
THESIS = (2.365e-4, 2.309e-4, 2.289e-4, 2.397e-4)  # C₃⸝₂ of the four runs, PHYSICS.md §5


def runs(u=0.03, constants=THESIS, **options):
    rng = np.random.default_rng(7)
    return [fit_spin_down(T, spin("disc", T, 40.0, c) + rng.normal(0, 0.03, T.size), u, **options) for c in constants]


def test_a_mean_is_the_thesiss_with_its_uncertainty_from_the_scatter():
    c1 = [Estimate(c, 4e-6, "1/s") for c in (0.003199, 0.003134, 0.003133, 0.003261)]
    average = mean(c1)
    assert average.value == pytest.approx(0.00318175, rel=1e-12)  # the thesis prints this mean
    assert average.scatter == pytest.approx(6.1190e-5, rel=1e-4)  # by hand: √(1.1233e-8/3)
    assert average.u == pytest.approx(6.1190e-5 / 2, rel=1e-4)
    assert average.degrees_of_freedom == 3


def test_each_constant_is_the_mean_of_the_runs():
    fitted = runs()
    together = combine(fitted)
    for name in LAWS:
        for constant, average in together.fit(name).constants.items():
            values = [run.fit(name).parameters[constant].value for run in fitted]
            assert average.value == pytest.approx(np.mean(values))
            shared = np.array([run.fit(name).shared_u[constant] for run in fitted])
            own2 = np.square([run.fit(name).parameters[constant].u for run in fitted]) - shared**2
            assert average.scatter == pytest.approx(np.std(values, ddof=1))
            assert average.u == pytest.approx(
                np.hypot(max(average.scatter / 2, np.sqrt(own2.sum()) / 4), shared.mean())
            )
    lines = [run.fit("disc").linearised["c32"].value for run in fitted]
    assert together.fit("disc").linearised["c32"].value == pytest.approx(np.mean(lines))


def test_what_runs_of_one_top_share_grows_no_smaller_with_their_number():
    found = [Estimate(c, 5e-6, "1/s") for c in (1.0e-3, 1.002e-3, 0.998e-3, 1.0e-3)]
    shared = mean(found, [3e-6] * 4)
    assert shared.value == mean(found).value
    # by hand: each one's own part is √(5² − 3²) = 4, so 2 of the mean, with 3 of all
    assert mean([*found[:1]] * 4, [3e-6] * 4).u == pytest.approx(np.hypot(2e-6, 3e-6))
    assert mean([*found[:1]] * 400, [3e-6] * 400).u > 3e-6


def test_the_common_law_is_found_and_the_others_excluded():
    together = combine(runs())
    assert {name for name, _ in together.verdict.excluded} >= {"stokes", "newton"}
    assert together.verdict.indistinguishable[0] == together.best
    assert "disc" in together.verdict.indistinguishable
    assert sum(fit.statistics.weight for fit in together.fits) == pytest.approx(1)


def test_runs_that_differ_more_than_their_fits_explain_are_told():
    (warning,) = combine(runs()).fit("disc").warnings
    assert "c32 scatters between the runs" in warning
    assert combine(runs(constants=[2.34e-4] * 4)).fit("disc").warnings == ()


@pytest.mark.parametrize("u", [0.03, None])
def test_statistics_are_those_of_one_experiment(u):
    fitted = runs(u)
    stats = combine(fitted).fit("disc").statistics
    fits = [run.fit("disc") for run in fitted]
    rss = sum((fit.residuals**2).sum() for fit in fits)
    n, p = 80, 8
    assert (stats.n, stats.n_parameters) == (n, p)
    assert stats.rms_residual == pytest.approx(np.sqrt(rss / n))
    if u is None:
        k = p + 1
        assert stats.aicc == pytest.approx(n * np.log(rss / n) + 2 * k + 2 * k * (k + 1) / (n - k - 1))
        assert stats.reduced_chi_square is None
    else:
        assert stats.reduced_chi_square == pytest.approx(rss / u**2 / (n - p))
        assert stats.aicc == pytest.approx(rss / u**2 + 2 * p + 2 * p * (p + 1) / (n - p - 1))
    residuals = [fit.residuals for fit in fits]
    assert stats.durbin_watson == pytest.approx(durbin_watson(*residuals))
    assert stats.runs_test_p == pytest.approx(runs_test_p(*residuals))


def test_one_run_keeps_its_own_uncertainty_and_says_what_that_lacks():
    (run,) = runs(constants=THESIS[:1])
    together = combine([run])
    constant, own = together.fit("disc").constants["c32"], run.fit("disc").parameters["c32"]
    assert (constant.value, constant.u, constant.scatter) == (own.value, own.u, None)
    assert "scatter between runs" in together.warnings[-1]


def test_runs_without_a_common_law_cannot_be_combined():
    with pytest.raises(NothingToCombine, match="0 runs"):
        combine([])
    with pytest.raises(NothingToCombine) as error:
        combine([*runs(laws=["disc"], constants=THESIS[:1]), *runs(laws=["stokes"], constants=THESIS[:1])])
    assert error.value.runs == 2


def test_laws_that_a_run_lacks_are_left_out():
    together = combine([*runs(constants=THESIS[:1]), *runs(laws=["disc", "stokes"], constants=THESIS[1:2])])
    assert [fit.name for fit in together.fits] == ["stokes", "disc"]


def common_fit(fitted, u):
    """χ² of all runs fitted at once with one exponent."""

    def residuals(parameters):
        exponent, rest = parameters[0], parameters[1:].reshape(len(fitted), 2)
        return np.concatenate([
            (run.frequency - spin("power", run.time - run.start_time, start, np.exp(log_c), exponent)) / sigma
            for run, (start, log_c), sigma in zip(fitted, rest, u, strict=True)
        ])  # fmt: skip

    own = [
        [fit.parameters[key].value for key in ("start_frequency", "c", "exponent")]
        for fit in (r.fit("power") for r in fitted)
    ]
    exponent = np.mean([each[2] for each in own])
    shift = [np.log(c) + (n - exponent) * np.log(2 * np.pi * 30) for _, c, n in own]
    start = [exponent, *np.ravel([(each[0], log_c) for each, log_c in zip(own, shift, strict=True)])]
    return 2 * least_squares(residuals, start, x_scale=np.abs(start), xtol=1e-15, ftol=1e-15, gtol=1e-15).cost


@pytest.mark.parametrize("u", [0.03, None])
def test_one_exponent_for_all_runs_costs_what_a_common_fit_finds(u):
    """Against a fit of all runs at once with one exponent: the parabola is exact to a few per cent of the growth."""
    fitted = runs(u)
    stats = combine(fitted).fit("power").statistics
    assert stats.n_parameters == 2 * len(fitted) + 1
    separate = sum(fit.fit("power").statistics.rss for fit in fitted)
    growth = common_fit(fitted, [0.03] * len(fitted)) * 0.03**2 - separate
    assert growth > 0
    assert stats.rss - separate == pytest.approx(growth, rel=0.05)


def test_runs_weigh_in_their_common_exponent_by_the_uncertainties_that_were_stated():
    """Though one states a tenth of its scatter, and its uncertainties are enlarged: χ² is that of the stated ones."""
    stated = [0.03, 0.003, 0.03]
    fitted = [runs(u, constants=THESIS[:3])[k] for k, u in enumerate(stated)]
    assert fitted[1].fit("power").statistics.inflation > 10
    separate = sum(run.fit("power").statistics.chi_square for run in fitted)
    growth = common_fit(fitted, stated) - separate
    assert combine(fitted).fit("power").statistics.chi_square - separate == pytest.approx(growth, rel=0.05)


def test_more_runs_make_no_law_more_excluded_for_its_constants():
    """Eight runs of a disc: power, which contains it, is never excluded, and its exponent is 3/2."""
    together = combine(runs(constants=[2.34e-4 * (1 + 0.02 * k) for k in range(-4, 4)]))
    assert {name for name, _ in together.verdict.excluded} >= {"stokes", "newton"}
    assert "power" in {*together.verdict.indistinguishable, *together.verdict.needless}
    exponent = together.fit("power").constants["exponent"]
    assert exponent.value == pytest.approx(1.5, abs=3 * exponent.u)


def test_few_runs_say_how_little_they_tell():
    assert "Student's t" in combine(runs()[:2]).warnings[-1]
    assert "1.8 u" in combine(runs()[:2]).warnings[-1]  # t of one degree of freedom at 84.1 %: 1.84


def test_runs_without_stated_uncertainties_say_so_all_and_some():
    with_u, without = runs(constants=THESIS[:2]), runs(None, constants=THESIS[:2])
    said = [" ".join(combine(each).warnings) for each in (without, [with_u[0], without[1]], with_u)]
    assert ["no uncertainties of the readings were given" in text for text in said] == [True, False, False]
    assert ["1 of 2 runs give no uncertainties" in text for text in said] == [False, True, False]
