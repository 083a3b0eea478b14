"""Windows of height, mass and spin against published numbers, and against the full equations of motion."""

import math

import numpy as np
import pytest

from analysis.stability import (
    SymmetricTop,
    equilibria,
    floating_mass,
    modes,
    quartic,
    reduced_mass,
    sleeping_limit,
    spin_windows,
    thesis_limit,
    vertical_mode,
    windows,
)

RHO = 1.40e-3
THESIS = SymmetricTop(mass=0.02526, transverse=1.04e-6, axial=1.731314e-6, moment=-0.714)


def ring(a, b):
    """B, B′, B″ of a ring sheet on its axis, from φ₀ = 2πρ [z/√(a²+z²) − z/√(b²+z²)] and B = −φ₁."""

    def field(z):
        def derivatives(r2):
            u = 1 / np.sqrt(r2 + z * z)
            return np.array([r2 * u**3, -3 * r2 * z * u**5, 3 * r2 * (4 * z * z - r2) * u**7])

        return -2 * np.pi * RHO * (derivatives(a * a) - derivatives(b * b))

    return field


BASE = ring(0.030, 0.055)


@pytest.mark.parametrize(
    ("outer", "heights"),
    [
        (2.0, [(0.458024280, 0.986858278), (2.451612963, 2.651646110)]),
        (5.5 / 3, [(0.449623332, 0.947770806), (2.334506364, 2.522757775)]),
    ],
)
def test_the_adiabatic_windows_are_those_published(outer, heights):
    a = 0.030
    found = windows(ring(a, outer * a), THESIS, 0.05 * a, 5 * a)
    # published to nine decimals of z/a
    assert [(w.low / a, w.high / a) for w in found] == [pytest.approx(pair, abs=1e-9) for pair in heights]


def test_the_masses_of_the_upper_window_are_those_published():
    a = 0.030
    upper = windows(ring(a, 2 * a), THESIS, 0.05 * a, 5 * a)[1]
    assert reduced_mass(upper.light, THESIS, a, RHO) == pytest.approx(0.03521014, abs=1e-8)
    assert reduced_mass(upper.heavy, THESIS, a, RHO) == pytest.approx(0.03626888, abs=1e-8)
    device = windows(BASE, THESIS, 0.0015, 0.15)[1]
    assert (device.low, device.high) == pytest.approx((0.070035, 0.075683), abs=5e-7)
    assert (device.light, device.heavy) == pytest.approx((0.024742, 0.025485), abs=5e-7)


def test_a_heavier_top_than_the_field_can_lift_has_no_equilibrium_above():
    printed = SymmetricTop(0.0255, THESIS.transverse, THESIS.axial, THESIS.moment)
    assert not equilibria(BASE, printed, 0.05, 0.15)
    floating = equilibria(BASE, THESIS, 0.05, 0.15)
    assert [e.stable for e in floating] == [False, True]  # below the heaviest one's height it is thrown up and away
    assert floating[1].height == pytest.approx(0.0731, abs=2e-4)
    for e in floating:
        assert floating_mass(BASE, THESIS, e.height) == pytest.approx(THESIS.mass, rel=1e-12)


def test_the_linear_window_and_its_modes_are_those_published():
    # at 7.30 cm, with the mass that floats there
    top = SymmetricTop(floating_mass(BASE, THESIS, 0.073), THESIS.transverse, THESIS.axial, THESIS.moment)
    ((low, high),) = spin_windows(BASE, top, 0.073)
    assert low == pytest.approx(21.65, abs=0.005)
    assert high == pytest.approx(80.6, abs=0.05)
    seen = modes(BASE, top, 0.073, 30.0)
    assert np.abs(seen.imag).max() < 1e-9
    assert seen.real == pytest.approx([-0.589, 0.772, 7.53, 42.23], abs=0.005)
    assert sleeping_limit(BASE, top, 0.073) == pytest.approx(21.69, abs=0.005)
    assert vertical_mode(BASE, top, 0.073) == pytest.approx(
        math.sqrt(0.714 * 1.9805 / top.mass) / 2 / math.pi, rel=1e-4
    )


def test_the_synchronous_wobble_resonates_where_published():
    # θ = δ P/((I₃ − I₁) ω² − P): the resonance of a driven top, just above the lower limit
    p = 0.714 * float(BASE(np.array([0.073]))[0, 0])
    assert math.sqrt(p / (THESIS.axial - THESIS.transverse)) / (2 * math.pi) == pytest.approx(22.1, abs=0.1)


def test_the_estimate_of_the_thesis_is_reproduced_with_the_mass_it_must_have_used():
    top = SymmetricTop(0.0253, THESIS.transverse, 1.73e-6, THESIS.moment)
    assert thesis_limit(BASE, top, 0.073) == pytest.approx(14.005, abs=0.01)
    # and lacks the factor 2√(I₁/I₃) = 1.55 of the sleeping top's
    ratio = sleeping_limit(BASE, top, 0.073) / thesis_limit(BASE, top, 0.073)
    assert ratio == pytest.approx(2 * math.sqrt(1.04 / 1.73), rel=0.01)


