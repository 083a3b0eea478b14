"""The slips of the thesis, each tried on a number that neither the printed nor the corrected equation decides."""

import math
from collections.abc import Callable

import numpy as np

from analysis.arrays import Array
from analysis.field.ring import Ring
from analysis.field.ring import on_axis as ring_on_axis
from levilab.present.document.blocks import Note
from levilab.reproduce.check import Finding, Found, erratum
from levilab.reproduce.tops import ESTIMATE_KG, MASS_KG, THESIS, estimate_hz, known, many, preset_at, scan
from levilab.simulator.energy import magnetic_energy
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.field import field_of, flux_density, on_axis
from levilab.simulator.kernels.motion import R, V
from levilab.simulator.model import base_field
from levilab.simulator.published.printed import several
from levilab.simulator.scene import Scene, preset
from levilab.simulator.single import simulate
from levilab.simulator.trajectory import Trajectory
from levilab.stability.scan import lower_limit

#: Rates of change are taken from the motion this long before and after the start [s]: its error is 1e-7 of them.
_H_S = 2e-5
#: A top on the axis, at the measured height, at rest but for its spin.
ON_AXIS = {"start.position_m": [0.0, 0.0, 0.073], "start.velocity_m_s": [0.0, 0.0, 0.0]}


def rate(scene: Scene, value: Callable[[Trajectory], Array]) -> float:
    """Return the rate of change of a quantity of the motion at its start, from the simulated motion alone."""
    ends = [
        float(value(simulate(scene, sign * _H_S, tolerance=1e-14, rate=None, step=_H_S / 4))[-1]) for sign in (1, -1)
    ]
    return (ends[0] - ends[1]) / (2 * _H_S)


def bend(scene: Scene, value: Callable[[Trajectory], Array], h: float = 5e-5) -> float:
    """Return the second rate of change at the start."""
    motions = [simulate(scene, sign * h, tolerance=1e-14, rate=None, step=h / 8) for sign in (1, -1)]
    after, before = (float(value(one)[-1]) for one in motions)
    return (after - 2 * float(value(motions[0])[0]) + before) / h**2


def centre_of_mass() -> Finding:
    """Compute the centre of mass of the disc on the floor, from its two faces."""
    top, grams = preset("undriven").top, 1e3 * MASS_KG
    height = 100 * top.magnet_height_m
    nodes, weights = np.polynomial.legendre.leggauss(4)
    # ∫ρ(r) z d³r, the density being the mass over the volume
    integral = float(grams / height * np.sum(weights / 2 * height * (nodes + 1) / 2 * height))
    return erratum(
        "(2.8)",
        "R = ∫ρ(r) r d³r lacks 1/m",
        "R = (1/m) ∫ρ(r) r d³r",
        f"height of the centre of mass of an even disc of {height:.2f} cm; true: the middle, by symmetry",
        truth=height / 2,
        by_printed=integral,
        by_corrected=integral / grams,
        unit="cm",
    )


def rotation() -> Finding:
    """Compare the kinetic energy that is gained with the potential energy that is lost."""
    scene = preset_at("IC1")
    top = scene.top
    motion = simulate(scene, 0.3, tolerance=1e-10, rate=10.0)
    ends = motion.states[[0, -1]]
    potential = magnetic_energy(motion.model, ends) + top.mass_kg * scene.gravity_m_s2 * ends[:, R][:, 2]
    along = np.einsum("ij,ij->i", motion.angular_momentum[[0, -1]], motion.axis[[0, -1]])
    across = np.einsum("ij,ij->i", motion.angular_momentum[[0, -1]], motion.angular_momentum[[0, -1]]) - along**2
    turning = across / top.inertia_transverse_kg_m2 + along**2 / top.inertia_axial_kg_m2
    lost = float(potential[0] - potential[1]) - 0.5 * top.mass_kg * float(np.diff(np.sum(ends[:, V] ** 2, axis=1))[0])
    return erratum(
        "(2.26)",
        "T_rot lacks ½",
        "T_rot = ½ Σ I ω²",
        "energy of the rotation gained in 0.3 s; true: potential energy lost less ½mv² gained",
        truth=1e6 * lost,
        by_printed=1e6 * float(turning[1] - turning[0]),
        by_corrected=1e6 * float(turning[1] - turning[0]) / 2,
        tolerance=1e-4,
        unit="µJ",
    )


