"""What the dipole approximation costs: the top's magnet as a disc of finite size instead of a point."""

from functools import partial

import numpy as np

from analysis.arrays import Array
from levilab.present.document.blocks import Picture
from levilab.present.numbers import with_sign
from levilab.reproduce.check import Finding, Found, check, statement
from levilab.reproduce.figure import dipole_figure
from levilab.reproduce.tops import THESIS
from levilab.simulator.disc import nodes_of, rule_for
from levilab.simulator.equilibrium import axial_field, stability_of
from levilab.simulator.field import flux_density
from levilab.simulator.model import base_field
from levilab.simulator.scene import Scene, preset

#: Where the thesis's top floated [m].
HEIGHT_M = THESIS["device.height"].value / 100
#: Heights between which the thesis says how good the approximation is [m].
LOW_M, HIGH_M = 0.065, 0.080
POINT = {"base.field": "exact"}
DISC = POINT | {"top.magnet": "disc"}


def by_rings(height: float) -> float:
    """Return the mean of B_z [T] over the disc at a height [m], by a rule that shares no node with the simulator's.

    Rings of equal width, weighted by r, where the simulator's are of equal area; on a radius alone, since the field
    has no angle.
    """
    top = preset("undriven").top
    field = base_field(preset("undriven").changed(POINT))
    nodes, weights = np.polynomial.legendre.leggauss(24)
    radii = top.magnet_radius_m * (nodes + 1) / 2
    heights = height + top.magnet_height_m * nodes / 2
    places = np.stack(np.meshgrid(radii, [0.0], heights, indexing="ij"), axis=-1)[:, 0]
    flux = flux_density(field, places)[..., 2] @ (weights / 2)
    return float(np.sum(flux * weights * radii) / np.sum(weights * radii))


def energies_over(scene: Scene) -> Array:
    """Return by how much the energy of a disc exceeds that of a point, over heights and tilts [%].

    Returns:
        shape (2, n): in parts of |μ|B, and of the energy itself, whose limit is taken at π/2, where both are 0.
    """
    base = base_field(scene)
    nodes = nodes_of(scene.top, rule_for(scene.top.magnet_radius_m, scene.top.magnet_height_m, LOW_M))
    found = []
    for tilt in np.linspace(0.0, np.pi / 2 - 1e-3, 31):
        sin, cos = np.sin(tilt), np.cos(tilt)
        turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
        for z in np.linspace(LOW_M, HIGH_M, 16):
            here = np.array([0.0, 0.0, z])
            flux = flux_density(base, here)
            point = float(flux @ turn[:, 2])
            disc = float((flux_density(base, nodes[:, :3] @ turn.T + here) @ turn[:, 2]) @ nodes[:, 3])
            found.append((100 * (disc - point) / np.linalg.norm(flux), 100 * (disc / point - 1)))
    return np.array(found).T


def make() -> Found:
    """Make the chapter."""
    point, disc = (preset("undriven").changed(values) for values in (POINT, DISC))
    z = np.linspace(0.060, 0.085, 251)
    fields: tuple[Array, Array] = (axial_field(point)(z), axial_field(disc)(z))
    at = np.array([HEIGHT_M])
    here = [axial_field(one)(at)[:3, 0] for one in (point, disc)]
    energy, force, bend = (100 * (float(b) / float(a) - 1) for a, b in zip(*here, strict=True))
    edges = [100 * stability_of(one).lifted[-1].low for one in (point, disc)]
    nodes = nodes_of(disc.top, rule_for(disc.top.magnet_radius_m, disc.top.magnet_height_m, 0.078))
    places = nodes[:, :3] + np.array([0.0, 0.0, HEIGHT_M])
    mean = float(flux_density(base_field(disc), places)[:, 2] @ nodes[:, 3])
    other = by_rings(HEIGHT_M)
    over = energies_over(disc)
    own = stability_of(preset("undriven")).lifted[-1]
    b, _, second = (float(value) for value in here[0])
    # ½B″(⟨z²⟩ − ⟨r²⟩/2): ⟨z²⟩ = h²/12, ⟨r²⟩ = R²/2
    leading = 50 * second / b * (disc.top.magnet_height_m**2 / 12 - disc.top.magnet_radius_m**2 / 4)
    findings: list[Finding] = [
        statement(
            "energy, disc less point, 6.5 cm < z < 8 cm, 0 ≤ θ ≤ π/2",
            "dipole approximation",
            "less than 1 %",
            f"{with_sign(over[0].min(), 2)} to {with_sign(over[0].max(), 2)} % of |μ|B; of the energy itself, "
            f"which is 0 at π/2, {with_sign(over[1].min(), 2)} to {with_sign(over[1].max(), 2)} %; at 7.3 cm, upright, "
            f"{with_sign(energy, 2)} %, of which ½B″(h²/12 − R²/4) is {with_sign(leading, 2)} %",
            holds=bool(np.abs(over[0]).max() < 1.0),
        ),
        check("force at 7.3 cm, disc over point", THESIS["dipole.force"], force),
        check("B″ at 7.3 cm, disc over point", THESIS["dipole.bend"], bend),
        check("lower edge of the heights, a point", THESIS["dipole.edge"], edges[0]),
        check("lower edge of the heights, a disc", THESIS["dipole.disc_edge"], edges[1]),
        statement(
            "is the approximation good?",
            "dipole approximation",
            "the energy differs by less than 1 %, so a point will do",
            f"the force by {force:.1f} %, more than the whole window of masses, "
            f"{100 * (own.heavy / own.light - 1):.1f} %; the heights' lower edge by {10 * (edges[0] - edges[1]):.1f} "
            f"mm of {10 * 100 * (own.high - own.low):.1f} mm",
            holds=False,
            reason="a force is a derivative: a small change of the energy over a short distance is a large one of its "
            "slope",
        ),
        statement(
            "mean of B_z over the disc by two rules",
            "dipole approximation",
            "",
            f"{1e3 * other:.8f} mT (rings of equal width, 24 × 24 nodes), {1e3 * mean:.8f} mT (rings of equal area, "
            f"{len(nodes)} nodes, as the simulator)",
            holds=abs(mean / other - 1) < 1e-9,
        ),
    ]
    picture = Picture(
        "dipole",
        "A disc is lifted otherwise than a point.",
        "Left: energy and force of a disc of 1.44 cm radius and 0.33 cm height over those of a point of the same "
        "moment, along the axis. Right: the second derivative of the field that each of them feels, which decides "
        "where the motion up and down is stable. Dotted: 7.3 cm.",
        "Energy and force of a disc over those of a point, and the second derivative of the field of both",
        partial(dipole_figure, 100 * z, fields, 100 * HEIGHT_M),
    )
    said = "The magnet of the top is 1.44 cm in radius and floats 7 cm above its base: how much of a point is it?"
    return Found(tuple(findings), (picture,), said)
