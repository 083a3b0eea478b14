"""Statistics of fits and what is made of them, against the textbook's formulas and tables."""

import math

import pytest
from scipy.stats import chi2

from analysis.spindown.selection import statistics, variance_factor, weigh
from analysis.spindown.verdict import verdict


def fit(chi_square, n=20, p=2, **given):
    """Of readings with known uncertainties."""
    given = {"durbin_watson": 2.0, "runs_test_p": 0.5} | given
    return statistics(n=n, n_parameters=p, rss=chi_square * 1e-4, least_rss=0.0, chi_square=chi_square, **given)


def test_scatter_that_chance_makes_once_in_a_thousand_is_none():
    limit = float(chi2.isf(1e-3, 18))
    assert fit(0.999 * limit).inflation == 1.0
    assert fit(1.001 * limit).inflation == pytest.approx(1.001 * limit / 18)


def test_the_unit_of_chi_square_is_that_of_the_law_that_fits_best():
    fits = {"disc": fit(90.0), "stokes": fit(900.0)}
    assert variance_factor(fits) == pytest.approx(90.0 / 18)
    assert variance_factor({"disc": fit(18.0), "stokes": fit(900.0)}) == 1.0


def test_with_understated_uncertainties_laws_are_compared_by_qaicc():
    # Burnham & Anderson (2002) eq. (2.6.2): χ²/ĉ + 2K + 2K(K + 1)/(n − K − 1), ĉ one of the K parameters
    fits = {"disc": fit(90.0, p=2), "power": fit(85.0, p=3)}
    weighed, criterion = weigh(fits)
    factor = 85.0 / 17
    expected = {name: one.chi_square / factor + penalty(20, one.n_parameters + 1) for name, one in fits.items()}
    assert criterion == "aicc"
    assert weighed["power"].difference == pytest.approx(expected["power"] - expected["disc"])
    # with ĉ known to be 1 it is no parameter
    sound, _ = weigh({"disc": fit(18.0, p=2), "power": fit(17.0, p=3)})
    assert sound["power"].difference == pytest.approx(17.0 - 18.0 + penalty(20, 3) - penalty(20, 2))


def penalty(n, k):
    return 2 * k + 2 * k * (k + 1) / (n - k - 1)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("sigmas", "shape"), [(2.9, False), (3.1, True)])
def test_a_shape_is_three_standard_deviations_of_durbin_and_watson(sigmas, shape, sign):
    # for noise the statistic is 2 ± 2/√n
    assert fit(18.0, durbin_watson=2 + sign * sigmas * 2 / math.sqrt(20)).has_shape is shape


@pytest.mark.parametrize("p", [0.009, 0.011])
def test_signs_in_an_order_that_one_in_a_hundred_has_are_a_shape(p):
    assert fit(18.0, runs_test_p=p).has_shape is (p < 0.01)


def judged(**fits):
    weighed, criterion = weigh(fits)
    return verdict(weighed, criterion, fall=0.3, exponent=None)


@pytest.mark.parametrize(
    ("more", "kind"), [(3.9, "indistinguishable"), (4.1, "weak"), (9.9, "weak"), (10.1, "excluded")]
)
def test_laws_are_told_apart_by_the_differences_of_the_textbook(more, kind):
    # Burnham & Anderson (2002) § 2.6: up to 4 a law has support, beyond 10 none; laws with as many constants
    found = judged(disc=fit(18.0), stokes=fit(18.0 + more))
    lists = {name: getattr(found, name) for name in ("indistinguishable", "weak")}
    lists["excluded"] = tuple(name for name, _ in found.excluded)
    assert [name for name, laws in lists.items() if "stokes" in laws] == [kind]


@pytest.mark.parametrize(("worse", "needless"), [(3.0, True), (6.0, False)])
def test_a_law_with_more_constants_is_needless_only_where_it_fits_as_well(worse, needless):
    # mixed does not contain the disc: it may fit worse with a constant more
    found = judged(disc=fit(18.0), mixed=fit(18.0 + worse, p=3))
    assert ("mixed" in found.needless) is needless


def test_of_laws_that_fit_alike_none_is_singled_out_before_one_with_fewer_constants():
    found = judged(mixed=fit(18.0, p=3), disc=fit(21.5, p=2), stokes=fit(90.0, p=2))  # ΔAICc 0.7 in favour of mixed
    assert found.best == "mixed"
    assert not found.decided
    assert found.text.startswith("The laws disc and mixed cannot be told apart: they fit as well as each other, disc")
    assert judged(disc=fit(18.0, p=2), mixed=fit(17.0, p=3)).decided


def test_the_reason_of_an_exclusion_has_digits_that_differ():
    # u = 0.01 Hz: rms 0.01010 and 0.01040 Hz
    found = judged(disc=fit(2040.0, n=2000, p=2), mixed=fit(2163.0, n=2000, p=2))
    assert "it leaves 0.0104 Hz rms, disc 0.0101 Hz" in dict(found.excluded)["mixed"]
