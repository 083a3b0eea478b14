"""The precession with which a scene begins, on both sides of the spin from which on a steady one exists."""

import math

import numpy as np
import pytest

from levilab.simulator.field import flux_density
from levilab.simulator.model import base_field
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from levilab.simulator.start import start_of, steady_rates

TILT = 0.01
SCENE = preset("undriven").changed(
    {"start.position_m": [0, 0, 0.073], "start.tilt_rad": TILT, "start.precession": "steady"}
)
PLACE = np.array([0.0, 0.0, 0.073])
I1, I3 = SCENE.top.inertia_transverse_kg_m2, SCENE.top.inertia_axial_kg_m2
RESTORING = -SCENE.top.moment_a_m2 * float(flux_density(base_field(SCENE), PLACE[None, :])[0, 2])
#: The spin [rad/s] from which on there is a steady precession: (I3 w)^2 = 4 I1 cos(tilt) P.
EDGE = math.sqrt(4 * I1 * math.cos(TILT) * RESTORING) / I3


def rate(spin):
    return steady_rates(SCENE, spin, PLACE)[0]


def missing(spin, rate):
    """The torque [N m per sin(tilt)] that a rate lacks for a steady precession."""
    return I1 * math.cos(TILT) * rate**2 - I3 * spin * rate + RESTORING


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("spin", [1.0001 * EDGE, 1.2 * EDGE, 3 * EDGE])
def test_above_the_edge_the_slow_steady_rate_is_taken(spin, sense):
    found = rate(sense * spin)
    assert missing(sense * spin, found) == pytest.approx(0, abs=1e-12 * RESTORING)
    assert abs(found) < I3 * spin / (2 * I1 * math.cos(TILT))  # the slower of the two


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("spin", [0.9999 * EDGE, 0.8 * EDGE, 2 * math.pi * 5.0, 0.01])
def test_below_the_edge_the_rate_is_the_one_nearest_to_steady(spin, sense):
    # where the torque that is missing is least; at 5 Hz 26 rad/s, and not 2P/(I3 w) = 510 rad/s
    found = rate(sense * spin)
    assert found == pytest.approx(sense * I3 * spin / (2 * I1 * math.cos(TILT)), rel=1e-12)
    for other in (0.99 * found, 1.01 * found):
        assert missing(sense * spin, other) > missing(sense * spin, found) > 0


def test_the_edge_is_where_a_sleeping_top_begins_to_tip():
    assert EDGE / (2 * math.pi) == pytest.approx(21.7, abs=0.05)


def test_the_rate_is_continuous_over_the_edge_and_at_a_spin_of_zero():
    # like a square root above the edge: a millionth of the spin is a thousandth of the rate
    below, above = rate(EDGE * (1 - 1e-9)), rate(EDGE * (1 + 1e-9))
    assert above == pytest.approx(below, rel=1e-4)
    assert rate(0.0) == 0.0
    assert rate(1e-9) == pytest.approx(-rate(-1e-9), abs=1e-8)


def test_a_slow_top_starts_with_that_rate_and_keeps_its_tilt_best():
    slow = SCENE.changed({"start.spin_hz": 5.0})
    state = start_of(slow)
    n, momentum = state[6:9], state[9:12]
    across = momentum - (momentum @ n) * n
    assert np.linalg.norm(across) == pytest.approx(I1 * rate(2 * math.pi * 5.0) * math.sin(TILT), rel=1e-9)
    # it tips, but from a tilt that stands still
    tilt = simulate(slow, 0.002, rate=2000).tilt
    assert tilt[0] == pytest.approx(TILT)
    assert np.ptp(tilt) < 0.1 * TILT
