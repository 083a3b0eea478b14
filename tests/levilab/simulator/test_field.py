"""The base's field against magpylib, against derivatives of higher precision, and against itself."""

import math

import magpylib
import mpmath
import numpy as np
import pytest

from levilab.simulator.field import FieldError, field_of, flux_density, flux_gradient, on_axis
from levilab.simulator.kernels import ring
from levilab.simulator.kernels.paraxial import Paraxial, weights
from support.parts import callable_part

elliptic = callable_part(ring.elliptic)

A, B, RHO = 0.030, 0.055, 1.40e-3
EXACT = field_of(A, B, RHO, "exact")
THICK = field_of(A, B, RHO, "exact", thickness=0.02, origin=-0.01)

#: On the axis, next to it on either side of where the series takes over, over and outside of the ring, below, far.
PLACES = np.array(
    [
        [0, 0, 0.073], [1e-12, 0, 0.073], [1e-6, 1e-6, 0.073], [0.0017, 0, 0.073], [0.0019, 0, 0.073],
        [0.0025, 0.001, 0.073], [0.010, 0.005, 0.073], [0.020, 0, 0.05], [0.0, 0.03, 0.02], [0.04, 0.03, 0.02],
        [0.08, 0, 0.005], [0.01, 0, -0.05], [0.1, 0.1, 0.1], [0.5, 0.0, 1.0],
    ]
)  # fmt: skip
THESIS = ["paraxial-2", "paraxial-4", "paraxial-20", "exact"]


def authority(thickness, origin, places):
    """The same ring in magpylib: two loops of current, or two cylinders magnetised along z [T]."""
    if thickness == 0:
        current = 4 * np.pi * RHO / magpylib.mu_0
        return sum(
            magpylib.current.Circle(diameter=2 * r, current=sign * current, position=(0, 0, origin)).getB(places)
            for r, sign in ((B, 1), (A, -1))
        )
    polarization = 4 * np.pi * RHO / thickness
    return sum(
        magpylib.magnet.Cylinder(
            polarization=(0, 0, sign * polarization), dimension=(2 * r, thickness), position=(0, 0, origin)
        ).getB(places)
        for r, sign in ((B, 1), (A, -1))
    )


def relative(seen, expected, axes=-1):
    return np.linalg.norm(seen - expected, axis=axes) / np.linalg.norm(expected, axis=axes)


def differences(field, places, h):
    """∂B_i/∂x_j by central differences of order 8, shape (n, 3, 3)."""
    gradient = np.zeros((len(places), 3, 3))
    for j in range(3):
        for k, c in enumerate((4 / 5, -1 / 5, 4 / 105, -1 / 280), 1):
            step = np.eye(3)[j] * k * h
            gradient[:, :, j] += c * (field(places + step) - field(places - step)) / h
    return gradient


# --- against magpylib ---


def test_the_sheet_is_that_of_magpylib():
    assert relative(flux_density(EXACT, PLACES), authority(0, 0, PLACES)).max() < 1e-12


def test_the_thick_ring_is_that_of_magpylib():
    assert relative(flux_density(THICK, PLACES), authority(0.02, -0.01, PLACES)).max() < 1e-10
    # a quarter of its thickness above its face, where the sheets it is made of begin to be seen
    close = np.array([[0.03, 0, 0.005], [0.045, 0, 0.005], [0.0, 0.02, 0.005]])
    assert relative(flux_density(THICK, close), authority(0.02, -0.01, close)).max() < 1e-10


# --- against higher precision ---


def loop(radius, r, z):
    """(B_r, B_z) of a loop with 40 digits, in the units in which its field on the axis is R²/(R² + z²)^(3/2)."""
    near, far = (radius - r) ** 2 + z**2, (radius + r) ** 2 + z**2
    m = 4 * radius * r / far
    k, e = mpmath.ellipk(m), mpmath.ellipe(m)
    scale = 1 / (mpmath.pi * mpmath.sqrt(far))
    along = scale * (k + (radius**2 - r**2 - z**2) / near * e)
    return scale * z / r * ((radius**2 + r**2 + z**2) / near * e - k), along


