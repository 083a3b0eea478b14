"""A record of the tape's light: frequency and chirp, by the pulses of some tenths of a second to some seconds."""

import math
from pathlib import Path

import numpy as np

from analysis.arrays import Array
from instruments.clock import VirtualClock
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.priors import drawing
from levilab.crosscheck.subject import Pull, Subject, TrialFailed, pull_of
from levilab.pipelines.catalogue import ANALYSES
from levilab.runs.waveforms import run_waveforms
from levilab.simulator.laws import LAWS
from levilab.world.light import Tape
from levilab.world.spin_world import SpinScene, SpinWorld

#: The chirp's truth is a difference over twice this [s].
_APART_S = 0.05


class _Watched(SpinWorld):
    """A world that remembers at which of its times the oscilloscope looked: step count → time of the first sample."""

    def __init__(self, scene: SpinScene) -> None:
        super().__init__(scene, VirtualClock())
        self.looks: dict[int, float] = {}

    def light(self, start: float, step: float, n: int) -> Array:
        """See SpinWorld."""
        self.looks[n] = start
        return super().light(start, step, n)


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one record."""
    random = np.random.default_rng((seed, 5))
    draw = drawing("spin", random)
    law = sorted(LAWS)[int(random.integers(len(LAWS)))]
    scene = SpinScene(
        start_hz=draw("spin"),
        drag=law,
        constants=tuple(constant * draw("drag") for constant in LAWS[law].usual),
        fall_hz=20.0,
        tape=Tape(width=draw("width of the tape"), noise=draw("noise of the light")),
        jitter=draw("scatter of the pulses"),
        seed=seed,
    )
    world = _Watched(scene)
    duration = draw("length")
    settings = {"records": 1, "duration_s": duration, "points": round(20_000 * duration)}
    run = acquire_mock("trace", seed, folder, world, settings)
    (record,) = run_waveforms(run)
    start = world.looks.get(record.count)
    if start is None:
        raise TrialFailed("the oscilloscope took its record in several pieces: its time is not known")
    analysis = ANALYSES["spin"]
    (found,) = analysis.analyze([run.folder]).runs
    # the run's time counts from its own zero; the record has the same first sample in both
    moment = found.spin.reference_time - record.start + start
    before, here, after = world.motion(moment + np.array([-_APART_S, 0.0, _APART_S]))[0] / (2 * math.pi)
    return [
        pull_of("frequency", found.spin.frequency, float(here)),
        pull_of("chirp", found.spin.chirp, float(after - before) / (2 * _APART_S)),
    ]


SUBJECT = Subject("spin", "a record of the light of a top that slows down: frequency and chirp", trial)
