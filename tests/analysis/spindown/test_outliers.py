"""How far a reading must lie off to be left out, and how many may."""

import numpy as np
import pytest
from scipy.special import ndtri

from analysis.spindown.drag import spin
from analysis.spindown.fit import fit_spin_down

T = np.arange(0, 200, 10.0)
#: Twenty values that scatter as a standard normal variable does, in an order without a trend.
SCATTER = ndtri((np.argsort(np.random.default_rng(5).random(20)) + 0.5) / 20)


def readings(relative):
    return spin("disc", T, 40.0, 2.34e-4) * (1 + relative * SCATTER)


@pytest.mark.parametrize(("off", "left_out"), [(0.55, True), (0.75, False)])
def test_of_noisy_readings_those_beyond_eight_standard_deviations_are_miscounts(off, left_out):
    # with 4 % of noise eight standard deviations are a third; more than a tenth of the readings, so not one at a time
    y, where = readings(0.04), [3, 9, 14, 16]
    y[where] = spin("disc", T, 40.0, 2.34e-4)[where] * off
    assert (set(fit_spin_down(T, y).outliers) >= set(where)) is left_out


def test_at_most_a_tenth_of_the_readings_is_left_out_beside_miscounts():
    y = readings(2e-4)
    y[[5, 9, 14]] *= [1.12, 0.96, 1.015]  # 70 standard deviations and more, and no miscounts
    assert fit_spin_down(T, y, 0.01).outliers == (5, 9)
