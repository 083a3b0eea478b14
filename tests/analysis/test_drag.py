"""The curve through spins: its slope and u under each drag and on a ramp, against the laws' closed forms."""

import math

import numpy as np
import pytest

from analysis.drag import fit_curve
from analysis.spindown.drag import LAWS, spin


@pytest.mark.parametrize("u", [0.002, 0.03])
@pytest.mark.parametrize("number", [3, 13])
@pytest.mark.parametrize("law", ["stokes", "disc", "newton", "falling ramp", "rising ramp"])
def test_the_slope_in_the_middle_has_the_right_u_and_no_curve_is_a_swing(law, number, u):
    time, sizes, rng = np.linspace(0, 60, number), np.full(number, u), np.random.default_rng(11)
    if law in LAWS:
        constant = 0.2 / 40 * (2 * math.pi * 40) ** (1 - LAWS[law].exponent)
        curve, near = (spin(law, at, 40.0, constant) for at in (time, np.array([29.99, 30.01])))
        slope = float(np.diff(near)[0] / 0.02)
    else:
        slope = {"falling ramp": -1 / 6, "rising ramp": 1 / 3}[law]
        curve = 30 + slope * (time - 30)
    found = [fit_curve(time, curve + rng.normal(0, sizes), sizes) for _ in range(60)]
    pulls = [(one.slope - slope) / one.u for one in found]
    assert abs(np.mean(pulls)) < 4 / math.sqrt(60)
    assert np.std(pulls) == pytest.approx(1.0, abs=4 / math.sqrt(2 * 60))
    # an even ramp is two u away from a drag, and that is all
    assert np.median([one.chi_square for one in found]) < number - 2 + 4 + 3 * math.sqrt(2 * (number - 2) / 60)


def test_two_spins_have_the_slope_between_them_with_what_the_exponent_leaves_open():
    time = np.array([0.0, 60.0])
    found = fit_curve(time, spin("stokes", time, 40.0, 0.0067), np.full(2, 0.002))
    there = float(spin("stokes", np.array([30.0]), 40.0, 0.0067)[0])
    assert abs(found.slope + 0.0067 * there) < found.u < 0.01
