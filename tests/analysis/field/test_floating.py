"""What follows from a scan: the published windows, how uncertainties are carried on, and the moment from a height.

Many drawn devices are in benchmarks/field.py.
"""

from dataclasses import replace

import numpy as np
import pytest

from analysis.field.fit import Known, Prior, fit_scan
from analysis.field.floating import RESULTS, KnownTop, floating_spins, follow
from analysis.field.magnet import Disc
from analysis.field.ring import Ring, on_axis
from analysis.uncertainty import Estimate

Z = np.arange(0.030, 0.1101, 0.005)
THESIS = Ring(1.40e-3, 0.0, 0.0, 0.030, 0.055)
EXACT = Known(Prior(0.030, 0.0), Prior(0.055, 0.0), Prior(0.0, 0.0), Prior(0.0, 0.0), Prior(0.0, 0.0))
ROUGH = Known(Prior(0.030, 1e-4), Prior(0.055, 1e-4), Prior(0.0, 1e-3), Prior(0.015, 2e-4), Prior(0.0, 5e-5))


def of(value, u=0.0, unit=""):
    return Estimate(value, u, unit)


TOP = KnownTop(of(1.04e-6), of(1.731314e-6), of(0.714))


def of_thesis(sign=1):
    """A scan of the thesis's base without noise, by which nothing is open but its strength."""
    return fit_scan(Z, sign * on_axis(THESIS, Z)[0], EXACT, 1e-9)


def test_the_thesis_device_has_its_windows():
    """Heights, masses and the sleeping top's limit as in docs and in Berry's units: 7.0035 to 7.5683 cm."""
    found = follow(of_thesis(), TOP)
    assert found["lowest_height"] == pytest.approx(0.0700351, abs=2e-7)
    assert found["highest_height"] == pytest.approx(0.0756827, abs=2e-7)
    assert found["lightest_mass"] == pytest.approx(0.024742, abs=1e-6)
    assert found["heaviest_mass"] == pytest.approx(0.025485, abs=1e-6)
    assert found["mass_to_set"] == pytest.approx((0.024742 + 0.025485) / 2, abs=1e-6)
    assert "moment" not in found.values
    assert "mass_to_add" not in found.values


def test_the_windows_do_not_depend_on_which_pole_is_up():
    up, down = follow(of_thesis(), TOP), follow(of_thesis(-1), TOP)
    for name in up.values:
        assert down[name] == pytest.approx(up[name], rel=1e-8), name


def test_the_height_of_the_thesis_gives_its_moment_back():
    """25.26 g at 7.3 cm: its 0.714 A m², with u by the rule for products."""
    top = replace(TOP, moment=None, mass=of(0.02526, 1e-5), height=of(0.073, 2e-4))
    found = follow(of_thesis(), top)
    slope, bend = on_axis(THESIS, np.array([0.073]))[1:, 0]
    assert found["moment"] == pytest.approx(0.714, rel=1e-4)
    relative = np.hypot(1e-5 / 0.02526, 2e-4 * bend / slope)
    assert found.values["moment"].u == pytest.approx(0.714 * relative, rel=1e-3)
    assert found["mass_to_add"] == pytest.approx(found["mass_to_set"] - 0.02526, rel=1e-12)


def test_the_slowest_spin_at_the_thesis_height_is_that_of_the_quartic():
    window = floating_spins(THESIS, TOP, 0.714 * 0.347396 / 9.82, (0.0700, 0.0757))
    assert window == pytest.approx((21.65, 80.6), abs=0.06)  # as printed in the physics of the bench
    assert floating_spins(THESIS, TOP, 0.0255, (0.0700, 0.0757)) is None


