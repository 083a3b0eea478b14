"""The closed forms of the spin's decay against an integrator that knows none of them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from levilab.simulator.spin import DECAYS

START = 2 * math.pi * 40.0  # [rad/s]

#: Constants of which one is hardly or not at all there.
OF_ONE = [(1e-9, 1.7e-5), (3e-3, 1e-12), (0.0, 1.7e-5), (3e-3, 0.0)]
#: ω̇ = −g(ω), written independently, with constants of the size that tops show (PHYSICS.md, 5), and with extremes.
LAWS = {
    "stokes": (lambda w, c: c * w, [(3.18e-3,), (1e-7,), (0.5,)]),
    "newton": (lambda w, c: c * w**2, [(1.70e-5,), (1e-9,), (1e-2,)]),
    "disc": (lambda w, c: c * w**1.5, [(2.34e-4,), (1e-8,), (5e-2,)]),
    "mixed": (lambda w, c1, c2: c1 * w + c2 * w**2, [(1e-3, 1e-5), (0.3, 1e-3), *OF_ONE]),
}
CASES = [
    pytest.param(name, constants, id=f"{name}-{constants}")
    for name, (_, several) in LAWS.items()
    for constants in several
]


def test_every_law_is_tested():
    assert set(LAWS) == set(DECAYS)


@pytest.mark.parametrize(("name", "constants"), CASES)
def test_spin_and_angle_are_those_of_an_integrator(name, constants):
    drag, decay = LAWS[name][0], DECAYS[name]
    times = np.linspace(0.0, 200.0, 21)
    exact = solve_ivp(
        lambda _, y: [-drag(y[0], *constants), y[0]],
        (0.0, 200.0),
        [START, 0.0],
        method="DOP853",
        t_eval=times,
        rtol=1e-12,
        atol=1e-12,
    )
    spin = decay.after(START, times, *constants)
    # the integrator's tolerance a step, times some hundred steps
    np.testing.assert_allclose(spin, exact.y[0], rtol=2e-10, atol=1e-9)
    # from the difference of two spins, which for the smallest constants is a millionth of them after 10 s
    np.testing.assert_allclose(decay.turned(START, spin, *constants), exact.y[1], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("name", "constants"), CASES)
def test_times_and_angles_are_the_integrals_over_the_spin(name, constants):
    drag, decay = LAWS[name][0], DECAYS[name]
    end = START / 2
    time, _ = quad(lambda w: 1 / drag(w, *constants), end, START, epsabs=0.0, epsrel=1e-12)
    angle, _ = quad(lambda w: w / drag(w, *constants), end, START, epsabs=0.0, epsrel=1e-12)
    # ten times what quad was asked for
    assert decay.elapsed(START, end, *constants) == pytest.approx(time, rel=1e-11)
    assert decay.turned(START, end, *constants) == pytest.approx(angle, rel=1e-11)


@given(
    case=st.sampled_from([(name, constants) for name, (_, several) in LAWS.items() for constants in several[:1]]),
    start=st.floats(50.0, 500.0),
    time=st.floats(0.1, 1000.0),
)
def test_the_time_to_a_spin_is_the_time_after_which_it_is_reached(case, start, time):
    name, constants = case
    decay = DECAYS[name]
    # at 0.1 s the spin has lost 3e-4 of itself: the rounding of 1e-16 becomes 1e-12 of that
    assert decay.elapsed(start, decay.after(start, time, *constants), *constants) == pytest.approx(time, rel=1e-11)


@pytest.mark.parametrize(("name", "constants"), CASES)
def test_decay_composes(name, constants):
    decay = DECAYS[name]
    halfway = decay.after(START, 30.0, *constants)
    # a few roundings
    assert decay.after(halfway, 50.0, *constants) == pytest.approx(decay.after(START, 80.0, *constants), rel=1e-14)


def test_the_thesiss_spin_down_takes_about_as_long_as_it_took():
    # from 40 Hz to the fall near 22 Hz in about 190 s (PHYSICS.md, 5), at the mean of the refitted constants
    time = DECAYS["disc"].elapsed(START, 2 * math.pi * 21.86, 2.34e-4)
    assert time == pytest.approx(190.0, abs=10.0)
