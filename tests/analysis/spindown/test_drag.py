"""Closed forms of the drag laws against arbitrary precision and an integrator that knows only the law."""

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from analysis.spindown.drag import LAWS, spin

CONSTANTS = {
    "stokes": (3.18e-3,),
    "newton": (1.73e-5,),
    "disc": (2.34e-4,),
    "mixed": (1.5e-3, 8e-6),
    "power": (2.34e-4, 1.5),
}
SLOWING = {
    "stokes": lambda w, c: -c * w,
    "newton": lambda w, c: -c * w**2,
    "disc": lambda w, c: -c * w**1.5,
    "mixed": lambda w, c1, c2: -c1 * w - c2 * w**2,
    "power": lambda w, c, n: -c * w**n,
}
TIMES = np.linspace(0, 2000, 21)  # down to 0.2 % (Stokes) and 19 % (Newton) of the start


def exact_power(tau, x0, kappa, m):
    """Textbook form, with as many digits as the limit m → 0 needs."""
    return x0 * mp.exp(-kappa * tau) if m == 0 else (x0**-m + m * kappa * tau) ** (-1 / m)


def exact_mixed(tau, x0, alpha, beta):
    if alpha == 0:
        return x0 / (1 + beta * x0 * tau)
    e = mp.exp(-alpha * tau)
    return alpha * x0 * e / (alpha + beta * x0 * (1 - e))


EXACT = {
    "stokes": lambda tau, x0, k: exact_power(tau, x0, k, mp.mpf(0)),
    "newton": lambda tau, x0, k: exact_power(tau, x0, k, mp.mpf(1)),
    "disc": lambda tau, x0, k: exact_power(tau, x0, k, mp.mpf("0.5")),
    "mixed": exact_mixed,
    "power": exact_power,
}
POINTS = [
    ("stokes", [1.3, 0.6]),
    ("newton", [1.3, 0.6]),
    ("disc", [1.3, 0.6]),
    ("disc", [1.0, 25.0]),
    ("mixed", [1.3, 0.3, 0.3]),
    ("mixed", [1.3, 1e-9, 0.6]),
    ("mixed", [1.3, -0.2, 0.6]),
    ("mixed", [1.3, 0.7, -0.2]),
    ("mixed", [1.3, 20.0, 3.0]),
    ("power", [1.3, 0.6, 0.5]),
    ("power", [1.3, 0.6, 1e-9]),
    ("power", [1.3, 0.6, -1e-6]),
    ("power", [1.3, 0.6, 0.04]),
    ("power", [1.3, 0.6, -0.9]),
    ("power", [0.9, 0.6, 6.0]),
    ("power", [1.3, -0.1, 0.5]),
]


@pytest.mark.parametrize("law", LAWS)
def test_the_closed_form_solves_the_equation_of_motion(law):
    start = 2 * np.pi * 40.0
    solved = solve_ivp(
        lambda _, w: SLOWING[law](w, *CONSTANTS[law]), (0, TIMES[-1]), [start], "DOP853", TIMES, rtol=1e-13, atol=1e-13
    )
    # 1e-10: the integrator's error grows with its few hundred steps of 1e-13 each
    assert spin(law, TIMES, 40.0, *CONSTANTS[law]) == pytest.approx(solved.y[0] / 2 / np.pi, rel=1e-10)


@pytest.mark.parametrize(("law", "q"), POINTS)
def test_the_closed_form_keeps_all_digits(law, q):
    tau = np.linspace(0, 1, 11)
    with mp.workdps(50):
        exact = [float(EXACT[law](mp.mpf(float(t)), *map(mp.mpf, q))) for t in tau]
    # 2e-14: the spin is the exponential of up to 20 rounded parts
    assert LAWS[law].spin(tau, np.array(q)) == pytest.approx(exact, rel=2e-14)


@pytest.mark.parametrize(("law", "q"), POINTS)
def test_the_gradient_is_that_of_the_closed_form(law, q):
    tau = np.linspace(0.1, 1, 7)
    with mp.workdps(60):
        for row, place in zip(LAWS[law].gradient(tau, np.array(q)), np.eye(len(q), dtype=int), strict=True):
            exact = [
                float(mp.diff(lambda *p, t=t: EXACT[law](mp.mpf(float(t)), *p), [*map(mp.mpf, q)], tuple(place)))
                for t in tau
            ]
            # 1e-12: near the end of the series two equal halves leave 1e-14, times the largest parts
            assert row == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_natural_constants_and_dimensionless_parameters_are_each_others_inverse(law):
    natural = [40.0, *CONSTANTS[law]]
    q = LAWS[law].dimensionless(natural, 29.0, 190.0)
    assert LAWS[law].natural(q, 29.0, 190.0)[0] == pytest.approx(natural, rel=1e-14)


@pytest.mark.parametrize("law", LAWS)
def test_the_slopes_of_the_natural_constants_are_exact(law):
    q = LAWS[law].dimensionless([40.0, *CONSTANTS[law]], 29.0, 190.0)
    _, slopes = LAWS[law].natural(q, 29.0, 190.0)
    for i, step in enumerate(np.eye(len(q)) * 1e-5):
        up, down = (LAWS[law].natural(q + sign * step, 29.0, 190.0)[0] for sign in (1, -1))
        # 1e-8: the difference over two steps is off by h²/6 · (ln ω)² ≈ 5e-10
        assert slopes[:, i] == pytest.approx((up - down) / 2e-5, rel=1e-8, abs=1e-18)


def test_a_power_below_one_stops_the_top_in_finite_time():
    # ω̇ = −c: 40 Hz are gone after 2π·40/c = 100 s
    c = 2 * np.pi * 40 / 100
    assert spin("power", [0, 50, 99, 101, 1e6], 40.0, c, 0.0) == pytest.approx([40, 20, 0.4, 0, 0], abs=1e-12)


@pytest.mark.parametrize("law", ["mixed", "power"])
def test_no_step_of_a_search_however_wild_overflows(law):
    tau = np.linspace(0, 1, 5)
    wild = [-1e6, -700.0, -1.0, 0.0, 1e-12, 1.0, 700.0, 1e6]
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        for q in np.array(np.meshgrid([-1.0, 1e-3, 1.0, 1e3], wild, wild)).reshape(3, -1).T:
            assert np.isfinite(LAWS[law].spin(tau, q) ** 2).all()
            assert np.isfinite(LAWS[law].gradient(tau, q)).all()
