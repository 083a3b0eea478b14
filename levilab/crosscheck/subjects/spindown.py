"""The spin-down of a top that only spins: the law of drag, its constants and the fall."""

import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from analysis.spindown.fit import SpinDown
from instruments.clock import VirtualClock
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.priors import drawing
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.pipelines.catalogue import ANALYSES
from levilab.simulator.laws import LAWS
from levilab.simulator.scene import Scene
from levilab.simulator.single import simulate
from levilab.simulator.spin import DECAYS
from levilab.world.spin_world import SpinScene, SpinWorld

#: The spin at which the drive goes off [Hz].
START_HZ = 40.0
#: States of the simulated spin per second, for the moment of the fall.
RATE = 10.0


def draw_scene(seed: int) -> SpinScene:
    """Draw a top."""
    random = np.random.default_rng((seed, 2))
    draw = drawing("spindown", random)
    law = sorted(LAWS)[int(random.integers(len(LAWS)))]
    return SpinScene(
        start_hz=draw("start"),
        drag=law,
        constants=tuple(c * draw("drag") for c in LAWS[law].usual),
        fall_hz=draw("fall"),
        jitter=SpinScene.jitter * draw("scatter of the pulses"),
        seed=seed,
    )


def trial(seed: int, folder: Path, counter: str | None = None, scope: str | None = None) -> list[Pull]:
    """Try one spin-down.  counter, scope: that counts in place of the bench's."""
    scene = draw_scene(seed)
    law, names, exponent = scene.drag, LAWS[scene.drag].names, LAWS[scene.drag].exponent
    run = acquire_mock("spin", seed, folder, SpinWorld(scene, VirtualClock()), counter=counter, scope=scope)
    found = spindown_of(run.folder, tilt="none")  # a count of this world is the spin
    pulls = [
        pull_of(f"{law} {name}", found.fit(law).parameters[name], truth)
        for name, truth in zip(names, scene.constants, strict=True)
    ]
    spin = DECAYS[law].after(2 * math.pi * START_HZ, found.start_time, *scene.constants) / (2 * math.pi)
    pulls.append(pull_of("start frequency", found.fit(law).parameters["start_frequency"], float(spin)))
    if exponent is not None:
        pulls.append(pull_of("exponent", found.fit("power").parameters["exponent"], exponent))
    pulls.append(_fall(found, law, names, scene))
    return pulls


def spindown_of(folder: Path, **options: Any) -> SpinDown:
    """Return the only spin-down of a run."""
    analysis = ANALYSES["spindown"]
    run: SpinDown
    (run,) = analysis.analyze([folder], analysis.options_from(options)).runs
    return run


def _fall(found: SpinDown, law: str, names: tuple[str, ...], scene: SpinScene) -> Pull:
    """Return when the top falls, by the fitted law in the simulator, beside the world's own moment [s]."""
    fit = found.fit(law)
    order = ("start_frequency", *names)
    values = np.array([fit.parameters[name].value for name in order], dtype=np.float64)
    step = np.array([fit.parameters[name].u for name in order], dtype=np.float64)

    def fall_time(numbers: Any) -> float:
        constants = tuple(map(float, numbers[1:]))
        return found.start_time + fall_of_spin(law, constants, float(numbers[0]), scene.fall_hz)

    middle = fall_time(values)
    slope = np.array([fall_time(values + row) - middle for row in np.diag(step)]) / step
    covariance = np.asarray(fit.covariance, dtype=np.float64)
    u = math.sqrt(float(slope @ covariance @ slope))
    truth = DECAYS[law].elapsed(2 * math.pi * START_HZ, 2 * math.pi * scene.fall_hz, *scene.constants)
    return Pull("fall", middle, u, float(truth))


def fall_of_spin(law: str, constants: tuple[float, ...], start_hz: float, fall_hz: float) -> float:
    """Return the time [s] at which a simulated spin under this law is that of the fall.  Raises TrialFailed."""
    scene = Scene(observed="spin").changed(
        {"drag.law": law, "drag.coefficient": list(constants) if len(constants) > 1 else constants[0],
         "start.spin_hz": start_hz}
    )  # fmt: skip
    motion = simulate(scene, 600.0, rate=RATE)
    spins = np.asarray(motion.spin_hz)
    if not spins.min() < fall_hz:
        raise TrialFailed(f"the fitted law {law} lets the top spin above {fall_hz:g} Hz for 600 s")
    return float(np.interp(-fall_hz, -spins, motion.time))


SUBJECT = Subject(
    "spindown", "the spin-down of a top that only spins: constants of the drag, its exponent, the fall", trial
)
#: Its clock is up to 0.1 per mille off, which moves the constants by 0.1 u.
SOUND = Subject(
    "sound",
    "the same, counted by a sound card by estimating the frequency of records, each with its u",
    partial(trial, scope="sound"),
)
