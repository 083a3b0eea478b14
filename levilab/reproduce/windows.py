"""Where a top can float: heights, masses, the effective mass, contours of the potential, and the least spin."""

import math
from functools import partial

import numpy as np

from analysis.stability import floating_mass, reduced_mass
from levilab.present.document.blocks import Note, Picture
from levilab.reproduce.check import Because, Comparison, Finding, Found, check
from levilab.reproduce.figure import Contours, contour_figure
from levilab.reproduce.tops import ESTIMATE_KG, THESIS, estimate_hz, known
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.field import flux_density
from levilab.simulator.model import base_field
from levilab.simulator.scene import Scene, preset

#: The base with b = 2a has the inner radius of the thesis's: only the ratio matters.
TWICE = {"base.outer_radius_m": 0.060}

#: Effective mass of the top whose resting place the thesis shows.
RESTING = 0.0360


def heights_and_masses(scene: Scene, prefix: str) -> list[Finding]:
    """Compare the edges of the heights in parts of the inner radius with the reference."""
    found, a = stability_of(scene), scene.base.inner_radius_m
    low, high = found.windows
    edges = {"low": low.low, "low_end": low.high, "high": high.low, "high_end": high.high}
    title = {"twice": "b = 2a", "own": "b/a = 5.5/3"}[prefix]
    names = ("lower region from", "lower region to", "upper region from", "upper region to")
    return [
        check(f"{title}: {name}", THESIS[f"stability.{prefix}_{key}"], z / a)
        for name, (key, z) in zip(names, edges.items(), strict=True)
    ]


def effective_masses() -> list[Finding]:
    """Compare M = m g a²/(2π|μ|ρ) of the lightest and the heaviest top of the upper region, and a height, b = 2a."""
    scene = preset("undriven").changed(TWICE)
    found = stability_of(scene)
    window, base = found.windows[-1], scene.base
    per_kg = reduced_mass(1.0, found.top, base.inner_radius_m, base.strength_t_m)
    masses = [
        check(f"b = 2a: effective mass of the {word} top", THESIS[f"stability.twice_{key}"], mass * per_kg)
        for word, key, mass in (("lightest", "light", window.light), ("heaviest", "heavy", window.heavy))
    ]
    resting = known(stability_of(scene.changed({"top.mass_kg": RESTING / per_kg})).floating)
    height = resting.height / base.inner_radius_m
    return [*masses, check(f"b = 2a: height of the top with M = {RESTING:.4f}", THESIS["stability.twice_rest"], height)]


def device() -> list[Finding]:
    """Compare the thesis's statements on its own top: masses, height, and its estimate of the least spin."""
    found = stability_of(preset("undriven"))
    window, floating = found.lifted[-1], known(found.floating)
    estimate = estimate_hz()
    lifted = floating_mass(found.field, found.top, THESIS["device.height"].value / 100)
    factor = 2 * math.sqrt(found.top.transverse / found.top.axial)
    exact = floating.spins[0][0]
    true = check(
        "least spin of the thesis's own estimate against the exact one",
        THESIS["stability.estimate"],
        exact,
        Because(
            f"the estimate lacks the factor 2√(I₁/I₃) = {factor:.3f}: with it, for "
            f"{found.scene.top.mass_kg * 1e3:.2f} g at {100 * floating.height:.2f} cm, where they float, it is "
            f"{found.sleeping:.2f} Hz, the sleeping top's limit, and the sideways motion moves that to {exact:.2f} "
            f"Hz; without it, for {1e3 * ESTIMATE_KG:.2f} g at 7.3 cm, it is {estimate:.3f} Hz, as printed",
            estimate,
        ),
    )
    return [
        check("lightest top that floats", THESIS["stability.lightest"], 1e3 * window.light),
        check("heaviest top that floats", THESIS["stability.heaviest"], 1e3 * window.heavy),
        check(
            "mass of the top that floats at the measured 7.3 cm",
            THESIS["device.mass"],
            1e3 * found.scene.top.mass_kg,
            Because(
                f"the field of Table 3.1 lifts {1e3 * window.heavy:.3f} g at most: 25.5 g fall. At 7.3 cm it lifts "
                f"{1e3 * lifted:.2f} g",
                THESIS["device.mass"].value > 1e3 * window.heavy and abs(lifted / found.scene.top.mass_kg - 1) < 1e-3,
            ),
        ),
        check(
            f"height of a top of {1e3 * found.scene.top.mass_kg:.2f} g",
            THESIS["device.height"],
            100 * floating.height,
            how=Comparison.FITTED,
        ),
        check(
            f"the thesis's estimate, for {1e3 * ESTIMATE_KG:.2f} g at 7.3 cm",
            THESIS["stability.estimate"],
            estimate,
            how=Comparison.FITTED,
        ),
        true,
    ]


def contours(scene: Scene) -> Contours:
    """Return U = mgz + |μ||B| − its value at the minimum, over r and z [J], in the exact field."""
    height = known(stability_of(scene).floating).height
    r = np.linspace(-0.03, 0.03, 121)
    z = np.linspace(0.060, 0.086, 131)
    places = np.stack([*np.meshgrid(r, [0.0], z, indexing="ij")], axis=-1)[:, 0]
    field = np.linalg.norm(flux_density(base_field(scene), places), axis=-1)
    energy = scene.top.mass_kg * scene.gravity_m_s2 * z[None, :] + abs(scene.top.moment_a_m2) * field
    rest = float(energy[60, np.argmin(np.abs(z - height))])
    return Contours(100 * r, 100 * z, 1e6 * (energy.T - rest), 100 * height)


def make() -> Found:
    """Make the chapter."""
    own = preset("undriven")
    findings = [
        *heights_and_masses(own.changed(TWICE), "twice"),
        *effective_masses(),
        *heights_and_masses(own, "own"),
        *device(),
    ]
    masses = (0.02490, 0.02526, 0.02545)
    shown = [contours(own.changed({"base.field": "exact", "top.mass_kg": mass})) for mass in masses]
    picture = Picture(
        "contours",
        "The trap is shallow, and deepest in the middle of the masses.",
        "Contours of mgz + |μ||B| over the distance from the axis and the height, in steps of 2 µJ from the place "
        "where the top rests (cross), in the exact field of the base. The bold line is the rim over which a top "
        "escapes: sideways and up for light tops, down for heavy ones.",
        "Contours of the potential for tops of three masses",
        partial(contour_figure, tuple(shown), tuple(f"{1e3 * mass:.2f} g" for mass in masses)),
    )
    said = (
        "A fast top whose moment follows the field floats stably in two regions of height, of which the upper one is "
        "the Levitron's. The edges are zeros of three conditions on the field of the base, found here to the last "
        "digits."
    )
    note = Note(
        "The masses of 24.742 to 25.485 g are those of the thesis's field and moment. Its estimate of the least spin "
        "is a sleeping top's limit without the factor 2√(I₁/I₃)."
    )
    return Found(tuple(findings), (picture, note), said)
