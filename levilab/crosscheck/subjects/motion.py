"""The spin-down of a top in full motion, which the drive has brought to its spin: constant of the drag and fall."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from instruments.clock import VirtualClock
from levilab.acquisition.table import settings_of, with_settings
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
#: A top that nutates (keys of a scene).  The tilt was chosen between two that were tried, and is measured on no top: it
#: is an assumption about what a drive may leave.
STIRRED = {"start.tilt_rad": 0.075, "start.precession": "none"}


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
    """The same request in this world.  No u of a reading is stated: that of a request is of a top that only spins."""

    def wiring() -> Wiring:
        return virtual_wiring(scene_world(scene, VirtualClock, lambda _: None, seed=seed), request.config.limits)

    settings: Any = settings_of(request.config, request.experiment)
    config = with_settings(request.config, request.experiment, settings.model_copy(update={"reading_u_hz": None}))
    return replace(request, config=config, wiring=wiring, scene=scene.as_table())


def _fall(found: Fitted, run: Run, scene: Scene) -> Pull:
    """When the top falls, by the fitted law in the simulator, beside what was seen of it [s].

    It was seen to have fallen between its last reading and the next one that was asked for.  A drive leaves a motion
    that a count does not tell, and that lets a top fall earlier: so the prediction is the middle between a calm top and
    one that still nutates, its uncertainty half their distance.
    """
    parameters = found.models["disc"]["parameters"]
    fitted = scene.changed(
        {"drag.coefficient": parameters["c32"]["value"], "start.spin_hz": parameters["start_frequency"]["value"]}
    )
    calm, stirred = (_simulated_fall(fitted.changed(keys)) for keys in ({}, STIRRED))
    times = run.readings().column("time_s")
    interval = float(np.median(np.diff(times)))
    u = math.hypot(interval / math.sqrt(12), (calm - stirred) / 2)
    return Pull("fall", found.start_time + (calm + stirred) / 2, u, float(times[-1]) + interval / 2)


def _simulated_fall(scene: Scene) -> float:
    """When the top of a scene falls [s].  Raises TrialFailed."""
    motion = simulate(scene, LONGEST_S, tolerance=1e-6, rate=None)
    if motion.fell is None:
        raise TrialFailed(f"the fitted law keeps the simulated top up for {LONGEST_S:g} s")
    return float(motion.fell.time)


SUBJECT = Subject(
    "motion",
    "the spin-down of a top in full motion: constant of the disc's drag, exponent, the fall",
    trial,
)
