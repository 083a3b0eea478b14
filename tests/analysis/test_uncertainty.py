"""The mean of several runs and its uncertainty."""

import numpy as np
import pytest

from analysis.uncertainty import Estimate, mean


def test_a_mean_is_the_thesiss_with_its_uncertainty_from_the_scatter():
    c1 = [Estimate(c, 4e-6, "1/s") for c in (0.003199, 0.003134, 0.003133, 0.003261)]
    average = mean(c1)
    assert average.value == pytest.approx(0.00318175, rel=1e-12)  # the thesis prints this mean
    assert average.scatter == pytest.approx(6.1190e-5, rel=1e-4)  # by hand: √(1.1233e-8/3)
    assert average.u == pytest.approx(6.1190e-5 / 2, rel=1e-4)
    assert average.degrees_of_freedom == 3


def test_what_runs_of_one_top_share_grows_no_smaller_with_their_number():
    found = [Estimate(c, 5e-6, "1/s") for c in (1.0e-3, 1.002e-3, 0.998e-3, 1.0e-3)]
    shared = mean(found, [3e-6] * 4)
    assert shared.value == mean(found).value
    # by hand: each one's own part is √(5² − 3²) = 4, so 2 of the mean, with 3 of all
    assert mean([*found[:1]] * 4, [3e-6] * 4).u == pytest.approx(np.hypot(2e-6, 3e-6))
    assert mean([*found[:1]] * 400, [3e-6] * 400).u > 3e-6
