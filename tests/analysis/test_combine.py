"""Several runs together."""

import numpy as np
import pytest

from analysis.combine import combine, mean
from analysis.drag import LAWS, spin
from analysis.errors import NothingToCombine
from analysis.residuals import durbin_watson, runs_test_p
from analysis.spindown import Estimate, fit_spin_down

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
            assert average.u == pytest.approx(np.std(values, ddof=1) / 2)
    lines = [run.fit("disc").linearised["c32"].value for run in fitted]
    assert together.fit("disc").linearised["c32"].value == pytest.approx(np.mean(lines))


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