def fourth_power() -> Finding:
    """Compute the coefficient of r⁴ in the potential's series, from the exact field beside the axis."""
    z, base = 0.073, preset("undriven").base
    ring = Ring(base.strength_t_m, 0.0, 0.0, base.inner_radius_m, base.outer_radius_m)
    b, _, second, _, fourth = ring_on_axis(ring, np.array([z]), 5)[:, 0]
    exact = field_of(base.inner_radius_m, base.outer_radius_m, base.strength_t_m, "exact")
    coefficients = []
    for r in (6e-3, 3e-3):
        flux = float(flux_density(exact, [r, 0.0, z])[2])
        coefficients.append((flux - b + second * r**2 / 4) / (fourth * r**4))
    return erratum(
        "(2.42)",
        "coefficient of r⁴ is 3/16",
        "it is 1/64",
        "coefficient of φ₄ r⁴; true: from elliptic integrals, at r → 0",
        truth=(4 * coefficients[1] - coefficients[0]) / 3,
        by_printed=3 / 16,
        by_corrected=1 / 64,
        tolerance=1e-3,
    )


def thickness() -> Finding:
    """Compute the field of a base of one material, twice as thick: two bases on each other."""
    a, b, z, h = 0.030, 0.055, np.array([0.073]), 0.002

    def flux(strength: float, thick: float, origin: float) -> float:
        return float(on_axis(field_of(a, b, strength, "exact", thickness=thick, origin=origin), z)[0, 0])

    one = flux(1e-3, h, 0.0)
    return erratum(
        "(2.48)",
        "the factor is 1/h",
        "it is h",
        "field of a base twice as thick, over that of the thin one; true: two thin ones on each other",
        truth=(flux(1e-3, h, h / 2) + flux(1e-3, h, -h / 2)) / one,
        by_printed=flux(0.5e-3, 2 * h, 0.0) / one,
        by_corrected=flux(2e-3, 2 * h, 0.0) / one,
        reading="read as the factor from magnetisation to the strength of a thin sheet",
    )


def bracket() -> Finding:
    """Compute the rise of |B| beside the axis, in the thesis's units."""
    base, z = preset("undriven").base, 0.073
    a, aside = 100 * base.inner_radius_m, 0.02
    exact = field_of(base.inner_radius_m, base.outer_radius_m, base.strength_t_m, "exact")
    far, near = (np.linalg.norm(flux_density(exact, [r * base.inner_radius_m, 0.0, z])) for r in (aside, 0.0))
    b, slope, second = on_axis(exact, np.array([z]))[:, 0]
    per_cm2 = float((slope / b) ** 2 - 2 * second / b) * 1e-4
    return erratum(
        "(2.54)",
        "the r² in the bracket lacks a², lengths being in a",
        "1 + (a²r²/8)(φ₂²/φ₁² − 2φ₃/φ₁)",
        f"rise of |B| from the axis to r = {aside:g} a at 7.3 cm, in parts of it; true: from elliptic integrals",
        truth=1e6 * float(far / near - 1),
        by_printed=1e6 * aside**2 / 8 * per_cm2,
        by_corrected=1e6 * (a * aside) ** 2 / 8 * per_cm2,
        tolerance=1e-3,
        unit="10⁻⁶",
    )


def least_spin() -> Finding:
    """Find the spin at which the two fast roots of a top on a fixed point become real, from the roots.

    Of the top of the first chapter, where it floats: a heavier one floats lower, in a stronger field, and needs more.
    """
    found = stability_of(preset("undriven"))
    top, height = found.top, known(found.floating).height
    p = -top.moment * float(found.field(np.array([height]))[0, 0])
    low, high = 10.0, 40.0
    for _ in range(60):
        middle = (low + high) / 2
        roots = np.roots([top.transverse, -top.axial * 2 * math.pi * middle, p])
        low, high = (middle, high) if abs(roots[0].imag) > 0 else (low, middle)
    return erratum(
        "(2.57)",
        "lacks the factor 2√(I₁/I₃) = 1.55",
        "2√(I₁P)/I₃",
        f"least spin of a sleeping top, {1e3 * top.mass:.2f} g at {100 * height:.2f} cm; true: where "
        "its roots become real",
        truth=high,
        by_printed=found.thesis_estimate,
        by_corrected=found.thesis_estimate * 2 * math.sqrt(top.transverse / top.axial),
        unit="Hz",
        reading=f"the printed {estimate_hz():.3f} Hz are its own equation's for {1e3 * ESTIMATE_KG:.2f} g at 7.3 cm",
    )


