"""The transverse moment from its amplitude beside the top."""

import numpy as np
import pytest

from analysis.rotation import spin_of_field, transverse_moment
from analysis.uncertainty import Estimate

#: The thesis's top: 3 % of 0.714 A m².
MOMENT = 0.03 * 0.714


def field_of_a_turning_dipole(random, far, below, noise=1e-7):
    """From the definition of a dipole's field, for a phone that lies askew."""
    times = np.sort(np.arange(1000) / 100 + random.normal(0, 3e-4, 1000))
    angle = 2 * np.pi * 31 * times
    moment = MOMENT * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    away = np.array([far, 0.0, -below])
    r = np.linalg.norm(away)
    field = 1e-7 * (3 * (moment @ away)[:, None] * away / r**5 - moment / r**3)
    askew, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return times, field @ askew + random.normal(0, noise, (1000, 3))


@pytest.mark.parametrize(("far", "below"), [(0.2, 0.0), (0.18, 0.07), (0.05, 0.15)])
def test_it_is_that_of_the_dipole_however_the_phone_lies(far, below):
    random = np.random.default_rng(7)
    found = transverse_moment(
        spin_of_field(*field_of_a_turning_dipole(random, far, below)), Estimate(far, 0.0, "m"), below
    )
    assert abs(found.value - MOMENT) < 4 * found.u
    assert found.u < 0.05 * MOMENT


def test_the_distance_is_in_its_u():
    random = np.random.default_rng(8)
    spin = spin_of_field(*field_of_a_turning_dipole(random, 0.2, 0.05, noise=1e-9))
    found = transverse_moment(spin, Estimate(0.2, 0.002, "m"), 0.05)
    moved = [transverse_moment(spin, Estimate(0.2 + x, 0.0, "m"), 0.05 + z).value for x, z in ((2e-3, 0), (0, 2e-3))]
    assert found.u == pytest.approx(np.hypot(*(np.array(moved) - found.value)), rel=0.05)  # second order


def test_one_axis_does_not_tell_it():
    random = np.random.default_rng(9)
    times, field = field_of_a_turning_dipole(random, 0.2, 0.0)
    assert transverse_moment(spin_of_field(times, field[:, :1]), Estimate(0.2, 0.0, "m")) is None
