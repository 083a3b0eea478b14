"""The spin-down of a top in full motion, which the drive has brought to its spin: constant of the drag and fall."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from analysis.spindown.fit import SpinDown
from instruments.clock import VirtualClock
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.priors import drawing
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.crosscheck.subjects.spindown import spindown_of
from levilab.runs.run import Run
from levilab.simulator.kernels.motion import R
from levilab.simulator.scene import Scene, preset
from levilab.simulator.single import simulate
from levilab.simulator.start import nutating_start, start_of, steady_rates
from levilab.world.bench import scene_world

#: The disc's constant of the thesis's runs [(rad/s)^−½/s].
USUAL = 2.34e-4
#: A top of another mass, tilt of its moment and drag falls within so long [s].
LONGEST_S = 400.0
#: A scene with less of a nutation than this would be upright [Hz].
_LEAST_HZ = 1e-6


def draw_scene(seed: int) -> Scene:
    """Return the top of this seed."""
    draw = drawing("motion", np.random.default_rng((seed, 3)))
    tilt, coefficient = draw("moment across the axis"), USUAL * draw("drag")
    return preset("spindown").changed(
        {
            "top.mass_kg": draw("top.mass_kg"),
            "top.moment_tilt": [tilt, 0.97],
            "drag.law": "disc",
            "drag.coefficient": coefficient,
            "start.spin_hz": draw("start.spin_hz"),
        }
    )


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one spin-down of a drawn top."""
    scene = draw_scene(seed)
    coefficient: Any = scene.drag.coefficient
    world = scene_world(scene, VirtualClock, lambda _: None, seed=seed)
    # without the stated u: that is of a top that only spins
    run = acquire_mock("spin", seed, folder, world, {"reading_u_hz": None}, scene=scene)
    found = spindown_of(run.folder)
    return [
        pull_of("disc c32", found.fit("disc").parameters["c32"], coefficient),
        pull_of("exponent", found.fit("power").parameters["exponent"], 1.5),
        _fall(found, run, scene),
    ]


def _fall(found: SpinDown, run: Run, scene: Scene) -> Pull:
    """Return when the top falls, by the fitted law in the simulator, beside what was seen of it [s].

    It was seen to have fallen between the end of the gate of its last reading and that of the next one, which came to
    none.  A drive leaves a nutation, and the more of it the earlier a top falls; the counts show how much.  The
    prediction is the middle between the least and the most of it that they and the prior allow, half their distance a
    part of its uncertainty.
    """
    parameters = found.fit("disc").parameters
    constant, start = parameters["c32"], parameters["start_frequency"].value
    if not constant.value or constant.u is None:
        raise TrialFailed("disc c32: the analysis gives no value with an uncertainty")
    fitted = scene.changed({"drag.coefficient": constant.value, "start.spin_hz": start})
    readings = run.readings()
    wobble = parameters["wobble"].value or 0.0
    u_wobble = parameters["wobble"].u or 0.0
    late, early = (_simulated_fall(fitted, max(wobble + sign * u_wobble, _LEAST_HZ)) for sign in (-1, 1))
    times = readings.column("time_s")
    interval, gate = float(np.median(np.diff(times))), float(run.record.configuration["spin"]["gate_s"])
    # a given spin is reached in a time that goes as 1/C
    by_constant = (late + early) / 2 * constant.u / constant.value
    u = math.hypot(interval / math.sqrt(12), (late - early) / 2, by_constant)
    return Pull("fall", found.start_time + (late + early) / 2, u, float(times[-1]) + (interval + gate) / 2)


def nutation(scene: Scene, wobble_hz: float) -> float:
    """Return the angle [rad] of a nutation that adds so much to the count, K/√((ν/ν_s)² − 1).

    It adds half the square of the angle times its frequency.  With f and p the frequencies of nutation and precession
    the root is (f − p)/2√(fp).
    """
    place = start_of(scene)[R]
    slow, fast = steady_rates(scene, 2 * math.pi * scene.start.spin_hz, place)
    counted = wobble_hz * 2 * math.sqrt(slow * fast) / (fast - slow)
    return math.sqrt(2 * counted * 2 * math.pi / fast)


def _simulated_fall(scene: Scene, wobble_hz: float) -> float:
    """Return the time [s] at which the top of a scene falls that nutates so much.  Raises TrialFailed."""
    nutating = scene.changed({"start.tilt_rad": nutation(scene, wobble_hz)})
    motion = simulate(nutating, LONGEST_S, tolerance=1e-6, rate=None, start=nutating_start(nutating))
    if motion.fell is None:
        raise TrialFailed(f"the fitted law keeps the simulated top up for {LONGEST_S:g} s")
    return float(motion.fell.time)


SUBJECT = Subject(
    "motion", "the spin-down of a top in full motion: constant of the disc's drag, exponent, the fall", trial
)