def drive() -> list[Finding]:
    """Compute the torque of the drive on an upright top at the start."""
    scene = preset("driven").changed({**ON_AXIS, "start.tilt_rad": 0.0})
    top = scene.top
    torque = top.moment_a_m2 * top.moment_tilt[0] * scene.drive.amplitude_t
    truth = rate(scene, lambda motion: 2 * math.pi * motion.spin_hz)
    return [
        erratum(
            "(2.58)",
            "the drive is a sine along x",
            "a cosine along y, as in its program",
            "ω̇₃ of the upright top at the start",
            truth=truth,
            by_printed=0.0,
            by_corrected=torque / top.inertia_axial_kg_m2,
            tolerance=1e-5,
            unit="rad/s²",
            reading="at ψ = 0 the moment leans to x: a field along x exerts no torque about the axis",
        ),
        erratum(
            "(2.59)",
            "lacks 1/I₃",
            "I₃ω̇₃ is the torque",
            "ω̇₃ of the upright top at the start",
            truth=truth,
            by_printed=torque,
            by_corrected=torque / top.inertia_axial_kg_m2,
            tolerance=1e-5,
            unit="rad/s²",
        ),
    ]


def drag() -> list[Finding]:
    """Compute the effect of drag on the spin: backwards, by Newton's law, and as a torque."""
    from scipy.integrate import solve_ivp

    backwards = preset("friction").changed({**ON_AXIS, "start.spin_hz": -30.0})
    forwards = preset("friction").changed(ON_AXIS)
    c, spin = forwards.drag.constants[0], 2 * math.pi * 30.0
    c2, top = float(np.mean([one.value for one in several("thesis", "spindown.c2")])), forwards.top
    newton = solve_ivp(lambda _, w: -c2 * w**2, (0.0, 100.0), [spin], rtol=1e-12, atol=1e-12)
    torque = rate(forwards, lambda motion: np.einsum("ij,ij->i", motion.angular_momentum, motion.axis))
    return [
        erratum(
            "(2.61)",
            "−Cω₃ⁿ sgn ω₃, for odd n",
            "−C|ω₃|ⁿ sgn ω₃",
            "change of |ω₃| of a top that spins backwards, n = 1",
            truth=rate(backwards, lambda motion: 2 * math.pi * np.abs(motion.spin_hz)),
            by_printed=c * spin,
            by_corrected=-c * spin,
            tolerance=1e-5,
            unit="rad/s²",
        ),
        erratum(
            "(2.63)",
            "1/(A − Ct), hence the negative C₂ in its figure",
            "1/(A + Ct)",
            "spin after 100 s under n = 2, from 30 Hz; true: integrated",
            truth=float(newton.y[0, -1]) / (2 * math.pi),
            by_printed=1 / (1 / spin - c2 * 100.0) / (2 * math.pi),
            by_corrected=1 / (1 / spin + c2 * 100.0) / (2 * math.pi),
            unit="Hz",
        ),
        erratum(
            "(2.66)",
            "torque C ω₃",
            "C I₃ ω₃, as in its program",
            "torque of drag about the axis at 30 Hz",
            truth=torque,
            by_printed=-c * spin,
            by_corrected=-c * top.inertia_axial_kg_m2 * spin,
            tolerance=1e-5,
            unit="N m",
        ),
        erratum(
            "(2.67)",
            "torque (C/I₃) ω₃",
            "C I₃ ω₃",
            "torque of drag about the axis at 30 Hz",
            truth=torque,
            by_printed=-c / top.inertia_axial_kg_m2 * spin,
            by_corrected=-c * top.inertia_axial_kg_m2 * spin,
            tolerance=1e-5,
            unit="N m",
        ),
    ]


def tilting() -> Finding:
    """Compute the equation of θ at the start, on the axis, in the thesis's units."""
    scene = preset_at("IC1").changed({**ON_AXIS, "start.tilt_rad": 0.1})
    top, spin, theta = scene.top, 2 * math.pi * scene.start.spin_hz, scene.start.tilt_rad
    sin, cos = math.sin(theta), math.cos(theta)
    phi = spin / (1 + cos)
    transverse, axial = 1e7 * top.inertia_transverse_kg_m2, 1e7 * top.inertia_axial_kg_m2  # [g cm²]
    righting = -1e7 * top.moment_a_m2 * float(flux_density(base_field(scene), [0.0, 0.0, 0.073])[2]) * sin
    rest = (righting - axial * spin * phi * sin) / transverse
    return erratum(
        "(2.67), θ",
        "I₁(θ̈ − I₁φ̇² sin θ cos θ)",
        "I₁(θ̈ − φ̇² sin θ cos θ)",
        "θ̈ of a top tilted by 0.1 rad on the axis",
        truth=bend(scene, lambda motion: motion.tilt),
        by_printed=rest + transverse * phi**2 * sin * cos,
        by_corrected=rest + phi**2 * sin * cos,
        tolerance=1e-4,
        unit="rad/s²",
    )


