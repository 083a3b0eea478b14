"""The pieces of the two flows, each against an authority: rotations, sines, decays, the laws of drag."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levilab.simulator.accuracy import LONGEST_TURN
from levilab.simulator.kernels import braking, vectors
from levilab.simulator.spin import DECAYS
from support.parts import callable_part

rotation, rotate, sine_of_turns = map(callable_part, (vectors.rotation, vectors.rotate, vectors.sine_of_turns))
decay, mean_decay = callable_part(braking.decay), callable_part(braking.mean_decay)
slowed, rate = callable_part(braking.spin_after), callable_part(braking.spin_rate)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-3, 0.1, 0.3, 0.5])
def test_a_turn_is_that_of_rodrigues_to_rounding(angle):
    axis, a = np.array([0.6, -0.64, 0.48]), np.array([0.1, 0.2, -0.97])
    sinc, cosc = rotation(angle**2)
    turned = rotate(tuple(a), tuple(axis), angle * sinc, angle**2 * cosc)
    assert turned == pytest.approx(Rotation.from_rotvec(axis * angle).apply(a), abs=4e-16)


def test_the_longest_turn_of_a_drift_is_as_exact_as_said():
    for angle, error in ((1.0, 3e-15), (LONGEST_TURN, 2e-10)):
        sinc, cosc = rotation(angle**2)
        assert sinc == pytest.approx(math.sin(angle) / angle, abs=error)
        assert cosc == pytest.approx((1 - math.cos(angle)) / angle**2, abs=error)


def test_the_sine_of_turns_agrees_with_the_library_at_any_phase():
    # 1e4 turns: five minutes of a 30 Hz drive; the rest is the rounding of the argument itself
    for turns in np.concatenate([np.linspace(-1.3, 1.3, 1001), [0.25, 0.5, 0.75, 1e4 + 0.2]]):
        exact = math.sin(2 * math.pi * math.remainder(turns, 1.0))
        assert sine_of_turns(turns) == pytest.approx(exact, abs=4e-16)


@pytest.mark.parametrize("x", [-0.2, -1e-5, 0.0, 1e-9, 0.05, 0.2])
def test_decay_and_its_average_are_those_of_the_library(x):
    assert decay(x) == pytest.approx(math.exp(-x), rel=3e-16)
    assert mean_decay(x) == pytest.approx(-math.expm1(-x) / x if x else 1.0, rel=3e-16)


LAWS = {
    "stokes": braking.Stokes(0.3),
    "newton": braking.Newton(2e-3),
    "disc": braking.LaminarDisc(2e-2),
    "mixed": braking.Mixed(0.2, 1e-3),
}


@pytest.mark.parametrize("name", LAWS)
def test_a_slowed_spin_follows_the_closed_form_either_way_round_and_back(name):
    law = LAWS[name]
    for spin in (188.5, 6.0):
        for d in (1e-3, 0.3):
            after = float(DECAYS[name].after(spin, d, *law))
            assert slowed(law, spin, d) == pytest.approx(after, rel=1e-15)
            assert slowed(law, -spin, d) == pytest.approx(-after, rel=1e-15)
            assert slowed(law, after, -d) == pytest.approx(spin, rel=1e-15)


@pytest.mark.parametrize("name", LAWS)
def test_the_rate_of_a_law_is_the_slope_of_its_flow(name):
    law, d = LAWS[name], 1e-4
    # a central difference: its error is of third order in C·d < 1e-4
    slope = (slowed(law, 188.5, d) - slowed(law, 188.5, -d)) / (2 * d)
    assert rate(law, 188.5) == pytest.approx(slope, rel=1e-8)