@pytest.mark.parametrize(
    ("top", "field", "published", "quartics"),
    [
        ((0.02135, 0.65, 2.20e-6, 1.32e-6), (0.0136, -0.322, 2.24), (98, 251), (97.8, 235)),
        ((0.02135, 0.65, 2.20e-6, 1.32e-6), (0.0205, -0.322, 2 * 0.594), (120, 436), (120.3, 417)),
        ((0.0152, 0.46, 1.63e-6, 0.865e-6), (0.0173, -0.324, 2.10), (103, 327), (101.5, 326)),
    ],
    ids=["1", "2", "3"],
)
def test_the_limits_of_simon_1997(top, field, published, quartics):
    mass, moment, axial, transverse = top
    # their numbers are rounded: what floats there is what μB′ carries
    top = SymmetricTop(mass, transverse, axial, -moment, gravity=moment * abs(field[1]) / mass)
    ((low, high),) = spin_windows(lambda z: np.array(field)[:, None] + 0 * z, top, 0.0)
    seen = 2 * math.pi * low, 2 * math.pi * high
    assert seen == pytest.approx(quartics, abs=0.6)
    # their simulated limits are of finite motions: 2 % below, 7 % above
    assert seen[0] == pytest.approx(published[0], rel=0.02)
    assert seen[1] == pytest.approx(published[1], rel=0.07)


@pytest.mark.parametrize("spin_hz", [15.0, 30.0, 60.0, 90.0])
def test_the_quartic_has_the_roots_of_the_full_equations(spin_hz):
    # the 12 equations of motion about the equilibrium, differentiated numerically, know nothing of u and N
    height, spin = 0.073, 2 * np.pi * spin_hz
    b, slope, bend = BASE(np.array([height]))[:, 0]
    mass = floating_mass(BASE, THESIS, height)
    i1, i3, mu, g = THESIS.transverse, THESIS.axial, THESIS.moment, THESIS.gravity

    def rate(y):
        (x, y_, z), v, n, L = y[:3], y[3:6], y[6:9], y[9:]
        # the field to second order in the distances: B = −∇Φ with Φ to r²
        dz = z - height
        p = -(slope + bend * dz) / 2
        B = np.array([p * x, p * y_, b + slope * dz + bend * dz**2 / 2 - bend * (x * x + y_ * y_) / 4])
        force = mu * np.array(
            [
                n[0] * p - n[2] * bend * x / 2,
                n[1] * p - n[2] * bend * y_ / 2,
                -(n[0] * x + n[1] * y_) * bend / 2 + n[2] * (slope + bend * dz),
            ]
        )
        return np.concatenate([v, force / mass - [0, 0, g], np.cross(L, n) / i1, mu * np.cross(n, B)])

    rest = np.array([0, 0, height, 0, 0, 0, 0, 0, 1, 0, 0, i3 * spin])
    scale = np.array([1e-5] * 3 + [1e-5] * 3 + [1e-5] * 3 + [1e-5 * i3 * 200] * 3)
    jacobian = np.array(
        [(rate(rest + h * e) - rate(rest - h * e)) / (2 * h) for h, e in zip(scale, np.eye(12), strict=True)]
    ).T
    frequencies = np.linalg.eigvals(jacobian / 1.0).imag / (2 * np.pi)
    top = SymmetricTop(mass, i1, i3, mu)
    for mode in modes(BASE, top, height, spin_hz):
        assert np.min(np.abs(frequencies - mode.real)) < 2e-4 * max(1, abs(mode.real))
    assert np.min(np.abs(np.abs(frequencies) - vertical_mode(BASE, top, height))) < 1e-4


def test_a_moment_along_the_field_has_no_spin_that_helps():
    along = SymmetricTop(THESIS.mass, THESIS.transverse, THESIS.axial, +0.714)
    assert spin_windows(BASE, along, 0.073) == ()
    assert math.isnan(sleeping_limit(BASE, along, 0.073))
    assert np.all(np.isfinite(quartic(BASE, along, 0.073, 100.0)))


def test_the_stiffnesses_over_the_mass_are_those_of_berrys_potential():
    """U = mgz + |μ||B|, whose |B| bends sideways by B′²/4B − B″/2: M V Berry, Proc. R. Soc. A 452, 1207 (1996)."""
    for found in equilibria(BASE, THESIS, 0.05, 0.09):
        b, slope, bend = BASE(found.height)
        push = abs(THESIS.moment) * np.sign(b) / THESIS.mass
        assert found.axial == pytest.approx(push * bend)
        assert found.radial == pytest.approx(push * (slope**2 / (4 * b) - bend / 2))