def force() -> Finding:
    """Compute the force on a top below the height at which it floats."""
    scene = preset_at("IC1").changed({**ON_AXIS, "start.position_m": [0.0, 0.0, 0.071], "start.tilt_rad": 0.0})
    top = scene.top
    upward = top.moment_a_m2 * float(on_axis(base_field(scene), np.array([0.071]))[1, 0]) / top.mass_kg
    return erratum(
        "(3.1)",
        "F_z = mg − μ ∂_z B_z",
        "F_z = μ ∂_z B_z − mg; its zero, and so the moment, is right",
        "acceleration upward of the upright top on the axis at 7.1 cm",
        truth=rate(scene, lambda motion: motion.velocity[:, 2]),
        by_printed=scene.gravity_m_s2 - upward,
        by_corrected=upward - scene.gravity_m_s2,
        tolerance=1e-5,
        unit="m/s²",
    )


def table_of_parameters() -> list[Finding]:
    """Compare units and mass of Table 3.1."""
    scene = preset("undriven")
    rho, mu = THESIS["device.strength"].value, THESIS["device.moment"].value
    a, b, g = (THESIS[f"device.{key}"].value for key in ("inner_radius", "outer_radius", "gravity"))
    z = THESIS["device.height"].value
    # B′ of the sheet in mT/cm, in the thesis's units throughout
    slope = 2 * math.pi * rho * 3 * z * (a**2 / (a**2 + z**2) ** 2.5 - b**2 / (b**2 + z**2) ** 2.5)
    lifted = mu * abs(slope) / g
    true = 1e3 * abs(scene.top.moment_a_m2 * float(on_axis(base_field(scene), z / 100)[1, 0])) / scene.gravity_m_s2
    return [
        erratum(
            "Table 3.1, units",
            "units of ρ and μ",
            "ρ in mT cm, μ in g cm² s⁻² mT⁻¹",
            "mass that floats at 7.3 cm; true: in SI",
            truth=true,
            by_printed=None,
            by_corrected=lifted,
            unit="g",
        ),
        erratum(
            "Table 3.1, m",
            "m = 25.5 g, more than the 25.485 g that this field can lift",
            "25.26 g",
            "mass that floats at 7.3 cm",
            truth=true,
            by_printed=THESIS["device.mass"].value,
            by_corrected=1e3 * scene.top.mass_kg,
            tolerance=2e-4,
            unit="g",
        ),
    ]


def tilt_of_moment() -> Finding:
    """Compute the lean of the moment of (4.4), from the torque of a field along the axis."""
    across, along = preset("driven").top.moment_tilt
    moment = np.array([across, 0.0, along])
    torque = np.cross(moment, [0.0, 0.0, 1.0])
    return erratum(
        "(4.4)",
        "leans by 1.5°",
        "leans by 1.77° and shortens μ by 3 %",
        "angle of the moment; true: from the torque of a field along the axis",
        truth=math.degrees(math.asin(float(np.linalg.norm(torque)) / float(np.linalg.norm(moment)))),
        by_printed=THESIS["device.tilt"].value,
        by_corrected=math.degrees(math.atan2(across, along)),
        unit="°",
    )


def third_start() -> Finding:
    """Simulate the lower limit from x = 0.50 and 0.30 cm."""
    printed, step = THESIS["limits.lower.IC3"], 0.05
    spins = scan(21.8, 25.3, step)
    aside = np.array([0.005, 0.003])
    up = many(preset_at("IC3"), {"start.spin_hz": spins[None, :], "start.position_m.0": aside[:, None]}).survived
    wrong, right = (lower_limit(spins, row) for row in up)
    return erratum(
        "Table 4.1, third column",
        "x(0) = 0.50 cm",
        "0.30 cm",
        f"lower limit from there, in steps of {step:g} Hz; true: as Table 4.2 prints it",
        truth=printed.value,
        by_printed=wrong,
        by_corrected=right,
        tolerance=step / printed.value,
        unit="Hz",
    )


def make() -> Found:
    """Make the chapter."""
    findings = (
        centre_of_mass(),
        rotation(),
        fourth_power(),
        thickness(),
        bracket(),
        least_spin(),
        *drive(),
        *drag(),
        tilting(),
        force(),
        *table_of_parameters(),
        tilt_of_moment(),
        third_start(),
    )
    note = Note(
        "Each row: what the printed equation gives for a number, what the corrected one gives, and what is true by a "
        "third way (a simulated motion, an exact field, a symmetry, a dimension)."
    )
    return Found(findings, (note,), "Slips in equations and tables of the thesis, each with a numeric test.")
