"""The top from its parts: closed forms, parts that are cut, and uncertainties against drawn parts."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.top import Cylinder, ImpossibleCylinder, top_of

RING = Cylinder("ring", 0.010, 0.014, 0.004, 0.006, 0.001, 1e-5, 5e-5, 5e-5, 5e-5, 1e-4)
STEM = Cylinder("stem", 0.002, 0.002, 0.0, 0.030, 0.012, 1e-5, 2e-5, 0.0, 1e-4, 3e-4)


def values(top):
    return [top.mass.value, top.transverse.value, top.axial.value, top.centre.value]


def test_a_sphere_of_thin_discs_has_two_fifths_of_its_mass_times_radius_squared():
    n, radius = 400, 0.02
    places = radius * (2 * (np.arange(n) + 0.5) / n - 1)
    squares = radius**2 - places**2
    discs = [
        Cylinder("disc", float(0.1 * s / squares.sum()), float(np.sqrt(s)), height=2 * radius / n, offset=float(z))
        for z, s in zip(places, squares, strict=True)
    ]
    top = top_of(discs)
    # discs are steps in the sphere's face: they err by 1/n²
    assert values(top) == pytest.approx([0.1, 0.4 * 0.1 * radius**2, 0.4 * 0.1 * radius**2, 0.0], rel=1e-5, abs=1e-12)


def test_a_part_that_is_cut_in_two_is_the_same_part():
    halves = [
        replace(RING, mass=RING.mass / 2, height=RING.height / 2, offset=RING.offset + side * RING.height / 4)
        for side in (-1, 1)
    ]
    assert values(top_of(halves)) == pytest.approx(values(top_of([RING])), rel=1e-14)


def test_a_hollow_cylinder_is_a_full_one_less_its_hole():
    share = (RING.inner_radius / RING.outer_radius) ** 2
    full = replace(RING, inner_radius=0.0, mass=RING.mass / (1 - share))
    hole = replace(full, outer_radius=RING.inner_radius, mass=full.mass * share)
    both = np.array(values(top_of([RING, hole])))
    assert both == pytest.approx(values(top_of([full])), rel=1e-14)


def test_the_mark_that_offsets_are_counted_from_does_not_matter():
    moved = [replace(part, offset=part.offset + 1.0) for part in (RING, STEM)]
    here, there = top_of([RING, STEM]), top_of(moved)
    assert values(there)[:3] == pytest.approx(values(here)[:3], rel=1e-9)
    assert there.centre.value == pytest.approx((here.centre.value or 0.0) + 1.0, rel=1e-12)


def test_uncertainties_are_those_of_parts_that_are_drawn():
    top = top_of([RING, STEM])
    random = np.random.default_rng(0)
    names = ("mass", "outer_radius", "inner_radius", "height", "offset")

    def drawn(part):
        return replace(
            part, **{n: getattr(part, n) + getattr(part, f"{n}_u") * random.standard_normal() for n in names}
        )

    found = np.array([values(top_of([drawn(RING), drawn(STEM)])) for _ in range(600)])
    u = [top.mass.u, top.transverse.u, top.axial.u, top.centre.u]
    # three standard errors of a standard deviation from 600: 8.7 %
    assert found.std(axis=0) == pytest.approx(u, rel=0.087)
    seen = np.corrcoef(found[:, :3].T)
    expected = top.covariance / np.sqrt(np.outer(np.diagonal(top.covariance), np.diagonal(top.covariance)))
    assert seen == pytest.approx(expected, abs=0.13)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"mass": 0.0}, "part ring: mass = 0, more than 0 kg is expected"),
        ({"inner_radius": 0.014}, "inner_radius = 0.014, from 0 to less than outer_radius"),
        ({"height": -0.001}, "height = -0.001"),
        ({"offset": float("nan")}, "offset = nan, a finite number"),
        ({"mass_u": -1.0}, "mass_u = -1"),
    ],
)
def test_a_part_that_is_no_cylinder_is_named(change, says):
    with pytest.raises(ImpossibleCylinder) as caught:
        top_of([STEM, replace(RING, **change)])
    assert says in str(caught.value)


def test_a_top_without_parts_is_none():
    with pytest.raises(ImpossibleCylinder, match="at least 1"):
        top_of([])
