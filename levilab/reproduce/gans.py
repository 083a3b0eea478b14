"""Gans, Jones & Washizu 1998: a top over a ring of dipoles, and what bounds it.

The numbers of the paper's edges could not be had (see the data file).  What can be tried is what its abstract says,
with its model, and the parameters of a program written after it.
"""

import math
from functools import partial
from typing import Any

import numpy as np

from analysis.arrays import Array
from levilab.present.document.blocks import Note, Picture
from levilab.reproduce.check import Found, statement
from levilab.reproduce.figure import gans_figure
from levilab.reproduce.tops import known, many
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.published.printed import published
from levilab.simulator.scene import Scene, preset

GANS = published("gans-1998")
ABSTRACT = "abstract"
#: Only ratios matter; this radius is that of a Levitron's ring [m].  A ring of dipoles is a sheet this narrow: the
#: field differs by the square of the half width, in parts of the radius.
RADIUS_M, HALF_WIDTH = 0.0347, 1e-3
MASS_KG, MOMENT_A_M2, GRAVITY = 0.02135, 0.65, 9.82
#: √(g/R) in turns per second [Hz].
UNIT_HZ = math.sqrt(GRAVITY / RADIUS_M) / (2 * math.pi)
DURATION_S = 30.0
#: Spins in √(g/R), and tilts [rad].
SPINS, TILTS = np.linspace(4.0, 10.5, 66), np.geomspace(0.002, 0.3, 26)
#: Tilts for the amplitude of the motion [rad].
SMALL_TILTS = np.geomspace(1e-4, 0.02, 8)


def scene() -> Scene:
    """Return the paper's model with the program's parameters: at rest where it floats, with its spin and tilt."""
    get = {key: GANS[f"model.{key}"].value for key in ("transverse", "axial", "strength", "spin", "tilt")}
    inertia = MASS_KG * RADIUS_M**2
    strength = get["strength"] * MASS_KG * GRAVITY * RADIUS_M**2 / (4 * math.pi * HALF_WIDTH * MOMENT_A_M2)
    return preset("undriven").changed(
        {
            "gravity_m_s2": GRAVITY,
            "base.inner_radius_m": RADIUS_M * (1 - HALF_WIDTH),
            "base.outer_radius_m": RADIUS_M * (1 + HALF_WIDTH),
            "base.strength_t_m": strength,
            "top.mass_kg": MASS_KG,
            "top.moment_a_m2": -MOMENT_A_M2,
            "top.inertia_transverse_kg_m2": get["transverse"] * inertia,
            "top.inertia_axial_kg_m2": get["axial"] * inertia,
            "start.place": "equilibrium",
            "start.position_m": [0.0, 0.0, 1.74 * RADIUS_M],
            "start.velocity_m_s": [0.0, 0.0, 0.0],
            "start.precession": "none",
            "start.tilt_rad": get["tilt"],
            "start.spin_hz": get["spin"] * UNIT_HZ,
        }
    )


def edges_by_hand() -> tuple[float, float]:
    """Return the upper region's edges for a ring of dipoles, from the polynomials of its field [R].

    ψ = Z/(1 + Z²)^(3/2): up and down it is stable above the zero of ψ⁗ in 8Z⁴ − 24Z² + 3, sideways below the zero of
    ψ″² − 2ψ‴ψ′, with the derivatives as polynomials over powers of 1 + Z².
    """
    x: Any = np.polynomial.Polynomial([0.0, 1.0])
    u = 1 + x**2
    # ψ⁽ᵏ⁾ = p_k/u^(k + 3/2), and p_(k+1) = p_k′ u − (2k + 3) Z p_k
    p = [x]
    for k in range(3):
        p.append(p[-1].deriv() * u - (2 * k + 3) * x * p[-1])
    up_and_down = _zeros(p[3])
    sideways = _zeros(p[2] ** 2 - 2 * p[3] * p[1])
    low = max(zero for zero in up_and_down if zero < max(sideways))
    return low, min(zero for zero in sideways if zero > low)


def _zeros(polynomial: Any) -> list[float]:
    return [float(root.real) for root in polynomial.roots() if abs(root.imag) < 1e-9 and root.real > 1e-9]


