"""The closed form of the ring's field against magpylib, the simulator, and its own differences."""

from dataclasses import fields, replace

import magpylib
import numpy as np
import pytest

from analysis.field.magnet import Disc, axial_field, stiffnesses
from analysis.field.ring import Ring, on_axis, reversal, slopes
from analysis.stability import SymmetricTop, windows
from levilab.simulator.equilibrium import axial_field as scene_field
from levilab.simulator.equilibrium import top_of
from levilab.simulator.scene import preset

Z = np.array([-0.04, 0.012, 0.0285, 0.045, 0.073, 0.11, 0.4])
SHEET = Ring(1.40e-3, 0.0, 0.0, 0.030, 0.055)
THICK = Ring(-1.31e-3, 0.0012, 0.0151, 0.0301, 0.0548)


def by_magpylib(ring):
    """Two cylinders magnetised along z, or for a sheet two loops of current [T]."""
    places = np.column_stack([0 * Z, 0 * Z, Z])
    position, radii = (0, 0, ring.origin), ((ring.outer_radius, 1), (ring.inner_radius, -1))
    if ring.thickness == 0:
        current = 4 * np.pi * ring.strength / magpylib.mu_0
        parts = [magpylib.current.Circle(diameter=2 * r, current=s * current, position=position) for r, s in radii]
    else:
        size = 4 * np.pi * ring.strength / ring.thickness
        parts = [
            magpylib.magnet.Cylinder(
                polarization=(0, 0, s * size), dimension=(2 * r, ring.thickness), position=position
            )
            for r, s in radii
        ]
    return sum(part.getB(places) for part in parts)[:, 2]


@pytest.mark.parametrize("ring", [SHEET, THICK, replace(THICK, thickness=0.05, origin=-0.02)])
def test_the_field_is_that_of_magpylib(ring):
    """To 1e-9 of the largest; magpylib's own cylinders err by 1e-12 of what they subtract."""
    seen, expected = on_axis(ring, Z)[0], by_magpylib(ring)
    assert seen == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("thickness", [1.4e-2, 4e-5, 2.99e-5, 1e-7, 0.0])
def test_slopes_are_those_of_differences(thickness):
    """Central differences over 1e-4 of a radius err by 1e-7; of a thin ring the slope by h is small itself."""
    ring = replace(THICK, thickness=thickness)
    for k, (name, step) in enumerate(zip((f.name for f in fields(Ring)), (1e-6, 2e-6, 2e-6, 2e-6, 2e-6), strict=True)):
        ends = [on_axis(replace(ring, **{name: getattr(ring, name) + s * step}), Z)[0] for s in (1, -1)]
        seen, expected = slopes(ring, Z)[k], (ends[0] - ends[1]) / (2 * step)
        scale = np.abs(slopes(THICK, Z)[k]).max()
        assert seen == pytest.approx(expected, abs=2e-6 * scale), name


def test_derivatives_along_the_axis_are_those_of_differences():
    step, orders = 1e-5, 8
    ends = [on_axis(THICK, Z + s * step, orders) for s in (1, -1)]
    slopes_seen, found = (ends[0] - ends[1]) / (2 * step), on_axis(THICK, Z, orders)
    for order in range(orders - 1):  # a difference over 1e-5 m errs by 1e-6 where the field varies over 1 cm
        scale = np.abs(found[order + 1]).max()
        assert slopes_seen[order] == pytest.approx(found[order + 1], abs=2e-6 * scale)


def test_the_field_changes_its_sign_at_the_reversal():
    place = reversal(SHEET)
    assert on_axis(SHEET, np.array([place]))[0, 0] == pytest.approx(0.0, abs=1e-15)


def test_a_disc_feels_what_the_simulators_quadrature_gives():
    """Independent ways: a series of harmonic functions here, an integral over the disc by Gauss points there."""
    ring, disc, moment = Ring(1.40e-3, 0.0, 0.015, 0.030, 0.055), Disc(0.0144, 0.0033), -0.714
    scene = preset("undriven").changed({"base.field": "exact", "base.thickness_m": 0.015, "top.magnet": "disc"})
    z = np.array([0.066, 0.07, 0.073, 0.078])
    seen, expected = axial_field(ring, disc)(z), scene_field(scene)(z)
    assert seen[:2] == pytest.approx(expected[:2], rel=1e-5)  # the series is left off at 1e-5 of the force
    stiff = top_of(scene).stiffnesses
    # of the differences of the simulator 1e-4 is left where the stiffness itself nearly vanishes
    assert stiffnesses(ring, disc, moment)(z) == pytest.approx(stiff(z), rel=4e-4)
    top = SymmetricTop(1.0, 1.0, 1.0, moment, 9.82, stiffnesses(ring, disc, moment))
    (window,) = windows(axial_field(ring, disc), top, 0.05, 0.1)
    assert (window.low, window.high) == pytest.approx((0.0680958, 0.0750386), abs=1e-6)
