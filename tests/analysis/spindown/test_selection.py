"""The criteria and the verdict, against the textbook's formulas and limits."""

import numpy as np
import pytest

from analysis.spindown.selection import statistics, weigh
from analysis.spindown.verdict import is_simple, verdict


def fit(misfit, n=20, p=2, **given):
    """Return the statistics of readings with known uncertainties."""
    given = {"durbin_watson": 2.0, "runs_test_p": 0.5, "chi_square": misfit} | given
    return statistics(n=n, n_parameters=p, rss=misfit * 1e-4, misfit=misfit, **given)


def test_a_stated_u_counts_as_eight_readings_beside_those_that_scatter():
    assert fit(18.0).variance_factor == 1.0
    assert fit(180.0).variance_factor == pytest.approx((8 + 180) / 26)
    assert fit(9.0).variance_factor == pytest.approx((8 + 9) / 26)
    assert fit(9.0, chi_square=None).variance_factor == 1.0


def test_weights_and_differences_are_akaikes():
    # Burnham & Anderson (2002) eqs. (2.4), (2.9), with the size of the noise among the parameters
    weighed, criterion = weigh({"disc": fit(18.0, p=2), "power": fit(17.0, p=3)})
    difference = 17.0 - 18.0 + penalty(20, 4) - penalty(20, 3)
    assert criterion == "aicc"
    assert weighed["power"].difference == pytest.approx(difference)
    assert weighed["power"].weight == pytest.approx(1 / (1 + np.exp(difference / 2)))


def penalty(n, k):
    return 2 * k + 2 * k * (k + 1) / (n - k - 1)


def judged(**fits):
    return verdict(*weigh(fits))


@pytest.mark.parametrize(
    ("more", "kind"), [(3.9, "indistinguishable"), (4.1, "weak"), (9.9, "weak"), (10.1, "excluded")]
)
def test_laws_are_judged_by_the_differences_of_the_textbook(more, kind):
    # Burnham & Anderson (2002) § 2.6: up to 4 a law has support, beyond 10 none; laws with as many constants
    found = judged(disc=fit(18.0), stokes=fit(18.0 + more))
    lists = ("indistinguishable", "weak", "excluded")
    assert [name for name in lists if "stokes" in getattr(found, name)] == [kind]


@pytest.mark.parametrize(("worse", "needless"), [(3.0, True), (6.0, False)])
def test_a_law_with_more_constants_is_needless_only_where_it_fits_as_well(worse, needless):
    # mixed does not contain the disc: it may fit worse with a constant more
    found = judged(disc=fit(18.0), mixed=fit(18.0 + worse, p=3))
    assert ("mixed" in found.needless) is needless


def test_no_number_of_constants_excludes_a_law():
    found = judged(disc=fit(18.0), mixed=fit(24.0, p=5))  # AICc charges 11 for three more of them
    assert found.weak == ("mixed",)
    assert judged(disc=fit(18.0), mixed=fit(28.1, p=5)).excluded == ("mixed",)


def test_of_laws_that_fit_alike_none_is_singled_out_before_one_with_fewer_constants():
    found = judged(mixed=fit(18.0, p=3), disc=fit(21.7, p=2), stokes=fit(90.0, p=2))
    assert found.best == "disc"  # whose constants are shown
    assert found.indistinguishable == ("disc", "mixed")
    assert not found.decided
    assert judged(disc=fit(18.0, p=2), mixed=fit(17.0, p=3)).decided


def test_simple_laws_are_those_that_contain_no_other():
    laws = ("stokes", "newton", "disc", "mixed", "power")
    assert [name for name in laws if is_simple(name)] == ["stokes", "newton", "disc"]
