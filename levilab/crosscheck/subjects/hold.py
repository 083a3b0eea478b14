"""A top that only spins, held by a drive that it triggers: the drag that the amplitude balances."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from instruments.clock import VirtualClock
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.priors import drawing
from levilab.crosscheck.subject import Pull, Subject, pull_of
from levilab.crosscheck.subjects.spindown import draw_scene
from levilab.pipelines.catalogue import ANALYSES
from levilab.simulator.spin import DECAYS
from levilab.world.spin_world import SpinWorld

#: The time for which a spin is held [s].
_HELD_S = 100.0


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one held spin; the truth is the drag of the world's law at the mean of the readings."""
    scene = replace(draw_scene(seed), fall_hz=21.4)
    spin = drawing("hold", np.random.default_rng((seed, 25)))("spin")
    settings = {"drive_frequency_hz": spin, "longest_s": _HELD_S}
    run = acquire_mock("hold", seed, folder, SpinWorld(scene, VirtualClock()), settings)
    analysis = ANALYSES["hold"]
    (found,) = analysis.analyze([run.folder]).runs
    held = found.spin.value or 0.0
    return [pull_of("drag", found.drag, held * DECAYS[scene.drag].damping(2 * math.pi * held, *scene.constants))]


SUBJECT = Subject("hold", "a spin held by a drive that the top triggers: the drag by the amplitude", trial, trials=100)
