"""The limits of tops that only spin, lower and upper, with a drive that creeps and with one that the top triggers."""

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from analysis.locked import Cause
from instruments.clock import VirtualClock
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.priors import drawing
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.crosscheck.subjects.spindown import draw_scene
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.limit.analysis import Limits
from levilab.world.spin_world import SpinScene, SpinWorld

#: Number of tops of a run.
TOPS = 10
#: Quantity → settings of its runs.
_WAYS: MappingProxyType[str, dict[str, Any]] = MappingProxyType({
    "lower mean": {"which": "lower", "drive_frequency_hz": 24.0, "ramp_hz_per_s": 0.3},
    "upper mean": {"which": "upper"},
    "triggered upper mean": {"which": "upper", "drive": "triggered"},
})  # fmt: skip
#: A drive that leaves every top behind: drag takes all of its 0.12 mT at 31 to 40 Hz.
_TOO_WEAK = MappingProxyType({"which": "upper", "drive_frequency_hz": 25.0, "drive_amplitude_vpp": 3.0})


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try a run of ten tops in each way; the truth is the mean of the law that their limits are drawn from.

    Raises TrialFailed where a cause is not the true one: in this world a lock is lost by nothing but drag.
    """
    draw = drawing("limit", np.random.default_rng((seed, 26)))
    lower, upper = draw("lower mean"), draw("upper mean")
    falls, edges = (tuple(mean + draw("top") for _ in range(TOPS)) for mean in (lower, upper))
    scene = replace(draw_scene(seed), fall_hz=falls[0], later_falls_hz=falls[1:], edges_hz=edges)
    pulls = []
    for name, settings in _WAYS.items():
        found = _limits(seed, folder / name, scene, settings | {"repetitions": TOPS})
        if settings["which"] == "upper":
            _check_causes(name, found, Cause.OUT_OF_WINDOW)
        pulls.append(pull_of(name, found.statistics.mean, lower if settings["which"] == "lower" else upper))
    _check_causes(
        "too weak a drive",
        _limits(seed, folder / "weak", replace(scene, edges_hz=()), {**_TOO_WEAK, "repetitions": 2}),
        Cause.LEFT_BEHIND,
    )
    return pulls


def _limits(seed: int, folder: Path, scene: SpinScene, changes: dict[str, Any]) -> Limits:
    """Return the limits of a run."""
    run = acquire_mock("limit", seed, folder, SpinWorld(scene, VirtualClock()), {"hold_s": 1.0, **changes})
    analysis = ANALYSES["limit"]
    found: Limits
    (found,) = analysis.analyze([run.folder]).groups
    return found


def _check_causes(name: str, found: Limits, truth: Cause) -> None:
    wrong = {cause: n for cause, n in found.causes.items() if cause != truth}
    if wrong or not found.causes:
        raise TrialFailed(f"{name}: causes {found.causes}, {truth} is true")


SUBJECT = Subject(
    "limit",
    "lower and upper limits of ten tops each, by a drive that creeps and one that the top triggers; causes of losses",
    trial,
    freedom=TOPS - 1,
)