def precise(r, z):
    """(B_r, B_z) of the sheet, and its gradient (∂rBr, ∂zBr, ∂zBz), with 40 digits."""
    with mpmath.workdps(40):
        a, b, k = mpmath.mpf(A), mpmath.mpf(B), 2 * mpmath.pi * mpmath.mpf(RHO)

        def component(i):
            return lambda r, z: k * (loop(b, r, z)[i] - loop(a, r, z)[i])

        r, z = mpmath.mpf(r), mpmath.mpf(z)
        gradient = [mpmath.diff(component(i), (r, z), which) for i, which in ((0, (1, 0)), (0, (0, 1)), (1, (0, 1)))]
        return [float(component(i)(r, z)) for i in range(2)], [float(x) for x in gradient]


@pytest.mark.parametrize("place", [(1e-9, 0.073), (0.00249, 0.073), (0.00251, 0.073), (0.012, 0.06), (0.02, 0.01)])
def test_field_and_gradient_have_eleven_digits_on_both_sides_of_where_the_series_takes_over(place):
    r, z = place
    (br, bz), (rr, rz, zz) = precise(r, z)
    seen = flux_density(EXACT, [r, 0, z])
    assert seen == pytest.approx([br, 0, bz], abs=1e-13 * math.hypot(br, bz))
    gradient = flux_gradient(EXACT, [r, 0, z])
    size = np.linalg.norm(gradient)
    assert gradient[0, 0] == pytest.approx(rr, abs=1e-11 * size)
    assert gradient[0, 2] == pytest.approx(rz, abs=1e-11 * size)
    assert gradient[2, 2] == pytest.approx(zz, abs=1e-11 * size)


@pytest.mark.parametrize(
    ("distance", "digits"),
    [(1e-3, 1e-13), (1e-5, 1e-11), (1e-6, 1e-10)],  # the distance itself is rounded: eps × R/distance
)
def test_close_to_an_edge_the_field_loses_only_what_the_distance_loses(distance, digits):
    for r in (A, B):
        (br, bz), _ = precise(r + 0.6 * distance, 0.8 * distance)
        seen = flux_density(EXACT, [r + 0.6 * distance, 0, 0.8 * distance])
        assert relative(seen, np.array([br, 0, bz])) < digits


def test_close_to_the_sheet_between_its_edges():
    (br, bz), _ = precise(0.0425, 1e-4)
    assert relative(flux_density(EXACT, [0.0425, 0, 1e-4]), np.array([br, 0, bz])) < 1e-12


@pytest.mark.parametrize("m", [0.0, 1e-15, 1e-6, 0.3, 0.9, 1 - 1e-6, 1 - 1e-12])
def test_elliptic_integrals_are_those_of_mpmath(m):
    k, e = elliptic(1 - m)
    exact = mpmath.mpf(1 - m)  # the complement as it was given, not as 1 − m rounds back
    assert k == pytest.approx(float(mpmath.ellipk(1 - exact)), rel=1e-15)
    assert e == pytest.approx(float(mpmath.ellipe(1 - exact)), rel=2e-14)  # E = K (1 − Σ): Σ → 1 there


# --- against published numbers ---


def test_the_field_at_the_height_of_the_top():
    b, slope, bend = on_axis(EXACT, [0.073])[:, 0]
    assert abs(b) == pytest.approx(18.7455e-3, abs=5e-8)
    assert slope == pytest.approx(-3.47396e-1, abs=5e-7)
    assert bend == pytest.approx(1.9805, abs=5e-5)


@pytest.mark.parametrize(("r", "along", "across"), [(0.010, 0.056, -1.9), (0.0144, 0.24, -3.6), (0.020, 0.85, -6.2)])
def test_the_error_of_the_series_to_r2_is_that_published(r, along, across):
    cut, full = (flux_density(field_of(A, B, RHO, kind), [r, 0, 0.073]) for kind in ("paraxial-2", "exact"))
    assert 100 * (cut[2] / full[2] - 1) == pytest.approx(along, abs=0.006)
    assert 100 * (cut[0] / full[0] - 1) == pytest.approx(across, abs=0.06)


