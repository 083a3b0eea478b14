"""A top that only spins, held by a drive that it triggers: the drag that the amplitude balances."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from levilab.acquisition.loop import AcquisitionRequest
from levilab.acquisition.table import settings_of
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.priors import drawing
from levilab.crosscheck.subject import Pull, Subject, pull_of
from levilab.crosscheck.subjects.spindown import draw_scene, in_world
from levilab.pipelines.catalogue import ANALYSES
from levilab.simulator.spin import DECAYS

#: The time for which a spin is held [s].
_HELD_S = 100.0


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one held spin; the truth is the drag of the world's law at the mean of the readings."""
    scene = replace(draw_scene(seed), fall_hz=21.4)
    spin = drawing("hold", np.random.default_rng((seed, 25)))("spin")

    def change(request: AcquisitionRequest) -> AcquisitionRequest:
        settings = settings_of(request.config, "hold")
        settings = settings.model_copy(update={"drive_frequency_hz": spin, "longest_s": _HELD_S})
        return in_world(replace(request, config=request.config.model_copy(update={"hold": settings})), scene)

    run = acquire_mock("hold", seed, folder, change)
    analysis = ANALYSES["hold"]
    (found,) = analysis.analyze([run.folder], analysis.options_from({})).runs
    held = found.spin.value or 0.0
    return [pull_of("drag", found.drag, held * DECAYS[scene.drag].damping(2 * math.pi * held, *scene.constants))]


SUBJECT = Subject("hold", "a spin held by a drive that the top triggers: the drag by the amplitude", trial, trials=100)