@pytest.mark.parametrize("magnet", [None, Disc(0.0144, 0.0033)])
@pytest.mark.parametrize(
    ("which", "moved"),
    [
        # a base that is stronger by 1 % lifts 1 % more, at the same heights
        ("strength", {"heaviest_mass": 0.01, "mass_to_set": 0.01, "lowest_height": 0.0, "height_at_mass": 0.0}),
        # one that lies 1 mm higher moves all heights by that, and no mass
        ("origin", {"lowest_height": 1e-3, "height_at_mass": 1e-3, "mass_to_set": 0.0, "fastest_spin": 0.0}),
        ("moment", {"lightest_mass": 0.01, "mass_to_set": 0.01, "highest_height": 0.0}),
        # the mode of a top with 1 % more inertia about both axes is slower by half of that
        ("inertias", {"mass_to_set": 0.0, "height_at_mass": 0.0, "slowest_spin": 0.005}),
    ],
)
def test_each_uncertainty_moves_what_it_must(which, moved, magnet):
    """One uncertainty at a time, whose effect is known exactly."""
    scan, top = of_thesis(), replace(TOP, magnet=magnet)
    covariance = np.zeros((6, 6))
    if which == "strength":
        covariance[0, 0] = (0.01 * scan.values[0]) ** 2
    if which == "origin":
        covariance[1, 1] = 1e-3**2
    if which == "moment":
        top = replace(top, moment=of(0.714, 0.00714))
    if which == "inertias":
        inertias = 0.01 * np.array([0.0, 1.04e-6, 1.731314e-6])
        top = replace(top, covariance=np.outer(inertias, inertias))
    found = follow(replace(scan, covariance=covariance), top)
    for name, expected in moved.items():
        scale = 1.0 if name.endswith("height") or name == "height_at_mass" else found[name]
        # 1 % moves the spins by their slope only to first order, and the strength is not all that the slowest one has
        assert found.values[name].u == pytest.approx(expected * scale, rel=0.02, abs=1e-6 * scale), name


def test_a_measured_height_tells_the_mass_better_than_the_moment():
    ring = Ring(1.42e-3, 5e-4, 0.0151, 0.03005, 0.055)
    scan = fit_scan(Z, on_axis(ring, Z)[0], ROUGH, 2e-6, 2e-4)
    by_moment = follow(scan, replace(TOP, moment=of(0.714, 0.00714)))
    by_height = follow(scan, replace(TOP, mass=of(0.0252, 1e-5), height=of(0.073, 2e-4)))
    sizes = [found.values["mass_to_set"].u or 0.0 for found in (by_moment, by_height)]
    assert sizes[1] < sizes[0] / 4  # the strength of the base drops out
    assert any(of.kind == "rough mass" for of in by_moment.remarks)
    assert not any(of.kind == "rough mass" for of in by_height.remarks)


def test_a_height_outside_of_the_window_is_doubted():
    top = replace(TOP, mass=of(0.0252), height=of(0.060))
    found = follow(of_thesis(), top)
    assert any(of.kind == "another zero" for of in found.remarks)


def test_a_top_that_no_spin_holds_up_floats_nowhere():
    assert follow(of_thesis(), replace(TOP, transverse=of(1e-4))) is None


def test_inertias_of_the_same_parts_are_not_independent():
    covariance = np.diag([1e-5, 1e-8, 1e-8]) ** 2
    covariance[1, 2] = covariance[2, 1] = 1e-16
    alone = replace(TOP, transverse=of(1.04e-6, 1e-8), axial=of(1.731314e-6, 1e-8))
    together = follow(of_thesis(), replace(alone, covariance=covariance))
    apart = follow(of_thesis(), alone)
    assert together.values["slowest_spin"].u != pytest.approx(apart.values["slowest_spin"].u, rel=0.01)


def test_without_moment_mass_and_height_nothing_follows():
    with pytest.raises(ValueError, match="a moment"):
        follow(of_thesis(), replace(TOP, moment=None, mass=of(0.025)))


def test_every_result_has_a_unit():
    found = follow(of_thesis(), replace(TOP, mass=of(0.0252), height=of(0.073)))
    assert {name: estimate.unit for name, estimate in found.values.items()} == RESULTS
