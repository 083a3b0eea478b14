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
    sleeping_limit,
    spin_windows,
    vertical_mode,
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
