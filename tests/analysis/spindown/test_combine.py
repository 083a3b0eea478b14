"""Several runs together."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from analysis.residuals import durbin_watson, runs_test_p
from analysis.spindown.combine import NothingToCombine, combine
from analysis.spindown.drag import LAWS, spin
from analysis.spindown.fit import fit_spin_down
from analysis.spindown.joint import JointExponent, joint_exponent

T = np.arange(0, 200, 10.0)
THESIS = (2.365e-4, 2.309e-4, 2.289e-4, 2.397e-4)  # C₃⸝₂ of the four runs, PHYSICS.md §5


def runs(u=0.03, constants=THESIS, *, tilt=False, **options):
    rng = np.random.default_rng(7)
    return [
        fit_spin_down(T, spin("disc", T, 40.0, c) + rng.normal(0, 0.03, T.size), u, tilt=tilt, **options)
        for c in constants
    ]


def test_each_constant_is_the_mean_of_the_runs():
    fitted = runs(tilt=True)
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


def test_the_common_law_is_found_and_the_others_excluded():
    together = combine(runs())
    assert set(together.verdict.excluded) >= {"stokes", "newton"}
    assert together.verdict.indistinguishable[0] == together.best
    assert "disc" in together.verdict.indistinguishable
    assert sum(fit.statistics.weight for fit in together.fits) == pytest.approx(1)


def test_runs_that_differ_more_than_their_fits_explain_are_told():
    (remark,) = combine(runs()).fit("disc").remarks
    assert (remark.kind, remark.name) == ("scatters", "c32")
    assert combine(runs(constants=[2.34e-4] * 4)).fit("disc").remarks == ()


@pytest.mark.parametrize("u", [0.03, None])
def test_statistics_are_those_of_one_experiment(u):
    fitted = runs(u)
    stats = combine(fitted).fit("disc").statistics
    fits = [run.fit("disc") for run in fitted]
    rss = sum((fit.residuals**2).sum() for fit in fits)
    n, p = 80, 8
    assert (stats.n, stats.n_parameters) == (n, p)
    assert stats.rms_residual == pytest.approx(np.sqrt(rss / n))
    assert stats.misfit == pytest.approx(sum(fit.statistics.misfit for fit in fits))
    k = p + 4  # the noise of each run
    assert stats.aicc == pytest.approx(stats.misfit + 2 * k + 2 * k * (k + 1) / (n - k - 1))
    assert stats.reduced_chi_square == (None if u is None else pytest.approx(rss / u**2 / (n - p)))
    residuals = [fit.residuals for fit in fits]
    assert stats.durbin_watson == pytest.approx(durbin_watson(*residuals))
    assert stats.runs_test_p == pytest.approx(runs_test_p(*residuals))


def test_one_run_keeps_its_own_uncertainty_and_says_what_that_lacks():
    (run,) = runs(constants=THESIS[:1])
    together = combine([run])
    constant, own = together.fit("disc").constants["c32"], run.fit("disc").parameters["c32"]
    assert (constant.value, constant.u, constant.scatter) == (own.value, own.u, None)
    assert together.remarks[-1].kind == "one run"


def test_runs_without_a_common_law_cannot_be_combined():
    with pytest.raises(NothingToCombine, match="0 runs"):
        combine([])
    with pytest.raises(NothingToCombine) as error:
        combine([*runs(laws=["disc"], constants=THESIS[:1]), *runs(laws=["stokes"], constants=THESIS[:1])])
    assert error.value.runs == 2


def test_laws_that_a_run_lacks_are_left_out():
    together = combine([*runs(constants=THESIS[:1]), *runs(laws=["disc", "stokes"], constants=THESIS[1:2])])
    assert [fit.name for fit in together.fits] == ["stokes", "disc"]


def joint_chi_square(fitted, exponent=None):
    """Return χ² by scipy, the exponent and its u: a start and a constant for each run, one exponent for all."""

    def residuals(q):
        n = q[-1] if exponent is None else exponent
        return np.concatenate([
            run.frequency - spin("power", run.time, 40 * q[2 * k], 2.34e-4 * 250 ** (1.5 - n) * q[2 * k + 1], n)
            for k, run in enumerate(fitted)
        ]) / 0.03  # fmt: skip

    found = least_squares(residuals, [1.0] * 2 * len(fitted) + ([1.5] if exponent is None else []))
    return 2 * found.cost, found.x[-1], np.sqrt(np.linalg.inv(found.jac.T @ found.jac)[-1, -1])


@pytest.mark.parametrize("u", [0.03, None])
def test_the_common_exponent_is_that_of_one_fit_to_all_readings(u):
    fitted = runs(u)
    _, exponent, expected_u = joint_chi_square(fitted)
    joint = joint_exponent(fitted)
    assert joint.value == pytest.approx(exponent, abs=0.3 * expected_u)  # the noise of each run is estimated from it
    assert joint.curvature**-0.5 == pytest.approx(expected_u, rel=0.25)
    stats = combine(fitted).fit("power").statistics
    assert (stats.n_parameters, stats.misfit) == (2 * len(fitted) + 1, joint.misfit)


def test_a_free_exponent_gains_as_much_over_the_true_law_as_in_one_fit():
    """Neither more nor less than in a joint fit by scipy with the true noise, which gains χ² with one freedom."""
    rng, gains, expected = np.random.default_rng(11), [], []
    for _ in range(6):
        fitted = [
            fit_spin_down(
                T, spin("disc", T, 40.0, c) + rng.normal(0, 0.03, T.size), 0.03, tilt=False, laws=["disc", "power"],
                keep_outliers=True,
            )
            for c in rng.normal(2.34e-4, 4e-6, 6)
        ]  # fmt: skip
        together = combine(fitted)
        gains.append(together.fit("disc").statistics.misfit - together.fit("power").statistics.misfit)
        expected.append(joint_chi_square(fitted, 1.5)[0] - joint_chi_square(fitted)[0])
    # the size of the noise and the correlation of neighbours are estimated here, each from 20 readings
    assert gains == pytest.approx(expected, abs=1.2)


def test_one_tilt_for_all_runs_pays_once_for_what_each_run_would():
    """N runs read y = e + g φ with noise 1, φ one for all with a normal prior: generalised least squares."""
    n, g = 6, 1.7
    y = np.array([0.3, 1.1, -0.2, 0.8, 0.4, 0.9])
    separate = [float(((y - e) ** 2).sum() / (1 + g**2)) for e in (0.0, y.mean())]
    inverse = np.linalg.inv(np.eye(n) + g**2 * np.ones((n, n)))
    once = [float((y - e) @ inverse @ (y - e)) for e in (0.0, y.mean())]
    joint = JointExponent(y.mean(), n / (1 + g**2), separate[1], g, n)
    assert joint.misfit_of(separate[0]) - joint.misfit == pytest.approx(once[0] - once[1])


def test_more_runs_make_no_law_more_excluded_for_its_constants():
    """Eight runs of a disc: power, which contains it, is never excluded, and its exponent is 3/2."""
    together = combine(runs(constants=[2.34e-4 * (1 + 0.02 * k) for k in range(-4, 4)]))
    assert set(together.verdict.excluded) >= {"stokes", "newton"}
    assert "power" in {*together.verdict.indistinguishable, *together.verdict.needless}
    exponent = together.fit("power").constants["exponent"]
    assert exponent.value == pytest.approx(1.5, abs=3 * exponent.u)


def kinds(*each):
    return [remark.kind for remark in combine(list(each)).remarks]


def test_few_runs_say_how_little_they_tell():
    (remark,) = combine(runs()[:2]).remarks
    assert remark.kind == "few runs"
    assert remark.values == pytest.approx((2, 1.84), abs=0.01)  # t of one degree of freedom at 84.1 %


def test_runs_without_stated_uncertainties_say_so_all_and_some():
    with_u, without = runs(constants=THESIS[:2]), runs(None, constants=THESIS[:2])
    said = [kinds(*each) for each in (without, [with_u[0], without[1]], with_u)]
    assert ["no u" in kind for kind in said] == [True, False, False]
    assert ["mixed u" in kind for kind in said] == [False, True, False]
