"""Fits of a scan: scatter over fixed seeds, what calliper and scan each say, and scans that are refused."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.errors import NotFinite, NotPositive, ShapesDiffer
from analysis.field.errors import FieldStandsStill, FieldTurnsOver, ImpossibleRing, NoField, TooFewHeights
from analysis.field.fit import PARAMETERS, Known, Prior, fit_scan, parts_of
from analysis.field.ring import Ring, on_axis

Z = np.arange(0.030, 0.1101, 0.005)
U_B, U_Z = 2e-6, 2e-4
KNOWN = Known(Prior(0.030, 1e-4), Prior(0.055, 1e-4), Prior(0.0, 1e-3), Prior(0.015, 2e-4), Prior(0.0, 5e-5))
TRUTH = Ring(1.43e-3, 0.0008, 0.0151, 0.0301, 0.0549)


def scan(seed=0, ring=TRUTH, background=2e-5, u_b=U_B, u_z=U_Z):
    random = np.random.default_rng(seed)
    heights = Z + u_z * random.standard_normal(Z.size)
    return on_axis(ring, heights)[0] + background + u_b * random.standard_normal(Z.size)


def drawn(seed):
    """A base as calliper and data sheet allow, and its background."""
    by = np.random.default_rng((seed, 1)).standard_normal(6)
    ring = Ring(
        1.4e-3 * (1 + 0.03 * by[0]), 1e-3 * by[1], 0.015 + 2e-4 * by[2], 0.03 + 1e-4 * by[3], 0.055 + 1e-4 * by[4]
    )
    return ring, 5e-5 * by[5]


def test_uncertainties_predict_the_scatter():
    pulls, reduced = [], []
    for seed in range(25):
        ring, background = drawn(seed)
        found = fit_scan(Z, scan(seed, ring, background), KNOWN, U_B * np.ones(17), U_Z)
        truth = [ring.strength, ring.origin, ring.thickness, background, ring.inner_radius, ring.outer_radius]
        pulls.append((found.values - truth) / np.sqrt(np.diagonal(found.covariance)))
        reduced.append(found.statistics.reduced_chi_square)
    # three standard errors of a standard deviation, and of a mean, from 25
    assert np.std(pulls, axis=0) == pytest.approx(np.ones(6), abs=0.43)
    assert np.mean(pulls, axis=0) == pytest.approx(np.zeros(6), abs=0.6)
    assert np.mean(reduced) == pytest.approx(1.0, abs=3 * np.sqrt(2 / 16 / 25))


@pytest.mark.parametrize(("u_b", "u_z", "every"), [(1e-6, U_Z, 1), (1e-4, 0.0, 1), (1e-4, U_Z, 3)])
def test_of_heights_and_readings_without_u_the_fit_finds_which_scatter(u_b, u_z, every):
    pulls = []
    for seed in range(25):
        ring, background = drawn(seed)
        found = fit_scan(Z[::every], scan(seed, ring, background, u_b, u_z)[::every], KNOWN, None, None)
        truth = [ring.strength, ring.origin, ring.thickness, background]
        pulls.append((found.values[:4] - truth) / np.sqrt(np.diagonal(found.covariance))[:4])
    # as above; of the origin 1.9 by heights that are exact, and by the likeliest scatters of six heights
    assert np.std(pulls, axis=0) == pytest.approx(np.ones(4), abs=0.43)


def of_background(found):
    return [one for one in found.remarks if (one.kind, one.name) == ("contradicts", "background")]


@pytest.mark.parametrize("background", [5e-4, -2e-3])
def test_a_zero_that_is_off_is_found_where_nothing_is_known_of_the_probe(background):
    field = scan(background=background, u_b=2e-5, u_z=0.0)
    found = fit_scan(Z, field, replace(KNOWN, background=Known.background), None, None)
    strength = found.parameters["strength"]
    assert abs(strength.value - TRUTH.strength) < 3 * strength.u  # with a zero that is known to 50 µT 5 and 20 u


@pytest.mark.parametrize("background", [5e-4, -2e-3])
def test_a_zero_that_scatter_of_unknown_size_hides_is_named(background):
    found = fit_scan(Z, scan(background=background, u_b=2e-5, u_z=0.0), KNOWN, None, None)
    (remark,) = of_background(found)
    assert remark.values[0] == pytest.approx(background, abs=1.5e-4)  # three u


def test_a_sound_zero_is_not_doubted():
    doubted = sum(bool(of_background(fit_scan(Z, scan(k, *drawn(k), 2e-5, 0.0), KNOWN))) for k in range(60))
    assert doubted <= 1  # 0.3 % each


def test_uncertain_radii_are_no_misfit_of_exact_readings():
    pulls = []
    for seed in range(25):
        ring, background = drawn(seed)
        found = fit_scan(Z, scan(seed, ring, background, 1e-6, 0.0), KNOWN, 1e-6)
        truth = [ring.strength, ring.origin, ring.thickness, background, ring.inner_radius, ring.outer_radius]
        pulls.append((found.values - truth) / np.sqrt(np.diagonal(found.covariance)))
        assert not {of.kind for of in found.remarks} & {"scan scatters", "no strength", "contradicts"}
    assert np.std(pulls, axis=0) == pytest.approx(np.ones(6), abs=0.43)  # 0.01 to 0.6 with radii that are held


def test_a_scan_without_noise_gives_the_ring_back():
    known = replace(
        KNOWN, inner_radius=Prior(0.0301, 0.0), outer_radius=Prior(0.0549, 0.0), thickness=None, origin=None
    )
    found = fit_scan(Z, scan(u_b=0.0, u_z=0.0), known, 1e-9)
    expected = [TRUTH.strength, TRUTH.origin, TRUTH.thickness, 2e-5, 0.0301, 0.0549]
    # with a u of 1 nT; the prior of the background, 0 ± 50 µT, draws by its share of that, 1e-8
    assert found.values == pytest.approx(expected, rel=1e-5)
    assert found.fitted == PARAMETERS[:4]
    assert [of.kind for of in found.remarks] in ([], ["scan overstated"])


def test_a_pole_that_points_down_is_the_same_but_for_the_sign():
    up, down = (fit_scan(Z, sign * scan(background=0.0), KNOWN, U_B, U_Z) for sign in (1, -1))
    assert down.values[0] == pytest.approx(-up.values[0], rel=1e-9)
    assert down.values[1:3] == pytest.approx(up.values[1:3], rel=1e-6)
    assert down.residuals == pytest.approx(-up.residuals, abs=1e-12)


def test_what_the_scan_cannot_tell_stays_the_callipers():
    found = fit_scan(Z, scan(), KNOWN, U_B, U_Z)
    thickness, origin = found.learned("thickness"), found.learned("origin")
    assert thickness > 0.99
    assert origin < 0.2
    assert found.learned("strength") is None
    free = fit_scan(Z, scan(), replace(KNOWN, thickness=None), U_B, U_Z)
    assert free.parameters["thickness"].u is not None
    assert free.parameters["thickness"].u > 2e-3
    assert abs(free.correlation("thickness", "strength")) > 0.5


def test_the_scale_of_the_instrument_goes_into_the_strength_alone():
    plain, scaled = (fit_scan(Z, scan(), replace(KNOWN, gain_u=gain), U_B, U_Z) for gain in (0.0, 0.01))
    u = [found.parameters["strength"].u or 0.0 for found in (plain, scaled)]
    assert u[1] == pytest.approx(np.hypot(u[0], 0.01 * plain.values[0]), rel=1e-9)
    assert scaled.parameters["origin"] == plain.parameters["origin"]


def test_without_uncertainties_the_scatter_stands_for_them():
    known = fit_scan(Z, scan(u_z=0.0), KNOWN, U_B)
    unknown = fit_scan(Z, scan(u_z=0.0), KNOWN)
    assert unknown.statistics.reduced_chi_square is None
    # 17 readings tell a standard deviation to 17 %
    assert np.mean(unknown.u) == pytest.approx(np.mean(known.u), rel=0.6)


def test_a_base_that_is_no_such_ring_enlarges_the_uncertainties():
    bent = scan() * (1 + 3 * Z)
    found = fit_scan(Z, bent, KNOWN, U_B, U_Z)
    for name, parts in parts_of(found).items():
        assert np.linalg.norm([part.size for part in parts]) == pytest.approx(found.parameters[name].u)
    assert found.remarks[0].kind == "scan scatters"
    assert ("contradicts", "inner_radius") in [(of.kind, of.name) for of in found.remarks]


def test_a_slip_of_the_probe_is_named():
    slipped = scan()
    slipped[9] = on_axis(TRUTH, np.array([Z[9] + 0.004]))[0, 0]
    said = fit_scan(Z, slipped, KNOWN, U_B, U_Z).remarks
    assert ("stray reading", Z[9]) in [(of.kind, *of.values[:1]) for of in said]


def test_an_uncertainty_that_is_common_to_all_is_recognised():
    assert any(of.kind == "scan overstated" for of in fit_scan(Z, scan(), KNOWN, 2e-4, U_Z).remarks)


@pytest.mark.parametrize(
    ("z", "b", "error", "says"),
    [
        (Z[:2], scan()[:2], TooFewHeights, "heights: 2, from 30 to 35 mm, at least 4 are needed"),
        (np.full(9, 0.07), scan()[:9], TooFewHeights, "different heights: 1, from 70"),
        (Z[:0], Z[:0], TooFewHeights, "heights: 0, at least 4 are needed: scan on"),
        (Z, 1e-3 * scan(), NoField, "nowhere above 0.0246 mT"),
        (Z, np.minimum(scan(), 0.0200), FieldStandsStill, "stays at 20 mT from 45 to 70 mm"),
        (Z, scan() * np.where(Z > 0.08, -1, 1), FieldTurnsOver, "between 80 and 85 mm"),
        (Z, scan()[:-1], ShapesDiffer, "flux density has shape (16,)"),
        (Z, np.where(Z > 0.1, np.nan, scan()), NotFinite, "flux density number 16 is nan"),
    ],
)
def test_a_bad_scan_is_refused_in_a_sentence(z, b, error, says):
    with pytest.raises(error) as caught:
        fit_scan(z, b, KNOWN)
    assert says in str(caught.value)


def test_uncertainties_and_radii_that_cannot_be_are_refused():
    with pytest.raises(NotPositive):
        fit_scan(Z, scan(), KNOWN, 0.0)
    with pytest.raises(NotPositive):
        fit_scan(Z, scan(), KNOWN, U_B, -1e-3)
    with pytest.raises(ImpossibleRing, match=r"inner radius 0\.06 m, outer radius 0\.055 m"):
        fit_scan(Z, scan(), replace(KNOWN, inner_radius=Prior(0.06, 0.0)))


def test_the_sign_may_change_where_that_of_the_base_does():
    low = np.arange(0.012, 0.10, 0.006)
    found = fit_scan(low, on_axis(TRUTH, low)[0], KNOWN, U_B, U_Z)
    assert found.values[0] == pytest.approx(TRUTH.strength, rel=0.02)


@pytest.mark.parametrize(("strength", "doubted"), [(1e-5, True), (1.43e-3, False)])
def test_a_strength_within_three_of_its_uncertainties_is_doubted(strength, doubted):
    rough = 1e-4  # of a reading [T]: as noise of this size alone may make
    found = fit_scan(Z, scan(1, replace(TRUTH, strength=strength), u_b=rough), KNOWN, rough, U_Z)
    assert any(of.kind == "no strength" for of in found.remarks) is doubted
    assert found.is_of_a_ring is not doubted


@pytest.mark.parametrize("u", [None, 1e-5])
def test_a_field_that_no_ring_has_is_none_of_a_base(u):
    z = np.arange(0.005, 0.12, 0.005)
    bump = 4e-3 * np.exp(-(((z - 0.05) / 0.02) ** 2)) + 1e-5 * np.random.default_rng(3).normal(size=len(z))
    found = fit_scan(z, bump, KNOWN, u)
    assert not found.is_of_a_ring
    assert "no ring" in {of.kind for of in found.remarks}


def test_a_weak_field_far_from_the_base_is_no_background_as_it_changes():
    far = np.arange(0.2, 0.41, 0.01)  # from 2.1 to 0.3 mT, within the range of a phone
    found = fit_scan(far, on_axis(TRUTH, far)[0] + 4e-5, replace(KNOWN, background=Known.background), 1e-6, 1e-4)
    strength = found.parameters["strength"]
    assert abs(strength.value - TRUTH.strength) < 3 * strength.u < 0.3 * TRUTH.strength


def test_noise_beside_no_base_is_no_field():
    noise = 3e-4 + 2e-4 * np.random.default_rng(0).standard_normal(Z.size)  # range 0.7 mT, u of the zero 0.5 mT
    with pytest.raises(NoField):
        fit_scan(Z, noise, replace(KNOWN, background=Known.background))


def test_diameters_for_radii_make_the_field_that_of_no_ring():
    known = replace(KNOWN, inner_radius=Prior(0.060, 1e-4), outer_radius=Prior(0.110, 1e-4), origin=None)
    found = fit_scan(Z, scan(1, u_b=2e-5), known, None, None)
    assert "no ring" in {of.kind for of in found.remarks}  # in 17 heights too few signs for a test of runs


def test_a_stand_that_is_set_badly_makes_no_other_field_of_a_rings():
    z = np.arange(0.03, 0.111, 0.005)
    for seed in range(20):
        off = 2e-3 * np.random.default_rng(seed).normal(size=len(z))
        assert fit_scan(z, on_axis(TRUTH, z + off)[0], KNOWN).is_of_a_ring


def test_residuals_that_keep_their_sign_are_named_where_no_u_tells_them():
    z = np.linspace(0.03, 0.12, 60)
    field = on_axis(TRUTH, z)[0]
    bent = fit_scan(z, field + 1e-4 * np.sin(z / 0.01), KNOWN)
    assert {of.kind for of in bent.remarks} == {"scan bends", "contradicts"}  # a free background follows a part of it
    for other in (np.random.default_rng(2).normal(size=60), (-1.0) ** np.arange(60)):
        assert fit_scan(z, field + 1e-4 * other, KNOWN).remarks == ()
