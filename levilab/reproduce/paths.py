"""Motions that the thesis shows as figures: paths, the tilt at the fall, a tilted moment beside an aligned one."""

import math
from functools import partial

import numpy as np

from analysis.numbers import digits
from analysis.stability import sleeping_limit
from levilab.motion.lines import lines_of
from levilab.present.document.blocks import Picture
from levilab.reproduce.check import Because, Finding, Found, Within, check, statement
from levilab.reproduce.figure import fall_figure, paths_figure, tilted_figure
from levilab.reproduce.tops import DURATION_S, FALL_M, THESIS, known, many, preset_at, simulate_for_lines
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import Scene, preset
from levilab.simulator.single import simulate
from levilab.simulator.trajectory import Trajectory
from levilab.stability.thesis import SIMULATED_HZ, STARTS

#: How long a path is shown [s], and samples per second.
PATH_S, PATH_HZ = 10.0, 400.0
#: How long a fall with drag takes at most, how much of it is shown [s], and samples per second.
FALL_S, SHOWN_S, FALL_HZ = 150.0, 6.0, 400.0
#: A tilt that is very large [rad]; the mass of the tilted runs [kg], and how much shorter they are said to be [%].
LARGE_RAD, TILTED_KG, SHORTER_PERCENT = 0.5, 0.02445, 35.0
#: A line is that of theory within this part of its frequency: the swings are not small.
NEAR = 0.06


def paths() -> tuple[list[Finding], dict[str, Trajectory]]:
    """Simulate the four paths, and compare their constants of motion, and their lines with theory."""
    shown = {name: simulate(preset_at(name), PATH_S, tolerance=1e-8, rate=PATH_HZ) for name in STARTS}
    found: list[Finding] = []
    for name, motion in shown.items():
        drift = float(np.abs(motion.energies / motion.energies[0] - 1).max())
        place = 100 * motion.position
        x, z = (float(np.abs(place[:, 0]).max()), (float(place[:, 2].min()), float(place[:, 2].max())))
        found.append(
            statement(
                f"{name}: path over x and z at 30 Hz",
                "figures of the paths",
                "the top stays in the trap",
                f"|x| up to {x:.2f} cm, z from {z[0]:.2f} to {z[1]:.2f} cm in {PATH_S:g} s; energy constant to "
                f"{digits(drift, 1)} of itself",
                holds=motion.survived and drift < 1e-9,
            )
        )
    return found, shown


def modes() -> list[Finding]:
    """Compare the lines of the calm start IC2 with the roots of the quartic."""
    scene = preset_at("IC2")
    found = stability_of(scene)
    motion = simulate_for_lines(scene, DURATION_S, 1e-8)
    lines = {line.name: line.frequency for line in lines_of(motion).lines if line.name and not line.sideband}
    theory = dict(zip(("nutation", "precession"), sorted(found.modes.real, key=abs)[:1:-1], strict=True))
    off = {name: lines.get(name, math.nan) / frequency - 1 for name, frequency in theory.items()}
    return [
        statement(
            f"IC2: {name} in the spectrum of n_x + i n_y",
            "theory of small motions",
            "",
            f"{lines.get(name, math.nan):.3f} Hz (line of the simulated motion), {frequency:.3f} Hz (root of the "
            "quartic)",
            holds=abs(off[name]) < NEAR,
        )
        for name, frequency in theory.items()
    ]


def compare_sleeping_limits(scene: Scene) -> tuple[float, str, bool]:
    """Compare the sleeping top's limit of a scene with that of the first chapter's top, which has another mass.

    Returns:
        the limit [Hz]; both in words; whether their heights alone make the difference.
    """
    own, first = stability_of(scene), stability_of(preset("undriven"))
    here, there = known(own.floating).height, known(first.floating).height
    words = (
        f"{own.sleeping:.2f} Hz for its {1e3 * own.top.mass:.3f} g, which float at {100 * here:.2f} cm; "
        f"the first chapter's {1e3 * first.top.mass:.2f} g float at {100 * there:.2f} cm, in a weaker "
        f"field: {first.sleeping:.2f} Hz"
    )
    limit = sleeping_limit(own.field, own.top, there)
    return own.sleeping, words, math.isclose(limit, first.sleeping, rel_tol=1e-9)


def fall() -> tuple[Finding, Trajectory]:
    """Simulate a top with drag from 30 Hz: how its tilt grows at the end."""
    scene = preset_at("IC1", "friction", f"escape.height_m={FALL_M}")
    motion = simulate(scene, FALL_S, tolerance=1e-6, rate=FALL_HZ)
    early = motion.time < motion.time[-1] - SHOWN_S
    before, last = float(motion.tilt[early].max()), float(motion.tilt[-1])
    limit, words, explained = compare_sleeping_limits(scene)
    return (
        statement(
            "tilt at the fall, IC1 with drag from 30 Hz",
            "figure of the tilt",
            "the tilt stays small until the spin is too slow, and grows within a second",
            f"up to {math.degrees(before):.1f}° until {SHOWN_S:g} s before the fall, {math.degrees(last):.0f}° when z "
            f"is 6 cm, at {motion.spin_hz[-1]:.2f} Hz; the sleeping top's limit is {words}",
            holds=not motion.survived
            and last > 3 * before
            and abs(float(motion.spin_hz[-1]) - limit) < 0.5
            and explained,
        ),
        motion,
    )