# --- against itself ---


@pytest.mark.parametrize("kind", THESIS)
@pytest.mark.parametrize("thickness", [0.0, 0.02])
def test_the_gradient_is_the_derivative_of_the_field_and_symmetric(kind, thickness):
    field = field_of(A, B, RHO, kind, thickness=thickness, origin=-thickness / 2)
    places = PLACES[:8]
    gradient = flux_gradient(field, places)
    assert gradient == pytest.approx(np.swapaxes(gradient, -1, -2), rel=1e-15)
    seen = differences(lambda at: flux_density(field, at), places, 1e-3)
    assert relative(gradient, seen, axes=(-2, -1)).max() < 3e-10  # differences over 1 mm of a field of 2 cm


@pytest.mark.parametrize("field", [EXACT, THICK], ids=["sheet", "thick"])
def test_an_exact_field_has_no_divergence(field):
    gradient = flux_gradient(field, PLACES)
    trace = np.trace(gradient, axis1=-2, axis2=-1)
    assert np.abs(trace / np.linalg.norm(gradient, axis=(-2, -1))).max() < 1e-12


@pytest.mark.parametrize("thickness", [0.0, 0.02])
def test_the_series_converges_to_the_exact_field_by_the_distance_from_the_edges(thickness):
    at = np.array([0.01, 0.0, 0.073])
    exact = flux_density(field_of(A, B, RHO, "exact", thickness=thickness, origin=-thickness / 2), at)
    ring = {"thickness": thickness, "origin": -thickness / 2}
    # each order is compiled for itself, for a second; those between take the same way through the same code
    cut = [flux_density(field_of(A, B, RHO, f"paraxial-{n}", **ring), at) for n in (4, 20)]
    errors = [relative(series, exact) for series in cut]
    # a term is smaller than the one before by r²/(a² + z²) = 1/62, but for polynomials of the height that pass zero
    assert 1e-14 < errors[0] < 1e-4
    assert errors[1] < 1e-14


def test_general_and_written_out_series_agree():
    general = Paraxial(*field_of(A, B, RHO, "paraxial-2"), weights(1))
    assert flux_density(general, PLACES) == pytest.approx(
        flux_density(field_of(A, B, RHO, "paraxial-2"), PLACES), rel=1e-13, abs=1e-17
    )


def test_a_thin_base_is_nearly_a_sheet():
    thin = field_of(A, B, RHO, "paraxial-4", thickness=1e-4)
    sheet = field_of(A, B, RHO, "paraxial-4")
    # the mean over h adds h²/24 of the second derivative: 1e-6 of the field for z ~ 5 cm
    assert relative(flux_density(thin, PLACES[:8]), flux_density(sheet, PLACES[:8])).max() < 1e-5


# --- what is refused ---


@pytest.mark.parametrize(
    ("ring", "kind", "more", "words"),
    [
        ((0.05, 0.03, RHO), "exact", {}, "0 < inner < outer"),
        ((0.0, 0.03, RHO), "exact", {}, "0 < inner < outer"),
        ((A, B, math.nan), "exact", {}, "strength = nan"),
        ((A, B, RHO), "paraxial-3", {}, "paraxial-2, paraxial-4"),
        ((A, B, RHO), "paraxial-22", {}, "paraxial-20"),
        ((A, B, RHO), "dipole", {}, "exact or paraxial"),
        ((A, B, RHO), "exact", {"thickness": -0.01}, "thickness = -0.01"),
        ((A, B, RHO), "exact", {"origin": math.inf}, "origin = inf"),
    ],
)
def test_a_base_that_cannot_be_is_refused_by_name(ring, kind, more, words):
    with pytest.raises(FieldError, match=words):
        field_of(*ring, kind, **more)