def amplitudes() -> tuple[Array, float]:
    """Return the largest distance from the axis over the start's tilt [R], and the power of the tilt it grows with."""
    found = many(scene(), {"start.tilt_rad": SMALL_TILTS}, 10.0, rate=200.0, columns=[0, 1])
    away = np.max(np.hypot(found.samples[..., 0], found.samples[..., 1]), axis=-1) / RADIUS_M
    return away, float(np.polyfit(np.log(SMALL_TILTS), np.log(away), 1)[0])


def make() -> Found:
    """Make the chapter."""
    top = scene()
    found = stability_of(top)
    floating = known(found.floating)
    window = found.lifted[-1]
    low, high = window.low / RADIUS_M, window.high / RADIUS_M
    by_hand = edges_by_hand()
    height = floating.height / RADIUS_M
    spins = [spin / UNIT_HZ for spin in floating.spins[0]]
    up = many(top, {"start.spin_hz": SPINS[:, None] * UNIT_HZ, "start.tilt_rad": TILTS[None, :]}, DURATION_S).survived
    away, power = amplitudes()
    calm = SPINS[up[:, 0]]
    row = int(np.argmin(np.abs(SPINS - GANS["model.spin"].value)))
    least_lost = float(TILTS[np.argmin(up[row])]) if not up[row].all() else math.nan
    given = {key: GANS[f"model.{key}"] for key in ("height", "spin")}
    findings = (
        statement(
            "stable heights over a ring of dipoles",
            "the model's polynomials",
            "",
            f"{low:.5f} to {high:.5f} R (windows of the base's field), {by_hand[0]:.5f} to {by_hand[1]:.5f} R (zeros "
            "of the polynomials)",
            holds=abs(low / by_hand[0] - 1) < 1e-5 and abs(high / by_hand[1] - 1) < 1e-5,
        ),
        statement(
            "height of the start",
            given["height"].place,
            f"{given['height'].text} R",
            f"the top floats at {height:.3f} R; stable from {low:.3f} to {high:.3f} R",
            holds=low < given["height"].value < high and abs(height / given["height"].value - 1) < 0.03,
        ),
        statement(
            "spin of the start",
            given["spin"].place,
            f"{given['spin'].text} √(g/R)",
            f"small motions are stable from {spins[0]:.2f} to {spins[1]:.2f} √(g/R)",
            holds=spins[0] < given["spin"].value < spins[1] and bool(up[row, 0]),
        ),
        statement(
            "three modes of failure",
            ABSTRACT,
            "insufficient spin, too large a tilt, too great a spin",
            f"calm tops are up from {calm.min():.1f} to {calm.max():.1f} √(g/R); at {SPINS[row]:.1f} √(g/R) the first "
            f"tilt that is lost is {least_lost:.2f} rad",
            holds=bool(not up[0, 0] and not up[-1, 0] and not up[row, -1] and up[row, 0]),
        ),
        statement(
            "the amplitude of the motion scales with the tilt of the start",
            ABSTRACT,
            "linearly",
            f"as its power {power:.3f}, over tilts of {SMALL_TILTS[0]:.4f} to {SMALL_TILTS[-1]:.2f} rad "
            f"({away[0] / SMALL_TILTS[0]:.3f} R per rad)",
            holds=abs(power - 1) < 0.02,
        ),
    )
    picture = Picture(
        "gans",
        "Three ways to be lost over a ring of dipoles.",
        f"Which tops are up after {DURATION_S:g} s (filled) over spin and tilt of the start, where the top floats; "
        "lines: the window of small motions. Below a spin, beyond a tilt, above a spin: the paper's three modes of "
        "failure.",
        "Survival over spin and tilt over a ring of dipoles",
        partial(gans_figure, SPINS, TILTS, up, (spins[0], spins[1])),
    )
    note = Note(
        "What could not be had: the numbers of the paper's edges. Its abstract has none, and its tables and figures "
        "are not freely to read; the model's parameters are those of Scilab's demonstration, which names the paper."
    )
    return Found(findings, (picture, note), "What the abstract says, tried with the paper's model.")
