"""The spin-down of a top in full motion, which the drive has brought to its spin: constant of the drag and fall."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from instruments.clock import VirtualClock
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, acquired, pull_of
from levilab.crosscheck.subjects.spindown import Fitted, spindown_of
from levilab.simulator.scene import Scene, preset
from levilab.simulator.single import simulate
from levilab.world.bench import scene_world, virtual_wiring

if TYPE_CHECKING:
    from pathlib import Path

    from levilab.acquisition.loop import AcquisitionRequest
    from levilab.bench.wiring import Wiring
    from levilab.runs.run import Run

#: The disc's constant of the thesis's runs [(rad/s)^−½/s].
USUAL = 2.34e-4
#: A top of another mass, tilt of its moment and drag falls within so long [s].
LONGEST_S = 400.0


def trial(seed: int, folder: Path) -> list[Pull]:
    """One spin-down: mass, tilt of the moment and drag are drawn by the seed."""
    random = np.random.default_rng((seed, 3))
    tilt = float(random.uniform(0.022, 0.034))
    coefficient = USUAL * float(random.uniform(0.85, 1.15))
    scene = preset("spindown").changed(
        {
            "top.mass_kg": float(random.uniform(0.02420, 0.02440)),
            "top.moment_tilt": [tilt, 0.97],
            "drag.law": "disc",
            "drag.coefficient": coefficient,
            "start.spin_hz": float(random.uniform(29.0, 31.0)),
        }
    )
    run = acquired("spin", seed, folder, lambda request: _in_world(request, scene, seed))
    found = spindown_of(run.folder)
    parameters = found.models["disc"]["parameters"]
    return [
        pull_of("disc c32", parameters["c32"], coefficient),
        pull_of("exponent", found.models["power"]["parameters"]["exponent"], 1.5),
        _fall(found, run, scene),
    ]


def _in_world(request: AcquisitionRequest, scene: Scene, seed: int) -> AcquisitionRequest:
    def wiring() -> Wiring:
        return virtual_wiring(scene_world(scene, VirtualClock, lambda _: None, seed=seed), request.config.limits)

    return replace(request, wiring=wiring, scene=scene.as_table())


def _fall(found: Fitted, run: Run, scene: Scene) -> Pull:
    """When the top falls, by the fitted law in the simulator, beside what was seen of it [s].

    It was seen to have fallen between its last reading and the next one that was asked for.
    """
    parameters = found.models["disc"]["parameters"]
    free = scene.changed(
        {"drag.coefficient": parameters["c32"]["value"], "start.spin_hz": parameters["start_frequency"]["value"]}
    )
    motion = simulate(free, LONGEST_S, tolerance=1e-6, rate=None)
    if motion.fell is None:
        raise TrialFailed(f"the fitted law keeps the simulated top up for {LONGEST_S:g} s")
    times = run.readings().column("time_s")
    interval = float(np.median(np.diff(times)))
    return Pull("fall", found.start_time + motion.fell.time, interval / math.sqrt(12), float(times[-1]) + interval / 2)


SUBJECT = Subject(
    "motion",
    "the spin-down of a top in full motion: constant of the disc's drag, exponent, the fall",
    trial,
)
