"""Budgets: squares add up, and each row is as large as what its input does to the result."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.budget import Budget, Component, gate_bias, printed_step, rest, u_of_step
from analysis.field.fit import PARAMETERS, Known, Prior, fit_scan, parts_of
from analysis.field.ring import Ring, on_axis
from analysis.spindown.drag import LAWS, spin
from analysis.spindown.fit import fit_spin_down

TIME = np.arange(0.0, 200.0, 10.0)
DISC = spin("disc", TIME, 40.0, 2.34e-4)


def component(size, *, included=True):
    return Component("row", "a row", "A", size, "Hz", 2.0, included=included)


# --- a budget ------------------------------------------------------------------------------------------


@given(st.lists(st.floats(1e-6, 1e6), min_size=1, max_size=8))
def test_squares_of_the_rows_add_up_and_shares_are_parts_of_one(sizes):
    rows = tuple(map(component, sizes))
    budget = Budget("x", 1.0, float(np.linalg.norm([2 * size for size in sizes])), "Hz", rows)
    assert budget.closes
    assert sum(budget.share(row) or 0.0 for row in rows) == pytest.approx(1, rel=1e-9)
    assert budget.largest == budget.included[0] == max(rows, key=lambda row: row.contribution)


def test_a_row_that_is_not_in_u_changes_no_share_and_stands_in_u_with_all():
    budget = Budget("x", 1.0, 6.0, "Hz", (component(3.0), component(4.0, included=False)))
    assert budget.closes
    assert budget.share(budget.included[0]) == 1.0
    assert budget.u_with_all == pytest.approx(10.0)
    assert not budget.misses_nothing


def test_a_budget_whose_rows_do_not_add_up_says_so():
    assert not Budget("x", 1.0, 6.0, "Hz", (component(2.9),)).closes


@given(st.lists(st.integers(-(10**6), 10**6), min_size=2, max_size=20), st.integers(0, 5))
def test_the_step_of_printed_numbers_is_that_of_their_last_digit(numbers, decimals):
    step = printed_step([number / 10**decimals for number in [*numbers, 1]])
    assert step == pytest.approx(10.0**-decimals)


def test_rounding_scatters_by_as_much_as_its_row_says():
    random = np.random.default_rng(1)
    numbers = random.uniform(20, 40, 4000)
    assert np.std(np.round(numbers, 1) - numbers) == pytest.approx(u_of_step(0.1), rel=0.03)  # 3 standard errors


def test_a_mean_over_a_gate_exceeds_the_middle_by_the_bias():
    t = np.linspace(-0.5, 0.5, 20001)
    curve = 30.0 - 0.1 * t + 0.5 * 4.5e-4 * t**2
    bias = float(gate_bias(curve[0], curve[10000], curve[-1]))
    assert np.trapezoid(curve, t) - 30.0 == pytest.approx(bias, rel=1e-4)
    assert bias == pytest.approx(4.5e-4 / 24, rel=1e-6)  # ν″T²/24


def test_rest_is_what_is_left_of_a_sum_of_squares():
    assert rest(13.0, 5.0) == pytest.approx(12.0)
    assert rest(1.0, 2.0) == 0.0


# --- a spin-down ---------------------------------------------------------------------------------------


def readings(seed=1, noise=0.03):
    return DISC + noise * np.random.default_rng(seed).standard_normal(len(TIME))


def squares(parts):
    return float(np.linalg.norm([parts.scatter, parts.excess, parts.correlation, parts.tilt]))


@pytest.mark.parametrize("u", [0.03, 0.004, None])
@pytest.mark.parametrize("tilt", [False, True])
def test_the_parts_of_every_constant_add_up_to_its_u(u, tilt):
    found = fit_spin_down(TIME, readings(3), u, laws=["disc", "mixed", "power"], tilt=tilt)
    for fit in found.fits:
        assert set(fit.parts) == set(fit.parameters)
        for name, parts in fit.parts.items():
            assert squares(parts) == pytest.approx(fit.parameters[name].u, rel=1e-9), (fit.name, name)


def test_independent_readings_of_their_stated_u_leave_scatter_and_what_is_not_known_of_their_correlation():
    parts = fit_spin_down(TIME, readings(5), 0.03, laws=["disc"], tilt=False).fit("disc").parts["c32"]
    assert parts.scatter > 0
    assert parts.excess < 0.3 * parts.scatter  # these scatter by 1.03 of their u
    assert parts.correlation < parts.scatter
    assert (parts.tilt, parts.gate) == (0, None)


def test_a_u_that_is_stated_three_times_too_small_is_an_excess():
    parts = fit_spin_down(TIME, readings(6), 0.01, laws=["disc"], tilt=False).fit("disc").parts["c32"]
    assert parts.excess > 2 * parts.scatter


def test_correlated_readings_have_a_row_of_their_own():
    random, noise = np.random.default_rng(8), np.zeros(len(TIME))
    for k in range(1, len(noise)):
        noise[k] = 0.9 * noise[k - 1] + 0.03 * random.standard_normal()
    found = fit_spin_down(TIME, DISC + noise, laws=["disc"], tilt=False)
    assert found.is_correlated
    assert found.fit("disc").parts["c32"].correlation > found.fit("disc").parts["c32"].scatter


def test_a_gate_moves_the_constants_by_as_much_as_their_row_says():
    gate, fine = 9.0, np.linspace(-0.5, 0.5, 2001)
    means = np.array([np.mean(spin("disc", t + gate * fine, 40.0, 2.34e-4)) for t in TIME[1:-1]])
    here = spin("disc", TIME[1:-1], 40.0, 2.34e-4)
    fits = [
        fit_spin_down(TIME[1:-1], of, 0.03, laws=["disc"], tilt=False, gate=gate).fit("disc") for of in (here, means)
    ]
    for name in ("start_frequency", "c32"):
        moved = fits[1].parameters[name].value - fits[0].parameters[name].value
        # Simpson's nodes lie within the readings, which moves those of the first and last reading
        assert fits[0].parts[name].gate == pytest.approx(moved, rel=0.12)
    assert abs(fits[0].parts["c32"].gate) < fits[0].parameters["c32"].u  # that of 1 s is 81 times less


# --- a scan --------------------------------------------------------------------------------------------

KNOWN = Known(
    Prior(0.030, 1e-4), Prior(0.055, 1e-4), Prior(0.0, 1e-3), Prior(0.015, 2e-4), Prior(0.0, 5e-5), gain_u=1.2e-3
)
HEIGHT = np.arange(0.03, 0.111, 0.005)
RING = Ring(1.4e-3, 0.0005, 0.015, 0.030, 0.055)


def scan_of(known=KNOWN, *, scale=1.0):
    flux = on_axis(RING, HEIGHT)[0] * scale
    return fit_scan(HEIGHT, flux, known, 3e-7, 2e-4)


def test_the_parts_of_a_scan_add_up_to_the_u_of_each_parameter():
    scan = scan_of()
    for name, parts in parts_of(scan).items():
        whole = float(np.linalg.norm([part.size for part in parts]))
        assert whole == pytest.approx(scan.parameters[name].u, rel=1e-6), name


@pytest.mark.parametrize("moved", ["origin", "thickness", "background", "inner_radius", "outer_radius"])
def test_what_the_calliper_says_moves_the_strength_by_its_row(moved):
    prior, part = KNOWN.prior(moved), 0.05
    other = replace(KNOWN, **{moved: Prior(prior.value + part * prior.u, prior.u)})
    scan = scan_of()
    (row,) = [one for one in parts_of(scan)["strength"] if one.name == moved]
    change = float((scan_of(other).values - scan.values)[PARAMETERS.index("strength")])
    assert change == pytest.approx(part * row.size, rel=0.05)  # to first order


def test_the_scale_of_the_probe_moves_the_strength_by_its_row():
    scan = scan_of()
    (row,) = [one for one in parts_of(scan)["strength"] if one.name == "gain"]
    change = float(scan_of(scale=1 + 0.01 * KNOWN.gain_u).values[0] - scan.values[0])
    assert change == pytest.approx(0.01 * row.size, rel=0.02)


def test_every_law_has_an_order_for_the_clocks():
    assert all(len(law.orders) == len(law.constants) for name, law in LAWS.items() if name != "power")