def sudden_fall() -> Finding:
    """Find when the tilt is very large, without drag, just below the lower limit."""
    limit = SIMULATED_HZ["IC1"][0]
    spins = limit - 0.01 * np.arange(1, 4)
    times = []
    for spin in spins.tolist():
        motion = simulate(preset_at("IC1").changed({"start.spin_hz": spin}), DURATION_S, tolerance=1e-7, rate=200.0)
        times.append(float(motion.time[np.argmax(motion.tilt > LARGE_RAD)]))
    return check(
        f"IC1 without drag, {limit - spins[0]:.2f} Hz below its lower limit: the tilt exceeds {LARGE_RAD:g} rad after",
        THESIS["fall.time"],
        times[0],
        Within(
            max(times) - min(times), "a hundredth and two below it: " + ", ".join(f"{time:.2f} s" for time in times)
        ),
    )


def shorter_run() -> Finding:
    """Compute how much earlier a top with a tilted moment falls, with drag: of starts alike, for several masses."""
    aligned = preset_at("IC1", "friction", f"escape.height_m={FALL_M}")
    leaning = aligned.changed({"top.moment_tilt": list(preset("tilted").top.moment_tilt)})
    spins = 30.0 + 0.001 * np.arange(24)
    lasts = float(np.median(many(aligned, {"start.spin_hz": spins}, FALL_S).time))
    masses = np.array([TILTED_KG, *(TILTED_KG - 1e-6 * np.array([50.0, 75.0, 100.0]))])
    falls = many(leaning, {"start.spin_hz": spins[None, :], "top.mass_kg": masses[:, None]}, FALL_S).time
    shorter = 100 * (1 - falls / lasts)
    parts = "; ".join(
        f"{1e3 * mass:.3f} g: {row.min():.0f} to {row.max():.0f} %"
        for mass, row in zip(masses.tolist(), shorter, strict=True)
    )
    reached = bool(shorter[1:].min() < SHORTER_PERCENT + 0.5 < shorter[0].min())
    return statement(
        "a tilted moment shortens the run with drag, IC1 from 30 Hz",
        "§4.3",
        f"by approximately {SHORTER_PERCENT:g} %",
        f"{np.median(shorter[0]):.0f} % for the {1e3 * TILTED_KG:.2f} g of its tilted runs, {spins.size} starts alike",
        holds=abs(float(np.median(shorter[0])) - SHORTER_PERCENT) < 5,
        reason=f"the phase at the fall and 0.1 g decide how early the top is lost ({parts})" if reached else "",
    )


def compare_tilted() -> tuple[list[Finding], tuple[Trajectory, Trajectory]]:
    """Simulate a moment tilted in the top beside one that is as strong along the axis, but aligned."""
    scene = preset("tilted")
    across, along = scene.top.moment_tilt
    aligned = scene.changed({"top.moment_tilt": [0.0, along]})
    motions = tuple(simulate(one, 4.0, tolerance=1e-8, rate=1000.0) for one in (scene, aligned))
    angle, norm = math.degrees(math.atan2(across, along)), math.hypot(across, along)
    printed = THESIS["device.tilt"]
    lines = [lines_of(simulate_for_lines(one, 20.0, 1e-7)) for one in (scene, aligned)]
    spin = scene.start.spin_hz
    wobble = [max((x.amplitude for x in one.lines if abs(x.frequency - spin) < 0.05), default=0.0) for one in lines]
    found: list[Finding] = [
        check(
            "angle between moment and axis",
            printed,
            angle,
            Because(
                f"μ·(0.03, 0, 0.97) leans by arctan(0.03/0.97) = {angle:.4f}°, and it has {norm:.6f} of the length of "
                f"μ, {100 * (1 - norm):.0f} % less, so that a lighter top floats; 1.5° would be "
                f"({along * math.tan(math.radians(printed.value)):.4f}, 0, 0.97)",
                abs(angle - 1.7715) < 1e-3 and abs(norm - 0.970464) < 1e-6,
            ),
        ),
        statement(
            "a tilted moment makes the top wobble once a turn",
            "figures of the tilted and the aligned dipole",
            "the tilted one wobbles, the aligned one does not",
            f"line of n_x + i n_y at {spin:g} Hz: {1e3 * wobble[0]:.2f} mrad (tilted), {1e3 * wobble[1]:.2f} mrad "
            "(aligned)",
            holds=wobble[0] > 10 * wobble[1] and wobble[0] > 0.01,
        ),
    ]
    return found, (motions[0], motions[1])


def make() -> Found:
    """Make the chapter."""
    about_paths, shown = paths()
    about_fall, falling = fall()
    about_tilt, both = compare_tilted()
    pictures = (
        Picture(
            "paths",
            "Four starts, four paths.",
            f"Path of the centre of mass over x and z, the first {PATH_S:g} s at 30 Hz without drag; the ring marks "
            "the start.",
            "Paths over x and z from the four starts",
            partial(paths_figure, shown),
        ),
        Picture(
            "fall",
            "A top that slows down tilts at the very end.",
            "Tilt (band between its least and greatest value, and on the right the last second), height and spin of a "
            "top with the thesis's drag, from 30 Hz, up to its fall.",
            "Tilt, height and spin up to the fall",
            partial(fall_figure, falling),
        ),
        Picture(
            "tilted",
            "A tilted moment wobbles with the spin.",
            "The axis seen from above, n_x and n_y, in the first 4 s at 30 Hz: with the moment tilted by 1.77° and "
            "with one that is as strong along the axis, but not tilted.",
            "The axis seen from above with a tilted and with an aligned moment",
            partial(tilted_figure, both),
        ),
    )
    said = "Figures without numbers: what they show is said in a sentence and tried; the motions are simulated again."
    findings = (*about_paths, *modes(), about_fall, sudden_fall(), *about_tilt, shorter_run())
    return Found(findings, pictures, said)
