"""The slow swings of a top in full motion, filmed, and recorded by a phone above it: geometric magnetism."""

from pathlib import Path

import numpy as np

from analysis.arrays import Array
from levilab.crosscheck.priors import PRIORS, drawing
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.formats.device import read_device
from levilab.pipelines.catalogue import ANALYSES
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import Scene, preset
from levilab.simulator.single import simulate
from levilab.simulator.trajectory import Trajectory

#: Frames per second, and length of the film [s].
RATE, DURATION_S = 120.0, 110.0
#: Of the moment, across the axis: about 2°.
_ACROSS = 0.03
#: Error of a coordinate [m] and of a sample of the field [T]; standard uncertainties of the mass [kg] and of the radii
#: of the base [m].
NOISE_M, _FIELD_NOISE_T, _WEIGHED_U_KG, _CALLIPER_U_M = (
    PRIORS["sway"][name].b for name in ("noise", "noise of the field", "mass as weighed", "radius as measured")
)


def draw_scene(seed: int) -> Scene:
    """Draw mass, place, velocity, tilt and drag of a top at 40 Hz, and what pushes it."""
    draw = drawing("sway", np.random.default_rng((seed, 23)))
    resting = preset("undriven").changed({"top.mass_kg": draw("top.mass_kg"), "drag.law": "disc"})
    floating = stability_of(resting).floating
    if floating is None:
        raise TrialFailed("the top that was drawn floats nowhere")
    away, azimuth = draw("push"), draw("azimuth")
    height = floating.height + draw("height")
    return resting.changed(
        {
            "start.place": "given",
            "start.spin_hz": 40.0,
            "start.position_m": [away * np.cos(azimuth), away * np.sin(azimuth), height],
            "start.velocity_m_s": [draw("velocity") for _ in range(3)],
            "start.tilt_rad": draw("start.tilt_rad"),
        }
    )


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one film of a drawn top, and the record of a phone above it, whose magnetometer shows the spin, too.

    True are (I₃ω₃/m)(B′/2B)² where a top of its mass floats at rest, and all of the spin's angular momentum.
    """
    scene = draw_scene(seed)
    place = stability_of(scene).floating
    assert place is not None
    motion = simulate(scene, DURATION_S, rate=RATE, tolerance=1e-5)
    by = np.random.default_rng((seed, 24))
    noise = NOISE_M * by.standard_normal((len(motion.time), 2))
    table = np.column_stack([motion.time, motion.position[:, :2] + noise, motion.spin_hz])[:-1]
    track, device = folder / "track.csv", folder / "device.toml"
    np.savetxt(track, table, "%.6f", ",", header="time_s,x_m,y_m,spin_frequency_hz", comments="")
    top, base = scene.top, scene.base
    weighed = by.normal(top.mass_kg, _WEIGHED_U_KG)
    inner, outer = by.normal((base.inner_radius_m, base.outer_radius_m), _CALLIPER_U_M).tolist()
    device.write_text(
        f"[base]\ninner_radius_m = {inner}\ninner_radius_u_m = {_CALLIPER_U_M}\nouter_radius_m = {outer}\n"
        f"outer_radius_u_m = {_CALLIPER_U_M}\n[top]\n"
        f"moment_a_m2 = {abs(top.moment_a_m2)}\nmass_kg = {weighed}\nmass_u_kg = {_WEIGHED_U_KG}\n"
        f"inertia_transverse_kg_m2 = {top.inertia_transverse_kg_m2}\ninertia_axial_kg_m2 = {top.inertia_axial_kg_m2}\n",
        encoding="utf-8",
    )
    analysis = ANALYSES["sway"]
    (found,) = analysis.analyze([track], analysis.options_from({"device": read_device(device)})).runs
    b, slope, _ = stability_of(scene).field(np.array([place.height]))[:, 0]
    truth = top.inertia_axial_kg_m2 / top.mass_kg * float(slope / (2 * b)) ** 2 * found.geometry.spin
    draw = drawing("sway", by)
    record, far = folder / "phone.csv", draw("distance")
    field = field_of_top(motion, far, draw("aside"), _ACROSS * top.moment_a_m2) * (1.0, draw("gains"), 1.0)
    field += _FIELD_NOISE_T * by.standard_normal(field.shape)
    heads = ",".join(("Time (s)", *(f"Magnetic field {axis} (T)" for axis in "xyz")))
    np.savetxt(record, np.column_stack([motion.time, field])[:-1], "%.10f", ",", header=heads, comments="")
    options = {"device": read_device(device), "sensor_m": PRIORS["sway"]["distance"].a}
    (by_field,) = analysis.analyze([record], analysis.options_from(options)).runs
    return [
        pull_of("geometric magnetism", found.geometry.measured, truth),
        pull_of("joint ratio", found.geometry.joint.ratio, 1.0),
        pull_of("geometric magnetism, by the field", by_field.geometry.measured, truth),
    ]


def field_of_top(motion: Trajectory, far: float, aside: float, across: float) -> Array:
    """Return the field of a top's dipole above the height at which its motion begins, shape (n, 3) [T].

    Args:
        motion: of the top.
        far: how far above [m].
        aside: from the axis of the base [m].
        across: moment across the top's axis, which turns with the spin [A m²].
    """
    turns = np.concatenate([[0.0], np.cumsum((motion.spin_hz[1:] + motion.spin_hz[:-1]) / 2 * np.diff(motion.time))])
    spun = np.stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns), 0 * turns], axis=1)
    moment = motion.scene.top.moment_a_m2 * motion.axis + across * spun
    way = np.array([aside, 0.0, motion.position[0, 2] + far]) - motion.position
    size = np.linalg.norm(way, axis=1)[:, None]
    along = np.sum(moment * way, axis=1)[:, None] / size**2
    return np.asarray(1e-7 * (3 * along * way - moment) / size**3)


SUBJECT = Subject(
    "sway",
    "the slow swings of a top in full motion, filmed and by a phone's magnetometer above it: geometric magnetism",
    trial,
)
